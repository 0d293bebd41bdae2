/* penumbra-map: cones and sheets from the silhouettes, the darkest kept.
 *
 * based on: [WH03], whole: figure 4's cones and sheets, figure 5's intensity, the modified depth test.
 * Differs, and why:
 * - Points are asked anywhere, not only on the receiver in the map. So a texel keeps Z_v and what of
 *   Z_F belongs to the fragment, and equation 1 is finished with the point's own depth; where several
 *   cones or sheets overlap, the darkest for the map's receiver is kept, as in the paper, or for the
 *   far plane where the map has none.
 * - Depths are h of map/frame.h: equation 1 in orthographic frames, with reciprocal depths in
 *   perspective, where it is exact and sheets are planar however different their cones are.
 * - Cones are evaluated at every texel instead of being cut into triangles, and only where sheets leave
 *   a gap: inside a sheet's strip the sheet is the darker.
 * - The result is filtered over 2 x 2 texels, intensities and comparisons, never depths.
 * - 3 I^2 - 2 I^3 only under falloff=paper: the area of a disk cut by a line is not it. */
#include <math.h>

#include "base/memory.h"
#include "technique/light_maps.h"
#include "technique/map_techniques.h"
#include "technique/rim.h"

/* What shade needs to know of the frame that is drawn. */
typedef struct sheet {
    const ss_light_maps *maps;
    uint32_t face;
    float per_texel; /* Z_F - Z_v for a texel of distance */
} sheet;

static void shade(void *ctx, const ss_raster_run *run) {
    const sheet *s = ctx;
    for (uint32_t i = 0; i < run->n; i++) {
        const float away = ss_rim_away(run, i);
        ss_outer_offer(s->maps, s->face, run->x + i, run->y, run->attribute[1][i], away * s->per_texel);
    }
}

/* The cone's radius at the far plane: C_r = (Z_far - Z_v) L_r / Z_v, in texels. */
static double cone_radius(const void *ctx, const ss_rim_vertex *vertex) {
    const ss_frame *frame = ctx;
    return fmax(0, ss_frame_rate(frame) * (frame->far_h - vertex->h));
}

static softshadow_status draw_face(const ss_stage *stage, const ss_light_maps *maps,
                                   const ss_silhouette *found, uint32_t face) {
    const ss_frame *frame = &maps->frames.face[face];
    const ss_rim_style style = {.width = cone_radius, .ctx = frame, .tangent = true};
    sheet s = {maps, face, (float)(1 / ss_frame_rate(frame))};
    ss_rim rim;
    ss_raster_triangle *triangles = NULL;
    size_t count = 0;
    softshadow_status status =
        ss_rim_build(&rim, stage, found, frame, maps->frames.resolution);
    if (!status) status = ss_rim_draw(&rim, &style, &triangles, &count);
    if (!status) {
        status = ss_raster_cpu.draw(triangles, count, 4, maps->frames.resolution, shade, &s, stage->pool);
    }
    ss_free(triangles);
    ss_rim_free(&rim);
    return status;
}

static softshadow_status draw(const ss_stage *stage, ss_light_maps *maps) {
    ss_silhouette found;
    softshadow_status status = ss_rim_find(stage, &found);
    if (status) return status;
    maps->silhouette_edges = found.count;
    if (found.count) status = ss_outer_clear(maps, "penumbra");
    for (uint32_t face = 0; face < maps->frames.count && found.count && !status; face++) {
        status = draw_face(stage, maps, &found, face);
    }
    ss_silhouette_free(&found);
    return status;
}

static softshadow_status build(const ss_stage *stage, void **state) {
    const ss_light_maps_wish wish = {.state_size = sizeof(ss_light_maps), .slope_texels = 1.5,
                                     .paper = SS_FALLOFF_BERNSTEIN};
    softshadow_status status = ss_light_maps_build(stage, &wish, state);
    if (status || stage->light->point) return status;
    ss_light_maps *maps = *state;
    if (maps->frames.count) status = draw(stage, maps);
    if (status) ss_light_maps_destroy(maps), *state = NULL;
    return status;
}

static softshadow_status query(const ss_stage *stage, const void *state, const ss_point *points,
                               size_t n, float *visibility, float *bound, ss_arena *scratch,
                               ss_counts *counts) {
    (void)stage, (void)scratch;
    const ss_light_maps *maps = state;
    return ss_light_maps_query(maps, maps->plane ? ss_outer_answer : ss_light_maps_hard, points, n,
                               visibility, bound, counts);
}

const ss_technique ss_penumbra_map = {
    .name = "penumbra-map",
    .title = "penumbra maps: the outer penumbra as cones and sheets from the silhouettes",
    .cite = "WH03",
    .notes = "Outer penumbra only: the umbra is the hard shadow and does not shrink as the light grows. "
             "rect: taken as the disk of its area. Opacity textures make holes in the shadow, not "
             "penumbrae. A map without bounds ends one scene diagonal behind the casters.",
    .needs = SS_NEEDS_SILHOUETTES,
    .bound_kind = SOFTSHADOW_BOUND_NONE,
    .lights_native = SS_LIGHTS_ROUND,
    .lights_approximated = SS_LIGHTS_RECT,
    .weightings = 1u << SOFTSHADOW_UNIFORM,
    .build = build,
    .query = query,
    .destroy = ss_light_maps_destroy,
    .bytes = ss_light_maps_bytes,
    .map_count = ss_light_maps_count,
    .get_map = ss_light_maps_get,
    .silhouette_edges = ss_light_maps_silhouettes,
    .casters_culled = ss_light_maps_culled,
};
