/* Building outlines: edges numbered in the BVH's order, ranges of normals from the triangles,
 * boundaries from below upwards by signed sums.
 *
 * based on: normal cones (Shirman & Abi-Ezzi 1993); silhouette edges of clusters as signed
 * boundaries, as in shadow volumes (Lloyd et al. 2004). */
#include "trace/outline.h"

#include <math.h>
#include <string.h>

#include "base/status.h"
#include "base/vec.h"

#define NORMAL_ERROR 0x1p-20f
#define LEAST_COSINE 0.02 /* a wider cone tells nothing */

typedef struct builder {
    const ss_bvh *bvh;
    const ss_topology *topology;
    const uint8_t *tested;
    ss_outline *outline;
    float (*normal)[4]; /* by position in bvh->order; [3] is 0 for a face without a side */
    uint8_t *lit;       /* by position: sides that all of the light is on, SS_DROP_FRONT or _BACK */
    uint32_t *edge;     /* topology's edge -> ours */
    int32_t *sum;       /* per edge, all 0 between lists */
    uint8_t *drop;      /* per solid: SS_DRAW_BOTH .. */
    const ss_light *light;
} builder;

/* ---- faces
 * -------------------------------------------------------------------------------------*/

static void corner_of(const builder *b, uint32_t triangle, int corner, double out[3]) {
    const ss_world *world = b->bvh->world;
    const float *v =
        world->vertices + 3 * (size_t)world->indices[3 * (size_t)triangle + (size_t)corner];
    for (int k = 0; k < 3; k++) out[k] = v[k];
}

/* The side of a face that all of the light is on, by more than floats would misjudge. What is
 * before a sphere's polar plane lies between the point and the sphere, too. */
static uint8_t side_of_light(const ss_light *light, const double n[3], const double corner[3]) {
    const bool sun = light->type == SOFTSHADOW_SUN;
    const double u = ss_dot(n, light->u), v = ss_dot(n, light->v);
    double to[3], reach = light->type == SOFTSHADOW_RECT ? fabs(u) + fabs(v) : sqrt(u * u + v * v);
    if (light->type == SOFTSHADOW_SPHERE) reach = light->radius;
    if (sun) memcpy(to, light->normal, sizeof to);
    else ss_sub(light->centre, corner, to);
    const double room = reach + 2 * SS_SIDE_ERROR + 0x1p-40 * (ss_length(to) + light->radius);
    const double height = ss_dot(n, to);
    return height > room ? SS_DROP_FRONT : height < -room ? SS_DROP_BACK : SS_DRAW_BOTH;
}

static softshadow_status find_normals(void *ctx, uint64_t begin, uint64_t end) {
    builder *b = ctx;
    for (uint64_t i = begin; i < end; i++) {
        double v[3][3], e[3], f[3], n[3];
        for (int c = 0; c < 3; c++) corner_of(b, b->bvh->order[i], c, v[c]);
        ss_sub(v[1], v[0], e);
        ss_sub(v[2], v[0], f);
        ss_cross(e, f, n);
        const double area = ss_length(n), longest = fmax(ss_length(e), ss_length(f));
        /* A face thinner than the rounding of its corners can turn over when it is projected. */
        b->normal[i][3] = area > SS_SIDE_ERROR * longest ? 1 : 0;
        if (area > 0) {
            for (int k = 0; k < 3; k++) n[k] /= area, b->normal[i][k] = (float)n[k];
            if (b->normal[i][3] != 0) b->lit[i] = side_of_light(b->light, n, v[0]);
        }
    }
    return SOFTSHADOW_OK;
}

static void set_unknown(ss_outline_node *node, uint32_t slot) {
    for (int k = 0; k < 3; k++) node->normal_low[k][slot] = -1, node->normal_high[k][slot] = 1;
    node->offset_low[slot] = -INFINITY, node->offset_high[slot] = INFINITY;
    node->cosine[slot] = 0, node->sine[slot] = 1;
}

/* Ranges of normals and offsets of the faces in [first, last); false if some face has no side. */
static bool set_ranges(const builder *b, ss_outline_node *node, uint32_t slot, uint32_t first,
                       uint32_t last, double axis[3]) {
    float low[3] = {2, 2, 2}, high[3] = {-2, -2, -2};
    double least = INFINITY, most = -INFINITY, sum[3] = {0, 0, 0};
    for (uint32_t i = first; i < last; i++) {
        const float *n = b->normal[i];
        double corner[3], offset = 0;
        if (n[3] == 0) return false;
        corner_of(b, b->bvh->order[i], 0, corner);
        for (int k = 0; k < 3; k++) {
            low[k] = n[k] < low[k] ? n[k] : low[k], high[k] = n[k] > high[k] ? n[k] : high[k];
            offset += (double)n[k] * (corner[k] - node->middle[k][slot]);
            sum[k] += n[k];
        }
        least = offset < least ? offset : least, most = offset > most ? offset : most;
    }
    for (int k = 0; k < 3; k++) {
        node->normal_low[k][slot] = low[k] - NORMAL_ERROR;
        node->normal_high[k][slot] = high[k] + NORMAL_ERROR;
        axis[k] = sum[k];
    }
    node->offset_low[slot] = (float)least - SS_SIDE_ERROR;
    node->offset_high[slot] = (float)most + SS_SIDE_ERROR;
    return true;
}

static void set_cone(const builder *b, ss_outline_node *node, uint32_t slot, uint32_t first,
                     uint32_t last, double axis[3]) {
    double cosine = 1;
    if (!ss_normalize(axis)) cosine = 0;
    for (uint32_t i = first; i < last && cosine > LEAST_COSINE; i++) {
        const float *n = b->normal[i];
        const double c = n[0] * axis[0] + n[1] * axis[1] + n[2] * axis[2];
        cosine = c < cosine ? c : cosine;
    }
    cosine -= NORMAL_ERROR;
    if (!(cosine > LEAST_COSINE)) cosine = 0;
    for (int k = 0; k < 3; k++) node->axis[k][slot] = (float)axis[k];
    node->cosine[slot] = (float)cosine;
    node->sine[slot] = (float)(sqrt(fmax(0, 1 - cosine * cosine)) + NORMAL_ERROR);
}

static softshadow_status find_ranges(void *ctx, uint64_t begin, uint64_t end) {
    builder *b = ctx;
    for (uint64_t n = begin; n < end; n++) {
        const ss_bvh_node *from = &b->bvh->nodes[n];
        ss_outline_node *node = &b->outline->nodes[n];
        for (uint32_t i = 0; i < SS_BVH_WIDTH; i++) {
            double axis[3];
            if (i >= from->count) {
                set_unknown(node, i);
                continue;
            }
            for (int k = 0; k < 3; k++) {
                node->middle[k][i] = from->low[k][i] + (from->high[k][i] - from->low[k][i]) / 2;
            }
            if (set_ranges(b, node, i, from->first[i], from->last[i], axis)) {
                set_cone(b, node, i, from->first[i], from->last[i], axis);
            } else {
                set_unknown(node, i);
            }
        }
    }
    return SOFTSHADOW_OK;
}

/* ---- edges
 * -------------------------------------------------------------------------------------*/

static uint32_t number_edge(builder *b, uint32_t topology_edge) {
    uint32_t *edge = &b->edge[topology_edge];
    if (*edge == SS_NO_EDGE) {
        *edge = b->outline->edge_count++;
        for (int end = 0; end < 2; end++) {
            const uint32_t v = b->topology->edges[topology_edge].vertex[end];
            memcpy(&b->outline->ends[*edge][4 * end], b->bvh->world->vertices + 3 * (size_t)v,
                   3 * sizeof(float));
        }
    }
    return *edge;
}

/* Numbers edges as the leaves come, so that what is drawn together lies together. */
static void number_uses(builder *b) {
    const ss_topology *t = b->topology;
    for (uint32_t l = 0; l < b->bvh->leaf_count; l++) {
        const ss_bvh_leaf *leaf = &b->bvh->leaves[l];
        for (uint32_t s = 0; s < SS_BVH_WIDTH; s++) {
            for (uint32_t k = 0; k < 3; k++) {
                uint32_t *use = &b->outline->leaf_uses[l][k][s];
                *use = SS_NO_USE;
                if (s >= leaf->count) continue;
                const size_t at = 3 * (size_t)leaf->triangle[s];
                const uint32_t edge = t->triangle_edges[at + k];
                if (edge == SS_NO_EDGE) continue;
                const uint32_t start = t->weld[b->bvh->world->indices[at + k]];
                *use = number_edge(b, edge) << 1 | (start != t->edges[edge].vertex[0]);
            }
        }
    }
}

static bool room_for(ss_outline *o, size_t more) {
    if (o->use_count + more <= o->use_room) return true;
    const size_t room = 2 * (o->use_count + more);
    if (room > UINT32_MAX) return false;
    uint32_t *grown = ss_grow(o->uses, o->use_count, room, sizeof *grown);
    if (!grown) return false;
    o->uses = grown, o->use_room = (uint32_t)room;
    return true;
}

static void add_use(builder *b, uint32_t use) {
    if (use == SS_NO_USE) return;
    b->sum[use >> 1] += use & 1 ? -1 : 1;
    b->outline->uses[b->outline->use_count++] = use;
}

/* Keeps of the uses from `first` on what their sums leave, an edge as often as it counts. */
static uint32_t cancel(builder *b, uint32_t first) {
    ss_outline *o = b->outline;
    uint32_t kept = first;
    for (uint32_t i = first; i < o->use_count; i++) {
        const uint32_t use = o->uses[i];
        int32_t *sum = &b->sum[use >> 1];
        const int32_t unit = use & 1 ? -1 : 1;
        if ((int64_t)*sum * unit <= 0) continue;
        *sum -= unit;
        o->uses[kept++] = use;
    }
    o->use_count = kept;
    return kept - first;
}

/* The boundary of one child, from its faces or from its own children's boundaries. */
static bool find_boundary(builder *b, uint32_t child, uint32_t *first, uint32_t *count) {
    ss_outline *o = b->outline;
    *first = o->use_count;
    if (child & SS_BVH_LEAF) {
        const uint32_t l = child & ~SS_BVH_LEAF;
        if (!room_for(o, 3 * SS_BVH_WIDTH)) return false;
        for (uint32_t s = 0; s < b->bvh->leaves[l].count; s++) {
            for (int k = 0; k < 3; k++) add_use(b, o->leaf_uses[l][k][s]);
        }
    } else {
        const ss_outline_node *below = &o->nodes[child];
        for (uint32_t i = 0; i < b->bvh->nodes[child].count; i++) {
            if (!room_for(o, below->count[i])) return false;
            for (uint32_t j = 0; j < below->count[i]; j++) add_use(b, o->uses[below->first[i] + j]);
        }
    }
    /* Sums are read before any is taken away, so a second pass is not needed. */
    *count = cancel(b, *first);
    return true;
}

static bool any_tested(const builder *b, uint32_t first, uint32_t last) {
    for (uint32_t i = first; i < last && b->tested; i++) {
        if (b->tested[b->bvh->order[i]]) return true;
    }
    return false;
}

/* Which faces of each solid need not be drawn. Closed by sums is not enough: two solids glued along
 * an edge, one of them inside out, are closed, too; so where an edge has more than two uses it is
 * the solids of connectivity.h that are asked. */
static bool find_solids(builder *b) {
    const ss_topology *t = b->topology;
    const ss_component *solids = t->solids ? t->solids : t->components;
    const uint32_t count = t->solids ? t->solid_count : t->component_count;
    double low[3], high[3];
    b->drop = ss_alloc(count, 1);
    if (!b->drop) return false;
    ss_light_box(b->light, low, high);
    for (uint32_t c = 0; c < count; c++) {
        const ss_component *from = &solids[c];
        const bool fin = from->triangle_count == 2; /* back to back: one of them always faces away */
        bool apart = false;
        for (int k = 0; k < 3; k++) {
            apart |= low[k] > from->high[k] || high[k] < from->low[k];
        }
        if (!from->closed || !apart || (from->volume == 0 && !fin)) continue;
        b->drop[c] = from->volume > 0 || fin ? SS_DROP_FRONT : SS_DROP_BACK;
    }
    return true;
}

static uint8_t drop_of(const builder *b, uint32_t triangle) {
    const ss_topology *t = b->topology;
    const uint32_t solid =
        t->solids ? t->triangle_solid[triangle] : t->triangle_component[triangle];
    return solid == SS_NO_COMPONENT ? SS_DRAW_BOTH : b->drop[solid];
}

/* Where point and light are on one side of a face it is in nobody's way. */
static void mark_leaves(builder *b) {
    for (uint32_t l = 0; l < b->bvh->leaf_count; l++) {
        const ss_bvh_leaf *leaf = &b->bvh->leaves[l];
        for (uint32_t s = 0; s < leaf->count; s++) {
            const uint8_t drop = drop_of(b, leaf->triangle[s]), lit = b->lit[leaf->first + s];
            if (drop) b->outline->leaf_drop[l][drop - 1] |= (uint16_t)(1u << s);
            if (lit) b->outline->leaf_drop[l][lit - 1] |= (uint16_t)(1u << s);
        }
    }
}

/* Children have higher numbers than their parents. */
static void mark_nodes(builder *b) {
    for (uint32_t n = b->bvh->node_count; n-- > 0;) {
        const ss_bvh_node *from = &b->bvh->nodes[n];
        ss_outline_node *node = &b->outline->nodes[n];
        for (uint32_t i = 0; i < from->count; i++) {
            const uint32_t child = from->child[i], l = child & ~SS_BVH_LEAF;
            uint32_t front, back, all;
            if (child & SS_BVH_LEAF) {
                all = (1u << b->bvh->leaves[l].count) - 1;
                front = b->outline->leaf_drop[l][0], back = b->outline->leaf_drop[l][1];
            } else {
                all = (1u << b->bvh->nodes[child].count) - 1;
                front = b->outline->nodes[child].drop_front,
                back = b->outline->nodes[child].drop_back;
            }
            node->drop_front |= (uint16_t)((front == all) << i);
            node->drop_back |= (uint16_t)((back == all) << i);
        }
    }
}

/* Children have higher numbers than their parents: from the last node to the first. */
static bool find_boundaries(builder *b) {
    for (uint32_t n = b->bvh->node_count; n-- > 0;) {
        const ss_bvh_node *from = &b->bvh->nodes[n];
        ss_outline_node *node = &b->outline->nodes[n];
        for (uint32_t i = 0; i < from->count; i++) {
            if (!find_boundary(b, from->child[i], &node->first[i], &node->count[i])) return false;
            const uint32_t faces = from->last[i] - from->first[i];
            const bool fewer = faces == 1 || node->count[i] <= faces * 19 / 10;
            if (fewer && !any_tested(b, from->first[i], from->last[i])) node->whole |= 1u << i;
        }
    }
    return true;
}

/* ---- all of it
 * ---------------------------------------------------------------------------------*/

static bool allocate(builder *b) {
    ss_outline *o = b->outline;
    const size_t triangles = b->bvh->world->triangle_count, edges = b->topology->edge_count;
    o->node_count = b->bvh->node_count, o->leaf_count = b->bvh->leaf_count;
    o->nodes = ss_alloc(o->node_count, sizeof *o->nodes);
    o->leaf_uses = ss_alloc(o->leaf_count, sizeof *o->leaf_uses);
    o->leaf_drop = ss_alloc(o->leaf_count, sizeof *o->leaf_drop);
    o->ends = ss_alloc(edges, sizeof *o->ends);
    b->normal = ss_alloc(triangles, sizeof *b->normal);
    b->lit = ss_alloc(triangles, sizeof *b->lit);
    b->edge = ss_alloc(edges, sizeof *b->edge);
    b->sum = ss_alloc(edges, sizeof *b->sum);
    if (!o->nodes || !o->leaf_uses || !o->leaf_drop || !o->ends || !b->normal || !b->lit ||
        !b->edge || !b->sum)
        return false;
    memset(b->edge, 0xff, edges * sizeof *b->edge);
    return room_for(o, triangles);
}

static softshadow_status run(builder *b, ss_pool *pool) {
    if (!allocate(b)) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for outlines");
    softshadow_status status =
        ss_parallel_for(pool, b->bvh->world->triangle_count, 4096, find_normals, b);
    if (!status) status = ss_parallel_for(pool, b->bvh->node_count, 16, find_ranges, b);
    if (status) return status;
    number_uses(b);
    if (!find_solids(b)) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for outlines");
    mark_leaves(b);
    mark_nodes(b);
    if (!find_boundaries(b)) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for outlines");
    return SOFTSHADOW_OK;
}

softshadow_status ss_outline_build(ss_outline **out, const ss_bvh *bvh, const ss_topology *topology,
                                   const uint8_t *tested, const ss_light *light, ss_pool *pool) {
    *out = NULL;
    builder b = {.bvh = bvh,
                 .topology = topology,
                 .tested = tested,
                 .light = light,
                 .outline = ss_alloc(1, sizeof *b.outline)};
    if (!b.outline) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for outlines");
    const softshadow_status status = run(&b, pool);
    ss_free(b.normal);
    ss_free(b.lit);
    ss_free(b.edge);
    ss_free(b.sum);
    ss_free(b.drop);
    if (status)
        ss_outline_destroy(b.outline);
    else
        *out = b.outline;
    return status;
}

void ss_outline_destroy(ss_outline *o) {
    if (!o) return;
    ss_free(o->nodes);
    ss_free(o->leaf_uses);
    ss_free(o->leaf_drop);
    ss_free(o->uses);
    ss_free(o->ends);
    ss_free(o);
}

size_t ss_outline_bytes(const ss_outline *o) {
    return sizeof *o + o->node_count * sizeof *o->nodes +
           o->leaf_count * (sizeof *o->leaf_uses + sizeof *o->leaf_drop) +
           o->use_room * sizeof *o->uses + o->edge_count * sizeof *o->ends;
}
