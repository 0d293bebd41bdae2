/* Our own wide BVH over the world's triangles: for shafts (everything that could be between a box
 * of points and a light) and for the faces near a point. Built once per scene, light-independent;
 * never touches Embree, so `exact` and the maps work where Embree is missing and after fork(). */
#ifndef SS_TRACE_BVH_H
#define SS_TRACE_BVH_H

#include "base/memory.h"
#include "base/parallel.h"
#include "scene/scene.h"

typedef struct ss_bvh ss_bvh;

softshadow_status ss_bvh_build(ss_bvh **out, const ss_world *world, ss_pool *pool,
                               ss_progress *progress);
void ss_bvh_destroy(ss_bvh *bvh);
size_t ss_bvh_bytes(const ss_bvh *bvh);

/* World triangles whose (float) bounding box comes within radius of p along every axis, in
 * ascending order. Returns how many there are, or room + 1 if there are more; stores the first
 * `room` of them. */
size_t ss_bvh_near(const ss_bvh *bvh, const double p[3], double radius, uint32_t *triangles,
                   size_t room);

/* The same for any point of a box, in no order; stops at room + 1. */
size_t ss_bvh_near_box(const ss_bvh *bvh, const double low[3], const double high[3], double radius,
                       uint32_t *triangles, size_t room);

/* Could any triangle touch a segment from a point of the box (low..high, local) to the light? The
 * answer "no" is certain, including every triangle that only touches such a segment's ends or
 * rim. */
bool ss_bvh_shaft_empty(const ss_bvh *bvh, const ss_light *light, const double low[3],
                        const double high[3]);

/* Which triangles could? Stores the first `room` of them that the walk finds; returns how many it
 * found before it gave up, which it does at room + 1. */
size_t ss_bvh_shaft(const ss_bvh *bvh, const ss_light *light, const double low[3],
                    const double high[3], uint32_t *triangles, size_t room);

#endif
