/* single-sample: the inner penumbra from a map of how wide the shadow is.
 *
 * based on: [KD03] as [Lawlor06] (section 1 and figure 10) and the survey of [Cou05] 3.1.6 describe
 * it: beside the depth map a shadow-width map, the distance to the closest texel that is
 * geometrically illuminated; a penumbra inside the hard shadow, none outside. Differs, and why:
 * - [KD03] draw occluders and receivers apart, so that the illuminated texels are those without an
 *   occluder. Here both are one set: a texel is illuminated where it holds nothing, or where it is
 * the last surface along its ray and a neighbour is a surface well before it: a receiver beside an
 *   occluder's rim. Shadows of occluders that overlap in the map then are one, as in the paper.
 * - Distances are exact and go everywhere ([FH12]) instead of a few passes of a filter.
 * - The width that makes the penumbra full is rate (h_p - h_v), the light's own; the result is
 * filtered over 2 x 2 texels, never depths.
 * - The linear ramp only under falloff=linear or paper. */
#include <math.h>
#include <string.h>

#include "base/cpu.h"
#include "base/memory.h"
#include "base/status.h"
#include "technique/answers.h"
#include "technique/light_maps.h"
#include "technique/map_techniques.h"
#include "technique/single_sample.h"

#define RIM 16.0 /* steeper than this, in texels a texel, is an occluder's rim: the hard shadow's  \
                  */
#define NOWHERE 1e15f    /* a squared distance */

/* ---- the shadow-width map ---------------------------------------------------------------------
 */

typedef struct widths {
    float *depth, *second;       /* of this face, unbiased first surface, and what lies below it */
    float *square;               /* of the distance to the closest illuminated texel */
    const float *biased;         /* of the hard shadow */
    float *texels;               /* of this face */
    uint32_t side;
    float rim;
} widths;

/* Is the texel well below one of its neighbours? */
static bool beside_rim(const widths *w, uint32_t x, uint32_t y) {
    const float here = w->depth[(size_t)y * w->side + x];
    for (int j = -1; j <= 1; j++) {
        for (int i = -1; i <= 1; i++) {
            const uint32_t column = x + (uint32_t)i, row = y + (uint32_t)j;
            if (column >= w->side || row >= w->side) continue;
            if (here - w->depth[(size_t)row * w->side + column] > w->rim) return true;
        }
    }
    return false;
}

static bool illuminated(const widths *w, uint32_t x, uint32_t y) {
    const size_t at = (size_t)y * w->side + x;
    if (w->depth[at] == SS_MAP_FAR) return true;
    return w->second[at] == SS_MAP_FAR && beside_rim(w, x, y);
}

/* Down the columns: the closest in the same column. */
static softshadow_status columns(void *ctx, uint64_t begin, uint64_t end) {
    const widths *w = ctx;
    for (uint64_t x = begin; x < end; x++) {
        float away = NOWHERE;
        for (uint32_t y = 0; y < w->side; y++) {
            away = illuminated(w, (uint32_t)x, y) ? 0 : away + 1;
            w->square[(size_t)y * w->side + x] = away;
        }
        away = NOWHERE;
        for (uint32_t y = w->side; y-- > 0;) {
            float *at = &w->square[(size_t)y * w->side + x];
            away = *at == 0 ? 0 : away + 1;
            *at = *at < away ? *at : away;
            *at = *at < 32768 ? *at * *at : NOWHERE;
        }
    }
    return SOFTSHADOW_OK;
}

/* Along a row: the lower envelope of parabolas, [FH12] algorithm 1. `at` and `from` have room for
 * side + 1. */
static void envelope(float *row, uint32_t side, float *copy, uint32_t *at, double *from) {
    uint32_t k = 0;
    memcpy(copy, row, side * sizeof *row);
    at[0] = 0, from[0] = -INFINITY, from[1] = INFINITY;
    for (uint32_t q = 1; q < side; q++) {
        double cut;
        for (;; k--) {
            const double v = at[k], rise = (double)copy[q] + (double)q * q - copy[at[k]] - v * v;
            cut = rise / (2 * (q - v));
            if (cut > from[k]) break; /* from[0] is below everything */
        }
        at[++k] = q, from[k] = cut, from[k + 1] = INFINITY;
    }
    k = 0;
    for (uint32_t x = 0; x < side; x++) {
        while (from[k + 1] < x) k++;
        const float d = (float)x - (float)at[k];
        row[x] = d * d + copy[at[k]];
    }
}

static softshadow_status rows(void *ctx, uint64_t begin, uint64_t end) {
    const widths *w = ctx;
    float *copy = ss_alloc(w->side, sizeof *copy);
    uint32_t *at = ss_alloc(w->side + 1, sizeof *at);
    double *from = ss_alloc(w->side + 1, sizeof *from);
    softshadow_status status = SOFTSHADOW_OK;
    if (!copy || !at || !from)
        status = ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for a row of a map");
    for (uint64_t y = begin; y < end && !status; y++) {
        const size_t first = (size_t)y * w->side;
        envelope(w->square + first, w->side, copy, at, from);
        for (size_t i = first; i < first + w->side; i++) { /* the rim is between two centres */
            w->texels[i * SINGLE_CHANNELS + SINGLE_DEPTH] = w->biased[i];
            w->texels[i * SINGLE_CHANNELS + SINGLE_INSIDE] = sqrtf(w->square[i]) - .5f;
        }
    }
    ss_free(copy), ss_free(at), ss_free(from);
    return status;
}

/* The surfaces as they are, without the hard shadow's bias, and what lies below. */
static softshadow_status two_layers(const ss_stage *stage, const ss_frame *frame,
                                    const widths *w) {
    const ss_raster_casters casters = {
        .world = stage->world, .frame = frame, .resolution = w->side, .deepest = frame->far_h};
    float *const layer[] = {w->depth, w->second};
    return stage->raster->depth(&casters, layer, 2, stage->pool);
}

static softshadow_status measure(const ss_stage *stage, ss_light_maps *maps, uint32_t face,
                                 float *planes) {
    const uint32_t side = maps->frames.resolution;
    const size_t n = (size_t)side * side;
    widths w = {.depth = planes,
                .second = planes + n,
                .square = planes + 2 * n,
                .biased = maps->depth + face * n,
                .texels = maps->plane + face * n * SINGLE_CHANNELS,
                .side = side,
                .rim = (float)(RIM * maps->frames.face[face].texel)};
    softshadow_status status = two_layers(stage, &maps->frames.face[face], &w);
    if (!status) status = ss_parallel_for(stage->pool, side, 16, columns, &w);
    if (!status) status = ss_parallel_for(stage->pool, side, 16, rows, &w);
    return status;
}

static ss_light_maps_answer answer;

static softshadow_status draw(const ss_stage *stage, ss_light_maps *maps) {
    const size_t n = maps->texels / maps->frames.count;
    float *planes = ss_alloc_any(n, 3 * sizeof *planes);
    softshadow_status status = ss_light_maps_add_any(maps, "width", SINGLE_CHANNELS, answer);
    maps->channel_names = "depth,inside";
    if (!planes)
        status = ss_fail(SOFTSHADOW_E_MEMORY, "build.resolution: out of memory for three maps");
    for (uint32_t face = 0; face < maps->frames.count && !status; face++) {
        status = measure(stage, maps, face, planes);
    }
    ss_free(planes);
    return status;
}

static softshadow_status build(const ss_stage *stage, void **state) {
    const ss_light_maps_wish wish = {.state_size = sizeof(ss_single_state), .slope_texels = 1.5};
    softshadow_status status = ss_light_maps_build(stage, &wish, state);
    if (status || stage->light->point) return status;
    ss_single_state *single = *state;
    ss_light_maps *maps = &single->maps;
    if (stage->params->falloff == SOFTSHADOW_FALLOFF_PAPER) {
        ss_falloff_make(&maps->falloff, SOFTSHADOW_FALLOFF_LINEAR, SS_FALLOFF_TABLE, stage->light);
    }
    for (uint32_t face = 0; face < maps->frames.count; face++) {
        single->rate[face] = (float)ss_frame_rate(&maps->frames.face[face]);
    }
    if (maps->frames.count) status = draw(stage, maps);
    if (status) ss_light_maps_destroy(maps), *state = NULL;
    return status;
}

/* ---- asking ---------------------------------------------------------------------------------- */

static ss_light_maps_answer *const rungs[] = SS_RUNGS(ss_answer_single);

static void answer(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    rungs[maps->frames.rung](maps, looks, n, out);
}

/* word 0 of a face: its rate. */
static const char glsl[] = SS_LIGHT_MAPS_GLSL
    "float inner_of(uint at, float h, float rate) {\n"
    "    float gap = h - planes[at], inside = planes[at + 1u];\n"
    "    if (!(gap > 0.0)) return 1.0;\n"
    "    if (!(gap > 4.76837158203125e-7 * abs(h))) return 0.0;\n"
    "    float open = 1.0 - inside / (rate * gap);\n"
    "    return open > 0.0 ? open < 1.0 ? open : 1.0 : 0.0;\n"
    "}\n"
    "float answer(vec3 look, uint face) {\n"
    "    float most = side() > 1u ? float(side()) - 1.5 : 0.0, rate = word(face, 0u);\n"
    "    uint right = side() > 1u ? 2u : 0u, up = right * side();\n"
    "    vec2 low = look.xy - 0.5;\n"
    "    low.x = low.x > 0.0 ? low.x < most ? low.x : most : 0.0;\n"
    "    low.y = low.y > 0.0 ? low.y < most ? low.y : most : 0.0;\n"
    "    uvec2 cell = uvec2(low);\n"
    "    vec2 share = low - vec2(cell);\n"
    "    uint a = (base_of(face) + cell.y * side() + cell.x) * 2u;\n"
    "    float below = (1.0 - share.x) * inner_of(a, look.z, rate) +\n"
    "                  share.x * inner_of(a + right, look.z, rate);\n"
    "    float above = (1.0 - share.x) * inner_of(a + up, look.z, rate) +\n"
    "                  share.x * inner_of(a + up + right, look.z, rate);\n"
    "    return falloff_at((1.0 - share.y) * below + share.y * above);\n"
    "}\n";

static softshadow_status tables(void *state, ss_raster_question *question) {
    ss_single_state *single = state;
    for (uint32_t i = 0; i < SS_MAP_FACES; i++)
        *ss_light_maps_words(&single->maps, i) = single->rate[i];
    return ss_light_maps_ask(&single->maps, single->maps.plane ? glsl : ss_light_maps_hard_glsl,
                             question);
}

const ss_technique ss_single_sample = {
    .name = "single-sample",
    .title = "a single light sample and a shadow-width map: the inner penumbra",
    .cite = "KD03",
    .notes =
        "Inner penumbra only: nothing outside of the hard shadow is shaded, and small occluders "
        "never cast a full shadow. rect: taken as the disk of its area. Occluders that overlap "
        "as the light sees them count as one.",
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
