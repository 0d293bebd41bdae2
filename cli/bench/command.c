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
#include "maps.h"
#include "report.h"

enum { SCENES = 32 };

typedef struct request {
    bench_options options;
    size_t scenes[SCENES];
    size_t scene_count;
    const char *csv, *times, *models, *figure10;
    softshadow_light light;
    bool light_given, quick, calibrate, figure10_given, maps;
    bool small, medium, object; /* lights */
    bool camera, scattered;
    uint32_t backend;
    cli_text backend_times, map_rows;
    report report;
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

/* ---- Work -----------------------------------------------------------------------------------*/

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
    if (r->options.rays) return bench_rays(cell, &r->options, error);
    if (r->backend == SOFTSHADOW_EGL)
        return bench_backends(cell, &r->options, r->times, &r->backend_times, error);
    return bench_measure(cell, &r->options, &result, error) &&
           report_cell(&r->report, cell, &r->options, &result, error);
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
    peer *caster;
    bool fine = true;
    for (int i = 0; i < 2 && fine; i++) {
        bench_cell cell = {.scene = scene, .points_name = i ? "scattered" : "camera"};
        if (i ? !r->scattered || r->calibrate : !r->camera) continue;
        const uint32_t side = r->options.side;
        if (i == 0) {
            if (!peer_create(&caster, &scene->mesh, true, error)) return false;
            fine = bench_points_camera(&cell.points, scene, caster, side);
            peer_destroy(caster);
        } else {
            const size_t count = side == 512 ? 250000 : (size_t)side * side;
            fine = bench_points_scattered(&cell.points, scene, count);
        }
        if (!fine) return cli_fail(error, CLI_FAILED, "%s: no points", scene->name);
        fine = some_lights(r, &cell, error);
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
    if (!report_open(&r->report, &r->options, r->maps ? NULL : r->csv, r->times, error))
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
    report_close(&r->report);
    cli_text_free(&r->map_rows);
    return fine;
}

/* What was not asked for. */
static void complete(request *r, int files) {
    bench_options *o = &r->options;
    cli_error none;
    if (!o->tolerance_count) take_tolerances(r, "1/64,1/256,1/1024", &none);
    if (r->maps && !r->small && !r->medium && !r->object) r->small = r->medium = r->object = true;
    if (r->maps && !files && !r->scene_count) take_scenes(r, "bunny,dragon-48k,leaves-2k", &none);
    if (!r->small && !r->medium && !r->object) r->medium = r->object = true;
    if (!r->camera && !r->scattered) r->camera = true;
    if (!files && !r->scene_count) {
        if (r->quick) take_scenes(r, "triangle,leaves-2k,bunny,dragon-202k", &none);
        for (size_t i = 0; !r->quick && i < bench_scene_count(); i++)
            r->scenes[r->scene_count++] = i;
    }
    if (r->quick && o->repeat == 0) o->repeat = 1;
    if (o->repeat == 0) o->repeat = 3;
    o->automatic = true;
}

int cli_bench(int argc, char **argv) {
    request r = {.options = {.threads = 1, .side = 512, .truth_points = 4096, .truth_samples = 16384}};
    static const char *const backends[] = {"cpu", "egl", NULL};
    bench_options *o = &r.options;
    char about[1024];
    snprintf(about, sizeof about,
             "Time a point at equal error: the library against rays, on meshes or on its own scenes:\n"
             "%s.\n"
             "Errors are root mean squares over points in penumbra against 16384 rays of another\n"
             "sequence; times are processor times of one thread. L is\n" CLI_LIGHT_FORMS ".",
             bench_scene_names());
    const cli_option own[] = {
        {.name = "peer", .kind = CLI_FLAG, .into = &o->peer,
         .help = "run Embree on the same points in turns, and print ratios of time"},
        {.name = "methods", .kind = CLI_FLAG, .into = &o->methods,
         .help = "time every other method, too, with its defaults"},
        {.name = "rays", .kind = CLI_UINT, .argument = "N", .into = &o->rays, .low = 16, .high = 4096,
         .help = "only this: raytrace of N samples against Embree at equal rays"},
        {.name = "backend", .kind = CLI_CHOICE, .argument = "WHERE", .into = &r.backend,
         .choices = backends,
         .help = "egl: only methods that run on the GPU, there and on the CPU (cpu)"},
        {.name = "scenes", .kind = CLI_TAKE, .argument = "LIST", .into = &r, .take = take_scenes,
         .help = "some of its own scenes (all)"},
        {.name = "light", .letter = 'l', .kind = CLI_TAKE, .argument = "L", .into = &r, .take = take_light,
         .help = "this light instead of the scene's own"},
        {.name = "lights", .kind = CLI_TAKE, .argument = "LIST", .into = &r, .take = take_lights,
         .help = "of small, medium, object (medium,object)"},
        {.name = "points", .kind = CLI_TAKE, .argument = "LIST", .into = &r, .take = take_points,
         .help = "of camera, scattered (camera)"},
        {.name = "side", .kind = CLI_UINT, .argument = "N", .into = &o->side, .low = 8, .high = 4096,
         .help = "the camera's pixels along a side (512)"},
        {.name = "tolerances", .kind = CLI_TAKE, .argument = "LIST", .into = &r,
         .take = take_tolerances, .help = "errors at which times are compared (1/64,1/256,1/1024)"},
        {.name = "primitives", .kind = CLI_FLAG, .into = &o->primitives,
         .help = "ask on the surface itself, and tell what each point lies on"},
        {.name = "repeat", .kind = CLI_UINT, .argument = "N", .into = &o->repeat, .low = 1,
         .high = 31, .help = "timings of each side, in turns; medians count (3)"},
        {.name = "quick", .kind = CLI_FLAG, .into = &r.quick,
         .help = "four scenes, one timing each"},
        {.name = "threads", .kind = CLI_UINT, .argument = "N", .into = &o->threads, .low = 1,
         .high = 1024, .help = "of the library; with 1 all is pinned to one processor (1)"},
        {.name = "truth-points", .kind = CLI_UINT, .argument = "N", .into = &o->truth_points,
         .low = 16, .high = 1 << 22, .help = "points that errors are measured on (4096)"},
        {.name = "truth-samples", .kind = CLI_UINT, .argument = "N", .into = &o->truth_samples,
         .low = 128, .high = 1 << 22, .help = "of each of them (16384)"},
        {.name = "models", .kind = CLI_TEXT, .argument = "DIR", .into = &r.models,
         .help = "what examples/fetch-models got (~/.cache/softshadow/models)"},
        {.name = "csv", .kind = CLI_TEXT, .argument = "FILE", .into = &r.csv,
         .help = "ratios and errors, which others can check"},
        {.name = "times", .kind = CLI_TEXT, .argument = "FILE", .into = &r.times,
         .help = "times too, which hold for this machine only"},
        {.name = "figure10", .kind = CLI_TEXT, .argument = "DIR", .into = &r.figure10,
         .optional = true, .given = &r.figure10_given,
         .help = "only Lawlor's table of map methods beside the paper's numbers; it\n"
                 "and its pictures are written into DIR (figure10)"},
        {.name = "maps", .kind = CLI_FLAG, .into = &r.maps,
         .help = "errors and times of every map method at 256 to 4096 texels a side\n"
                 "(of bunny, dragon-48k and leaves-2k, under all three lights)"},
        {.name = "calibrate", .kind = CLI_FLAG, .into = &r.calibrate,
         .help = "find the medium light: a quarter of the points in penumbra"},
        {0}};
    const cli_command command = {
        .name = "bench", .usage = "[MESH... [--light L]] [--peer]",
        .about = about,
        .tables = {own},
        .more = "  softshadow bench --peer --scenes bunny --lights medium\n"};
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
    if (o->threads == 1 && r.backend == SOFTSHADOW_CPU) pin(); /* a GPU has threads of its own */
    if (!all_scenes(&r, files, count, &error)) return cli_options_complain("bench", &error);
    return cli_options_flush("bench");
}
