/* Seconds on a clock that never goes back. Only statistics read it: no choice depends on time. */
#ifndef SS_BASE_CLOCK_H
#define SS_BASE_CLOCK_H

double ss_clock(void);

#endif
