/* digest [few]: what every method answers, as one line of text a question: two builds of the
 * library that give the same bits give the same lines. bits.sh runs this one program with
 * differently built libraries; which one it got is its first line, on stderr. */
#define _GNU_SOURCE /* dladdr */
#include <dlfcn.h>
#include <math.h>
#include <stdbool.h>

#include "abi/plain.h"
#include "scenes.h"

enum { SIDE = 12, GROUND = SIDE * SIDE, ON = 84, N = GROUND + ON, LIGHTS = 6, PROFILE = 5 };

typedef struct place {
    const char *name;
    scene_mesh mesh;
    double points[N][3];
    float normals[N][3];
    uint64_t primitives[N];
} place;

static bool few; /* some of the questions only: for builds without optimisation */

static uint64_t mix(uint64_t hash, const void *data, size_t size) {
    const uint8_t *bytes = data;
    for (size_t i = 0; i < size; i++) hash = (hash ^ bytes[i]) * 0x100000001b3;
    return hash;
}
#define START 0xcbf29ce484222325u

static uint64_t mix_floats(const float *values, size_t count) {
    uint64_t hash = START;
    for (size_t i = 0; i < count; i++) { /* NaN is NaN, whatever its bits */
        const float value = isnan(values[i]) ? (float)NAN : values[i];
        hash = mix(hash, &value, sizeof value);
    }
    return hash;
}

/* ---- What is asked ---------------------------------------------------------------------- */

/* Points on the ground and on casters, with normals that are their own. */
static void add_points(place *p, double half) {
    uint64_t random = 17;
    scene_grid(p->points, SIDE, -half, half, -half, half, 0);
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < 3; k++) p->normals[i][k] = k == 2 ? 1 : (float)(i % (k + 3)) / 8;
        p->primitives[i] = SOFTSHADOW_NO_PRIMITIVE;
        if (i < GROUND) continue;
        const uint64_t t = scene_random(&random) % p->mesh.triangles;
        const double u = scene_uniform(&random, 0, .5), v = scene_uniform(&random, 0, .5);
        const uint32_t *index = p->mesh.indices + 3 * t;
        for (int k = 0; k < 3; k++) {
            const double *x = p->mesh.xyz + k;
            p->points[i][k] =
                (1 - u - v) * x[3 * index[0]] + u * x[3 * index[1]] + v * x[3 * index[2]];
        }
        p->primitives[i] = t;
    }
}

/* Garbage and solids; leaves, far from the origin; a dense ball, of which levels are made. */
static place *make_place(int which) {
    place *p = calloc(1, sizeof *p);
    if (!p) abort();
    if (which == 0) {
        p->name = "solids";
        scene_garbage(&p->mesh, 31);
        scene_box(&p->mesh, (const double[3]){-1, -1, 1}, (const double[3]){.5, .25, 2});
        scene_icosphere(&p->mesh, (const double[3]){.4, .3, 2.5}, .6, 2, .1);
    } else if (which == 1) {
        p->name = "leaves";
        scene_leaves(&p->mesh, 150, 5);
    } else {
        p->name = "dense";
        scene_icosphere(&p->mesh, (const double[3]){.1, -.05, 1.2}, .9, 5, .12);
    }
    add_points(p, 2);
    for (int i = 0; which == 1 && i < N; i++) p->points[i][0] += 1e5, p->points[i][1] -= 3e4;
    for (size_t i = 0; which == 1 && i < p->mesh.vertices; i++) {
        p->mesh.xyz[3 * i] += 1e5, p->mesh.xyz[3 * i + 1] -= 3e4;
    }
    return p;
}

static softshadow_light make_light(const place *p, int which) {
    static const float profile[PROFILE] = {1, .9f, .8f, .5f, .3f};
    const bool far = strcmp(p->name, "leaves") == 0;
    const double x = (far ? 1e5 : 0) + .3, y = (far ? -3e4 : 0) + .6;
    softshadow_light light = which == 0   ? scene_sphere_light(x, y, 8, 1.25)
                             : which == 1 ? scene_disk_light(x, y, 8, .125, .25, -1, 1.25)
                             : which == 2 ? scene_rect_light(x, y, 8, 1.5, 1)
                             : which == 3 ? scene_sun_light(.125, .06, -1, .15)
                             : which == 4 ? scene_sphere_light(x, y, 8, 1.5)
                                          : scene_disk_light(x, y, 8, 0, 0, 0, 0);
    if (which == 4) light.profile = profile, light.profile_count = PROFILE;
    if (which == 5) light.u[0] = 1.4, light.u[1] = .2, light.v[0] = -.1, light.v[1] = .7;
    return light;
}

/* ---- Answers as lines ------------------------------------------------------------------- */

static void print_query(softshadow *handle, const place *p, const char *label) {
    static float visibility[N], bound[N];
    for (int batch = 0; batch < (few ? 1 : 2); batch++) { /* from primitives; on an image's rows */
        softshadow_points points = SOFTSHADOW_POINTS_INIT;
        points.position_type = SOFTSHADOW_F64, points.positions = p->points, points.count = N;
        points.normals = (const float *)p->normals, points.error_bound = bound;
        if (batch == 0)
            points.primitives = p->primitives;
        else
            points.width = SIDE;
        const softshadow_status status = softshadow_query_visibility(handle, &points, visibility);
        printf("%s, batch %d: %s %016llx, bounds %016llx\n", label, batch,
               softshadow_status_name(status), (unsigned long long)mix_floats(visibility, N),
               (unsigned long long)mix_floats(bound, N));
    }
}

static void print_maps(softshadow *handle, const char *label) {
    uint32_t count = 0;
    softshadow_map_count(handle, &count);
    for (uint32_t i = 0; i < count; i++) {
        softshadow_map map = SOFTSHADOW_MAP_INIT;
        if (softshadow_get_map(handle, i, &map) != SOFTSHADOW_OK) continue;
        const size_t size = (size_t)map.width * map.height * map.channels;
        printf("%s, map %u %s: %016llx %016llx\n", label, i, map.name,
               (unsigned long long)mix_floats(map.pixels, size),
               (unsigned long long)mix(START, map.matrix, sizeof map.matrix));
    }
}

static void print_build(softshadow *handle, const place *p, const softshadow_build *build,
                        const char *label) {
    const softshadow_status status = softshadow_build_maps(handle, build);
    if (status) {
        printf("%s: %s\n", label, softshadow_status_name(status));
        return;
    }
    print_query(handle, p, label);
    print_maps(handle, label);
}

/* A method on one light, in all that changes what is computed; on further lights in some of it. */
static void print_method(softshadow *handle, const place *p, const char *method,
                         const char *light) {
    static const char *const ways[] = {"plain", "solid angle", "irradiance", "fine",
                                       "paper", "propagated",  "profile"};
    const bool first = strcmp(light, "sphere") == 0;
    for (int way = 0; way < (first ? 7 : 3); way++) {
        char label[128];
        softshadow_build build = SOFTSHADOW_BUILD_INIT;
        if (few && way != 0 && way != 2 && way != 5) continue;
        build.method = method, build.resolution = 96, build.seed = 3;
        build.points_ahead = 1 << 20, build.tolerance = 1.0 / 32;
        if (way == 1) build.weighting = SOFTSHADOW_SOLID_ANGLE;
        if (way == 2) build.weighting = SOFTSHADOW_IRRADIANCE;
        if (way == 3) build.samples = 1000, build.blur = 3, build.max_samples = 40;
        if (way == 4) build.falloff = SOFTSHADOW_FALLOFF_PAPER;
        if (way == 5) build.propagate = 1, build.falloff = SOFTSHADOW_FALLOFF_LINEAR;
        if (way == 6) build.falloff = SOFTSHADOW_FALLOFF_PROFILE;
        snprintf(label, sizeof label, "%s, %s, %s, %s", p->name, light, method, ways[way]);
        print_build(handle, p, &build, label);
    }
}

static void print_report(softshadow *handle, const place *p) {
    softshadow_mesh_report report = SOFTSHADOW_MESH_REPORT_INIT;
    softshadow_explanation e = SOFTSHADOW_EXPLANATION_INIT;
    static float image[48 * 48];
    static uint64_t hider[48 * 48];
    memcpy(e.point, p->points[GROUND / 2 + SIDE / 2], sizeof e.point);
    e.size = 48, e.image = image, e.hider = hider;
    const softshadow_status status = softshadow_explain(handle, &e);
    softshadow_mesh_info(handle, 0, &report);
    printf("%s, explained: %s %016llx %016llx\n", p->name, softshadow_status_name(status),
           (unsigned long long)mix_floats(image, 48 * 48),
           (unsigned long long)mix(START, hider, sizeof hider));
    printf("%s, report: %016llx\n", p->name,
           (unsigned long long)mix(START, &report.vertices, sizeof report - 8));
}

static void print_place(int which) {
    static const char *const lights[LIGHTS] = {"sphere", "disk",    "rect",
                                               "sun",    "profile", "ellipse"};
    place *p = make_place(which);
    static const plain_api api = PLAIN_LINKED;
    const char *names[64];
    const unsigned methods = plain_methods(&api, names);
    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    mesh.position_type = SOFTSHADOW_F64;
    mesh.positions = p->mesh.xyz, mesh.vertex_count = p->mesh.vertices;
    mesh.indices = p->mesh.indices, mesh.triangle_count = p->mesh.triangles;
    for (int l = 0; l < (which == 2 || few ? 1 : LIGHTS); l++) {
        softshadow *handle = NULL;
        const softshadow_light light = make_light(p, l);
        REQUIRE(softshadow_create(&handle, NULL) == SOFTSHADOW_OK, "create");
        REQUIRE(softshadow_add_mesh(handle, &mesh, NULL) == SOFTSHADOW_OK, "%s",
                softshadow_last_message(handle));
        REQUIRE(softshadow_set_light(handle, &light) == SOFTSHADOW_OK, "%s",
                softshadow_last_message(handle));
        for (unsigned m = 0; m < methods; m++) print_method(handle, p, names[m], lights[l]);
        if (l == 0) print_report(handle, p);
        softshadow_destroy(handle);
    }
    scene_free(&p->mesh);
    free(p);
}

int main(int argc, char **argv) {
    Dl_info info;
    few = argc > 1 && strcmp(argv[1], "few") == 0;
    if (!dladdr((void *)(uintptr_t)softshadow_create, &info)) return 1;
    fprintf(stderr, "%s\n", info.dli_fname);
    for (int which = 0; which < 3; which++) print_place(which);
    return fflush(stdout) ? 1 : 0;
}
