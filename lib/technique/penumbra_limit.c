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
 * - In the paper light leaks where a silhouette folds back over its own body ("silhouette leakage
 *   at shadow of base of left ear", figure 8): what passes the fold meets the body next to it, and
 *   the equation does not know. Here b ends at that surface, and a fold that lets through less than
 *   an outline further away gives way to it. Likewise.
 * - The other builder, propagation from a depth image, is limit_propagate.c.
 * - Four texels of one occluder are interpolated, then equation 2. Where they are of different
 * ones, the paper brings g and b together (figure 7), which makes the shadow hard there; here
 * equation 2 is applied to each and the results are filtered. Likewise.
 * - Visibility becomes illumination by the light's own table (appendix A), for any light's profile.
 */
#include <math.h>

#include "base/cpu.h"
#include "base/lanes.h"
#include "base/memory.h"
#include "base/status.h"
#include "technique/answers.h"
#include "technique/limit.h"
#include "technique/map_techniques.h"

#define SLOPE    1.5 /* texels: as for 2 x 2 comparisons */
#define NEAR     4   /* h per unit of X: so steep a surface, 76 degrees, is still looked for */

/* ---- building ------------------------------------------------------------------------------- */

/* Inside, the surface that light past the silhouette ends on: what is below the texel; or what the
 * light meets just outside of the silhouette, where that is far above the other. Of what passes
 * between such a fold (at c and o) to a receiver far below only |q| / 2 (o - c) / ((z - c) (z - o))
 * is left, and all of the penumbra's light would shine through the body. */
static float floor_of(const ss_limit_face *f, size_t i, float here) {
    const float *texel = f->texels + i * LIMIT_CHANNELS;
    const float c = texel[LIMIT_C], open = texel[LIMIT_B], depth = f->depth[i];
    if (f->highest || !(open - c < (here - c) / 2)) return here;
    const float top = depth > c ? depth : c; /* what is lit stays so */
    return (open > top ? open : top) + f->near;
}

#define ROWS 16 /* that a thread takes at once */

typedef struct limiting {
    ss_limit_face *face;
    float *above, *lower; /* where to look for b from; what is there */
} limiting;

/* Steps 1 and 3: the limits above and below. Outside: c, between which and the surface the equation
 * says lit of itself, and that surface. Inside: the occluder's own surface, and the front face that
 * light past the silhouette ends on: the first below half way there, as what lies nearer to c is
 * the occluder itself ([Lawlor06]: "throw away geometry above or near the occluder depth"). */
static softshadow_status limit_rows(void *ctx, uint64_t begin, uint64_t end) {
    const limiting *l = ctx;
    ss_limit_face *r = l->face;
    const float far = (float)r->frame->far_h;
    for (size_t i = begin * r->side; i < end * r->side; i++) {
        float *texel = r->texels + i * LIMIT_CHANNELS;
        const bool none = texel[LIMIT_C] == SS_MAP_FAR, outside = texel[LIMIT_Q] > r->per_texel;
        const float c = texel[LIMIT_C], depth = r->depth[i];
        const float open = texel[LIMIT_B] < far ? texel[LIMIT_B] : far, half = (c + open) / 2;
        l->above[i] = none || outside ? SS_MAP_FAR : half > depth ? half : depth;
        /* the edge may run beside the centre of an uncovered texel that is inside of it */
        const bool past = depth >= half && depth > c + r->near && texel[LIMIT_Q] > -r->per_texel;
        const bool covered = none || (texel[LIMIT_Q] <= 0 && !past);
        texel[LIMIT_G] = covered ? depth : c;
        if (outside) texel[LIMIT_B] = depth;
        else if (!(l->above[i] < SS_MAP_FAR)) texel[LIMIT_B] = SS_MAP_FAR;
    }
    return SOFTSHADOW_OK;
}

static softshadow_status floor_rows(void *ctx, uint64_t begin, uint64_t end) {
    const limiting *l = ctx;
    const ss_limit_face *r = l->face;
    const ss_floats far = ss_floats_all(SS_MAP_FAR);
    const size_t last = end * r->side;
    for (size_t i = begin * r->side; i < last; i++) {
        for (; i + 4 <= last; i += 4) /* most texels are not inside of anything */
            if (ss_floats_bits((ss_ints)(ss_floats_load(l->above + i) < far))) break;
        if (i < last && l->above[i] < SS_MAP_FAR)
            r->texels[i * LIMIT_CHANNELS + LIMIT_B] = floor_of(r, i, l->lower[i]);
    }
    return SOFTSHADOW_OK;
}

/* begun: are the limits above and below already there? */
static softshadow_status limit(const ss_stage *stage, ss_limit_face *r, bool begun) {
    limiting l = {r, r->key, ss_alloc_any((size_t)r->side * r->side, sizeof *l.lower)};
    if (!l.lower) return ss_fail(SOFTSHADOW_E_MEMORY, "build.resolution: out of memory for a map");
    const ss_raster_casters casters = {.world = stage->world,
                                       .frame = r->frame,
                                       .resolution = r->side,
                                       .slope_texels = SLOPE,
                                       .steepest = SS_MAP_STEEPEST,
                                       .deepest = r->frame->far_h,
                                       .front_only = true};
    softshadow_status status = SOFTSHADOW_OK;
    if (!begun) status = ss_parallel_for(stage->pool, r->side, ROWS, limit_rows, &l);
    if (!status) status = stage->raster->peel(&casters, l.above, l.lower, stage->pool);
    if (!status) status = ss_parallel_for(stage->pool, r->side, ROWS, floor_rows, &l);
    ss_free(l.lower);
    return status;
}

static softshadow_status build_face(const ss_stage *stage, ss_limit_state *state,
                                    const ss_silhouette *found, uint32_t face) {
    ss_light_maps *maps = &state->maps;
    const ss_frame *frame = &maps->frames.face[face];
    const uint32_t side = maps->frames.resolution;
    const size_t n = (size_t)side * side;
    ss_limit_face f = {.frame = frame,
                       .depth = maps->depth + face * n,
                       .texels = maps->plane + face * n * LIMIT_CHANNELS,
                       .lit = ss_light_maps_lit(maps, face),
                       .side = side,
                       .per_texel = (float)(1 / ss_frame_rate(frame)),
                       .highest = state->paper};
    f.near = fminf(f.per_texel, (float)(NEAR * frame->texel));
    /* an edge may sink by four light cones a texel and still be one */
    state->same[face] = 4 * f.near;
    f.key = ss_alloc_any(n, sizeof *f.key);
    softshadow_status status = SOFTSHADOW_OK;
    if (!f.key) status = ss_fail(SOFTSHADOW_E_MEMORY, "build.resolution: out of memory for a map");
    const bool tiled = found && ss_limit_tiled(stage, side);
    for (size_t i = 0; i < n && !status && !tiled; i++) {
        f.key[i] = SS_MAP_FAR;
        f.texels[i * LIMIT_CHANNELS + LIMIT_C] = SS_MAP_FAR;
    }
    if (!status) {
        status = found ? ss_limit_ribbons(stage, &f, found) : ss_limit_propagate(stage, &f);
    }
    if (!status) status = limit(stage, &f, tiled);
    ss_free(f.key);
    return status;
}

static ss_light_maps_answer answer;

static softshadow_status draw(const ss_stage *stage, ss_limit_state *state,
                              const ss_silhouette *found) {
    ss_light_maps *maps = &state->maps;
    const bool tiled = found && ss_limit_tiled(stage, maps->frames.resolution);
    softshadow_status status =
        (tiled ? ss_light_maps_add_any
               : ss_light_maps_add_plane)(maps, "penumbra-limit", LIMIT_CHANNELS, answer);
    maps->channel_names = "c,g,b,q";
    if (!status) status = ss_light_maps_add_lit(maps);
    for (uint32_t face = 0; face < maps->frames.count && !status; face++) {
        status = build_face(stage, state, found, face);
    }
    if (!status) ss_light_maps_finish_lit(maps);
    return status;
}

static softshadow_status draw_silhouettes(const ss_stage *stage, ss_limit_state *state) {
    ss_silhouette found;
    softshadow_status status = ss_rim_find(stage, &found);
    if (status) return status;
    state->maps.silhouette_edges = found.count;
    if (found.count) status = draw(stage, state, &found);
    ss_silhouette_free(&found);
    return status;
}

static softshadow_status build(const ss_stage *stage, void **state) {
    const ss_light_maps_wish wish = {
        .state_size = sizeof(ss_limit_state), .slope_texels = SLOPE, .paper = SS_FALLOFF_TABLE};
    softshadow_status status = ss_light_maps_build(stage, &wish, state);
    if (status || stage->light->point) return status;
    ss_limit_state *limits = *state;
    limits->paper = stage->params->falloff == SOFTSHADOW_FALLOFF_PAPER;
    if (limits->maps.frames.count) {
        status = stage->params->propagate ? draw(stage, limits, NULL)
                                          : draw_silhouettes(stage, limits);
    }
    if (status) ss_light_maps_destroy(limits), *state = NULL;
    return status;
}

/* ---- asking --------------------------------------------------------------------------------- */

static ss_light_maps_answer *const rungs[] = SS_RUNGS(ss_answer_limit);

static void answer(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    rungs[maps->frames.rung](maps, looks, n, out);
}

/* words[1]: paper; word 0 of a face: same. A texel is c, g, b, q. */
static const char glsl[] = SS_LIGHT_MAPS_GLSL
    "float equation_2(vec4 t, float z) {\n"
    "    float gap = z - t.x, least = 4.76837158203125e-7 * abs(z);\n"
    "    float l = clamp(0.5 + 0.5 * t.w / (gap > least ? gap : least), 0.0, 1.0);\n"
    "    return z < t.y ? 1.0 : z < t.x || z > t.z ? 0.0 : l;\n"
    "}\n"
    "float alone(vec4 t, float z) {\n"
    "    if (words[1] == 0.0 && t.x != 1e30) return equation_2(t, z);\n"
    "    if (t.x < 1e30 && t.w > 0.0) return z > t.z ? 0.0 : 1.0;\n"
    "    return z < t.y ? 1.0 : 0.0;\n"
    "}\n"
    "vec4 texel(uint at) {\n"
    "    return vec4(planes[at * 4u], planes[at * 4u + 1u], planes[at * 4u + 2u], planes[at * 4u + 3u]);\n"
    "}\n"
    "float answer(vec3 look, uint face) {\n"
    "    float most = float(side()) - 1.5;\n"
    "    uint right = side() > 1u ? 1u : 0u, up = right * side();\n"
    "    vec2 low = look.xy - 0.5;\n"
    "    low.x = low.x > 0.0 ? low.x < most ? low.x : most : 0.0;\n"
    "    low.y = low.y > 0.0 ? low.y < most ? low.y : most : 0.0;\n"
    "    uvec2 cell = uvec2(low);\n"
    "    float u = low.x - float(cell.x), v = low.y - float(cell.y), z = look.z;\n"
    "    uint at = base_of(face) + cell.y * side() + cell.x;\n"
    "    vec4 a = texel(at), b = texel(at + right), c = texel(at + up), d = texel(at + up + right);\n"
    "    vec4 w = vec4((1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v);\n"
    "    float spread = max(max(a.x, b.x), max(c.x, d.x)) - min(min(a.x, b.x), min(c.x, d.x));\n"
    "    if (spread <= word(face, 0u) && a.x < 1e30) {\n"
    "        return falloff_at(equation_2(w.x * a + w.y * b + w.z * c + w.w * d, z));\n"
    "    }\n"
    "    return falloff_at(w.x * alone(a, z) + w.y * alone(b, z) + w.z * alone(c, z) + w.w * alone(d, z));\n"
    "}\n";

static softshadow_status tables(void *state, ss_raster_question *question) {
    ss_limit_state *limits = state;
    ss_light_maps *maps = &limits->maps;
    maps->words[1] = limits->paper;
    for (uint32_t i = 0; i < SS_MAP_FACES; i++) *ss_light_maps_words(maps, i) = limits->same[i];
    return ss_light_maps_ask(maps, maps->plane ? glsl : ss_light_maps_hard_glsl, question);
}

const ss_technique ss_penumbra_limit = {
    .name = "penumbra-limit",
    .title = "penumbra limit maps: inner and outer penumbra from depths that interpolate",
    .cite = "Lawlor06",
    .notes =
        "Exact along a straight edge of constant depth; at corners and where penumbrae overlap "
        "only "
        "the nearest silhouette counts. rect: taken as the disk of its area. Opacity textures make "
        "holes in the shadow, not penumbrae, unless build.propagate takes silhouettes from the "
        "depth image; edges are then known to a fraction of a texel only.",
    .needs = SS_NEEDS_SILHOUETTES,
    .spared = SS_NEEDS_SILHOUETTES,
    .bound_kind = SOFTSHADOW_BOUND_NONE,
    .lights_native = SS_LIGHTS_ROUND,
    .lights_approximated = SS_LIGHTS_RECT,
    .weightings = 1u << SOFTSHADOW_UNIFORM,
    .build = build,
    .query_glsl = glsl,
    .tables = tables,
    .destroy = ss_light_maps_destroy,
    .bytes = ss_light_maps_bytes,
    SS_LIGHT_MAPS_ROWS,
};
