/* What a mesh is made of. Half-edges (OpenMesh) answer where they can hold every triangle. Where
 * they refuse one, as at an edge of three, the edge table answers, which takes anything. */
#include <string.h>

#include "base/memory.h"
#include "base/predicate.h"
#include "base/status.h"
#include "topology/edges.h"
#include "topology/openmesh.h"
#include "topology/topology.h"
#include "topology/weld.h"

typedef struct reporter {
    const ss_mesh *mesh;
    softshadow_mesh_report *out;
    double (*positions)[3];
    ss_topology table;
    ss_corners corners;
} reporter;

static softshadow_status no_memory(const reporter *r) {
    return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for a report on %zu triangles",
                   r->mesh->triangle_count);
}

static void double_place(const void *ctx, size_t i, double out[3]) {
    memcpy(out, ((const double(*)[3])ctx)[i], sizeof(double[3]));
}

static softshadow_status place_vertices(reporter *r) {
    const size_t n = r->mesh->vertex_count;
    r->positions = ss_alloc(n, sizeof *r->positions);
    r->table.weld = ss_alloc(n, sizeof *r->table.weld);
    if (!r->positions || !r->table.weld) return no_memory(r);
    for (size_t i = 0; i < n; i++) ss_mesh_vertex(r->mesh, i, r->positions[i]);
    const softshadow_status status = ss_weld(double_place, r->positions, n, 0, r->table.weld);
    if (status != SOFTSHADOW_OK) return status;
    for (size_t i = 0; i < n; i++) r->out->positions += r->table.weld[i] == i;
    r->corners = (ss_corners){r->mesh->indices, r->table.weld, r->mesh->triangle_count, n};
    return SOFTSHADOW_OK;
}

static void sorted_corners(const void *ctx, size_t t, double out[3]) {
    uint32_t c[3];
    ss_corners_of(ctx, t, c);
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < 2; k++) {
            if (c[k] <= c[k + 1]) continue;
            const uint32_t swapped = c[k];
            c[k] = c[k + 1], c[k + 1] = swapped;
        }
    }
    for (int k = 0; k < 3; k++) out[k] = c[k];
}

/* Triangles with the same corners are found as places with the same coordinates are. */
static softshadow_status count_triangles(reporter *r) {
    const size_t n = r->mesh->triangle_count;
    uint32_t *first = ss_alloc(n, sizeof *first);
    if (!first) return no_memory(r);
    const softshadow_status status = ss_weld(sorted_corners, &r->corners, n, 0, first);
    for (size_t t = 0; status == SOFTSHADOW_OK && t < n; t++) {
        uint32_t c[3];
        ss_corners_of(&r->corners, t, c);
        r->out->degenerate_triangles +=
            ss_collinear(r->positions[c[0]], r->positions[c[1]], r->positions[c[2]]);
        r->out->duplicate_triangles += first[t] != t;
    }
    ss_free(first);
    return status;
}

static void count_edges(reporter *r) {
    const ss_topology *table = &r->table;
    r->out->edges = table->edge_count;
    for (size_t e = 0; e < table->edge_count; e++) {
        const uint32_t uses = ss_edge_uses(&table->edges[e]);
        const uint32_t *use = table->uses + table->edges[e].first_use;
        r->out->boundary_edges += uses == 1;
        r->out->nonmanifold_edges += uses > 2;
        r->out->flipped_edges += uses == 2 && ((use[0] ^ use[1]) & 1) == 0;
    }
    r->out->components = table->component_count;
    for (uint32_t c = 0; c < table->component_count; c++) {
        r->out->closed_components += table->components[c].closed;
    }
}

static uint32_t root_of(uint32_t *parent, uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

/* Where, among all corners, the triangle of this use has its corner at vertex v. */
static uint32_t corner_at(const reporter *r, uint32_t use, uint32_t v) {
    uint32_t c[3];
    const uint32_t t = ss_use_triangle(use);
    ss_corners_of(&r->corners, t, c);
    return 3 * t + (c[0] == v ? 0u : c[1] == v ? 1u : 2u);
}

/* Joins the corners at both ends of every edge: what stays apart at a vertex are its fans. */
static void join_corners(const reporter *r, uint32_t *parent) {
    for (size_t e = 0; e < r->table.edge_count; e++) {
        const ss_edge *edge = r->table.edges + e;
        for (uint32_t i = edge[0].first_use + 1; i < edge[1].first_use; i++) {
            for (int end = 0; end < 2; end++) {
                const uint32_t v = edge->vertex[end];
                const uint32_t a = root_of(parent, corner_at(r, r->table.uses[i - 1], v));
                const uint32_t b = root_of(parent, corner_at(r, r->table.uses[i], v));
                parent[a > b ? a : b] = a > b ? b : a;
            }
        }
    }
}

static softshadow_status count_fans(reporter *r) {
    const size_t n = 3 * r->mesh->triangle_count;
    uint32_t *parent = ss_alloc(n, sizeof *parent);
    uint8_t *fans = ss_alloc(r->mesh->vertex_count, 1);
    const softshadow_status status = parent && fans ? SOFTSHADOW_OK : no_memory(r);
    if (status == SOFTSHADOW_OK) {
        for (size_t i = 0; i < n; i++) parent[i] = (uint32_t)i;
        join_corners(r, parent);
        for (size_t i = 0; i < n; i++) {
            if (parent[i] != i || r->table.triangle_edges[i] == SS_NO_EDGE) continue;
            uint8_t *count = &fans[r->table.weld[r->mesh->indices[i]]];
            if (*count < 2 && ++*count == 2) r->out->nonmanifold_vertices++;
        }
    }
    ss_free(parent);
    ss_free(fans);
    return status;
}

/* The corners of all triangles that half-edges can be asked to hold. */
static uint32_t *clean_corners(const reporter *r, size_t *count) {
    uint32_t *corners = ss_alloc(r->mesh->triangle_count, sizeof(uint32_t[3]));
    *count = 0;
    for (size_t t = 0; corners && t < r->mesh->triangle_count; t++) {
        uint32_t c[3];
        ss_corners_of(&r->corners, t, c);
        if (!ss_corners_degenerate(c)) memcpy(corners + 3 * (*count)++, c, sizeof c);
    }
    return corners;
}

static softshadow_status count_by_halfedges(reporter *r) {
    size_t count;
    ss_halfedges halfedges;
    uint32_t *corners = clean_corners(r, &count);
    if (!corners) return no_memory(r);
    const softshadow_status status =
        ss_openmesh_count(&halfedges, corners, count, r->mesh->vertex_count);
    ss_free(corners);
    if (status != SOFTSHADOW_OK) return status;
    if (halfedges.refused) return count_fans(r);
    r->out->edges = halfedges.edges, r->out->boundary_edges = halfedges.boundary_edges;
    r->out->components = halfedges.components;
    r->out->nonmanifold_vertices = halfedges.nonmanifold_vertices;
    return SOFTSHADOW_OK;
}

/* Does the front of the triangle look at the light's centre? Exactly edge-on it does not. */
static bool faces_light(const reporter *r, const softshadow_light *light, uint32_t t) {
    uint32_t c[3];
    ss_corners_of(&r->corners, t, c);
    const double *a = r->positions[c[0]], *b = r->positions[c[1]], *d = r->positions[c[2]];
    if (light->type == SOFTSHADOW_SUN) return ss_orient3d_towards(a, b, d, light->direction) < 0;
    return ss_orient3d(a, b, d, light->position) > 0;
}

/* One sign per face, so that silhouettes are loops whatever the rounding. */
static softshadow_status count_silhouette(reporter *r, const softshadow_light *light) {
    bool *facing = ss_alloc(r->mesh->triangle_count, sizeof *facing);
    if (!facing) return no_memory(r);
    for (uint32_t t = 0; t < r->mesh->triangle_count; t++) facing[t] = faces_light(r, light, t);
    for (size_t e = 0; e < r->table.edge_count; e++) {
        const ss_edge *edge = r->table.edges + e;
        int64_t sum = 0;
        for (uint32_t i = edge[0].first_use; i < edge[1].first_use; i++) {
            const uint32_t use = r->table.uses[i];
            if (facing[ss_use_triangle(use)]) sum += ss_use_sign(use);
        }
        r->out->silhouette_edges += sum != 0;
    }
    ss_free(facing);
    return SOFTSHADOW_OK;
}

static softshadow_status fill(reporter *r, const softshadow_light *light) {
    softshadow_status status = place_vertices(r);
    if (status == SOFTSHADOW_OK) status = ss_edges_build(&r->table, &r->corners, NULL);
    if (status == SOFTSHADOW_OK) status = ss_components_build(&r->table);
    if (status == SOFTSHADOW_OK) status = count_triangles(r);
    if (status != SOFTSHADOW_OK) return status;
    count_edges(r);
    status = count_by_halfedges(r);
    if (status == SOFTSHADOW_OK && light) status = count_silhouette(r, light);
    return status;
}

softshadow_status ss_topology_report(const ss_mesh *mesh, const softshadow_light *light,
                                     softshadow_mesh_report *out) {
    *out = (softshadow_mesh_report){.struct_size = out->struct_size};
    out->vertices = mesh->vertex_count, out->triangles = mesh->triangle_count;
    for (int k = 0; k < 3; k++) out->bounds[k] = mesh->low[k], out->bounds[3 + k] = mesh->high[k];
    reporter r = {.mesh = mesh, .out = out};
    const softshadow_status status = fill(&r, light);
    ss_free(r.positions);
    ss_edges_free(&r.table);
    return status;
}
