/* pcss: percentage-closer filtering, as wide as the blockers' mean depth says.
 *
 * based on: [Fer05], whole: blocker search, penumbra estimation w = (d_r - d_b) w_light / d_b,
 * filtering. Differs, and why:
 * - The mean is of h (map/frame.h), reciprocal depth in perspective: then the estimate is
 *   rate (h_r - h_b), without a division.
 * - The filter has the light's own shape, and texels count by the share of it that they cover: see
 *   lamp.h. Point samples would band.
 * - The search region is that of the nearest occluder in it, not that of the near plane.
 * - A texel blocks only where it stands between the point and some of the light: h_r - h grows with
 * its distance. Without that, wide filters shadow every slope with itself; bias cannot help, as it
 * would have to grow with the filter. */
#include "base/cpu.h"
#include "technique/lamp_ask.h"
#include "technique/lamp_walk.h"
#include "technique/light_maps.h"
#include "technique/map_techniques.h"

static ss_light_maps_answer answer;

static softshadow_status build(const ss_stage *stage, void **state) {
    const ss_light_maps_wish wish = {
        .state_size = sizeof(ss_lamp_maps), .slope_texels = 1.5, .margin = true};
    const softshadow_status status = ss_lamp_maps_build(stage, &wish, state);
    if (!status && !stage->light->point) ((ss_lamp_maps *)*state)->maps.answer = answer;
    return status;
}

/* ---- asking ---------------------------------------------------------------------------------- */

static ss_lamp_blockers *const mean_blocker[] = SS_RUNGS(ss_lamp_blockers);
static ss_lamp_filter *const filtered[] = SS_RUNGS(ss_lamp_filter);

static float seen_by(const ss_lamp_maps *pcss, const ss_looks *looks, size_t i) {
    const uint32_t face = looks->face[i];
    const int rung = pcss->maps.frames.rung;
    const double x = looks->x[i], y = looks->y[i];
    const float h = looks->h[i];
    const ss_pyramid *pyramid = &pcss->pyramid[face];
    ss_lamp_view view;
    ss_lamp_kernel kernel;
    double gap;
    if (h == -SS_MAP_FAR) return 1;
    if (!ss_lamp_see(&pcss->lamp[face], x, y, h, &view)) return ss_lamp_maps_hard(pcss, looks, i);
    const ss_lamp_asked a = {
        .view = &view, .kernel = &kernel, .pyramid = pyramid, .x = x, .y = y, .h = h};
    if (!ss_lamp_search(&view, pyramid, x, y, h, &kernel)) return 1;
    ss_lamp_thin(&kernel, pcss->max_samples);
    if (!mean_blocker[rung](&a, &gap)) return 1; /* step 1 */
    if (gap < view.least) gap = view.least; /* step 2: w = reach x gap */
    if (!ss_lamp_footprint(&view, pyramid->side[0], x, y, gap, &kernel)) return 1;
    ss_lamp_thin(&kernel, pcss->max_samples);
    return (float)(1 - filtered[rung](&a, gap)); /* step 3 */
}

static void answer(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    for (size_t i = 0; i < n; i++) out[i] = seen_by((const ss_lamp_maps *)maps, looks, i);
}

/* words[1]: max_samples. */
static const char glsl[] = SS_LAMP_GLSL
    "float depth_of(Kernel k, ivec2 i, uint face) {\n"
    "    ivec2 at = min(k.low + i * k.step + k.step / 2, ivec2(int(side()) - 1));\n"
    "    return depths[base_of(face) + uint(at.y) * side() + uint(at.x)];\n"
    "}\n"
    "bool blocks(View v, Kernel k, vec2 low, float gap) {\n"
    "    return gap > 0.0 && !lamp_misses(v, low + float(k.step) / 2.0, max(gap, v.least), float(k.step));\n"
    "}\n"
    "bool blockers(View v, Kernel k, vec3 look, inout uint next, inout float sum, inout float n) {\n"
    "    int i = int(next) % k.count.x, j = int(next) / k.count.x;\n"
    "    for (; j < k.count.y; steps += 2u) {\n"
    "        next = uint(j * k.count.x + i);\n"
    "        if (steps >= most_steps) return false;\n"
    "        vec2 low = vec2(k.low + ivec2(i, j) * k.step) - look.xy;\n"
    "        float gap = look.z - depth_of(k, ivec2(i, j), v.face);\n"
    "        if (blocks(v, k, low, gap)) sum += gap, n += 1.0;\n"
    "        if (++i >= k.count.x) i = 0, j++;\n"
    "    }\n"
    "    return true;\n"
    "}\n"
    "float share_of(View v, Kernel k, vec3 look, float gap, ivec2 i) {\n"
    "    vec2 low = vec2(k.low + i * k.step) - look.xy;\n"
    "    if (!blocks(v, k, low, look.z - depth_of(k, i, v.face))) return 0.0;\n"
    "    if (lamp_misses(v, low + float(k.step) / 2.0, gap, float(k.step))) return 0.0;\n"
    "    return lamp_hidden(v, low / gap, (low + float(k.step)) / gap);\n"
    "}\n"
    "bool filtered(View v, Kernel k, vec3 look, float gap, inout uint next, inout float sum) {\n"
    "    uint each = 2u + lamp_steps(v);\n"
    "    int i = int(next) % k.count.x, j = int(next) / k.count.x;\n"
    "    for (; j < k.count.y; steps += each) {\n"
    "        next = uint(j * k.count.x + i);\n"
    "        if (steps >= most_steps) return false;\n"
    "        sum += share_of(v, k, look, gap, ivec2(i, j));\n"
    "        if (++i >= k.count.x) i = 0, j++;\n"
    "    }\n"
    "    return true;\n"
    "}\n"
    /* at: the step, its next texel, its sum; how many blockers, the gap */
    "bool advance(vec3 look, uint face, inout uvec4 at) {\n"
    "    View v; Kernel k;\n"
    "    float sum = uintBitsToFloat(at.z), n = uintBitsToFloat(at.w);\n"
    "    if (look.z == -1e30) return done(at, 1.0);\n"
    "    if (!lamp_see(face, look, v)) return done(at, hard(look, face));\n"
    "    if (at.x == 0u) {\n"
    "        if (!lamp_search(v, look, k)) return done(at, 1.0);\n"
    "        lamp_thin(k, uint(words[1]));\n"
    "        bool all = blockers(v, k, look, at.y, sum, n);\n"
    "        at.zw = floatBitsToUint(vec2(sum, n));\n"
    "        if (!all) return false;\n"
    "        if (n == 0.0) return done(at, 1.0);\n"
    "        n = max(sum / n, v.least), sum = 0.0, at = uvec4(1u, 0u, 0u, floatBitsToUint(n));\n"
    "    }\n"
    "    if (!lamp_footprint(v, look.xy, n, k)) return done(at, 1.0);\n"
    "    lamp_thin(k, uint(words[1]));\n"
    "    bool all = filtered(v, k, look, n, at.y, sum);\n"
    "    at.z = floatBitsToUint(sum);\n"
    "    return all && done(at, 1.0 - min(sum, 1.0));\n"
    "}\n";

static softshadow_status tables(void *state, ss_raster_question *question) {
    ss_lamp_maps *pcss = state;
    pcss->maps.words[1] = (float)pcss->max_samples;
    return ss_lamp_maps_ask(pcss, glsl, question);
}

const ss_technique ss_pcss = {
    .name = "pcss",
    .title = "percentage-closer soft shadows: a filter as wide as the mean blocker's penumbra",
    .cite = "Fer05",
    .notes =
        "One depth for all that blocks: shadows of occluders at several depths are all as soft as "
        "their mean. falloff has no meaning here, the filter has the light's shape. max_samples: "
        "most texels each of the two steps looks at, 0 all.",
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
