/* based on: [WWB14] Embree; [Vog79] the sunflower spiral; [DBC17] Duff et al., "Building an
 * Orthonormal Basis, Revisited". */
#include "peer.h"

#include <dlfcn.h>
#include <embree3/rtcore.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "config.h"

#define TAU    6.28318530717958647693
#define PACKET 16

/* clang-format off */
#define EACH_FUNCTION(X) \
    X(NewDevice) X(ReleaseDevice) X(GetDeviceError) X(NewScene) X(ReleaseScene) X(SetSceneFlags) \
    X(SetSceneBuildQuality) X(CommitScene) X(AttachGeometry) X(NewGeometry) X(ReleaseGeometry) \
    X(SetDeviceMemoryMonitorFunction) \
    X(SetGeometryBuildQuality) X(SetSharedGeometryBuffer) X(CommitGeometry) X(Occluded16) \
    X(Intersect1) X(Intersect16)
/* clang-format on */

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
    atomic_int_least64_t bytes;
};

struct peer_samples {
    peer_style style;
    uint32_t padded; /* a multiple of PACKET */
    uint32_t seed;
    float *x, *y; /* in the unit disk or [-1, 1]^2, padded; aligned as packets are */
    _Alignas(64) float rim_x[PACKET], rim_y[PACKET];
};

/* ---- Loading and building -------------------------------------------------------------------*/

/* Loaded for good: threads of TBB below Embree must never find their code gone. */
static bool load(cli_error *error) {
    void *library = dlopen(SS_EMBREE_LIBRARY, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (!library)
        return cli_fail(error, CLI_FAILED, "Embree: %s; install the Debian package libembree3-3",
                        dlerror());
#define X(name)                                                                                    \
    *(void **)&rtc.name = dlsym(library, "rtc" #name);                                             \
    if (!rtc.name) return cli_fail(error, CLI_FAILED, "Embree: rtc" #name " is missing");
    EACH_FUNCTION(X)
#undef X
    return true;
}

/* Embree tells of every allocation from whichever thread makes it. */
static bool count_bytes(void *counter, ssize_t bytes, bool after) {
    (void)after;
    atomic_fetch_add((atomic_int_least64_t *)counter, bytes);
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
    rtc.SetDeviceMemoryMonitorFunction(p->device, count_bytes, &p->bytes);
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

uint64_t peer_bytes(const peer *p) { return (uint64_t)atomic_load(&p->bytes); }

uint32_t peer_first_hit(const peer *p, const double origin[3], const double direction[3],
                        double *distance) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRayHit ray = {.ray = {.org_x = (float)origin[0],
                                    .org_y = (float)origin[1],
                                    .org_z = (float)origin[2],
                                    .dir_x = (float)direction[0],
                                    .dir_y = (float)direction[1],
                                    .dir_z = (float)direction[2],
                                    .tfar = INFINITY,
                                    .mask = UINT32_MAX},
                            .hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
    rtc.Intersect1(p->scene, &context, &ray);
    *distance = (double)ray.ray.tfar;
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
    const uint64_t x = ((const sample *)a)->key, y = ((const sample *)b)->key;
    return (x > y) - (x < y);
}

static sample place(const peer_samples *s, bool disk, uint32_t i) {
    const double golden = 0.61803398874989484820, turns = fmod(i * golden, 1);
    sample at;
    if (s->style.truth) {
        const double u = fmod(0.5 + i * 0.75487766624669276, 1),
                     v = fmod(i * 0.56984029099805327, 1);
        const double radius = sqrt(u);
        at.x = (float)(disk ? radius * cos(TAU * v) : 2 * u - 1);
        at.y = (float)(disk ? radius * sin(TAU * v) : 2 * v - 1);
    } else if (disk) {
        const double radius = sqrt((i + 0.5) / s->style.samples);
        at.x = (float)(radius * cos(TAU * turns)), at.y = (float)(radius * sin(TAU * turns));
    } else {
        at.x = (float)(2 * (i + 0.5) / s->style.samples - 1), at.y = (float)(2 * turns - 1);
    }
    at.key = i;
    if (s->style.clustered) {
        const double scale = 32767.0;
        at.key = spread((uint32_t)(((double)at.x + 1) * scale)) |
                 spread((uint32_t)(((double)at.y + 1) * scale)) << 1;
    }
    return at;
}

static void place_rim(peer_samples *s, bool disk) {
    for (int i = 0; i < PACKET; i++) {
        const double turn = TAU * i / PACKET, c = cos(turn), d = sin(turn);
        const double out = disk ? 1 : 1 / fmax(fabs(c), fabs(d));
        s->rim_x[i] = (float)(out * c), s->rim_y[i] = (float)(out * d);
    }
}

peer_samples *peer_samples_create(const softshadow_light *light, const peer_style *style) {
    peer_samples *s = aligned_alloc(64, sizeof *s);
    if (!s) return NULL;
    memset(s, 0, sizeof *s);
    const bool disk = light->type != SOFTSHADOW_RECT;
    s->style = *style;
    s->padded = (style->samples + PACKET - 1) / PACKET * PACKET;
    s->x = aligned_alloc(64, s->padded * sizeof *s->x);
    s->y = aligned_alloc(64, s->padded * sizeof *s->y);
    sample *all = malloc(style->samples * sizeof *all);
    if (s->x && s->y && all) {
        for (uint32_t i = 0; i < style->samples; i++) all[i] = place(s, disk, i);
        memset(s->x, 0, s->padded * sizeof *s->x), memset(s->y, 0, s->padded * sizeof *s->y);
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

static inline __attribute__((always_inline)) void axes(const float n[3], float a[3], float b[3]) {
    /* [DBC17], without a branch */
    const float sign = copysignf(1, n[2]), k = -1 / (sign + n[2]), m = n[0] * n[1] * k;
    a[0] = 1 + sign * n[0] * n[0] * k, a[1] = sign * m, a[2] = -sign * n[0];
    b[0] = m, b[1] = sign + n[1] * n[1] * k, b[2] = -n[1];
}

/* A hash of the point turns the samples, so that an answer does not depend on the order. */
static inline __attribute__((always_inline)) uint32_t hash(const float p[3], uint32_t seed) {
    uint32_t bits[3];
    memcpy(bits, p, sizeof bits);
    uint32_t h = bits[0] * 0x9e3779b1u ^ bits[1] * 0x85ebca77u ^ bits[2] * 0xc2b2ae3du ^ seed;
    h = (h ^ h >> 15) * 0x2c1b3c6du;
    h = (h ^ h >> 12) * 0x297a2d39u;
    return h ^ h >> 15;
}

enum { TURNS = 1024 };

typedef struct work {
    const softshadow_light *light;
    const peer_samples *samples;
    RTCScene scene;
    struct RTCIntersectContext *context;
    view fixed; /* what of the view is the same for all points */
    float cosine[TURNS], sine[TURNS];
} work;

static void prepare(work *w) {
    const softshadow_light *light = w->light;
    float size = (float)light->radius, normal[3];
    for (int i = 0; i < TURNS; i++) {
        w->cosine[i] = (float)cos(TAU * i / TURNS), w->sine[i] = (float)sin(TAU * i / TURNS);
    }
    w->fixed.end = 1;
    for (int k = 0; k < 3; k++) {
        w->fixed.centre[k] = (float)light->position[k];
        w->fixed.a[k] = (float)light->u[k], w->fixed.b[k] = (float)light->v[k];
    }
    if (light->type == SOFTSHADOW_RECT || light->type == SOFTSHADOW_SPHERE) return;
    const double *d = light->direction, length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (int k = 0; k < 3; k++) normal[k] = (float)(d[k] / length);
    axes(normal, w->fixed.a, w->fixed.b);
    if (light->type == SOFTSHADOW_SUN) {
        size = (float)tan(light->radius), w->fixed.end = INFINITY;
        for (int k = 0; k < 3; k++) w->fixed.centre[k] = -normal[k];
    }
    for (int k = 0; k < 3; k++) w->fixed.a[k] *= size, w->fixed.b[k] *= size;
}

static inline __attribute__((always_inline)) void see(const work *w, const float p[3], view *v) {
    *v = w->fixed;
    if (w->light->type != SOFTSHADOW_SUN)
        for (int k = 0; k < 3; k++) v->centre[k] -= p[k];
    if (w->light->type == SOFTSHADOW_RECT) return;
    float size = 1;
    if (w->light->type == SOFTSHADOW_SPHERE) {
        const float *c = v->centre, radius = (float)w->light->radius;
        const float square = c[0] * c[0] + c[1] * c[1] + c[2] * c[2], part = 1 / sqrtf(square);
        const float to[3] = {c[0] * part, c[1] * part, c[2] * part};
        v->end = 1 - radius * radius / square;
        size = radius / sqrtf(v->end);
        axes(to, v->a, v->b);
    }
    const uint32_t turn = hash(p, w->samples->seed) >> 22;
    const float c = size * w->cosine[turn], s = size * w->sine[turn];
    for (int k = 0; k < 3; k++) {
        const float a = v->a[k], b = v->b[k];
        v->a[k] = c * a + s * b, v->b[k] = c * b - s * a;
    }
}

typedef struct RTCRay16 packet;
typedef float floats __attribute__((vector_size(64)));
typedef int32_t ints __attribute__((vector_size(64)));

/* A macro: a function that returns a vector has one ABI with AVX-512 and another without. */
#define ALL_OF(x) ((floats){0} + (x))

static inline __attribute__((always_inline)) void begin(packet *ray, const float p[3]) {
    *(floats *)ray->org_x = ALL_OF(p[0]);
    *(floats *)ray->org_y = ALL_OF(p[1]);
    *(floats *)ray->org_z = ALL_OF(p[2]);
    *(floats *)ray->tnear = *(floats *)ray->time = ALL_OF(0);
    *(ints *)ray->mask = ~(ints){0};
    *(ints *)ray->id = *(ints *)ray->flags = (ints){0};
}

/* Adds one to each lane whose valid ray meets something. */
static inline __attribute__((always_inline)) void shoot(const work *w, packet *ray, const view *v,
                                                        const float *x, const float *y,
                                                        const ints *valid, ints *hidden) {
    const floats s = *(const floats *)x, t = *(const floats *)y;
    *(floats *)ray->dir_x = ALL_OF(v->centre[0]) + s * ALL_OF(v->a[0]) + t * ALL_OF(v->b[0]);
    *(floats *)ray->dir_y = ALL_OF(v->centre[1]) + s * ALL_OF(v->a[1]) + t * ALL_OF(v->b[1]);
    *(floats *)ray->dir_z = ALL_OF(v->centre[2]) + s * ALL_OF(v->a[2]) + t * ALL_OF(v->b[2]);
    *(floats *)ray->tfar = ALL_OF(v->end);
    rtc.Occluded16((const int *)valid, w->scene, w->context, ray);
    *hidden -= (*(floats *)ray->tfar < ALL_OF(0)) & *valid;
}

static inline __attribute__((always_inline)) uint32_t sum_of(const ints *lanes) {
    uint32_t sum = 0;
    for (int i = 0; i < PACKET; i++) sum += (uint32_t)(*lanes)[i];
    return sum;
}

static inline __attribute__((always_inline)) void answer(const work *w, const float (*points)[3],
                                                         size_t count, float *visibility) {
    const peer_samples *s = w->samples;
    const uint32_t last = s->padded - PACKET;
    _Alignas(64) packet ray;
    ints all = ~(ints){0}, tail;
    for (int i = 0; i < PACKET; i++) tail[i] = last + (uint32_t)i < s->style.samples ? -1 : 0;
    for (size_t q = 0; q < count; q++) {
        view v;
        see(w, points[q], &v);
        begin(&ray, points[q]);
        ints hidden = {0};
        if (s->style.rim) {
            shoot(w, &ray, &v, s->rim_x, s->rim_y, &all, &hidden);
            const uint32_t met = sum_of(&hidden);
            if (met == 0 || met == PACKET) {
                visibility[q] = met == 0;
                continue;
            }
            hidden = (ints){0};
        }
        for (uint32_t i = 0; i < last; i += PACKET)
            shoot(w, &ray, &v, s->x + i, s->y + i, &all, &hidden);
        shoot(w, &ray, &v, s->x + last, s->y + last, &tail, &hidden);
        visibility[q] = 1 - (float)sum_of(&hidden) / (float)s->style.samples;
    }
}

/* Four by four rays of a picture. */
static inline __attribute__((always_inline)) void picture(RTCScene scene, const peer_rays *rays,
                                                          float *out) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    _Alignas(64) struct RTCRayHit16 all = {0};
    float origin[3];
    ints valid = ~(ints){0};
    floats column, row;
    for (int k = 0; k < 3; k++) origin[k] = (float)rays->origin[k];
    for (int i = 0; i < PACKET; i++)
        column[i] = (float)(i % 4) + .5f, row[i] = (float)(i / 4) + .5f;
    const float per = 2 / (float)rays->side;
    begin(&all.ray, origin);
    for (uint32_t y = 0; y < rays->side; y += 4) {
        for (uint32_t x = 0; x < rays->side; x += 4) {
            const floats s = (column + (float)x) * per - 1, t = (row + (float)y) * per - 1;
            float *const to[3] = {all.ray.dir_x, all.ray.dir_y, all.ray.dir_z};
            for (int k = 0; k < 3; k++)
                *(floats *)to[k] = ALL_OF((float)rays->middle[k]) + s * ALL_OF((float)rays->x[k]) +
                                   t * ALL_OF((float)rays->y[k]);
            *(floats *)all.ray.tfar = ALL_OF(INFINITY);
            *(ints *)all.hit.geomID = ~(ints){0};
            rtc.Intersect16((const int *)&valid, scene, &context, &all);
            for (uint32_t i = 0; i < 4; i++)
                memcpy(out + (size_t)(y + i) * rays->side + x, all.ray.tfar + 4 * i,
                       4 * sizeof *out);
        }
    }
}

static void picture_plain(RTCScene scene, const peer_rays *rays, float *out) {
    picture(scene, rays, out);
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

__attribute__((target("avx512f,avx512bw,avx512dq,avx512vl,prefer-vector-width=512"))) static void
picture_avx512(RTCScene scene, const peer_rays *rays, float *out) {
    picture(scene, rays, out);
}

static void picture_best(RTCScene scene, const peer_rays *rays, float *out) {
    const unsigned saved = _mm_getcsr();
    _mm_setcsr(saved | FLUSH);
    if (__builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
        picture_avx512(scene, rays, out);
    else
        picture_plain(scene, rays, out);
    _mm_setcsr(saved);
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
static void picture_best(RTCScene scene, const peer_rays *rays, float *out) {
    picture_plain(scene, rays, out);
}

static void answer_best(const work *w, const float (*p)[3], size_t n, float *out) {
    answer_plain(w, p, n, out);
}
#endif

void peer_query(const peer *p, const softshadow_light *light, const peer_samples *samples,
                const float (*points)[3], size_t count, float *visibility) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    if (samples->style.coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    work w = {.light = light, .samples = samples, .scene = p->scene, .context = &context};
    prepare(&w);
    answer_best(&w, points, count, visibility);
}

void peer_depth(const peer *p, const peer_rays *rays, float *out) {
    picture_best(p->scene, rays, out);
}
