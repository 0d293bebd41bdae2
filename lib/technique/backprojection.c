/* backprojection: the texels of a shadow map as small patches, projected back onto the light.
 *
 * based on: [BCS06], whole; its section 2 and layers=1 are [GBP06]. Layers by depth peeling (4.1),
 * midpoints between them for the test and true depths for the area (4.2), the deepest layer first
 * and the first contribution that is not zero (4.2, end), every step-th sample in its stead where
 * there are too many (5). Differs, and why:
 * - Depths are h of map/frame.h, in which equation 1 is an affine map of texels over h_p - h_v: see
 *   lamp.h. A rect is clamped to as in the paper; disks clip the patch exactly.
 * - Midpoints have bounds, where [BCS06] 5 finds acne and for the last layer, too: see midpoint.h.
 * - Surfaces nearer to each other than floats tell are one layer.
 * - The search region is that of the nearest occluder in it, by a pyramid of least depths, as in
 *   [GBP06], not that of the near plane; squares of it without occluders are skipped.
 * - [GBP06]'s gap filling is what falloff=paper means with one layer; its gaps are filled towards
 * the left and lower neighbour when that occludes, too. */
#include <math.h>
#include <stdio.h>

#include "base/cpu.h"
#include "base/memory.h"
#include "base/status.h"
#include "technique/lamp_ask.h"
#include "technique/lamp_walk.h"
#include "technique/light_maps.h"
#include "technique/map_techniques.h"
#include "technique/midpoint.h"

#define NOTHING  SS_LAMP_NOTHING
#define SKIP     3        /* level of the pyramid whose squares are skipped: 8 x 8 texels */

typedef struct back_state {
    ss_lamp_maps lamps; /* the plane: depths of all layers, then what points are compared with */
    uint32_t layers;
    bool fill;
    char names[SS_MOST_LAYERS * 24]; /* of the plane's channels */
} back_state;

/* ---- layers, woven into texels --------------------------------------------------------------- */

typedef struct weaving {
    const back_state *back;
    const float *layer[SS_MOST_LAYERS]; /* of this face */
    ss_midpoints midpoints;
    float *texels; /* of this face, layers x 2 each */
} weaving;

static softshadow_status weave_rows(void *ctx, uint64_t begin, uint64_t end) {
    const weaving *w = ctx;
    const uint32_t side = w->midpoints.side, layers = w->back->layers;
    float *compared = ss_alloc_any((size_t)side * layers, sizeof *compared);
    const float *channel[2 * SS_MOST_LAYERS];
    if (!compared) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for a row of a map");
    for (uint64_t y = begin; y < end; y++) {
        for (uint32_t l = 0; l < layers; l++) {
            ss_midpoints of = w->midpoints;
            of.layer = w->layer[l], of.next = l + 1 < layers ? w->layer[l + 1] : NULL;
            ss_midpoints_row(&of, (uint32_t)y, compared + l * side);
            channel[l] = w->layer[l] + y * side, channel[layers + l] = compared + l * side;
        }
        ss_light_maps_weave(channel, 2 * layers, side, w->texels + y * side * 2 * layers);
    }
    ss_free(compared);
    return SOFTSHADOW_OK;
}

static softshadow_status weave_face(const ss_stage *stage, const back_state *back, uint32_t face) {
    const ss_light_maps *maps = &back->lamps.maps;
    const uint32_t side = maps->frames.resolution;
    weaving w = {.back = back,
                 .midpoints = ss_midpoints_of(stage, &maps->frames.face[face], side),
                 .texels = maps->plane + (size_t)face * side * side * 2 * back->layers};
    for (uint32_t l = 0; l < back->layers; l++) w.layer[l] = ss_light_maps_layer(maps, face, l);
    return ss_parallel_for(stage->pool, side, 16, weave_rows, &w);
}

/* ---- building -------------------------------------------------------------------------------- */

/* "depth0,depth1,compared0,compared1" */
static void name_channels(back_state *back) {
    size_t used = 0;
    for (uint32_t i = 0; i < 2 * back->layers; i++) {
        used += (size_t)snprintf(back->names + used, sizeof back->names - used, "%s%s%u",
                                 i ? "," : "", i < back->layers ? "depth" : "compared",
                                 i % back->layers);
    }
    back->lamps.maps.channel_names = back->names;
}

static ss_light_maps_answer answer;

static softshadow_status build(const ss_stage *stage, void **state) {
    const ss_light_maps_wish wish = {.state_size = sizeof(back_state),
                                     .slope_texels = 1,
                                     .bare = !stage->light->point,
                                     .below = stage->light->point ? 0 : stage->params->layers - 1,
                                     .margin = true};
    softshadow_status status = ss_lamp_maps_build(stage, &wish, state);
    if (status || stage->light->point) return status;
    back_state *back = *state;
    ss_light_maps *maps = &back->lamps.maps;
    back->layers = stage->params->layers;
    back->fill = back->layers == 1 && stage->params->falloff == SOFTSHADOW_FALLOFF_PAPER;
    const uint32_t count = maps->frames.count;
    if (count) status = ss_light_maps_add_any(maps, "layers", 2 * back->layers, answer);
    name_channels(back);
    for (uint32_t face = 0; face < count && !status; face++) {
        status = weave_face(stage, back, face);
    }
    ss_light_maps_drop_layers(maps);
    if (status) ss_lamp_maps_destroy(back), *state = NULL;
    return status;
}

/* ---- asking ---------------------------------------------------------------------------------- */

/* One point, and the face it looks at. */
typedef struct asked {
    const float *texels;
    const ss_pyramid *pyramid;
    ss_lamp_view view;
    ss_lamp_kernel kernel;
    double x, y;
    float h;
} asked;

static inline double gap_of(const asked *a, float depth) {
    const double gap = (double)a->h - depth;
    return gap > a->view.least ? gap : a->view.least;
}

/* [GBP06]: to the right edge of the left neighbour, the upper edge of the lower one, as they
 * project. */
static void fill_gaps(const asked *a, const float *texel, const int32_t at[2], const double edge[2],
                      double low[2]) {
    const int32_t step = a->kernel.step;
    const ptrdiff_t channels = 2;
    const ptrdiff_t stride[2] = {step * channels, step * channels * (ptrdiff_t)a->pyramid->side[0]};
    for (int k = 0; k < 2; k++) {
        if (at[k] < step) continue;
        const float *other = texel - stride[k];
        if (!(other[0] + (other[1] - other[0]) * (float)step < a->h)) continue;
        const double bound = edge[k] / gap_of(a, other[0]);
        if (bound < low[k]) low[k] = bound;
    }
}

/* What the patch at (column, row) hides of the light, with its gaps filled. */
static double contribution(const asked *a, int32_t column, int32_t row) {
    const int32_t step = a->kernel.step, at[2] = {column + step / 2, row + step / 2};
    const int32_t last = (int32_t)a->pyramid->side[0] - 1;
    const int32_t x = at[0] < last ? at[0] : last, y = at[1] < last ? at[1] : last;
    const float *texel = a->texels + ((size_t)y * a->pyramid->side[0] + (size_t)x) * 2;
    const double edge[2] = {column - a->x, row - a->y};
    /* a patch of step x step texels needs as many times the bias */
    if (!(texel[0] + (texel[1] - texel[0]) * (float)step < a->h)) return 0;
    const double gap = gap_of(a, texel[0]);
    double low[2] = {edge[0] / gap, edge[1] / gap};
    const double high[2] = {(edge[0] + step) / gap, (edge[1] + step) / gap};
    fill_gaps(a, texel, (int32_t[2]){x, y}, edge, low);
    const double hidden = ss_lamp_hidden(&a->view, low, high);
    return hidden > NOTHING ? hidden : 0;
}

/* Is there no occluder in the square of the pyramid around a texel? */
static inline bool empty_square(const asked *a, int32_t x, int32_t y) {
    const uint32_t level = a->pyramid->levels > SKIP ? SKIP : a->pyramid->levels - 1;
    const size_t side = a->pyramid->side[level];
    return !(a->pyramid->level[level][(size_t)(y >> level) * side + (size_t)(x >> level)] < a->h);
}

/* One layer, its gaps filled: [GBP06]. */
static double hidden_filled(const asked *a) {
    const ss_lamp_kernel *k = &a->kernel;
    const int32_t last = (int32_t)a->pyramid->side[0] - 1;
    double sum = 0;
    for (int32_t j = 0; j < k->count[1]; j++) {
        const int32_t row = k->low[1] + j * k->step, mid = row + k->step / 2;
        const int32_t y = mid < last ? mid : last;
        for (int32_t i = 0; i < k->count[0]; i++) {
            const int32_t column = k->low[0] + i * k->step, centre = column + k->step / 2;
            const int32_t x = centre < last ? centre : last;
            if (empty_square(a, x, y)) {
                const int32_t next = ((x >> SKIP) + 1) << SKIP; /* the samples that stay in it */
                i += (next - 1 - x) / k->step;
                continue;
            }
            sum += contribution(a, column, row);
        }
        if (sum >= 1 - NOTHING) return 1;
    }
    return sum;
}

static ss_lamp_patches *const patches[] = SS_RUNGS(ss_lamp_patches);

static float seen_by(const back_state *back, const ss_looks *looks, size_t i) {
    const uint32_t face = looks->face[i];
    asked a = {.texels = back->lamps.maps.plane + (size_t)looks->base[i] * 2 * back->layers,
               .pyramid = &back->lamps.pyramid[face],
               .x = looks->x[i],
               .y = looks->y[i],
               .h = looks->h[i]};
    if (a.h == -SS_MAP_FAR) return 1;
    if (!ss_lamp_see(&back->lamps.lamp[face], a.x, a.y, a.h, &a.view))
        return ss_lamp_maps_hard(&back->lamps, looks, i);
    if (!ss_lamp_search(&a.view, a.pyramid, a.x, a.y, a.h, &a.kernel)) return 1;
    ss_lamp_thin(&a.kernel, back->lamps.max_samples);
    if (back->fill) return (float)(1 - hidden_filled(&a));
    const ss_lamp_asked plain = {.view = &a.view,
                                 .kernel = &a.kernel,
                                 .pyramid = a.pyramid,
                                 .texels = a.texels,
                                 .layers = back->layers,
                                 .x = a.x,
                                 .y = a.y,
                                 .h = a.h};
    return (float)(1 - patches[back->lamps.maps.frames.rung](&plain));
}

static void answer(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    for (size_t i = 0; i < n; i++) out[i] = seen_by((const back_state *)maps, looks, i);
}

/* words[1] to [3]: layers, max_samples, fill. */
static const char glsl[] = SS_LAMP_GLSL
    "float gap_of(View v, vec3 look, float depth) { return max(look.z - depth, v.least); }\n"
    "uint texel_of(uint face, ivec2 at) {\n"
    "    return (base_of(face) + uint(at.y) * side() + uint(at.x)) * 2u * uint(words[1]);\n"
    "}\n"
    "vec2 fill_gaps(View v, vec3 look, ivec2 at, int step, vec2 edge, vec2 low) {\n"
    "    for (int k = 0; k < 2; k++) {\n"
    "        if (at[k] < step) continue;\n"
    "        ivec2 beside = at;\n"
    "        beside[k] -= step;\n"
    "        uint other = texel_of(v.face, beside);\n"
    "        float depth = planes[other];\n"
    "        if (!(depth + (planes[other + 1u] - depth) * float(step) < look.z)) continue;\n"
    "        low[k] = min(low[k], edge[k] / gap_of(v, look, depth));\n"
    "    }\n"
    "    return low;\n"
    "}\n"
    "float contribution(View v, vec3 look, ivec2 corner, int step) {\n"
    "    ivec2 at = min(corner + step / 2, ivec2(int(side()) - 1));\n"
    "    uint texel = texel_of(v.face, at);\n"
    "    int layers = int(words[1]);\n"
    "    vec2 edge = vec2(corner) - look.xy;\n"
    "    bool wide = words[3] != 0.0;\n"
    "    for (int l = layers - 1; l >= 0; l--) {\n"
    "        float depth = planes[texel + uint(l)], compared = planes[texel + uint(layers + l)];\n"
    "        if (!(depth + (compared - depth) * float(step) < look.z)) continue;\n"
    "        float gap = gap_of(v, look, depth);\n"
    "        if (!wide && lamp_misses(v, edge + float(step) / 2.0, gap, float(step))) continue;\n"
    "        vec2 low = edge / gap, high = (edge + float(step)) / gap;\n"
    "        if (wide) low = fill_gaps(v, look, at, step, edge, low);\n"
    "        float hidden = lamp_hidden(v, low, high);\n"
    "        if (hidden > 1e-9) return hidden;\n"
    "    }\n"
    "    return 0.0;\n"
    "}\n"
    "bool hidden_by_all(View v, Kernel k, vec3 look, inout uint next, inout float sum) {\n"
    "    uint count = levels(), level = count > 3u ? 3u : count - 1u;\n"
    "    uint wide = side_at(level), start = level > 0u ? level_start(v.face, level) : base_of(v.face);\n"
    "    uint each = lamp_steps(v) + 3u * uint(words[1]);\n"
    "    int last = int(side()) - 1, i = int(next) % k.count.x, j = int(next) / k.count.x;\n"
    "    for (; j < k.count.y && sum < 1.0; steps += each) {\n"
    "        next = uint(j * k.count.x + i);\n"
    "        if (steps >= most_steps) return false;\n"
    "        ivec2 corner = k.low + ivec2(i, j) * k.step, at = min(corner + k.step / 2, ivec2(last));\n"
    "        uint square = start + uint(at.y >> level) * wide + uint(at.x >> level);\n"
    "        float least = level > 0u ? pyramids[square] : depths[square];\n"
    "        if (least < look.z) sum += contribution(v, look, corner, k.step);\n"
    "        else i += (((at.x >> 3) + 1) * 8 - 1 - at.x) / k.step;\n" /* the samples that stay in it */
    "        if (++i >= k.count.x) i = 0, j++;\n"
    "    }\n"
    "    return true;\n"
    "}\n"
    /* at: nothing, the next texel, the sum */
    "bool advance(vec3 look, uint face, inout uvec4 at) {\n"
    "    View v; Kernel k;\n"
    "    if (look.z == -1e30) return done(at, 1.0);\n"
    "    if (!lamp_see(face, look, v)) return done(at, hard(look, face));\n"
    "    if (!lamp_search(v, look, k)) return done(at, 1.0);\n"
    "    lamp_thin(k, uint(words[2]));\n"
    "    float sum = uintBitsToFloat(at.z);\n"
    "    bool all = hidden_by_all(v, k, look, at.y, sum);\n"
    "    at.z = floatBitsToUint(sum);\n"
    "    return all && done(at, 1.0 - min(sum, 1.0));\n"
    "}\n";

static softshadow_status tables(void *state, ss_raster_question *question) {
    back_state *back = state;
    float *words = back->lamps.maps.words;
    words[1] = (float)back->layers, words[2] = (float)back->lamps.max_samples;
    words[3] = back->fill;
    return ss_lamp_maps_ask(&back->lamps, glsl, question);
}

const ss_technique ss_backprojection = {
    .name = "backprojection",
    .title = "backprojection of depth layers, texel by texel, onto the light",
    .cite = "BCS06",
    .notes =
        "layers: 1 is the original, falloff=paper with it fills gaps; otherwise falloff has no "
        "meaning here, areas are measured on the light. max_samples: most texels a point looks "
        "at, 0 all; fewer are faster and band. Overlapping patches darken a little, gaps that no "
        "layer fills let light through.",
    .bound_kind = SOFTSHADOW_BOUND_NONE,
    .lights_native = SS_LIGHTS_ALL,
    .weightings = 1u << SOFTSHADOW_UNIFORM,
    .build = build,
    .query_glsl = glsl,
    .tables = tables,
    .destroy = ss_lamp_maps_destroy,
    .bytes = ss_lamp_maps_bytes,
    SS_LIGHT_MAPS_ROWS,
};
