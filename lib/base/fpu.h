/* The floating-point mode. Inside: round to nearest, no traps, denormals kept. Outside: the
 * host's. */
#ifndef SS_BASE_FPU_H
#define SS_BASE_FPU_H

#include <fenv.h>

typedef struct ss_fpu {
    fenv_t environment;
} ss_fpu;

void ss_fpu_enter(ss_fpu *saved);
void ss_fpu_leave(const ss_fpu *saved);

/* For code that profits and whose results cannot depend on it: flush denormals (x86), and back. */
unsigned ss_fpu_flush_denormals(void);
void ss_fpu_restore_denormals(unsigned saved);

#endif
