/* Levels of every mesh: from the cache or made, in a frame of the mesh's own (before its
 * transform), then put where the mesh is in this world. */
#include "topology/levels.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"
#include "topology/cache.h"
#include "topology/decimate.h"

#define FEWEST 2048 /* triangles: with fewer the full mesh is cheap */

/* Positions p of the mesh become (p - low) scale, within [0, 1]. */
typedef struct frame {
    double low[3], scale;
} frame;

typedef struct builder {
    const ss_world *world;
    ss_pool *pool;
    ss_progress *progress;
    ss_levels *out;
    const char *directory;
    const uint32_t *chosen; /* meshes that can have levels */
    bool *cached;           /* per mesh */
} builder;

static bool can_have_levels(const ss_mesh *mesh) {
    return mesh->triangle_count >= FEWEST && mesh->triangle_count <= UINT32_MAX / 3 &&
           mesh->vertex_count < UINT32_MAX && !mesh->opacity.texels;
}

uint64_t ss_levels_work(const ss_world *world) {
    uint64_t work = 0;
    for (uint32_t m = 0; m < world->mesh_count; m++) {
        const ss_mesh *mesh = world->meshes[m].source;
        if (can_have_levels(mesh)) work += mesh->triangle_count;
    }
    return work;
}

/* ---- The mesh's own frame ---- */

/* false: all its vertices are in one place */
static bool find_frame(const ss_mesh *plain, frame *f) {
    double high[3] = {-INFINITY, -INFINITY, -INFINITY}, largest = 0;
    int exponent;
    for (int k = 0; k < 3; k++) f->low[k] = INFINITY;
    for (size_t i = 0; i < 3 * plain->triangle_count; i++) {
        double p[3];
        ss_mesh_vertex(plain, plain->indices[i], p);
        for (int k = 0; k < 3; k++) {
            if (p[k] < f->low[k]) f->low[k] = p[k];
            if (p[k] > high[k]) high[k] = p[k];
        }
    }
    for (int k = 0; k < 3; k++) largest = fmax(largest, high[k] - f->low[k]);
    if (!(largest > 0)) return false;
    frexp(largest, &exponent);
    f->scale = ldexp(1, exponent < -1000 ? 1000 : -exponent);
    return true;
}

static float *frame_vertices(const ss_mesh *plain, const frame *f) {
    float *vertices = ss_alloc(3 * plain->vertex_count, sizeof *vertices);
    for (size_t v = 0; vertices && v < plain->vertex_count; v++) {
        double p[3];
        ss_mesh_vertex(plain, v, p);
        for (int k = 0; k < 3; k++)
            vertices[3 * v + (size_t)k] = (float)((p[k] - f->low[k]) * f->scale);
    }
    return vertices;
}

static ss_cache_key key_of(const ss_mesh *mesh, const float *vertices) {
    ss_cache_key key = {{0}, mesh->vertex_count, mesh->triangle_count};
    ss_hash_add(&key.hash, vertices, 3 * mesh->vertex_count * sizeof *vertices);
    ss_hash_add(&key.hash, mesh->indices, 3 * mesh->triangle_count * sizeof *mesh->indices);
    return key;
}

static softshadow_status make(const builder *b, const ss_mesh *mesh, const float *vertices,
                              ss_mesh_levels *out, bool *cached) {
    ss_cache_key key = {{0}, 0, 0};
    const softshadow_options *host = ss_pool_options(b->pool);
    if (b->directory) {
        key = key_of(mesh, vertices);
        *cached = ss_cache_load(b->directory, &key, out, host);
        if (*cached) return SOFTSHADOW_OK;
    }
    const softshadow_status status = ss_decimate(out, vertices, mesh->vertex_count, mesh->indices,
                                                 mesh->triangle_count, b->pool, b->progress);
    if (status == SOFTSHADOW_OK && b->directory) ss_cache_save(b->directory, &key, out, host);
    return status;
}

/* ---- Into the world ---- */

/* The most that the transform stretches a length, from above: exact where it keeps shapes. */
static double stretch(const ss_mesh *mesh) {
    if (!mesh->transformed) return 1;
    double most = 0;
    for (int i = 0; i < 3; i++) { /* rows of A'A */
        double sum = 0;
        for (int j = 0; j < 3; j++) {
            double dot = 0;
            for (int k = 0; k < 3; k++)
                dot += mesh->transform[4 * k + i] * mesh->transform[4 * k + j];
            sum += fabs(dot);
        }
        most = fmax(most, sum);
    }
    return sqrt(most);
}

static void place_vertex(const ss_world *world, const ss_mesh *mesh, const frame *f, float v[3]) {
    double p[3], host[3], local[3];
    for (int k = 0; k < 3; k++) host[k] = p[k] = f->low[k] + (double)v[k] / f->scale;
    for (int k = 0; k < 3 && mesh->transformed; k++) {
        const double *row = mesh->transform + 4 * k;
        host[k] = row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3];
    }
    ss_world_local(world, host, local);
    for (int k = 0; k < 3; k++) v[k] = (float)local[k];
}

static void place_levels(const ss_world *world, const ss_mesh *mesh, const frame *f,
                         ss_mesh_levels *levels) {
    const double unit = stretch(mesh) / f->scale * world->scale;
    for (uint32_t i = 0; i < levels->count; i++) {
        ss_level *level = &levels->level[i];
        for (size_t v = 0; v < level->vertex_count; v++) {
            place_vertex(world, mesh, f, level->vertices + 3 * v);
        }
        level->deviation_rms *= unit, level->deviation_max *= unit;
    }
}

static softshadow_status build_mesh(const builder *b, uint32_t m) {
    const ss_mesh *mesh = b->world->meshes[m].source;
    ss_mesh plain = *mesh;
    frame f;
    plain.transformed = false;
    if (!find_frame(&plain, &f)) return SOFTSHADOW_OK;
    float *vertices = frame_vertices(&plain, &f);
    if (!vertices) {
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for coarser levels of %zu triangles",
                       mesh->triangle_count);
    }
    const softshadow_status status = make(b, mesh, vertices, &b->out->meshes[m], &b->cached[m]);
    ss_free(vertices);
    if (status != SOFTSHADOW_OK) return status;
    place_levels(b->world, mesh, &f, &b->out->meshes[m]);
    return ss_progress_add(b->progress, mesh->triangle_count);
}

static softshadow_status build_chosen(void *ctx, uint64_t begin, uint64_t end) {
    const builder *b = ctx;
    for (uint64_t i = begin; i < end; i++) {
        const softshadow_status status = build_mesh(b, b->chosen[i]);
        if (status != SOFTSHADOW_OK) return status;
    }
    return SOFTSHADOW_OK;
}

/* Few meshes: one by one, each on all threads. Many: each on one. */
static softshadow_status build_all(builder *b, uint32_t count) {
    if (count < ss_pool_threads(b->pool)) return build_chosen(b, 0, count);
    return ss_parallel_for(b->pool, count, 1, build_chosen, b);
}

static softshadow_status build(builder *b) {
    const uint32_t meshes = b->world->mesh_count;
    uint32_t *chosen = ss_alloc(meshes, sizeof *chosen), count = 0;
    b->out->meshes = ss_alloc(meshes, sizeof *b->out->meshes);
    b->cached = ss_alloc(meshes, sizeof *b->cached);
    softshadow_status status = SOFTSHADOW_OK;
    if (!chosen || !b->out->meshes || !b->cached) {
        status = ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for levels of %u meshes", meshes);
    } else {
        b->out->mesh_count = meshes;
        for (uint32_t m = 0; m < meshes; m++) {
            if (can_have_levels(b->world->meshes[m].source)) chosen[count++] = m;
        }
        b->chosen = chosen;
        status = build_all(b, count);
        for (uint32_t m = 0; m < meshes; m++) {
            b->out->cached += b->cached[m];
            for (uint32_t i = 0; i < b->out->meshes[m].count; i++) {
                b->out->triangle_count += b->out->meshes[m].level[i].triangle_count;
            }
        }
    }
    ss_free(chosen);
    ss_free(b->cached);
    return status;
}

softshadow_status ss_levels_build(const ss_world *world, ss_pool *pool, ss_progress *progress,
                                  ss_levels **out) {
    *out = NULL;
    builder b = {.world = world, .pool = pool, .progress = progress};
    b.directory = ss_cache_directory();
    b.out = ss_alloc(1, sizeof *b.out);
    if (!b.out) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for coarser levels");
    const softshadow_status status = build(&b);
    if (status == SOFTSHADOW_OK)
        *out = b.out;
    else
        ss_levels_destroy(b.out);
    return status;
}

void ss_levels_destroy(ss_levels *levels) {
    if (!levels) return;
    for (uint32_t m = 0; m < levels->mesh_count; m++) ss_mesh_levels_free(&levels->meshes[m]);
    ss_free(levels->meshes);
    ss_free(levels);
}

size_t ss_levels_bytes(const ss_levels *levels) {
    size_t bytes = sizeof *levels + levels->mesh_count * sizeof *levels->meshes;
    for (uint32_t m = 0; m < levels->mesh_count; m++) {
        for (uint32_t i = 0; i < levels->meshes[m].count; i++) {
            const ss_level *level = &levels->meshes[m].level[i];
            bytes += level->vertex_count * sizeof(float[3]) +
                     level->triangle_count * sizeof(uint32_t[3]);
        }
    }
    return bytes;
}
