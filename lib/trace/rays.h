/* Embree: the only file pair that knows it. Reached through dlopen and a table of dlsym'd functions,
 * loaded on first use, so that a host's own Embree never captures our calls. */
#ifndef SS_TRACE_RAYS_H
#define SS_TRACE_RAYS_H

#include "base/parallel.h"
#include "scene/scene.h"

typedef struct ss_rays ss_rays;

softshadow_status ss_rays_create(ss_rays **out, const ss_world *world, ss_pool *pool);
void ss_rays_destroy(ss_rays *rays);
size_t ss_rays_bytes(const ss_rays *rays);

/* Sixteen segments from one origin: origin + t d[lane], 0 < t < t_end. `valid` has a bit per lane.
 * Triangles in `ignored` (few) never occlude. Returns the occluded lanes as bits. */
uint32_t ss_rays_occluded16(const ss_rays *rays, const float origin[3], const float dx[16],
                            const float dy[16], const float dz[16], float t_end, uint32_t valid,
                            const uint32_t *ignored, size_t ignored_count);

#endif
