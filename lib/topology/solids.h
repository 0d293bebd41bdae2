/* The closed surfaces that components are made of. */
#ifndef SS_TOPOLOGY_SOLIDS_H
#define SS_TOPOLOGY_SOLIDS_H

#include "scene/connectivity.h"
#include "scene/scene.h"

/* Fills triangle_solid, solids (all but closed's view of textures, volumes and bounds) and their
 * count, where an edge has more than two uses; else there are none, and components will do. */
softshadow_status ss_solids_build(ss_topology *out, const ss_world *world);

#endif
