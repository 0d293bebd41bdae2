/* Builds what the plan asks for, keeps what is still true. */
#include <string.h>

#include "base/clock.h"
#include "base/cpu.h"
#include "base/memory.h"
#include "base/status.h"
#include "engine/engine.h"
#include "silhouette/silhouette.h"
#include "topology/topology.h"
#include "trace/bvh.h"
#include "trace/rays.h"

static void free_states(ss_built *built) {
    for (uint32_t i = 0; i < built->light_count && built->states; i++) {
        if (built->states[i] && built->plan.technique->destroy) {
            built->plan.technique->destroy(built->states[i]);
        }
    }
    for (uint32_t i = 0; i < built->light_count && built->programs; i++) {
        built->plan.raster->unload(built->programs[i]);
    }
    ss_engine_drop_tracers(built);
    ss_engine_drop_skies(built);
    ss_free(built->programs);
    ss_free(built->states);
    ss_free(built->stages);
    ss_free(built->lights);
    built->states = NULL, built->stages = NULL, built->lights = NULL, built->light_count = 0;
    built->programs = NULL;
}

static void free_geometry(ss_built *built) {
    ss_engine_drop_lod(built);
    ss_rays_destroy(built->rays);
    ss_bvh_destroy(built->bvh);
    ss_silhouette_tree_destroy(built->silhouettes);
    ss_topology_destroy(built->topology);
    ss_world_destroy(built->world);
    built->rays = NULL, built->bvh = NULL, built->world = NULL, built->no_rays = false;
    built->silhouettes = NULL, built->topology = NULL;
}

void ss_built_free(ss_built *built) {
    free_states(built);
    free_geometry(built);
    *built = (ss_built){.peak_bytes = built->peak_bytes};
}

#define NEEDS_TOPOLOGY (SS_NEEDS_EDGES | SS_NEEDS_COMPONENTS | SS_NEEDS_SILHOUETTES)

static softshadow_status build_connectivity(softshadow *handle, uint32_t needs) {
    ss_built *built = &handle->built;
    softshadow_status status = SOFTSHADOW_OK;
    if ((needs & NEEDS_TOPOLOGY) && !built->topology) {
        status = ss_topology_build(&built->topology, built->world, handle->pool);
    }
    if (!status && (needs & SS_NEEDS_SILHOUETTES) && !built->silhouettes) {
        status = ss_silhouette_tree_build(&built->silhouettes, built->world, built->topology,
                                          handle->pool);
    }
    return status;
}

/* What depends on the meshes only: kept while they stay as they were. */
static softshadow_status build_geometry(softshadow *handle, uint32_t needs,
                                        ss_progress *progress) {
    ss_built *built = &handle->built;
    softshadow_status status = SOFTSHADOW_OK;
    if (built->world && built->geometry_version != handle->scene.geometry_version) {
        free_geometry(built);
    }
    if (!built->world) status = ss_world_create(&built->world, &handle->scene);
    built->geometry_version = handle->scene.geometry_version;
    if (!status && (needs & SS_NEEDS_BVH) && !built->bvh) {
        status = ss_bvh_build(&built->bvh, built->world, handle->pool, progress);
    }
    if (!status && (needs & SS_NEEDS_RAYS) && !built->rays) {
        status = ss_rays_create(&built->rays, built->world, handle->pool);
    }
    return status ? status : build_connectivity(handle, needs);
}

static void localize_bounds(const ss_world *world, ss_params *params) {
    double low[3], high[3];
    if (!params->bounded) return;
    ss_world_local(world, params->bounds, low);
    ss_world_local(world, params->bounds + 3, high);
    memcpy(params->bounds, low, sizeof low);
    memcpy(params->bounds + 3, high, sizeof high);
}

/* Builds for light i, and takes its query to the GPU. */
static softshadow_status build_light(ss_built *built, uint32_t i) {
    const ss_technique *technique = built->plan.technique;
    ss_raster_question question = {0};
    softshadow_status status = SOFTSHADOW_OK;
    if (technique->build) status = technique->build(&built->stages[i], &built->states[i]);
    if (status || !built->programs) return status;
    status = technique->tables(built->states[i], &question);
    if (status || !question.glsl) return status;
    return built->plan.raster->load(&question, &built->programs[i]);
}

static softshadow_status build_lights(softshadow *handle, ss_progress *progress) {
    ss_built *built = &handle->built;
    const uint32_t n = handle->scene.light_count;
    const bool ask_in_c = !built->plan.raster->load;
    if (built->light_version != handle->scene.light_version) ss_engine_drop_lod_lights(built);
    built->light_version = handle->scene.light_version;
    built->lights = ss_alloc(n, sizeof *built->lights);
    built->stages = ss_alloc(n, sizeof *built->stages);
    built->states = ss_alloc(n, sizeof *built->states);
    built->programs = ask_in_c ? NULL : ss_alloc(n, sizeof *built->programs);
    if (!built->lights || !built->stages || !built->states || (!ask_in_c && !built->programs)) {
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %u lights", n);
    }
    built->light_count = n;
    for (uint32_t i = 0; i < n; i++) {
        ss_world_light(built->world, &handle->scene.lights[i], &built->lights[i]);
        built->stages[i] = (ss_stage){.world = built->world,
                                      .light = &built->lights[i],
                                      .light_id = i,
                                      .params = &built->plan.params,
                                      .pool = handle->pool,
                                      .rung = (int)ss_cpu_rung(),
                                      .progress = progress,
                                      .spent = &handle->totals.build_spent,
                                      .bvh = built->bvh,
                                      .rays = built->rays,
                                      .topology = built->topology,
                                      .silhouettes = built->silhouettes,
                                      .raster = built->plan.raster};
        const softshadow_status status = build_light(built, i);
        if (status) return status;
    }
    return SOFTSHADOW_OK;
}

static void count_bytes(ss_built *built) {
    const ss_world *world = built->world;
    size_t bytes = world->vertex_count * 12 + world->triangle_count * 12;
    bytes += ss_engine_lod_bytes(built);
    if (built->bvh) bytes += ss_bvh_bytes(built->bvh);
    if (built->rays) bytes += ss_rays_bytes(built->rays);
    if (built->topology) bytes += ss_topology_bytes(built->topology);
    if (built->silhouettes) bytes += ss_silhouette_tree_bytes(built->silhouettes);
    for (uint32_t i = 0; i < built->light_count && built->plan.technique->bytes; i++) {
        if (built->states[i]) bytes += built->plan.technique->bytes(built->states[i]);
    }
    built->bytes = bytes;
    if (bytes > built->peak_bytes) built->peak_bytes = bytes;
}

static bool same_plan(const ss_plan *a, const ss_plan *b) {
    return a->technique == b->technique && a->needs == b->needs && a->raster == b->raster &&
           memcmp(&a->params, &b->params, sizeof a->params) == 0;
}

static softshadow_status build(softshadow *handle, const ss_plan *plan, ss_progress *progress) {
    ss_built *built = &handle->built;
    softshadow_status status = ss_progress_add(progress, 0);
    if (!status) status = build_geometry(handle, plan->needs, progress);
    if (status) return status;
    if (!(plan->needs & SS_NEEDS_LOD)) ss_engine_drop_lod(built);
    built->plan = *plan;
    localize_bounds(built->world, &built->plan.params);
    status = build_lights(handle, progress);
    for (uint32_t i = 0; i < built->light_count; i++) built->stages[i].progress = NULL;
    if (!status) count_bytes(built);
    for (uint32_t i = 0; i < built->light_count && !status; i++) {
        ss_stage unused = built->stages[i];
        status = ss_engine_lend(handle, i, 0, progress, &unused);
    }
    return status ? status : ss_progress_add(progress, 1);
}

/* What a request that says ANY does when the GPU fails under it. */
static softshadow_status build_somewhere(softshadow *handle, ss_plan *plan, ss_progress *progress) {
    softshadow_status status = build(handle, plan, progress);
    if (status != SOFTSHADOW_E_BACKEND || !plan->any || plan->raster == &ss_raster_cpu)
        return status;
    ss_plan_spare(plan);
    free_states(&handle->built);
    return build(handle, plan, progress);
}

softshadow_status ss_engine_build(softshadow *handle, const softshadow_build *request) {
    const double start = ss_clock();
    ss_built *built = &handle->built;
    ss_plan plan;
    softshadow_status status = ss_plan_make(&plan, request, &handle->scene);
    if (status) {
        ss_built_free(built);
        return status;
    }
    handle->totals = (ss_totals){0};
    const bool fresh = built->ready && same_plan(&handle->requested, &plan) &&
                       built->geometry_version == handle->scene.geometry_version &&
                       built->light_version == handle->scene.light_version;
    if (fresh) {
        built->plan.any = plan.any; /* how it is to be asked, not what it is */
        return SOFTSHADOW_OK;
    }
    free_states(built);
    built->ready = false;
    ss_progress *progress = NULL;
    if (handle->options.progress) {
        progress = ss_progress_create(&handle->options, 1);
        if (!progress) status = ss_fail(SOFTSHADOW_E_MEMORY, "out of memory");
    }
    const ss_plan asked = plan; /* the GPU may have to be spared */
    if (!status) status = build_somewhere(handle, &plan, progress);
    ss_progress_destroy(progress);
    if (status) {
        ss_built_free(built);
        return status;
    }
    built->ready = true;
    handle->requested = asked;
    handle->totals.build_seconds = ss_clock() - start;
    if (plan.raster->spent) handle->totals.build_copies = plan.raster->spent();
    if (*plan.why) ss_engine_tell(handle, plan.why);
    return SOFTSHADOW_OK;
}
