/* Clusters of edges that face alike.
 *
 * based on: [SGGHS00]: a hierarchy of edges whose nodes say from where none of their edges can be a
 * silhouette. Instead of its anchored cones a node keeps a sphere and a normal cone: cheaper to
 * build, and as good where meshes are dense. Edges are sorted by the octant of their normal and
 * then along a Morton curve, so that the two sides of a thin body do not share clusters. */
#include "silhouette/tree.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"
#include "base/vec.h"

#define GRAIN 8192
/* A face thinner than this (area over longest edge squared) has no normal that floats can hold: the
 * cross product's rounding, 4e-16 of the square, would be as much as theirs. */
#define THIN 1e-7

typedef struct builder {
    ss_silhouette_tree *tree;
    const ss_world *world;
    const ss_topology *topology;
    ss_pool *pool;
    uint32_t *keys; /* per balanced edge */
} builder;

static void corner(const ss_world *world, size_t i, double out[3]) {
    for (int k = 0; k < 3; k++) out[k] = world->vertices[3 * (size_t)world->indices[i] + (size_t)k];
}

static softshadow_status find_planes(void *ctx, uint64_t begin, uint64_t end) {
    const builder *b = ctx;
    for (uint64_t t = begin; t < end; t++) {
        double v[3][3], e[3], f[3], g[3], n[3];
        for (int i = 0; i < 3; i++) corner(b->world, 3 * t + (size_t)i, v[i]);
        ss_sub(v[1], v[0], e), ss_sub(v[2], v[0], f), ss_sub(v[2], v[1], g);
        ss_cross(e, f, n);
        const double longest = fmax(ss_dot(e, e), fmax(ss_dot(f, f), ss_dot(g, g)));
        const bool thin = !(ss_length(n) > THIN * longest) || !ss_normalize(n);
        ss_silhouette_plane *plane = &b->tree->planes[t];
        double offset = 0; /* of the normal as it is kept */
        for (int k = 0; k < 3; k++) {
            plane->normal[k] = thin ? 0 : (float)n[k];
            offset += (double)plane->normal[k] * v[0][k];
        }
        plane->offset = (float)offset;
    }
    return SOFTSHADOW_OK;
}

static bool balanced(const ss_topology *topology, size_t e) {
    int64_t sum = 0;
    for (uint32_t i = topology->edges[e].first_use; i < topology->edges[e + 1].first_use; i++) {
        sum += ss_use_sign(topology->uses[i]);
    }
    return sum == 0;
}

static softshadow_status split_edges(builder *b) {
    ss_silhouette_tree *tree = b->tree;
    const ss_topology *topology = b->topology;
    tree->balanced = ss_alloc(topology->edge_count, sizeof *tree->balanced);
    tree->free_edges = ss_alloc(topology->edge_count, sizeof *tree->free_edges);
    b->keys = ss_alloc(topology->edge_count, sizeof *b->keys);
    tree->triangle_count = topology->triangle_count;
    tree->planes = ss_alloc(topology->triangle_count, sizeof *tree->planes);
    if (!tree->balanced || !tree->free_edges || !b->keys || !tree->planes) {
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for the silhouettes of %zu edges",
                       topology->edge_count);
    }
    for (size_t e = 0; e < topology->edge_count; e++) {
        if (balanced(topology, e)) tree->balanced[tree->balanced_count++] = (uint32_t)e;
        else tree->free_edges[tree->free_count++] = (uint32_t)e;
    }
    return SOFTSHADOW_OK;
}

/* Spreads 9 bits to every third place. */
static uint32_t spread(uint32_t x) {
    x = (x | x << 16) & 0x030000ff;
    x = (x | x << 8) & 0x0300f00f;
    x = (x | x << 4) & 0x030c30c3;
    return (x | x << 2) & 0x09249249;
}

static softshadow_status find_keys(void *ctx, uint64_t begin, uint64_t end) {
    const builder *b = ctx;
    for (uint64_t i = begin; i < end; i++) {
        const ss_edge *edge = &b->topology->edges[b->tree->balanced[i]];
        const float *p = b->world->vertices + 3 * (size_t)edge->vertex[0];
        const float *n =
            b->tree->planes[ss_use_triangle(b->topology->uses[edge->first_use])].normal;
        uint32_t key = 0;
        for (int k = 0; k < 3; k++) {
            key |= spread((uint32_t)((p[k] + 1) * 255.99f)) << k;
            key |= (uint32_t)(n[k] < 0) << (27 + k);
        }
        b->keys[i] = key;
    }
    return SOFTSHADOW_OK;
}

/* By three digits of ten bits; stable, so the order depends on the scene only. */
static softshadow_status sort_edges(builder *b) {
    const size_t n = b->tree->balanced_count;
    uint32_t *edges = b->tree->balanced, *keys = b->keys;
    uint32_t *spare = ss_alloc(2 * n, sizeof *spare);
    uint32_t *start = ss_alloc(1025, sizeof *start);
    if (!spare || !start) {
        ss_free(spare), ss_free(start);
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for sorting %zu edges", n);
    }
    for (int shift = 0; shift < 30; shift += 10) {
        memset(start, 0, 1025 * sizeof *start);
        for (size_t i = 0; i < n; i++) start[(keys[i] >> shift & 1023) + 1]++;
        for (int d = 0; d < 1024; d++) start[d + 1] += start[d];
        for (size_t i = 0; i < n; i++) {
            const uint32_t at = start[keys[i] >> shift & 1023]++;
            spare[at] = edges[i], spare[n + at] = keys[i];
        }
        memcpy(edges, spare, n * sizeof *edges);
        memcpy(keys, spare + n, n * sizeof *keys);
    }
    ss_free(spare), ss_free(start);
    return SOFTSHADOW_OK;
}

static softshadow_status find_faces(builder *b) {
    ss_silhouette_tree *tree = b->tree;
    tree->faces = ss_alloc(tree->balanced_count, sizeof *tree->faces);
    if (!tree->faces) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for silhouettes");
    for (size_t i = 0; i < tree->balanced_count; i++) {
        const ss_edge *edge = &b->topology->edges[tree->balanced[i]];
        const uint32_t *use = b->topology->uses + edge->first_use;
        const bool plain = ss_edge_uses(edge) == 2, swap = plain && ss_use_sign(use[0]) < 0;
        tree->faces[i][0] = plain ? ss_use_triangle(use[swap]) : SS_NO_TRIANGLE;
        tree->faces[i][1] = plain ? ss_use_triangle(use[!swap]) : SS_NO_TRIANGLE;
    }
    return SOFTSHADOW_OK;
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The angle for a cosine whose vectors were rounded to float: acos loses half the digits near 1. */
static double angle_of(double cosine) { return acos(fmax(-1, fmin(1, cosine))) + 1e-3; }

typedef struct gathering {
    double low[3], high[3], axis[3];
    bool vague; /* some normal is not known */
} gathering;

static void take_point(gathering *g, const double low[3], const double high[3]) {
    for (int k = 0; k < 3; k++) {
        g->low[k] = fmin(g->low[k], low[k]), g->high[k] = fmax(g->high[k], high[k]);
    }
}

/* Roundings of the conversions to float are below 1e-6 of what is rounded. */
static void place_sphere(ss_silhouette_node *node, const gathering *g) {
    double diagonal = 0, size = 0;
    for (int k = 0; k < 3; k++) {
        node->centre[k] = (float)((g->low[k] + g->high[k]) / 2);
        diagonal += (g->high[k] - g->low[k]) * (g->high[k] - g->low[k]);
        size = fmax(size, fmax(fabs(g->low[k]), fabs(g->high[k])));
    }
    node->radius = (float)(sqrt(diagonal) / 2 * (1 + 1e-6) + 1e-6 * size);
}

static const gathering nothing = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY},
                                  {0, 0, 0}, false};

static void close_node(ss_silhouette_node *node, const gathering *g, double angle) {
    place_sphere(node, g);
    for (int k = 0; k < 3; k++) node->axis[k] = (float)g->axis[k];
    node->angle = g->vague ? (float)M_PI : (float)angle + 1e-6f;
    node->cosine = cosf(node->angle), node->sine = sinf(node->angle);
}

static void make_leaf(const builder *b, size_t leaf) {
    const size_t begin = leaf * SS_SILHOUETTE_LEAF;
    const size_t end = begin + SS_SILHOUETTE_LEAF < b->tree->balanced_count
                           ? begin + SS_SILHOUETTE_LEAF : b->tree->balanced_count;
    gathering g = nothing;
    double cosine = 1;
    for (int pass = 0; pass < 2; pass++) {
        if (pass == 1 && !ss_normalize(g.axis)) g.vague = true;
        for (size_t i = begin; i < end; i++) {
            const ss_edge *edge = &b->topology->edges[b->tree->balanced[i]];
            for (int j = 0; j < 2 && pass == 0; j++) {
                const float *v = b->world->vertices + 3 * (size_t)edge->vertex[j];
                take_point(&g, (double[3]){v[0], v[1], v[2]}, (double[3]){v[0], v[1], v[2]});
            }
            for (uint32_t u = edge[0].first_use; u < edge[1].first_use; u++) {
                const float *f = b->tree->planes[ss_use_triangle(b->topology->uses[u])].normal;
                const double n[3] = {f[0], f[1], f[2]};
                if (pass == 1) cosine = fmin(cosine, dot(g.axis, n));
                else if (dot(n, n) > 0) ss_add_scaled(g.axis, 1, n, g.axis);
                else g.vague = true;
            }
        }
    }
    close_node(&b->tree->node[0][leaf], &g, angle_of(cosine));
}

static softshadow_status make_leaves(void *ctx, uint64_t begin, uint64_t end) {
    for (uint64_t leaf = begin; leaf < end; leaf++) make_leaf(ctx, leaf);
    return SOFTSHADOW_OK;
}

static void make_parent(const ss_silhouette_node *child, size_t n, ss_silhouette_node *node) {
    gathering g = nothing;
    double angle = 0;
    for (size_t i = 0; i < n; i++) {
        double low[3], high[3];
        for (int k = 0; k < 3; k++) {
            low[k] = child[i].centre[k] - child[i].radius,
            high[k] = child[i].centre[k] + child[i].radius;
            g.axis[k] += child[i].axis[k];
        }
        take_point(&g, low, high);
        g.vague |= child[i].angle > M_PI / 2;
    }
    if (!ss_normalize(g.axis)) g.vague = true;
    for (size_t i = 0; i < n && !g.vague; i++) {
        const double axis[3] = {child[i].axis[0], child[i].axis[1], child[i].axis[2]};
        angle = fmax(angle, angle_of(dot(g.axis, axis)) + child[i].angle);
    }
    close_node(node, &g, angle);
}

static softshadow_status make_levels(builder *b) {
    ss_silhouette_tree *tree = b->tree;
    size_t below = tree->balanced_count;
    while (below > 0) {
        const uint32_t level = tree->levels;
        const size_t fan = level ? SS_SILHOUETTE_FAN : SS_SILHOUETTE_LEAF;
        const size_t n = (below + fan - 1) / fan;
        tree->node[level] = ss_alloc(n, sizeof *tree->node[level]);
        if (!tree->node[level])
            return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for silhouettes");
        tree->count[level] = n;
        tree->levels++;
        if (level == 0) {
            const softshadow_status status =
                ss_parallel_for(b->pool, n, GRAIN / 16, make_leaves, b);
            if (status) return status;
        }
        for (size_t i = 0; i < n && level; i++) {
            const size_t first = i * fan, count = first + fan < below ? fan : below - first;
            make_parent(tree->node[level - 1] + first, count, tree->node[level] + i);
        }
        if (n == 1 || tree->levels == SS_SILHOUETTE_LEVELS) break;
        below = n;
    }
    return SOFTSHADOW_OK;
}

softshadow_status ss_silhouette_tree_build(ss_silhouette_tree **out, const ss_world *world,
                                           const ss_topology *topology, ss_pool *pool) {
    *out = NULL;
    builder b = {.world = world, .topology = topology, .pool = pool};
    b.tree = ss_alloc(1, sizeof *b.tree);
    if (!b.tree) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for silhouettes");
    softshadow_status status = split_edges(&b);
    if (!status) status = ss_parallel_for(pool, topology->triangle_count, GRAIN, find_planes, &b);
    if (!status) status = ss_parallel_for(pool, b.tree->balanced_count, GRAIN, find_keys, &b);
    if (!status) status = sort_edges(&b);
    if (!status) status = find_faces(&b);
    if (!status) status = make_levels(&b);
    ss_free(b.keys);
    if (status) ss_silhouette_tree_destroy(b.tree);
    else *out = b.tree;
    return status;
}

void ss_silhouette_tree_destroy(ss_silhouette_tree *tree) {
    if (!tree) return;
    for (int i = 0; i < SS_SILHOUETTE_LEVELS; i++) ss_free(tree->node[i]);
    ss_free(tree->balanced), ss_free(tree->faces), ss_free(tree->free_edges), ss_free(tree->planes);
    ss_free(tree);
}

size_t ss_silhouette_tree_bytes(const ss_silhouette_tree *tree) {
    size_t bytes = sizeof *tree + (3 * tree->balanced_count + tree->free_count) * sizeof(uint32_t);
    bytes += tree->triangle_count * sizeof *tree->planes;
    for (uint32_t i = 0; i < tree->levels; i++)
        bytes += tree->count[i] * sizeof(ss_silhouette_node);
    return bytes;
}
