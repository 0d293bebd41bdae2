/* Mesh files, lights and options into a built handle. */
#include "scene.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool cli_scene_fail(const cli_scene *scene, softshadow_status status, const char *what,
                    cli_error *error) {
    const char *message = softshadow_last_message(scene->handle);
    if (!*message) message = softshadow_status_name(status);
    return cli_fail(error, CLI_FAILED, "%s%s%s", what ? what : "", what ? ": " : "", message);
}

static bool add_mesh(cli_scene *scene, const char *path, cli_error *error) {
    cli_mesh *mesh = &scene->meshes[scene->mesh_count];
    char shown[208];
    if (!cli_mesh_read(path, mesh, error)) return false;
    scene->mesh_count++;
    const softshadow_mesh given = cli_mesh_given(mesh);
    softshadow_status status = softshadow_add_mesh(scene->handle, &given, NULL);
    return status == SOFTSHADOW_OK ||
           cli_scene_fail(scene, status, cli_show_path(path, shown), error);
}

static bool add_lights(cli_scene *scene, const cli_build_options *options, cli_error *error) {
    for (uint32_t i = 0; i < options->light_count; i++) {
        const softshadow_light *light = &options->lights[i];
        softshadow_status status = i ? softshadow_add_light(scene->handle, light, NULL)
                                     : softshadow_set_light(scene->handle, light);
        char what[32];
        snprintf(what, sizeof what, "--light number %u", i + 1);
        if (status != SOFTSHADOW_OK) return cli_scene_fail(scene, status, what, error);
        scene->light_count++;
    }
    return true;
}

static bool fill(cli_scene *scene, const cli_build_options *options, char *const *paths, int count,
                 cli_error *error) {
    softshadow_options given = SOFTSHADOW_OPTIONS_INIT;
    given.threads = options->threads;
    given.user = &scene->progress;
    given.log = cli_progress_log;
    given.progress = cli_progress_step;
    softshadow_status status = softshadow_create(&scene->handle, &given);
    if (status != SOFTSHADOW_OK) return cli_scene_fail(scene, status, NULL, error);
    scene->meshes = calloc((size_t)count + 1, sizeof *scene->meshes);
    if (!scene->meshes) return cli_fail(error, CLI_FAILED, "memory ran out");
    for (int i = 0; i < count; i++)
        if (!add_mesh(scene, paths[i], error)) return false;
    if (!add_lights(scene, options, error)) return false;
    if (options->unbuilt) return true;
    cli_progress_begin(&scene->progress, "building");
    status = softshadow_build_maps(scene->handle, &options->build);
    if (status == SOFTSHADOW_OK) return true;
    cli_scene_fail(scene, status, NULL, error);
    /* A method or a number that is not allowed was asked wrongly, and so was what is not there. */
    if (status == SOFTSHADOW_E_ARGUMENT) error->status = CLI_USAGE;
    return false;
}

bool cli_scene_open(cli_scene *scene, const cli_build_options *options, char *const *mesh_paths,
                    int mesh_count, cli_error *error) {
    *scene = (cli_scene){0};
    cli_progress_init(&scene->progress, options->quiet || options->silent);
    scene->progress.silent = options->silent;
    if (fill(scene, options, mesh_paths, mesh_count, error)) return true;
    cli_scene_close(scene);
    return false;
}

void cli_scene_close(cli_scene *scene) {
    softshadow_destroy(scene->handle);
    for (uint32_t i = 0; i < scene->mesh_count; i++) cli_mesh_free(&scene->meshes[i]);
    free(scene->meshes);
    cli_progress_free(&scene->progress);
    scene->handle = NULL;
    scene->meshes = NULL;
    scene->mesh_count = 0;
}

bool cli_scene_print_stats(const cli_scene *scene, bool json, cli_error *error) {
    softshadow_stats s = SOFTSHADOW_STATS_INIT;
    softshadow_status status = softshadow_get_stats(scene->handle, &s);
    if (status != SOFTSHADOW_OK) return cli_scene_fail(scene, status, "--stats", error);
    const struct row {
        const char *name;
        uint64_t value;
    } rows[] = {{"triangles", s.triangles},
                {"casters_culled", s.casters_culled},
                {"silhouette_edges", s.silhouette_edges},
                {"lod_triangles", s.lod_triangles},
                {"points", s.points},
                {"points_lit", s.points_lit},
                {"points_umbra", s.points_umbra},
                {"points_penumbra", s.points_penumbra},
                {"points_traced", s.points_traced},
                {"points_settled", s.points_settled},
                {"points_bad", s.points_bad},
                {"rays", s.rays},
                {"map_bytes", s.map_bytes},
                {"peak_bytes", s.peak_bytes}};
    const char *method = s.method_used ? s.method_used : "none";
    const char *backend = s.backend_used ? s.backend_used : "none";
    const char *head = json ? "{\"method\": \"%s\", \"backend\": \"%s\", \"build_seconds\": %.6f, "
                              "\"query_seconds\": %.6f"
                            : "method            %14s\nbackend           %14s\n"
                              "build_seconds     %14.3f\nquery_seconds     %14.3f\n";
    fprintf(stderr, head, method, backend, s.build_seconds, s.query_seconds);
    const char *copies = json ? ", \"upload_seconds\": %.6f, \"download_seconds\": %.6f"
                              : "upload_seconds    %14.3f\ndownload_seconds  %14.3f\n";
    if (strcmp(backend, "egl") == 0) fprintf(stderr, copies, s.upload_seconds, s.download_seconds);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        fprintf(stderr, json ? ", \"%s\": %llu" : "%-18s%14llu\n", rows[i].name,
                (unsigned long long)rows[i].value);
    if (json) fputs("}\n", stderr);
    return true;
}

bool cli_scene_print_error(cli_scene *scene, const softshadow_points *points, cli_error *error) {
    softshadow_points asked = *points;
    asked.error_bound = NULL;
    cli_progress_begin(&scene->progress, "verifying");
    for (uint32_t light = 0; light < scene->light_count; light++) {
        softshadow_error e = SOFTSHADOW_ERROR_INIT;
        asked.light = light;
        softshadow_status status = softshadow_measure_error(scene->handle, &asked, &e);
        if (status != SOFTSHADOW_OK) return cli_scene_fail(scene, status, "--verify", error);
        fprintf(stderr,
                "verify: light %u: rms %.6f  max %.6f  p99 %.6f  mean %+.6f  over %llu points; "
                "the reference's own error: rms %.6f\n",
                light, e.rms, e.max, e.p99, e.mean, (unsigned long long)e.points,
                e.reference_error);
    }
    return true;
}
