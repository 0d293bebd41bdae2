/* How far points are from a surface. */
#ifndef SS_TOPOLOGY_CLOSEST_H
#define SS_TOPOLOGY_CLOSEST_H

#include "base/parallel.h"

typedef struct ss_closest ss_closest;

/* Keeps pointers to the arrays (3 numbers each). At least one triangle. */
softshadow_status ss_closest_create(ss_closest **out, const float *vertices,
                                    const uint32_t *triangles, size_t triangle_count);
void ss_closest_destroy(ss_closest *closest);

/* The squared distance from p to the nearest triangle, or `bound` if none is that near. hint: a
 * triangle that may be near (or SS_NO_HINT), replaced by the nearest one; it saves time and changes
 * the answer by rounding only. */
#define SS_NO_HINT UINT32_MAX
double ss_closest_distance2(const ss_closest *closest, const float p[3], double bound,
                            uint32_t *hint);

#endif
