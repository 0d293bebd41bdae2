/* Edge collapses by quadrics, in passes over arrays instead of a heap over half-edges: each pass
 * costs all edges (in parallel), takes the cheaper ones in order of cost, every vertex at most
 * once, and packs what is left. Nothing but costs is computed in parallel, so the result does not
 * depend on threads.
 *
 * based on: [Garland, Heckbert 97] for the metric. It differs in the order (a pass instead of one
 * globally cheapest edge at a time), which costs little quality and is some ten times as fast. */
#include "topology/simplify.h"

#include <string.h>

#include "base/memory.h"
#include "base/status.h"
#include "topology/edges.h"
#include "topology/quadric.h"

#define GRAIN      8192
#define RIM_WEIGHT 4.0 /* a rim moves a silhouette by all of its error, a face by part of it */
#define PULL       1e-3 /* of the quadric's trace: keeps new vertices near their edge */
#define SHORTER    1e-4 /* likewise prefers short edges where all are free */
#define FOLD       0.2  /* least cosine between a triangle's normals before and after */
#define BINS       2048 /* of costs, by the upper 11 bits of a float: steps of a quarter */

struct ss_simplifier {
    ss_pool *pool;
    size_t original_count, vertex_count, triangle_count;
    double (*place)[3];
    ss_quadric *quadric;
    uint32_t *triangles, *where;
    double rim_share;
    /* of one pass */
    ss_topology edges;
    uint32_t *same;           /* identity: triangles are welded */
    uint8_t *rim;             /* per vertex: on an edge that is not between two triangles */
    uint8_t *done;            /* per vertex: took part in a collapse */
    uint32_t *into;           /* per vertex: what it has become */
    uint32_t *first, *around; /* triangles around vertices */
    uint32_t *stamp, stamps;
    uint64_t *order, *spare; /* cost << 32 | edge */
    size_t order_count;
};

static softshadow_status no_memory(size_t triangles) {
    return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for simplifying %zu triangles", triangles);
}

/* ---- Quadrics ---- */

static void triangle_normal(const double a[3], const double b[3], const double c[3],
                            double out[3]) {
    double u[3], v[3];
    ss_sub(b, a, u), ss_sub(c, a, v);
    ss_cross(u, v, out);
}

static void add_faces(ss_simplifier *s) {
    for (size_t t = 0; t < s->triangle_count; t++) {
        const uint32_t *c = s->triangles + 3 * t;
        double n[3];
        triangle_normal(s->place[c[0]], s->place[c[1]], s->place[c[2]], n);
        const double area = ss_length(n) / 2;
        if (!ss_normalize(n)) continue;
        for (int k = 0; k < 3; k++)
            ss_quadric_add_plane(&s->quadric[c[k]], n, s->place[c[0]], area);
    }
}

static bool is_rim(const ss_topology *table, const ss_edge *edge) {
    const uint32_t *use = table->uses + edge->first_use;
    return ss_edge_uses(edge) != 2 || ((use[0] ^ use[1]) & 1) == 0;
}

/* The plane through a rim edge, upright on its triangle: it keeps the rim where it is. */
static void add_rim(ss_simplifier *s, const ss_edge *edge) {
    const double *a = s->place[edge->vertex[0]], *b = s->place[edge->vertex[1]];
    for (uint32_t i = edge[0].first_use; i < edge[1].first_use; i++) {
        const uint32_t *c = s->triangles + 3 * (size_t)ss_use_triangle(s->edges.uses[i]);
        double n[3], along[3], across[3];
        triangle_normal(s->place[c[0]], s->place[c[1]], s->place[c[2]], n);
        ss_sub(b, a, along);
        ss_cross(along, n, across);
        if (!ss_normalize(across)) continue;
        const double weight = RIM_WEIGHT * ss_dot(along, along);
        for (int k = 0; k < 2; k++) {
            ss_quadric_add_plane(&s->quadric[edge->vertex[k]], across, a, weight);
        }
    }
}

static void add_rims(ss_simplifier *s) {
    size_t rims = 0;
    for (size_t e = 0; e < s->edges.edge_count; e++) {
        if (!is_rim(&s->edges, &s->edges.edges[e])) continue;
        add_rim(s, &s->edges.edges[e]);
        rims++;
    }
    s->rim_share = s->edges.edge_count ? (double)rims / (double)s->edges.edge_count : 0;
}

/* ---- What a collapse would cost ---- */

/* Where the two ends of an edge should meet; gives the cost. */
static double meet(const ss_simplifier *s, uint32_t a, uint32_t b, double out[3]) {
    ss_quadric q = s->quadric[a];
    ss_quadric_add(&q, &s->quadric[b]);
    double along[3], moved[3], middle[3];
    ss_sub(s->place[b], s->place[a], along);
    for (int k = 0; k < 3; k++) out[k] = middle[k] = (s->place[a][k] + s->place[b][k]) / 2;
    const double trace = ss_quadric_trace(&q), length2 = ss_dot(along, along);
    ss_quadric_descend(&q, PULL * trace, out);
    ss_sub(out, middle, moved);
    if (!(ss_dot(moved, moved) <= 4 * length2)) memcpy(out, middle, sizeof middle);
    return ss_quadric_at(&q, out) + SHORTER * trace * length2;
}

static softshadow_status cost_edges(void *ctx, uint64_t begin, uint64_t end) {
    ss_simplifier *s = ctx;
    for (uint64_t e = begin; e < end; e++) {
        const ss_edge *edge = &s->edges.edges[e];
        double where[3];
        const float cost = (float)meet(s, edge->vertex[0], edge->vertex[1], where);
        uint32_t bits;
        memcpy(&bits, &cost, sizeof bits);
        s->order[e] = (uint64_t)bits << 32 | e;
    }
    return SOFTSHADOW_OK;
}

/* Keeps the edges that cost no more than about the `rank` cheapest do. */
static void keep_cheap(ss_simplifier *s, size_t rank) {
    size_t bin[BINS] = {0}, sum = 0, kept = 0;
    uint64_t last = 0;
    for (size_t i = 0; i < s->edges.edge_count; i++) bin[s->order[i] >> 53]++;
    while (last < BINS - 1 && (sum += bin[last]) < rank) last++;
    for (size_t i = 0; i < s->edges.edge_count; i++) {
        if (s->order[i] >> 53 <= last) s->order[kept++] = s->order[i];
    }
    s->order_count = kept;
}

/* By cost, ties by edge: positive floats sort as their bits do. */
static void sort_order(ss_simplifier *s) {
    for (int shift = 32; shift < 64; shift += 11) {
        size_t place[BINS + 1] = {0};
        for (size_t i = 0; i < s->order_count; i++)
            place[(s->order[i] >> shift & (BINS - 1)) + 1]++;
        for (size_t i = 0; i < BINS; i++) place[i + 1] += place[i];
        for (size_t i = 0; i < s->order_count; i++) {
            s->spare[place[s->order[i] >> shift & (BINS - 1)]++] = s->order[i];
        }
        uint64_t *swapped = s->order;
        s->order = s->spare, s->spare = swapped;
    }
}

/* ---- Collapsing ---- */

/* The corners of a triangle as they are now; false if it is gone. */
static bool corners_now(const ss_simplifier *s, uint32_t t, uint32_t c[3]) {
    for (int k = 0; k < 3; k++) c[k] = s->into[s->triangles[3 * (size_t)t + (size_t)k]];
    return c[0] != c[1] && c[1] != c[2] && c[2] != c[0];
}

/* Would a triangle around v, but not around other, turn over if v moved to p? */
static bool folds(const ss_simplifier *s, uint32_t v, uint32_t other, const double p[3]) {
    for (uint32_t i = s->first[v]; i < s->first[v + 1]; i++) {
        uint32_t c[3];
        if (!corners_now(s, s->around[i], c)) continue;
        if (c[0] == other || c[1] == other || c[2] == other) continue;
        const double *x[3];
        double before[3], after[3];
        for (int k = 0; k < 3; k++) x[k] = s->place[c[k]];
        triangle_normal(x[0], x[1], x[2], before);
        for (int k = 0; k < 3; k++) x[k] = c[k] == v ? p : x[k];
        triangle_normal(x[0], x[1], x[2], after);
        const double cosine = ss_dot(before, after);
        const double sizes = ss_dot(before, before) * ss_dot(after, after);
        if (cosine < 0 || cosine * cosine < FOLD * FOLD * sizes) return true;
    }
    return false;
}

/* The link condition: the ends share as many neighbours as triangles, so nothing is pinched. Counts
 * those triangles, 0 if it fails. */
static uint32_t shared_triangles(ss_simplifier *s, uint32_t a, uint32_t b) {
    uint32_t shared = 0, common = 0;
    const uint32_t near_a = ++s->stamps, near_both = ++s->stamps;
    for (uint32_t i = s->first[a]; i < s->first[a + 1]; i++) {
        uint32_t c[3];
        if (!corners_now(s, s->around[i], c)) continue;
        shared += c[0] == b || c[1] == b || c[2] == b;
        for (int k = 0; k < 3; k++) s->stamp[c[k]] = near_a;
    }
    for (uint32_t i = s->first[b]; i < s->first[b + 1]; i++) {
        uint32_t c[3];
        if (!corners_now(s, s->around[i], c)) continue;
        for (int k = 0; k < 3; k++) {
            if (c[k] == a || c[k] == b || s->stamp[c[k]] != near_a) continue;
            s->stamp[c[k]] = near_both;
            common++;
        }
    }
    return common == shared ? shared : 0;
}

/* Gives how many triangles went; 0: it must not be done. */
static uint32_t collapse(ss_simplifier *s, uint32_t e) {
    const ss_edge *edge = &s->edges.edges[e];
    const uint32_t a = edge->vertex[0], b = edge->vertex[1];
    if (s->done[a] || s->done[b]) return 0;
    if (s->rim[a] && s->rim[b] && !is_rim(&s->edges, edge)) return 0; /* would join two rims */
    double p[3];
    meet(s, a, b, p);
    const uint32_t gone = shared_triangles(s, a, b);
    if (gone == 0 || folds(s, a, b, p) || folds(s, b, a, p)) return 0;
    memcpy(s->place[a], p, sizeof p);
    ss_quadric_add(&s->quadric[a], &s->quadric[b]);
    s->into[b] = a;
    s->done[a] = s->done[b] = 1;
    return gone;
}

static size_t collapse_in_order(ss_simplifier *s, size_t wanted) {
    size_t gone = 0;
    for (size_t i = 0; i < s->order_count && gone < wanted; i++) {
        gone += collapse(s, (uint32_t)s->order[i]);
    }
    return gone;
}

/* ---- One pass ---- */

static softshadow_status find_edges(ss_simplifier *s) {
    const ss_corners corners = {s->triangles, s->same, s->triangle_count, s->vertex_count};
    s->edges = (ss_topology){0};
    return ss_edges_build(&s->edges, &corners, s->pool);
}

static void list_around(ss_simplifier *s) {
    memset(s->first, 0, (s->vertex_count + 1) * sizeof *s->first);
    for (size_t i = 0; i < 3 * s->triangle_count; i++) s->first[s->triangles[i] + 1]++;
    for (size_t v = 0; v < s->vertex_count; v++) s->first[v + 1] += s->first[v];
    for (size_t i = 0; i < 3 * s->triangle_count; i++) {
        s->around[s->first[s->triangles[i]]++] = (uint32_t)(i / 3);
    }
    memmove(s->first + 1, s->first, s->vertex_count * sizeof *s->first);
    s->first[0] = 0;
}

static void reset_vertices(ss_simplifier *s) {
    memset(s->done, 0, s->vertex_count);
    memset(s->rim, 0, s->vertex_count);
    memcpy(s->into, s->same, s->vertex_count * sizeof *s->into);
    for (size_t e = 0; e < s->edges.edge_count; e++) {
        const ss_edge *edge = &s->edges.edges[e];
        if (is_rim(&s->edges, edge)) s->rim[edge->vertex[0]] = s->rim[edge->vertex[1]] = 1;
    }
}

/* Drops triangles that are gone, then vertices that no triangle uses, keeping the order of both. */
static void pack(ss_simplifier *s) {
    size_t triangles = 0;
    uint32_t vertices = 0, *number = s->first;
    memset(number, 0, s->vertex_count * sizeof *number);
    for (uint32_t t = 0; t < s->triangle_count; t++) {
        uint32_t c[3];
        if (!corners_now(s, t, c)) continue;
        for (int k = 0; k < 3; k++) number[c[k]] = 1;
        memcpy(s->triangles + 3 * triangles++, c, sizeof c);
    }
    for (size_t v = 0; v < s->vertex_count; v++) {
        if (!number[v]) continue;
        number[v] = vertices;
        memmove(s->place[vertices], s->place[v], sizeof *s->place);
        s->quadric[vertices++] = s->quadric[v];
    }
    for (size_t i = 0; i < 3 * triangles; i++) s->triangles[i] = number[s->triangles[i]];
    for (size_t o = 0; o < s->original_count; o++) s->where[o] = number[s->into[s->where[o]]];
    s->triangle_count = triangles, s->vertex_count = vertices;
}

/* Enough cheap edges to reach the target if a third of them can be taken; at most three quarters of
 * all, for the dearest edges are better left to a pass that knows the new costs. */
static size_t rank_wanted(const ss_simplifier *s, size_t wanted, bool all) {
    const size_t most = all ? s->edges.edge_count : s->edges.edge_count / 4 * 3;
    const size_t rank = wanted / 2 * 3;
    return rank < most ? rank : most;
}

static softshadow_status pass(ss_simplifier *s, size_t target, bool all, size_t *gone) {
    /* The first pass finds the edges that the beginning has left. */
    softshadow_status status = s->edges.edges ? SOFTSHADOW_OK : find_edges(s);
    if (status == SOFTSHADOW_OK) {
        list_around(s);
        reset_vertices(s);
        status = ss_parallel_for(s->pool, s->edges.edge_count, GRAIN, cost_edges, s);
    }
    if (status == SOFTSHADOW_OK) {
        keep_cheap(s, rank_wanted(s, s->triangle_count - target, all));
        sort_order(s);
        *gone = collapse_in_order(s, s->triangle_count - target);
        pack(s);
    }
    ss_edges_free(&s->edges);
    s->edges = (ss_topology){0};
    return status;
}

softshadow_status ss_simplify(ss_simplifier *s, size_t target, ss_progress *progress) {
    bool all = false;
    while (s->triangle_count > target) {
        size_t gone = 0;
        softshadow_status status = ss_progress_add(progress, 0);
        if (status == SOFTSHADOW_OK) status = pass(s, target, all, &gone);
        if (status != SOFTSHADOW_OK) return status;
        /* Less than one in 200: first ask for the dear edges too, then give up. */
        if (gone >= s->triangle_count / 200 + 1)
            all = false;
        else if (all)
            break;
        else
            all = true;
    }
    return SOFTSHADOW_OK;
}

/* ---- Beginning and end ---- */

static bool allocate(ss_simplifier *s) {
    const size_t v = s->vertex_count, t = s->triangle_count;
    s->place = ss_alloc(v, sizeof *s->place), s->quadric = ss_alloc(v, sizeof *s->quadric);
    s->triangles = ss_alloc(3 * t, sizeof(uint32_t)), s->where = ss_alloc(v, sizeof(uint32_t));
    s->same = ss_alloc(v, sizeof(uint32_t)), s->into = ss_alloc(v, sizeof(uint32_t));
    s->rim = ss_alloc(v, 1), s->done = ss_alloc(v, 1);
    s->first = ss_alloc(v + 1, sizeof(uint32_t)), s->around = ss_alloc(3 * t, sizeof(uint32_t));
    s->stamp = ss_alloc(v, sizeof(uint32_t));
    s->order = ss_alloc(3 * t, sizeof(uint64_t)), s->spare = ss_alloc(3 * t, sizeof(uint64_t));
    return s->place && s->quadric && s->triangles && s->where && s->same && s->into && s->rim &&
           s->done && s->first && s->around && s->stamp && s->order && s->spare;
}

softshadow_status ss_simplifier_create(ss_simplifier **out, const float *vertices,
                                       size_t vertex_count, const uint32_t *triangles,
                                       size_t triangle_count, ss_pool *pool) {
    *out = NULL;
    ss_simplifier *s = ss_alloc(1, sizeof *s);
    if (!s) return no_memory(triangle_count);
    s->pool = pool;
    s->original_count = s->vertex_count = vertex_count, s->triangle_count = triangle_count;
    softshadow_status status = allocate(s) ? SOFTSHADOW_OK : no_memory(triangle_count);
    if (status == SOFTSHADOW_OK) {
        for (size_t i = 0; i < 3 * vertex_count; i++) s->place[i / 3][i % 3] = vertices[i];
        for (uint32_t v = 0; v < vertex_count; v++) s->same[v] = s->where[v] = v;
        if (triangle_count) memcpy(s->triangles, triangles, 3 * triangle_count * sizeof *triangles);
        status = find_edges(s);
    }
    if (status != SOFTSHADOW_OK) {
        ss_simplifier_destroy(s);
        return status;
    }
    add_faces(s);
    add_rims(s);
    *out = s;
    return SOFTSHADOW_OK;
}

void ss_simplifier_destroy(ss_simplifier *s) {
    if (!s) return;
    ss_edges_free(&s->edges);
    ss_free(s->place), ss_free(s->quadric), ss_free(s->triangles), ss_free(s->where);
    ss_free(s->same), ss_free(s->into), ss_free(s->rim), ss_free(s->done), ss_free(s->first);
    ss_free(s->around), ss_free(s->stamp), ss_free(s->order), ss_free(s->spare);
    ss_free(s);
}

size_t ss_simplifier_vertices(const ss_simplifier *s) { return s->vertex_count; }
size_t ss_simplifier_triangles(const ss_simplifier *s) { return s->triangle_count; }
double ss_simplifier_rim(const ss_simplifier *s) { return s->rim_share; }

void ss_simplifier_read(const ss_simplifier *s, float *vertices, uint32_t *triangles) {
    for (size_t i = 0; i < 3 * s->vertex_count; i++) vertices[i] = (float)s->place[i / 3][i % 3];
    memcpy(triangles, s->triangles, 3 * s->triangle_count * sizeof *triangles);
}

uint32_t ss_simplifier_where(const ss_simplifier *s, size_t original) { return s->where[original]; }
