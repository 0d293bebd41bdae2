/* Components: triangles connected by edges, by union-find. The root of each is its lowest triangle.
 * They are closed where every edge is used equally often both ways: a sum over uses, which takes
 * complex edges as well as plain ones. */
#include "base/memory.h"
#include "base/status.h"
#include "topology/edges.h"

static uint32_t root_of(uint32_t *parent, uint32_t t) {
    while (parent[t] != t) t = parent[t] = parent[parent[t]];
    return t;
}

static void join(uint32_t *parent, uint32_t a, uint32_t b) {
    a = root_of(parent, a), b = root_of(parent, b);
    if (a < b)
        parent[b] = a;
    else
        parent[a] = b;
}

static void join_over_edges(ss_topology *out) {
    uint32_t *parent = out->triangle_component;
    for (size_t t = 0; t < out->triangle_count; t++) parent[t] = (uint32_t)t;
    for (size_t e = 0; e < out->edge_count; e++) {
        const ss_edge *edge = out->edges + e;
        for (uint32_t i = edge[0].first_use + 1; i < edge[1].first_use; i++) {
            join(parent, ss_use_triangle(out->uses[i - 1]), ss_use_triangle(out->uses[i]));
        }
    }
}

/* Roots come before the rest of their component, so that parents may become numbers on the way. */
static uint32_t number(ss_topology *out) {
    uint32_t *parent = out->triangle_component, count = 0;
    for (size_t t = 0; t < out->triangle_count; t++) {
        if (out->triangle_edges[3 * t] == SS_NO_EDGE)
            parent[t] = SS_NO_COMPONENT;
        else if (parent[t] == t)
            parent[t] = count++;
        else
            parent[t] = parent[parent[t]];
    }
    return count;
}

static void flatten(ss_topology *out) {
    uint32_t *parent = out->triangle_component;
    for (size_t t = 0; t < out->triangle_count; t++) parent[t] = parent[parent[t]];
}

static void gather(ss_topology *out) {
    for (uint32_t t = 0; t < out->triangle_count; t++) {
        const uint32_t c = out->triangle_component[t];
        if (c == SS_NO_COMPONENT) continue;
        ss_component *component = &out->components[c];
        if (component->triangle_count++ == 0)
            component->first_triangle = t, component->closed = true;
    }
    for (size_t e = 0; e < out->edge_count; e++) {
        const ss_edge *edge = out->edges + e;
        int64_t sum = 0;
        for (uint32_t i = edge[0].first_use; i < edge[1].first_use; i++) {
            sum += ss_use_sign(out->uses[i]);
        }
        const uint32_t t = ss_use_triangle(out->uses[edge->first_use]);
        if (sum != 0) out->components[out->triangle_component[t]].closed = false;
    }
}

softshadow_status ss_components_build(ss_topology *out) {
    out->triangle_component = ss_alloc(out->triangle_count, sizeof *out->triangle_component);
    if (out->triangle_component) {
        join_over_edges(out);
        flatten(out);
        out->component_count = number(out);
        out->components = ss_alloc(out->component_count, sizeof *out->components);
    }
    if (!out->triangle_component || !out->components) {
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for the components of %zu triangles",
                       out->triangle_count);
    }
    gather(out);
    return SOFTSHADOW_OK;
}
