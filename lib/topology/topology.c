/* The world's connectivity: weld each mesh, one edge table, components with what is solid. */
#include "topology/topology.h"

#include "base/memory.h"
#include "base/status.h"
#include "topology/edges.h"
#include "topology/solids.h"
#include "topology/weld.h"

typedef struct welder {
    const ss_world *world;
    uint32_t *weld;
} welder;

static void float_place(const void *ctx, size_t i, double out[3]) {
    const float *vertex = (const float *)ctx + 3 * i;
    for (int k = 0; k < 3; k++) out[k] = vertex[k];
}

static softshadow_status weld_meshes(void *ctx, uint64_t begin, uint64_t end) {
    const welder *w = ctx;
    const ss_world *world = w->world;
    for (uint64_t m = begin; m < end; m++) {
        const uint32_t first = world->meshes[m].first_vertex;
        const size_t last =
            m + 1 < world->mesh_count ? world->meshes[m + 1].first_vertex : world->vertex_count;
        const softshadow_status status = ss_weld(float_place, world->vertices + 3 * (size_t)first,
                                                 last - first, first, w->weld + first);
        if (status != SOFTSHADOW_OK) return status;
    }
    return SOFTSHADOW_OK;
}

static softshadow_status weld_world(ss_topology *out, const ss_world *world, ss_pool *pool) {
    out->weld = ss_alloc(world->vertex_count, sizeof *out->weld);
    if (!out->weld) {
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for welding %zu vertices",
                       world->vertex_count);
    }
    welder w = {world, out->weld};
    return ss_parallel_for(pool, world->mesh_count, 1, weld_meshes, &w);
}

/* Six times the volume of the cone from the component's first corner over this triangle. */
static double cone(const float *apex, const float *corner[3]) {
    double v[3][3];
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) v[i][k] = (double)corner[i][k] - (double)apex[k];
    }
    return v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) +
           v[0][1] * (v[1][2] * v[2][0] - v[1][0] * v[2][2]) +
           v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
}

static void measure(ss_component *component, const ss_world *world, uint32_t t) {
    const float *corner[3];
    for (int i = 0; i < 3; i++) {
        corner[i] = world->vertices + 3 * (size_t)world->indices[3 * (size_t)t + (size_t)i];
    }
    const float *apex =
        world->vertices + 3 * (size_t)world->indices[3 * (size_t)component->first_triangle];
    if (t == component->first_triangle) {
        for (int k = 0; k < 3; k++) component->low[k] = component->high[k] = corner[0][k];
    }
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            if (corner[i][k] < component->low[k]) component->low[k] = corner[i][k];
            if (corner[i][k] > component->high[k]) component->high[k] = corner[i][k];
        }
    }
    component->volume += cone(apex, corner) / 6;
}

static void measure_all(const uint32_t *of, ss_component *components, const ss_world *world) {
    const ss_world_mesh *mesh = world->meshes;
    for (uint32_t t = 0; t < world->triangle_count; t++) {
        while (mesh + 1 < world->meshes + world->mesh_count && t >= mesh[1].first_triangle) mesh++;
        if (of[t] == SS_NO_COMPONENT) continue;
        measure(&components[of[t]], world, t);
        if (mesh->source->opacity.texels) components[of[t]].closed = false;
    }
}

softshadow_status ss_topology_build(ss_topology **out, const ss_world *world, ss_pool *pool) {
    *out = NULL;
    ss_topology *topology = ss_alloc(1, sizeof *topology);
    if (!topology) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for the edge table");
    softshadow_status status = weld_world(topology, world, pool);
    const ss_corners corners = {world->indices, topology->weld, world->triangle_count,
                                world->vertex_count};
    if (status == SOFTSHADOW_OK) status = ss_edges_build(topology, &corners, pool);
    if (status == SOFTSHADOW_OK) status = ss_components_build(topology);
    if (status == SOFTSHADOW_OK) status = ss_solids_build(topology, world);
    if (status != SOFTSHADOW_OK) {
        ss_topology_destroy(topology);
        return status;
    }
    measure_all(topology->triangle_component, topology->components, world);
    if (topology->solids) measure_all(topology->triangle_solid, topology->solids, world);
    *out = topology;
    return SOFTSHADOW_OK;
}

void ss_topology_destroy(ss_topology *topology) {
    if (!topology) return;
    ss_edges_free(topology);
    ss_free(topology);
}

size_t ss_topology_bytes(const ss_topology *topology) {
    return sizeof *topology + topology->vertex_count * sizeof *topology->weld +
           (topology->edge_count + 1) * sizeof *topology->edges +
           topology->use_count * sizeof *topology->uses +
           topology->triangle_count * 4 * sizeof *topology->triangle_edges +
           topology->component_count * sizeof *topology->components +
           (topology->solids ? topology->triangle_count * sizeof *topology->triangle_solid : 0) +
           topology->solid_count * sizeof *topology->solids;
}
