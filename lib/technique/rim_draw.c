/* What penumbrae are drawn with: strips along a rim's edges, pieces of discs around its corners. */
#include "technique/rim.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"
#include "base/vec.h"

#define PIECE (M_PI / 6) /* most that one triangle of a corner spans */
#define SHARE 256        /* edges or vertices that one thread draws at a time */

/* The edges of vertices where not just one arrives and one leaves: edge[first[v] .. first[v + 1]). */
typedef struct crowds {
    uint32_t *first, *edge;
} crowds;

/* Draws a share of the rim; shares follow each other in the order of edges, then vertices. */
typedef struct artist {
    const ss_rim *rim;
    const ss_rim_style *style;
    const crowds *crowds;
    ss_raster_polygon *list;
    size_t count, room;
    size_t first; /* of all that is drawn */
    bool failed;
} artist;

static ss_raster_polygon *next(artist *a) {
    if (a->count == a->room) {
        const size_t wanted = a->room ? 2 * a->room : 1024;
        ss_raster_polygon *grown = ss_grow(a->list, a->count, wanted, sizeof *grown);
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

typedef struct spot {
    double x, y, attribute[SS_RASTER_ATTRIBUTES];
} spot;

static void polygon(artist *a, const spot *corner, uint32_t corners, uint32_t tag) {
    ss_raster_polygon *p = next(a);
    if (!p) return;
    *p = (ss_raster_polygon){.corners = corners, .tag = tag};
    for (uint32_t i = 0; i < corners; i++) {
        p->corner[i][0] = corner[i].x, p->corner[i][1] = corner[i].y;
        memcpy(p->attribute[i], corner[i].attribute, sizeof p->attribute[i]);
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

/* ---- what light gets past ------------------------------------------------------------------- */

/* Silhouettes against nothing are those that matter most: what is known of all of an edge is not
 * looked up for each texel. Nor is what hides all of a corner's piece. */
#define SKY_NEAR  1.5     /* the two places of ss_rim_open() */
#define SKY_WAY   2.5
#define SKY_SLACK .0625   /* texels: snapping moves corners by 1/512, floats places by less */
#define SKY_BULGE .1      /* of a piece's arc beyond its chord: SKY_WAY (1 - cos(PIECE / 2)) */
#define SKY_MOST  16      /* texels along a side that are looked at */
#define SKY_LEAST 0x1p-10 /* texels: shorter edges' gradients say little */

/* Where depths are looked up. */
typedef struct patch {
    double low[2], high[2];
} patch;

static const patch nowhere = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};

static void spread(patch *p, double x, double y) {
    const double at[2] = {x, y};
    for (int k = 0; k < 2; k++)
        p->low[k] = fmin(p->low[k], at[k]), p->high[k] = fmax(p->high[k], at[k]);
}

/* Are all depths of a patch from low on, but less than high? Of a large one nobody knows. */
static bool within(const artist *a, const patch *p, double slack, float low, float high) {
    const double most = a->style->side - 1.0;
    uint32_t from[2], to[2];
    for (int k = 0; k < 2; k++) {
        if (!(p->high[k] - p->low[k] < SKY_MOST)) return false;
        from[k] = (uint32_t)fmin(fmax(p->low[k] - slack, 0), most);
        to[k] = (uint32_t)fmin(fmax(p->high[k] + slack, 0), most);
    }
    for (uint32_t y = from[1]; y <= to[1]; y++) {
        const float *row = a->style->depth + (size_t)y * a->style->side;
        for (uint32_t x = from[0]; x <= to[0]; x++)
            if (!(low <= row[x] && row[x] < high)) return false;
    }
    return true;
}

static bool nothing_at(const artist *a, const patch *p, double slack) {
    return a->style->sky && within(a, p, slack, SS_MAP_FAR, INFINITY);
}

/* What hangs on a strip's corners hangs on the edge there; or, where penumbrae are not as wide
 * everywhere, a little beside it: what is between the corners is between those places. */
static bool strip_open(const artist *a, const ss_rim_edge *edge, const double right[2],
                       const spot near[2], const spot far[2]) {
    const double wide = ss_rim_stretch(&a->rim->vertex[edge->vertex[0]], right);
    patch p = nowhere;
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
    patch p = nowhere;
    if (flags & SS_RIM_DISC) return false;
    for (int i = 0; i < 2; i++) spread(&p, at->x + way * ways[i][0], at->y + way * ways[i][1]);
    return nothing_at(a, &p, SKY_SLACK + SKY_BULGE);
}

/* Does light get nowhere past all of it? Offers would refuse every texel. */
static bool piece_hidden(const artist *a, const ss_rim_vertex *at, const double ways[2][2],
                         uint32_t flags) {
    const float h = (float)at->h + a->style->past;
    if (!a->style->hidden || !a->style->depth) return false;
    for (int side = -1; side <= 1; side += 2) {
        patch p = nowhere;
        if (!(flags & SS_RIM_DISC) && (side < 0) != ((flags & SS_RIM_INSIDE) != 0)) continue;
        for (int i = 0; i < 2; i++) {
            spread(&p, at->x + side * SKY_NEAR * ways[i][0], at->y + side * SKY_NEAR * ways[i][1]);
            spread(&p, at->x + side * SKY_WAY * ways[i][0], at->y + side * SKY_WAY * ways[i][1]);
        }
        if (!within(a, &p, SKY_SLACK + SKY_BULGE, -INFINITY, h)) return false;
    }
    return true;
}

/* ---- strips and corners --------------------------------------------------------------------- */

/* Both widths are stretched alike, as the edge's line has one tangent: its numbers vary
 * linearly. */
static void strip(artist *a, uint32_t e) {
    const ss_rim_edge *edge = &a->rim->edge[e];
    double m[2];
    if (!leave_edge(a, e, 1, m)) return;
    const double right[2] = {edge->along[1], -edge->along[0]};
    spot near[2], far[2];
    for (int i = 0; i < 2; i++) {
        const ss_rim_vertex *v = &a->rim->vertex[edge->vertex[i]];
        const double w = width_of(a, edge->vertex[i]), wide = w * ss_rim_stretch(v, right);
        const double in = a->style->inside ? -1 : 0;
        near[i] = (spot){v->x + in * wide * m[0], v->y + in * wide * m[1], {in * w, v->h}};
        far[i] = (spot){v->x + wide * m[0], v->y + wide * m[1], {w, v->h}};
    }
    const bool open = strip_open(a, edge, right, near, far);
    polygon(a, (const spot[]){near[0], near[1], far[1], far[0]}, 4,
            SS_RIM_TAG * e + (open ? SS_RIM_SKY : 0));
}

/* A piece of the disc around a vertex, from angle `from` on by `turn` (either sign). */
static void wedge(artist *a, uint32_t v, double from, double turn, uint32_t flags) {
    const ss_rim_vertex *at = &a->rim->vertex[v];
    const int pieces = (int)ceil(fabs(turn) / PIECE);
    const double widest = ss_length_2(1, ss_length_2(at->tangent[0], at->tangent[1]));
    const double r = widest * width_of(a, v) / cos(turn / (2 * (pieces ? pieces : 1)));
    const spot tip = {at->x, at->y, {0, at->h}};
    spot rim[2];
    double ways[2][2];
    for (int i = 0; i <= pieces; i++) {
        const double angle = from + turn * i / (pieces ? pieces : 1);
        ways[1][0] = cos(angle), ways[1][1] = sin(angle);
        const double x = r * ways[1][0], y = r * ways[1][1];
        rim[1] = (spot){at->x + x, at->y + y,
                        {x, at->h, y, x * at->tangent[0] + y * at->tangent[1]}};
        if (i > 0 && !piece_hidden(a, at, ways, flags)) {
            const uint32_t open = piece_open(a, at, ways, flags) ? SS_RIM_SKY : 0;
            const spot piece[] = {tip, rim[0], rim[1]};
            polygon(a, piece, 3, SS_RIM_TAG * v + SS_RIM_CORNER + flags + open);
        }
        rim[0] = rim[1];
        memcpy(ways[0], ways[1], sizeof ways[0]);
    }
}

static double angle_of(const double m[2]) { return atan2(m[1], m[0]); }

/* To -pi..pi; a full turn back is a turn ahead: the tip of a blade is outside. */
static double principal(double angle) {
    angle = remainder(angle, 2 * M_PI);
    return angle <= -M_PI * (1 - 1e-12) ? M_PI : angle;
}

static bool hidden(const artist *a, uint32_t e) {
    return a->style->hidden && a->style->hidden[e] == SS_RIM_HIDDEN;
}

/* Where a vertex is the nearest of an edge that it is an end of: ways up to `half` from the angle
 * *middle; false: the edge's widths do not tell. */
static bool ways_beside(const artist *a, uint32_t e, uint32_t v, double *middle, double *half) {
    const ss_rim_edge *edge = &a->rim->edge[e];
    const bool last = edge->vertex[1] == v;
    const double right[2] = {edge->along[1], -edge->along[0]}, sign = last ? 1 : -1;
    const double wide = ss_rim_stretch(&a->rim->vertex[edge->vertex[0]], right);
    const double more = wide * (width_of(a, v) - width_of(a, edge->vertex[!last]));
    const double lean = a->style->tangent && edge->length > 0 ? more / edge->length : 0;
    if (!(edge->length > 0) || !(fabs(lean) < 1)) return false;
    *middle = atan2(sign * edge->along[1], sign * edge->along[0]), *half = acos(-lean);
    return true;
}

/* Narrows the angles from span[0] to span[1]; false: to none. */
static bool narrow(double span[2], double middle, double half) {
    double low = INFINITY, high = -INFINITY;
    for (int k = -1; k <= 1; k++) {
        const double from = fmax(span[0], middle - half + 2 * M_PI * k);
        const double to = fmin(span[1], middle + half + 2 * M_PI * k);
        if (from < to) low = fmin(low, from), high = fmax(high, to);
    }
    span[0] = low, span[1] = high;
    return low < high;
}

/* Of a vertex whose inside and outside the rim does not tell, the piece of a disc that is nearer to
 * it than to its edges, as far as these are seen all along: hidden ones offer nothing there. */
static void disc(artist *a, const uint32_t *edges, size_t n, uint32_t v) {
    double base = 0, span[2] = {-M_PI, M_PI}, middle, half;
    bool seen = false, bounded = false;
    for (size_t i = 0; i < n; i++) {
        seen |= !hidden(a, edges[i]);
        if (a->style->hidden && a->style->hidden[edges[i]] != SS_RIM_SEEN) continue;
        if (!ways_beside(a, edges[i], v, &middle, &half)) continue;
        if (!bounded) base = middle, bounded = true;
        if (!narrow(span, principal(middle - base), half)) return;
    }
    if (seen) wedge(a, v, base + span[0], span[1] - span[0], SS_RIM_DISC);
}

/* One edge in, one out: outside opens at a left turn, inside at a right one. */
static void corner(artist *a, uint32_t v) {
    const ss_rim_vertex *at = &a->rim->vertex[v];
    if (hidden(a, at->in) && hidden(a, at->out)) return;
    double m[2], n[2];
    for (int side = 1; side >= (a->style->inside ? -1 : 1); side -= 2) {
        if (!leave_edge(a, at->in, side, m) || !leave_edge(a, at->out, side, n)) {
            disc(a, (const uint32_t[]){at->in, at->out}, 2, v);
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
    if (!(ss_length_2(mean[0], mean[1]) > 1e-6)) {
        disc(a, edges, n, v);
        return;
    }
    for (size_t i = 0; i < n; i++) {
        if (hidden(a, edges[i]) || !leave_edge(a, edges[i], 1, m)) continue;
        wedge(a, v, angle_of(m), principal(angle_of(mean) - angle_of(m)), 0);
    }
}

/* ---- all ------------------------------------------------------------------------------------ */

static void draw_edge(artist *a, uint32_t e) {
    if (!hidden(a, e)) strip(a, e);
}

static void draw_vertex(artist *a, uint32_t v) {
    const ss_rim_vertex *at = &a->rim->vertex[v];
    const uint32_t *edges = a->crowds->edge + a->crowds->first[v];
    const size_t n = a->crowds->first[v + 1] - a->crowds->first[v];
    if (at->cut || at->arriving + at->leaving == 0) return;
    if (at->arriving == 1 && at->leaving == 1) corner(a, v);
    else if (n > 2 && a->style->average) crowded(a, edges, n, v);
    else disc(a, edges, n, v);
}

static bool is_plain(const ss_rim_vertex *v) { return v->arriving == 1 && v->leaving == 1; }

static bool find_crowds(const ss_rim *rim, crowds *out) {
    out->first = ss_alloc(rim->vertex_count + 2, sizeof *out->first);
    out->edge = ss_alloc_any(2 * rim->edge_count, sizeof *out->edge);
    if (!out->first || !out->edge) return false;
    for (size_t v = 0; v < rim->vertex_count; v++) {
        const ss_rim_vertex *at = &rim->vertex[v];
        out->first[v + 2] = out->first[v + 1] + (is_plain(at) ? 0 : at->arriving + at->leaving);
    }
    for (uint32_t e = 0; e < rim->edge_count; e++) {
        for (int i = 0; i < 2; i++) {
            const uint32_t v = rim->edge[e].vertex[i];
            if (!is_plain(&rim->vertex[v])) out->edge[out->first[v + 1]++] = e;
        }
    }
    return true;
}

static softshadow_status no_memory(const ss_rim *rim) {
    return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for the penumbrae of %zu silhouette edges",
                   rim->edge_count);
}

typedef struct drawing {
    const ss_rim *rim;
    artist *share; /* of each */
    ss_raster_polygon *all;
} drawing;

static softshadow_status draw_shares(void *ctx, uint64_t begin, uint64_t end) {
    const drawing *d = ctx;
    const size_t edges = d->rim->edge_count, all = edges + d->rim->vertex_count;
    for (uint64_t share = begin; share < end; share++) {
        artist *a = &d->share[share];
        const size_t last = (share + 1) * SHARE < all ? (share + 1) * SHARE : all;
        for (size_t i = share * SHARE; i < last; i++) {
            if (i < edges) draw_edge(a, (uint32_t)i);
            else draw_vertex(a, (uint32_t)(i - edges));
        }
        if (a->failed) return no_memory(d->rim);
    }
    return SOFTSHADOW_OK;
}

/* One list of all that has been drawn. */
static softshadow_status gather(void *ctx, uint64_t begin, uint64_t end) {
    const drawing *d = ctx;
    for (uint64_t share = begin; share < end; share++) {
        const artist *a = &d->share[share];
        if (a->count) memcpy(d->all + a->first, a->list, a->count * sizeof *a->list);
    }
    return SOFTSHADOW_OK;
}

static softshadow_status draw_all(drawing *d, size_t shares, ss_pool *pool, size_t *count) {
    softshadow_status status = ss_parallel_for(pool, shares, 1, draw_shares, d);
    for (size_t i = 0; i < shares; i++)
        d->share[i].first = *count, *count += d->share[i].count;
    if (!status && !(d->all = ss_alloc_any(*count, sizeof *d->all))) status = no_memory(d->rim);
    return status ? status : ss_parallel_for(pool, shares, 1, gather, d);
}

softshadow_status ss_rim_draw(const ss_rim *rim, const ss_rim_style *style, ss_pool *pool,
                              ss_raster_polygon **polygons, size_t *count) {
    const size_t shares = (rim->edge_count + rim->vertex_count + SHARE - 1) / SHARE;
    crowds all = {0};
    drawing d = {.rim = rim, .share = ss_alloc(shares, sizeof *d.share)};
    softshadow_status status = SOFTSHADOW_OK;
    *polygons = NULL, *count = 0;
    if (!d.share || !find_crowds(rim, &all)) status = no_memory(rim);
    for (size_t i = 0; i < shares && !status; i++)
        d.share[i] = (artist){.rim = rim, .style = style, .crowds = &all};
    if (!status) status = draw_all(&d, shares, pool, count);
    for (size_t i = 0; i < shares && d.share; i++) ss_free(d.share[i].list);
    ss_free(d.share), ss_free(all.first), ss_free(all.edge);
    if (status) ss_free(d.all), *count = 0;
    else *polygons = d.all;
    return status;
}
