/* The scene at coarser levels, each a world and a BVH of its own in the same local coordinates: what
 * may stand for the casters far enough in front of a group of points. */
#ifndef SS_TRACE_LOD_H
#define SS_TRACE_LOD_H

#include "base/parallel.h"
#include "scene/levels.h"
#include "scene/scene.h"
#include "trace/bvh.h"

typedef struct ss_lod_level {
    ss_world *world;  /* meshes without such a level are in it as fine as they have it */
    ss_bvh *bvh;
    double deviation; /* how far its surface may be from the casters': 4 x the largest RMS distance */
} ss_lod_level;

typedef struct ss_lod {
    ss_lod_level level[SS_LEVELS_MOST]; /* fine to coarse */
    uint32_t count;                     /* 0: no mesh has levels */
} ss_lod;

softshadow_status ss_lod_create(ss_lod **out, const ss_world *world, const ss_levels *levels,
                                ss_pool *pool);
void ss_lod_destroy(ss_lod *lod);
size_t ss_lod_bytes(const ss_lod *lod);
uint64_t ss_lod_triangles(const ss_lod *lod);

#endif
