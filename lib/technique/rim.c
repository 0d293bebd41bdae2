#include "technique/rim.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/status.h"
#include "base/vec.h"

softshadow_status ss_rim_find(const ss_stage *stage, ss_silhouette *out) {
    const double start = ss_clock();
    const ss_eye eye = ss_eye_of(stage->light);
    const softshadow_status status = ss_silhouette_find(out, stage->silhouettes, stage->world,
                                                        stage->topology, &eye, stage->pool);
    stage->spent->silhouettes += ss_clock() - start;
    return status;
}

double ss_rim_stretch(const ss_rim_vertex *v, const double m[2]) {
    return ss_length_2(1, m[0] * v->tangent[0] + m[1] * v->tangent[1]);
}

/* ---- collecting ----------------------------------------------------------------------------- */

typedef struct collector {
    ss_rim *out;
    const ss_world *world;
    const ss_frame *frame;
    uint32_t *number; /* of a world vertex in the rim, + 1; 0: none yet */
    double most;      /* resolution */
    bool mirrored;    /* does the eye see X, Y mirrored? */
    bool round;       /* the lamp is a sphere, seen in perspective */
} collector;

static void place_of(const ss_world *world, uint32_t v, double p[3]) {
    for (int k = 0; k < 3; k++) p[k] = world->vertices[3 * (size_t)v + (size_t)k];
}

static double z_of(const ss_frame *frame, const double p[3]) {
    double d[3];
    ss_sub(p, frame->origin, d);
    return ss_dot(d, frame->z);
}

static uint32_t add_vertex(collector *c, const double at[3], bool cut) {
    ss_rim_vertex *v = &c->out->vertex[c->out->vertex_count];
    *v = (ss_rim_vertex){.x = at[0], .y = at[1], .h = at[2], .in = SS_RIM_NONE,
                             .out = SS_RIM_NONE, .cut = cut};
    for (int k = 0; k < 2 && c->round; k++) {
        v->tangent[k] = (c->frame->low[k] + at[k] * c->frame->texel) * c->frame->inverse;
    }
    return (uint32_t)c->out->vertex_count++;
}

/* The end of an edge: the vertex itself, or where the edge to `other` leaves the near plane. */
static uint32_t end_of(collector *c, uint32_t v, uint32_t other) {
    double p[3], q[3], at[3];
    place_of(c->world, v, p);
    if (ss_frame_project(c->frame, p, at)) {
        if (!c->number[v]) c->number[v] = add_vertex(c, at, false) + 1;
        return c->number[v] - 1;
    }
    place_of(c->world, other, q);
    const double zp = z_of(c->frame, p), zq = z_of(c->frame, q);
    /* behind the plane by 1e-6 of the reference distance, so that projecting it succeeds */
    const double z = c->frame->nearest + 1e-6 / c->frame->inverse;
    if (!(zq > z)) return SS_RIM_NONE;
    const double t = (z - zp) / (zq - zp);
    for (int k = 0; k < 3; k++) p[k] += t * (q[k] - p[k]);
    return ss_frame_project(c->frame, p, at) ? add_vertex(c, at, true) : SS_RIM_NONE;
}

/* Can anything of its penumbra fall into the map? */
static bool matters(const collector *c, const ss_rim_vertex *a, const ss_rim_vertex *b) {
    const double h = fmin(a->h, b->h);
    if (h >= c->frame->far_h) return false;
    const double o = fmax(ss_length_2(a->tangent[0], a->tangent[1]), ss_length_2(b->tangent[0], b->tangent[1]));
    const double far = ss_frame_rate(c->frame) * (c->frame->far_h - h) * ss_length_2(1, o) + 4;
    return fmax(a->x, b->x) > -far && fmax(a->y, b->y) > -far && fmin(a->x, b->x) < c->most + far &&
           fmin(a->y, b->y) < c->most + far;
}

static void collect(collector *c, const ss_silhouette_edge *found) {
    const uint32_t from = found->vertex[c->mirrored], to = found->vertex[!c->mirrored];
    double p[3], q[3];
    place_of(c->world, from, p), place_of(c->world, to, q);
    if (!(z_of(c->frame, p) > c->frame->nearest) && !(z_of(c->frame, q) > c->frame->nearest))
        return;
    const uint32_t a = end_of(c, from, to), b = end_of(c, to, from);
    if (a == SS_RIM_NONE || b == SS_RIM_NONE) return;
    ss_rim_vertex *va = &c->out->vertex[a], *vb = &c->out->vertex[b];
    if (!matters(c, va, vb)) return;
    ss_rim_edge edge = {{a, b}, {vb->x - va->x, vb->y - va->y}, 0};
    edge.length = ss_length_2(edge.along[0], edge.along[1]);
    for (int k = 0; k < 2; k++) edge.along[k] = edge.length > 0 ? edge.along[k] / edge.length : 0;
    va->out = vb->in = (uint32_t)c->out->edge_count;
    va->leaving++, vb->arriving++;
    c->out->edge[c->out->edge_count++] = edge;
}

static bool lay_out(ss_rim *rim) {
    rim->rows = rim->edge_count > rim->vertex_count ? rim->edge_count : rim->vertex_count;
    rim->row = ss_alloc(rim->rows, SS_RIM_ROW * sizeof *rim->row);
    if (!rim->row) return false;
    for (size_t i = 0; i < rim->edge_count; i++) {
        const ss_rim_edge *edge = &rim->edge[i];
        const double right[2] = {edge->along[1], -edge->along[0]};
        float *row = rim->row + i * SS_RIM_ROW;
        row[SS_RIM_RIGHT] = (float)right[0], row[SS_RIM_RIGHT + 1] = (float)right[1];
        row[SS_RIM_WIDE] = (float)ss_rim_stretch(&rim->vertex[edge->vertex[0]], right);
    }
    for (size_t i = 0; i < rim->vertex_count; i++) {
        float *place = rim->row + i * SS_RIM_ROW + SS_RIM_PLACE;
        place[0] = (float)rim->vertex[i].x, place[1] = (float)rim->vertex[i].y;
    }
    return true;
}

softshadow_status ss_rim_build(ss_rim *out, const ss_stage *stage, const ss_silhouette *found,
                                   const ss_frame *frame, uint32_t resolution) {
    *out = (ss_rim){0};
    collector c = {.out = out, .world = stage->world, .frame = frame, .most = resolution,
                   .mirrored = ss_frame_mirrored(frame),
                   .round = stage->light->type == SOFTSHADOW_SPHERE && frame->inverse > 0};
    c.number = ss_alloc(stage->world->vertex_count, sizeof *c.number);
    out->vertex = ss_alloc(2 * found->count, sizeof *out->vertex);
    out->edge = ss_alloc(found->count, sizeof *out->edge);
    softshadow_status status = SOFTSHADOW_OK;
    if (!c.number || !out->vertex || !out->edge) {
        status =
            ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu silhouette edges", found->count);
        ss_rim_free(out);
    }
    for (size_t i = 0; i < found->count && !status; i++) collect(&c, &found->edges[i]);
    ss_free(c.number);
    if (!status && !lay_out(out)) {
        status =
            ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu silhouette edges", found->count);
        ss_rim_free(out);
    }
    return status;
}

void ss_rim_free(ss_rim *rim) {
    ss_free(rim->vertex);
    ss_free(rim->edge);
    ss_free(rim->row);
    *rim = (ss_rim){0};
}

/* ---- what is around it ---------------------------------------------------------------------- */

static float depth_near(const float *depth, uint32_t side, float x, float y) {
    const float most = (float)(side - 1);
    const uint32_t column = (uint32_t)(x > 0 ? x < most ? x : most : 0);
    const uint32_t row = (uint32_t)(y > 0 ? y < most ? y : most : 0);
    return depth[(size_t)row * side + column];
}

float ss_rim_open(const float *depth, uint32_t side, const float place[2],
                  const float outwards[2]) {
    const float near =
        depth_near(depth, side, place[0] + 1.5f * outwards[0], place[1] + 1.5f * outwards[1]);
    const float far =
        depth_near(depth, side, place[0] + 2.5f * outwards[0], place[1] + 2.5f * outwards[1]);
    return near > far ? near : far;
}

typedef struct hiding {
    const ss_rim *rim;
    const float *depth;
    uint32_t side;
    float past;
    uint8_t *hidden; /* of each edge */
} hiding;

/* On a closed body half of the silhouette: offers would refuse every texel of it. */
static uint8_t edge_hidden(const hiding *h, const ss_rim_edge *edge) {
    const ss_rim_vertex *a = &h->rim->vertex[edge->vertex[0]],
                        *b = &h->rim->vertex[edge->vertex[1]];
    const float right[2] = {(float)edge->along[1], (float)-edge->along[0]};
    if (!(edge->length > 0 && edge->length < 1024)) return SS_RIM_SEEN; /* end on */
    const int steps = 1 + (int)(2 * edge->length);
    int past = 0;
    for (int i = 0; i <= steps; i++) {
        const double t = (double)i / steps;
        const float place[2] = {(float)(a->x + t * (b->x - a->x)),
                                (float)(a->y + t * (b->y - a->y))};
        const float c = (float)(a->h + t * (b->h - a->h));
        past += !(ss_rim_open(h->depth, h->side, place, right) < c + h->past);
        if (0 < past && past <= i) return SS_RIM_PARTLY;
    }
    return past ? SS_RIM_SEEN : SS_RIM_HIDDEN;
}

static softshadow_status hide(void *ctx, uint64_t begin, uint64_t end) {
    const hiding *h = ctx;
    for (uint64_t i = begin; i < end; i++) h->hidden[i] = edge_hidden(h, &h->rim->edge[i]);
    return SOFTSHADOW_OK;
}

softshadow_status ss_rim_find_hidden(const ss_stage *stage, const ss_rim *rim, const float *depth,
                                     uint32_t side, float past, uint8_t **hidden) {
    *hidden = ss_alloc(rim->edge_count, 1);
    if (!*hidden)
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu edges", rim->edge_count);
    hiding h = {rim, depth, side, past, *hidden};
    return ss_parallel_for(stage->pool, rim->edge_count, 256, hide, &h);
}

void ss_rim_tables(const ss_rim *rim, const float *depth, uint32_t side, const float *words,
                   size_t word_count, ss_raster_ink *ink) {
    ink->table[0] = (ss_raster_table){depth, (size_t)side * side * sizeof *depth};
    ink->table[1] = (ss_raster_table){words, word_count * sizeof *words};
    ink->table[2] = (ss_raster_table){rim->row, rim->rows * SS_RIM_ROW * sizeof *rim->row};
    ink->tables = 3;
}
