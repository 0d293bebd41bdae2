/* Coarser levels of the world's meshes (scene/levels.h), and their cache on disk.
 *
 * If the environment variable SOFTSHADOW_CACHE names a directory, levels are kept there, one file
 * per mesh, named by a hash of its positions (before the transform) and indices: they survive moves
 * of the mesh, the light and everything else. Files may come and go at any time and are never
 * trusted. */
#ifndef SS_TOPOLOGY_LEVELS_H
#define SS_TOPOLOGY_LEVELS_H

#include "base/parallel.h"
#include "scene/levels.h"
#include "scene/scene.h"

/* Progress advances by ss_levels_work() in all. */
softshadow_status ss_levels_build(const ss_world *world, ss_pool *pool, ss_progress *progress,
                                  ss_levels **out);
void ss_levels_destroy(ss_levels *levels);
size_t ss_levels_bytes(const ss_levels *levels);
/* The triangles of all meshes that can have levels: what a build takes its time for. */
uint64_t ss_levels_work(const ss_world *world);

#endif
