#include "base/fpu.h"

#if defined(__x86_64__)
#include <xmmintrin.h>
#define DEFAULT_MXCSR 0x1f80u /* all traps masked, round to nearest, denormals kept */
#define FLUSH 0x8040u         /* FTZ | DAZ */
#endif

void ss_fpu_enter(ss_fpu *saved) {
    fegetenv(&saved->environment);
    fesetenv(FE_DFL_ENV);
#if defined(__x86_64__)
    _mm_setcsr(DEFAULT_MXCSR);
#endif
}

void ss_fpu_leave(const ss_fpu *saved) { fesetenv(&saved->environment); }

unsigned ss_fpu_flush_denormals(void) {
#if defined(__x86_64__)
    const unsigned saved = _mm_getcsr();
    _mm_setcsr(saved | FLUSH);
    return saved;
#else
    return 0;
#endif
}

void ss_fpu_restore_denormals(unsigned saved) {
#if defined(__x86_64__)
    _mm_setcsr(saved);
#else
    (void)saved;
#endif
}
