/* Coarser stand-ins for the casting meshes, as plain tables that techniques may read. */
#ifndef SS_SCENE_LEVELS_H
#define SS_SCENE_LEVELS_H

#include <stddef.h>
#include <stdint.h>

#define SS_LEVELS_MOST 4

/* A level has about a quarter of the triangles of the one before it (of the mesh itself, for the
 * first). What is closed in the mesh is closed in the level. The level's surface lies on both sides
 * of the mesh's. */
typedef struct ss_level {
    float *vertices;   /* vertex_count x 3, local, padded by 16 bytes */
    uint32_t *indices; /* triangle_count x 3, into this level's vertices */
    size_t vertex_count, triangle_count;
    /* Distances of the mesh's own vertices from the level's surface, local units: root mean square
     * and largest. 4 x RMS is what a depth slab takes for the level's deviation. */
    double deviation_rms, deviation_max;
} ss_level;

typedef struct ss_mesh_levels {
    ss_level level[SS_LEVELS_MOST]; /* fine to coarse */
    uint32_t count;                 /* 0: the mesh is small, has an opacity texture or is a soup */
} ss_mesh_levels;

typedef struct ss_levels {
    ss_mesh_levels *meshes; /* one per world mesh */
    uint32_t mesh_count;
    uint64_t triangle_count; /* of all levels */
    uint32_t cached;         /* meshes whose levels came from the cache on disk */
} ss_levels;

#endif
