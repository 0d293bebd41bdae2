/* The CPU backend: corners are projected once, triangles sorted into bands of rows, bands drawn by any
 * thread. A band is drawn in the triangles' order, so the result does not depend on the threads. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"
#include "raster/cpu/bins.h"
#include "raster/cpu/clip.h"
#include "raster/raster.h"

#define GRAIN 8192

/* A vertex in map coordinates; x is NaN where only clipping helps. */
typedef struct projected {
    float x, y, h;
} projected;

typedef struct drawing {
    const ss_raster_casters *casters;
    projected *vertex;
    ss_bins bins;
    bool mirrored; /* does the light see X, Y mirrored? */
    const float *above;
    float *plane;
} drawing;

static softshadow_status project(void *ctx, uint64_t begin, uint64_t end) {
    const drawing *d = ctx;
    const ss_frame frame = *d->casters->frame;
    for (uint64_t v = begin; v < end; v++) {
        const float *f = d->casters->world->vertices + 3 * v;
        const double p[3] = {f[0], f[1], f[2]};
        double at[3];
        const bool seen = ss_frame_project(&frame, p, at) && fabs(at[0]) < SS_GUARD && fabs(at[1]) < SS_GUARD;
        if (seen) d->vertex[v] = (projected){(float)at[0], (float)at[1], (float)at[2]};
        else d->vertex[v] = (projected){NAN, NAN, NAN};
    }
    return SOFTSHADOW_OK;
}

/* The corners to draw: three as they are, or what clipping leaves. */
static inline int corners_of(const drawing *d, size_t t, ss_scan_corner corner[SS_CLIP_MOST]) {
    const ss_world *world = d->casters->world;
    const uint32_t *index = world->indices + 3 * t;
    bool plain = true;
    for (int i = 0; i < 3; i++) {
        const projected *p = &d->vertex[index[i]];
        plain &= p->x == p->x;
        corner[i] = (ss_scan_corner){p->x, p->y, {p->h}};
    }
    if (plain) return 3;
    double local[3][3];
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) local[i][k] = world->vertices[3 * (size_t)index[i] + (size_t)k];
    }
    return ss_clip_caster(d->casters->frame, local, corner);
}

typedef struct flat_box {
    double low[3], high[2]; /* x, y, h; h's highest does not matter */
} flat_box;

/* Not fmin and fmax: those are calls, and this runs for every triangle. */
static inline double less(double a, double b) { return a < b ? a : b; }
static inline double more(double a, double b) { return a > b ? a : b; }

static inline flat_box box_of(const ss_scan_corner *corner, int n) {
    flat_box b = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    for (int i = 0; i < n; i++) {
        b.low[0] = less(b.low[0], corner[i].x), b.high[0] = more(b.high[0], corner[i].x);
        b.low[1] = less(b.low[1], corner[i].y), b.high[1] = more(b.high[1], corner[i].y);
        b.low[2] = less(b.low[2], corner[i].attribute[0]);
    }
    return b;
}

/* Rows within half a texel of the box, which is more than snapping moves it. */
static bool rows_of_box(const double low[2], const double high[2], uint32_t resolution, int32_t *first,
                        int32_t *last) {
    const double most = resolution;
    if (!(high[0] > -0.5 && high[1] > -0.5 && low[0] < most + 0.5 && low[1] < most + 0.5)) return false;
    *first = low[1] < 1 ? 0 : (int32_t)(low[1] - 0.5);
    *last = high[1] + 0.5 > most - 1 ? (int32_t)resolution - 1 : (int32_t)(high[1] + 0.5);
    return *first <= *last;
}

static bool caster_rows(const void *ctx, size_t t, int32_t *first, int32_t *last) {
    const drawing *d = ctx;
    const ss_raster_casters *c = d->casters;
    ss_scan_corner corner[SS_CLIP_MOST];
    const int n = corners_of(d, t, corner);
    if (n == 0) return false;
    const flat_box b = box_of(corner, n);
    if (b.low[2] > c->deepest) return false;
    if (c->held && !c->held[t]) {
        const double far = ss_frame_rate(c->frame) * (c->deepest - b.low[2]) + 1, most = c->resolution;
        c->held[t] = b.high[0] > -far && b.high[1] > -far && b.low[0] < most + far && b.low[1] < most + far;
    }
    return rows_of_box(b.low, b.high, c->resolution, first, last);
}

/* ---- triangles with holes ------------------------------------------------------------------- */

typedef struct holes {
    const ss_world *world;
    const ss_frame *frame;
    uint32_t triangle;
    const ss_scan_corner *corner;
    double uv[3][2]; /* weights of the triangle's 2nd and 3rd vertex at the corners */
} holes;

/* Weights in the map to weights on the triangle: 1 / distance is what is linear in the map. */
static bool keep(void *ctx, const double weight[3]) {
    const holes *h = ctx;
    double sum = 0, u = 0, v = 0;
    for (int i = 0; i < 3; i++) {
        const double s = weight[i] * (1 - h->corner[i].attribute[0] * h->frame->inverse);
        sum += s, u += s * h->uv[i][0], v += s * h->uv[i][1];
    }
    return ss_world_opaque_at(h->world, h->triangle, u / sum, v / sum);
}

static bool has_holes(const ss_world *world, size_t t) {
    return world->any_opacity && ss_world_mesh_of(world, (uint32_t)t)->source->opacity.texels;
}

/* ---- bands ---------------------------------------------------------------------------------- */

static float bias_of(const drawing *d, const ss_scan *scan) {
    const ss_raster_casters *c = d->casters;
    if (!(c->slope_texels > 0)) return 0;
    const double steep = c->steepest * c->frame->texel;
    const double x = less(fabs((double)scan->step_x[0]), steep);
    const double y = less(fabs((double)scan->step_y[0]), steep);
    return (float)(c->slope_texels * (x + y));
}

static void draw_part(const drawing *d, size_t t, const ss_scan_corner corner[3], bool clipped,
                      int32_t first, int32_t last) {
    const ss_raster_casters *c = d->casters;
    ss_scan scan;
    if (!ss_scan_snap(&scan, corner, c->resolution)) return;
    if (scan.last_y < first || scan.first_y > last) return;
    if (c->front_only && (ss_scan_area(&scan) > 0) == d->mirrored) return;
    ss_scan_gradients(&scan, corner, 1);
    const float bias = bias_of(d, &scan);
    if (has_holes(c->world, t) && !clipped) {
        holes h = {c->world, c->frame, (uint32_t)t, corner, {{0, 0}, {1, 0}, {0, 1}}};
        ss_scan_masked(&scan, first, last, c->resolution, bias, d->above, d->plane, keep, &h);
    } else if (d->above) {
        ss_scan_peel(&scan, first, last, c->resolution, bias, d->above, d->plane);
    } else {
        ss_scan_depth(&scan, first, last, c->resolution, bias, d->plane);
    }
}

static softshadow_status draw_bands(void *ctx, uint64_t begin, uint64_t end) {
    const drawing *d = ctx;
    const uint32_t n = d->casters->resolution;
    for (uint64_t band = begin; band < end; band++) {
        const int32_t first = (int32_t)band * SS_BAND;
        const int32_t last = first + SS_BAND < (int32_t)n ? first + SS_BAND - 1 : (int32_t)n - 1;
        float *row = d->plane + (size_t)first * n;
        for (size_t i = 0; i < (size_t)(last - first + 1) * n; i++) row[i] = SS_MAP_FAR;
        for (uint32_t i = d->bins.first[band]; i < d->bins.first[band + 1]; i++) {
            const uint32_t t = d->bins.item[i];
            ss_scan_corner corner[SS_CLIP_MOST];
            const int count = corners_of(d, t, corner);
            for (int k = 2; k < count; k++) {
                const ss_scan_corner part[3] = {corner[0], corner[k - 1], corner[k]};
                draw_part(d, t, part, count > 3, first, last);
            }
        }
    }
    return SOFTSHADOW_OK;
}

static softshadow_status draw_casters(const ss_raster_casters *casters, const float *above,
                                      float *plane, ss_pool *pool) {
    const ss_world *world = casters->world;
    drawing d = {.casters = casters, .above = above, .plane = plane,
                 .mirrored = ss_frame_mirrored(casters->frame)};
    d.vertex = ss_alloc(world->vertex_count, sizeof *d.vertex);
    if (!d.vertex) {
        return ss_fail(SOFTSHADOW_E_MEMORY, "map: out of memory for %zu vertices", world->vertex_count);
    }
    softshadow_status status = ss_parallel_for(pool, world->vertex_count, GRAIN, project, &d);
    if (!status) {
        status = ss_bins_build(&d.bins, world->triangle_count, casters->resolution, caster_rows, &d, pool);
    }
    if (!status) status = ss_parallel_for(pool, d.bins.bands, 1, draw_bands, &d);
    ss_bins_free(&d.bins);
    ss_free(d.vertex);
    return status;
}

static softshadow_status depth(const ss_raster_casters *casters, float *plane, ss_pool *pool) {
    return draw_casters(casters, NULL, plane, pool);
}

static softshadow_status peel(const ss_raster_casters *casters, const float *above, float *plane,
                              ss_pool *pool) {
    return draw_casters(casters, above, plane, pool);
}

/* ---- the techniques' own triangles ---------------------------------------------------------- */

typedef struct sketch {
    const ss_raster_triangle *triangles;
    uint32_t used, resolution;
    ss_raster_shade *shade;
    void *ctx;
    ss_bins bins;
} sketch;

static int sketch_corners(const sketch *s, size_t i, ss_scan_corner corner[SS_CLIP_MOST]) {
    const ss_raster_triangle *t = &s->triangles[i];
    bool far = false;
    for (int k = 0; k < 3; k++) {
        corner[k].x = t->corner[k][0], corner[k].y = t->corner[k][1];
        memcpy(corner[k].attribute, t->attribute[k], sizeof t->attribute[k]);
        if (!isfinite(corner[k].x) || !isfinite(corner[k].y)) return 0;
        far |= fabs(corner[k].x) >= SS_GUARD || fabs(corner[k].y) >= SS_GUARD;
    }
    return far ? ss_clip_guard(corner, 3, s->used) : 3;
}

static bool sketch_rows(const void *ctx, size_t i, int32_t *first, int32_t *last) {
    const sketch *s = ctx;
    ss_scan_corner corner[SS_CLIP_MOST];
    const int n = sketch_corners(s, i, corner);
    if (n == 0) return false;
    const flat_box b = box_of(corner, n);
    return rows_of_box(b.low, b.high, s->resolution, first, last);
}

static softshadow_status sketch_bands(void *ctx, uint64_t begin, uint64_t end) {
    const sketch *s = ctx;
    for (uint64_t band = begin; band < end; band++) {
        const int32_t first = (int32_t)band * SS_BAND;
        for (uint32_t i = s->bins.first[band]; i < s->bins.first[band + 1]; i++) {
            const uint32_t t = s->bins.item[i];
            ss_scan_corner corner[SS_CLIP_MOST];
            const int count = sketch_corners(s, t, corner);
            for (int k = 2; k < count; k++) {
                const ss_scan_corner part[3] = {corner[0], corner[k - 1], corner[k]};
                ss_scan scan;
                if (!ss_scan_snap(&scan, part, s->resolution)) continue;
                ss_scan_gradients(&scan, part, s->used);
                ss_scan_runs(&scan, first, first + SS_BAND - 1, s->used, s->triangles[t].tag, s->shade,
                             s->ctx);
            }
        }
    }
    return SOFTSHADOW_OK;
}

static softshadow_status draw(const ss_raster_triangle *triangles, size_t count, uint32_t used,
                              uint32_t resolution, ss_raster_shade *shade, void *ctx, ss_pool *pool) {
    sketch s = {.triangles = triangles, .used = used, .resolution = resolution, .shade = shade, .ctx = ctx};
    softshadow_status status = ss_bins_build(&s.bins, count, resolution, sketch_rows, &s, pool);
    if (!status) status = ss_parallel_for(pool, s.bins.bands, 1, sketch_bands, &s);
    ss_bins_free(&s.bins);
    return status;
}

const ss_raster ss_raster_cpu = {.name = "cpu", .depth = depth, .peel = peel, .draw = draw};
