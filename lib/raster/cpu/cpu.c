/* The CPU backend: corners are projected once, triangles sorted into bands of rows, bands drawn by any
 * thread. A band is drawn in the triangles' order, so the result does not depend on the threads. */
#include "base/memory.h"
#include "base/status.h"
#include "raster/casters.h"
#include "raster/cpu/bins.h"
#include "raster/cpu/keep.h"
#include "raster/raster.h"

typedef struct drawing {
    const ss_raster_casters *asked;
    ss_casters casters;
    ss_bins bins;
    const float *above;
    float *plane;
} drawing;

static bool caster_rows(const void *ctx, size_t t, int32_t *first, int32_t *last) {
    const drawing *d = ctx;
    ss_scan_corner corner[SS_CLIP_MOST];
    const int count = ss_casters_corners(&d->casters, t, corner);
    return ss_casters_rows(&d->casters, t, corner, count, first, last);
}

static void draw_part(const drawing *d, size_t t, const ss_scan_corner corner[3], int32_t first,
                      int32_t last) {
    const ss_raster_casters *c = d->asked;
    ss_scan scan;
    if (!ss_scan_snap(&scan, corner, c->resolution)) return;
    if (scan.last_y < first || scan.first_y > last) return;
    if (ss_casters_turned(&d->casters, &scan)) return;
    ss_scan_gradients(&scan, corner, 1);
    const float bias = ss_casters_bias(&d->casters, &scan);
    if (ss_caster_has_holes(c->world, t)) {
        ss_caster_holes h = {c->world, c->frame, (uint32_t)t, corner};
        ss_scan_masked(&scan, first, last, c->resolution, bias, d->above, d->plane,
                       ss_caster_opaque_at, &h);
    } else if (d->above) {
        ss_scan_peel(&scan, first, last, c->resolution, bias, d->above, d->plane);
    } else {
        ss_scan_depth(&scan, first, last, c->resolution, bias, d->plane);
    }
}

static softshadow_status draw_bands(void *ctx, uint64_t begin, uint64_t end) {
    const drawing *d = ctx;
    const uint32_t n = d->asked->resolution;
    for (uint64_t band = begin; band < end; band++) {
        const int32_t first = (int32_t)band * SS_BAND;
        const int32_t last = first + SS_BAND < (int32_t)n ? first + SS_BAND - 1 : (int32_t)n - 1;
        float *row = d->plane + (size_t)first * n;
        for (size_t i = 0; i < (size_t)(last - first + 1) * n; i++) row[i] = SS_MAP_FAR;
        for (uint32_t i = d->bins.first[band]; i < d->bins.first[band + 1]; i++) {
            const uint32_t t = d->bins.item[i];
            ss_scan_corner corner[SS_CLIP_MOST];
            const int count = ss_casters_corners(&d->casters, t, corner);
            for (int k = 2; k < count; k++) {
                const ss_scan_corner part[3] = {corner[0], corner[k - 1], corner[k]};
                draw_part(d, t, part, first, last);
            }
        }
    }
    return SOFTSHADOW_OK;
}

static softshadow_status draw_casters(const ss_raster_casters *casters, const float *above,
                                      float *plane, ss_pool *pool) {
    drawing d = {.asked = casters, .above = above, .plane = plane};
    softshadow_status status = ss_casters_project(&d.casters, casters, pool);
    if (!status) {
        status = ss_bins_build(&d.bins, casters->world->triangle_count, casters->resolution,
                               caster_rows, &d, pool);
    }
    if (!status) status = ss_parallel_for(pool, d.bins.bands, 1, draw_bands, &d);
    ss_bins_free(&d.bins);
    ss_casters_free(&d.casters);
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
    uint32_t resolution;
    const ss_raster_ink *ink;
    ss_bins bins;
} sketch;

static bool sketch_rows(const void *ctx, size_t i, int32_t *first, int32_t *last) {
    const sketch *s = ctx;
    ss_scan_corner corner[SS_CLIP_MOST];
    const int count = ss_raster_triangle_corners(&s->triangles[i], corner);
    return ss_scan_corner_rows(corner, count, s->resolution, first, last);
}

static softshadow_status sketch_bands(void *ctx, uint64_t begin, uint64_t end) {
    const sketch *s = ctx;
    for (uint64_t band = begin; band < end; band++) {
        const int32_t first = (int32_t)band * SS_BAND;
        for (uint32_t i = s->bins.first[band]; i < s->bins.first[band + 1]; i++) {
            const uint32_t t = s->bins.item[i];
            ss_scan_corner corner[SS_CLIP_MOST];
            const int count = ss_raster_triangle_corners(&s->triangles[t], corner);
            for (int k = 2; k < count; k++) {
                const ss_scan_corner part[3] = {corner[0], corner[k - 1], corner[k]};
                ss_scan scan;
                if (!ss_scan_snap(&scan, part, s->resolution)) continue;
                ss_scan_gradients(&scan, part, SS_RASTER_ATTRIBUTES);
                ss_scan_runs(&scan, first, first + SS_BAND - 1, SS_RASTER_ATTRIBUTES,
                             s->triangles[t].tag, s->ink->shade, s->ink->ctx);
            }
        }
    }
    return SOFTSHADOW_OK;
}

static softshadow_status keep(const ss_raster_triangle *triangles, size_t count,
                              uint32_t resolution, const ss_raster_ink *ink, ss_pool *pool) {
    if (ink->least) return ss_cpu_keep(triangles, count, resolution, ink, pool);
    sketch s = {.triangles = triangles, .resolution = resolution, .ink = ink};
    softshadow_status status = ss_bins_build(&s.bins, count, resolution, sketch_rows, &s, pool);
    if (!status) status = ss_parallel_for(pool, s.bins.bands, 1, sketch_bands, &s);
    ss_bins_free(&s.bins);
    return status;
}

const ss_raster ss_raster_cpu = {
    .name = "cpu", .depth = depth, .peel = peel, .keep = keep};
