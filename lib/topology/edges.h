/* The edge table of welded triangles. */
#ifndef SS_TOPOLOGY_EDGES_H
#define SS_TOPOLOGY_EDGES_H

#include "base/parallel.h"
#include "scene/connectivity.h"

/* Triangles as the tables read them: corner k of triangle t is weld[indices[3 t + k]]. */
typedef struct ss_corners {
    const uint32_t *indices, *weld;
    size_t triangle_count, vertex_count;
} ss_corners;

static inline void ss_corners_of(const ss_corners *corners, size_t t, uint32_t out[3]) {
    for (int k = 0; k < 3; k++) out[k] = corners->weld[corners->indices[3 * t + (size_t)k]];
}
static inline bool ss_corners_degenerate(const uint32_t c[3]) {
    return c[0] == c[1] || c[1] == c[2] || c[2] == c[0];
}

/* Fills edges, uses, triangle_edges and their counts of *out, which owns them; pool may be NULL. */
softshadow_status ss_edges_build(ss_topology *out, const ss_corners *corners, ss_pool *pool);
/* Fills triangle_component, components (all but closed's view of textures and the bounds) and their
 * count from the edges. */
softshadow_status ss_components_build(ss_topology *out);
/* Frees what a topology holds, not the struct. */
void ss_edges_free(ss_topology *topology);

#endif
