#include "base/cpu.h"

#include <stdlib.h>
#include <string.h>


static ss_rung machine(void) {
#ifdef SS_HAVE_X86
    __builtin_cpu_init();
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return SS_SCALAR;
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) {
        return SS_AVX512;
    }
    return SS_AVX2;
#else
    return SS_SCALAR;
#endif
}

static ss_rung cap(void) {
    const char *wish = getenv("SOFTSHADOW_CPU");
    if (!wish) return SS_AVX512;
    if (strcmp(wish, "scalar") == 0) return SS_SCALAR;
    if (strcmp(wish, "avx2") == 0) return SS_AVX2;
    return SS_AVX512;
}

ss_rung ss_cpu_rung(void) {
    const ss_rung has = machine(), may = cap();
    return has < may ? has : may;
}

const char *ss_rung_name(ss_rung rung) {
    return rung == SS_AVX512 ? "avx512" : rung == SS_AVX2 ? "avx2" : "scalar";
}
