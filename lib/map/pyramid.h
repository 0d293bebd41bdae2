/* The least depth of every square of 2^l x 2^l texels of a map: how near the nearest occluder in a
 * region can be, without looking at all of it. */
#ifndef SS_MAP_PYRAMID_H
#define SS_MAP_PYRAMID_H

#include <stddef.h>

#include "base/parallel.h"

#define SS_PYRAMID_LEVELS 16

typedef struct ss_pyramid {
    const float *level[SS_PYRAMID_LEVELS]; /* 0: the map itself, which must outlive this */
    uint32_t side[SS_PYRAMID_LEVELS];      /* the last is 1 */
    uint32_t levels;
    float *own;
    size_t count; /* floats of `own` */
} ss_pyramid;

softshadow_status ss_pyramid_build(ss_pyramid *out, const float *plane, uint32_t side,
                                   ss_pool *pool);
void ss_pyramid_free(ss_pyramid *pyramid);

/* At most the least depth of the texels low .. high (columns, rows; both inside the map): squares
 * of the pyramid that the box only touches count as well. */
float ss_pyramid_least(const ss_pyramid *pyramid, const int32_t low[2], const int32_t high[2]);

#endif
