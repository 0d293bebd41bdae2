/* What topology found out about the world, as plain tables that techniques may read.
 *
 * WELDED: vertices of one mesh whose float local coordinates are equal count as one (-0 equals 0).
 * The float coordinates, because they are what the engines see: two edges then cancel exactly where
 * they cover the same pixels and samples. Whatever is closed in the host's doubles stays closed
 * when corners fall together by rounding, so nothing is lost by it. Vertices of two meshes are
 * never welded.
 *
 * A triangle that has two welded corners contributes nothing: no edge, no component. */
#ifndef SS_SCENE_CONNECTIVITY_H
#define SS_SCENE_CONNECTIVITY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define SS_NO_EDGE      UINT32_MAX
#define SS_NO_COMPONENT UINT32_MAX

/* An undirected edge, whatever the number of triangles that share it. */
typedef struct ss_edge {
    uint32_t vertex[2]; /* welded world vertices, vertex[0] < vertex[1] */
    uint32_t first_use; /* its uses are uses[edge.first_use .. next edge's first_use) */
} ss_edge;

/* A use is triangle << 1 | against: against is 1 where the triangle runs from vertex[1] to
 * vertex[0]. */
static inline uint32_t ss_use_triangle(uint32_t use) { return use >> 1; }
static inline int ss_use_sign(uint32_t use) { return use & 1 ? -1 : 1; }

typedef struct ss_component {
    uint32_t first_triangle; /* the lowest one */
    uint32_t triangle_count;
    /* Every edge is used equally often in both directions, and no opacity texture makes holes. A
     * ray whose ends are both outside crosses as many faces from the front as from the back. */
    bool closed;
    /* Signed, in local units; where closed: > 0 the fronts look outwards, < 0 inwards. */
    double volume;
    float low[3], high[3];
} ss_component;

typedef struct ss_topology {
    size_t vertex_count, triangle_count; /* of the world */
    size_t edge_count, use_count;
    uint32_t *weld; /* per world vertex: the lowest-numbered one in the same place */
    ss_edge *edges; /* by (vertex[0], vertex[1]); edge_count + 1: the last only ends the uses */
    uint32_t *uses; /* by triangle within an edge */
    uint32_t *triangle_edges;     /* triangle_count x 3: from corner k to k + 1; SS_NO_EDGE */
    uint32_t *triangle_component; /* SS_NO_COMPONENT for degenerate ones */
    ss_component *components;     /* triangles connected by edges, in order of first_triangle */
    uint32_t component_count;
    /* Components taken apart where more than two triangles share an edge: at each edge of one that
     * is closed its triangles bound wedges, in pairs that run either way. NULL where none do. */
    uint32_t *triangle_solid;
    ss_component *solids;
    uint32_t solid_count;
} ss_topology;

static inline uint32_t ss_edge_uses(const ss_edge *edge) {
    return edge[1].first_use - edge[0].first_use;
}

#endif
