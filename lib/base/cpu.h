/* Which instruction sets may be used: what the machine has, capped by
 * SOFTSHADOW_CPU=scalar|avx2|avx512 so that tests can force every rung. Every rung gives the same
 * bits. */
#ifndef SS_BASE_CPU_H
#define SS_BASE_CPU_H

#include "config.h"

typedef enum ss_rung { SS_SCALAR, SS_AVX2, SS_AVX512 } ss_rung; /* AVX512: F, BW, DQ, VL */

ss_rung ss_cpu_rung(void);
const char *ss_rung_name(ss_rung rung);

/* What a *_kernel.h does, as it is compiled for each rung: files NAME_scalar.c, NAME_avx2.c and
 * NAME_avx512.c define RUNG and include it. SS_RUNGS(f) lists the three of one function. */
#ifdef SS_HAVE_X86
#define SS_RUNGS(f) {f##_scalar, f##_avx2, f##_avx512}
#else
#define SS_RUNGS(f) {f##_scalar, f##_scalar, f##_scalar}
#endif

#endif
