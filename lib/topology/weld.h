/* Which vertices are in the same place. */
#ifndef SS_TOPOLOGY_WELD_H
#define SS_TOPOLOGY_WELD_H

#include <stddef.h>
#include <stdint.h>

#include "softshadow.h"

/* Where vertex i is. */
typedef void ss_place(const void *ctx, size_t i, double out[3]);

/* weld[i] = offset + the lowest j whose place equals that of i (numerically: -0 equals 0), for i
 * below count. */
softshadow_status ss_weld(ss_place *place, const void *ctx, size_t count, uint32_t offset,
                          uint32_t *weld);

#endif
