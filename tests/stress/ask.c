#include <fenv.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#include "stress/stress.h"

uint32_t stress_method_count(void) {
    uint32_t count = 0;
    softshadow_method_count(&count);
    return count;
}

softshadow_method stress_method(uint32_t index) {
    softshadow_method method = SOFTSHADOW_METHOD_INIT;
    softshadow_method_info(index, &method);
    return method;
}

static float *to_floats(const double *from, size_t count) {
    float *to = malloc((count ? count : 1) * sizeof *to);
    if (!to) abort();
    for (size_t i = 0; i < count; i++) to[i] = (float)from[i];
    return to;
}

static softshadow_status put(softshadow *handle, const char *method, const stress_case *one,
                             const float *vertices) {
    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    softshadow_build build = SOFTSHADOW_BUILD_INIT;
    mesh.position_type = one->single ? SOFTSHADOW_F32 : SOFTSHADOW_F64;
    mesh.positions = one->single ? (const void *)vertices : one->mesh.xyz;
    mesh.vertex_count = one->mesh.vertices;
    mesh.indices = one->mesh.indices, mesh.triangle_count = one->mesh.triangles;
    build.method = method;
    build.resolution = 256; /* what is looked for here does not hang on fine maps */
    softshadow_status status = SOFTSHADOW_OK;
    if (mesh.vertex_count) status = softshadow_add_mesh(handle, &mesh, NULL);
    if (!status) status = softshadow_set_light(handle, &one->light);
    return status ? status : softshadow_build_maps(handle, &build);
}

static void set_mode(stress_mode mode) {
    static const int rounding[] = {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO};
    if (mode < STRESS_FLUSHED) fesetround(rounding[mode]);
#if defined(__x86_64__)
    if (mode == STRESS_FLUSHED) _mm_setcsr(_mm_getcsr() | 0x8040u);
#endif
}

softshadow_status stress_ask(const char *method, const stress_case *one, float *visibility,
                             float *bound, stress_mode mode) {
    softshadow *handle;
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    float *vertices = to_floats(one->mesh.xyz, 3 * one->mesh.vertices);
    float *positions = to_floats(one->points[0], 3 * one->count);
    fenv_t usual;
    fegetenv(&usual);
    set_mode(mode);
    softshadow_status status = softshadow_create(&handle, NULL);
    if (!status) status = put(handle, method, one, vertices);
    points.position_type = one->single ? SOFTSHADOW_F32 : SOFTSHADOW_F64;
    points.positions = one->single ? (const void *)positions : one->points;
    points.count = one->count, points.primitives = one->primitives, points.error_bound = bound;
    if (!status) status = softshadow_query_visibility(handle, &points, visibility);
    if (status && status != SOFTSHADOW_E_UNSUPPORTED) {
        fprintf(stderr, "%s, %s %s: %s\n", method, one->sweep, one->cell,
                softshadow_last_message(handle));
    }
    softshadow_destroy(handle);
    fesetenv(&usual);
    free(vertices), free(positions);
    return status;
}
