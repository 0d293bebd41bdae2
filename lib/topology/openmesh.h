/* OpenMesh behind a C header: nothing of it is seen outside openmesh.cc, nothing is thrown or
 * printed. */
#ifndef SS_TOPOLOGY_OPENMESH_H
#define SS_TOPOLOGY_OPENMESH_H

#include <stddef.h>
#include <stdint.h>

#include "softshadow.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What half-edges say about triangles (three welded corners each, degenerate ones left out). */
typedef struct ss_halfedges {
    uint64_t refused; /* triangles where an edge or a vertex is too complex: not counted below */
    uint64_t edges, boundary_edges;
    uint64_t nonmanifold_vertices; /* more than one fan */
    uint64_t components;
} ss_halfedges;

softshadow_status ss_openmesh_count(ss_halfedges *out, const uint32_t *corners,
                                    size_t triangle_count, size_t vertex_count);

#ifdef __cplusplus
}
#endif
#endif
