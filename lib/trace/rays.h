/* Embree: the only file pair that knows it. Reached through dlopen and a table of dlsym'd
 * functions, loaded on first use, so that a host's own Embree never captures our calls. */
#ifndef SS_TRACE_RAYS_H
#define SS_TRACE_RAYS_H

#include "base/parallel.h"
#include "scene/scene.h"

typedef struct ss_rays ss_rays;

/* Builds Embree's own tree over the world. Errors: E_BACKEND with the loader's or Embree's words,
 * E_MEMORY, and E_UNSUPPORTED in a child made by fork() and where no thread can be started: there
 * Embree's scheduler hangs or aborts. */
softshadow_status ss_rays_create(ss_rays **out, const ss_world *world, ss_pool *pool);
void ss_rays_destroy(ss_rays *rays);
size_t ss_rays_bytes(const ss_rays *rays);

/* Can this library be used as Embree? ss_rays_create() asks it of the one that configure named. */
softshadow_status ss_rays_load(const char *library);

/* Sixteen segments: origin + t d, t_begin < t < t_end, in local units. Laid out as Embree wants it,
 * so that nothing is copied; `kept` are Embree's. Directions should be of a size near 1. */
typedef struct ss_segments {
    _Alignas(64) float ox[16], oy[16], oz[16], t_begin[16];
    float dx[16], dy[16], dz[16], kept_time[16];
    float t_end[16];
    uint32_t kept[3][16];
} ss_segments;

/* Which of the lanes in `valid` are blocked, as bits. Triangles in `ignored` (few) never block, nor
 * do spots that an opacity texture leaves open. Changes t_end. A lane that is not finite, or 1e18
 * and beyond, is answered "not blocked" (Embree would abort the process). coherent: the lanes pass
 * the same few boxes of the tree; up to 40 % faster if they do, up to 60 % slower if not. */
uint32_t ss_rays_blocked(const ss_rays *rays, ss_segments *segments, uint32_t valid,
                         bool coherent, const uint32_t *ignored, size_t ignored_count);

#endif
