/* Weld, collapse edges by a factor of four three times, and measure how far each result strays.
 *
 * Fins, triangles back to back, would hold on to every edge that they stand on: the surface is made
 * coarser without them, and a level has those that it does not come near. */
#include "topology/decimate.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"
#include "topology/closest.h"
#include "topology/edges.h"
#include "topology/fins.h"
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

#define MOST_FINS 8     /* a share of all triangles: more are no accident, and stay where they are */

/* Compact welded triangles, and behind them those of fins with the vertices that only they have. */
typedef struct welded {
    float *vertices;
    uint32_t *triangles;
    size_t vertex_count, triangle_count, fin_count, all_vertices;
} welded;

static softshadow_status no_memory(size_t triangles) {
    return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for coarser levels of %zu triangles",
                   triangles);
}

static void float_place(const void *ctx, size_t i, double out[3]) {
    const float *vertex = (const float *)ctx + 3 * i;
    for (int k = 0; k < 3; k++) out[k] = vertex[k];
}

static void gather(welded *w, const ss_corners *corners) {
    for (size_t t = 0; t < corners->triangle_count; t++) {
        uint32_t *c = w->triangles + 3 * w->triangle_count;
        ss_corners_of(corners, t, c);
        if (!ss_corners_degenerate(c)) w->triangle_count++;
    }
}

/* Numbers vertices by first use, which keeps neighbours together. Gives how many there are then. */
static size_t compact(welded *w, const float *vertices, size_t first, size_t last, uint32_t *number,
                      size_t count) {
    for (size_t i = 3 * first; i < 3 * last; i++) {
        const uint32_t v = w->triangles[i];
        if (number[v] == 0) {
            memcpy(w->vertices + 3 * count, vertices + 3 * (size_t)v, sizeof(float[3]));
            number[v] = (uint32_t)++count;
        }
        w->triangles[i] = number[v] - 1;
    }
    return count;
}

static softshadow_status part_fins(welded *w, size_t vertex_count) {
    const size_t all = w->triangle_count;
    size_t others;
    const softshadow_status status = ss_fins_last(w->triangles, all, vertex_count, &others);
    if (status || (all - others) * MOST_FINS > all) return status;
    w->triangle_count = others, w->fin_count = all - others;
    return SOFTSHADOW_OK;
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
        gather(w, &corners);
        status = part_fins(w, vertex_count);
    }
    if (status == SOFTSHADOW_OK) {
        const size_t all = w->triangle_count + w->fin_count;
        w->vertex_count = compact(w, vertices, 0, w->triangle_count, number, 0);
        w->all_vertices = compact(w, vertices, w->triangle_count, all, number, w->vertex_count);
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

static void sort3(uint32_t c[3]) {
    for (int i = 0; i < 3; i++) {
        const uint32_t low = c[i % 2], high = c[i % 2 + 1];
        if (low > high) c[i % 2] = high, c[i % 2 + 1] = low;
    }
}

/* Of a triangle: the farthest of its corners and of the middles of its sides and its own. The same
 * bits for both that are back to back. */
static double fin_distance2(const measure *m, const uint32_t *corners) {
    static const float at[7][3] = {{1, 0, 0},     {0, 1, 0},     {0, 0, 1},      {.5f, .5f, 0},
                                   {.5f, 0, .5f}, {0, .5f, .5f}, {1 / 3.f, 1 / 3.f, 1 / 3.f}};
    uint32_t c[3] = {corners[0], corners[1], corners[2]};
    double most = 0;
    sort3(c);
    for (int i = 0; i < 7; i++) {
        float p[3] = {0, 0, 0};
        for (int corner = 0; corner < 3; corner++) {
            const float *v = m->from->vertices + 3 * (size_t)c[corner];
            for (int k = 0; k < 3; k++) p[k] += at[i][corner] * v[k];
        }
        uint32_t hint = SS_NO_HINT;
        const double distance2 = ss_closest_distance2(m->closest, p, INFINITY, &hint);
        if (distance2 > most) most = distance2;
    }
    return most;
}

/* Those that stray farther than the level does; *sum of the others' squares. */
static size_t choose_fins(const measure *m, double most, uint32_t *kept, double *sum) {
    const welded *from = m->from;
    size_t count = 0;
    for (size_t i = 0; i < from->fin_count; i++) {
        const uint32_t *c = from->triangles + 3 * (from->triangle_count + i);
        const double distance2 = fin_distance2(m, c);
        if (distance2 <= most) *sum += distance2;
        else memcpy(kept + 3 * count++, c, sizeof(uint32_t[3]));
    }
    return count;
}

static void copy_fins(ss_level *level, const welded *from, const uint32_t *kept, size_t count,
                      uint32_t *number) {
    for (size_t i = 0; i < 3 * count; i++) {
        uint32_t *v = &number[kept[i]];
        if (*v == 0) {
            memcpy(level->vertices + 3 * level->vertex_count,
                   from->vertices + 3 * (size_t)kept[i], sizeof(float[3]));
            *v = (uint32_t)++level->vertex_count;
        }
        level->indices[3 * level->triangle_count + i] = *v - 1;
    }
    level->triangle_count += count;
}

static softshadow_status add_fins(ss_level *level, const welded *from, const uint32_t *kept,
                                  size_t count) {
    const ss_level before = *level;
    if (count == 0) return SOFTSHADOW_OK;
    uint32_t *number = ss_alloc(from->all_vertices, sizeof *number);
    *level = (ss_level){0};
    const bool fine = number && ss_level_allocate(level, before.vertex_count + 3 * count,
                                                  before.triangle_count + count);
    if (fine) {
        memcpy(level->vertices, before.vertices, before.vertex_count * sizeof(float[3]));
        memcpy(level->indices, before.indices, before.triangle_count * sizeof(uint32_t[3]));
        level->vertex_count = before.vertex_count, level->triangle_count = before.triangle_count;
        copy_fins(level, from, kept, count, number);
    }
    ss_free(before.vertices);
    ss_free(before.indices);
    ss_free(number);
    return fine ? SOFTSHADOW_OK : no_memory(from->triangle_count);
}

static softshadow_status measure_all(measure *m, ss_level *level, ss_pool *pool) {
    const welded *from = m->from;
    uint32_t *kept = ss_alloc(3 * from->fin_count, sizeof *kept);
    m->distance2 = ss_alloc(from->vertex_count, sizeof *m->distance2);
    softshadow_status status =
        kept && m->distance2
            ? ss_parallel_for(pool, from->vertex_count, GRAIN, measure_vertices, m)
            : no_memory(level->triangle_count);
    if (status == SOFTSHADOW_OK) {
        double sum = 0, most = 0;
        for (size_t v = 0; v < from->vertex_count; v++) {
            sum += m->distance2[v];
            if (m->distance2[v] > most) most = m->distance2[v];
        }
        const size_t count = choose_fins(m, most, kept, &sum);
        const size_t measured = from->vertex_count + from->fin_count - count;
        status = add_fins(level, from, kept, count);
        level->deviation_rms = sqrt(sum / (double)measured);
        level->deviation_max = sqrt(most);
    }
    ss_free(kept);
    ss_free(m->distance2);
    return status;
}

static softshadow_status measure_level(ss_level *level, const welded *from,
                                       const ss_simplifier *simplifier, ss_pool *pool) {
    ss_closest *closest;
    softshadow_status status =
        ss_closest_create(&closest, level->vertices, level->indices, level->triangle_count);
    if (status != SOFTSHADOW_OK) return status;
    const ss_level body = *level; /* what is measured: fins are added to it afterwards */
    measure m = {from, &body, simplifier, closest, NULL};
    status = measure_all(&m, level, pool);
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
