#include "raster/casters.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"

#define GRAIN 8192

static softshadow_status project(void *ctx, uint64_t begin, uint64_t end) {
    const ss_casters *c = ctx;
    const ss_frame frame = *c->asked->frame;
    for (uint64_t v = begin; v < end; v++) {
        const float *f = c->asked->world->vertices + 3 * v;
        const double p[3] = {f[0], f[1], f[2]};
        double at[3];
        const bool seen =
            ss_frame_project(&frame, p, at) && fabs(at[0]) < SS_GUARD && fabs(at[1]) < SS_GUARD;
        if (seen)
            c->vertex[v] = (ss_caster_vertex){(float)at[0], (float)at[1], (float)at[2]};
        else
            c->vertex[v] = (ss_caster_vertex){NAN, NAN, NAN};
    }
    return SOFTSHADOW_OK;
}

softshadow_status ss_casters_project(ss_casters *out, const ss_raster_casters *asked,
                                     ss_pool *pool) {
    const ss_world *world = asked->world;
    *out = (ss_casters){.asked = asked, .mirrored = ss_frame_mirrored(asked->frame)};
    out->vertex = ss_alloc(world->vertex_count, sizeof *out->vertex);
    if (!out->vertex) {
        return ss_fail(SOFTSHADOW_E_MEMORY, "map: out of memory for %zu vertices",
                       world->vertex_count);
    }
    return ss_parallel_for(pool, world->vertex_count, GRAIN, project, out);
}

void ss_casters_free(ss_casters *casters) {
    ss_free(casters->vertex);
    casters->vertex = NULL;
}

/* 1 / distance from the frame's centre, in its own unit: what is linear in the map, as h is. */
static inline double nearness(const ss_frame *frame, double h) { return 1 - h * frame->inverse; }

int ss_casters_corners(const ss_casters *casters, size_t t, ss_scan_corner corner[SS_CLIP_MOST]) {
    const ss_world *world = casters->asked->world;
    const uint32_t *index = world->indices + 3 * t;
    bool plain = true;
    for (int i = 0; i < 3; i++) {
        const ss_caster_vertex *p = &casters->vertex[index[i]];
        plain &= p->x == p->x;
        corner[i] = (ss_scan_corner){p->x, p->y, {p->h}};
    }
    if (plain) {
        for (int k = 1; k < 3; k++) {
            corner[k].attribute[k] = nearness(casters->asked->frame, corner[k].attribute[0]);
        }
        return 3;
    }
    double local[3][3];
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) local[i][k] = world->vertices[3 * (size_t)index[i] + (size_t)k];
    }
    return ss_clip_caster(casters->asked->frame, local, corner);
}

/* ---- which rows ----------------------------------------------------------------------------- */

static inline ss_caster_box box_of(const ss_scan_corner *corner, int n) {
    ss_caster_box b = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    for (int i = 0; i < n; i++) {
        const double at[3] = {corner[i].x, corner[i].y, corner[i].attribute[0]};
        for (int k = 0; k < 3; k++) b.low[k] = ss_scan_less(b.low[k], at[k]);
        for (int k = 0; k < 2; k++) b.high[k] = ss_scan_more(b.high[k], at[k]);
    }
    return b;
}

/* Rows within half a texel of the box, which is more than snapping moves it. */
static bool rows_of_box(const double low[2], const double high[2], uint32_t resolution,
                        int32_t *first, int32_t *last) {
    const double most = resolution;
    if (!(high[0] > -0.5 && high[1] > -0.5 && low[0] < most + 0.5 && low[1] < most + 0.5))
        return false;
    *first = low[1] < 1 ? 0 : (int32_t)(low[1] - 0.5);
    *last = high[1] + 0.5 > most - 1 ? (int32_t)resolution - 1 : (int32_t)(high[1] + 0.5);
    return *first <= *last;
}

bool ss_casters_want(const ss_casters *casters, size_t t, const ss_caster_box *b) {
    const ss_raster_casters *c = casters->asked;
    if (b->low[2] > c->deepest) return false;
    if (c->holes_only && !ss_caster_has_holes(c->world, t)) return false;
    if (c->held && !c->held[t]) {
        const double far = ss_frame_rate(c->frame) * (c->deepest - b->low[2]) + 1,
                     most = c->resolution;
        c->held[t] = b->high[0] > -far && b->high[1] > -far && b->low[0] < most + far &&
                     b->low[1] < most + far;
    }
    return true;
}

bool ss_casters_rows(const ss_casters *casters, size_t t, const ss_scan_corner *corner, int count,
                     int32_t *first, int32_t *last) {
    if (count == 0) return false;
    const ss_caster_box b = box_of(corner, count);
    return ss_casters_want(casters, t, &b) &&
           rows_of_box(b.low, b.high, casters->asked->resolution, first, last);
}

bool ss_scan_corner_rows(const ss_scan_corner *corner, int count, uint32_t resolution,
                         int32_t *first, int32_t *last) {
    if (count == 0) return false;
    const ss_caster_box b = box_of(corner, count);
    return rows_of_box(b.low, b.high, resolution, first, last);
}

/* ---- what is drawn -------------------------------------------------------------------------- */

bool ss_casters_turned(const ss_casters *casters, const ss_scan *scan) {
    return casters->asked->front_only && (ss_scan_area(scan) > 0) == casters->mirrored;
}

float ss_casters_bias(const ss_casters *casters, const ss_scan *scan) {
    const ss_raster_casters *c = casters->asked;
    if (!(c->slope_texels > 0)) return 0;
    const double steep = c->steepest * c->frame->texel;
    const double x = ss_scan_less(fabs((double)scan->step_x[0]), steep);
    const double y = ss_scan_less(fabs((double)scan->step_y[0]), steep);
    return (float)(c->slope_texels * (x + y));
}

bool ss_caster_opaque_at(void *holes, const double weight[3]) {
    const ss_caster_holes *h = holes;
    double sum[SS_CASTER_ATTRIBUTES] = {0};
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < SS_CASTER_ATTRIBUTES; k++) {
            sum[k] += weight[i] * h->corner[i].attribute[k];
        }
    }
    const double s = nearness(h->frame, sum[0]);
    return ss_world_opaque_at(h->world, h->triangle, sum[1] / s, sum[2] / s);
}

int ss_raster_polygon_corners(const ss_raster_polygon *polygon,
                              ss_scan_corner corner[SS_CLIP_MOST]) {
    const int corners = (int)polygon->corners;
    bool far = false;
    for (int k = 0; k < corners; k++) {
        corner[k].x = polygon->corner[k][0], corner[k].y = polygon->corner[k][1];
        memcpy(corner[k].attribute, polygon->attribute[k], sizeof polygon->attribute[k]);
        if (!isfinite(corner[k].x) || !isfinite(corner[k].y)) return 0;
        far |= fabs(corner[k].x) >= SS_GUARD || fabs(corner[k].y) >= SS_GUARD;
    }
    return far ? ss_clip_guard(corner, corners, SS_RASTER_ATTRIBUTES) : corners;
}
