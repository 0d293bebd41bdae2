/* Solids: what is left of components where more than two triangles share an edge. Meshes in use
 * have such edges: fins, two triangles back to back, and places where a surface touches itself.
 * There the uses of an edge are taken in pairs, one each way, that bound the same wedge of space:
 * fins first, then around the edge. What pairs connect is a closed surface of its own, and what is
 * true of segments that cross such a surface is true of each solid for itself. */
#include "topology/solids.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/status.h"
#include "base/vec.h"

#define MOST 32 /* uses of an edge that are taken in pairs */

typedef struct fan {
    uint32_t use, third; /* the corner of its triangle that is not on the edge */
    double angle;
} fan;

typedef struct builder {
    ss_topology *out;
    const ss_world *world;
    bool *open; /* per triangle: an edge of it has no partner */
} builder;

static uint32_t root_of(uint32_t *parent, uint32_t t) {
    while (parent[t] != t) t = parent[t] = parent[parent[t]];
    return t;
}

static void join(const builder *b, uint32_t one, uint32_t two) {
    uint32_t *parent = b->out->triangle_solid;
    const uint32_t x = root_of(parent, ss_use_triangle(one)),
                   y = root_of(parent, ss_use_triangle(two));
    parent[x > y ? x : y] = x > y ? y : x;
}

static uint32_t third_of(const builder *b, const ss_edge *edge, uint32_t use) {
    const uint32_t *index = b->world->indices + 3 * (size_t)ss_use_triangle(use);
    for (int k = 0; k < 3; k++) {
        const uint32_t v = b->out->weld[index[k]];
        if (v != edge->vertex[0] && v != edge->vertex[1]) return v;
    }
    return edge->vertex[0]; /* not of a triangle that has edges */
}

static void between(const builder *b, uint32_t from, uint32_t to, double out[3]) {
    const float *u = b->world->vertices + 3 * (size_t)from,
                *v = b->world->vertices + 3 * (size_t)to;
    for (int k = 0; k < 3; k++) out[k] = (double)v[k] - (double)u[k];
}

/* Joins triangles back to back; gives how many others there are, which come first. */
static uint32_t join_fins(const builder *b, fan *fans, uint32_t count) {
    bool paired[MOST] = {false};
    uint32_t left = 0;
    for (uint32_t i = 0; i < count; i++) {
        for (uint32_t j = i + 1; j < count && !paired[i]; j++) {
            if (paired[j] || fans[i].third != fans[j].third) continue;
            if (!((fans[i].use ^ fans[j].use) & 1)) continue;
            join(b, fans[i].use, fans[j].use);
            paired[i] = paired[j] = true;
        }
        if (!paired[i]) fans[left++] = fans[i];
    }
    return left;
}

static int compare_angles(const void *a, const void *b) {
    const fan *x = a, *y = b;
    if (x->angle != y->angle) return x->angle < y->angle ? -1 : 1;
    return (x->use > y->use) - (x->use < y->use);
}

/* Sorts around the edge; false for a triangle that has no angle. */
static bool sort_fans(const builder *b, const ss_edge *edge, fan *fans, uint32_t count) {
    double along[3], right[3] = {0, 0, 0}, up[3] = {0, 0, 0};
    between(b, edge->vertex[0], edge->vertex[1], along);
    if (!ss_normalize(along)) return false;
    for (uint32_t i = 0; i < count; i++) {
        double to[3];
        between(b, edge->vertex[0], fans[i].third, to);
        ss_add_scaled(to, -ss_dot(along, to), along, to);
        if (i == 0) {
            for (int k = 0; k < 3; k++) right[k] = to[k];
            if (!ss_normalize(right)) return false;
            ss_cross(along, right, up);
        }
        const double x = ss_dot(right, to), y = ss_dot(up, to);
        if (x == 0 && y == 0) return false;
        fans[i].angle = i == 0 ? 0 : atan2(y, x);
    }
    qsort(fans, count, sizeof *fans, compare_angles);
    return true;
}

/* Counterclockwise, a wedge of the inside begins behind each triangle that runs against the edge
 * and ends at one that runs along it, as brackets do: two solids that touch, one of them perhaps
 * inside out, so come apart. False where they do not match. */
static bool join_wedges(const builder *b, const ss_edge *edge, fan *fans, uint32_t count) {
    int32_t depth = 0, least = 0;
    uint32_t start = 0, begun[MOST], open = 0;
    if (count > 2 && !sort_fans(b, edge, fans, count)) return false;
    for (uint32_t i = 0; i < count; i++) {
        depth -= ss_use_sign(fans[i].use);
        if (depth < least) least = depth, start = i + 1;
    }
    if (depth != 0) return false;
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t use = fans[(start + i) % count].use;
        if (ss_use_sign(use) < 0) begun[open++] = use;
        else join(b, begun[--open], use);
    }
    return true;
}

static void join_edge(const builder *b, const ss_edge *edge) {
    const uint32_t *uses = b->out->uses + edge->first_use, count = ss_edge_uses(edge);
    fan fans[MOST];
    uint32_t left = count;
    if (count <= MOST) {
        for (uint32_t i = 0; i < count; i++) {
            fans[i] = (fan){uses[i], count > 2 ? third_of(b, edge, uses[i]) : 0, 0};
        }
        if (count > 2) left = join_fins(b, fans, count);
        if (join_wedges(b, edge, fans, left)) return;
    }
    for (uint32_t i = 0; i < left; i++) {
        b->open[ss_use_triangle(count <= MOST ? fans[i].use : uses[i])] = true;
    }
}

/* Roots come before the rest of their solid, so that parents may become numbers on the way. */
static void number(ss_topology *out) {
    uint32_t *parent = out->triangle_solid;
    for (size_t t = 0; t < out->triangle_count; t++) parent[t] = root_of(parent, (uint32_t)t);
    out->solid_count = 0;
    for (size_t t = 0; t < out->triangle_count; t++) {
        if (out->triangle_edges[3 * t] == SS_NO_EDGE)
            parent[t] = SS_NO_COMPONENT;
        else if (parent[t] == t)
            parent[t] = out->solid_count++;
        else
            parent[t] = parent[parent[t]];
    }
}

static softshadow_status split(builder *b) {
    ss_topology *out = b->out;
    out->triangle_solid = ss_alloc(out->triangle_count, sizeof *out->triangle_solid);
    b->open = ss_alloc(out->triangle_count, sizeof *b->open);
    if (out->triangle_solid && b->open) {
        for (size_t t = 0; t < out->triangle_count; t++) out->triangle_solid[t] = (uint32_t)t;
        for (size_t e = 0; e < out->edge_count; e++) join_edge(b, out->edges + e);
        number(out);
        out->solids = ss_alloc(out->solid_count, sizeof *out->solids);
    }
    if (!out->triangle_solid || !b->open || !out->solids) {
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for the solids of %zu triangles",
                       out->triangle_count);
    }
    for (uint32_t t = 0; t < out->triangle_count; t++) {
        if (out->triangle_solid[t] == SS_NO_COMPONENT) continue;
        ss_component *solid = &out->solids[out->triangle_solid[t]];
        if (solid->triangle_count++ == 0) solid->first_triangle = t, solid->closed = true;
        if (b->open[t]) solid->closed = false;
    }
    return SOFTSHADOW_OK;
}

softshadow_status ss_solids_build(ss_topology *out, const ss_world *world) {
    builder b = {.out = out, .world = world};
    bool plain = true;
    for (size_t e = 0; e < out->edge_count && plain; e++) {
        plain = ss_edge_uses(&out->edges[e]) <= 2;
    }
    if (plain) return SOFTSHADOW_OK;
    const softshadow_status status = split(&b);
    ss_free(b.open);
    return status;
}
