#include "technique/outer.h"

#include <math.h>

#include "base/lanes.h"
#include "base/memory.h"
#include "technique/offers.h"

/* Where a pen's offers go when a GPU has chosen among them. */
static void keep(void *ctx, uint32_t x, uint32_t y, float key, const float value[4]) {
    const ss_outer_sheet *s = ctx;
    float *texel = s->texels + ((size_t)y * s->side + x) * SS_OUTER_CHANNELS;
    texel[SS_OUTER_VERTEX] = value[0], texel[SS_OUTER_RISE] = value[1], texel[SS_OUTER_KEY] = key;
}

static float least_rise(const void *ctx, uint32_t tag, const float *low, const float *high,
                        int *kind) {
    const ss_outer_sheet *s = ctx;
    (void)kind;
    return s->pen->rise(s->pen->ctx, ss_rim_least(tag, low, high), high[1]);
}

/* A rise is kept where it is less than key (receiver - vertex). */
static void room(const void *ctx, const uint32_t box[4], float nearest, float most[2]) {
    const ss_outer_sheet *s = ctx;
    const ss_floats far = ss_floats_all(s->far);
    ss_floats sum = {0, 0, 0, 0};
    for (uint32_t y = box[1]; y <= box[3]; y++) {
        for (uint32_t x = box[0]; x <= box[2]; x += 4) {
            ss_floats t[4]; /* a texel beyond the last is the last again */
            for (uint32_t i = 0; i < 4; i++) {
                const uint32_t at = x + i < box[2] ? x + i : box[2];
                t[i] = ss_floats_load(s->texels + ((size_t)y * s->side + at) * SS_OUTER_CHANNELS);
            }
            ss_floats_turn(&t[0], &t[1], &t[2], &t[3]);
            const ss_floats receiver = ss_floats_less(t[SS_OUTER_DEPTH], far);
            sum = ss_floats_more(t[SS_OUTER_KEY] * (receiver - nearest), sum);
        }
    }
    most[0] = most[1] = fmaxf(fmaxf(sum[0], sum[1]), fmaxf(sum[2], sum[3]));
}

static void clear(const ss_outer_sheet *s) {
    for (size_t i = 0; i < (size_t)s->side * s->side; i++) {
        float *texel = s->texels + i * SS_OUTER_CHANNELS;
        texel[SS_OUTER_DEPTH] = s->depth[i];
        texel[SS_OUTER_VERTEX] = SS_MAP_FAR, texel[SS_OUTER_RISE] = 0, texel[SS_OUTER_KEY] = 1;
    }
}

/* Tiles fill the plane as they are drawn; else the pen's own shade() offers to it, or keep()
 * does. */
static softshadow_status draw_rim(const ss_stage *stage, const ss_light_maps *maps, uint32_t face,
                                  const ss_raster_polygon *polygons, size_t count,
                                  const ss_outer_pen *pen) {
    const uint32_t side = maps->frames.resolution;
    const size_t n = (size_t)side * side, first = face * n;
    ss_outer_sheet s = {maps->plane + first * SS_OUTER_CHANNELS, maps->depth + first,
                        ss_light_maps_lit(maps, face), side,
                        (float)maps->frames.face[face].far_h, pen->words[0],
                        1 / pen->words[0], pen};
    ss_outer_pen own = *pen;
    own.words[3] = (float)maps->frames.face[face].far_h;
    const ss_raster_ink ink = {.shade = pen->shade,
                               .ctx = pen->ctx,
                               .offer_glsl = pen->glsl,
                               .table = {{maps->depth + first, n * sizeof *maps->depth},
                                         {own.words, sizeof own.words}},
                               .tables = 2,
                               .first_key = 1,
                               .keep = keep,
                               .keep_ctx = &s,
                               .least = least_rise,
                               .room = room,
                               .tiler = pen->plain ? SS_OFFERS_OF(ss_offers_outer, stage->rung) : NULL,
                               .tiler_ctx = &s};
    if (!ink.tiler || !stage->raster->tiles) clear(&s);
    return stage->raster->keep(polygons, count, side, &ink, stage->pool);
}

/* What nearer things hide of a silhouette draws nothing: wherever its penumbra comes out from under
 * them, that of their own rim is the darker. On a closed body half of the silhouette. */
softshadow_status ss_outer_paint(const ss_stage *stage, const ss_light_maps *maps,
                                 const ss_silhouette *found, uint32_t face,
                                 const ss_rim_style *style, const ss_outer_pen *pen) {
    const uint32_t side = maps->frames.resolution;
    const float *depth = maps->depth + (size_t)face * side * side;
    ss_rim_style seen = *style;
    ss_rim rim;
    uint8_t *hidden = NULL;
    ss_raster_polygon *polygons = NULL;
    size_t count = 0;
    softshadow_status status = ss_rim_build(&rim, stage, found, &maps->frames.face[face], side);
    if (!status) status = ss_rim_find_hidden(stage, &rim, depth, side, 0, &hidden);
    seen.hidden = hidden;
    if (!status) status = ss_rim_draw(&rim, &seen, stage->pool, &polygons, &count);
    if (!status) status = draw_rim(stage, maps, face, polygons, count, pen);
    ss_free(polygons), ss_free(hidden);
    ss_rim_free(&rim);
    return status;
}

static softshadow_status draw_all(const ss_stage *stage, ss_light_maps *maps, const char *plane,
                                  ss_outer_draw *draw) {
    ss_silhouette found;
    softshadow_status status = ss_rim_find(stage, &found);
    if (status) return status;
    maps->silhouette_edges = found.count;
    maps->channel_names = "depth,occluder,rise,key";
    if (found.count)
        status = ss_light_maps_add_any(maps, plane, SS_OUTER_CHANNELS, ss_outer_answer);
    if (found.count && !status) status = ss_light_maps_add_lit(maps);
    for (uint32_t face = 0; face < maps->frames.count && found.count && !status; face++) {
        status = draw(stage, maps, &found, face);
    }
    if (found.count && !status) ss_light_maps_finish_lit(maps);
    ss_silhouette_free(&found);
    return status;
}

softshadow_status ss_outer_build(const ss_stage *stage, const char *plane, ss_falloff_paper paper,
                                 ss_outer_draw *draw, void **state) {
    const ss_light_maps_wish wish = {.state_size = sizeof(ss_light_maps), .slope_texels = 1.5,
                                     .paper = paper};
    softshadow_status status = ss_light_maps_build(stage, &wish, state);
    if (status || stage->light->point) return status;
    ss_light_maps *maps = *state;
    if (maps->frames.count) status = draw_all(stage, maps, plane, draw);
    if (status) ss_light_maps_destroy(maps), *state = NULL;
    return status;
}
