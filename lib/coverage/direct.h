/* Segments against triangles one by one, in double: for what the kernels of group.h do not take
 * (points in the light's plane, point lights, opacity tests) and the oracle that tests hold them
 * against. */
#ifndef SS_COVERAGE_DIRECT_H
#define SS_COVERAGE_DIRECT_H

#include <stdbool.h>
#include <stdint.h>

#include "scene/scene.h"

/* Corners relative to the point. */
typedef struct ss_direct {
    double corner[3][3], size; /* the largest number in them */
    uint32_t triangle;
} ss_direct;

void ss_direct_set(ss_direct *direct, const ss_world *world, uint32_t triangle, const double p[3]);

/* Does the triangle block the segment from the point along d, 0 < t < t_end? No segment passes
 * between faces that share an edge or a corner. Where the triangle is opacity-tested, what the
 * texture says there. */
bool ss_direct_blocks(const ss_direct *direct, const ss_world *world, const double d[3],
                      double t_end);

#endif
