/* How often this process was forked from one that had used the library. */
#ifndef SS_BASE_PROCESS_H
#define SS_BASE_PROCESS_H

#include <stdbool.h>

void ss_process_watch(void);           /* call once before the first handle is made; cheap again */
unsigned ss_process_generation(void);  /* grows in every child */
static inline bool ss_process_forked(void) { return ss_process_generation() > 0; }

#endif
