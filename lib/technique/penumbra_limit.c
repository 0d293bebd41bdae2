/* penumbra-limit: the depth at which a penumbra begins, interpolated.
 *
 * based on: [Lawlor06], whole: section 2 (c, g, b and the signed limit, equations 1 and 2), 3.1
 * (ribbons on both sides of the silhouette, the highest limit wins, limits raised by a few texels).
 * Differs, and why:
 * - Depths are h of map/frame.h: linear under a sun, as in the paper, reciprocal in perspective,
 * which is the "perspective transform that pushes the light source out to infinity" of its
 * section 5.
 * - Ribbons of one corner leave gaps; pieces of a disc fill them, on the side where they open.
 * - The paper draws every silhouette, also those that another occluder hides from the light, and
 * lets the light leak. A ribbon whose silhouette is hidden is left out, and the outer half of one
 * stops where something nearer covers the texel.
 * - The lower limit b is the nearest FRONT face below the occluder, biased by its slope, instead of
 * the nearest back face: sheets without a back side receive too.
 * - Of overlapping ribbons the paper keeps the highest limit, which serves the first surface only:
 *   every fold of a closed body then cuts into the penumbra below the body. Here the silhouette
 * wins that is nearest to the light's centre, in light radii, as the texel's receiver sees it:
 * outside the surface in the map, inside the far plane. falloff=paper does as the paper.
 * - Four texels of one occluder are interpolated, then equation 2. Where they are of different
 * ones, the paper brings g and b together (figure 7), which makes the shadow hard there; here
 * equation 2 is applied to each and the results are filtered. Likewise.
 * - Visibility becomes illumination by the light's own table (appendix A), for any light's profile.
 */
#include <math.h>

#include "base/memory.h"
#include "base/status.h"
#include "technique/light_maps.h"
#include "technique/map_techniques.h"
#include "technique/rim.h"

/* A texel: the occluder's depth (SS_MAP_FAR: no penumbra here), the upper limit (above it is lit),
 * the lower limit (below it is dark), and the signed limit, q > 0 outside. */
enum { LIMIT_C, LIMIT_G, LIMIT_B, LIMIT_Q, LIMIT_CHANNELS };

/* Texels that ribbons are wider than the penumbra, so that what is interpolated at their rim is
 * saturated on both sides ([Lawlor06] 3.1: "a few extra pixels"). */
#define RAISE    3
#define SLOPE    1.5 /* texels: as for 2 x 2 comparisons */
#define STEEPEST 16  /* as the hard shadow's */
#define NEAR     4   /* h per unit of X: so steep a surface, 76 degrees, is still looked for */

typedef struct limit_state {
    ss_light_maps maps;
    float same[SS_MAP_FACES]; /* c of two texels further apart than this: two occluders */
    bool paper;               /* its own way where occluders overlap: highest limit, figure 7 */
} limit_state;

/* ---- ribbons -------------------------------------------------------------------------------- */

typedef struct ribbons {
    const ss_light_maps *maps;
    const ss_frame *frame;
    const ss_rim *rim;
    const float *depth; /* of this face */
    float *texels, *key;
    uint32_t side;
    float per_texel; /* of distance, in h: the light's cone */
    float near;      /* depths that differ by less may be one surface, seen a texel apart */
    bool highest;    /* limit wins, as in the paper */
} ribbons;

static float depth_near(const ribbons *r, double x, double y) {
    const double most = r->side - 1;
    const uint32_t column = (uint32_t)(x > 0 ? x < most ? x : most : 0);
    const uint32_t row = (uint32_t)(y > 0 ? y < most ? y : most : 0);
    return r->depth[(size_t)row * r->side + column];
}

/* How far down the light gets past the silhouette at (x, y): the depth a little outside of it,
 * where its own surface has ended: one texel and a half away, or two and a half where a bend is
 * still in the way. Above c: something nearer hides the silhouette. */
static float depth_outside(const ribbons *r, double x, double y, const double outwards[2]) {
    const float near = depth_near(r, x + 1.5 * outwards[0], y + 1.5 * outwards[1]);
    const float far = depth_near(r, x + 2.5 * outwards[0], y + 2.5 * outwards[1]);
    return fmaxf(near, far);
}

/* Outside of the silhouette a texel counts only where its own surface lies below c (else that
 * surface hides the light), and only down to where the penumbra has not begun on it ([WH03] line
 * 4), raised as ribbons are. Within a texel of the edge snapping decides what covers the centre:
 * those count. */
static bool outside_matters(const ribbons *r, float depth, float c, float q) {
    if (q <= r->per_texel) return depth > c - r->near;
    return depth > c && c + q < depth + RAISE * r->per_texel;
}

/* Whom a ribbon is for: outside, the surface in the map; inside, what is far below the occluder. */
static float receiver_of(const ribbons *r, float depth, float c, float q) {
    const float far = (float)r->frame->far_h, most = depth < far && q > 0 ? depth : far;
    return most > c + r->near ? most : c + r->near;
}

static void offer(const ribbons *r, uint32_t x, uint32_t y, float c, float q, float open) {
    const size_t at = (size_t)y * r->side + x;
    float *texel = r->texels + at * LIMIT_CHANNELS;
    if (open < c - r->near) return;
    if (q > 0 && !outside_matters(r, r->depth[at], c, q)) return;
    const float key =
        r->highest ? c + fabsf(q) : fabsf(q) / (receiver_of(r, r->depth[at], c, q) - c);
    if (!(key < r->key[at])) return;
    r->key[at] = key;
    texel[LIMIT_C] = c, texel[LIMIT_Q] = q, texel[LIMIT_B] = open;
}

static void shade_strip(const ribbons *r, const ss_raster_run *run) {
    const ss_rim_edge *edge = &r->rim->edge[run->tag / SS_RIM_TAG];
    const double right[2] = {edge->along[1], -edge->along[0]};
    const double wide = ss_rim_stretch(&r->rim->vertex[edge->vertex[0]], right);
    for (uint32_t i = 0; i < run->n; i++) {
        const float away = run->attribute[0][i], c = run->attribute[1][i];
        const double foot = -wide * away;
        const double x = run->x + i + 0.5 + foot * right[0], y = run->y + 0.5 + foot * right[1];
        offer(r, run->x + i, run->y, c, away * r->per_texel, depth_outside(r, x, y, right));
    }
}

/* Around a vertex; a whole disc (where more than two edges meet) is inside where the texel is
 * covered. */
static void shade_corner(const ribbons *r, const ss_raster_run *run) {
    const ss_rim_vertex *v = &r->rim->vertex[run->tag / SS_RIM_TAG];
    const bool disc = run->tag & SS_RIM_DISC;
    for (uint32_t i = 0; i < run->n; i++) {
        const float c = run->attribute[1][i], away = ss_rim_away(run, i);
        const double dx = run->attribute[0][i], dy = run->attribute[2][i],
                     length = sqrt(dx * dx + dy * dy);
        bool inside = run->tag & SS_RIM_INSIDE;
        if (disc) inside = r->depth[(size_t)run->y * r->side + run->x + i] < c + r->near;
        const double sign = inside ? -1 : 1, per = length > 0 ? sign / length : 0;
        const float open = depth_outside(r, v->x, v->y, (double[2]){dx * per, dy * per});
        offer(r, run->x + i, run->y, c, (float)sign * away * r->per_texel, open);
    }
}

static void shade(void *ctx, const ss_raster_run *run) {
    if (run->tag & SS_RIM_CORNER)
        shade_corner(ctx, run);
    else
        shade_strip(ctx, run);
}

/* The penumbra's half width at the farthest receiver, raised. */
static double width(const void *ctx, const ss_rim_vertex *vertex) {
    const ss_frame *frame = ctx;
    return fmax(0, ss_frame_rate(frame) * (frame->far_h - vertex->h)) + RAISE;
}

/* ---- building ------------------------------------------------------------------------------- */

/* Step 2: all silhouettes as ribbons. */
static softshadow_status draw_ribbons(const ss_stage *stage, ribbons *r,
                                      const ss_silhouette *found) {
    const ss_rim_style style = {.width = width, .ctx = r->frame, .inside = true};
    ss_rim rim;
    ss_raster_triangle *triangles = NULL;
    size_t count = 0;
    softshadow_status status = ss_rim_build(&rim, stage, found, r->frame, r->side);
    r->rim = &rim;
    if (!status) status = ss_rim_draw(&rim, &style, &triangles, &count);
    if (!status) status = ss_raster_cpu.draw(triangles, count, 4, r->side, shade, r, stage->pool);
    ss_free(triangles);
    ss_rim_free(&rim);
    return status;
}

/* Steps 1 and 3: the limits above and below. Outside: c, between which and the surface the equation
 * says lit of itself, and that surface. Inside: the occluder's own surface, and the front face that
 * light past the silhouette ends on: the first below half way there, as what lies nearer to c is
 * the occluder itself ([Lawlor06]: "throw away geometry above or near the occluder depth"). */
static softshadow_status limit(const ss_stage *stage, ribbons *r) {
    const size_t n = (size_t)r->side * r->side;
    const float far = (float)r->frame->far_h;
    float *above = r->key, *lower = ss_alloc(n, sizeof *lower);
    if (!lower) return ss_fail(SOFTSHADOW_E_MEMORY, "build.resolution: out of memory for a map");
    for (size_t i = 0; i < n; i++) {
        float *texel = r->texels + i * LIMIT_CHANNELS;
        const bool none = texel[LIMIT_C] == SS_MAP_FAR, outside = texel[LIMIT_Q] > r->per_texel;
        const float open = texel[LIMIT_B] < far ? texel[LIMIT_B] : far;
        above[i] = none || outside ? SS_MAP_FAR : fmaxf((texel[LIMIT_C] + open) / 2, r->depth[i]);
        texel[LIMIT_G] = !none && texel[LIMIT_Q] > 0 ? texel[LIMIT_C] : r->depth[i];
        texel[LIMIT_B] = outside ? r->depth[i] : SS_MAP_FAR;
    }
    const ss_raster_casters casters = {.world = stage->world,
                                       .frame = r->frame,
                                       .resolution = r->side,
                                       .slope_texels = SLOPE,
                                       .steepest = STEEPEST,
                                       .deepest = r->frame->far_h,
                                       .front_only = true};
    const softshadow_status status = stage->raster->peel(&casters, above, lower, stage->pool);
    for (size_t i = 0; i < n && !status; i++) {
        if (above[i] < SS_MAP_FAR) r->texels[i * LIMIT_CHANNELS + LIMIT_B] = lower[i];
    }
    ss_free(lower);
    return status;
}

static softshadow_status build_face(const ss_stage *stage, limit_state *state,
                                    const ss_silhouette *found, uint32_t face) {
    ss_light_maps *maps = &state->maps;
    const ss_frame *frame = &maps->frames.face[face];
    const uint32_t side = maps->frames.resolution;
    const size_t n = (size_t)side * side;
    ribbons r = {.maps = maps,
                 .frame = frame,
                 .depth = maps->depth + face * n,
                 .side = side,
                 .texels = maps->plane + face * n * LIMIT_CHANNELS,
                 .per_texel = (float)(1 / ss_frame_rate(frame)),
                 .highest = state->paper};
    r.near = fminf(r.per_texel, (float)(NEAR * frame->texel));
    /* an edge may sink by four light cones a texel and still be one */
    state->same[face] = 4 * r.near;
    r.key = ss_alloc(n, sizeof *r.key);
    if (!r.key) return ss_fail(SOFTSHADOW_E_MEMORY, "build.resolution: out of memory for a map");
    for (size_t i = 0; i < n; i++) {
        r.key[i] = SS_MAP_FAR;
        r.texels[i * LIMIT_CHANNELS + LIMIT_C] = SS_MAP_FAR;
    }
    softshadow_status status = draw_ribbons(stage, &r, found);
    if (!status) status = limit(stage, &r);
    ss_free(r.key);
    return status;
}

static softshadow_status draw(const ss_stage *stage, limit_state *state) {
    ss_light_maps *maps = &state->maps;
    ss_silhouette found;
    softshadow_status status = ss_rim_find(stage, &found);
    if (status) return status;
    maps->silhouette_edges = found.count;
    if (found.count) status = ss_light_maps_add_plane(maps, "penumbra-limit", LIMIT_CHANNELS);
    maps->channel_names = "c,g,b,q";
    for (uint32_t face = 0; face < maps->frames.count && found.count && !status; face++) {
        status = build_face(stage, state, &found, face);
    }
    ss_silhouette_free(&found);
    return status;
}

static softshadow_status build(const ss_stage *stage, void **state) {
    const ss_light_maps_wish wish = {
        .state_size = sizeof(limit_state), .slope_texels = SLOPE, .paper = SS_FALLOFF_TABLE};
    softshadow_status status = ss_light_maps_build(stage, &wish, state);
    if (status || stage->light->point) return status;
    limit_state *limits = *state;
    limits->paper = stage->params->falloff == SOFTSHADOW_FALLOFF_PAPER;
    if (limits->maps.frames.count) status = draw(stage, limits);
    if (status) ss_light_maps_destroy(limits), *state = NULL;
    return status;
}

/* ---- asking --------------------------------------------------------------------------------- */

static inline float saturate(float x) { return x > 0 ? x < 1 ? x : 1 : 0; }

/* Equation 2. A gap that rounding could have made is none: the sign of q alone decides. */
static inline float equation_2(float c, float g, float b, float q, float z) {
    const float gap = z - c, least = 0x1p-21f * fabsf(z);
    const float l = saturate(.5f + .5f * q / (gap > least ? gap : least));
    const float dark = z < c || z > b ? 0 : l;
    return z < g ? 1 : dark;
}

/* The hard shadow of a texel, g and b brought together at the surface that is on top. */
static inline float hard(const float *texel, float z) {
    if (texel[LIMIT_C] < SS_MAP_FAR && texel[LIMIT_Q] > 0) return z > texel[LIMIT_B] ? 0 : 1;
    return z < texel[LIMIT_G] ? 1 : 0;
}

static inline float alone(const limit_state *state, const float *texel, float z) {
    if (state->paper || texel[LIMIT_C] == SS_MAP_FAR) return hard(texel, z);
    return equation_2(texel[LIMIT_C], texel[LIMIT_G], texel[LIMIT_B], texel[LIMIT_Q], z);
}

static void answer(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    const limit_state *state = (const limit_state *)maps;
    const uint32_t side = maps->frames.resolution;
    const float most = (float)side - 1.5f;
    const size_t right = side > 1 ? LIMIT_CHANNELS : 0,
                 up = side > 1 ? (size_t)side * LIMIT_CHANNELS : 0;
    for (size_t i = 0; i < n; i++) {
        const float x = looks->x[i] - .5f, y = looks->y[i] - .5f, z = looks->h[i];
        const float left = x > 0 ? x < most ? x : most : 0, low = y > 0 ? y < most ? y : most : 0;
        const uint32_t column = (uint32_t)left, row = (uint32_t)low;
        const float u = left - (float)column, v = low - (float)row;
        const float *t00 =
            maps->plane + (size_t)(looks->base[i] + row * side + column) * LIMIT_CHANNELS;
        const float *t10 = t00 + right, *t01 = t00 + up, *t11 = t01 + right;
        const float w00 = (1 - u) * (1 - v), w10 = u * (1 - v), w01 = (1 - u) * v, w11 = u * v;
        const float c0 = t00[LIMIT_C], c1 = t10[LIMIT_C], c2 = t01[LIMIT_C], c3 = t11[LIMIT_C];
        const float lower = c0 < c1 ? c0 : c1, upper = c2 < c3 ? c2 : c3;
        const float higher = c0 > c1 ? c0 : c1, highest = c2 > c3 ? c2 : c3;
        const float spread =
            (higher > highest ? higher : highest) - (lower < upper ? lower : upper);
        float l;
        if (spread <= state->same[looks->face[i]] && c0 < SS_MAP_FAR) {
            float m[LIMIT_CHANNELS];
            for (int k = 0; k < LIMIT_CHANNELS; k++) {
                m[k] = w00 * t00[k] + w10 * t10[k] + w01 * t01[k] + w11 * t11[k];
            }
            l = equation_2(m[LIMIT_C], m[LIMIT_G], m[LIMIT_B], m[LIMIT_Q], z);
        } else {
            l = w00 * alone(state, t00, z) + w10 * alone(state, t10, z) +
                w01 * alone(state, t01, z) + w11 * alone(state, t11, z);
        }
        out[i] = ss_falloff_at(&maps->falloff, l);
    }
}

static softshadow_status query(const ss_stage *stage, const void *state, const ss_point *points,
                               size_t n, float *visibility, float *bound, ss_arena *scratch,
                               ss_counts *counts) {
    (void)stage, (void)scratch;
    const ss_light_maps *maps = state;
    return ss_light_maps_query(maps, maps->plane ? answer : ss_light_maps_hard, points, n,
                               visibility, bound, counts);
}

const ss_technique ss_penumbra_limit = {
    .name = "penumbra-limit",
    .title = "penumbra limit maps: inner and outer penumbra from depths that interpolate",
    .cite = "Lawlor06",
    .notes =
        "Exact along a straight edge of constant depth; at corners and where penumbrae overlap "
        "only "
        "the nearest silhouette counts. rect: taken as the disk of its area. Opacity textures make "
        "holes in the shadow, not penumbrae.",
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
