/* penumbra-mask: percentage-closer filtering as wide as the penumbra, only where there is one.
 *
 * based on: [Cou05] chapter 5: a mask of over-estimated penumbra volumes with the depth of the edge
 * that each is of (5.1), a filter as wide as receiver and averaged edge depth say, n x n jittered
 * taps (5.2), and the blur of the visibility image that never crosses ids (5.3). Differs, and why:
 * - Volumes of single edges, and of discs around vertices between them, over-estimated by a fixed
 *   share and some texels: the printed construction moves edges towards the light, where s_e = 1
 *   leaves nothing. The nearest volume in a texel counts, as there; its edge's depth is that of the
 *   nearest place on the edge, not of the nearer end.
 * - In h of map/frame.h the width of the filter is rate (h_r - h_o) for every light; the printed
 *   formula gives half of that on either side, so s_p is 2. falloff=paper: as printed, taps in a
 *   square.
 * - Taps lie on the light: in a disk or a rectangle, as the point sees it, weighted by its profile.
 * - A tap that meets something too near to stand before its place on the light looks again, as near
 *   as that is: else a slope that fills the filter would shadow itself.
 * - What is in no volume takes no tap: there the shadow map alone knows. In the thesis all that
 *   fails the depth test is filtered; beyond the volumes it finds nothing.
 * - Against acne the midpoint between the two nearest surfaces ([Woo92]), which the thesis wished
 *   for: see midpoint.h.
 * - The jitter is a function of the point's place in the map and the seed. */
#include <math.h>

#include "base/memory.h"
#include "base/status.h"
#include "scene/light_parts.h"
#include "technique/blur.h"
#include "technique/lamp_ask.h"
#include "technique/light_maps.h"
#include "technique/map_techniques.h"
#include "technique/midpoint.h"
#include "technique/offers.h"
#include "technique/parts.h"
#include "technique/rim.h"
#include "trace/samples.h"

/* A texel: the depth of its surface; the depth below which that shadows; the depth at which a
 * penumbra volume begins (SS_MAP_FAR: none), and that of the edge it is of. */
enum { MASK_SURFACE, MASK_COMPARED, MASK_VOLUME, MASK_EDGE, MASK_CHANNELS };

#define WIDER    1.25 /* volumes than half a penumbra: "to account for sampling errors" (5.1) */
#define RAISE    2    /* and texels on top */
#define NEAR     4 /* h per unit of X: so steep a surface, 76 degrees, still goes on */
#define AROUND   2        /* edge depths are averaged over 2 * AROUND + 1 places along each axis */
#define BLUR     12       /* n_blur of 5.5 */

typedef struct mask_state {
    ss_light_maps maps;
    ss_lamp lamp[SS_MAP_FACES];
    uint32_t taps, blur, seed;
    bool paper;
} mask_state;

/* ---- the mask -------------------------------------------------------------------------------- */

typedef struct masking {
    const ss_frame *frame;
    const ss_rim *rim;
    const float *depth; /* of this face */
    float *texels;
    uint32_t side;
    float per_texel; /* of distance, in h: the light's cone, widened */
    float near;      /* a surface that goes on past an edge is no deeper than this */
} masking;

/* How far down the light gets past the silhouette that place i of a run is of. */
static float open_past(const masking *m, const ss_raster_run *run, uint32_t i) {
    const ss_rim_foot foot = ss_rim_foot_of(m->rim, run, i, false);
    return ss_rim_open(m->depth, m->side, foot.place, foot.outwards);
}

/* Silhouettes that no light gets past are none: hidden ones, seams, bumps in a wider surface. */
static void shade(void *ctx, const ss_raster_run *run) {
    const masking *m = ctx;
    float *texel = m->texels + ((size_t)run->y * m->side + run->x) * MASK_CHANNELS;
    for (uint32_t i = 0; i < run->n; i++, texel += MASK_CHANNELS) {
        const float edge = run->attribute[1][i], away = fabsf(ss_rim_away(run, i)) - RAISE;
        const float begins = edge + (away > 0 ? away * m->per_texel : 0);
        const float before = texel[MASK_VOLUME];
        /* the order of edges that meet must not matter */
        const bool nearer = begins < before || (begins == before && edge < texel[MASK_EDGE]);
        if (!nearer || !(open_past(m, run, i) > edge + m->near)) continue;
        texel[MASK_VOLUME] = begins, texel[MASK_EDGE] = edge;
    }
}

/* words: per_texel, near. Of what begins alike the first, where C takes the edge that is less deep:
 * they begin alike where they are alike. */
static const char offer_glsl[] = SS_RIM_GLSL
    "bool offer(uint tag, ivec2 texel, vec4 varied, precise out float key, out vec4 value) {\n"
    "    float edge = varied.y;\n"
    "    precise float away = abs(rim_away(tag, varied)) - 2.0, least = edge + words[1];\n"
    "    key = edge + (away > 0.0 ? away * words[0] : 0.0);\n"
    "    value = vec4(edge, 0.0, 0.0, 0.0);\n"
    "    return rim_open(rim_foot(tag, texel, varied, false)) > least;\n"
    "}\n";

/* Where offers go when a GPU has chosen among them. */
static void keep(void *ctx, uint32_t x, uint32_t y, float begins, const float value[4]) {
    const masking *m = ctx;
    float *texel = m->texels + ((size_t)y * m->side + x) * MASK_CHANNELS;
    texel[MASK_VOLUME] = begins, texel[MASK_EDGE] = value[0];
}

/* How much deeper than its edge a volume begins. */
static float least_rise(const void *ctx, uint32_t tag, const float *low, const float *high,
                        int *kind) {
    const masking *m = ctx;
    const float away = ss_rim_least(tag, low, high) - RAISE;
    (void)kind;
    return away > 0 ? away * m->per_texel : 0;
}

static void room(const void *ctx, const uint32_t box[4], float nearest, float most[2]) {
    const masking *m = ctx;
    float sum = 0;
    for (uint32_t y = box[1]; y <= box[3]; y++) {
        const float *texel = m->texels + ((size_t)y * m->side + box[0]) * MASK_CHANNELS;
        for (uint32_t x = box[0]; x <= box[2]; x++, texel += MASK_CHANNELS) {
            sum = texel[MASK_VOLUME] - nearest > sum ? texel[MASK_VOLUME] - nearest : sum;
        }
    }
    most[0] = most[1] = sum * (1 + 0x1p-16f) + 0x1p-20f;
}

static double width(const void *ctx, const ss_rim_vertex *vertex) {
    const ss_frame *frame = ctx;
    return fmax(0, WIDER * ss_frame_rate(frame) * (frame->far_h - vertex->h)) + RAISE;
}

static softshadow_status draw_mask(const ss_stage *stage, masking *m, const ss_silhouette *found) {
    ss_rim_style style = {.width = width, .ctx = m->frame, .inside = true};
    const float words[] = {m->per_texel, m->near};
    ss_raster_ink ink = {.shade = shade,
                         .ctx = m,
                         .offer_glsl = offer_glsl,
                         .first_key = SS_MAP_FAR,
                         .keep = keep,
                         .keep_ctx = m,
                         .least = least_rise,
                         .room = room,
                         .tiler = m->side <= SS_OFFER_SIDE
                                      ? SS_OFFERS_OF(ss_offers_mask, stage->rung)
                                      : NULL};
    ss_offer_face tiled = {.depth = m->depth, .texels = m->texels, .side = m->side,
                           .per_texel = m->per_texel, .texels_per = 1 / m->per_texel, .near = m->near};
    ss_rim rim;
    uint8_t *unseen = NULL;
    ss_raster_polygon *polygons = NULL;
    size_t count = 0;
    softshadow_status status = ss_rim_build(&rim, stage, found, m->frame, m->side);
    m->rim = &rim;
    if (!status) status = ss_rim_find_hidden(stage, &rim, m->depth, m->side, m->near, &unseen);
    style.hidden = unseen;
    style.depth = m->depth, style.side = m->side, style.past = m->near;
    style.sky = ink.tiler && stage->raster->tiles;
    if (!status) status = ss_rim_draw(&rim, &style, stage->pool, &polygons, &count);
    if (!status) {
        tiled.rows = rim.row, ink.tiler_ctx = &tiled;
        ss_rim_tables(&rim, m->depth, m->side, words, sizeof words / sizeof *words, &ink);
        status = stage->raster->keep(polygons, count, m->side, &ink, stage->pool);
    }
    ss_free(polygons), ss_free(unseen);
    ss_rim_free(&rim);
    return status;
}

/* ---- what shadows ---------------------------------------------------------------------------- */

typedef struct weaving {
    ss_midpoints midpoints;
    float *texels;
} weaving;

/* The volumes are still to come. */
static softshadow_status weave_rows(void *ctx, uint64_t begin, uint64_t end) {
    const weaving *w = ctx;
    const uint32_t side = w->midpoints.side;
    float *row = ss_alloc(3 * (size_t)side, sizeof *row);
    if (!row) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for a row of a map");
    float *compared = row, *volume = row + side, *edge = volume + side;
    for (uint32_t x = 0; x < side; x++) volume[x] = SS_MAP_FAR;
    for (uint64_t y = begin; y < end; y++) {
        const float *channel[MASK_CHANNELS] = {[MASK_SURFACE] = w->midpoints.layer + y * side,
                                               [MASK_COMPARED] = compared,
                                               [MASK_VOLUME] = volume,
                                               [MASK_EDGE] = edge};
        ss_midpoints_row(&w->midpoints, (uint32_t)y, compared);
        ss_light_maps_weave(channel, MASK_CHANNELS, side, w->texels + y * side * MASK_CHANNELS);
    }
    ss_free(row);
    return SOFTSHADOW_OK;
}

/* ---- building -------------------------------------------------------------------------------- */

static softshadow_status build_face(const ss_stage *stage, mask_state *mask, uint32_t face,
                                    const ss_silhouette *found) {
    const ss_light_maps *maps = &mask->maps;
    const ss_frame *frame = &maps->frames.face[face];
    const uint32_t side = maps->frames.resolution;
    float *texels = maps->plane + (size_t)face * side * side * MASK_CHANNELS;
    weaving w = {ss_midpoints_of(stage, frame, side), texels};
    w.midpoints.layer = ss_light_maps_layer(maps, face, 0);
    w.midpoints.next = ss_light_maps_layer(maps, face, 1);
    masking m = {.frame = frame,
                 .depth = w.midpoints.layer,
                 .texels = texels,
                 .side = side,
                 .per_texel = (float)(1 / (WIDER * ss_frame_rate(frame)))};
    m.near = fminf(m.per_texel, (float)(NEAR * frame->texel));
    softshadow_status status = ss_parallel_for(stage->pool, side, 16, weave_rows, &w);
    if (!status) status = draw_mask(stage, &m, found);
    ss_lamp_make(&mask->lamp[face], stage->light, frame);
    return status;
}

static ss_light_maps_answer answer;

static softshadow_status draw(const ss_stage *stage, mask_state *mask,
                              const ss_silhouette *found) {
    ss_light_maps *maps = &mask->maps;
    softshadow_status status =
        ss_light_maps_add_any(maps, "penumbra-mask", MASK_CHANNELS, answer);
    maps->channel_names = "surface,compared,volume,edge";
    for (uint32_t face = 0; face < maps->frames.count && !status; face++)
        status = build_face(stage, mask, face, found);
    ss_light_maps_drop_layers(maps);
    return status;
}

/* What lies below the first surface only matters where there are silhouettes. */
static softshadow_status build_part(const ss_stage *stage, void **state) {
    const ss_params *params = stage->params;
    const bool point = stage->light->point;
    ss_light_maps_wish wish = {.state_size = sizeof(mask_state),
                               .slope_texels = 1.5,
                               .bare = !point,
                               .margin = true};
    ss_silhouette found = {0};
    softshadow_status status = ss_light_maps_fit(stage, &wish, state);
    if (status) return status;
    mask_state *mask = *state;
    mask->taps = params->mask_taps, mask->seed = params->seed;
    mask->blur = params->blur == 1 ? BLUR : params->blur;
    mask->paper = params->falloff == SOFTSHADOW_FALLOFF_PAPER;
    if (!point && mask->maps.frames.count) status = ss_rim_find(stage, &found);
    mask->maps.silhouette_edges = found.count, wish.below = found.count > 0;
    if (!status) status = ss_light_maps_draw(stage, &wish, &mask->maps);
    if (!status && found.count) status = draw(stage, mask, &found);
    ss_silhouette_free(&found);
    if (status) ss_light_maps_destroy(mask), *state = NULL;
    return status;
}

/* ---- asking ---------------------------------------------------------------------------------- */

static const float *texel_at(const mask_state *mask, const ss_looks *looks, size_t i) {
    const size_t row = (uint32_t)looks->y[i], column = (uint32_t)looks->x[i];
    return mask->maps.plane +
           (looks->base[i] + row * mask->maps.frames.resolution + column) * MASK_CHANNELS;
}

static inline bool in_mask(const float *texel, float h) {
    return h - texel[MASK_VOLUME] > SS_MAP_ALIKE * fabsf(h);
}

/* One point, and the face it looks at. */
typedef struct asked {
    const mask_state *mask;
    const float *texels;
    ss_lamp_view view;
    double from_light[2][2]; /* the light's coordinates to texels, for a unit of h */
    double x, y;
    float h;
    double gap; /* h_r - h_o */
} asked;

/* A column's or a row's number, within the map. */
static inline size_t cell_of(const asked *a, double at) {
    const double most = a->mask->maps.frames.resolution - 1.0;
    return (size_t)(int64_t)(at > 0 ? at < most ? at : most : 0);
}

static inline const float *texel_of(const asked *a, size_t column, size_t row) {
    return a->texels + (row * a->mask->maps.frames.resolution + column) * MASK_CHANNELS;
}

static inline const float *place(const asked *a, double x, double y) {
    return texel_of(a, cell_of(a, x), cell_of(a, y));
}

/* d_o: the mean over the volumes that hold the point, in a region as wide as the filter of the one
 * at hand. */
static double mean_edge(const asked *a, const float *texel) {
    const double gap = (double)a->h - texel[MASK_EDGE];
    double sum = 0;
    int n = 0;
    size_t column[2 * AROUND + 1];
    for (int i = -AROUND; i <= AROUND; i++)
        column[i + AROUND] = cell_of(a, a->x + gap * a->view.reach[0] * i / AROUND);
    for (int j = -AROUND; j <= AROUND; j++) {
        const size_t row = cell_of(a, a->y + gap * a->view.reach[1] * j / AROUND);
        for (int i = 0; i <= 2 * AROUND; i++) {
            const float *t = texel_of(a, column[i], row);
            if (in_mask(t, a->h)) sum += t[MASK_EDGE], n++;
        }
    }
    return n ? sum / n : texel[MASK_EDGE];
}

/* Where on the map the light's place (s, t) is seen past something h_r - h = 1 away, and how far it
 * is from the light's centre, in radii. */
typedef struct aim {
    double x, y, away;
} aim;

static inline bool before_light(const asked *a, const float *texel, const aim *at, double gap) {
    return a->mask->paper || (double)a->h - texel[MASK_SURFACE] >= at->away * gap;
}

/* Does what is in a texel hide that place? If it is too near to the point to stand before it, what
 * is as near as that has to: the thing itself, or nothing but a slope the point lies on. */
static inline float open_at(const asked *a, const float *texel, const aim *at) {
    if (!(texel[MASK_COMPARED] < a->h)) return 1;
    if (before_light(a, texel, at, a->gap)) return 0;
    const double gap = (double)a->h - texel[MASK_SURFACE];
    const float *own = place(a, a->x + gap * at->x, a->y + gap * at->y);
    return own[MASK_COMPARED] < a->h && before_light(a, own, at, gap) ? 0 : 1;
}

/* floor(), which the least instruction set has not. */
static inline double lower_of(double x) {
    if (!(fabs(x) < 0x1p52)) return x;
    const double whole = (double)(int64_t)x;
    return whole > x ? whole - 1 : whole;
}

/* One tap at (s, t) on the light, compared with four texels: graphics hardware's filter. */
static float tap(const asked *a, double s, double t, double away) {
    const aim at = {a->from_light[0][0] * s + a->from_light[0][1] * t,
                    a->from_light[1][0] * s + a->from_light[1][1] * t, away};
    const double x = a->x + a->gap * at.x - .5, y = a->y + a->gap * at.y - .5;
    const double left = lower_of(x), low = lower_of(y);
    const float u = (float)(x - left), v = (float)(y - low);
    const size_t column[2] = {cell_of(a, left), cell_of(a, left + 1)};
    const size_t row[2] = {cell_of(a, low), cell_of(a, low + 1)};
    const float below = (1 - u) * open_at(a, texel_of(a, column[0], row[0]), &at) +
                        u * open_at(a, texel_of(a, column[1], row[0]), &at);
    const float above = (1 - u) * open_at(a, texel_of(a, column[0], row[1]), &at) +
                        u * open_at(a, texel_of(a, column[1], row[1]), &at);
    return (1 - v) * below + v * above;
}

static uint64_t hash_of(const asked *a) {
    const uint64_t x = (uint64_t)(int64_t)(a->x * 256), y = (uint64_t)(int64_t)(a->y * 256);
    return ss_hash(ss_hash(x << 32 ^ y) + a->mask->seed);
}

#define PLACES 64 /* of taps that are found at once: nothing about them has to be guessed */

/* Places on the light of taps from k on, n x n cells, a tap anywhere in each (5.2), and how far
 * they are from its centre. */
static void find_places(const asked *a, bool disk, uint64_t hash, uint32_t k, uint32_t count,
                        double place[PLACES][3]) {
    const uint32_t n = a->mask->taps;
    const double per = 2.0 / n;
    uint32_t column = k % n, row = k / n;
    for (uint32_t i = 0; i < count; i++, column++) {
        const uint64_t jitter = ss_hash(hash + k + i);
        double *st = place[i];
        if (column == n) column = 0, row++;
        st[0] = (column + (double)(uint32_t)jitter * 0x1p-32) * per - 1;
        st[1] = (row + (double)(jitter >> 32) * 0x1p-32) * per - 1;
        st[2] = disk ? ss_square_to_disk(st) : fmax(fabs(st[0]), fabs(st[1]));
    }
}

static float filter(const asked *a) {
    const ss_light *light = &a->mask->maps.light;
    const bool disk = a->view.lamp->disk && !a->mask->paper;
    const uint32_t taps = a->mask->taps * a->mask->taps;
    const uint64_t hash = hash_of(a);
    double sum = 0, all = 0;
    for (uint32_t k = 0; k < taps; k += PLACES) {
        const uint32_t count = taps - k < PLACES ? taps - k : PLACES;
        double place[PLACES][3];
        find_places(a, disk, hash, k, count, place);
        for (uint32_t i = 0; i < count; i++) {
            const double *at = place[i];
            const double weight = light->profile_count ? ss_light_profile(light, at[2]) : 1;
            sum += weight * tap(a, at[0], at[1], at[2]), all += weight;
        }
    }
    return all > 0 ? (float)(sum / all) : 1;
}

static void invert(const double m[2][2], double out[2][2]) {
    const double det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    out[0][0] = m[1][1] / det, out[0][1] = -m[0][1] / det;
    out[1][0] = -m[1][0] / det, out[1][1] = m[0][0] / det;
}

static float seen_by(const mask_state *mask, const ss_looks *looks, size_t i) {
    const float *texel = texel_at(mask, looks, i);
    const uint32_t face = looks->face[i], side = mask->maps.frames.resolution;
    const float hard = texel[MASK_COMPARED] < looks->h[i] ? 0 : 1;
    if (!in_mask(texel, looks->h[i])) return hard;
    asked a = {.mask = mask,
               .texels = mask->maps.plane + (size_t)face * side * side * MASK_CHANNELS,
               .x = looks->x[i],
               .y = looks->y[i],
               .h = looks->h[i]};
    if (!ss_lamp_see(&mask->lamp[face], a.x, a.y, a.h, &a.view)) return hard;
    invert(a.view.to_light, a.from_light);
    a.gap = (mask->paper ? .5 : 1) * ((double)a.h - mean_edge(&a, texel));
    return filter(&a);
}

static void answer(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    for (size_t i = 0; i < n; i++) out[i] = seen_by((const mask_state *)maps, looks, i);
}

/* Counts the points that took taps, and marks them where an image will be blurred. */
static void mark(const mask_state *mask, const ss_point *points, size_t n, bool marks,
                 float *visibility, ss_counts *counts) {
    for (size_t first = 0; first < n; first += SS_LOOKS) {
        const size_t m = n - first < SS_LOOKS ? n - first : SS_LOOKS;
        ss_looks looks;
        ss_places places;
        ss_light_maps_place(points + first, m, &places);
        ss_frames_look(&mask->maps.frames, &places, m, &looks);
        for (size_t i = 0; i < m; i++) {
            if (!in_mask(texel_at(mask, &looks, i), looks.h[i])) continue;
            counts->traced++;
            if (marks) visibility[first + i] = -visibility[first + i];
        }
    }
}

static softshadow_status query(const ss_stage *stage, const void *state, const ss_point *points,
                               size_t n, float *visibility, float *bound, ss_arena *scratch,
                               ss_counts *counts) {
    const mask_state *mask = state;
    const softshadow_status status =
        ss_light_maps_query(stage, state, points, n, visibility, bound, scratch, counts);
    if (!status && mask->maps.plane) {
        mark(mask, points, n, stage->rows && mask->blur, visibility, counts);
    }
    return status;
}

static softshadow_status finish(const ss_stage *stage, const void *state, const ss_image *image,
                                ss_pool *pool, ss_counts *counts) {
    const mask_state *mask = state;
    if (!mask->maps.plane || !mask->blur) return SOFTSHADOW_OK;
    return ss_blur(image, mask->blur, stage->raster, pool, counts);
}

/* ---- the same on a GPU ----------------------------------------------------------------------- */

/* ss_hash() in halves, the lower one first. */
#define HASH_GLSL \
    "uvec2 add64(uvec2 a, uvec2 b) {\n" \
    "    uint carry, low = uaddCarry(a.x, b.x, carry);\n" \
    "    return uvec2(low, a.y + b.y + carry);\n" \
    "}\n" \
    "uvec2 mul64(uvec2 a, uvec2 b) {\n" \
    "    uint high, low;\n" \
    "    umulExtended(a.x, b.x, high, low);\n" \
    "    return uvec2(low, high + a.x * b.y + a.y * b.x);\n" \
    "}\n" \
    "uvec2 mix64(uvec2 a, int by) { return a ^ uvec2(a.x >> by | a.y << (32 - by), a.y >> by); }\n" \
    "uvec2 hash64(uvec2 x) {\n" \
    "    x = add64(x, uvec2(0x7f4a7c15u, 0x9e3779b9u));\n" \
    "    x = mul64(mix64(x, 30), uvec2(0x1ce4e5b9u, 0xbf58476du));\n" \
    "    x = mul64(mix64(x, 27), uvec2(0x133111ebu, 0x94d049bbu));\n" \
    "    return mix64(x, 31);\n" \
    "}\n"

/* words[1] to [6]: taps, the seed's halves, paper, is the light a disk, how many numbers its
 * profile has. Where a tap or an edge's depth is looked up on the line between two texels, floats
 * may take the other. The sign bit says that the point was in the mask. */
static const char glsl[] = SS_LIGHT_MAPS_GLSL SS_LAMP_VIEW_GLSL HASH_GLSL
    "layout(std430, binding = 6) readonly buffer Profile { float profile[]; };\n"
    "struct Asked { vec3 look; uint base; mat2 from_light; float gap; };\n"
    "vec4 texel_at(uint at) {\n"
    "    return vec4(planes[at * 4u], planes[at * 4u + 1u], planes[at * 4u + 2u], planes[at * 4u + 3u]);\n"
    "}\n"
    "vec4 place(Asked a, vec2 at) {\n"
    "    float most = float(side()) - 1.0;\n"
    "    uint column = uint(at.x > 0.0 ? at.x < most ? at.x : most : 0.0);\n"
    "    uint row = uint(at.y > 0.0 ? at.y < most ? at.y : most : 0.0);\n"
    "    return texel_at(a.base + row * side() + column);\n"
    "}\n"
    "bool in_mask(vec4 texel, float h) { return h - texel.z > 4.76837158203125e-7 * abs(h); }\n"
    "float mean_edge(Asked a, vec2 reach, float own) {\n"
    "    float gap = a.look.z - own, sum = 0.0, n = 0.0;\n"
    "    for (int j = -2; j <= 2; j++) {\n"
    "        for (int i = -2; i <= 2; i++) {\n"
    "            vec4 t = place(a, a.look.xy + gap * reach * vec2(i, j) / 2.0);\n"
    "            if (in_mask(t, a.look.z)) sum += a.look.z - t.w, n += 1.0;\n"
    "        }\n"
    "    }\n"
    "    return n > 0.0 ? sum / n : gap;\n"
    "}\n"
    "bool before_light(Asked a, vec4 texel, float away, float gap) {\n"
    "    return words[4] != 0.0 || a.look.z - texel.x >= away * gap;\n"
    "}\n"
    "float open_at(Asked a, vec4 texel, vec2 aim, float away) {\n"
    "    if (!(texel.y < a.look.z)) return 1.0;\n"
    "    if (before_light(a, texel, away, a.gap)) return 0.0;\n"
    "    float gap = a.look.z - texel.x;\n"
    "    vec4 own = place(a, a.look.xy + gap * aim);\n"
    "    return own.y < a.look.z && before_light(a, own, away, gap) ? 0.0 : 1.0;\n"
    "}\n"
    "float tap(Asked a, vec2 st, float away) {\n"
    "    vec2 aim = a.from_light * st, at = a.look.xy + a.gap * aim - 0.5, low = floor(at);\n"
    "    vec2 share = at - low;\n"
    "    float below = (1.0 - share.x) * open_at(a, place(a, low), aim, away) +\n"
    "                  share.x * open_at(a, place(a, low + vec2(1.0, 0.0)), aim, away);\n"
    "    float above = (1.0 - share.x) * open_at(a, place(a, low + vec2(0.0, 1.0)), aim, away) +\n"
    "                  share.x * open_at(a, place(a, low + 1.0), aim, away);\n"
    "    return (1.0 - share.y) * below + share.y * above;\n"
    "}\n"
    "vec2 to_disk(vec2 st) {\n"
    "    if (st == vec2(0.0)) return st;\n"
    "    bool wide = abs(st.x) > abs(st.y);\n"
    "    float radius = wide ? st.x : st.y;\n"
    "    float turn = wide ? 0.785398163 * (st.y / st.x) : 1.57079633 - 0.785398163 * (st.x / st.y);\n"
    "    return radius * vec2(cos(turn), sin(turn));\n"
    "}\n"
    "float profile_at(float away) {\n"
    "    uint count = uint(words[6]);\n"
    "    if (count < 2u) return count == 0u ? 1.0 : profile[0];\n"
    "    float at = min(away, 1.0) * float(count - 1u);\n"
    "    uint i = min(uint(at), count - 2u);\n"
    "    float share = at - float(i);\n"
    "    return (1.0 - share) * profile[i] + share * profile[i + 1u];\n"
    "}\n"
    "float filtered(Asked a) {\n"
    "    uint n = uint(words[1]);\n"
    "    uvec2 seed = uvec2(uint(words[2]) | uint(words[3]) << 16, 0u);\n"
    "    uvec2 at = uvec2(a.look.yx * 256.0), hash = hash64(add64(hash64(at), seed));\n"
    "    float sum = 0.0, all = 0.0;\n"
    "    for (uint k = 0u; k < n * n; k++) {\n"
    "        vec2 jitter = vec2(hash64(add64(hash, uvec2(k, 0u)))) * 2.3283064365386963e-10;\n"
    "        vec2 st = 2.0 * (vec2(k % n, k / n) + jitter) / float(n) - 1.0;\n"
    "        if (words[5] != 0.0) st = to_disk(st);\n"
    "        float away = words[5] != 0.0 ? sqrt(dot(st, st)) : max(abs(st.x), abs(st.y));\n"
    "        float weight = profile_at(away);\n"
    "        sum += weight * tap(a, st, away), all += weight;\n"
    "    }\n"
    "    return all > 0.0 ? sum / all : 1.0;\n"
    "}\n"
    "float marked(float seen) { return uintBitsToFloat(floatBitsToUint(seen) | 0x80000000u); }\n"
    "float answer(vec3 look, uint face) {\n"
    "    uint base = base_of(face);\n"
    "    vec4 texel = texel_at(base + uint(look.y) * side() + uint(look.x));\n"
    "    float hard = texel.y < look.z ? 0.0 : 1.0;\n"
    "    View v;\n"
    "    if (!in_mask(texel, look.z)) return hard;\n"
    "    if (!lamp_see(face, look, v)) return marked(hard);\n"
    "    float det = v.row[0].x * v.row[1].y - v.row[0].y * v.row[1].x;\n"
    "    mat2 from = mat2(v.row[1].y, -v.row[1].x, -v.row[0].y, v.row[0].x) * (1.0 / det);\n"
    "    Asked a = Asked(look, base, from, 0.0);\n"
    "    a.gap = mean_edge(a, v.reach, texel.w) * (words[4] != 0.0 ? 0.5 : 1.0);\n"
    "    return marked(filtered(a));\n"
    "}\n";

static softshadow_status tables(void *state, ss_raster_question *question) {
    mask_state *mask = state;
    ss_light_maps *maps = &mask->maps;
    const ss_light *light = &maps->light;
    if (!maps->plane) return ss_light_maps_tables_hard(state, question);
    maps->words[1] = (float)mask->taps;
    maps->words[2] = (float)(mask->seed & 0xffff), maps->words[3] = (float)(mask->seed >> 16);
    maps->words[4] = mask->paper, maps->words[5] = mask->lamp[0].disk && !mask->paper;
    maps->words[6] = (float)light->profile_count;
    for (uint32_t i = 0; i < maps->frames.count; i++) {
        ss_lamp_words(&mask->lamp[i], ss_light_maps_words(maps, i));
    }
    const softshadow_status status = ss_light_maps_ask(maps, glsl, question);
    question->table[question->tables++] =
        (ss_raster_table){light->profile, light->profile_count * sizeof *light->profile};
    return status;
}

/* Answers whose sign says that they took taps: what query() does with those. */
static void horizon(const ss_stage *stage, const void *state, const ss_point *points, size_t n,
                    float *visibility, float *bound, ss_counts *counts) {
    const mask_state *mask = state;
    const bool marks = stage->rows && mask->blur;
    for (size_t first = 0; first < n; first += SS_LOOKS) {
        const size_t m = n - first < SS_LOOKS ? n - first : SS_LOOKS;
        float *out = visibility + first;
        bool taken[SS_LOOKS];
        for (size_t i = 0; i < m; i++) {
            taken[i] = signbit(out[i]);
            counts->traced += taken[i], out[i] = fabsf(out[i]);
        }
        ss_light_maps_horizon(stage, state, points + first, m, out, bound ? bound + first : NULL,
                              counts);
        for (size_t i = 0; i < m && marks; i++) out[i] = taken[i] ? -out[i] : out[i];
    }
}

static const ss_technique part = {
    .build = build_part,
    .query = query,
    .finish = finish,
    .tables = tables,
    .look = ss_light_maps_look,
    .horizon = horizon,
    .destroy = ss_light_maps_destroy,
    .bytes = ss_light_maps_bytes,
    .map_count = ss_light_maps_count,
    .get_map = ss_light_maps_get,
    .silhouette_edges = ss_light_maps_silhouettes,
    .casters_culled = ss_light_maps_culled,
};

static softshadow_status build(const ss_stage *stage, void **state) {
    return ss_parts_build(stage, &part, state);
}

const ss_technique ss_penumbra_mask = {
    .name = "penumbra-mask",
    .title = "penumbra volumes as a mask for percentage-closer filtering",
    .cite = "Cou05",
    .notes =
        "Noisy: mask_taps x mask_taps jittered taps a point, only inside the mask. blur: over so many "
        "pixels where the points are rows of an image, 1 for 12, never across ids. One depth of edges "
        "for all that blocks, and only what the light's centre, or that of a part of it, sees. falloff: only paper makes a "
        "difference, the taps have the light's shape.",
    .needs = SS_NEEDS_SILHOUETTES,
    .bound_kind = SOFTSHADOW_BOUND_NONE,
    .lights_native = SS_LIGHTS_ALL,
    .weightings = 1u << SOFTSHADOW_UNIFORM,
    .build = build,
    .finish = ss_parts_finish,
    .query_glsl = glsl,
    SS_PARTS_ROWS,
};
