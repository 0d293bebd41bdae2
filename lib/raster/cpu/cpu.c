/* The CPU backend: corners are projected once, triangles sorted into bands of rows, bands drawn by
 * any thread. The nearest depth stays, in whatever order a band is drawn; that depends on no
 * thread. */
#include <math.h>

#include "base/cpu.h"
#include "base/lanes.h"
#include "base/memory.h"
#include "base/status.h"
#include "raster/casters.h"
#include "raster/cpu/bins.h"
#include "raster/cpu/keep.h"
#include "raster/cpu/setup.h"
#include "raster/raster.h"

typedef struct drawing {
    const ss_raster_casters *asked;
    ss_casters casters;
    ss_bins bins;
    float *const *layer;
    uint32_t layers;
    const float *above; /* of layer 0; or NULL */
    float most_bias; /* a little more than any triangle's */
    bool plain;      /* are triangles set up by the register? */
} drawing;

/* Snaps a triangle that is whole; false: it covers no texel's centre. */
static inline bool snap(const ss_caster_plain *p, uint32_t resolution, ss_scan *scan) {
    SS_UNROLL
    for (int i = 0; i < 3; i++) {
        scan->x[i] = (int32_t)lrintf(p->x[i] * SS_SUBTEXELS);
        scan->y[i] = (int32_t)lrintf(p->y[i] * SS_SUBTEXELS);
    }
    return ss_scan_box(scan, resolution);
}

static inline float less(float a, float b) { return a < b ? a : b; }
static inline float more(float a, float b) { return a > b ? a : b; }
static inline float least3(const float v[3]) { return less(less(v[0], v[1]), v[2]); }
static inline float most3(const float v[3]) { return more(more(v[0], v[1]), v[2]); }

static bool caster_rows(const void *ctx, size_t t, int32_t *first, int32_t *last) {
    const drawing *d = ctx;
    ss_caster_plain plain;
    if (!ss_casters_plain(&d->casters, t, &plain)) {
        ss_scan_corner corner[SS_CLIP_MOST];
        const int count = ss_casters_corners(&d->casters, t, corner);
        return ss_casters_rows(&d->casters, t, corner, count, first, last);
    }
    const ss_caster_box box = {{least3(plain.x), least3(plain.y), least3(plain.h)},
                               {most3(plain.x), most3(plain.y)}};
    ss_scan scan;
    if (!ss_casters_want(&d->casters, t, &box)) return false;
    if (!snap(&plain, d->asked->resolution, &scan)) return false;
    *first = scan.first_y, *last = scan.last_y;
    return true;
}

static ss_setup_bands *const bands_of[] = SS_RUNGS(ss_setup_bands);

/* Triangles that nothing cuts by the register, the rest one by one. Those that turn their back to
 * the light are marked, and drawn last: most of them are hidden by what is drawn first. */
static void caster_spans(const void *ctx, size_t begin, size_t end, ss_bin_span *span) {
    const drawing *d = ctx;
    if (d->plain) bands_of[ss_cpu_rung()](&d->casters, begin, end, span);
    for (size_t t = begin; t < end; t++) {
        int32_t first, last;
        uint16_t *to = span[t - begin];
        if (d->plain && to[1] != SS_SETUP_ALONE) continue;
        to[0] = to[1] = 0;
        if (!caster_rows(d, t, &first, &last)) continue;
        to[0] = (uint16_t)(first / SS_BAND), to[1] = (uint16_t)(last / SS_BAND + 1);
    }
}

static void draw_part(const drawing *d, size_t t, const ss_scan_corner corner[3],
                      const ss_scan_rows *to) {
    const ss_raster_casters *c = d->asked;
    ss_scan scan;
    if (!ss_scan_snap(&scan, corner, c->resolution)) return;
    if (scan.last_y < to->first || scan.first_y > to->last) return;
    if (ss_casters_turned(&d->casters, &scan)) return;
    ss_scan_gradients(&scan, corner, 1);
    const float bias = ss_casters_bias(&d->casters, &scan);
    if (ss_caster_has_holes(c->world, t)) {
        ss_caster_holes h = {c->world, c->frame, (uint32_t)t, corner};
        ss_scan_masked(&scan, to, bias, ss_caster_opaque_at, &h);
    } else {
        ss_scan_depth(&scan, to, bias);
    }
}

/* A small triangle that nothing cuts and nothing pierces; false: it is another one. With `later`
 * what turns its back to the light is not drawn but told: most of it is hidden by what is drawn
 * first. */
static inline bool draw_small(const drawing *d, size_t t, const ss_scan_rows *to, bool *later) {
    const ss_raster_casters *c = d->asked;
    ss_caster_plain plain;
    ss_scan scan;
    if (!ss_casters_plain(&d->casters, t, &plain)) return false;
    if (!snap(&plain, c->resolution, &scan)) return true;
    if (!ss_scan_is_small(&scan)) return false;
    const bool turned = (ss_scan_area(&scan) > 0) == d->casters.mirrored;
    if (turned && c->front_only) return true;
    if (later && turned) {
        *later = true;
        return true;
    }
    const float least = least3(plain.h), most = most3(plain.h) + d->most_bias; /* of what is stored */
    /* few are below two layers: to ask costs more than it spares */
    if (!to->second && ss_scan_hidden(&scan, to, least, most)) return true;
    const double x[3] = {plain.x[0], plain.x[1], plain.x[2]},
                 y[3] = {plain.y[0], plain.y[1], plain.y[2]},
                 h[3] = {plain.h[0], plain.h[1], plain.h[2]};
    const ss_scan_plane plane = ss_scan_plane_of(&scan, x, y);
    ss_scan_gradient(&scan, &plane, 0, h);
    ss_scan_small(&scan, to, ss_casters_bias(&d->casters, &scan));
    return true;
}

static void draw_caster(const drawing *d, size_t t, const ss_scan_rows *to, bool *later) {
    if (!d->asked->world->any_opacity && draw_small(d, t, to, later)) return;
    ss_scan_corner corner[SS_CLIP_MOST];
    const int count = ss_casters_corners(&d->casters, t, corner);
    for (int k = 2; k < count; k++) {
        const ss_scan_corner part[3] = {corner[0], corner[k - 1], corner[k]};
        draw_part(d, t, part, to);
    }
}

static void clear(float *plane, size_t n) {
    const ss_floats far = ss_floats_all(SS_MAP_FAR);
    size_t i = 0;
    for (; i + 4 <= n; i += 4) ss_floats_store(plane + i, far);
    for (; i < n; i++) plane[i] = SS_MAP_FAR;
}

static void draw_all(const drawing *d, const uint32_t *item, uint32_t count,
                     const ss_scan_rows *to) {
    for (uint32_t i = 0; i < count; i++) draw_caster(d, item[i], to, NULL);
}

/* What turns its back to the light comes to the front of the list, and is drawn last. */
static void draw_nearest(const drawing *d, uint32_t *item, uint32_t count, const ss_scan_rows *to) {
    uint32_t turned = 0;
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t t = item[i] & ~SS_BIN_MARK;
        bool later = item[i] & SS_BIN_MARK;
        if (!later) draw_caster(d, t, to, &later);
        item[i] = later ? item[turned] : t;
        if (later) item[turned++] = t;
    }
    draw_all(d, item, turned, to);
}

/* From one layer on two in one pass, where there are as many; gives how many. The nearest of all
 * stays, whatever the order. */
static uint32_t draw_layers(const drawing *d, uint32_t l, uint32_t *item, uint32_t count,
                            ss_scan_rows *to) {
    const size_t n = d->asked->resolution, first = (size_t)to->first * n,
                 texels = (size_t)(to->last - to->first + 1) * n;
    bool doubt = false;
    to->doubt = &doubt;
    to->plane = d->layer[l], to->second = l + 1 < d->layers ? d->layer[l + 1] : NULL;
    clear(to->plane + first, texels);
    if (to->second) clear(to->second + first, texels);
    if (l == 0) draw_nearest(d, item, count, to);
    else draw_all(d, item, count, to);
    return to->second && !doubt ? 2 : 1;
}

static void draw_band(const drawing *d, uint32_t band) {
    const uint32_t n = d->asked->resolution;
    const int32_t first = (int32_t)band * SS_BAND;
    ss_scan_rows to = {.first = first,
                       .last = first + SS_BAND < (int32_t)n ? first + SS_BAND - 1 : (int32_t)n - 1,
                       .resolution = n,
                       .above = d->above,
                       .alike = d->above ? 0 : SS_MAP_ALIKE};
    uint32_t *item = d->bins.item + d->bins.first[band];
    const uint32_t count = d->bins.first[band + 1] - d->bins.first[band];
    for (uint32_t l = 0; l < d->layers;) {
        if (l > 0) to.above = d->layer[l - 1];
        l += draw_layers(d, l, item, count, &to);
    }
}

static softshadow_status draw_bands(void *ctx, uint64_t begin, uint64_t end) {
    const drawing *d = ctx;
    for (uint64_t turn = begin; turn < end; turn++) draw_band(d, d->bins.order[turn]);
    return SOFTSHADOW_OK;
}

static softshadow_status draw_casters(drawing *d, ss_pool *pool) {
    const ss_raster_casters *casters = d->asked;
    d->most_bias =
        (float)(2.001 * casters->slope_texels * casters->steepest * casters->frame->texel);
    d->plain = !casters->holes_only && casters->world->triangle_count < SS_BIN_MARK &&
               casters->world->vertex_count < INT32_MAX / 3;
    softshadow_status status = ss_casters_project(&d->casters, casters, pool);
    if (!status) {
        status = ss_bins_build(&d->bins, casters->world->triangle_count, casters->resolution,
                               caster_rows, caster_spans, d, pool);
    }
    if (!status) status = ss_parallel_for(pool, d->bins.bands, 1, draw_bands, d);
    ss_bins_free(&d->bins);
    ss_casters_free(&d->casters);
    return status;
}

static softshadow_status depth(const ss_raster_casters *casters, float *const layer[],
                               uint32_t layers, ss_pool *pool) {
    drawing d = {.asked = casters, .layer = layer, .layers = layers};
    return draw_casters(&d, pool);
}

static softshadow_status peel(const ss_raster_casters *casters, const float *above, float *plane,
                              ss_pool *pool) {
    drawing d = {.asked = casters, .layer = &plane, .layers = 1, .above = above};
    return draw_casters(&d, pool);
}

/* ---- the techniques' own polygons ----------------------------------------------------------- */

typedef struct sketch {
    const ss_raster_polygon *polygons;
    uint32_t resolution;
    const ss_raster_ink *ink;
    ss_bins bins;
} sketch;

static bool sketch_rows(const void *ctx, size_t i, int32_t *first, int32_t *last) {
    const sketch *s = ctx;
    ss_scan_corner corner[SS_CLIP_MOST];
    const int count = ss_raster_polygon_corners(&s->polygons[i], corner);
    return ss_scan_corner_rows(corner, count, s->resolution, first, last);
}

static softshadow_status sketch_bands(void *ctx, uint64_t begin, uint64_t end) {
    const sketch *s = ctx;
    for (uint64_t turn = begin; turn < end; turn++) {
        const uint32_t band = s->bins.order[turn];
        const int32_t first = (int32_t)band * SS_BAND;
        for (uint32_t i = s->bins.first[band]; i < s->bins.first[band + 1]; i++) {
            const uint32_t t = s->bins.item[i];
            ss_scan_corner corner[SS_CLIP_MOST];
            const int count = ss_raster_polygon_corners(&s->polygons[t], corner);
            for (int k = 2; k < count; k++) {
                const ss_scan_corner part[3] = {corner[0], corner[k - 1], corner[k]};
                ss_scan scan;
                if (!ss_scan_snap(&scan, part, s->resolution)) continue;
                ss_scan_gradients(&scan, part, SS_RASTER_ATTRIBUTES);
                ss_scan_runs(&scan, first, first + SS_BAND - 1, SS_RASTER_ATTRIBUTES,
                             s->polygons[t].tag, s->ink->shade, s->ink->ctx);
            }
        }
    }
    return SOFTSHADOW_OK;
}

static softshadow_status keep(const ss_raster_polygon *polygons, size_t count,
                              uint32_t resolution, const ss_raster_ink *ink, ss_pool *pool) {
    if (ink->least) return ss_cpu_keep(polygons, count, resolution, ink, pool);
    sketch s = {.polygons = polygons, .resolution = resolution, .ink = ink};
    softshadow_status status =
        ss_bins_build(&s.bins, count, resolution, sketch_rows, NULL, &s, pool);
    if (!status) status = ss_parallel_for(pool, s.bins.bands, 1, sketch_bands, &s);
    ss_bins_free(&s.bins);
    return status;
}

const ss_raster ss_raster_cpu = {
    .name = "cpu", .tiles = true, .depth = depth, .peel = peel, .keep = keep};
