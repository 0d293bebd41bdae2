/* softshadow bench --backend egl: each method that runs on the GPU, built and asked there and on
 * the CPU. Wall times, medians; geometry is ready, so that a build is its maps. */
#include "backends.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../output.h"
#include "clock.h"
#include "report.h"
#include <softshadow.h>

enum { MOST_REPEATS = 31 };

/* One method on one backend, in seconds. */
typedef struct timing {
    double build, build_copies, query, query_copies;
} timing;

typedef struct duel {
    const bench_cell *cell;
    const bench_options *options;
    softshadow *handle;
    float *answers[2]; /* the CPU's, the GPU's */
    cli_error *error;
} duel;

static int by_size(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, uint32_t count) {
    qsort(values, count, sizeof *values, by_size);
    return values[count / 2];
}

static bool fails(duel *d, const char *method) {
    return cli_fail(d->error, CLI_FAILED, "%s: %s: %s", d->cell->scene->name, method,
                    softshadow_last_message(d->handle));
}

static bool open_scene(duel *d) {
    const peer_mesh *mesh = &d->cell->scene->mesh;
    softshadow_options options = SOFTSHADOW_OPTIONS_INIT;
    softshadow_mesh given = SOFTSHADOW_MESH_INIT;
    options.threads = d->options->threads;
    given.flags = SOFTSHADOW_BORROW;
    given.positions = mesh->positions, given.vertex_count = mesh->vertex_count;
    given.indices = mesh->indices, given.triangle_count = mesh->triangle_count;
    if (softshadow_create(&d->handle, &options) != SOFTSHADOW_OK)
        return cli_fail(d->error, CLI_FAILED, "%s", softshadow_last_message(NULL));
    return softshadow_add_mesh(d->handle, &given, NULL) == SOFTSHADOW_OK || fails(d, "mesh");
}

static double copies(const duel *d) {
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    softshadow_get_stats(d->handle, &stats);
    return stats.upload_seconds + stats.download_seconds;
}

/* The light is put anew, so that the maps are stale. */
static bool turn(duel *d, const char *method, uint32_t backend, timing *out) {
    softshadow_build build = SOFTSHADOW_BUILD_INIT;
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    build.method = method, build.backend = backend;
    points.positions = d->cell->points.at, points.count = d->cell->points.count;
    if (softshadow_set_light(d->handle, &d->cell->light) != SOFTSHADOW_OK) return fails(d, "light");
    double start = bench_wall();
    if (softshadow_build_maps(d->handle, &build) != SOFTSHADOW_OK) return fails(d, method);
    out->build = bench_wall() - start, out->build_copies = copies(d);
    start = bench_wall();
    if (softshadow_query_visibility(d->handle, &points, d->answers[backend]) != SOFTSHADOW_OK)
        return fails(d, method);
    out->query = bench_wall() - start, out->query_copies = copies(d) - out->build_copies;
    return true;
}

/* After one that is not counted: it makes the context, compiles, and prepares the geometry. */
static bool time_method(duel *d, const char *method, uint32_t backend, timing *out) {
    double values[4][MOST_REPEATS];
    timing t;
    if (!turn(d, method, backend, &t)) return false;
    for (uint32_t i = 0; i < d->options->repeat; i++) {
        if (!turn(d, method, backend, &t)) return false;
        values[0][i] = t.build, values[1][i] = t.build_copies;
        values[2][i] = t.query, values[3][i] = t.query_copies;
    }
    for (int k = 0; k < 4; k++) (&out->build)[k] = median(values[k], d->options->repeat);
    return true;
}

static void print_row(const duel *d, const char *method, const timing t[2], cli_text *times,
                      const char *device) {
    const size_t n = d->cell->points.count;
    const double per_million = 1e9 / (double)n; /* to milliseconds */
    double sum = 0, max = 0;
    for (size_t i = 0; i < n; i++) {
        const double by = fabs((double)d->answers[0][i] - d->answers[1][i]);
        sum += by * by, max = fmax(max, by);
    }
    const double rms = sqrt(sum / (double)n), numbers[] = {1e3 * t[0].build,
                                                           1e3 * t[1].build,
                                                           1e3 * t[1].build_copies,
                                                           per_million * t[0].query,
                                                           per_million * t[1].query,
                                                           per_million * t[1].query_copies,
                                                           rms,
                                                           max};
    printf("%-16s %9.1f %9.1f %8.1f   %9.1f %9.1f %8.1f   %.5f %.5f\n", method, numbers[0],
           numbers[1], numbers[2], numbers[3], numbers[4], numbers[5], rms, max);
    fflush(stdout);
    cli_text_printf(times, "%s,%s,%s,%s,%zu,%s", device, d->cell->scene->name, d->cell->light_name,
                    d->cell->points_name, n, method);
    for (int k = 0; k < 8; k++) cli_text_printf(times, ",%.6g", numbers[k]);
    cli_text_printf(times, "\n");
}

static bool all_methods(duel *d, const char *device, cli_text *times) {
    uint32_t count = 0;
    softshadow_method_count(&count);
    for (uint32_t i = 0; i < count; i++) {
        softshadow_method method = SOFTSHADOW_METHOD_INIT;
        timing t[2];
        softshadow_method_info(i, &method);
        if (!(method.backends & 1u << SOFTSHADOW_EGL)) continue;
        if (!time_method(d, method.name, SOFTSHADOW_CPU, &t[0])) return false;
        if (!time_method(d, method.name, SOFTSHADOW_EGL, &t[1])) return false;
        print_row(d, method.name, t, times, device);
    }
    return true;
}

/* The device's name without commas. */
static bool find_device(char name[128], cli_error *error) {
    softshadow_backend info = SOFTSHADOW_BACKEND_INIT;
    if (softshadow_backend_info(SOFTSHADOW_EGL, &info) != SOFTSHADOW_OK ||
        info.status != SOFTSHADOW_OK)
        return cli_fail(error, CLI_FAILED, "--backend egl: %s", info.why ? info.why : "not here");
    snprintf(name, 128, "%s", info.device);
    for (char *at = name; *at; at++) *at = *at == ',' ? ';' : *at;
    return true;
}

bool bench_backends(const bench_cell *cell, const bench_options *options, const char *path,
                    cli_text *times, cli_error *error) {
    duel d = {.cell = cell, .options = options, .error = error};
    char device[128];
    if (!find_device(device, error)) return false;
    for (int i = 0; i < 2; i++) d.answers[i] = malloc(cell->points.count * sizeof(float));
    if (times->length == 0)
        cli_text_printf(times, "device,scene,light,points,count,method,build_cpu_ms,build_egl_ms,"
                               "build_copies_ms,query_cpu_ms_per_million,query_egl_ms_per_million,"
                               "query_copies_ms_per_million,rms,max\n");
    printf("%s, %s light, %zu points; egl: %s\n"
           "                 maps, ms: cpu   egl  (copies)   1e6 points, ms: cpu   egl (copies)   "
           "rms     max\n",
           cell->scene->name, cell->light_name, cell->points.count, device);
    bool fine = d.answers[0] && d.answers[1] ? open_scene(&d)
                                             : cli_fail(error, CLI_FAILED, "memory ran out");
    fine = fine && all_methods(&d, device, times) && (!path || report_save(times, path, error));
    softshadow_destroy(d.handle);
    for (int i = 0; i < 2; i++) free(d.answers[i]);
    return fine;
}
