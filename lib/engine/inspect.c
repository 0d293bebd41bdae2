/* What a mesh is made of. */
#include "base/status.h"
#include "engine/engine.h"
#include "topology/topology.h"

softshadow_status ss_engine_inspect(softshadow *handle, uint32_t mesh_id,
                                    softshadow_mesh_report *report) {
    const ss_scene *scene = &handle->scene;
    if (mesh_id >= scene->mesh_count || !scene->meshes[mesh_id].used) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT,
                       "mesh_id: %u, is not a mesh of this scene (%u were added)", mesh_id,
                       scene->mesh_count);
    }
    return ss_topology_report(&scene->meshes[mesh_id], scene->light_count ? scene->lights : NULL,
                              report);
}
