/* The connectivity of the world and of one mesh. */
#ifndef SS_TOPOLOGY_TOPOLOGY_H
#define SS_TOPOLOGY_TOPOLOGY_H

#include "base/parallel.h"
#include "scene/connectivity.h"
#include "scene/scene.h"

softshadow_status ss_topology_build(ss_topology **out, const ss_world *world, ss_pool *pool);
void ss_topology_destroy(ss_topology *topology);
size_t ss_topology_bytes(const ss_topology *topology);

/* What softshadow_mesh_info() answers, all of it but struct_size. Positions are the mesh's after
 * its transform, in double, welded where they are equal; light may be NULL. A vertex on an edge of
 * three triangles or more is non-manifold only if its triangles fall apart when each edge joins all
 * its triangles there. */
softshadow_status ss_topology_report(const ss_mesh *mesh, const softshadow_light *light,
                                     softshadow_mesh_report *out);

#endif
