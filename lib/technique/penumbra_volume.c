/* penumbra-volume: volumes around the penumbrae of silhouette edges, and the light cut by the edge.
 *
 * based on: [Cou05] chapter 4: inner and outer volumes (4.1.2), the depth map of the volumes and
 * the two maps of end points, drawn in one pass (4.1.3), the light cut by the plane through point
 * and edge (4.2, listing 4.2), the light divided in sub-lights against the single-silhouette
 * artefact (4.3, in parts.c). Differs, and why:
 * - The thesis cuts a disk that stands perpendicular to the cutting plane and adds 3 k^2 - 2 k^3;
 *   its equation 4.1 as printed is that of the hidden part. Here the light's own shape is cut: a
 *   disk along the line in which the plane meets it, a sphere's disk as the point sees it.
 *   falloff=paper does as the thesis.
 * - Its volumes are mitred: they meet where the planes of neighbouring edges do, and at a corner
 *   the shadow of either edge goes on for ever. Between the volumes of two edges there is a piece
 *   of a disc around the vertex instead, and what cuts the light there is a line through the vertex
 *   across the way to the point. Under falloff=paper the piece is divided as by a mitre.
 * - Where volumes overlap in the map the thesis keeps the nearest one, whatever it belongs to. Here
 *   the edge is kept that passes nearest to the light's centre, in light radii, as the texel's
 *   receiver sees it; silhouettes that something nearer hides, and the sides of volumes that are
 *   not before anything, are left out. Points below a surface that the light past the edge falls on
 *   are dark. Likewise.
 * - Depths are h of map/frame.h, in which volumes are planar in perspective, too; the map is a
 *   little wider than the penumbra, and the result is filtered over 2 x 2 texels: never depths or
 *   end points.
 */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"
#include "base/vec.h"
#include "technique/light_maps.h"
#include "technique/map_techniques.h"
#include "technique/offers.h"
#include "technique/parts.h"
#include "technique/rim.h"

/* A texel: the depth at which its volume begins (SS_MAP_FAR: none); the depth at which it ends,
 * where a surface takes what light there is; and the edge, end by end in local coordinates, the
 * occluder on its left as the light sees it. */
enum { VOLUME_DEPTH, VOLUME_END, VOLUME_FROM, VOLUME_TO = VOLUME_FROM + 3, VOLUME_CHANNELS = 8 };

/* How much wider volumes are drawn than half a penumbra: an edge that sinks along its way has a
 * wider one, and so has a sphere that is near. And texels on top, because a place between four asks
 * all. */
#define WIDER    1.25
#define RAISE    2
#define SLOPE    1.5 /* texels to either side: the hard shadow's depths are the deepest there */
#define NEAR     4   /* so steep a surface, 76 degrees, is still the occluder's */

typedef struct volume_state {
    ss_light_maps maps;
    double radius; /* of the disk or sphere that is cut */
    bool paper;
} volume_state;

/* ---- volumes -------------------------------------------------------------------------------- */

typedef struct volumes {
    const ss_frame *frame;
    const ss_rim *rim;
    const float *depth; /* of this face */
    float *texels, *key;
    float (*ends)[VOLUME_CHANNELS]; /* of each edge, as a texel has them */
    struct turn *turns;             /* of each vertex */
    uint32_t side;
    float per_texel; /* of distance, in h: the light's cone */
    float climb;     /* the same of the volumes, which are wider */
    float near;      /* how much a surface may sink from one texel to the next and still be one */
    float steep;     /* and how much deeper than the edge the map may have it there */
    float far;
    bool mirrored, paper;
} volumes;

/* What is offered to a texel. */
typedef struct offer {
    float away;  /* from the edge, in texels, > 0 outside */
    float edge;  /* h of the edge there */
    float open;  /* how far down the light gets past the edge */
    float depth; /* of the texel */
} offer;

/* Does the volume stand before anything here? Inside, the occluder has to cover the texel; outside,
 * there has to be a receiver that the penumbra has begun on. At the edge snapping decides what
 * covers the texel's centre. */
static bool matters(const volumes *v, const offer *o, float rise) {
    if (o->open < o->edge - v->near) return false;
    if (o->away <= 0) return o->depth < o->edge + v->steep - v->near * o->away;
    if (o->away <= 1) return o->depth > o->edge - v->near;
    return o->depth > o->edge && o->depth > o->edge + rise;
}

/* By which the texel's edge is chosen: how far it passes from the light's centre. */
static float key_of(const volumes *v, const offer *o, float rise) {
    const float receiver = o->depth < v->far && o->away > 0 ? o->depth : v->far;
    if (v->paper) return o->edge + rise;
    const float gap = receiver - o->edge;
    return fabsf(o->away) * v->per_texel / (gap > v->near ? gap : v->near);
}

/* Where the volume begins; what covers the texel is not behind the edge, however deep it sinks. */
static float begin_of(const volumes *v, const offer *o, float rise) {
    const float begin = o->edge + rise;
    const bool covered = o->away <= 0 || (o->away <= 1 && o->depth < o->edge + v->steep);
    return covered && !v->paper && o->depth > begin ? o->depth : begin;
}

/* Where the volume ends for good: outside on the surface in the map, inside on the one that light
 * past the edge falls on; there it may have sunk on its way. */
static float end_of(const volumes *v, const offer *o) {
    const float sunk = o->edge + v->steep;
    if (v->paper || (o->away <= 0 && o->open == SS_MAP_FAR)) return SS_MAP_FAR;
    if (o->away <= 0) return (o->open > sunk ? o->open : sunk) + v->near * (2.5f - o->away);
    return o->away <= 1 && o->depth < sunk ? SS_MAP_FAR : o->depth;
}

/* While volumes are drawn a texel's ends are the tag of what it has them from, in two numbers that
 * floats hold. */
#define TAG_PARTS SS_OFFER_TAG

static void store(void *ctx, uint32_t x, uint32_t y, float key, const float value[4]) {
    const volumes *v = ctx;
    const size_t at = (size_t)y * v->side + x;
    float *texel = v->texels + at * VOLUME_CHANNELS;
    v->key[at] = key;
    texel[VOLUME_DEPTH] = value[0], texel[VOLUME_END] = value[1];
    texel[VOLUME_FROM] = value[2], texel[VOLUME_FROM + 1] = value[3];
}

/* The longest way from an edge to a receiver, a little more. */
static inline float deepest(const volumes *v, float edge) {
    const float gap = v->far - edge;
    return (gap > v->near ? gap : v->near) * (1 + 0x1p-16f);
}

/* A disc (where more than two edges meet) is inside where it is covered; on a vertex the edges that
 * meet there have what there is. */
static void shade(void *ctx, const ss_raster_run *run) {
    const volumes *v = ctx;
    const size_t first = (size_t)run->y * v->side + run->x;
    for (uint32_t i = 0; i < run->n; i++) {
        const float edge = run->attribute[1][i], depth = v->depth[first + i];
        const float size = fabsf(ss_rim_away(run, i)); /* most are too far away, on either side */
        if (!v->paper && !(size * v->per_texel < v->key[first + i] * deepest(v, edge))) continue;
        const ss_rim_foot foot = ss_rim_foot_of(v->rim, run, i, depth < edge + v->steep);
        if (foot.outwards[0] == 0 && foot.outwards[1] == 0) continue;
        const offer o = {foot.away, edge,
                         ss_rim_open(v->depth, v->side, foot.place, foot.outwards), depth};
        const float beyond = fabsf(o.away) - RAISE, rise = beyond > 0 ? beyond * v->climb : 0;
        const float key = key_of(v, &o, rise);
        if (!(key < v->key[first + i]) || (!v->paper && !matters(v, &o, rise))) continue;
        const uint32_t tag = run->tag | (foot.inside ? SS_RIM_INSIDE : 0);
        const float value[4] = {begin_of(v, &o, rise), end_of(v, &o), (float)(tag / TAG_PARTS),
                                (float)(tag % TAG_PARTS)};
        store(ctx, run->x + i, run->y, key, value);
    }
}

/* Outside is kind 0; a disc may be inside. */
static float least_away(const void *ctx, uint32_t tag, const float *low, const float *high,
                        int *kind) {
    const volumes *v = ctx;
    *kind = ss_rim_reaches_in(tag, low);
    return v->paper ? 0 : ss_rim_least(tag, low, high) * v->per_texel;
}

/* By key_of() and matters(). */
static void room(const void *ctx, const uint32_t box[4], float nearest, float most[2]) {
    const volumes *v = ctx;
    most[0] = most[1] = v->paper ? INFINITY : 0;
    for (uint32_t y = box[1]; y <= box[3] && !v->paper; y++) {
        for (uint32_t x = box[0]; x <= box[2]; x++) {
            const size_t at = (size_t)y * v->side + x;
            const float depth = v->depth[at], receiver = depth < v->far ? depth : v->far;
            const float gap = receiver - nearest > v->near ? receiver - nearest : v->near;
            const float begun = (depth - nearest) / v->climb * v->per_texel + RAISE * v->per_texel;
            const float by_key = v->key[at] * gap, out = by_key < begun ? by_key : begun;
            const float in = v->key[at] * deepest(v, nearest);
            most[0] = out > most[0] ? out : most[0];
            most[1] = in > most[1] ? in : most[1];
        }
    }
    most[0] *= 1 + 0x1p-16f;
}

/* words: per_texel, climb, near, steep, far, paper. All the above. */
static const char offer_glsl[] = SS_RIM_GLSL
    "bool matters(float depth, float edge, float away, float open, float rise) {\n"
    "    precise float above = edge - words[2], below = edge + words[3] - words[2] * away;\n"
    "    precise float begun = edge + rise;\n"
    "    if (open < above) return false;\n"
    "    if (away <= 0.0) return depth < below;\n"
    "    if (away <= 1.0) return depth > above;\n"
    "    return depth > edge && depth > begun;\n"
    "}\n"
    "float end_of(float depth, float edge, float away, float open) {\n"
    "    precise float sunk = edge + words[3], lower = words[2] * (2.5 - away);\n"
    "    precise float end = (open > sunk ? open : sunk) + lower;\n"
    "    if (words[5] != 0.0 || (away <= 0.0 && open == 1e30)) return 1e30;\n"
    "    if (away <= 0.0) return end;\n"
    "    return away <= 1.0 && depth < sunk ? 1e30 : depth;\n"
    "}\n"
    "bool offer(uint tag, ivec2 texel, vec4 varied, precise out float key, out vec4 value) {\n"
    "    float depth = depth_at(texel), edge = varied.y;\n"
    "    precise float sunk = edge + words[3];\n"
    "    Foot f = rim_foot(tag, texel, varied, depth < sunk);\n"
    "    float away = f.away, open = rim_open(f);\n"
    "    precise float beyond = abs(away) - 2.0, rise = beyond > 0.0 ? beyond * words[1] : 0.0;\n"
    "    precise float begin = edge + rise;\n"
    "    float receiver = depth < words[4] && away > 0.0 ? depth : words[4];\n"
    "    precise float gap = receiver - edge;\n"
    "    key = words[5] != 0.0 ? begin : abs(away) * words[0] / (gap > words[2] ? gap : words[2]);\n"
    "    bool covered = away <= 0.0 || (away <= 1.0 && depth < sunk);\n"
    "    uint side = tag | (f.inside ? 2u : 0u);\n"
    "    value.x = covered && words[5] == 0.0 && depth > begin ? depth : begin;\n"
    "    value.y = end_of(depth, edge, away, open);\n"
    "    value.zw = vec2(side / 4096u, side % 4096u);\n"
    "    return f.outwards != vec2(0.0) && (words[5] != 0.0 || matters(depth, edge, away, open, rise));\n"
    "}\n";

/* ---- the edges' ends ------------------------------------------------------------------------ */

/* A depth as it takes map coordinates to local ones: what they are divided by, and how far along
 * the axis. */
typedef struct level {
    double scale, along;
} level;

static level level_of(const ss_frame *frame, double h) {
    const double s = 1 - h * frame->inverse;
    return (level){s, h / s};
}

/* Map coordinates to local ones. */
static void lift(const ss_frame *frame, double column, double row, const level *at,
                 float out[3]) {
    const double x = (frame->low[0] + column * frame->texel) / at->scale;
    const double y = (frame->low[1] + row * frame->texel) / at->scale;
    for (int k = 0; k < 3; k++) {
        out[k] = (float)(frame->origin[k] + x * frame->x[k] + y * frame->y[k] +
                         at->along * frame->z[k]);
    }
}

/* A vertex of the rim, in local coordinates. */
typedef struct turn {
    level at;
    float end[3];
} turn;

/* The ends of an edge, the occluder on the left as the light sees them. */
static void ends_of(const volumes *v, const ss_rim_edge *edge, float ends[6]) {
    for (int i = 0; i < 2; i++)
        memcpy(ends + 3 * i, v->turns[edge->vertex[v->mirrored ? 1 - i : i]].end,
               sizeof v->turns->end);
}

/* A line through vertex number i with `outwards` on its right, as long as a map's side, which
 * floats hold well. */
static void ends_across(const volumes *v, uint32_t i, const double outwards[2], float ends[6]) {
    const ss_rim_vertex *at = &v->rim->vertex[i];
    const double reach = v->mirrored ? -(double)v->side : v->side;
    memcpy(ends, v->turns[i].end, sizeof v->turns->end);
    lift(v->frame, at->x - reach * outwards[1], at->y + reach * outwards[0], &v->turns[i].at,
         ends + 3);
}

/* The mitre of [Cou05] figure 4.2: of a corner's two edges the one on whose side of it the place
 * is. */
static void mitre(const volumes *v, const ss_rim_vertex *at, const double place[2], float ends[6]) {
    double farthest = -1;
    if (at->in == SS_RIM_NONE || at->out == SS_RIM_NONE) return;
    for (int i = 0; i < 2; i++) {
        const ss_rim_edge *edge = &v->rim->edge[i ? at->out : at->in];
        const double away = fabs(place[0] * edge->along[1] - place[1] * edge->along[0]);
        if (!(away > farthest)) continue;
        farthest = away;
        ends_of(v, edge, ends);
    }
}

static void ends_around(const void *of, uint32_t tag, uint32_t x, uint32_t y, float ends[6]) {
    const volumes *v = of;
    const ss_rim_vertex *at = &v->rim->vertex[tag / SS_RIM_TAG];
    const double place[2] = {x + .5 - at->x, y + .5 - at->y};
    const double length = sqrt(place[0] * place[0] + place[1] * place[1]);
    const double per = length > 0 ? (tag & SS_RIM_INSIDE ? -1 : 1) / length : 0;
    ends_across(v, tag / SS_RIM_TAG, (double[2]){place[0] * per, place[1] * per}, ends);
    if (v->paper && !(tag & SS_RIM_DISC)) mitre(v, at, place, ends);
}

static void ends_at(const volumes *v, uint32_t tag, uint32_t x, uint32_t y, float ends[6]) {
    if (tag & SS_RIM_CORNER) ends_around(v, tag, x, y, ends);
    else memcpy(ends, v->ends[tag / SS_RIM_TAG] + VOLUME_FROM, 6 * sizeof *ends);
}

static softshadow_status settle_rows(void *ctx, uint64_t begin, uint64_t end) {
    const volumes *v = ctx;
    for (uint32_t y = (uint32_t)begin; y < end; y++) {
        for (uint32_t x = 0; x < v->side; x++) {
            float *texel = v->texels + ((size_t)y * v->side + x) * VOLUME_CHANNELS;
            if (texel[VOLUME_DEPTH] == SS_MAP_FAR) continue;
            const uint32_t tag =
                (uint32_t)texel[VOLUME_FROM] * TAG_PARTS + (uint32_t)texel[VOLUME_FROM + 1];
            ends_at(v, tag, x, y, texel + VOLUME_FROM);
        }
    }
    return SOFTSHADOW_OK;
}

/* The penumbra's half width at the farthest receiver, raised. */
static double width(const void *ctx, const ss_rim_vertex *vertex) {
    const ss_frame *frame = ctx;
    return fmax(0, WIDER * ss_frame_rate(frame) * (frame->far_h - vertex->h)) + RAISE;
}

/* ---- building ------------------------------------------------------------------------------- */

/* Does the machine write every texel, whole? */
static bool is_tiled(const ss_stage *stage, uint32_t side) {
    return stage->raster->tiles && side <= SS_OFFER_SIDE;
}

static softshadow_status find_ends(volumes *v) {
    const ss_rim *rim = v->rim;
    v->ends = ss_alloc_any(rim->edge_count, sizeof *v->ends);
    v->turns = ss_alloc_any(rim->vertex_count, sizeof *v->turns);
    if (!v->ends || !v->turns)
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu edges", rim->edge_count);
    for (size_t i = 0; i < rim->vertex_count; i++) {
        const ss_rim_vertex *at = &rim->vertex[i];
        v->turns[i].at = level_of(v->frame, at->h);
        lift(v->frame, at->x, at->y, &v->turns[i].at, v->turns[i].end);
    }
    for (size_t i = 0; i < rim->edge_count; i++)
        ends_of(v, &rim->edge[i], v->ends[i] + VOLUME_FROM);
    return SOFTSHADOW_OK;
}

static softshadow_status draw_volumes(const ss_stage *stage, volumes *v,
                                      const ss_silhouette *found) {
    ss_rim_style style = {.width = width, .ctx = v->frame, .inside = true};
    const float words[] = {v->per_texel, v->climb, v->near, v->steep, v->far, v->paper};
    ss_raster_ink ink = {.shade = shade,
                         .ctx = v,
                         .offer_glsl = offer_glsl,
                         .first_key = SS_MAP_FAR,
                         .keep = store,
                         .keep_ctx = v,
                         .least = least_away,
                         .room = room,
                         .tiler = is_tiled(stage, v->side)
                                      ? SS_OFFERS_OF(ss_offers_volume, stage->rung)
                                      : NULL};
    ss_offer_face tiled = {.around = ends_around,
                           .of = v,
                           .depth = v->depth,
                           .texels = v->texels,
                           .side = v->side,
                           .per_texel = v->per_texel, .texels_per = 1 / v->per_texel,
                           .climb = v->climb,
                           .near = v->near,
                           .steep = v->steep,
                           .far = v->far,
                           .paper = v->paper};
    ss_rim rim;
    uint8_t *unseen = NULL;
    ss_raster_polygon *polygons = NULL;
    size_t count = 0;
    softshadow_status status = ss_rim_build(&rim, stage, found, v->frame, v->side);
    v->rim = &rim;
    if (!status) status = find_ends(v);
    if (!status && !v->paper)
        status = ss_rim_find_hidden(stage, &rim, v->depth, v->side, -v->near, &unseen);
    style.hidden = unseen;
    style.depth = v->depth, style.side = v->side, style.past = -v->near, style.sky = ink.tiler;
    if (!status) status = ss_rim_draw(&rim, &style, stage->pool, &polygons, &count);
    if (!status) {
        tiled.rows = rim.row, tiled.ends = (const float(*)[8])v->ends, ink.tiler_ctx = &tiled;
        ss_rim_tables(&rim, v->depth, v->side, words, sizeof words / sizeof *words, &ink);
        status = stage->raster->keep(polygons, count, v->side, &ink, stage->pool);
    }
    if (!status && !ink.tiler) status = ss_parallel_for(stage->pool, v->side, 16, settle_rows, v);
    ss_free(polygons), ss_free(v->ends), ss_free(v->turns), ss_free(unseen);
    ss_rim_free(&rim);
    return status;
}

static softshadow_status clear_rows(void *ctx, uint64_t begin, uint64_t end) {
    const volumes *v = ctx;
    for (size_t i = begin * v->side; i < end * v->side; i++)
        v->key[i] = v->texels[i * VOLUME_CHANNELS + VOLUME_DEPTH] = SS_MAP_FAR;
    return SOFTSHADOW_OK;
}

static softshadow_status build_face(const ss_stage *stage, volume_state *state,
                                    const ss_silhouette *found, uint32_t face) {
    const ss_light_maps *maps = &state->maps;
    const ss_frame *frame = &maps->frames.face[face];
    const uint32_t side = maps->frames.resolution;
    const size_t n = (size_t)side * side;
    volumes v = {.frame = frame,
                 .depth = maps->depth + face * n,
                 .texels = maps->plane + face * n * VOLUME_CHANNELS,
                 .side = side,
                 .per_texel = (float)(1 / ss_frame_rate(frame)),
                 .climb = (float)(1 / (WIDER * ss_frame_rate(frame))),
                 .far = (float)frame->far_h,
                 .mirrored = ss_frame_mirrored(frame),
                 .paper = state->paper};
    v.near = fminf(v.per_texel, (float)(NEAR * frame->texel));
    v.steep = (float)(2 * SLOPE * SS_MAP_STEEPEST * frame->texel) + v.near;
    if (is_tiled(stage, side)) return draw_volumes(stage, &v, found);
    v.key = ss_alloc_any(n, sizeof *v.key);
    if (!v.key) return ss_fail(SOFTSHADOW_E_MEMORY, "build.resolution: out of memory for a map");
    softshadow_status status = ss_parallel_for(stage->pool, side, 16, clear_rows, &v);
    if (!status) status = draw_volumes(stage, &v, found);
    ss_free(v.key);
    return status;
}

static ss_light_maps_answer answer;

static softshadow_status draw(const ss_stage *stage, volume_state *state) {
    ss_light_maps *maps = &state->maps;
    ss_silhouette found;
    softshadow_status status = ss_rim_find(stage, &found);
    if (status) return status;
    maps->silhouette_edges = found.count;
    if (found.count)
        status = (is_tiled(stage, maps->frames.resolution)
                      ? ss_light_maps_add_any
                      : ss_light_maps_add_plane)(maps, "penumbra-volume", VOLUME_CHANNELS, answer);
    maps->channel_names = "begin,end,from.x,from.y,from.z,to.x,to.y,to.z";
    for (uint32_t face = 0; face < maps->frames.count && found.count && !status; face++) {
        status = build_face(stage, state, &found, face);
    }
    ss_silhouette_free(&found);
    return status;
}

/* v = 3 k^2 - 2 k^3 on top of k, the share of a disk (4.2, equation 4.2 and what follows it). */
static void paper_falloff(ss_falloff *falloff) {
    for (int i = 0; i < SS_FALLOFF_STEPS + 2; i++) {
        const double k = ss_falloff_disk(2.0 * i / SS_FALLOFF_STEPS - 1);
        falloff->value[i] = (float)(k * k * (3 - 2 * k));
    }
}

static softshadow_status build_part(const ss_stage *stage, void **state) {
    const ss_light_maps_wish wish = {
        .state_size = sizeof(volume_state), .slope_texels = SLOPE, .paper = SS_FALLOFF_TABLE};
    softshadow_status status = ss_light_maps_build(stage, &wish, state);
    if (status || stage->light->point) return status;
    volume_state *volume = *state;
    volume->paper = stage->params->falloff == SOFTSHADOW_FALLOFF_PAPER;
    volume->radius = volume->maps.frames.radius;
    if (volume->paper) paper_falloff(&volume->maps.falloff);
    if (volume->maps.frames.count) status = draw(stage, volume);
    if (status) ss_light_maps_destroy(volume), *state = NULL;
    return status;
}

/* ---- asking --------------------------------------------------------------------------------- */

/* Where the plane through the point and the edge passes the light's centre: t in radii, > 0 if the
 * centre is on the side that the edge leaves visible (4.2, figure 4.4). */
static double cut(const volume_state *state, const float *ends, const double point[3]) {
    const ss_light *light = &state->maps.light;
    double along[3], from[3], centre[3], n[3];
    for (int k = 0; k < 3; k++) {
        along[k] = (double)ends[3 + k] - ends[k], from[k] = point[k] - ends[k];
        centre[k] = light->type == SOFTSHADOW_SUN ? light->normal[k] : light->centre[k] - point[k];
    }
    ss_cross(from, along, n);
    const double square = ss_dot(n, n), s = ss_dot(n, centre) / sqrt(square), r = state->radius;
    double reach = r; /* of the light across the plane, in such s */
    if (!state->paper && light->type == SOFTSHADOW_SPHERE) {
        const double d = ss_dot(centre, centre);
        reach = d > r * r ? r * sqrt(fmax(d - s * s, 0) / (d - r * r)) : INFINITY;
    } else if (!state->paper) {
        const double lean = ss_dot(n, light->normal);
        reach = r * sqrt(fmax(1 - lean * lean / square, 0));
    }
    /* a point on the edge, or a flat light in the plane: the side alone */
    return s > 0 ? s < reach ? s / reach : 1 : s > -reach ? s / reach : -1;
}

typedef struct asked {
    const volume_state *state;
    const double *point;
    float h;
    const float *ends; /* of the edge that `seen` is for; NULL: none yet */
    float seen;
} asked;

/* Listing 4.2: a point in a volume sees what the edge leaves of the light; else the shadow map
 * decides.
 */
static float alone(asked *a, const float *texel, float depth) {
    const float hard = depth < a->h ? 0 : 1;
    if (!(a->h - texel[VOLUME_DEPTH] > SS_MAP_ALIKE * fabsf(a->h))) return hard;
    const float *ends = texel + VOLUME_FROM;
    if (!a->ends || memcmp(a->ends, ends, 6 * sizeof *ends) != 0) {
        const double t = cut(a->state, ends, a->point);
        a->ends = ends;
        a->seen = ss_falloff_at(&a->state->maps.falloff, (float)(t / 2 + 0.5));
    }
    if (a->state->paper) return a->seen;
    return a->h > texel[VOLUME_END] ? 0 : a->seen;
}

static void answer(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    const uint32_t side = maps->frames.resolution;
    const float most = side > 1 ? (float)side - 1.5f : 0;
    const size_t right = side > 1, up = side > 1 ? side : 0;
    for (size_t i = 0; i < n; i++) {
        const float x = looks->x[i] - .5f, y = looks->y[i] - .5f;
        const float left = x > 0 ? x < most ? x : most : 0, low = y > 0 ? y < most ? y : most : 0;
        const uint32_t column = (uint32_t)left, row = (uint32_t)low;
        const float u = left - (float)column, v = low - (float)row;
        const size_t first = looks->base[i] + (size_t)row * side + column;
        const size_t at[4] = {first, first + right, first + up, first + up + right};
        const double point[3] = {looks->places->at[0][i], looks->places->at[1][i],
                                 looks->places->at[2][i]};
        asked a = {(const volume_state *)maps, point, looks->h[i], NULL, 0};
        float seen[4];
        for (int k = 0; k < 4; k++) {
            seen[k] = alone(&a, maps->plane + at[k] * VOLUME_CHANNELS, maps->depth[at[k]]);
        }
        const float below = seen[0] + u * (seen[1] - seen[0]); /* so that four ones make one */
        const float above = seen[2] + u * (seen[3] - seen[2]);
        out[i] = below + v * (above - below);
    }
}

/* words[1] to [4]: paper, radius, is it a sphere, a sun. A face's: lift's 16, the light's centre,
 * its normal. */
static const char glsl[] = SS_LIGHT_MAPS_GLSL SS_LIGHT_LIFT_GLSL
    "float cut(uint face, vec3 from_end, vec3 to_end, vec3 point) {\n"
    "    vec3 normal = word3(face, 19u);\n"
    "    vec3 centre = words[4] != 0.0 ? normal : word3(face, 16u) - point;\n"
    "    vec3 n = cross(point - from_end, to_end - from_end);\n"
    "    float square = dot(n, n), r = words[2], reach = r;\n"
    "    if (!(square > 0.0)) return -1.0;\n"
    "    float s = dot(n, centre) * inversesqrt(square);\n"
    "    if (words[1] == 0.0 && words[3] != 0.0) {\n"
    "        float d = dot(centre, centre);\n"
    "        reach = d > r * r ? r * sqrt(max(d - s * s, 0.0) / (d - r * r)) : 1e30;\n"
    "    } else if (words[1] == 0.0) {\n"
    "        float lean = dot(n, normal);\n"
    "        reach = r * sqrt(max(1.0 - lean * lean / square, 0.0));\n"
    "    }\n"
    "    return s > 0.0 ? s < reach ? s / reach : 1.0 : s > -reach ? s / reach : -1.0;\n"
    "}\n"
    "float alone(uint face, uint at, vec3 look, vec3 point) {\n"
    "    uint texel = at * 8u;\n"
    "    if (!(look.z - planes[texel] > 4.76837158203125e-7 * abs(look.z))) {\n"
    "        return depths[at] < look.z ? 0.0 : 1.0;\n"
    "    }\n"
    "    if (words[1] == 0.0 && look.z > planes[texel + 1u]) return 0.0;\n"
    "    vec3 from = vec3(planes[texel + 2u], planes[texel + 3u], planes[texel + 4u]);\n"
    "    vec3 to = vec3(planes[texel + 5u], planes[texel + 6u], planes[texel + 7u]);\n"
    "    return falloff_at(cut(face, from, to, point) / 2.0 + 0.5);\n"
    "}\n"
    "float answer(vec3 look, uint face) {\n"
    "    float most = side() > 1u ? float(side()) - 1.5 : 0.0;\n"
    "    uint right = side() > 1u ? 1u : 0u, up = right * side();\n"
    "    vec2 low = look.xy - 0.5;\n"
    "    low.x = low.x > 0.0 ? low.x < most ? low.x : most : 0.0;\n"
    "    low.y = low.y > 0.0 ? low.y < most ? low.y : most : 0.0;\n"
    "    uvec2 cell = uvec2(low);\n"
    "    vec2 share = low - vec2(cell);\n"
    "    if (look.z == -1e30) return 1.0;\n"
    "    vec3 point = lift(face, look);\n"
    "    uint a = base_of(face) + cell.y * side() + cell.x;\n"
    "    float first = alone(face, a, look, point), second = alone(face, a + right, look, point);\n"
    "    float third = alone(face, a + up, look, point), last = alone(face, a + up + right, look, point);\n"
    "    float below = first + share.x * (second - first), above = third + share.x * (last - third);\n"
    "    return below + share.y * (above - below);\n"
    "}\n";

static softshadow_status tables(void *state, ss_raster_question *question) {
    volume_state *volume = state;
    ss_light_maps *maps = &volume->maps;
    const ss_light *light = &maps->light;
    if (!maps->plane) return ss_light_maps_tables_hard(state, question);
    maps->words[1] = volume->paper, maps->words[2] = (float)volume->radius;
    maps->words[3] = light->type == SOFTSHADOW_SPHERE,
    maps->words[4] = light->type == SOFTSHADOW_SUN;
    for (uint32_t i = 0; i < maps->frames.count; i++) {
        float *words = ss_light_maps_words(maps, i);
        ss_light_maps_lift_words(&maps->frames.face[i], words);
        for (int k = 0; k < 3; k++) {
            words[16 + k] = (float)light->centre[k], words[19 + k] = (float)light->normal[k];
        }
    }
    return ss_light_maps_ask(maps, glsl, question);
}

static const ss_technique part = {
    .build = build_part,
    .tables = tables,
    .destroy = ss_light_maps_destroy,
    .bytes = ss_light_maps_bytes,
    SS_LIGHT_MAPS_ROWS,
};

static softshadow_status build(const ss_stage *stage, void **state) {
    return ss_parts_build(stage, &part, state);
}

const ss_technique ss_penumbra_volume = {
    .name = "penumbra-volume",
    .title = "penumbra volumes: the light cut by the silhouette edge that shades the point",
    .cite = "Cou05",
    .notes =
        "One edge a texel: where penumbrae overlap the others do not count, and inside a shadow "
        "narrower than its penumbra only the nearer side lets light in. Silhouettes are those seen "
        "from the light's centre. rect: taken as the disk of its area. Opacity textures make holes in "
        "the shadow, not penumbrae.",
    .needs = SS_NEEDS_SILHOUETTES,
    .bound_kind = SOFTSHADOW_BOUND_NONE,
    .lights_native = SS_LIGHTS_ROUND,
    .lights_approximated = SS_LIGHTS_RECT,
    .weightings = 1u << SOFTSHADOW_UNIFORM,
    .build = build,
    .query_places = ss_parts_query_places,
    .query_glsl = glsl,
    SS_PARTS_ROWS,
};
