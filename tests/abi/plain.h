/* For the programs of this folder that are hosts of their own kind and use no test framework: one
 * check that says where, one small scene that every method can answer. */
#ifndef TESTS_ABI_PLAIN_H
#define TESTS_ABI_PLAIN_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "abi/require.h"
#include "softshadow.h"

enum { PLAIN_SKIP = 77, PLAIN_POINTS = 1024 };

/* The library's functions, linked or looked up by hand. */
typedef struct plain_api {
    softshadow_status (*create)(softshadow **, const softshadow_options *);
    softshadow_status (*add_mesh)(softshadow *, const softshadow_mesh *, uint32_t *);
    softshadow_status (*set_light)(softshadow *, const softshadow_light *);
    softshadow_status (*build_maps)(softshadow *, const softshadow_build *);
    softshadow_status (*query_visibility)(softshadow *, const softshadow_points *, float *);
    softshadow_status (*method_count)(uint32_t *);
    softshadow_status (*method_info)(uint32_t, softshadow_method *);
    const char *(*last_message)(const softshadow *);
    void (*destroy)(softshadow *);
} plain_api;

#define PLAIN_LINKED                                                                               \
    {                                                                                              \
        softshadow_create, softshadow_add_mesh, softshadow_set_light, softshadow_build_maps,       \
            softshadow_query_visibility, softshadow_method_count, softshadow_method_info,          \
            softshadow_last_message, softshadow_destroy                                            \
    }

/* A tilted plate and a needle over a grid of points; fractions that are no round decimals. */
static inline softshadow_status plain_scene(const plain_api *api, softshadow **handle,
                                            const softshadow_options *options) {
    static const float xyz[] = {-1.1f, -0.9f, 1.3f, 1.2f, -0.7f, 1.9f, 0.1f, 1.3f,
                                2.3f,  0.3f,  0.4f, 2.7f, 1.7f,  0.5f, 1.1f};
    static const uint32_t indices[] = {0, 1, 2, 2, 3, 4, 0, 2, 4};
    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    mesh.positions = xyz, mesh.vertex_count = 5;
    mesh.indices = indices, mesh.triangle_count = 3;
    softshadow_light light = SOFTSHADOW_LIGHT_INIT;
    light.position[0] = 0.3, light.position[2] = 5.7;
    light.radius = 1.1;
    softshadow_status status = api->create(handle, options);
    if (!status) status = api->add_mesh(*handle, &mesh, NULL);
    return status ? status : api->set_light(*handle, &light);
}

static inline softshadow_status plain_ask(const plain_api *api, softshadow *handle,
                                          const char *method, float *visibility) {
    static float points[PLAIN_POINTS][3];
    for (int i = 0; i < PLAIN_POINTS; i++) {
        points[i][0] = (float)(i % 32) / 8 - 2, points[i][1] = (float)(i / 32) / 8 - 2;
    }
    softshadow_build build = SOFTSHADOW_BUILD_INIT;
    build.method = method, build.samples = 256;
    const softshadow_status status = api->build_maps(handle, &build);
    if (status) return status;
    softshadow_points batch = SOFTSHADOW_POINTS_INIT;
    batch.positions = points, batch.count = PLAIN_POINTS;
    return api->query_visibility(handle, &batch, visibility);
}

/* Everything, from nothing to nothing. */
static inline void plain_run(const plain_api *api, const char *method, float *visibility) {
    softshadow *handle = NULL;
    softshadow_status status = plain_scene(api, &handle, NULL);
    if (!status) status = plain_ask(api, handle, method, visibility);
    REQUIRE(status == SOFTSHADOW_OK, "%s: %d: %s", method, (int)status, api->last_message(handle));
    api->destroy(handle);
}

/* A picture that shows something: lit, dark and, where the method has penumbrae, half. */
static inline void plain_plausible(const float *v, const char *method) {
    int lit = 0, dark = 0, half = 0;
    for (int i = 0; i < PLAIN_POINTS; i++) {
        REQUIRE(v[i] >= 0 && v[i] <= 1, "%s: point %d: %g", method, i, (double)v[i]);
        lit += v[i] == 1, dark += v[i]<0.5f, half += v[i]> 0 && v[i] < 1;
    }
    const int hard = strcmp(method, "hard") == 0 || strcmp(method, "pcf") == 0;
    REQUIRE(lit > 100 && dark > 20 && (hard || half > 100), "%s: %d lit, %d dark, %d in penumbra",
            method, lit, dark, half);
}

/* The names of all methods, "auto" among them. Returns how many. */
static inline unsigned plain_methods(const plain_api *api, const char *names[64]) {
    uint32_t n = 0;
    int has_auto = 0;
    REQUIRE(api->method_count(&n) == SOFTSHADOW_OK && n < 64, "method_count: %u", n);
    for (uint32_t i = 0; i < n; i++) {
        softshadow_method method = SOFTSHADOW_METHOD_INIT;
        REQUIRE(api->method_info(i, &method) == SOFTSHADOW_OK, "method %u", i);
        names[i] = method.name;
        has_auto |= strcmp(method.name, "auto") == 0;
    }
    if (!has_auto) names[n++] = "auto";
    return n;
}

static inline int plain_sanitized(const char *why) {
    const char *sanitizers = getenv("SANITIZERS");
    if (!sanitizers || !*sanitizers) return 0;
    fprintf(stderr, "SKIPPED under -fsanitize=%s: %s\n", sanitizers, why);
    return 1;
}

#endif
