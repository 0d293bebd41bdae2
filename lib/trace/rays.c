/* Shadow rays by Embree 3. based on: [WWB14] (Embree), [WBW13] (its watertight test, "robust").
 *
 * ROBUST, because without it 8 % of random rays leak through a mesh far from the origin; HIGH build
 * quality, because many rays are asked of one tree. One device a world:
 * two handles never share errors, memory counts or locks. The device string stays empty: `threads=`
 * would throttle every user of TBB in the process. */
#include "trace/rays.h"

#include <dlfcn.h>
#include <embree3/rtcore.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/memory.h"
#include "base/process.h"
#include "base/status.h"
#include "config.h"
#include "trace/distinct.h"

#define EACH_FUNCTION(X) \
    X(NewDevice) X(ReleaseDevice) X(GetDeviceError) X(SetDeviceErrorFunction) \
    X(SetDeviceMemoryMonitorFunction) X(NewScene) X(ReleaseScene) X(SetSceneFlags) \
    X(SetSceneBuildQuality) X(JoinCommitScene) X(AttachGeometry) X(NewGeometry) \
    X(ReleaseGeometry) X(SetGeometryBuildQuality) X(SetSharedGeometryBuffer) X(CommitGeometry) \
    X(Occluded16)

/* Only the types of Embree's header are used, never its symbols. */
typedef struct embree {
#define X(name) __typeof__(&rtc##name) name;
    EACH_FUNCTION(X)
#undef X
} embree;

struct ss_rays {
    const embree *rtc;
    const ss_world *world;
    RTCDevice device;
    RTCScene scene; /* NULL: nothing casts */
    uint32_t *numbers;  /* of Embree's triangles in the world; NULL: the same */
    uint32_t *indices;  /* corners of those */
    size_t count;       /* of those */
    _Atomic int64_t bytes;
    bool committing; /* set while no other thread is about */
    pthread_mutex_t lock; /* guards error and message: builds report from several threads */
    enum RTCError error;
    char message[SS_MESSAGE_SIZE / 2];
};

_Static_assert(sizeof(ss_segments) == sizeof(struct RTCRay16), "segments are Embree's packet");
_Static_assert(offsetof(ss_segments, dx) == offsetof(struct RTCRay16, dir_x), "segments: dx");
_Static_assert(offsetof(ss_segments, t_begin) == offsetof(struct RTCRay16, tnear),
               "segments: t_begin");
_Static_assert(offsetof(ss_segments, t_end) == offsetof(struct RTCRay16, tfar), "segments: t_end");

/* ---- Loading ---- */

/* Loaded for good: threads of TBB below Embree must never find their code gone. RTLD_LOCAL and
 * dlsym on the handle: a host that exports its own rtc functions would capture ours otherwise. */
static softshadow_status load(const char *library, embree *rtc) {
    void *handle = dlopen(library, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (!handle) {
        const char *words = dlerror();
        return ss_fail(SOFTSHADOW_E_BACKEND, "Embree: %s; install the Debian package libembree3-3",
                       words ? words : library);
    }
#define X(name) \
    *(void **)&rtc->name = dlsym(handle, "rtc" #name); \
    if (!rtc->name) { \
        return ss_fail(SOFTSHADOW_E_BACKEND, "Embree: rtc" #name " is not in %s; install the " \
                       "Debian package libembree3-3", library); \
    }
    EACH_FUNCTION(X)
#undef X
    return SOFTSHADOW_OK;
}

softshadow_status ss_rays_load(const char *library) {
    embree rtc;
    return load(library, &rtc);
}

static softshadow_status loaded(const embree **out) {
    static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
    static embree table;
    static bool ready;
    softshadow_status status = SOFTSHADOW_OK;
    pthread_mutex_lock(&lock);
    if (!ready) status = load(SS_EMBREE_LIBRARY, &table);
    ready = status == SOFTSHADOW_OK;
    pthread_mutex_unlock(&lock);
    *out = &table;
    return status;
}

/* ---- May Embree run here? ---- */

static void *wait_for_start(void *lock) {
    pthread_mutex_lock(lock);
    pthread_mutex_unlock(lock);
    return NULL;
}

/* TBB aborts the process when a worker cannot be started: try as many first. */
static softshadow_status try_threads(void) {
    enum { MOST = 256 };
    pthread_t thread[MOST];
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    const int wanted = processors <= 2 ? 1 : processors > MOST ? MOST : (int)processors - 1;
    pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
    int started = 0, failure = 0;
    pthread_mutex_lock(&lock);
    while (started < wanted && failure == 0) {
        failure = pthread_create(&thread[started], NULL, wait_for_start, &lock);
        if (failure == 0) started++;
    }
    pthread_mutex_unlock(&lock);
    for (int i = 0; i < started; i++) pthread_join(thread[i], NULL);
    pthread_mutex_destroy(&lock);
    if (failure == 0) return SOFTSHADOW_OK;
    return ss_fail(SOFTSHADOW_E_UNSUPPORTED,
                   "ray tracing: only %d of %d threads can be started, and "
                   "Embree needs them; the methods without rays do not",
                   started, wanted);
}

/* ---- Building ---- */

static void on_error(void *user, enum RTCError code, const char *text) {
    ss_rays *rays = user;
    pthread_mutex_lock(&rays->lock);
    if (rays->error == RTC_ERROR_NONE) {
        rays->error = code;
        strncpy(rays->message, text ? text : "no message", sizeof rays->message - 1);
    }
    pthread_mutex_unlock(&rays->lock);
}

static bool can_have(size_t bytes) {
    void *trial = malloc(bytes);
    free(trial);
    return trial != NULL;
}

/* Counts. Says no before the commit only: there it would throw through all threads that joined, and
 * TBB crashes now and then where two of them rethrow one exception. */
static bool on_memory(void *user, ssize_t bytes, bool post) {
    ss_rays *rays = user;
    if (bytes > 0 && !post && !rays->committing && !can_have((size_t)bytes)) return false;
    atomic_fetch_add(&rays->bytes, bytes);
    return true;
}

/* What a commit takes at its peak: 85 to 113 bytes a triangle for grids and soups of 128 to
 * 524,288, by Embree 3.13's own count. */
static softshadow_status see_memory_coming(const ss_rays *rays) {
    const size_t triangles = rays->count;
    if (can_have(128 * triangles + (64 << 10))) return SOFTSHADOW_OK;
    return ss_fail(SOFTSHADOW_E_MEMORY,
                   "ray tracing: out of memory for Embree's tree of %zu triangles", triangles);
}

static softshadow_status failure_of(const ss_rays *rays) {
    if (rays->error == RTC_ERROR_NONE) return SOFTSHADOW_OK;
    const bool memory =
        rays->error == RTC_ERROR_OUT_OF_MEMORY || rays->error == RTC_ERROR_CANCELLED;
    return ss_fail(memory ? SOFTSHADOW_E_MEMORY : SOFTSHADOW_E_BACKEND,
                   "Embree: %s (%zu triangles)", rays->message, rays->world->triangle_count);
}

/* Every thread that comes helps; one alone finishes; one that comes late returns at once. So the
 * host's scheduler may run the bodies in any way, one after another included. */
static softshadow_status commit_body(void *ctx, uint64_t begin, uint64_t end) {
    (void)begin, (void)end;
    ss_rays *rays = ctx;
    rays->rtc->JoinCommitScene(rays->scene);
    return SOFTSHADOW_OK;
}

static softshadow_status leave_copies_out(ss_rays *rays) {
    const ss_world *world = rays->world;
    const softshadow_status status = ss_distinct_find(world, &rays->numbers, &rays->count);
    if (status || !rays->numbers) return status;
    rays->indices = ss_alloc(3 * rays->count, sizeof *rays->indices);
    if (!rays->indices) return ss_fail(SOFTSHADOW_E_MEMORY, "ray tracing: out of memory");
    for (size_t i = 0; i < rays->count; i++) {
        memcpy(rays->indices + 3 * i, world->indices + 3 * (size_t)rays->numbers[i],
               3 * sizeof *rays->indices);
    }
    return SOFTSHADOW_OK;
}

static void attach_triangles(ss_rays *rays) {
    const embree *rtc = rays->rtc;
    const ss_world *world = rays->world;
    RTCGeometry geometry = rtc->NewGeometry(rays->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    if (!geometry) return; /* on_error knows */
    rtc->SetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    rtc->SetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                 world->vertices, 0, 3 * sizeof(float), world->vertex_count);
    rtc->SetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                 rays->indices ? rays->indices : world->indices, 0,
                                 3 * sizeof(uint32_t), rays->count);
    rtc->CommitGeometry(geometry);
    rtc->AttachGeometry(rays->scene, geometry);
    rtc->ReleaseGeometry(geometry);
}

static softshadow_status build(ss_rays *rays, ss_pool *pool) {
    const embree *rtc = rays->rtc;
    rays->device = rtc->NewDevice(NULL);
    if (!rays->device) {
        return ss_fail(SOFTSHADOW_E_BACKEND, "Embree: rtcNewDevice failed with error %d",
                       (int)rtc->GetDeviceError(NULL));
    }
    rtc->SetDeviceErrorFunction(rays->device, on_error, rays);
    rtc->SetDeviceMemoryMonitorFunction(rays->device, on_memory, rays);
    if (rays->world->triangle_count == 0) return SOFTSHADOW_OK;
    softshadow_status status = leave_copies_out(rays);
    if (status) return status;
    rays->scene = rtc->NewScene(rays->device);
    if (!rays->scene) return failure_of(rays);
    rtc->SetSceneFlags(rays->scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    rtc->SetSceneBuildQuality(rays->scene, RTC_BUILD_QUALITY_HIGH);
    attach_triangles(rays);
    status = failure_of(rays);
    if (!status) status = see_memory_coming(rays);
    if (status) return status;
    rays->committing = true;
    status = ss_parallel_for(pool, ss_pool_threads(pool), 1, commit_body, rays);
    rays->committing = false;
    return status ? status : failure_of(rays);
}

softshadow_status ss_rays_create(ss_rays **out, const ss_world *world, ss_pool *pool) {
    *out = NULL;
    if (ss_process_forked()) {
        return ss_fail(SOFTSHADOW_E_UNSUPPORTED,
                       "ray tracing: not in a child made by fork(), where "
                       "Embree's scheduler may hang; the methods without rays work");
    }
    if (world->extent > 0 && world->extent < 0.25f) { /* a scene fills -1..1, where doubles can scale it */
        return ss_fail(SOFTSHADOW_E_UNSUPPORTED,
                       "ray tracing: all casters together are smaller than "
                       "2^-1023; the methods without rays work");
    }
    const embree *rtc;
    softshadow_status status = loaded(&rtc);
    if (!status) status = try_threads();
    if (status) return status;
    ss_rays *rays = ss_alloc(1, sizeof *rays);
    if (!rays) return ss_fail(SOFTSHADOW_E_MEMORY, "ray tracing: out of memory");
    rays->rtc = rtc, rays->world = world;
    pthread_mutex_init(&rays->lock, NULL);
    status = build(rays, pool);
    if (status) {
        ss_rays_destroy(rays);
        return status;
    }
    *out = rays;
    return SOFTSHADOW_OK;
}

/* In a child made by fork() Embree's own threads are gone: what it holds is left to the process. */
void ss_rays_destroy(ss_rays *rays) {
    if (!rays) return;
    if (!ss_process_forked()) {
        if (rays->scene) rays->rtc->ReleaseScene(rays->scene);
        if (rays->device) rays->rtc->ReleaseDevice(rays->device);
    }
    pthread_mutex_destroy(&rays->lock);
    ss_free(rays->numbers), ss_free(rays->indices);
    ss_free(rays);
}

size_t ss_rays_bytes(const ss_rays *rays) {
    const int64_t bytes = atomic_load(&rays->bytes);
    const size_t own = rays->numbers ? rays->world->triangle_count + 3 * rays->count : 0;
    return sizeof *rays + own * sizeof(uint32_t) + (size_t)(bytes > 0 ? bytes : 0);
}

/* ---- Asking ---- */

typedef struct question {
    struct RTCIntersectContext context; /* first: Embree hands it to the filter */
    const ss_world *world;
    const uint32_t *numbers; /* as in ss_rays */
    const uint32_t *ignored;
    size_t ignored_count;
} question;

static bool is_ignored(const question *asked, uint32_t triangle) {
    for (size_t i = 0; i < asked->ignored_count; i++) {
        if (asked->ignored[i] == triangle) return true;
    }
    return false;
}

/* Takes back the hits that do not block. A hit is rows of N: Ng x y z, u, v, primitive, ...
 * (Embree's accessors are C++ only). */
static void filter(const struct RTCFilterFunctionNArguments *arguments) {
    const question *asked = (const question *)arguments->context;
    const unsigned n = arguments->N;
    const float *u = (const float *)(const void *)arguments->hit + 3 * n, *v = u + n;
    const unsigned *triangles = (const unsigned *)(const void *)arguments->hit + 5 * n;
    for (unsigned i = 0; i < n; i++) {
        if (arguments->valid[i] == 0) continue;
        const uint32_t triangle = asked->numbers ? asked->numbers[triangles[i]] : triangles[i];
        if (is_ignored(asked, triangle) ||
            (asked->world->any_opacity &&
             !ss_world_opaque_at(asked->world, triangle, u[i], v[i]))) {
            arguments->valid[i] = 0;
        }
    }
}

/* Four lanes at once, in the compiler's own vectors: sixteen rays cost 150 ns, their checks must
 * not. */
typedef float floats __attribute__((vector_size(16)));
typedef int ints __attribute__((vector_size(16)));

static inline floats four(const float *values) {
    floats all;
    memcpy(&all, values, sizeof all);
    return all;
}

static inline ints within_limits(const float *values) {
    const floats v = four(values);
    return (v < 1e18f) & (v > -1e18f); /* NaN compares false */
}

/* Embree's valid mask: what was asked for and is safe to ask. */
static void mask_lanes(const ss_segments *segments, uint32_t valid, int lanes[16]) {
    for (int i = 0; i < 16; i += 4) {
        const floats begin = four(segments->t_begin + i), end = four(segments->t_end + i);
        const ints bit = {1 << i, 2 << i, 4 << i, 8 << i};
        const ints good = (((int)valid & bit) != 0) & (begin >= 0) & (end > begin) &
                          within_limits(segments->ox + i) & within_limits(segments->oy + i) &
                          within_limits(segments->oz + i) & within_limits(segments->dx + i) &
                          within_limits(segments->dy + i) & within_limits(segments->dz + i);
        memcpy(lanes + i, &good, sizeof good);
    }
}

/* The lanes that Embree marked with an end at minus infinity, as bits. */
static uint32_t ended(const ss_segments *segments, const int lanes[16]) {
    ints bits = {0};
    for (int i = 0; i < 16; i += 4) {
        ints asked;
        memcpy(&asked, lanes + i, sizeof asked);
        const ints bit = {1 << i, 2 << i, 4 << i, 8 << i};
        bits |= bit & asked & (four(segments->t_end + i) < 0);
    }
    return (uint32_t)(bits[0] | bits[1] | bits[2] | bits[3]);
}

uint32_t ss_rays_blocked(const ss_rays *rays, ss_segments *segments, uint32_t valid,
                         bool coherent, const uint32_t *ignored, size_t ignored_count) {
    if (!rays->scene) return 0;
    _Alignas(64) int lanes[16];
    mask_lanes(segments, valid, lanes);
    memset(segments->kept_time, 0, sizeof segments->kept_time);
    memset(segments->kept[0], 0xff, sizeof segments->kept[0]); /* the mask all geometry answers to */
    question asked = {.world = rays->world, .numbers = rays->numbers, .ignored = ignored,
                      .ignored_count = ignored_count};
    rtcInitIntersectContext(&asked.context);
    if (coherent) asked.context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    if (ignored_count > 0 || rays->world->any_opacity) asked.context.filter = filter;
    rays->rtc->Occluded16(lanes, rays->scene, &asked.context,
                          (struct RTCRay16 *)(void *)segments);
    return ended(segments, lanes);
}
