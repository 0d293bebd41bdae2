#include "technique/rim.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/status.h"
#include "base/vec.h"

#define PIECE (M_PI / 6) /* most that one triangle of a corner spans */

softshadow_status ss_rim_find(const ss_stage *stage, ss_silhouette *out) {
    const double start = ss_clock();
    const ss_eye eye = ss_eye_of(stage->light);
    const softshadow_status status = ss_silhouette_find(out, stage->silhouettes, stage->world,
                                                        stage->topology, &eye, stage->pool);
    stage->spent->silhouettes += ss_clock() - start;
    return status;
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
    const double o = fmax(hypot(a->tangent[0], a->tangent[1]), hypot(b->tangent[0], b->tangent[1]));
    const double far = ss_frame_rate(c->frame) * (c->frame->far_h - h) * hypot(1, o) + 4;
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
    edge.length = hypot(edge.along[0], edge.along[1]);
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
static bool edge_hidden(const hiding *h, const ss_rim_edge *edge) {
    const ss_rim_vertex *a = &h->rim->vertex[edge->vertex[0]],
                        *b = &h->rim->vertex[edge->vertex[1]];
    const float right[2] = {(float)edge->along[1], (float)-edge->along[0]};
    if (!(edge->length > 0 && edge->length < 1024)) return false; /* end on: nothing to look along */
    const int steps = 1 + (int)(2 * edge->length);
    for (int i = 0; i <= steps; i++) {
        const double t = (double)i / steps;
        const float place[2] = {(float)(a->x + t * (b->x - a->x)),
                                (float)(a->y + t * (b->y - a->y))};
        const float c = (float)(a->h + t * (b->h - a->h));
        if (!(ss_rim_open(h->depth, h->side, place, right) < c + h->past)) return false;
    }
    return true;
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

/* ---- drawing -------------------------------------------------------------------------------- */

typedef struct artist {
    const ss_rim *rim;
    const ss_rim_style *style;
    ss_raster_triangle *list;
    size_t count, room;
    bool failed;
} artist;

static ss_raster_triangle *next(artist *a) {
    if (a->count == a->room) {
        const size_t wanted = a->room ? 2 * a->room : 1024;
        ss_raster_triangle *grown = ss_grow(a->list, a->count, wanted, sizeof *grown);
        if (!grown) {
            a->failed = true;
            return NULL;
        }
        a->list = grown, a->room = wanted;
    }
    return &a->list[a->count++];
}

static double width_of(const artist *a, uint32_t v) {
    return a->style->width(a->style->ctx, &a->rim->vertex[v]);
}

double ss_rim_stretch(const ss_rim_vertex *v, const double m[2]) {
    return hypot(1, m[0] * v->tangent[0] + m[1] * v->tangent[1]);
}

typedef struct spot {
    double x, y, attribute[SS_RASTER_ATTRIBUTES];
} spot;

static void triangle(artist *a, const spot *p, const spot *q, const spot *r, uint32_t tag) {
    ss_raster_triangle *t = next(a);
    const spot *const corner[3] = {p, q, r};
    if (!t) return;
    *t = (ss_raster_triangle){.tag = tag};
    for (int i = 0; i < 3; i++) {
        t->corner[i][0] = corner[i]->x, t->corner[i][1] = corner[i]->y;
        memcpy(t->attribute[i], corner[i]->attribute, sizeof t->attribute[i]);
    }
}

/* Towards where a strip leaves its edge: the outside is on the right. Circles of radii r0, r1
 * around the ends touch a line with normal m where m . along = (r0 - r1) / length; false: one
 * circle holds the other, and there is no strip. */
static bool leave(const ss_rim_edge *edge, double side, double r0, double r1, bool tangent,
                  double m[2]) {
    const double right[2] = {edge->along[1] * side, -edge->along[0] * side};
    if (edge->length == 0) return false;
    const double lean = tangent ? (r0 - r1) / edge->length : 0;
    if (!(fabs(lean) < 1)) return false;
    const double across = sqrt((1 - lean) * (1 + lean));
    for (int k = 0; k < 2; k++) m[k] = lean * edge->along[k] + across * right[k];
    return true;
}

static bool leave_edge(const artist *a, uint32_t e, double side, double m[2]) {
    const ss_rim_edge *edge = &a->rim->edge[e];
    const double right[2] = {edge->along[1], -edge->along[0]};
    const double wide = ss_rim_stretch(&a->rim->vertex[edge->vertex[0]], right);
    return leave(edge, side, wide * width_of(a, edge->vertex[0]),
                 wide * width_of(a, edge->vertex[1]), a->style->tangent, m);
}

/* ---- open sky ------------------------------------------------------------------------------- */

/* Silhouettes against nothing are those that matter most: what is known of all of an edge is not
 * looked up for each texel. */
#define SKY_WAY   2.5     /* the farther of the two places of ss_rim_open() */
#define SKY_SLACK .0625   /* texels: snapping moves corners by 1/512, floats places by less */
#define SKY_BULGE .1      /* of a piece's arc beyond its chord: SKY_WAY (1 - cos(PIECE / 2)) */
#define SKY_MOST  16      /* texels along a side that are looked at */
#define SKY_LEAST 0x1p-10 /* texels: shorter edges' gradients say little */

/* Where depths are looked up. */
typedef struct patch {
    double low[2], high[2];
} patch;

static void spread(patch *p, double x, double y) {
    const double at[2] = {x, y};
    for (int k = 0; k < 2; k++)
        p->low[k] = fmin(p->low[k], at[k]), p->high[k] = fmax(p->high[k], at[k]);
}

static bool nothing_at(const artist *a, const patch *p, double slack) {
    const double most = a->style->side - 1.0;
    uint32_t from[2], to[2];
    if (!a->style->depth) return false;
    for (int k = 0; k < 2; k++) {
        if (!(p->high[k] - p->low[k] < SKY_MOST)) return false;
        from[k] = (uint32_t)fmin(fmax(p->low[k] - slack, 0), most);
        to[k] = (uint32_t)fmin(fmax(p->high[k] + slack, 0), most);
    }
    for (uint32_t y = from[1]; y <= to[1]; y++) {
        const float *row = a->style->depth + (size_t)y * a->style->side;
        for (uint32_t x = from[0]; x <= to[0]; x++)
            if (row[x] != SS_MAP_FAR) return false;
    }
    return true;
}

/* What hangs on a strip's corners hangs on the edge there; or, where penumbrae are not as wide
 * everywhere, a little beside it: what is between the corners is between those places. */
static bool strip_open(const artist *a, const ss_rim_edge *edge, const double right[2],
                       const spot near[2], const spot far[2]) {
    const double wide = ss_rim_stretch(&a->rim->vertex[edge->vertex[0]], right);
    patch p = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    if (!(edge->length > SKY_LEAST)) return false;
    for (int i = 0; i < 4; i++) {
        const spot *at = i < 2 ? &near[i] : &far[i - 2];
        const double past = SKY_WAY - wide * at->attribute[0];
        spread(&p, at->x + past * right[0], at->y + past * right[1]);
    }
    return nothing_at(a, &p, SKY_SLACK);
}

/* The same of a corner's piece between two ways, unit vectors. */
static bool piece_open(const artist *a, const ss_rim_vertex *at, const double ways[2][2],
                       uint32_t flags) {
    const double way = flags & SS_RIM_INSIDE ? -SKY_WAY : SKY_WAY;
    patch p = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    if (flags & SS_RIM_DISC) return false;
    for (int i = 0; i < 2; i++) spread(&p, at->x + way * ways[i][0], at->y + way * ways[i][1]);
    return nothing_at(a, &p, SKY_SLACK + SKY_BULGE);
}

/* ---- strips and corners --------------------------------------------------------------------- */

static void strip(artist *a, uint32_t e, double side) {
    const ss_rim_edge *edge = &a->rim->edge[e];
    double m[2];
    if (!leave_edge(a, e, side, m)) return;
    const double right[2] = {edge->along[1], -edge->along[0]};
    spot near[2], far[2];
    for (int i = 0; i < 2; i++) {
        const ss_rim_vertex *v = &a->rim->vertex[edge->vertex[i]];
        const double w = width_of(a, edge->vertex[i]), wide = w * ss_rim_stretch(v, right);
        near[i] = (spot){v->x, v->y, {0, v->h}};
        far[i] = (spot){v->x + wide * m[0], v->y + wide * m[1], {side * w, v->h}};
    }
    const bool open = strip_open(a, edge, right, near, far);
    const uint32_t tag =
        SS_RIM_TAG * e + (side < 0 ? SS_RIM_INSIDE : 0) + (open ? SS_RIM_SKY : 0);
    triangle(a, &near[0], &near[1], &far[1], tag);
    triangle(a, &near[0], &far[1], &far[0], tag);
}

/* A piece of the disc around a vertex, from angle `from` on by `turn` (either sign). */
static void wedge(artist *a, uint32_t v, double from, double turn, uint32_t flags) {
    const ss_rim_vertex *at = &a->rim->vertex[v];
    const int pieces = (int)ceil(fabs(turn) / PIECE);
    const double widest = hypot(1, hypot(at->tangent[0], at->tangent[1]));
    const double r = widest * width_of(a, v) / cos(turn / (2 * (pieces ? pieces : 1)));
    const spot tip = {at->x, at->y, {0, at->h}};
    for (int i = 0; i < pieces; i++) {
        spot rim[2];
        double ways[2][2];
        for (int k = 0; k < 2; k++) {
            const double angle = from + turn * (i + k) / pieces;
            ways[k][0] = cos(angle), ways[k][1] = sin(angle);
            const double x = r * ways[k][0], y = r * ways[k][1];
            rim[k] = (spot){at->x + x, at->y + y,
                            {x, at->h, y, x * at->tangent[0] + y * at->tangent[1]}};
        }
        const uint32_t open = piece_open(a, at, ways, flags) ? SS_RIM_SKY : 0;
        triangle(a, &tip, &rim[0], &rim[1], SS_RIM_TAG * v + SS_RIM_CORNER + flags + open);
    }
}

static double angle_of(const double m[2]) { return atan2(m[1], m[0]); }

/* To -pi..pi; a full turn back is a turn ahead: the tip of a blade is outside. */
static double principal(double angle) {
    angle = remainder(angle, 2 * M_PI);
    return angle <= -M_PI * (1 - 1e-12) ? M_PI : angle;
}

static bool hidden(const artist *a, uint32_t e) { return a->style->hidden && a->style->hidden[e]; }

/* One edge in, one out: outside opens at a left turn, inside at a right one. */
static void corner(artist *a, uint32_t v) {
    const ss_rim_vertex *at = &a->rim->vertex[v];
    if (hidden(a, at->in) && hidden(a, at->out)) return;
    double m[2], n[2];
    for (int side = 1; side >= (a->style->inside ? -1 : 1); side -= 2) {
        if (!leave_edge(a, at->in, side, m) || !leave_edge(a, at->out, side, n)) {
            wedge(a, v, 0, 2 * M_PI, SS_RIM_DISC);
            return;
        }
        const double turn = principal(angle_of(n) - angle_of(m));
        if (turn * side > 0) wedge(a, v, angle_of(m), turn, side < 0 ? SS_RIM_INSIDE : 0);
    }
}

/* Pieces from each strip's end to the mean of the strips' normals ([CD03] 3, step 3). */
static void crowded(artist *a, const uint32_t *edges, size_t n, uint32_t v) {
    double mean[2] = {0, 0}, m[2];
    for (size_t i = 0; i < n; i++) {
        if (!leave_edge(a, edges[i], 1, m)) continue;
        mean[0] += m[0], mean[1] += m[1];
    }
    if (!(hypot(mean[0], mean[1]) > 1e-6)) {
        wedge(a, v, 0, 2 * M_PI, SS_RIM_DISC);
        return;
    }
    for (size_t i = 0; i < n; i++) {
        if (!leave_edge(a, edges[i], 1, m)) continue;
        wedge(a, v, angle_of(m), principal(angle_of(mean) - angle_of(m)), 0);
    }
}

/* Vertices where more than two edges meet, with all their edges. */
static void draw_crowded(artist *a) {
    const ss_rim *o = a->rim;
    uint32_t *first = ss_alloc(o->vertex_count + 2, sizeof *first);
    uint32_t *edges = ss_alloc(2 * o->edge_count, sizeof *edges);
    a->failed |= !first || !edges;
    for (size_t e = 0; e < o->edge_count && !a->failed; e++) {
        for (int i = 0; i < 2; i++) first[o->edge[e].vertex[i] + 2]++;
    }
    for (size_t v = 0; v < o->vertex_count && !a->failed; v++) first[v + 2] += first[v + 1];
    for (size_t e = 0; e < o->edge_count && !a->failed; e++) {
        for (int i = 0; i < 2; i++) edges[first[o->edge[e].vertex[i] + 1]++] = (uint32_t)e;
    }
    for (uint32_t v = 0; v < o->vertex_count && !a->failed; v++) {
        if (o->vertex[v].arriving + o->vertex[v].leaving <= 2) continue;
        crowded(a, edges + first[v], first[v + 1] - first[v], v);
    }
    ss_free(first), ss_free(edges);
}

softshadow_status ss_rim_draw(const ss_rim *rim, const ss_rim_style *style,
                                  ss_raster_triangle **triangles, size_t *count) {
    artist a = {.rim = rim, .style = style};
    for (uint32_t e = 0; e < rim->edge_count && !a.failed; e++) {
        if (hidden(&a, e)) continue;
        strip(&a, e, 1);
        if (style->inside) strip(&a, e, -1);
    }
    for (uint32_t v = 0; v < rim->vertex_count && !a.failed; v++) {
        const ss_rim_vertex *at = &rim->vertex[v];
        const uint32_t degree = at->arriving + at->leaving;
        if (at->cut || degree == 0 || (degree > 2 && style->average)) continue;
        if (at->arriving == 1 && at->leaving == 1) corner(&a, v);
        else wedge(&a, v, 0, 2 * M_PI, SS_RIM_DISC);
    }
    if (style->average && !a.failed) draw_crowded(&a);
    *triangles = a.list, *count = a.count;
    if (!a.failed) return SOFTSHADOW_OK;
    ss_free(a.list);
    *triangles = NULL, *count = 0;
    return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for the penumbrae of %zu silhouette edges",
                   rim->edge_count);
}
