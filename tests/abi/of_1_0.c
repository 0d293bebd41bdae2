/* A program of 1.0, compiled against the header of that time (old/softshadow.h) and run with the
 * library of today: its structs, as small as they were then, are taken and filled. Each stands at
 * the very end of a page behind which nothing may be touched, so that a library which reads or
 * writes what was added later falls. */
#define _GNU_SOURCE /* MAP_ANONYMOUS */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "abi/require.h"
#include "softshadow.h"

#define OK(call) REQUIRE((call) == SOFTSHADOW_OK, "%s", softshadow_last_message(handle))
/* Fails with that status, and says why. */
#define REFUSED(status, call)                                                                      \
    REQUIRE((call) == (status) && *softshadow_last_message(handle), "%s",                          \
            softshadow_last_message(handle))

enum { POINTS = 64 };

/* size bytes before a page that is not there. */
static void *at_the_edge(const void *from, size_t size) {
    const size_t page = (size_t)sysconf(_SC_PAGESIZE);
    uint8_t *memory =
        mmap(NULL, 2 * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    REQUIRE(memory != MAP_FAILED && size <= page, "mmap");
    REQUIRE(mprotect(memory + page, page, PROT_NONE) == 0, "mprotect");
    return memcpy(memory + page - size, from, size);
}

#define EDGE(type, name, INIT)                                                                     \
    const type name##_zero = INIT;                                                                 \
    type *name = at_the_edge(&name##_zero, sizeof name##_zero)

static softshadow *make_handle(void) {
    softshadow *handle = NULL;
    EDGE(softshadow_options, options, SOFTSHADOW_OPTIONS_INIT);
    options->threads = 2;
    OK(softshadow_create(&handle, options));
    return handle;
}

static void add_scene(softshadow *handle) {
    static const float xyz[] = {-1, -1, 1, 1, -1, 1, 0, 1, 1};
    static const uint32_t indices[] = {0, 1, 2}, wrong[] = {0, 1, 3};
    uint32_t id = 7;
    EDGE(softshadow_mesh, mesh, SOFTSHADOW_MESH_INIT);
    mesh->positions = xyz, mesh->vertex_count = 3;
    mesh->indices = wrong, mesh->triangle_count = 1;
    REFUSED(SOFTSHADOW_E_MESH, softshadow_add_mesh(handle, mesh, &id));
    REQUIRE(id == UINT32_MAX, "%u", id);
    mesh->indices = indices, mesh->flags = SOFTSHADOW_CASTS;
    OK(softshadow_add_mesh(handle, mesh, &id));
    OK(softshadow_update_mesh(handle, id, mesh));
    EDGE(softshadow_light, light, SOFTSHADOW_LIGHT_INIT);
    light->type = SOFTSHADOW_SPHERE, light->position[2] = 4, light->radius = -1;
    REFUSED(SOFTSHADOW_E_LIGHT, softshadow_set_light(handle, light));
    light->radius = .5;
    OK(softshadow_set_light(handle, light));
    light->type = SOFTSHADOW_SUN, light->direction[2] = -1, light->radius = .1;
    OK(softshadow_add_light(handle, light, &id));
    REQUIRE(id == 1, "%u", id);
}

/* Points in a row below the triangle and beyond: from umbra to light. */
static void ask(softshadow *handle, float visibility[POINTS]) {
    static float xyz[POINTS][3], bound[POINTS];
    for (int i = 0; i < POINTS; i++) xyz[i][0] = (float)i / 16;
    EDGE(softshadow_points, points, SOFTSHADOW_POINTS_INIT);
    points->positions = xyz, points->count = POINTS;
    points->error_bound = bound;
    OK(softshadow_query_visibility(handle, points, visibility));
    EDGE(softshadow_error, error, SOFTSHADOW_ERROR_INIT);
    error->max_points = 8, error->samples = 64;
    OK(softshadow_measure_error(handle, points, error));
    REQUIRE(error->points == 8 && error->rms >= 0 && error->rms < .1, "%llu points, rms %g",
            (unsigned long long)error->points, error->rms);
}

static void build_and_ask(softshadow *handle, const char *method) {
    float visibility[POINTS];
    EDGE(softshadow_build, build, SOFTSHADOW_BUILD_INIT);
    build->method = "none";
    REFUSED(SOFTSHADOW_E_UNSUPPORTED, softshadow_build_maps(handle, build));
    build->method = method, build->resolution = 256, build->backend = SOFTSHADOW_CPU;
    OK(softshadow_build_maps(handle, build));
    ask(handle, visibility);
    REQUIRE(visibility[0] < .1f && visibility[POINTS - 1] > .9f, "%s: %g to %g", method,
            (double)visibility[0], (double)visibility[POINTS - 1]);
    EDGE(softshadow_stats, stats, SOFTSHADOW_STATS_INIT);
    OK(softshadow_get_stats(handle, stats));
    REQUIRE(stats->points == POINTS && strcmp(stats->backend_used, "cpu") == 0, "%llu points on %s",
            (unsigned long long)stats->points, stats->backend_used);
}

static void look(softshadow *handle) {
    uint32_t count = 0;
    OK(softshadow_map_count(handle, &count));
    for (uint32_t i = 0; i < count; i++) {
        EDGE(softshadow_map, map, SOFTSHADOW_MAP_INIT);
        OK(softshadow_get_map(handle, i, map));
        REQUIRE(map->width && map->height && map->pixels, "map %u", i);
    }
    REQUIRE(count > 0, "no maps");
    EDGE(softshadow_mesh_report, report, SOFTSHADOW_MESH_REPORT_INIT);
    OK(softshadow_mesh_info(handle, 0, report));
    REQUIRE(report->triangles == 1 && report->boundary_edges == 3 && report->bounds[5] == 1,
            "%llu triangles", (unsigned long long)report->triangles);
    uint64_t hider[64];
    EDGE(softshadow_explanation, explanation, SOFTSHADOW_EXPLANATION_INIT);
    explanation->size = 8, explanation->hider = hider;
    OK(softshadow_explain(handle, explanation));
    REQUIRE(explanation->triangles == 1 && explanation->visibility == 0, "V %g",
            (double)explanation->visibility);
}

static void ask_the_library(void) {
    softshadow *handle = NULL;
    uint32_t count = 0;
    REQUIRE(softshadow_version() / 10000 == 1, "%s", softshadow_version_string());
    OK(softshadow_method_count(&count));
    for (uint32_t i = 0; i < count; i++) {
        EDGE(softshadow_method, method, SOFTSHADOW_METHOD_INIT);
        OK(softshadow_method_info(i, method));
        REQUIRE(method->name && method->notes && method->struct_size == sizeof *method, "%u", i);
    }
    EDGE(softshadow_backend, backend, SOFTSHADOW_BACKEND_INIT);
    OK(softshadow_backend_info(SOFTSHADOW_CPU, backend));
    REQUIRE(backend->status == SOFTSHADOW_OK && strcmp(backend->name, "cpu") == 0, "backend");
}

int main(void) {
    ask_the_library();
    softshadow *handle = make_handle();
    add_scene(handle);
    EDGE(softshadow_points, none, SOFTSHADOW_POINTS_INIT);
    REFUSED(SOFTSHADOW_E_STATE, softshadow_query_visibility(handle, none, NULL));
    build_and_ask(handle, "auto");
    build_and_ask(handle, "penumbra-map");
    look(handle);
    OK(softshadow_remove_mesh(handle, 0));
    softshadow_destroy(handle);
    puts("a program of 1.0 runs");
    return 0;
}
