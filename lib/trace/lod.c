#include "trace/lod.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"

#define PADDING 4     /* floats that may be read behind the last vertex, as in ss_world */
#define DEVIATIONS 4  /* of RMS distance: what a level is taken to be off by */
/* A second level of a scene with fewer triangles saves nothing, as the first is quick to walk: of
 * the dragon with 48,000 that of 712 makes the RMS error at 1/64 .0162 in place of .0098 (medium
 * light). */
#define FEWEST 1024

/* Level k of a mesh, or the coarsest it has; NULL: the mesh itself. */
static const ss_level *level_of(const ss_mesh_levels *mesh, uint32_t k) {
    return mesh->count == 0 ? NULL : &mesh->level[k < mesh->count ? k : mesh->count - 1];
}

static size_t vertices_of(const ss_world *world, uint32_t m) {
    return world->meshes[m].source->vertex_count;
}

static size_t triangles_of(const ss_world *world, const ss_levels *levels, uint32_t k) {
    size_t sum = 0;
    for (uint32_t m = 0; m < world->mesh_count; m++) {
        const ss_level *level = level_of(&levels->meshes[m], k);
        sum += level ? level->triangle_count : world->meshes[m].source->triangle_count;
    }
    return sum;
}

static bool reserve(ss_world *coarse, const ss_world *world, const ss_levels *levels, uint32_t k) {
    for (uint32_t m = 0; m < world->mesh_count; m++) {
        const ss_level *level = level_of(&levels->meshes[m], k);
        coarse->vertex_count += level ? level->vertex_count : vertices_of(world, m);
    }
    coarse->triangle_count = triangles_of(world, levels, k);
    coarse->mesh_count = world->mesh_count;
    coarse->vertices = ss_alloc(3 * coarse->vertex_count + PADDING, sizeof(float));
    coarse->indices = ss_alloc(3 * coarse->triangle_count, sizeof(uint32_t));
    coarse->meshes = ss_alloc(coarse->mesh_count, sizeof(ss_world_mesh));
    return coarse->vertices && coarse->indices && coarse->meshes;
}

static void fill(ss_world *coarse, const ss_world *world, const ss_levels *levels, uint32_t k) {
    uint32_t vertex = 0, triangle = 0;
    for (uint32_t m = 0; m < world->mesh_count; m++) {
        const ss_world_mesh *mesh = &world->meshes[m];
        const ss_level *level = level_of(&levels->meshes[m], k);
        const size_t vertices = level ? level->vertex_count : vertices_of(world, m);
        const size_t triangles = level ? level->triangle_count : mesh->source->triangle_count;
        const float *from =
            level ? level->vertices : world->vertices + 3 * (size_t)mesh->first_vertex;
        const uint32_t *index =
            level ? level->indices : world->indices + 3 * (size_t)mesh->first_triangle;
        const uint32_t base = level ? 0 : mesh->first_vertex;
        coarse->meshes[m] = (ss_world_mesh){mesh->source, mesh->id, triangle, vertex};
        memcpy(coarse->vertices + 3 * (size_t)vertex, from, vertices * 3 * sizeof(float));
        for (size_t i = 0; i < 3 * triangles; i++) {
            coarse->indices[3 * (size_t)triangle + i] = index[i] - base + vertex;
        }
        vertex += (uint32_t)vertices, triangle += (uint32_t)triangles;
    }
}

static void measure(ss_world *coarse) {
    for (int k = 0; k < 3; k++) coarse->bounds[k] = INFINITY, coarse->bounds[3 + k] = -INFINITY;
    for (size_t i = 0; i < 3 * coarse->triangle_count; i++) {
        const float *at = coarse->vertices + 3 * (size_t)coarse->indices[i];
        for (int k = 0; k < 3; k++) {
            coarse->bounds[k] = fminf(coarse->bounds[k], at[k]);
            coarse->bounds[3 + k] = fmaxf(coarse->bounds[3 + k], at[k]);
        }
    }
    for (int i = 0; i < 6; i++) coarse->extent = fmax(coarse->extent, fabsf(coarse->bounds[i]));
}

static softshadow_status make_level(ss_lod_level *out, const ss_world *world,
                                    const ss_levels *levels, uint32_t k, ss_pool *pool) {
    ss_world *coarse = ss_alloc(1, sizeof *coarse);
    if (!coarse) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for a coarser scene");
    out->world = coarse;
    memcpy(coarse->low, world->low, sizeof coarse->low);
    memcpy(coarse->half, world->half, sizeof coarse->half);
    coarse->scale = world->scale, coarse->any_opacity = world->any_opacity;
    if (!reserve(coarse, world, levels, k)) {
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for a coarser scene of %zu triangles",
                       coarse->triangle_count);
    }
    fill(coarse, world, levels, k);
    measure(coarse);
    for (uint32_t m = 0; m < world->mesh_count; m++) {
        const ss_level *level = level_of(&levels->meshes[m], k);
        if (!level) continue;
        out->deviation = fmax(out->deviation, DEVIATIONS * level->deviation_rms);
        out->deviation_max = fmax(out->deviation_max, level->deviation_max);
    }
    return ss_bvh_build(&out->bvh, coarse, pool, NULL);
}

softshadow_status ss_lod_create(ss_lod **out, const ss_world *world, const ss_levels *levels,
                                ss_pool *pool) {
    *out = NULL;
    ss_lod *lod = ss_alloc(1, sizeof *lod);
    if (!lod) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for coarser scenes");
    for (uint32_t m = 0; m < levels->mesh_count; m++) {
        if (levels->meshes[m].count > lod->count) lod->count = levels->meshes[m].count;
    }
    for (uint32_t k = 1; k < lod->count; k++) {
        if (triangles_of(world, levels, k) < FEWEST) lod->count = k;
    }
    for (uint32_t k = 0; k < lod->count; k++) {
        const softshadow_status status = make_level(&lod->level[k], world, levels, k, pool);
        if (!status) continue;
        ss_lod_destroy(lod);
        return status;
    }
    *out = lod;
    return SOFTSHADOW_OK;
}

void ss_lod_destroy(ss_lod *lod) {
    if (!lod) return;
    for (uint32_t k = 0; k < SS_LEVELS_MOST; k++) {
        ss_bvh_destroy(lod->level[k].bvh);
        ss_world_destroy(lod->level[k].world);
    }
    ss_free(lod);
}

size_t ss_lod_bytes(const ss_lod *lod) {
    size_t bytes = 0;
    for (uint32_t k = 0; k < lod->count; k++) {
        const ss_world *world = lod->level[k].world;
        bytes +=
            12 * (world->vertex_count + world->triangle_count) + ss_bvh_bytes(lod->level[k].bvh);
    }
    return bytes;
}

uint64_t ss_lod_triangles(const ss_lod *lod) {
    uint64_t triangles = 0;
    for (uint32_t k = 0; k < lod->count; k++) triangles += lod->level[k].world->triangle_count;
    return triangles;
}

softshadow_status ss_lod_light_create(ss_lod_light **out, const ss_lod *lod,
                                      ss_topology *const topology[SS_LEVELS_MOST],
                                      const ss_light *light, ss_pool *pool) {
    *out = NULL;
    ss_lod_light *l = ss_alloc(1, sizeof *l);
    if (!l) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for coarser scenes");
    l->lod = lod;
    for (uint32_t k = 0; k < lod->count; k++) {
        const softshadow_status status = ss_outline_build(&l->outline[k], lod->level[k].bvh,
                                                          topology[k], NULL, light, pool);
        if (!status) continue;
        ss_lod_light_destroy(l);
        return status;
    }
    *out = l;
    return SOFTSHADOW_OK;
}

void ss_lod_light_destroy(ss_lod_light *light) {
    if (!light) return;
    for (uint32_t k = 0; k < SS_LEVELS_MOST; k++) ss_outline_destroy(light->outline[k]);
    ss_free(light);
}

size_t ss_lod_light_bytes(const ss_lod_light *light) {
    size_t bytes = sizeof *light;
    for (uint32_t k = 0; k < light->lod->count; k++) bytes += ss_outline_bytes(light->outline[k]);
    return bytes;
}
