/* The coarser levels of one mesh, in coordinates within [0, 1]. */
#ifndef SS_TOPOLOGY_DECIMATE_H
#define SS_TOPOLOGY_DECIMATE_H

#include <stdbool.h>

#include "base/parallel.h"
#include "scene/levels.h"

/* Fills *out, which owns what it holds; none where the mesh is a soup. Vertices that no triangle
 * uses do not count. */
softshadow_status ss_decimate(ss_mesh_levels *out, const float *vertices, size_t vertex_count,
                              const uint32_t *indices, size_t triangle_count, ss_pool *pool,
                              ss_progress *progress);
/* Arrays of a level, zeroed; false if memory is out. */
bool ss_level_allocate(ss_level *level, size_t vertex_count, size_t triangle_count);
void ss_mesh_levels_free(ss_mesh_levels *levels);

#endif
