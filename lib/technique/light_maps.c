#include "technique/light_maps.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/cpu.h"
#include "base/lanes.h"
#include "base/memory.h"
#include "base/status.h"
#include "base/vec.h"
#include "technique/answers.h"

/* ---- building ------------------------------------------------------------------------------- */

/* A length towards the light, as the host asked for: planes move away by it. */
static void bias_depth(ss_light_maps *maps, uint32_t face, double length) {
    const size_t n = maps->texels / maps->frames.count;
    float *depth = maps->depth + face * n;
    for (size_t i = 0; i < n; i++) {
        if (depth[i] == SS_MAP_FAR) continue;
        depth[i] += (float)ss_frame_step(&maps->frames.face[face], depth[i], length);
    }
}

float *ss_light_maps_layer(const ss_light_maps *maps, uint32_t face, uint32_t layer) {
    const size_t n = maps->texels / maps->frames.count;
    if (layer == 0) return maps->depth + face * n;
    return maps->below + (layer - 1) * maps->texels + face * n;
}

void ss_light_maps_drop_layers(ss_light_maps *maps) {
    ss_free(maps->below);
    maps->below = NULL;
}

static softshadow_status draw_depth(const ss_stage *stage, const ss_light_maps_wish *wish,
                                    ss_light_maps *maps, uint8_t *held) {
    const double bias = stage->params->depth_bias * stage->world->scale;
    for (uint32_t face = 0; face < maps->frames.count; face++) {
        const ss_frame *frame = &maps->frames.face[face];
        const ss_raster_casters casters = {
            .world = stage->world,
            .frame = frame,
            .resolution = maps->frames.resolution,
            .slope_texels = bias > 0 || wish->bare ? 0 : wish->slope_texels,
            .steepest = SS_MAP_STEEPEST,
            .deepest = frame->far_h,
            .held = held,
        };
        float *layer[SS_MOST_LAYERS];
        for (uint32_t l = 0; l <= wish->below; l++)
            layer[l] = ss_light_maps_layer(maps, face, l);
        const double start = ss_clock();
        const softshadow_status status =
            stage->raster->depth(&casters, layer, wish->below + 1, stage->pool);
        stage->spent->depth += ss_clock() - start;
        if (status) return status;
        if (bias > 0 && !wish->bare) bias_depth(maps, face, bias);
    }
    return SOFTSHADOW_OK;
}

static softshadow_status no_memory(const ss_light_maps *maps) {
    return ss_fail(SOFTSHADOW_E_MEMORY,
                   "build.resolution: out of memory for %u maps of %u x %u texels",
                   maps->frames.count, maps->frames.resolution, maps->frames.resolution);
}

softshadow_status ss_light_maps_fit(const ss_stage *stage, const ss_light_maps_wish *wish,
                                    void **state) {
    const ss_params *params = stage->params;
    ss_fit fit = {.world = stage->world, .light = stage->light, .resolution = params->resolution,
                  .bounded = params->bounded, .margin = wish->margin};
    memcpy(fit.bounds, params->bounds, sizeof fit.bounds);
    ss_light_maps *maps = *state = ss_alloc(1, wish->state_size);
    if (!maps) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory");
    maps->world = stage->world;
    maps->answer = ss_light_maps_hard;
    maps->light = *stage->light;
    maps->state_size = wish->state_size;
    ss_falloff_make(&maps->falloff, params->falloff, wish->paper, stage->light);
    const softshadow_status status = ss_frames_fit(&maps->frames, &fit, stage->pool);
    maps->texels = (size_t)params->resolution * params->resolution * maps->frames.count;
    if (status) ss_light_maps_destroy(maps), *state = NULL;
    return status;
}

softshadow_status ss_light_maps_draw(const ss_stage *stage, const ss_light_maps_wish *wish,
                                     ss_light_maps *maps) {
    uint8_t *held = ss_alloc(stage->world->triangle_count, 1);
    softshadow_status status = SOFTSHADOW_OK;
    maps->depth = ss_alloc_any(maps->texels, sizeof *maps->depth);
    if (wish->below) maps->below = ss_alloc_any(maps->texels * wish->below, sizeof *maps->below);
    if (!maps->depth || !held || (wish->below && !maps->below)) status = no_memory(maps);
    if (!status) status = draw_depth(stage, wish, maps, held);
    maps->culled = stage->world->triangle_count;
    for (size_t t = 0; held && t < stage->world->triangle_count; t++) maps->culled -= held[t];
    ss_free(held);
    return status;
}

softshadow_status ss_light_maps_build(const ss_stage *stage, const ss_light_maps_wish *wish,
                                      void **state) {
    softshadow_status status = ss_light_maps_fit(stage, wish, state);
    if (status) return status;
    status = ss_light_maps_draw(stage, wish, *state);
    if (status) ss_light_maps_destroy(*state), *state = NULL;
    return status;
}

static softshadow_status take_plane(ss_light_maps *maps, const char *name, uint32_t channels,
                                    ss_light_maps_answer *answer, float *plane) {
    maps->plane = plane;
    if (!plane) return no_memory(maps);
    maps->plane_name = name, maps->channels = channels, maps->answer = answer;
    return SOFTSHADOW_OK;
}

softshadow_status ss_light_maps_add_plane(ss_light_maps *maps, const char *name, uint32_t channels,
                                          ss_light_maps_answer *answer) {
    return take_plane(maps, name, channels, answer,
                      ss_alloc(maps->texels, channels * sizeof *maps->plane));
}

softshadow_status ss_light_maps_add_any(ss_light_maps *maps, const char *name, uint32_t channels,
                                        ss_light_maps_answer *answer) {
    return take_plane(maps, name, channels, answer,
                      ss_alloc_any(maps->texels, channels * sizeof *maps->plane));
}

void ss_light_maps_weave(const float *const channel[], uint32_t channels, uint32_t n,
                         float *texels) {
    uint32_t x = 0;
    for (; x + 4 <= n && channels == 4; x += 4) {
        ss_floats t[4];
        ss_floats_weave(channel, x, t);
        for (uint32_t i = 0; i < 4; i++) ss_floats_store(texels + 4 * (x + i), t[i]);
    }
    for (; x < n; x++)
        for (uint32_t c = 0; c < channels; c++) texels[x * channels + c] = channel[c][x];
}

softshadow_status ss_light_maps_add_lit(ss_light_maps *maps) {
    const size_t tiles = ss_light_maps_tiles(maps);
    const size_t n = tiles * tiles * maps->frames.count;
    maps->lit = ss_alloc_any(n, sizeof *maps->lit);
    for (size_t i = 0; i < n && maps->lit; i++) maps->lit[i] = -SS_MAP_FAR;
    return maps->lit ? SOFTSHADOW_OK : no_memory(maps);
}

void ss_light_maps_finish_lit(ss_light_maps *maps) {
    const uint32_t n = ss_light_maps_tiles(maps);
    for (uint32_t line = 0; line < n * maps->frames.count; line++) {
        float *row = maps->lit + (size_t)line * n;
        const float *next = line % n + 1 < n ? row + n : row;
        for (uint32_t x = 0; x < n; x++) {
            const uint32_t after = x + 1 < n ? x + 1 : x;
            row[x] = fminf(fminf(row[x], row[after]), fminf(next[x], next[after]));
        }
    }
}

void ss_light_maps_destroy(void *state) {
    ss_light_maps *maps = state;
    if (!maps) return;
    ss_free(maps->depth);
    ss_free(maps->below);
    ss_free(maps->plane);
    ss_free(maps->lit);
    ss_free(maps->packed);
    ss_free(maps);
}

/* ---- showing -------------------------------------------------------------------------------- */

size_t ss_light_maps_bytes(const void *state) {
    const ss_light_maps *maps = state;
    const size_t tiles = maps->lit ? ss_light_maps_tiles(maps) : 0;
    return maps->state_size + maps->texels * sizeof(float) * (1 + maps->channels) +
           tiles * tiles * maps->frames.count * sizeof(float);
}

uint32_t ss_light_maps_count(const void *state) {
    const ss_light_maps *maps = state;
    return maps->frames.count * (maps->plane ? 2 : 1);
}

void ss_light_maps_get(const void *state, uint32_t index, softshadow_map *map) {
    const ss_light_maps *maps = state;
    const uint32_t face = index % maps->frames.count, n = maps->frames.resolution;
    const bool second = index >= maps->frames.count;
    const size_t first = (size_t)face * n * n;
    map->name = second ? maps->plane_name : "depth";
    map->width = map->height = n;
    map->channels = second ? maps->channels : 1;
    map->channel_names = second ? maps->channel_names : NULL;
    map->face = face;
    map->pixels = second ? maps->plane + first * maps->channels : maps->depth + first;
    ss_frame_matrix(&maps->frames.face[face], maps->world, n, map->matrix);
    ss_frame_depth(&maps->frames.face[face], map->depth);
    map->unit = 1 / maps->world->scale;
    for (int k = 0; k < 3; k++) map->origin[k] = maps->world->low[k] + maps->world->half[k];
}

uint64_t ss_light_maps_silhouettes(const void *state) {
    return ((const ss_light_maps *)state)->silhouette_edges;
}

uint64_t ss_light_maps_culled(const void *state) { return ((const ss_light_maps *)state)->culled; }

/* ---- asking --------------------------------------------------------------------------------- */

static ss_light_maps_answer *const hard[] = SS_RUNGS(ss_answer_hard);

void ss_light_maps_hard(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    hard[maps->frames.rung](maps, looks, n, out);
}

/* What the point's own horizon leaves of the light: the tangent plane cuts the light's disk, at the
 * signed distance t radii from its centre. */
static float above_horizon(const ss_light_maps *maps, const ss_point *point) {
    const ss_light *light = &maps->light;
    ss_view view;
    ss_light_view(light, point->p, &view);
    if (view.inside) return 1;
    const double n[3] = {point->normal[0], point->normal[1], point->normal[2]};
    const double height = ss_dot(n, view.centre);
    const double reach = hypot(ss_dot(n, view.a), ss_dot(n, view.b)); /* of the disk, up and down */
    if (!(reach > 0)) return height > 0 ? 1 : 0;
    return ss_falloff_at(&maps->falloff, (float)(height / reach / 2 + 0.5));
}

static void count(const float *visibility, size_t n, ss_counts *counts) {
    const ss_floats one = ss_floats_all(1), zero = ss_floats_all(0);
    ss_ints ones = {0, 0, 0, 0}, zeros = {0, 0, 0, 0};
    size_t i = 0;
    for (; i + 4 <= n; i += 4) { /* a mask is -1; a block is far below 2^31 */
        const ss_floats v = ss_floats_load(visibility + i);
        ones -= (ss_ints)(v == one), zeros -= (ss_ints)(v == zero);
    }
    uint64_t lit = (uint64_t)ones[0] + (uint64_t)ones[1] + (uint64_t)ones[2] + (uint64_t)ones[3];
    uint64_t umbra =
        (uint64_t)zeros[0] + (uint64_t)zeros[1] + (uint64_t)zeros[2] + (uint64_t)zeros[3];
    for (; i < n; i++) lit += visibility[i] == 1, umbra += visibility[i] == 0;
    counts->lit += lit, counts->umbra += umbra, counts->penumbra += n - lit - umbra;
}

/* Points that see all of a lamp because they are inside it. nearest: a square that no point's
 * distance is below. */
static void light_inside(const ss_light_maps *maps, const ss_places *places, size_t n,
                         double nearest, float *visibility) {
    const ss_light *light = &maps->light;
    const double reach = light->radius * SS_LIGHT_INSIDE, square = reach * reach;
    const double *c = light->centre;
    /* in the frame's coordinates, which is good to 1e-12 of the scene's size: far below a
     * thousandth of a lamp that can be told from a point */
    if (light->type != SOFTSHADOW_SPHERE || light->point || nearest * 0.999 > square) return;
    for (size_t i = 0; i < n; i++) {
        const double x = places->at[0][i] - c[0], y = places->at[1][i] - c[1],
                     z = places->at[2][i] - c[2];
        if (x * x + y * y + z * z <= square) visibility[i] = 1;
    }
}

static void answer_places(const ss_light_maps *maps, const ss_places *places, size_t n,
                          float *visibility) {
    ss_looks looks;
    if (maps->frames.count) {
        ss_frames_look(&maps->frames, places, n, &looks);
        maps->answer(maps, &looks, n, visibility);
        light_inside(maps, places, n, looks.nearest, visibility);
    } else {
        for (size_t i = 0; i < n; i++) visibility[i] = 1;
    }
}

void ss_light_maps_query_places(const void *state, const ss_places *places, size_t n,
                                float *visibility, ss_counts *counts) {
    answer_places(state, places, n, visibility);
    count(visibility, n, counts);
}

void ss_light_maps_place(const ss_point *points, size_t n, ss_places *out) {
    for (size_t i = 0; i < (n + 7) / 8 * 8; i++) {
        const double *p = points[i < n ? i : n - 1].p;
        for (int k = 0; k < 3; k++) out->at[k][i] = p[k];
    }
}

static inline bool has_normal(const ss_point *point) {
    uint32_t bits[3];
    memcpy(bits, point->normal, sizeof bits);
    return (bits[0] | bits[1] | bits[2]) << 1; /* -0 is zero, too */
}

static void finish(const ss_light_maps *maps, const ss_point *points, size_t n, float *visibility,
                   float *bound, ss_counts *counts) {
    for (size_t i = 0; i < n; i++) {
        if (!has_normal(&points[i])) continue;
        const float above = above_horizon(maps, &points[i]);
        visibility[i] = above < visibility[i] ? above : visibility[i];
    }
    for (size_t i = 0; bound && i < n; i++) bound[i] = NAN;
    count(visibility, n, counts);
}

void ss_light_maps_horizon(const ss_stage *stage, const void *state, const ss_point *points,
                           size_t n, float *visibility, float *bound, ss_counts *counts) {
    (void)stage;
    const ss_light_maps *maps = state;
    for (size_t first = 0; first < n && maps->frames.count; first += SS_PLACES) {
        const size_t m = n - first < SS_PLACES ? n - first : SS_PLACES;
        ss_places places;
        ss_light_maps_place(points + first, m, &places);
        light_inside(maps, &places, m, 0, visibility + first);
    }
    finish(maps, points, n, visibility, bound, counts);
}

softshadow_status ss_light_maps_query(const ss_stage *stage, const void *state,
                                      const ss_point *points, size_t n, float *visibility,
                                      float *bound, ss_arena *scratch, ss_counts *counts) {
    (void)stage, (void)scratch;
    const ss_light_maps *maps = state;
    for (size_t first = 0; first < n; first += SS_PLACES) {
        const size_t m = n - first < SS_PLACES ? n - first : SS_PLACES;
        ss_places places;
        ss_light_maps_place(points + first, m, &places);
        answer_places(maps, &places, m, visibility + first);
        finish(maps, points + first, m, visibility + first, bound ? bound + first : NULL, counts);
    }
    return SOFTSHADOW_OK;
}

/* ---- the same on a GPU ----------------------------------------------------------------------- */

const char ss_light_maps_hard_glsl[] =
    SS_LIGHT_MAPS_GLSL "float answer(vec3 look, uint face) { return hard(look, face); }\n";

void ss_light_maps_lift_words(const ss_frame *frame, float *words) {
    for (int k = 0; k < 3; k++) {
        words[k] = (float)frame->origin[k], words[3 + k] = (float)frame->x[k];
        words[6 + k] = (float)frame->y[k], words[9 + k] = (float)frame->z[k];
    }
    words[12] = (float)frame->low[0], words[13] = (float)frame->low[1];
    words[14] = (float)frame->texel, words[15] = (float)frame->inverse;
}

softshadow_status ss_light_maps_ask(ss_light_maps *maps, const char *glsl,
                                    ss_raster_question *question) {
    question->glsl = NULL;
    if (!maps->frames.count) return SOFTSHADOW_OK;
    maps->words[0] = (float)maps->frames.resolution;
    *question = (ss_raster_question){
        .glsl = glsl,
        .table = {{maps->depth, maps->texels * sizeof *maps->depth},
                  {maps->plane, maps->texels * maps->channels * sizeof *maps->plane},
                  {maps->falloff.value, sizeof maps->falloff.value},
                  {maps->words, sizeof maps->words}},
        .tables = 4};
    return SOFTSHADOW_OK;
}

softshadow_status ss_light_maps_tables_hard(void *state, ss_raster_question *question) {
    return ss_light_maps_ask(state, ss_light_maps_hard_glsl, question);
}

void ss_light_maps_look(const void *state, const ss_point *points, size_t n, float (*out)[4]) {
    const ss_light_maps *maps = state;
    for (size_t first = 0; first < n; first += SS_LOOKS) {
        const size_t m = n - first < SS_LOOKS ? n - first : SS_LOOKS;
        ss_places places;
        ss_looks looks;
        ss_light_maps_place(points + first, m, &places);
        ss_frames_look(&maps->frames, &places, m, &looks);
        for (size_t i = 0; i < m; i++) {
            float *to = out[first + i];
            to[0] = looks.x[i], to[1] = looks.y[i], to[2] = looks.h[i], to[3] = looks.face[i];
        }
    }
}

/* ---- outer penumbrae ------------------------------------------------------------------------ */

void ss_outer_offer(const ss_light_maps *maps, uint32_t face, uint32_t x, uint32_t y, float vertex,
                    float rise) {
    const uint32_t n = maps->frames.resolution;
    float *texel = maps->plane + (((size_t)face * n + y) * n + x) * SS_OUTER_CHANNELS;
    const float far = (float)maps->frames.face[face].far_h;
    const float receiver = texel[SS_OUTER_DEPTH] < far ? texel[SS_OUTER_DEPTH] : far;
    /* at or below the receiver it shades nothing that is not hidden anyway: [WH03] line 4, [CD03]
     * 3.1 */
    if (!(vertex + rise < receiver)) return;
    const float key = rise / (receiver - vertex);
    if (!(key < texel[SS_OUTER_KEY])) return;
    texel[SS_OUTER_VERTEX] = vertex, texel[SS_OUTER_RISE] = rise, texel[SS_OUTER_KEY] = key;
}

static ss_light_maps_answer *const outer[] = SS_RUNGS(ss_answer_outer);

void ss_outer_answer(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    outer[maps->frames.rung](maps, looks, n, out);
}

const char ss_outer_glsl[] = SS_LIGHT_MAPS_GLSL
    "float outer_of(uint at, float h) {\n"
    "    float gap = h - planes[at + 1u];\n"
    "    float part = planes[at + 2u] / gap;\n"
    "    float open = gap > 4.76837158203125e-7 * abs(h) && part < 1.0 ? part : 1.0;\n"
    "    return planes[at] < h ? 0.0 : open;\n"
    "}\n"
    "float answer(vec3 look, uint face) {\n"
    "    float most = float(side()) - 1.5;\n"
    "    vec2 low = look.xy - 0.5;\n"
    "    low.x = low.x > 0.0 ? low.x < most ? low.x : most : 0.0;\n"
    "    low.y = low.y > 0.0 ? low.y < most ? low.y : most : 0.0;\n"
    "    uvec2 cell = uvec2(low);\n"
    "    vec2 share = low - vec2(cell);\n"
    "    uint a = (base_of(face) + cell.y * side() + cell.x) * 4u, b = a + side() * 4u;\n"
    "    float below = (1.0 - share.x) * outer_of(a, look.z) + share.x * outer_of(a + 4u, look.z);\n"
    "    float above = (1.0 - share.x) * outer_of(b, look.z) + share.x * outer_of(b + 4u, look.z);\n"
    "    return falloff_at((1.0 - share.y) * below + share.y * above);\n"
    "}\n";

softshadow_status ss_outer_tables(void *state, ss_raster_question *question) {
    ss_light_maps *maps = state;
    return ss_light_maps_ask(maps, maps->plane ? ss_outer_glsl : ss_light_maps_hard_glsl, question);
}
