/* based on: [WWB14] Embree; [Vog79] the sunflower spiral. */
#include "peer.h"

#include <dlfcn.h>
#include <embree3/rtcore.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "config.h"

#define TAU 6.28318530717958647693
#define PACKET 16

#define EACH_FUNCTION(X) \
    X(NewDevice) X(ReleaseDevice) X(GetDeviceError) X(NewScene) X(ReleaseScene) X(SetSceneFlags) \
    X(SetSceneBuildQuality) X(CommitScene) X(AttachGeometry) X(NewGeometry) X(ReleaseGeometry) \
    X(SetGeometryBuildQuality) X(SetSharedGeometryBuffer) X(CommitGeometry) X(Occluded16) \
    X(Intersect1)

/* Only the types of Embree's header are used, never its symbols. */
typedef struct embree {
#define X(name) __typeof__(&rtc##name) name;
    EACH_FUNCTION(X)
#undef X
} embree;

static embree rtc;

struct peer {
    RTCDevice device;
    RTCScene scene;
    double build_seconds;
};

struct peer_samples {
    peer_style style;
    uint32_t padded; /* a multiple of PACKET */
    uint32_t seed;
    float *x, *y;    /* in the unit disk or [-1, 1]^2, padded */
    float rim_x[PACKET], rim_y[PACKET];
};

/* ---- Loading and building -------------------------------------------------------------------*/

/* Loaded for good: threads of TBB below Embree must never find their code gone. */
static bool load(cli_error *error) {
    void *library = dlopen(SS_EMBREE_LIBRARY, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (!library)
        return cli_fail(error, CLI_FAILED, "Embree: %s; install the Debian package libembree3-3",
                        dlerror());
#define X(name) \
    *(void **) &rtc.name = dlsym(library, "rtc" #name); \
    if (!rtc.name) return cli_fail(error, CLI_FAILED, "Embree: rtc" #name " is missing");
    EACH_FUNCTION(X)
#undef X
    return true;
}

static void attach(peer *p, const peer_mesh *mesh) {
    const RTCGeometry triangles = rtc.NewGeometry(p->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtc.SetGeometryBuildQuality(triangles, RTC_BUILD_QUALITY_HIGH);
    rtc.SetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                mesh->positions, 0, 3 * sizeof(float), mesh->vertex_count);
    rtc.SetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                mesh->indices, 0, 3 * sizeof(uint32_t), mesh->triangle_count);
    rtc.CommitGeometry(triangles);
    rtc.AttachGeometry(p->scene, triangles);
    rtc.ReleaseGeometry(triangles);
}

bool peer_create(peer **out, const peer_mesh *mesh, bool robust, cli_error *error) {
    *out = NULL;
    if (!rtc.NewDevice && !load(error)) return false;
    peer *p = calloc(1, sizeof *p);
    if (!p) return cli_fail(error, CLI_FAILED, "memory ran out");
    p->device = rtc.NewDevice(NULL);
    if (!p->device) {
        free(p);
        return cli_fail(error, CLI_FAILED, "Embree: no device, error %d", rtc.GetDeviceError(NULL));
    }
    const double start = bench_clock();
    p->scene = rtc.NewScene(p->device);
    rtc.SetSceneBuildQuality(p->scene, RTC_BUILD_QUALITY_HIGH);
    rtc.SetSceneFlags(p->scene, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    attach(p, mesh);
    rtc.CommitScene(p->scene);
    p->build_seconds = bench_clock() - start;
    const enum RTCError code = rtc.GetDeviceError(p->device);
    if (code != RTC_ERROR_NONE) {
        peer_destroy(p);
        return cli_fail(error, CLI_FAILED, "Embree: the build failed, error %d", code);
    }
    *out = p;
    return true;
}

void peer_destroy(peer *p) {
    if (!p) return;
    rtc.ReleaseScene(p->scene);
    rtc.ReleaseDevice(p->device);
    free(p);
}

double peer_build_seconds(const peer *p) { return p->build_seconds; }

uint32_t peer_first_hit(const peer *p, const double origin[3], const double direction[3],
                        double *distance) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRayHit ray = {.ray = {.org_x = (float) origin[0], .org_y = (float) origin[1],
                                    .org_z = (float) origin[2], .dir_x = (float) direction[0],
                                    .dir_y = (float) direction[1], .dir_z = (float) direction[2],
                                    .tfar = INFINITY, .mask = UINT32_MAX},
                            .hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
    rtc.Intersect1(p->scene, &context, &ray);
    *distance = (double) ray.ray.tfar;
    return ray.hit.geomID == RTC_INVALID_GEOMETRY_ID ? UINT32_MAX : ray.hit.primID;
}

/* ---- Samples --------------------------------------------------------------------------------*/

typedef struct sample {
    float x, y;
    uint64_t key;
} sample;

static uint64_t spread(uint32_t bits) {
    uint64_t x = bits & 0xffff;
    x = (x | x << 8) & 0xff00ff;
    x = (x | x << 4) & 0xf0f0f0f;
    x = (x | x << 2) & 0x33333333;
    return (x | x << 1) & 0x55555555;
}

static int by_key(const void *a, const void *b) {
    const uint64_t x = ((const sample *) a)->key, y = ((const sample *) b)->key;
    return (x > y) - (x < y);
}

static sample place(const peer_samples *s, bool disk, uint32_t i) {
    const double golden = 0.61803398874989484820, turns = fmod(i * golden, 1);
    sample at;
    if (s->style.truth) {
        const double u = fmod(0.5 + i * 0.75487766624669276, 1), v = fmod(i * 0.56984029099805327, 1);
        const double radius = sqrt(u);
        at.x = (float) (disk ? radius * cos(TAU * v) : 2 * u - 1);
        at.y = (float) (disk ? radius * sin(TAU * v) : 2 * v - 1);
    } else if (disk) {
        const double radius = sqrt((i + 0.5) / s->style.samples);
        at.x = (float) (radius * cos(TAU * turns)), at.y = (float) (radius * sin(TAU * turns));
    } else {
        at.x = (float) (2 * (i + 0.5) / s->style.samples - 1), at.y = (float) (2 * turns - 1);
    }
    at.key = i;
    if (s->style.clustered) {
        const double scale = 32767.0;
        at.key = spread((uint32_t) (((double) at.x + 1) * scale)) |
                 spread((uint32_t) (((double) at.y + 1) * scale)) << 1;
    }
    return at;
}

static void place_rim(peer_samples *s, bool disk) {
    for (int i = 0; i < PACKET; i++) {
        const double turn = TAU * i / PACKET, c = cos(turn), d = sin(turn);
        const double out = disk ? 1 : 1 / fmax(fabs(c), fabs(d));
        s->rim_x[i] = (float) (out * c), s->rim_y[i] = (float) (out * d);
    }
}

peer_samples *peer_samples_create(const softshadow_light *light, const peer_style *style) {
    peer_samples *s = calloc(1, sizeof *s);
    if (!s) return NULL;
    const bool disk = light->type != SOFTSHADOW_RECT;
    s->style = *style;
    s->padded = (style->samples + PACKET - 1) / PACKET * PACKET;
    s->x = calloc(s->padded, sizeof *s->x), s->y = calloc(s->padded, sizeof *s->y);
    sample *all = malloc(style->samples * sizeof *all);
    if (s->x && s->y && all) {
        for (uint32_t i = 0; i < style->samples; i++) all[i] = place(s, disk, i);
        qsort(all, style->samples, sizeof *all, by_key);
        for (uint32_t i = 0; i < style->samples; i++) s->x[i] = all[i].x, s->y[i] = all[i].y;
        place_rim(s, disk);
    } else {
        peer_samples_free(s);
        s = NULL;
    }
    free(all);
    return s;
}

void peer_samples_turn(peer_samples *s) { s->seed += 0x9e3779b9u; }

void peer_samples_free(peer_samples *s) {
    if (!s) return;
    free(s->x);
    free(s->y);
    free(s);
}

/* ---- Rays -----------------------------------------------------------------------------------*/

/* The light as a point sees it: centre + x a + y b, turned about the centre. */
typedef struct view {
    float centre[3], a[3], b[3], end;
} view;

static void axes(const double n[3], double a[3], double b[3]) {
    const double sign = copysign(1, n[2]), k = -1 / (sign + n[2]), m = n[0] * n[1] * k;
    a[0] = 1 + sign * n[0] * n[0] * k, a[1] = sign * m, a[2] = -sign * n[0];
    b[0] = m, b[1] = sign + n[1] * n[1] * k, b[2] = -n[1];
}

static double unit(double v[3]) {
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int k = 0; k < 3; k++) v[k] /= length;
    return length;
}

/* A hash of the point turns the samples, so that an answer does not depend on the order. */
static uint32_t hash(const float p[3], uint32_t seed) {
    uint32_t bits[3];
    memcpy(bits, p, sizeof bits);
    uint32_t h = bits[0] * 0x9e3779b1u ^ bits[1] * 0x85ebca77u ^ bits[2] * 0xc2b2ae3du ^ seed;
    h = (h ^ h >> 15) * 0x2c1b3c6du;
    h = (h ^ h >> 12) * 0x297a2d39u;
    return h ^ h >> 15;
}

static void see(const softshadow_light *light, const float p[3], uint32_t seed, view *v) {
    double centre[3], a[3], b[3], end = 1, size = light->radius;
    for (int k = 0; k < 3; k++) centre[k] = light->position[k] - (double) p[k];
    if (light->type == SOFTSHADOW_SPHERE) {
        double to[3] = {centre[0], centre[1], centre[2]};
        const double sine = light->radius / unit(to);
        end = (1 - sine) * (1 + sine);
        size /= sqrt(end);
        axes(to, a, b);
    } else if (light->type == SOFTSHADOW_RECT) {
        size = 1;
        memcpy(a, light->u, sizeof a), memcpy(b, light->v, sizeof b);
    } else {
        double normal[3] = {light->direction[0], light->direction[1], light->direction[2]};
        unit(normal);
        axes(normal, a, b);
        if (light->type == SOFTSHADOW_SUN) {
            for (int k = 0; k < 3; k++) centre[k] = -normal[k];
            size = tan(light->radius), end = INFINITY;
        }
    }
    const float turn = (float) TAU * (float) (hash(p, seed) >> 8) * 0x1p-24f;
    const double c = (double) cosf(turn), s = (double) sinf(turn);
    const bool turns = light->type != SOFTSHADOW_RECT;
    for (int k = 0; k < 3; k++) {
        v->centre[k] = (float) centre[k];
        v->a[k] = (float) (size * (turns ? c * a[k] + s * b[k] : a[k]));
        v->b[k] = (float) (size * (turns ? c * b[k] - s * a[k] : b[k]));
    }
    v->end = (float) end;
}

typedef struct work {
    const softshadow_light *light;
    const peer_samples *samples;
    RTCScene scene;
    struct RTCIntersectContext *context;
} work;

typedef struct RTCRay16 packet;

static inline __attribute__((always_inline)) void begin(packet *ray, const float p[3]) {
    for (int i = 0; i < PACKET; i++) {
        ray->org_x[i] = p[0], ray->org_y[i] = p[1], ray->org_z[i] = p[2];
        ray->tnear[i] = 0, ray->time[i] = 0;
        ray->mask[i] = UINT32_MAX, ray->id[i] = 0, ray->flags[i] = 0;
    }
}

/* How many of the packet's valid rays meet something. */
static inline __attribute__((always_inline)) uint32_t shoot(const work *w, packet *ray,
                                                            const view *v, const float *x,
                                                            const float *y, const int *valid) {
    for (int i = 0; i < PACKET; i++) {
        ray->dir_x[i] = v->centre[0] + x[i] * v->a[0] + y[i] * v->b[0];
        ray->dir_y[i] = v->centre[1] + x[i] * v->a[1] + y[i] * v->b[1];
        ray->dir_z[i] = v->centre[2] + x[i] * v->a[2] + y[i] * v->b[2];
        ray->tfar[i] = v->end;
    }
    rtc.Occluded16(valid, w->scene, w->context, ray);
    int hidden = 0;
    for (int i = 0; i < PACKET; i++) hidden += valid[i] && ray->tfar[i] < 0;
    return (uint32_t) hidden;
}

static inline __attribute__((always_inline)) void answer(const work *w, const float (*points)[3],
                                                         size_t count, float *visibility) {
    const peer_samples *s = w->samples;
    _Alignas(64) packet ray;
    _Alignas(64) int all[PACKET], tail[PACKET];
    const uint32_t last = s->padded - PACKET;
    for (int i = 0; i < PACKET; i++) {
        all[i] = -1;
        tail[i] = last + (uint32_t) i < s->style.samples ? -1 : 0;
    }
    for (size_t q = 0; q < count; q++) {
        view v;
        see(w->light, points[q], s->seed, &v);
        begin(&ray, points[q]);
        if (s->style.rim) {
            const uint32_t hidden = shoot(w, &ray, &v, s->rim_x, s->rim_y, all);
            if (hidden == 0 || hidden == PACKET) {
                visibility[q] = hidden == 0;
                continue;
            }
        }
        uint32_t hidden = 0;
        for (uint32_t i = 0; i < last; i += PACKET)
            hidden += shoot(w, &ray, &v, s->x + i, s->y + i, all);
        hidden += shoot(w, &ray, &v, s->x + last, s->y + last, tail);
        visibility[q] = 1 - (float) hidden / (float) s->style.samples;
    }
}

static void answer_plain(const work *w, const float (*p)[3], size_t n, float *out) {
    answer(w, p, n, out);
}

#ifdef SS_HAVE_X86
#include <xmmintrin.h>
#define FLUSH 0x8040u /* FTZ | DAZ */

__attribute__((target("avx2,fma"))) static void answer_avx2(const work *w, const float (*p)[3],
                                                            size_t n, float *out) {
    answer(w, p, n, out);
}

__attribute__((target("avx512f,avx512bw,avx512dq,avx512vl,prefer-vector-width=512"))) static void
answer_avx512(const work *w, const float (*p)[3], size_t n, float *out) {
    answer(w, p, n, out);
}

static void answer_best(const work *w, const float (*p)[3], size_t n, float *out) {
    const unsigned saved = _mm_getcsr();
    _mm_setcsr(saved | FLUSH);
    if (__builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
        answer_avx512(w, p, n, out);
    else if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        answer_avx2(w, p, n, out);
    else
        answer_plain(w, p, n, out);
    _mm_setcsr(saved);
}
#else
static void answer_best(const work *w, const float (*p)[3], size_t n, float *out) {
    answer_plain(w, p, n, out);
}
#endif

void peer_query(const peer *p, const softshadow_light *light, const peer_samples *samples,
                const float (*points)[3], size_t count, float *visibility) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    if (samples->style.coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    const work w = {light, samples, p->scene, &context};
    answer_best(&w, points, count, visibility);
}
