/* softshadow bench --sweep: how time and error grow with one thing, all else as it is: every method
 * at its usual setting. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "matrix.h"

enum { LEAST_OF = 7 }; /* wall times, of which the least counts */

typedef struct sweep {
    const bench_scene *scene;
    bench_options options;
    matrix_request wanted;
    rows *rows;
    matrix_cell *out;
    cli_error *error;
} sweep;

static bool measure(sweep *s, bench_cell *cell, const char *name, double value) {
    s->out->sweep = name, s->out->value = value;
    return matrix_measure(s->out, cell, &s->options, &s->wanted, s->error) &&
           rows_add(s->rows, s->out, s->error);
}

/* What the camera sees under the medium light, for all that is not swept. */
static bool start(sweep *s, bench_cell *cell, const bench_scene *scene, uint32_t side) {
    *cell = (bench_cell){.scene = scene, .points_name = "camera", .light_name = "medium"};
    cell->light = scene_bench_light(&scene->entry, SCENE_LIGHT_MEDIUM);
    return bench_points_camera(&cell->points, scene, side, s->error);
}

static bool over_triangles(sweep *s) {
    const unsigned most = s->options.quick ? 5 : 7;
    bool fine = true;
    for (unsigned levels = 2; fine && levels <= most; levels++) {
        bench_scene scene;
        bench_cell cell;
        fine = bench_scene_spheres(&scene, levels, s->error);
        if (!fine) break;
        fine = start(s, &cell, &scene, s->options.side) &&
               measure(s, &cell, "triangles", (double)scene.mesh.triangle_count);
        bench_points_free(&cell.points);
        bench_scene_free(&scene);
    }
    return fine;
}

static bool over_points(sweep *s) {
    static const uint32_t sides[] = {32, 100, 316, 1000, 3162};
    const int most = s->options.quick ? 4 : 5;
    bool fine = true;
    for (int i = 0; fine && i < most; i++) {
        bench_cell cell;
        fine = start(s, &cell, s->scene, sides[i]) &&
               measure(s, &cell, "points", (double)cell.points.count);
        bench_points_free(&cell.points);
    }
    return fine;
}

/* The light's radius in radii of the scene: from a bulb to a sky. */
static bool over_light(sweep *s) {
    static const double radii[] = {.005, .02, .05, .1, .2, .4, .8, 1.6};
    const int step = s->options.quick ? 2 : 1;
    bench_cell cell;
    bool fine = start(s, &cell, s->scene, s->options.side);
    cell.light_name = "swept";
    for (int i = step - 1; fine && i < (int)(sizeof radii / sizeof *radii); i += step) {
        cell.light.radius = radii[i] * s->scene->entry.radius;
        fine = measure(s, &cell, "light", radii[i]);
    }
    bench_points_free(&cell.points);
    return fine;
}

/* Wall times; the peer has one thread only and is left out. */
static bool over_threads(sweep *s) {
    const long most = sysconf(_SC_NPROCESSORS_ONLN);
    bench_cell cell;
    bool fine = start(s, &cell, s->scene, s->options.side);
    s->wanted.wall = true;
    if (s->options.repeat < LEAST_OF) s->options.repeat = LEAST_OF;
    for (long n = 1; fine; n = 2 * n < most ? 2 * n : most) {
        s->options.threads = (uint32_t)n;
        fine = measure(s, &cell, "threads", (double)n);
        if (n == most) break;
    }
    bench_points_free(&cell.points);
    return fine;
}

/* Texels along a side of a map; only methods that have one. */
static bool over_resolution(sweep *s) {
    const uint32_t most = s->options.quick ? 2048 : 4096;
    softshadow_method method = SOFTSHADOW_METHOD_INIT;
    bench_cell cell;
    bool fine = start(s, &cell, s->scene, s->options.side);
    for (uint32_t i = 0; softshadow_method_info(i, &method) == SOFTSHADOW_OK; i++)
        if (method.bound_kind != SOFTSHADOW_BOUND_NONE || strcmp(method.name, "auto") == 0)
            s->wanted.methods &= ~((uint64_t)1 << i);
    s->wanted.peer = false;
    for (uint32_t side = 256; fine && side <= most; side *= 2) {
        s->wanted.texels = side;
        fine = measure(s, &cell, "resolution", side);
    }
    bench_points_free(&cell.points);
    return fine;
}

static const struct {
    const char *name;
    bool (*run)(sweep *s);
} sweeps[] = {{"triangles", over_triangles},
              {"points", over_points},
              {"light", over_light},
              {"threads", over_threads},
              {"resolution", over_resolution}};

const char *const sweep_names[] = {"triangles", "points", "light", "threads", "resolution", NULL};

bool sweep_run(const char *name, const bench_scene *scene, const bench_options *options,
               const matrix_request *wanted, rows *into, cli_error *error) {
    sweep s = {
        .scene = scene, .options = *options, .wanted = *wanted, .rows = into, .error = error};
    s.wanted.one_setting = true;
    s.out = malloc(sizeof *s.out);
    if (!s.out) return cli_fail(error, CLI_FAILED, "memory ran out");
    bool fine = true;
    for (size_t i = 0; i < sizeof sweeps / sizeof *sweeps; i++)
        if (strcmp(sweeps[i].name, name) == 0) fine = sweeps[i].run(&s);
    free(s.out);
    return fine;
}
