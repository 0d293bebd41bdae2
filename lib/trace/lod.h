/* The scene at coarser levels, each a world and a BVH of its own in the same local coordinates:
 * what may stand for the casters far enough in front of a group of points. */
#ifndef SS_TRACE_LOD_H
#define SS_TRACE_LOD_H

#include "base/parallel.h"
#include "scene/connectivity.h"
#include "scene/levels.h"
#include "scene/scene.h"
#include "trace/bvh.h"
#include "trace/outline.h"

typedef struct ss_lod_level {
    ss_world *world;  /* meshes without such a level are in it as fine as they have it */
    ss_bvh *bvh;
    /* How far its surface is from the casters', local units: as good as everywhere, 4 x the RMS
     * distance of the mesh that strays most; and at most, as far as that was measured. */
    double deviation, deviation_max;
} ss_lod_level;

typedef struct ss_lod {
    ss_lod_level level[SS_LEVELS_MOST]; /* fine to coarse */
    uint32_t count;                     /* 0: no mesh has levels */
} ss_lod;

/* Coarser scenes as the techniques of one light draw them. */
typedef struct ss_lod_light {
    const ss_lod *lod;
    ss_outline *outline[SS_LEVELS_MOST]; /* of each level */
} ss_lod_light;

softshadow_status ss_lod_create(ss_lod **out, const ss_world *world, const ss_levels *levels,
                                ss_pool *pool);
void ss_lod_destroy(ss_lod *lod);
size_t ss_lod_bytes(const ss_lod *lod);
uint64_t ss_lod_triangles(const ss_lod *lod);

/* topology: of each level's world. */
softshadow_status ss_lod_light_create(ss_lod_light **out, const ss_lod *lod,
                                      ss_topology *const topology[SS_LEVELS_MOST],
                                      const ss_light *light, ss_pool *pool);
void ss_lod_light_destroy(ss_lod_light *light);
size_t ss_lod_light_bytes(const ss_lod_light *light);

#endif
