/* Which instruction sets may be used: what the machine has, capped by SOFTSHADOW_CPU=scalar|avx2|avx512
 * so that tests can force every rung. Every rung gives the same bits. */
#ifndef SS_BASE_CPU_H
#define SS_BASE_CPU_H

typedef enum ss_rung { SS_SCALAR, SS_AVX2, SS_AVX512 } ss_rung; /* AVX512: F, BW, DQ, VL */

ss_rung ss_cpu_rung(void);
const char *ss_rung_name(ss_rung rung);

#endif
