/* penumbra-map: cones and sheets from the silhouettes, the darkest kept.
 *
 * based on: [WH03], whole: figure 4's cones and sheets, figure 5's intensity, the modified depth
 * test. Differs, and why:
 * - Points are asked anywhere, not only on the receiver in the map. So a texel keeps Z_v and what
 *   of Z_F belongs to the fragment, and equation 1 is finished with the point's own depth; where
 *   several cones or sheets overlap, the darkest for the map's receiver is kept, as in the paper,
 *   or for the far plane where the map has none.
 * - Depths are h of map/frame.h: equation 1 in orthographic frames, with reciprocal depths in
 *   perspective, where it is exact and sheets are planar however different their cones are.
 * - Cones are evaluated at every texel instead of being cut into triangles, and only where sheets
 *   leave a gap: inside a sheet's strip the sheet is the darker.
 * - Silhouettes that something nearer hides draw neither: see ss_outer_paint().
 * - The result is filtered over 2 x 2 texels, intensities and comparisons, never depths.
 * - 3 I^2 - 2 I^3 only under falloff=paper: the area of a disk cut by a line is not it. */
#include <math.h>

#include "technique/map_techniques.h"
#include "technique/outer.h"

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
        ss_outer_offer(s->maps, s->face, run->x + i, run->y, run->attribute[1][i],
                       away * s->per_texel);
    }
}

static float rise(const void *ctx, float away, float blocker) {
    (void)blocker;
    return away * ((const sheet *)ctx)->per_texel;
}

static const char glsl[] =
    SS_OUTER_GLSL "float rise_of(float away, float blocker) { return away * words[0]; }\n";

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
    const ss_outer_pen pen = {shade, rise, &s, glsl, {s.per_texel}, true};
    return ss_outer_paint(stage, maps, found, face, &style, &pen);
}

static softshadow_status build(const ss_stage *stage, void **state) {
    return ss_outer_build(stage, "penumbra", SS_FALLOFF_BERNSTEIN, draw_face, state);
}

const ss_technique ss_penumbra_map = {
    .name = "penumbra-map",
    .title = "penumbra maps: the outer penumbra as cones and sheets from the silhouettes",
    .cite = "WH03",
    .notes =
        "Outer penumbra only: the umbra is the hard shadow and does not shrink as the light grows. "
        "rect: taken as the disk of its area. Opacity textures make holes in the shadow, not "
        "penumbrae. A map without bounds ends one scene diagonal behind the casters.",
    .needs = SS_NEEDS_SILHOUETTES,
    .bound_kind = SOFTSHADOW_BOUND_NONE,
    .lights_native = SS_LIGHTS_ROUND,
    .lights_approximated = SS_LIGHTS_RECT,
    .weightings = 1u << SOFTSHADOW_UNIFORM,
    .build = build,
    .query_glsl = ss_outer_glsl,
    .tables = ss_outer_tables,
    .destroy = ss_light_maps_destroy,
    .bytes = ss_light_maps_bytes,
    SS_LIGHT_MAPS_ROWS,
};
