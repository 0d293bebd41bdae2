/* The limits of silhouettes as ribbons: [Lawlor06] 3.1, step 2. See penumbra_limit.c. */
#include <math.h>

#include "base/lanes.h"
#include "base/memory.h"
#include "base/status.h"
#include "technique/limit.h"
#include "technique/offers.h"

typedef struct ribbons {
    ss_limit_face *face;
    const ss_rim *rim;
} ribbons;

/* Where the light gets past the silhouette is looked up last: it can only make a key worse. */
static void offer(ss_limit_face *f, size_t at, float c, float q, const ss_rim_foot *foot) {
    if (!(ss_limit_key(f, at, c, q, SS_MAP_FAR) < f->key[at])) return;
    const float open = ss_rim_open(f->depth, f->side, foot->place, foot->outwards);
    const float key = ss_limit_key(f, at, c, q, open);
    if (!(key < f->key[at])) return;
    float *texel = f->texels + at * LIMIT_CHANNELS;
    f->key[at] = key;
    texel[LIMIT_C] = c, texel[LIMIT_Q] = q, texel[LIMIT_B] = open;
}

/* A whole disc (where more than two edges meet) is inside where the texel is covered. */
static void shade(void *ctx, const ss_raster_run *run) {
    const ribbons *r = ctx;
    ss_limit_face *f = r->face;
    const size_t first = (size_t)run->y * f->side + run->x;
    for (uint32_t i = 0; i < run->n; i++) {
        const float c = run->attribute[1][i];
        const ss_rim_foot foot = ss_rim_foot_of(r->rim, run, i, f->depth[first + i] < c + f->near);
        offer(f, first + i, c, foot.away * f->per_texel, &foot);
    }
}

/* words: per_texel, near, far_h, highest. ss_limit_key() and what it calls; 1e30: nothing. */
static const char glsl[] = SS_RIM_GLSL
    "float key_of(float depth, float c, float q, float open) {\n"
    "    float near = words[1], far = words[2];\n"
    "    precise float hidden = c - near, reached = depth + 3.0 * words[0], limit = c + q;\n"
    "    if (open < hidden) return 1e30;\n"
    "    if (q > 0.0 && q <= words[0] && !(depth > hidden)) return 1e30;\n"
    "    if (q > 0.0 && q > words[0] && !(depth > c && limit < reached)) return 1e30;\n"
    "    precise float highest = c + abs(q), least = c + near, opened = open + near;\n"
    "    if (words[3] != 0.0) return highest;\n"
    "    float most = depth < far && q > 0.0 ? depth : far, receiver = most > least ? most : least;\n"
    "    precise float away = abs(q) / (receiver - c);\n"
    "    if (q > 0.0 || !(opened < receiver) || !(away < 1.0)) return away;\n"
    "    precise float behind = abs(q) / (receiver - (open > c ? open : c));\n"
    "    precise float folded = 1.0 - ((behind < 1.0 ? behind : 1.0) - away);\n"
    "    return folded;\n"
    "}\n"
    "bool offer(uint tag, ivec2 texel, vec4 varied, precise out float key, out vec4 value) {\n"
    "    float depth = depth_at(texel), c = varied.y;\n"
    "    precise float covered = c + words[1];\n"
    "    Foot f = rim_foot(tag, texel, varied, depth < covered);\n"
    "    precise float q = f.away * words[0];\n"
    "    float open = rim_open(f);\n"
    "    key = key_of(depth, c, q, open);\n"
    "    value = vec4(c, q, open, 0.0);\n"
    "    return true;\n"
    "}\n";

/* Where offers go when a GPU has chosen among them. */
static void keep(void *ctx, uint32_t x, uint32_t y, float key, const float value[4]) {
    ss_limit_face *f = ((const ribbons *)ctx)->face;
    const size_t at = (size_t)y * f->side + x;
    float *texel = f->texels + at * LIMIT_CHANNELS;
    f->key[at] = key;
    texel[LIMIT_C] = value[0], texel[LIMIT_Q] = value[1], texel[LIMIT_B] = value[2];
}

/* Outside is kind 0; a disc may be inside. */
static float least_limit(const void *ctx, uint32_t tag, const float *low, const float *high,
                         int *kind) {
    const ss_limit_face *f = ((const ribbons *)ctx)->face;
    *kind = ss_rim_reaches_in(tag, low);
    return f->highest ? 0 : ss_rim_least(tag, low, high) * f->per_texel;
}

/* By ss_limit_away() and ss_limit_outside(). */
static void room(const void *ctx, const uint32_t box[4], float nearest, float most[2]) {
    const ss_limit_face *f = ((const ribbons *)ctx)->face;
    const float far = (float)f->frame->far_h,
                deepest = far - nearest > f->near ? far - nearest : f->near;
    const ss_floats near = ss_floats_all(f->near), last = ss_floats_all(far);
    ss_floats inside = {0, 0, 0, 0}, outside = inside;
    for (uint32_t y = box[1]; y <= box[3]; y++) {
        for (uint32_t x = box[0]; x <= box[2]; x += 4) {
            const size_t at = (size_t)y * f->side + (x + 3 <= box[2] ? x
                                                     : box[2] > 3    ? box[2] - 3
                                                                     : 0);
            if (f->side < 4) break;
            const ss_floats key = ss_floats_load(f->key + at),
                            depth = ss_floats_load(f->depth + at);
            const ss_floats gap = ss_floats_more(ss_floats_less(depth, last) - nearest, near);
            const ss_floats begun = depth - nearest + SS_LIMIT_RAISE * f->per_texel;
            inside = ss_floats_more(key * deepest, inside);
            outside = ss_floats_more(ss_floats_less(key * gap, begun), outside);
        }
    }
    most[0] = fmaxf(fmaxf(outside[0], outside[1]), fmaxf(outside[2], outside[3])) * (1 + 0x1p-16f);
    most[1] = fmaxf(fmaxf(inside[0], inside[1]), fmaxf(inside[2], inside[3])) * (1 + 0x1p-16f);
    if (f->side < 4) most[0] = most[1] = INFINITY;
}

static softshadow_status draw(const ss_stage *stage, ribbons *r,
                              const ss_raster_polygon *polygons, size_t count) {
    const ss_limit_face *f = r->face;
    const float words[] = {f->per_texel, f->near, (float)f->frame->far_h, f->highest};
    const ss_offer_face tiled = {.depth = f->depth,
                                 .texels = f->texels,
                                 .above = f->key,
                                 .lit = f->lit,
                                 .rows = r->rim->row,
                                 .side = f->side,
                                 .per_texel = f->per_texel, .texels_per = 1 / f->per_texel,
                                 .near = f->near,
                                 .far = (float)f->frame->far_h,
                                 .paper = f->highest};
    ss_raster_ink ink = {.shade = shade,
                         .ctx = r,
                         .offer_glsl = glsl,
                         .first_key = SS_MAP_FAR,
                         .keep = keep,
                         .keep_ctx = r,
                         .least = least_limit,
                         .room = room,
                         .tiler = ss_limit_tiled(stage, f->side) ? SS_OFFERS_OF(ss_offers_limit, stage->rung)
                                                           : NULL,
                         .tiler_ctx = &tiled};
    ss_rim_tables(r->rim, f->depth, f->side, words, sizeof words / sizeof *words, &ink);
    return stage->raster->keep(polygons, count, f->side, &ink, stage->pool);
}

/* The penumbra's half width at the farthest receiver, raised. */
static double width(const void *ctx, const ss_rim_vertex *vertex) {
    const ss_frame *frame = ctx;
    return fmax(0, ss_frame_rate(frame) * (frame->far_h - vertex->h)) + SS_LIMIT_RAISE;
}

softshadow_status ss_limit_ribbons(const ss_stage *stage, ss_limit_face *face,
                                   const ss_silhouette *found) {
    ss_rim_style style = {.width = width, .ctx = face->frame, .inside = true};
    uint8_t *unseen = NULL;
    ss_rim rim;
    ss_raster_polygon *polygons = NULL;
    size_t count = 0;
    ribbons r = {face, &rim};
    softshadow_status status = ss_rim_build(&rim, stage, found, face->frame, face->side);
    if (!status)
        status = ss_rim_find_hidden(stage, &rim, face->depth, face->side, -face->near, &unseen);
    style.hidden = unseen;
    style.depth = face->depth, style.side = face->side, style.past = -face->near;
    style.sky = ss_limit_tiled(stage, face->side);
    if (!status) status = ss_rim_draw(&rim, &style, stage->pool, &polygons, &count);
    if (!status) status = draw(stage, &r, polygons, count);
    ss_free(polygons), ss_free(unseen);
    ss_rim_free(&rim);
    return status;
}
