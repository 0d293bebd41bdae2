/* The public functions: check everything once, delegate. */
#include <stdlib.h>
#include <string.h>

#include "api/structs.h"
#include "base/fpu.h"
#include "base/memory.h"
#include "base/process.h"
#include "base/status.h"
#include "base/vec.h"
#include "engine/engine.h"

/* What 1.0 had of each struct, whatever was added since: up to this member, padding included. */
#define UP_TO(type, last)                                                                          \
    type##_1_0 = (offsetof(type, last) + sizeof(((type *)NULL)->last) + _Alignof(type) - 1) /      \
                 _Alignof(type) * _Alignof(type)
enum {
    UP_TO(softshadow_options, parallel),
    UP_TO(softshadow_mesh, opacity_threshold),
    UP_TO(softshadow_light, profile_count),
    UP_TO(softshadow_build, points_ahead),
    UP_TO(softshadow_points, error_bound),
    UP_TO(softshadow_error, points),
    UP_TO(softshadow_stats, download_seconds),
    UP_TO(softshadow_map, face),
    UP_TO(softshadow_method, backends),
    UP_TO(softshadow_backend, why),
    UP_TO(softshadow_mesh_report, bounds),
    UP_TO(softshadow_explanation, v)
};
#define SIZE_1_0(type) type##_1_0
#define TEXT_(x) #x
#define TEXT(x) TEXT_(x)

/* ---- entering and leaving ------------------------------------------------------------------- */

/* One public call: the host's floating-point mode is put aside, the handle is marked as used. */
typedef struct call {
    ss_fpu fpu;
    softshadow *handle;
    bool changes;
} call;

static _Thread_local const softshadow *message_owner;

static softshadow_status mark(softshadow *handle, bool changes) {
    int users = atomic_load(&handle->users);
    do {
        if (users < 0 || (changes && users > 0)) {
            return ss_fail(SOFTSHADOW_E_STATE,
                           users < 0 ? "another call is changing this handle"
                                     : "a query is using this handle: change it later");
        }
    } while (!atomic_compare_exchange_weak(&handle->users, &users, changes ? -1 : users + 1));
    return SOFTSHADOW_OK;
}

static softshadow_status enter(call *c, softshadow *handle, bool changes) {
    ss_fpu_enter(&c->fpu);
    ss_message_clear();
    message_owner = handle;
    c->handle = NULL, c->changes = changes;
    if (!handle) return ss_fail(SOFTSHADOW_E_ARGUMENT, "handle: NULL");
    if (handle->fork_generation != ss_process_generation()) {
        return ss_fail(SOFTSHADOW_E_STATE,
                       "this handle was made before fork(): make one in the child");
    }
    const softshadow_status status = mark(handle, changes);
    if (!status) c->handle = handle;
    return status;
}

static softshadow_status leave(call *c, softshadow_status status) {
    if (c->handle) {
        if (c->changes) atomic_store(&c->handle->users, 0);
        else atomic_fetch_sub(&c->handle->users, 1);
        if (status && c->handle->options.log) {
            c->handle->options.log(c->handle->options.user, 0, ss_message());
        }
    }
    ss_fpu_leave(&c->fpu);
    return status;
}

/* ---- the library itself --------------------------------------------------------------------- */

uint32_t softshadow_version(void) { return SOFTSHADOW_VERSION; }

const char *softshadow_version_string(void) {
    return TEXT(SOFTSHADOW_VERSION_MAJOR) "." TEXT(SOFTSHADOW_VERSION_MINOR) "." TEXT(
        SOFTSHADOW_VERSION_PATCH);
}

const char *softshadow_status_name(softshadow_status status) {
    static const char *const name[] = {
        "SOFTSHADOW_OK",        "SOFTSHADOW_E_ARGUMENT",    "SOFTSHADOW_E_STATE",
        "SOFTSHADOW_E_MESH",    "SOFTSHADOW_E_LIGHT",       "SOFTSHADOW_E_MEMORY",
        "SOFTSHADOW_E_UNSUPPORTED", "SOFTSHADOW_E_CANCELLED", "SOFTSHADOW_E_BACKEND",
        "SOFTSHADOW_E_INTERNAL"};
    if (status > 0 || status < SOFTSHADOW_E_INTERNAL) return "unknown status";
    return name[-status];
}

const char *softshadow_last_message(const softshadow *handle) {
    return handle == message_owner ? ss_message() : "";
}

/* ---- a handle ------------------------------------------------------------------------------- */

static softshadow_status make(softshadow **out, const softshadow_options *given) {
    softshadow *handle = ss_alloc(1, sizeof *handle);
    if (!handle) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for a handle");
    softshadow_status status = SOFTSHADOW_OK;
    if (given) {
        status = ss_struct_in("options", given, &handle->options, sizeof handle->options,
                              SIZE_1_0(softshadow_options));
    }
    if (!status) status = ss_pool_create(&handle->pool, &handle->options);
    if (status) {
        ss_free(handle);
        return status;
    }
    handle->fork_generation = ss_process_generation();
    pthread_mutex_init(&handle->totals_lock, NULL);
    pthread_mutex_init(&handle->scratch_lock, NULL);
    pthread_mutex_init(&handle->lod_lock, NULL);
    *out = handle;
    return SOFTSHADOW_OK;
}

softshadow_status softshadow_create(softshadow **out, const softshadow_options *options) {
    ss_fpu fpu;
    ss_fpu_enter(&fpu);
    ss_message_clear();
    message_owner = NULL;
    ss_process_watch();
    softshadow_status status;
    if (out) {
        *out = NULL;
        status = make(out, options);
    } else {
        status = ss_fail(SOFTSHADOW_E_ARGUMENT, "out: NULL, must point to a handle");
    }
    ss_fpu_leave(&fpu);
    return status;
}

void softshadow_destroy(softshadow *handle) {
    if (!handle) return;
    if (message_owner == handle) message_owner = NULL, ss_message_clear();
    /* In a child its threads do not exist and its locks may be held for ever: leave it be. */
    if (handle->fork_generation != ss_process_generation()) return;
    ss_fpu fpu;
    ss_fpu_enter(&fpu);
    ss_built_free(&handle->built);
    ss_scratch_free(handle);
    ss_scene_free(&handle->scene);
    ss_pool_destroy(handle->pool);
    pthread_mutex_destroy(&handle->totals_lock);
    pthread_mutex_destroy(&handle->scratch_lock);
    pthread_mutex_destroy(&handle->lod_lock);
    ss_free(handle);
    ss_fpu_leave(&fpu);
}

/* ---- the scene ------------------------------------------------------------------------------ */

softshadow_status softshadow_add_mesh(softshadow *handle, const softshadow_mesh *given,
                                      uint32_t *mesh_id) {
    call c;
    softshadow_mesh mesh;
    uint32_t id;
    if (mesh_id) *mesh_id = UINT32_MAX;
    softshadow_status status = enter(&c, handle, true);
    if (!status) {
        status = ss_struct_in("mesh", given, &mesh, sizeof mesh, SIZE_1_0(softshadow_mesh));
    }
    if (!status) status = ss_scene_add_mesh(&handle->scene, &mesh, &id);
    if (!status && mesh_id) *mesh_id = id;
    return leave(&c, status);
}

softshadow_status softshadow_update_mesh(softshadow *handle, uint32_t mesh_id,
                                         const softshadow_mesh *given) {
    call c;
    softshadow_mesh mesh;
    softshadow_status status = enter(&c, handle, true);
    if (!status) {
        status = ss_struct_in("mesh", given, &mesh, sizeof mesh, SIZE_1_0(softshadow_mesh));
    }
    if (!status) status = ss_scene_update_mesh(&handle->scene, mesh_id, &mesh);
    return leave(&c, status);
}

softshadow_status softshadow_remove_mesh(softshadow *handle, uint32_t mesh_id) {
    call c;
    softshadow_status status = enter(&c, handle, true);
    if (!status) status = ss_scene_remove_mesh(&handle->scene, mesh_id);
    return leave(&c, status);
}

static softshadow_status put_light(softshadow *handle, const softshadow_light *given, bool only,
                                   uint32_t *light_id) {
    call c;
    softshadow_light light;
    uint32_t id;
    if (light_id) *light_id = UINT32_MAX;
    softshadow_status status = enter(&c, handle, true);
    if (!status) {
        status = ss_struct_in("light", given, &light, sizeof light, SIZE_1_0(softshadow_light));
    }
    if (!status) status = ss_scene_add_light(&handle->scene, &light, only, &id);
    if (!status && light_id) *light_id = id;
    return leave(&c, status);
}

softshadow_status softshadow_set_light(softshadow *handle, const softshadow_light *light) {
    return put_light(handle, light, true, NULL);
}

softshadow_status softshadow_add_light(softshadow *handle, const softshadow_light *light,
                                       uint32_t *light_id) {
    return put_light(handle, light, false, light_id);
}

/* ---- build and ask -------------------------------------------------------------------------- */

softshadow_status softshadow_build_maps(softshadow *handle, const softshadow_build *given) {
    call c;
    softshadow_build request = SOFTSHADOW_BUILD_INIT;
    softshadow_status status = enter(&c, handle, true);
    if (!status && given) {
        status = ss_struct_in("build", given, &request, sizeof request, SIZE_1_0(softshadow_build));
    }
    if (!status) status = ss_engine_build(handle, &request);
    return leave(&c, status);
}

static softshadow_status check_ready(const softshadow *handle) {
    const ss_built *built = &handle->built;
    if (!built->ready) {
        return ss_fail(SOFTSHADOW_E_STATE, "nothing is built: call softshadow_build_maps() first");
    }
    if (built->geometry_version != handle->scene.geometry_version ||
        built->light_version != handle->scene.light_version) {
        return ss_fail(
            SOFTSHADOW_E_STATE,
            "the scene changed since the last build: call softshadow_build_maps() again");
    }
    return SOFTSHADOW_OK;
}

static softshadow_status check_array(const char *name, const void *array, size_t count, size_t size,
                                     size_t *stride) {
    if (*stride == 0) *stride = size;
    size_t bytes;
    if (*stride < size) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT, "points.%s: stride %zu, must be 0 or at least %zu",
                       name, *stride, size);
    }
    if (!ss_multiply(count, *stride, &bytes) || bytes > PTRDIFF_MAX) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT,
                       "points.%s: %zu items of stride %zu do not fit in memory", name, count,
                       *stride);
    }
    if (count && !array) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT, "points.%s: NULL, but count is %zu", name, count);
    }
    return SOFTSHADOW_OK;
}

static softshadow_status check_points(const softshadow *handle, softshadow_points *points) {
    if (points->position_type > SOFTSHADOW_F64) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT,
                       "points.position_type: %u, must be SOFTSHADOW_F32 or SOFTSHADOW_F64",
                       points->position_type);
    }
    const size_t size = points->position_type == SOFTSHADOW_F64 ? 24 : 12;
    softshadow_status status = check_array("positions", points->positions, points->count, size,
                                           &points->position_stride);
    if (!status && points->normals) {
        status = check_array("normals", points->normals, points->count, 12, &points->normal_stride);
    }
    if (status) return status;
    if (points->count > PTRDIFF_MAX / sizeof(uint64_t)) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT, "points.count: %zu do not fit in memory",
                       points->count);
    }
    if (points->width && points->count % points->width) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT, "points.count: %zu, must be a multiple of width %u",
                       points->count, points->width);
    }
    if (points->light >= handle->built.light_count) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT, "points.light: %u, must be below %u", points->light,
                       handle->built.light_count);
    }
    if (handle->built.plan.params.weighting == SOFTSHADOW_IRRADIANCE && points->count &&
        !points->normals) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT,
                       "points.normals: NULL, SOFTSHADOW_IRRADIANCE needs them");
    }
    return SOFTSHADOW_OK;
}

static void fill_nan(float *out, size_t count) {
    for (size_t i = 0; out && i < count; i++) out[i] = NAN;
}

/* More than any machine holds: such a count is a mistake, and there is no array to fill. */
#define NO_ARRAY ((uint64_t)1 << 44)

/* What a failed query leaves: nothing that could be taken for an answer. */
static void forget(const softshadow_points *points, float *visibility) {
    if (points->count >= NO_ARRAY) return;
    fill_nan(visibility, points->count);
    fill_nan(points->error_bound, points->count);
}

softshadow_status softshadow_query_visibility(softshadow *handle, const softshadow_points *given,
                                              float *visibility) {
    call c;
    softshadow_points points = {0};
    softshadow_status status = enter(&c, handle, false);
    const softshadow_status shape =
        ss_struct_in("points", given, &points, sizeof points, SIZE_1_0(softshadow_points));
    if (!status) status = shape;
    if (!status) status = check_ready(handle);
    if (!status) status = check_points(handle, &points);
    if (!status && points.count && !visibility) {
        status = ss_fail(SOFTSHADOW_E_ARGUMENT, "visibility: NULL, but points.count is %zu",
                         points.count);
    }
    if (!status) status = ss_engine_query(handle, &points, visibility);
    if (status && !shape) forget(&points, visibility);
    return leave(&c, status);
}

static void forget_error(softshadow_error *given) {
    if (!ss_struct_takes(given, SIZE_1_0(softshadow_error))) return;
    given->rms = given->max = given->p99 = given->mean = given->reference_error = NAN;
    given->points = 0;
}

softshadow_status softshadow_measure_error(softshadow *handle, const softshadow_points *given,
                                           softshadow_error *given_error) {
    call c;
    softshadow_points points;
    softshadow_error error;
    softshadow_status status = enter(&c, handle, false);
    if (!status) {
        status = ss_struct_in("points", given, &points, sizeof points, SIZE_1_0(softshadow_points));
    }
    if (!status) {
        status = ss_struct_in("error", given_error, &error, sizeof error,
                              SIZE_1_0(softshadow_error));
    }
    if (!status) status = check_ready(handle);
    if (!status) status = check_points(handle, &points);
    if (!status) status = ss_engine_measure(handle, &points, &error);
    if (!status) {
        status = ss_struct_out("error", given_error, &error, sizeof error,
                               SIZE_1_0(softshadow_error));
    }
    if (status) forget_error(given_error);
    return leave(&c, status);
}

/* ---- looking inside ------------------------------------------------------------------------- */

static void sum_up(softshadow *handle, softshadow_stats *stats) {
    const ss_built *built = &handle->built;
    const ss_technique *technique = built->plan.technique;
    pthread_mutex_lock(&handle->totals_lock);
    const ss_totals totals = handle->totals;
    pthread_mutex_unlock(&handle->totals_lock);
    stats->build_seconds = totals.build_seconds, stats->query_seconds = totals.query_seconds;
    stats->depth_seconds = totals.build_spent.depth;
    stats->silhouette_seconds = totals.build_spent.silhouettes;
    stats->points = totals.points, stats->points_bad = totals.points_bad;
    stats->points_lit = totals.counts.lit, stats->points_umbra = totals.counts.umbra;
    stats->points_penumbra = totals.counts.penumbra;
    stats->points_traced = totals.counts.traced, stats->points_settled = totals.counts.settled;
    stats->rays = totals.counts.rays;
    stats->upload_seconds = totals.build_copies.up + totals.counts.up;
    stats->download_seconds = totals.build_copies.down + totals.counts.down;
    if (!built->ready) return;
    stats->triangles = built->world->triangle_count;
    pthread_mutex_lock(&handle->lod_lock);
    stats->map_bytes = built->bytes, stats->peak_bytes = built->peak_bytes;
    stats->lod_triangles = built->lod_triangles;
    pthread_mutex_unlock(&handle->lod_lock);
    stats->method_used = technique->name,
    stats->backend_used = totals.counts.spared ? ss_raster_cpu.name : built->plan.raster->name;
    for (uint32_t i = 0; i < built->light_count; i++) {
        if (technique->silhouette_edges) {
            stats->silhouette_edges += technique->silhouette_edges(built->states[i]);
        }
        if (technique->casters_culled) {
            stats->casters_culled += technique->casters_culled(built->states[i]);
        }
    }
}

softshadow_status softshadow_get_stats(const softshadow *handle, softshadow_stats *given) {
    call c;
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    softshadow_status status = enter(&c, (softshadow *)handle, false);
    stats.method_used = stats.backend_used = "";
    if (!status) sum_up((softshadow *)handle, &stats);
    if (!status || ss_struct_takes(given, SIZE_1_0(softshadow_stats))) {
        const softshadow_status copied =
            ss_struct_out("stats", given, &stats, sizeof stats, SIZE_1_0(softshadow_stats));
        if (!status) status = copied;
    }
    return leave(&c, status);
}

static uint32_t maps_of(const ss_built *built, uint32_t light) {
    const ss_technique *technique = built->plan.technique;
    return technique->map_count ? technique->map_count(built->states[light]) : 0;
}

softshadow_status softshadow_map_count(const softshadow *handle, uint32_t *count) {
    call c;
    if (count) *count = 0;
    softshadow_status status = enter(&c, (softshadow *)handle, false);
    if (!status && !count) status = ss_fail(SOFTSHADOW_E_ARGUMENT, "count: NULL");
    if (!status) status = check_ready(handle);
    for (uint32_t i = 0; !status && i < handle->built.light_count; i++) {
        *count += maps_of(&handle->built, i);
    }
    return leave(&c, status);
}

softshadow_status softshadow_get_map(const softshadow *handle, uint32_t index,
                                     softshadow_map *given) {
    call c;
    softshadow_map map = SOFTSHADOW_MAP_INIT;
    softshadow_status status = enter(&c, (softshadow *)handle, false);
    if (!status) status = check_ready(handle);
    uint32_t before = 0, light = 0;
    if (!status) {
        const ss_built *built = &handle->built;
        while (light < built->light_count && index - before >= maps_of(built, light)) {
            before += maps_of(built, light++);
        }
        if (light == built->light_count) {
            status = ss_fail(SOFTSHADOW_E_ARGUMENT, "index: %u, there are %u maps", index, before);
        }
    }
    if (!status) {
        handle->built.plan.technique->get_map(handle->built.states[light], index - before, &map);
        map.light = light;
    }
    const softshadow_status copied =
        ss_struct_out("map", given, &map, sizeof map, SIZE_1_0(softshadow_map));
    return leave(&c, status ? status : copied);
}

softshadow_status softshadow_method_count(uint32_t *count) {
    ss_message_clear();
    message_owner = NULL;
    if (!count) return ss_fail(SOFTSHADOW_E_ARGUMENT, "count: NULL");
    *count = ss_plan_method_count();
    return SOFTSHADOW_OK;
}

softshadow_status softshadow_method_info(uint32_t index, softshadow_method *given) {
    ss_message_clear();
    message_owner = NULL;
    softshadow_method method = SOFTSHADOW_METHOD_INIT;
    softshadow_status status = SOFTSHADOW_OK;
    if (!ss_plan_method(index, &method)) {
        method = (softshadow_method)SOFTSHADOW_METHOD_INIT;
        status = ss_fail(SOFTSHADOW_E_ARGUMENT, "index: %u, must be below %u", index,
                         ss_plan_method_count());
    }
    const softshadow_status copied =
        ss_struct_out("method", given, &method, sizeof method, SIZE_1_0(softshadow_method));
    return status ? status : copied;
}

softshadow_status softshadow_backend_info(uint32_t backend, softshadow_backend *given) {
    static _Thread_local ss_raster_device device;
    static _Thread_local char why[SS_MESSAGE_SIZE];
    ss_fpu fpu;
    ss_fpu_enter(&fpu);
    ss_message_clear();
    message_owner = NULL;
    ss_process_watch();
    softshadow_backend info = SOFTSHADOW_BACKEND_INIT;
    info.status = ss_plan_backend(backend, &info.name, &device);
    strcpy(why, ss_message());
    info.device = device.name, info.version = device.version, info.why = why;
    if (info.status != SOFTSHADOW_E_ARGUMENT) ss_message_clear();
    softshadow_status status =
        ss_struct_out("info", given, &info, sizeof info, SIZE_1_0(softshadow_backend));
    if (info.status == SOFTSHADOW_E_ARGUMENT) status = info.status;
    ss_fpu_leave(&fpu);
    return status;
}

softshadow_status softshadow_mesh_info(softshadow *handle, uint32_t mesh_id,
                                       softshadow_mesh_report *given) {
    call c;
    softshadow_mesh_report report = SOFTSHADOW_MESH_REPORT_INIT;
    softshadow_status status = enter(&c, handle, false);
    if (!status) status = ss_engine_inspect(handle, mesh_id, &report);
    if (status) report = (softshadow_mesh_report)SOFTSHADOW_MESH_REPORT_INIT;
    if (!status || ss_struct_takes(given, SIZE_1_0(softshadow_mesh_report))) {
        const softshadow_status copied = ss_struct_out("report", given, &report, sizeof report,
                                                       SIZE_1_0(softshadow_mesh_report));
        if (!status) status = copied;
    }
    return leave(&c, status);
}

static void forget_explanation(softshadow_explanation *given) {
    if (!ss_struct_takes(given, SIZE_1_0(softshadow_explanation))) return;
    given->visibility = NAN, given->triangles = 0;
    for (int k = 0; k < 3; k++) given->centre[k] = given->u[k] = given->v[k] = NAN;
    if (given->size > SS_LARGEST_PICTURE) return;
    const size_t pixels = (size_t)given->size * given->size;
    fill_nan(given->image, pixels);
    for (size_t i = 0; given->hider && i < pixels; i++) given->hider[i] = SOFTSHADOW_NO_PRIMITIVE;
}

softshadow_status softshadow_explain(softshadow *handle, softshadow_explanation *given) {
    call c;
    softshadow_explanation explanation;
    softshadow_status status = enter(&c, handle, false);
    if (!status) {
        status = ss_struct_in("explanation", given, &explanation, sizeof explanation,
                              SIZE_1_0(softshadow_explanation));
    }
    if (!status) status = check_ready(handle);
    if (!status) status = ss_engine_explain(handle, &explanation);
    if (!status) {
        status = ss_struct_out("explanation", given, &explanation, sizeof explanation,
                               SIZE_1_0(softshadow_explanation));
    }
    if (status) forget_explanation(given);
    return leave(&c, status);
}
