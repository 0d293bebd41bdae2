#include "coverage/group.h"

#include "base/cpu.h"
#include "config.h"

const ss_group_kernel *ss_group_kernels_here(void) {
#ifdef SS_HAVE_X86
    switch (ss_cpu_rung()) {
    case SS_AVX512:
        return &ss_group_avx512;
    case SS_AVX2:
        return &ss_group_avx2;
    default:
        break;
    }
#endif
    return &ss_group_scalar;
}
