/* Weld, collapse edges by a factor of four three times, and measure how far each result strays. */
#include "topology/decimate.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"
#include "topology/closest.h"
#include "topology/edges.h"
#include "topology/simplify.h"
#include "topology/weld.h"

#define RATIO    4
#define GRAIN    4096 /* vertices a task measures: about 4 ms */
#define MOST_RIM 0.3  /* leaves of two triangles have 0.8, a sheet of n x n squares 1.3 / n */
#define TOO_MANY 1.5  /* times the triangles wanted: such a level is not worth having */
/* A fourth level of fewer triangles saves nothing, as the third is quick to walk: with one of 272
 * the bunny takes as long, and at 1/64 its RMS error grows from .0075 to .0097. */
#define FOURTH   1024
#define PADDING  4    /* floats behind the last vertex */

/* Compact welded triangles. */
typedef struct welded {
    float *vertices;
    uint32_t *triangles;
    size_t vertex_count, triangle_count;
} welded;

static softshadow_status no_memory(size_t triangles) {
    return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for coarser levels of %zu triangles",
                   triangles);
}

static void float_place(const void *ctx, size_t i, double out[3]) {
    const float *vertex = (const float *)ctx + 3 * i;
    for (int k = 0; k < 3; k++) out[k] = vertex[k];
}

/* Numbers welded vertices by first use, which keeps neighbours together. */
static void compact(welded *w, const float *vertices, const ss_corners *corners, uint32_t *number) {
    for (size_t t = 0; t < corners->triangle_count; t++) {
        uint32_t c[3];
        ss_corners_of(corners, t, c);
        if (ss_corners_degenerate(c)) continue;
        for (int k = 0; k < 3; k++) {
            if (number[c[k]] == 0) {
                memcpy(w->vertices + 3 * w->vertex_count, vertices + 3 * (size_t)c[k],
                       sizeof(float[3]));
                number[c[k]] = (uint32_t)++w->vertex_count;
            }
            w->triangles[3 * w->triangle_count + (size_t)k] = number[c[k]] - 1;
        }
        w->triangle_count++;
    }
}

static softshadow_status weld(welded *w, const float *vertices, size_t vertex_count,
                              const uint32_t *indices, size_t triangle_count) {
    uint32_t *same = ss_alloc(vertex_count, sizeof *same);
    uint32_t *number = ss_alloc(vertex_count, sizeof *number);
    w->vertices = ss_alloc(3 * vertex_count, sizeof *w->vertices);
    w->triangles = ss_alloc(3 * triangle_count, sizeof *w->triangles);
    softshadow_status status = SOFTSHADOW_OK;
    if (!same || !number || !w->vertices || !w->triangles) status = no_memory(triangle_count);
    if (status == SOFTSHADOW_OK) status = ss_weld(float_place, vertices, vertex_count, 0, same);
    if (status == SOFTSHADOW_OK) {
        const ss_corners corners = {indices, same, triangle_count, vertex_count};
        compact(w, vertices, &corners, number);
    }
    ss_free(same);
    ss_free(number);
    return status;
}

bool ss_level_allocate(ss_level *level, size_t vertex_count, size_t triangle_count) {
    level->vertices = ss_alloc(3 * vertex_count + PADDING, sizeof *level->vertices);
    level->indices = ss_alloc(3 * triangle_count, sizeof *level->indices);
    level->vertex_count = vertex_count, level->triangle_count = triangle_count;
    return level->vertices && level->indices;
}

void ss_mesh_levels_free(ss_mesh_levels *levels) {
    for (int i = 0; i < SS_LEVELS_MOST; i++) {
        ss_free(levels->level[i].vertices);
        ss_free(levels->level[i].indices);
    }
    *levels = (ss_mesh_levels){0};
}

/* ---- How far a level strays ---- */

typedef struct measure {
    const welded *from;
    const ss_level *to;
    const ss_simplifier *simplifier;
    const ss_closest *closest;
    double *distance2; /* per vertex: summed up in order afterwards, whatever the threads did */
} measure;

static softshadow_status measure_vertices(void *ctx, uint64_t begin, uint64_t end) {
    measure *m = ctx;
    uint32_t hint = SS_NO_HINT;
    for (uint64_t v = begin; v < end; v++) {
        const float *p = m->from->vertices + 3 * v;
        const float *became = m->to->vertices + 3 * (size_t)ss_simplifier_where(m->simplifier, v);
        double bound = 0;
        for (int k = 0; k < 3; k++) {
            const double d = (double)p[k] - became[k];
            bound += d * d;
        }
        m->distance2[v] = ss_closest_distance2(m->closest, p, bound, &hint);
    }
    return SOFTSHADOW_OK;
}

static softshadow_status measure_level(ss_level *level, const welded *from,
                                       const ss_simplifier *simplifier, ss_pool *pool) {
    ss_closest *closest;
    softshadow_status status =
        ss_closest_create(&closest, level->vertices, level->indices, level->triangle_count);
    if (status != SOFTSHADOW_OK) return status;
    measure m = {from, level, simplifier, closest, NULL};
    m.distance2 = ss_alloc(from->vertex_count, sizeof *m.distance2);
    status = m.distance2 ? ss_parallel_for(pool, from->vertex_count, GRAIN, measure_vertices, &m)
                         : no_memory(level->triangle_count);
    if (status == SOFTSHADOW_OK) {
        double sum = 0, most = 0;
        for (size_t v = 0; v < from->vertex_count; v++) {
            sum += m.distance2[v];
            if (m.distance2[v] > most) most = m.distance2[v];
        }
        level->deviation_rms = sqrt(sum / (double)from->vertex_count);
        level->deviation_max = sqrt(most);
    }
    ss_free(m.distance2);
    ss_closest_destroy(closest);
    return status;
}

/* ---- The levels ---- */

static softshadow_status read_level(ss_level *level, const ss_simplifier *s) {
    if (!ss_level_allocate(level, ss_simplifier_vertices(s), ss_simplifier_triangles(s))) {
        return no_memory(ss_simplifier_triangles(s));
    }
    ss_simplifier_read(s, level->vertices, level->indices);
    return SOFTSHADOW_OK;
}

static softshadow_status add_levels(ss_mesh_levels *out, const welded *w, ss_simplifier *s,
                                    ss_pool *pool, ss_progress *progress) {
    size_t target = w->triangle_count;
    if (ss_simplifier_rim(s) > MOST_RIM) return SOFTSHADOW_OK;
    while (out->count < SS_LEVELS_MOST) {
        target /= RATIO;
        if (out->count == 3 && target < FOURTH) break;
        softshadow_status status = ss_simplify(s, target, progress);
        if (status != SOFTSHADOW_OK) return status;
        const size_t got = ss_simplifier_triangles(s);
        if (got == 0 || (double)got > TOO_MANY * (double)target) return SOFTSHADOW_OK;
        ss_level *level = &out->level[out->count++];
        status = read_level(level, s);
        if (status == SOFTSHADOW_OK) status = measure_level(level, w, s, pool);
        if (status != SOFTSHADOW_OK) return status;
    }
    return SOFTSHADOW_OK;
}

softshadow_status ss_decimate(ss_mesh_levels *out, const float *vertices, size_t vertex_count,
                              const uint32_t *indices, size_t triangle_count, ss_pool *pool,
                              ss_progress *progress) {
    *out = (ss_mesh_levels){0};
    welded w = {0};
    ss_simplifier *s = NULL;
    softshadow_status status = weld(&w, vertices, vertex_count, indices, triangle_count);
    if (status == SOFTSHADOW_OK) {
        status = ss_simplifier_create(&s, w.vertices, w.vertex_count, w.triangles, w.triangle_count,
                                      pool);
    }
    if (status == SOFTSHADOW_OK) status = add_levels(out, &w, s, pool, progress);
    if (status != SOFTSHADOW_OK) ss_mesh_levels_free(out);
    ss_simplifier_destroy(s);
    ss_free(w.vertices);
    ss_free(w.triangles);
    return status;
}
