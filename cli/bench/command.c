/* softshadow bench: the library against the best that an expert does with Embree, in one run. */
#define _GNU_SOURCE
#include <math.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../commands.h"
#include "../light.h"
#include "../numbers.h"
#include "../options.h"
#include "../output.h"
#include "backends.h"
#include "bench.h"
#include "figure10.h"
#include "map_times.h"
#include "maps.h"
#include "matrix.h"
#include "report.h"

enum { SCENES = 32, SWEEPS = 8, EVERYWHERE = 2 /* of the choices of --backend */ };

typedef struct request {
    bench_options options;
    size_t scenes[SCENES];
    size_t scene_count;
    const char *csv, *json, *times, *models, *figure10, *timed;
    softshadow_light light;
    bool light_given, calibrate, figure10_given, maps, map_times;
    bool small, medium, object; /* lights */
    bool camera, scattered;
    uint32_t backend;
    cli_text backend_times, map_rows;
    report report;
    const char *sweeps[SWEEPS];
    size_t sweep_count;
    bool peer;
    matrix_request matrix;
    rows rows;
} request;

/* ---- Options --------------------------------------------------------------------------------*/

/* Calls take for every part of a list between commas. */
static bool take_list(request *r, const char *value,
                      bool (*take)(request *, const char *, size_t, cli_error *),
                      cli_error *error) {
    for (const char *at = value;; at++) {
        const size_t length = strcspn(at, ",");
        if (!take(r, at, length, error)) return false;
        at += length;
        if (!*at) return true;
    }
}

static bool take_scene(request *r, const char *name, size_t length, cli_error *error) {
    const int found = bench_scene_find(name, length);
    cli_shown shown;
    if (found < 0)
        return cli_fail(error, CLI_USAGE, "--scenes %s: is none; %s are allowed",
                        cli_show(&shown, name, length), bench_scene_names());
    if (r->scene_count == SCENES) return cli_fail(error, CLI_USAGE, "--scenes: too many");
    r->scenes[r->scene_count++] = (size_t)found;
    return true;
}

static bool take_scenes(void *into, const char *value, cli_error *error) {
    return take_list(into, value, take_scene, error);
}

/* 1/256 or 0.004 */
static bool take_tolerance(request *r, const char *text, size_t length, cli_error *error) {
    bench_options *o = &r->options;
    char part[32];
    double value;
    const bool inverse = length > 2 && text[0] == '1' && text[1] == '/';
    const size_t skip = inverse ? 2 : 0;
    if (o->tolerance_count == BENCH_TOLERANCES || length - skip >= sizeof part)
        return cli_fail(error, CLI_USAGE, "--tolerances: at most %d are allowed, such as 1/256",
                        BENCH_TOLERANCES);
    memcpy(part, text + skip, length - skip);
    part[length - skip] = 0;
    if (!cli_numbers_real("--tolerances", part, inverse ? 2 : 1e-5, inverse ? 1e5 : 0.5, &value,
                          error))
        return false;
    o->tolerances[o->tolerance_count++] = inverse ? 1 / value : value;
    return true;
}

static bool take_tolerances(void *into, const char *value, cli_error *error) {
    ((request *)into)->options.tolerance_count = 0;
    return take_list(into, value, take_tolerance, error);
}

static bool take_kind(request *r, const char *text, size_t length, cli_error *error) {
    const struct {
        const char *name;
        bool *into;
    } kinds[] = {{"small", &r->small}, {"medium", &r->medium}, {"object", &r->object},
                 {"camera", &r->camera}, {"scattered", &r->scattered}};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (strlen(kinds[i].name) == length && memcmp(kinds[i].name, text, length) == 0)
            return *kinds[i].into = true;
    cli_shown shown;
    return cli_fail(error, CLI_USAGE, "%s: is none of those that --help lists",
                    cli_show(&shown, text, length));
}

static bool take_lights(void *into, const char *value, cli_error *error) {
    request *r = into;
    r->small = r->medium = r->object = false;
    return take_list(r, value, take_kind, error);
}

static bool take_points(void *into, const char *value, cli_error *error) {
    request *r = into;
    r->camera = r->scattered = false;
    return take_list(r, value, take_kind, error);
}

static bool take_light(void *into, const char *value, cli_error *error) {
    request *r = into;
    r->light_given = true;
    return cli_light_parse(value, &r->light, error);
}

static bool take_method(request *r, const char *name, size_t length, cli_error *error) {
    return matrix_choose(&r->matrix, name, length, error);
}

static bool take_methods(void *into, const char *value, cli_error *error) {
    return take_list(into, value, take_method, error);
}

static bool take_sweep(request *r, const char *name, size_t length, cli_error *error) {
    cli_shown shown;
    for (size_t i = 0; sweep_names[i] && r->sweep_count < SWEEPS; i++) {
        if (strlen(sweep_names[i]) != length || memcmp(sweep_names[i], name, length) != 0) continue;
        r->sweeps[r->sweep_count++] = sweep_names[i];
        return true;
    }
    return cli_fail(error, CLI_USAGE, "--sweep %s: is none of those that --help lists",
                    cli_show(&shown, name, length));
}

static bool take_sweeps(void *into, const char *value, cli_error *error) {
    return take_list(into, value, take_sweep, error);
}

/* ---- Work -----------------------------------------------------------------------------------*/

/* A GPU has threads of its own. */
static bool wants_one_processor(const request *r) {
    for (size_t i = 0; i < r->sweep_count; i++)
        if (strcmp(r->sweeps[i], "threads") == 0) return false;
    return r->options.threads == 1 && r->backend == SOFTSHADOW_CPU;
}

/* To one processor, the last: the first is the system's favourite. */
static void pin(void) {
    cpu_set_t may, one;
    if (sched_getaffinity(0, sizeof may, &may) != 0) return;
    for (int i = CPU_SETSIZE - 1; i >= 0; i--) {
        if (!CPU_ISSET(i, &may)) continue;
        CPU_ZERO(&one);
        CPU_SET(i, &one);
        sched_setaffinity(0, sizeof one, &one);
        return;
    }
}

static bool matrix_cell_of(request *r, const bench_cell *cell, cli_error *error) {
    matrix_cell *m = malloc(sizeof *m);
    if (!m) return cli_fail(error, CLI_FAILED, "memory ran out");
    m->sweep = "", m->value = 0;
    const bool fine = matrix_measure(m, cell, &r->options, &r->matrix, error) &&
                      rows_add(&r->rows, m, error);
    free(m);
    return fine;
}

static bool one_cell(request *r, bench_cell *cell, cli_error *error) {
    bench_result result;
    if (r->calibrate) {
        double radius, share;
        if (!bench_calibrate(cell, &r->options, &radius, &share, error)) return false;
        printf("%s: medium radius %.4f of the scene's %.4f, %.1f %% of points in penumbra\n",
               cell->scene->name, radius, cell->scene->entry.radius, 100 * share);
        fflush(stdout);
        return true;
    }
    if (r->maps) return bench_maps(cell, &r->options, r->csv, &r->map_rows, error);
    if (r->map_times) return bench_map_times(cell, &r->options, r->timed, error);
    if (r->options.rays) return bench_rays(cell, &r->options, error);
    if (r->backend == SOFTSHADOW_EGL)
        return bench_backends(cell, &r->options, r->times, &r->backend_times, error);
    if (r->peer)
        return bench_measure(cell, &r->options, &result, error) &&
               report_cell(&r->report, cell, &r->options, &result, error);
    return matrix_cell_of(r, cell, error);
}

static bool some_lights(request *r, bench_cell *cell, cli_error *error) {
    const struct {
        bool wanted;
        int size;
        const char *name;
    } lights[] = {{r->small, SCENE_LIGHT_SMALL, "small"},
                  {r->medium || r->calibrate, SCENE_LIGHT_MEDIUM, "medium"},
                  {r->object, SCENE_LIGHT_OBJECT, "object"}};
    if (r->light_given) {
        cell->light = r->light, cell->light_name = cli_light_type_name(r->light.type);
        return one_cell(r, cell, error);
    }
    for (size_t i = 0; i < sizeof lights / sizeof *lights; i++) {
        if (!lights[i].wanted || (r->calibrate && lights[i].size != SCENE_LIGHT_MEDIUM)) continue;
        cell->light = scene_bench_light(&cell->scene->entry, lights[i].size);
        cell->light_name = lights[i].name;
        if (!one_cell(r, cell, error)) return false;
    }
    return true;
}

static bool one_scene(request *r, const bench_scene *scene, cli_error *error) {
    bool fine = true;
    if (r->sweep_count) {
        for (size_t i = 0; fine && i < r->sweep_count; i++)
            fine = sweep_run(r->sweeps[i], scene, &r->options, &r->matrix, &r->rows, error);
        return fine;
    }
    for (int i = 0; i < 2 && fine; i++) {
        bench_cell cell = {.scene = scene, .points_name = i ? "scattered" : "camera"};
        if (i ? !r->scattered || r->calibrate || r->matrix.pictures : !r->camera) continue;
        const uint32_t side = r->options.side;
        const size_t count = side == 512 ? 250000 : (size_t)side * side;
        fine = i ? bench_points_scattered(&cell.points, scene, count) ||
                       cli_fail(error, CLI_FAILED, "memory ran out")
                 : bench_points_camera(&cell.points, scene, side, error);
        fine = fine && some_lights(r, &cell, error);
        bench_points_free(&cell.points);
    }
    return fine;
}

static bool default_models(char path[512]) {
    const char *cache = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    const int length = cache && *cache ? snprintf(path, 512, "%s/softshadow/models", cache)
                                       : snprintf(path, 512, "%s/.cache/softshadow/models",
                                                  home ? home : "");
    return length < 512;
}

static bool all_scenes(request *r, char *const *files, int count, cli_error *error) {
    bench_scene scene;
    char models[512];
    if (!r->models && default_models(models)) r->models = models;
    if (!report_open(&r->report, &r->options, r->peer ? r->csv : NULL, r->peer ? r->times : NULL,
                     error))
        return false;
    bool fine = true;
    if (count) {
        fine = bench_scene_read(&scene, files, count, error) && one_scene(r, &scene, error);
        bench_scene_free(&scene);
    }
    for (size_t i = 0; fine && i < r->scene_count; i++) {
        fine = bench_scene_make(&scene, r->scenes[i], r->models, error);
        if (fine) {
            fine = one_scene(r, &scene, error);
        } else if (error->status == 0) {
            printf("%-12s left out: %s\n", scene.name, error->text);
            fine = true;
        }
        bench_scene_free(&scene);
    }
    if (fine) rows_conclude(&r->rows);
    rows_free(&r->rows);
    report_close(&r->report);
    cli_text_free(&r->map_rows);
    return fine;
}

/* The matrix, unless one of the other benches is asked for. */
static bool is_matrix(const request *r) {
    return !r->peer && !r->maps && !r->calibrate && !r->options.rays &&
           r->backend != SOFTSHADOW_EGL;
}

static void complete_scenes(request *r, int files) {
    cli_error none;
    if (files || r->scene_count) return;
    if (r->maps) take_scenes(r, "bunny,dragon-48k,leaves-2k", &none);
    else if (r->sweep_count) take_scenes(r, "bunny", &none);
    else if (r->options.quick && is_matrix(r)) take_scenes(r, "triangle,leaves-2k,bunny", &none);
    else if (r->options.quick) take_scenes(r, "triangle,leaves-2k,bunny,dragon-202k", &none);
    else if (is_matrix(r)) /* the others' sizes lie between, and minutes each show no more */
        take_scenes(r, "triangle,leaves-2k,leaves-20k,bunny,dragon-48k,dragon-871k,spheres-1m", &none);
    for (size_t i = 0; !r->scene_count && i < bench_scene_count(); i++) r->scenes[i] = i;
    if (!r->scene_count) r->scene_count = bench_scene_count();
}

/* What was not asked for. */
static void complete(request *r, int files) {
    bench_options *o = &r->options;
    matrix_request *m = &r->matrix;
    cli_error none;
    if (!o->tolerance_count) take_tolerances(r, "1/64,1/256,1/1024", &none);
    if (r->maps && !r->small && !r->medium && !r->object) r->small = r->medium = r->object = true;
    if (r->map_times && !r->small && !r->medium && !r->object) r->medium = true;
    if (r->map_times && !files && !r->scene_count) take_scenes(r, "bunny,dragon-871k", &none);
    if (r->map_times && o->repeat == 0) o->repeat = 15;
    if (!r->small && !r->medium && !r->object) r->medium = r->object = true;
    if (!r->camera && !r->scattered) r->camera = true;
    complete_scenes(r, files);
    if (o->repeat == 0) o->repeat = o->quick && !is_matrix(r) ? 1 : 3;
    o->automatic = true;
    if (m->pictures) o->truth_points = UINT32_MAX, m->one_setting = true;
    if (!o->side) o->side = m->pictures ? 192 : o->quick && is_matrix(r) ? 256 : 512;
    if (!o->truth_points)
        o->truth_points = r->sweep_count ? 1024 : o->quick && is_matrix(r) ? 2048 : 4096;
    if (!o->truth_samples) o->truth_samples = m->pictures ? 2048 : 16384;
    if (!m->methods && !m->peer) m->methods = UINT64_MAX, m->peer = true;
    m->egl = r->backend == EVERYWHERE;
    r->rows.csv_path = r->csv, r->rows.json_path = r->json;
}

int cli_bench(int argc, char **argv) {
    request r = {.options = {.threads = 1}};
    static const char *const backends[] = {"cpu", "egl", "all", NULL};
    bench_options *o = &r.options;
    char about[1024];
    snprintf(about, sizeof about,
             "Run time against error: every method at every setting, and Embree as an expert uses it, on\n"
             "the same points of meshes or of its own scenes:\n"
             "%s.\n"
             "Errors are measured against 16384 rays of another sequence, whose own error is told; times\n"
             "are processor times of one thread. L is\n" CLI_LIGHT_FORMS ".",
             bench_scene_names());
    const cli_option own[] = {
        {.name = "methods", .kind = CLI_TAKE, .argument = "LIST", .into = &r, .take = take_methods,
         .help = "of what 'softshadow methods' lists, and peer (all)"},
        {.name = "sweep", .kind = CLI_TAKE, .argument = "LIST", .into = &r, .take = take_sweeps,
         .help = "instead: how all grows with triangles, points, light,\n"
                 "threads, resolution"},
        {.name = "pictures", .kind = CLI_TEXT, .argument = "DIR", .into = &r.matrix.pictures,
         .help = "pictures of each method's errors, too, at its usual setting"},
        {.name = "peer", .kind = CLI_FLAG, .into = &r.peer,
         .help = "only exact and auto against Embree: ratios of time at equal error"},
        {.name = "rays", .kind = CLI_UINT, .argument = "N", .into = &o->rays, .low = 16, .high = 4096,
         .help = "only this: raytrace of N samples against Embree at equal rays"},
        {.name = "backend", .kind = CLI_CHOICE, .argument = "WHERE", .into = &r.backend,
         .choices = backends,
         .help = "all: the GPU, too; egl: only what runs there, and the CPU (cpu)"},
        {.name = "scenes", .kind = CLI_TAKE, .argument = "LIST", .into = &r, .take = take_scenes,
         .help = "some of its own scenes (those of all sizes)"},
        {.name = "light", .letter = 'l', .kind = CLI_TAKE, .argument = "L", .into = &r, .take = take_light,
         .help = "this light instead of the scene's own"},
        {.name = "lights", .kind = CLI_TAKE, .argument = "LIST", .into = &r, .take = take_lights,
         .help = "of small, medium, object (medium,object)"},
        {.name = "points", .kind = CLI_TAKE, .argument = "LIST", .into = &r, .take = take_points,
         .help = "of camera, scattered (camera)"},
        {.name = "side", .kind = CLI_UINT, .argument = "N", .into = &o->side, .low = 8, .high = 4096,
         .help = "the camera's pixels along a side (512; 192 for pictures)"},
        {.name = "tolerances", .kind = CLI_TAKE, .argument = "LIST", .into = &r,
         .take = take_tolerances, .help = "errors at which times are compared (1/64,1/256,1/1024)"},
        {.name = "primitives", .kind = CLI_FLAG, .into = &o->primitives,
         .help = "with --peer: ask on the surface, tell what each point lies on"},
        {.name = "repeat", .kind = CLI_UINT, .argument = "N", .into = &o->repeat, .low = 1,
         .high = 31, .help = "timings of each side, in turns; medians count (3)"},
        {.name = "quick", .kind = CLI_FLAG, .into = &o->quick,
         .help = "the smaller scenes, fewer points and settings"},
        {.name = "threads", .kind = CLI_UINT, .argument = "N", .into = &o->threads, .low = 1,
         .high = 1024, .help = "of the library; with 1 all is pinned to one processor (1)"},
        {.name = "truth-points", .kind = CLI_UINT, .argument = "N", .into = &o->truth_points,
         .low = 16, .high = 1 << 22, .help = "points that errors are measured on (4096; all for pictures)"},
        {.name = "truth-samples", .kind = CLI_UINT, .argument = "N", .into = &o->truth_samples,
         .low = 128, .high = 1 << 22, .help = "of each of them (16384; 2048 for pictures)"},
        {.name = "models", .kind = CLI_TEXT, .argument = "DIR", .into = &r.models,
         .help = "what examples/fetch-models got (~/.cache/softshadow/models)"},
        {.name = "csv", .kind = CLI_TEXT, .argument = "FILE", .into = &r.csv,
         .help = "the table; of --peer ratios and errors, which others can check"},
        {.name = "json", .kind = CLI_TEXT, .argument = "FILE", .into = &r.json,
         .help = "the same as a list of objects"},
        {.name = "times", .kind = CLI_TEXT, .argument = "FILE", .into = &r.times,
         .help = "of --peer, --backend egl: times, true on this machine only"},
        {.name = "figure10", .kind = CLI_TEXT, .argument = "DIR", .into = &r.figure10,
         .optional = true, .given = &r.figure10_given,
         .help = "only Lawlor's table of map methods beside the paper's numbers; it\n"
                 "and its pictures are written into DIR (figure10)"},
        {.name = "maps", .kind = CLI_FLAG, .into = &r.maps,
         .help = "errors and times of every map method at 256 to 4096 texels a side\n"
                 "(of bunny, dragon-48k and leaves-2k, under all three lights)"},
        {.name = "map-times", .kind = CLI_TEXT, .argument = "LIST", .into = &r.timed,
         .optional = true, .given = &r.map_times,
         .help = "times of map methods (all) at 1024 texels a side, of the depth map\n"
                 "and of silhouettes (bunny and dragon-871k, the medium light); with\n"
                 "--threads 2 or more what these gain over one"},
        {.name = "calibrate", .kind = CLI_FLAG, .into = &r.calibrate,
         .help = "find the medium light: a quarter of the points in penumbra"},
        {0}};
    const cli_command command = {
        .name = "bench", .usage = "[MESH... [--light L]] [--csv FILE]",
        .about = about,
        .tables = {own},
        .more = "  softshadow bench --scenes bunny --lights medium --csv bunny.csv\n"
                "  softshadow bench --scenes bunny --methods auto,exact,raytrace,peer\n"
                "  softshadow bench --peer --scenes bunny --lights medium\n"};
    char **files;
    int count, status;
    cli_error error;
    if (!cli_options_parse(&command, argc, argv, &files, &count, &status)) return status;
    if (r.figure10_given) {
        const char *folder = r.figure10 ? r.figure10 : "figure10";
        if (count) {
            cli_fail(&error, CLI_USAGE, "--figure10: has a scene of its own, no mesh is allowed");
            return cli_options_complain("bench", &error);
        }
        if (!bench_figure10(folder, &error)) return cli_options_complain("bench", &error);
        return cli_options_flush("bench");
    }
    complete(&r, count);
    if (r.sweep_count && r.scene_count + (count > 0) != 1) {
        cli_fail(&error, CLI_USAGE, "--sweep: one scene is allowed");
        return cli_options_complain("bench", &error);
    }
    if (wants_one_processor(&r)) pin();
    if (!all_scenes(&r, files, count, &error)) return cli_options_complain("bench", &error);
    return cli_options_flush("bench");
}
