/* What exact and auto work with beside the casters, made when enough points are known to come, then
 * lent to whatever is asked: a map that tells lit and dark points; for auto coarser scenes, and
 * rays where there are none. */
#include "base/status.h"
#include "coverage/sky.h"
#include "engine/engine.h"
#include "technique/raytrace.h"
#include "topology/levels.h"
#include "topology/topology.h"
#include "trace/lod.h"
#include "trace/rays.h"

/* Levels take some 3 us a triangle to make, and save the more the denser a mesh is: measured, .7 us
 * a point of 70,000 triangles and 12 us of 870,000. Either way they are repaid by a quarter of a
 * million points; where little is dense there is nothing to save. */
#define LEAST_POINTS    ((uint64_t)1 << 18)
#define LEAST_TRIANGLES 8192
/* Embree's tree takes .7 us a triangle, and rays save time on the densest meshes only: measured on
 * 871,000 triangles without levels, 128 x 128 points, three fifths of it. */
#define TRACED_TRIANGLES ((size_t)1 << 18)
#define TRACED_SHARE     32 /* triangles a point that repays the tree */

/* A sky takes some 4 ms and .6 us a triangle to make. Under the medium light it saves .14 us a
 * point of the bunny with coarser levels, .3 us of dragons and a million triangles: repaid by 4
 * points a triangle of the one, 1.3 to 3 of the others. Without levels it saves .5, 1.9 and 3.9 us,
 * repaid by one, or fewer. */
#define SKY_POINTS       ((uint64_t)1 << 18)
#define SKY_SHARE        1 /* points that repay a triangle, ... */
#define SKY_SHARE_LEVELS 4 /* ... where coarser levels make them cheap */

void ss_engine_drop_skies(ss_built *built) {
    for (uint32_t i = 0; i < built->light_count && built->skies; i++)
        ss_sky_destroy(built->skies[i]);
    ss_free(built->skies);
    ss_free(built->skies_tried);
    built->skies = NULL, built->skies_tried = NULL;
}

void ss_engine_drop_lod_lights(ss_built *built) {
    for (uint32_t i = 0; i < built->lod_light_count; i++)
        ss_lod_light_destroy(built->lod_lights[i]);
    ss_free(built->lod_lights);
    built->lod_lights = NULL, built->lod_light_count = 0;
}

void ss_engine_drop_lod(ss_built *built) {
    ss_engine_drop_lod_lights(built);
    ss_lod_destroy(built->lod);
    for (uint32_t k = 0; k < SS_LEVELS_MOST; k++) {
        ss_topology_destroy(built->lod_topology[k]);
        built->lod_topology[k] = NULL;
    }
    built->lod = NULL, built->lod_triangles = 0;
}

size_t ss_engine_lod_bytes(const ss_built *built) {
    size_t bytes = built->lod ? ss_lod_bytes(built->lod) : 0;
    for (uint32_t k = 0; k < SS_LEVELS_MOST; k++) {
        if (built->lod_topology[k]) bytes += ss_topology_bytes(built->lod_topology[k]);
    }
    for (uint32_t i = 0; i < built->lod_light_count; i++) {
        if (built->lod_lights[i]) bytes += ss_lod_light_bytes(built->lod_lights[i]);
    }
    return bytes;
}

void ss_engine_drop_tracers(ss_built *built) {
    for (uint32_t i = 0; i < built->light_count && built->tracers; i++) {
        if (built->tracers[i]) ss_raytrace.destroy(built->tracers[i]);
    }
    ss_free(built->tracers);
    built->tracers = NULL;
}

static softshadow_status make_levels(softshadow *handle, ss_progress *progress) {
    ss_built *built = &handle->built;
    ss_levels *levels;
    ss_progress_expect(progress, built->world->triangle_count);
    softshadow_status status = ss_levels_build(built->world, handle->pool, progress, &levels);
    if (status) return status;
    status = ss_lod_create(&built->lod, built->world, levels, handle->pool);
    ss_levels_destroy(levels);
    for (uint32_t k = 0; !status && k < built->lod->count; k++) {
        status =
            ss_topology_build(&built->lod_topology[k], built->lod->level[k].world, handle->pool);
    }
    if (status) {
        ss_engine_drop_lod(built);
        return status;
    }
    built->lod_triangles = ss_lod_triangles(built->lod);
    return SOFTSHADOW_OK;
}

static softshadow_status make_light(softshadow *handle, uint32_t light) {
    ss_built *built = &handle->built;
    if (!built->lod_lights) {
        built->lod_lights = ss_alloc(built->light_count, sizeof(struct ss_lod_light *));
        if (!built->lod_lights) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory");
        built->lod_light_count = built->light_count;
    }
    if (built->lod_lights[light]) return SOFTSHADOW_OK;
    return ss_lod_light_create(&built->lod_lights[light], built->lod, built->lod_topology,
                               &built->lights[light], handle->pool);
}

static void add_bytes(ss_built *built, size_t bytes) {
    built->bytes += bytes;
    if (built->bytes > built->peak_bytes) built->peak_bytes = built->bytes;
}

static softshadow_status make(softshadow *handle, uint32_t light, ss_progress *progress) {
    ss_built *built = &handle->built;
    const size_t before = ss_engine_lod_bytes(built);
    softshadow_status status = built->lod ? SOFTSHADOW_OK : make_levels(handle, progress);
    if (!status && built->lod->count) status = make_light(handle, light);
    add_bytes(built, ss_engine_lod_bytes(built) - before);
    return status;
}

/* Where Embree is not installed or may not be used auto has to do without. */
static softshadow_status make_rays(softshadow *handle) {
    ss_built *built = &handle->built;
    const softshadow_status status = ss_rays_create(&built->rays, built->world, handle->pool);
    built->no_rays = status == SOFTSHADOW_E_UNSUPPORTED || status == SOFTSHADOW_E_BACKEND;
    if (!status) add_bytes(built, ss_rays_bytes(built->rays));
    if (!built->no_rays) return status;
    ss_message_clear();
    return SOFTSHADOW_OK;
}

static softshadow_status make_tracer(softshadow *handle, uint32_t light, ss_stage *stage) {
    ss_built *built = &handle->built;
    softshadow_status status = SOFTSHADOW_OK;
    if (!built->rays && !built->no_rays) status = make_rays(handle);
    if (status || built->no_rays) return status;
    if (!built->tracers) built->tracers = ss_alloc(built->light_count, sizeof *built->tracers);
    if (!built->tracers) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory");
    if (!built->tracers[light]) {
        status = ss_raytrace_prepare_auto(&built->stages[light], &built->tracers[light]);
        if (status) return status;
        add_bytes(built, ss_raytrace.bytes(built->tracers[light]));
    }
    stage->rays = built->rays, stage->tracer = built->tracers[light];
    return SOFTSHADOW_OK;
}

/* Holes of a texture are looked up triangle by triangle, and a coarser mesh has other triangles. */
static bool levels_are_repaid(const ss_built *built, uint64_t points) {
    if (!(built->plan.needs & SS_NEEDS_LOD) || built->world->any_opacity) return false;
    return points >= LEAST_POINTS && ss_levels_work(built->world) >= LEAST_TRIANGLES;
}

static bool rays_are_repaid(const ss_built *built, uint64_t points) {
    const size_t triangles = built->world->triangle_count;
    if (!(built->plan.needs & SS_NEEDS_LOD) || triangles < TRACED_TRIANGLES) return false;
    return points >= triangles / TRACED_SHARE;
}

/* A light that emits nothing is no business of it: what it gives is not "lit". */
static bool sky_is_repaid(const ss_built *built, uint32_t light, uint64_t points) {
    if (!(built->plan.needs & SS_NEEDS_SKY)) return false;
    if (built->plan.params.weighting != SOFTSHADOW_UNIFORM) return false;
    if (!(built->lights[light].profile_mean > 0)) return false;
    float most;
    const ss_technique *technique = built->plan.technique;
    if (technique->plates && technique->plates(built->states[light], &most)) return false;
    const uint64_t share = levels_are_repaid(built, points) ? SKY_SHARE_LEVELS : SKY_SHARE;
    return points >= SKY_POINTS && points / share >= built->world->triangle_count;
}

static softshadow_status make_sky(ss_built *built, uint32_t light) {
    if (!built->skies) {
        built->skies = ss_alloc(built->light_count, sizeof(struct ss_sky *));
        built->skies_tried = ss_alloc(built->light_count, sizeof *built->skies_tried);
        if (!built->skies || !built->skies_tried)
            return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory");
    }
    if (built->skies_tried[light]) return SOFTSHADOW_OK;
    const softshadow_status status =
        ss_sky_create(&built->skies[light], built->bvh, built->topology, &built->lights[light]);
    built->skies_tried[light] = !status;
    if (built->skies[light]) add_bytes(built, ss_sky_bytes(built->skies[light]));
    return status;
}

static softshadow_status lend(softshadow *handle, uint32_t light, uint64_t points,
                              ss_progress *progress, ss_stage *stage) {
    ss_built *built = &handle->built;
    if (sky_is_repaid(built, light, points)) {
        const softshadow_status status = make_sky(built, light);
        if (status) return status;
        stage->sky = built->skies[light];
    }
    if (levels_are_repaid(built, points)) {
        const softshadow_status status = make(handle, light, progress);
        if (status) return status;
        if (built->lod_lights) stage->lod = built->lod_lights[light];
    }
    if (stage->lod || !rays_are_repaid(built, points)) return SOFTSHADOW_OK;
    return make_tracer(handle, light, stage);
}

softshadow_status ss_engine_lend(softshadow *handle, uint32_t light, size_t count,
                                 ss_progress *progress, ss_stage *stage) {
    const ss_built *built = &handle->built;
    const uint64_t ahead = built->plan.params.points_ahead, points = count > ahead ? count : ahead;
    stage->lod = NULL, stage->tracer = NULL, stage->sky = NULL;
    if (!levels_are_repaid(built, points) && !rays_are_repaid(built, points) &&
        !sky_is_repaid(built, light, points)) {
        return SOFTSHADOW_OK;
    }
    pthread_mutex_lock(&handle->lod_lock);
    /* While a host's scheduler waits for a loop it may run other work of the host's on this thread,
     * which would wait for this lock. */
    const bool before = ss_parallel_alone(true);
    if (!handle->options.parallel) ss_parallel_alone(before);
    const softshadow_status status = lend(handle, light, points, progress, stage);
    ss_parallel_alone(before);
    pthread_mutex_unlock(&handle->lod_lock);
    return status;
}
