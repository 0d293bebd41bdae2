/* smoothie: rectangles and corner pieces around the silhouettes, alpha blended by minimum.
 *
 * based on: [CD03], whole: construction (section 3, step 3), alpha (3.1), comparisons (step 5).
 * Differs, and why:
 * - Points are asked anywhere: a texel keeps the smoothie's depth b and what of equation 1 belongs
 *   to the blocker; the point's own distance r finishes it. Minimum blending goes by the map's
 *   receiver.
 * - The width t is by default R / b in tangent units, that of a light of radius R, for which alpha'
 *   is exactly the outer coordinate of the penumbra. A width given by the host is taken as it is.
 *   Under a sun b / r means nothing: alpha' = alpha t / ((r - b) tan(angle)).
 * - The sinusoid only under falloff=paper.
 * - The mean normal where more than two edges meet is that of the smoothies, not of the faces:
 *   faces of a soup have none that means something.
 * - Silhouettes that something nearer hides draw nothing: see ss_outer_paint(). */
#include <math.h>

#include "technique/map_techniques.h"
#include "technique/outer.h"

typedef struct smoothie {
    const ss_light_maps *maps;
    const ss_frame *frame;
    uint32_t face;
    double wide; /* t in X units as the host gave it; 0: by the light */
    float per_texel;
} smoothie;

/* rise with which alpha' = rise / (h_r - h_b). By the light: distance / rate. By a given t, in
 * perspective: alpha' = (distance / t) / (1 - b / r), and 1 - b / r = (h_r - h_b) / (D - h_b). */
static inline float rise_of(const smoothie *s, float away, float blocker) {
    if (s->wide == 0 || s->frame->inverse == 0) return away * s->per_texel;
    return (float)(away * s->frame->texel / s->wide * (1 / s->frame->inverse - blocker));
}

static void shade(void *ctx, const ss_raster_run *run) {
    const smoothie *s = ctx;
    for (uint32_t i = 0; i < run->n; i++) {
        const float blocker = run->attribute[1][i];
        const float away = ss_rim_away(run, i); /* in corners alpha = |v - p| / t */
        ss_outer_offer(s->maps, s->face, run->x + i, run->y, blocker, rise_of(s, away, blocker));
    }
}

static float rise(const void *ctx, float away, float blocker) {
    return rise_of(ctx, away, blocker);
}

/* words: per_texel; texel / t, 0: by the light; D. */
static const char glsl[] = SS_OUTER_GLSL
    "float rise_of(float away, float blocker) {\n"
    "    return words[1] == 0.0 ? away * words[0] : away * words[1] * (words[2] - blocker);\n"
    "}\n";

/* t, in texels. By the light R / b: all the way to a receiver at infinity in perspective, to the
 * far receivers under a sun. Beyond those nothing is asked. */
static double width(const void *ctx, const ss_rim_vertex *vertex) {
    const smoothie *s = ctx;
    if (s->wide > 0) return s->wide / s->frame->texel;
    return fmax(0, ss_frame_rate(s->frame) * (s->frame->far_h - vertex->h));
}

static softshadow_status draw_face(const ss_stage *stage, const ss_light_maps *maps,
                                   const ss_silhouette *found, uint32_t face) {
    const ss_frame *frame = &maps->frames.face[face];
    const double given = stage->params->smoothie_width;
    /* tangent units are X over D; under a sun they are lengths across the light */
    smoothie s = {maps, frame, face,
                  frame->inverse > 0 ? given / frame->inverse : given * stage->world->scale,
                  (float)(1 / ss_frame_rate(frame))};
    const ss_rim_style style = {.width = width, .ctx = &s, .average = true};
    const bool by_light = s.wide == 0 || frame->inverse == 0;
    const ss_outer_pen pen = {
        shade, rise, &s, glsl,
        {s.per_texel, by_light ? 0 : (float)(frame->texel / s.wide),
         by_light ? 0 : (float)(1 / frame->inverse)},
        by_light};
    return ss_outer_paint(stage, maps, found, face, &style, &pen);
}

static softshadow_status build(const ss_stage *stage, void **state) {
    return ss_outer_build(stage, "smoothie", SS_FALLOFF_SINUSOID, draw_face, state);
}

const ss_technique ss_smoothie = {
    .name = "smoothie",
    .title = "smoothies: soft edges from rectangles around the silhouettes",
    .cite = "CD03",
    .notes =
        "Outer penumbra only: the umbra is the hard shadow and does not shrink as the light grows. "
        "smoothie_width: t in tangent units, under a sun a length. rect: taken as the disk of its "
        "area. Opacity textures make holes in the shadow, not penumbrae.",
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
