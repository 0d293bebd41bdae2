/* softshadow bench --maps: how wrong each map method is, and what it takes. */
#include "maps.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../output.h"
#include "clock.h"
#include "report.h"

enum { LEAST_SIDE = 256, MOST_SIDE = 4096, MOST_REPEATS = 31 };
/* A method that takes longer for the points is not asked for larger maps. */
#define PATIENCE 2.0

typedef struct way {
    const char *method;
    bool propagate, exact;
} way;

typedef struct mapping {
    const bench_cell *cell;
    const bench_options *options;
    bench_truth truth;
    double bounds[6];
    softshadow *handle;
    float *answer;
    cli_text *csv;
    cli_error *error;
} mapping;

static bool fails(mapping *m, const char *method) {
    return cli_fail(m->error, CLI_FAILED, "%s: %s: %s", m->cell->scene->name, method,
                    softshadow_last_message(m->handle));
}

/* The median of a few times a point; of all of them the first if that one is long. */
static bool ask(mapping *m, const float *at, size_t count, float *answer, double *seconds) {
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    double times[MOST_REPEATS];
    uint32_t done = 0;
    points.positions = at, points.count = count;
    do {
        const double start = bench_clock();
        if (softshadow_query_visibility(m->handle, &points, answer) != SOFTSHADOW_OK)
            return fails(m, "query");
        times[done++] = bench_clock() - start;
    } while (done < 5 && times[0] < PATIENCE / 10);
    *seconds = bench_median(times, done) / (double)count;
    return true;
}

/* Neighbours share work under exact: its time is that of all the camera's points, not of the few
 * far apart whose errors are measured. */
static bool ask_all(mapping *m, double *seconds) {
    const bench_points *all = &m->cell->points;
    float *answer = malloc(all->count * sizeof *answer);
    if (!answer) return cli_fail(m->error, CLI_FAILED, "memory ran out");
    const bool fine = ask(m, (const float *)all->at, all->count, answer, seconds);
    free(answer);
    return fine;
}

static void tell(mapping *m, const char *name, uint32_t side, double build, double each) {
    double square = 0, sum = 0, most = 0;
    size_t within = 0;
    const size_t n = m->truth.count;
    for (size_t i = 0; i < n; i++) {
        const double d = (double)m->answer[i] - m->truth.value[i];
        square += d * d, sum += d, most = fmax(most, fabs(d)), within += fabs(d) <= 1.0 / 64;
    }
    const double rms = sqrt(square / (double)n), bias = sum / (double)n;
    const double share = 100 * (double)within / (double)n, ns = 1e9 * each;
    char size[16] = "";
    if (side) snprintf(size, sizeof size, "%u", side);
    printf("  %-26s %5s  %.4f  %.3f  %+.4f  %5.1f %%  %10.0f  %8.1f\n", name, size, rms, most, bias,
           share, ns, 1e3 * build);
    cli_text_printf(m->csv, "%s,%s,%.3f,%s,%s,%.5f,%.4f,%.5f,%.2f,%.1f,%.2f\n",
                    m->cell->scene->name, m->cell->light_name,
                    (double)m->truth.penumbrae / (double)n, name, size, rms, most, bias, share, ns,
                    1e3 * build);
}

/* One method at one size; *go_on false: larger ones would take too long, or it cannot do this. */
static bool one_size(mapping *m, const way *w, uint32_t side, bool *go_on) {
    softshadow_build build = SOFTSHADOW_BUILD_INIT;
    char name[48];
    double each = 0;
    snprintf(name, sizeof name, "%s%s", w->method, w->propagate ? " (propagated)" : "");
    build.method = w->method, build.resolution = side, build.propagate = w->propagate;
    build.bounds = m->bounds;
    const softshadow_status light = softshadow_set_light(m->handle, &m->cell->light);
    const double start = bench_clock();
    const softshadow_status status = light ? light : softshadow_build_maps(m->handle, &build);
    const double took = bench_clock() - start;
    *go_on = false;
    if (status == SOFTSHADOW_E_UNSUPPORTED) return true;
    if (status != SOFTSHADOW_OK) return fails(m, name);
    if (!ask(m, (const float *)m->truth.at, m->truth.count, m->answer, &each)) return false;
    if (w->exact && !ask_all(m, &each)) return false;
    tell(m, name, side, took, each);
    *go_on = each * (double)m->truth.count < PATIENCE && took < 2 * PATIENCE;
    fflush(stdout);
    return true;
}

static bool one_way(mapping *m, const way *w) {
    bool go_on = true;
    if (w->exact) return one_size(m, w, 0, &go_on);
    for (uint32_t side = LEAST_SIDE; go_on && side <= MOST_SIDE; side *= 2)
        if (!one_size(m, w, side, &go_on)) return false;
    return true;
}

/* What has no bound works from maps. */
static bool all_ways(mapping *m) {
    uint32_t count = 0;
    softshadow_method_count(&count);
    for (uint32_t i = 0; i < count; i++) {
        softshadow_method method = SOFTSHADOW_METHOD_INIT;
        if (softshadow_method_info(i, &method) != SOFTSHADOW_OK) continue;
        const bool exact = strcmp(method.name, "exact") == 0;
        if (!exact && method.bound_kind != SOFTSHADOW_BOUND_NONE) continue;
        for (int propagate = 0; propagate < 2; propagate++) {
            const way w = {method.name, propagate, exact};
            if (propagate && strcmp(method.name, "penumbra-limit") != 0) continue;
            if (!one_way(m, &w)) return false;
        }
    }
    return true;
}

/* What depends on the meshes only is built before anything is timed. */
static bool warm_up(mapping *m) {
    softshadow_build build = SOFTSHADOW_BUILD_INIT;
    build.method = "penumbra-limit", build.resolution = 16;
    return softshadow_build_maps(m->handle, &build) == SOFTSHADOW_OK || fails(m, build.method);
}

bool bench_maps(const bench_cell *cell, const bench_options *options, const char *path,
                cli_text *csv, cli_error *error) {
    mapping m = {.cell = cell, .options = options, .csv = csv, .error = error};
    bench_points_box(&cell->points, m.bounds);
    bool fine = bench_truth_find(&m.truth, cell, options, error);
    m.answer = fine ? malloc(m.truth.count * sizeof *m.answer) : NULL;
    if (fine && !m.answer) fine = cli_fail(error, CLI_FAILED, "memory ran out");
    fine = fine && bench_open(cell, options->threads, &m.handle, error);
    if (fine)
        printf("\n%s: %zu triangles, %s light, %.1f %% of %zu points in penumbra\n"
               "  %-26s %5s  %-6s  %-5s  %-7s  in 1/64  %10s  %8s\n",
               cell->scene->name, cell->scene->mesh.triangle_count, cell->light_name,
               100 * (double)m.truth.penumbrae / (double)m.truth.count, m.truth.count, "method",
               "map", "rms", "max", "bias", "ns a point", "build ms");
    if (!csv->length)
        cli_text_printf(csv,
                        "scene,light,penumbra,method,resolution,rms,max,bias,within,ns_a_point,"
                        "build_ms\n");
    fine = fine && warm_up(&m) && all_ways(&m) && (!path || report_save(csv, path, error));
    bench_truth_free(&m.truth);
    softshadow_destroy(m.handle);
    free(m.answer);
    return fine;
}
