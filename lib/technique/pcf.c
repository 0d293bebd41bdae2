/* pcf: the hard shadow, its depth comparisons filtered.
 *
 * based on: [Reeves87], with the bicubic filter that [CD03] compare with. Differs: instead of
 * random texels under a screen pixel's footprint (a point has none) the tent of the 2 x 2 texels
 * around the point, or the cubic B-spline of 4 x 4. Comparisons are filtered, never depths. */
#include "base/cpu.h"
#include "technique/answers.h"
#include "technique/light_maps.h"
#include "technique/map_techniques.h"

#define WIDE 16 /* max_samples from which on the filter has 4 x 4 taps */

typedef struct pcf_state {
    ss_light_maps maps;
    bool wide;
} pcf_state;

static ss_light_maps_answer tent, bicubic;

static softshadow_status build(const ss_stage *stage, void **state) {
    const bool wide = stage->params->max_samples >= WIDE;
    const ss_light_maps_wish wish = {.state_size = sizeof(pcf_state),
                                     .slope_texels = wide ? 3 : 1.5};
    const softshadow_status status = ss_light_maps_build(stage, &wish, state);
    if (status) return status;
    pcf_state *pcf = *state;
    pcf->wide = wide, pcf->maps.answer = wide ? bicubic : tent;
    return SOFTSHADOW_OK;
}

static inline float lit(const ss_light_maps *maps, const ss_looks *looks, size_t i, int x, int y) {
    const int side = (int)maps->frames.resolution;
    x = x < 0 ? 0 : x < side ? x : side - 1;
    y = y < 0 ? 0 : y < side ? y : side - 1;
    return maps->depth[looks->base[i] + (uint32_t)(y * side + x)] < looks->h[i] ? 0 : 1;
}

/* Where the tap at the lower left is, and how far the point is beyond it. */
static inline int split(float place, float *share) {
    const float low = place - .5f;
    const int cell = low < 0 ? -1 : (int)low;
    *share = low - (float)cell;
    return cell;
}

static ss_light_maps_answer *const rungs[] = SS_RUNGS(ss_answer_tent);

static void tent(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    rungs[maps->frames.rung](maps, looks, n, out);
}

/* The uniform cubic B-spline's weights for the four taps around share t of a cell. */
static inline void spline(float t, float weight[4]) {
    const float s = 1 - t;
    weight[0] = s * s * s / 6;
    weight[1] = (4 - 3 * t * t * (2 - t)) / 6;
    weight[2] = (4 - 3 * s * s * (2 - s)) / 6;
    weight[3] = t * t * t / 6;
}

static void bicubic(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    for (size_t i = 0; i < n; i++) {
        float u, v, across[4], up[4], sum = 0;
        const int x = split(looks->x[i], &u), y = split(looks->y[i], &v);
        spline(u, across), spline(v, up);
        for (int j = 0; j < 4; j++) {
            float row = 0;
            for (int k = 0; k < 4; k++)
                row += across[k] * lit(maps, looks, i, x + k - 1, y + j - 1);
            sum += up[j] * row;
        }
        out[i] = sum > 1 ? 1 : sum;
    }
}

/* words[1]: the wide filter? */
static const char glsl[] = SS_LIGHT_MAPS_GLSL
    "float lit(vec3 look, uint face, ivec2 at) {\n"
    "    at = clamp(at, ivec2(0), ivec2(int(side()) - 1));\n"
    "    return depths[base_of(face) + uint(at.y) * side() + uint(at.x)] < look.z ? 0.0 : 1.0;\n"
    "}\n"
    "vec4 spline(float t) {\n"
    "    float s = 1.0 - t;\n"
    "    return vec4(s * s * s, 4.0 - 3.0 * t * t * (2.0 - t), 4.0 - 3.0 * s * s * (2.0 - s),\n"
    "                t * t * t) / 6.0;\n"
    "}\n"
    "float answer(vec3 look, uint face) {\n"
    "    vec2 low = look.xy - 0.5;\n"
    "    ivec2 at = ivec2(low.x < 0.0 ? -1 : int(low.x), low.y < 0.0 ? -1 : int(low.y));\n"
    "    vec2 share = low - vec2(at);\n"
    "    if (words[1] == 0.0) {\n"
    "        float below = (1.0 - share.x) * lit(look, face, at) + share.x * lit(look, face, at + ivec2(1, 0));\n"
    "        float above = (1.0 - share.x) * lit(look, face, at + ivec2(0, 1)) +\n"
    "                      share.x * lit(look, face, at + ivec2(1, 1));\n"
    "        return (1.0 - share.y) * below + share.y * above;\n"
    "    }\n"
    "    vec4 across = spline(share.x), up = spline(share.y);\n"
    "    float sum = 0.0;\n"
    "    for (int j = 0; j < 4; j++) {\n"
    "        float row = 0.0;\n"
    "        for (int k = 0; k < 4; k++) row += across[k] * lit(look, face, at + ivec2(k - 1, j - 1));\n"
    "        sum += up[j] * row;\n"
    "    }\n"
    "    return sum > 1.0 ? 1.0 : sum;\n"
    "}\n";

static softshadow_status tables(void *state, ss_raster_question *question) {
    pcf_state *pcf = state;
    pcf->maps.words[1] = pcf->wide;
    return ss_light_maps_ask(&pcf->maps, glsl, question);
}

const ss_technique ss_pcf = {
    .name = "pcf",
    .title = "percentage-closer filtering: the hard shadow with an edge a texel or two wide",
    .cite = "Reeves87",
    .notes =
        "2 x 2 taps; max_samples >= 16: the bicubic filter of 4 x 4. The edge's width comes from "
        "the texels, not from the light.",
    .bound_kind = SOFTSHADOW_BOUND_NONE,
    .lights_native = SS_LIGHTS_ALL,
    .weightings = 1u << SOFTSHADOW_UNIFORM,
    .build = build,
    .query_glsl = glsl,
    .tables = tables,
    .destroy = ss_light_maps_destroy,
    .bytes = ss_light_maps_bytes,
    SS_LIGHT_MAPS_ROWS,
};
