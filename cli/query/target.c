/* Where the answers of a query go: a whole file or stdout, or a part in the middle of a file; with
 * --resume a journal beside it. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "query.h"

static bool same_file(const char *a, const char *b) {
    struct stat about_a, about_b;
    return stat(a, &about_a) == 0 && stat(b, &about_b) == 0 && S_ISREG(about_a.st_mode) &&
           about_a.st_dev == about_b.st_dev && about_a.st_ino == about_b.st_ino;
}

static bool check_inputs(const query_request *request, cli_error *error) {
    char shown[208];
    bool same = strcmp(request->points, "-") != 0 && same_file(request->points, request->output);
    for (int i = 0; i < request->mesh_count; i++)
        same = same || same_file(request->meshes[i], request->output);
    return !same || cli_fail(error, CLI_USAGE, "%s: is an input, another file is allowed as output",
                             cli_show_path(request->output, shown));
}

bool query_target_choose(query_target *target, const query_request *request,
                         const points_source *source, cli_error *error) {
    bool standard = strcmp(request->output, "-") == 0;
    *target = (query_target){.journal.fd = -1, .output.fd = -1};
    char shown[208];
    if (!standard && !check_inputs(request, error)) return false;
    target->format = (points_format)request->output_format;
    if (target->format == POINTS_NO_FORMAT && !standard)
        target->format = points_format_of(request->output);
    if (target->format == POINTS_NO_FORMAT && standard) /* as the points came */
        target->format = source->format == POINTS_RAW6 ? POINTS_RAW : source->format;
    if (target->format == POINTS_NO_FORMAT)
        return cli_fail(
            error, CLI_USAGE,
            "%s: its name tells no format, --output-format csv, ply, npy, raw or image is "
            "allowed",
            cli_show_path(request->output, shown));
    if (target->format == POINTS_IMAGE && standard)
        return cli_fail(error, CLI_USAGE,
                        "standard output: an image is written to a file only: -o");
    if (target->format != POINTS_TEXT && standard && isatty(STDOUT_FILENO))
        return cli_fail(error, CLI_USAGE, "standard output: is a terminal, and %s is no text: -o",
                        points_format_names[target->format]);
    if (request->resume && standard)
        return cli_fail(error, CLI_USAGE, "--resume: goes with a file: -o");
    bool records = target->format == POINTS_NPY || target->format == POINTS_RAW;
    target->placed = records && !standard && (request->sharded || request->resume);
    target->header = target->format == POINTS_NPY ? POINTS_NPY_HEADER : 0;
    if (!standard && !(target->path = strdup(request->output)))
        return cli_fail(error, CLI_FAILED, "memory ran out");
    return true;
}

/* ---- --resume ------------------------------------------------------------------------------ */

/* Everything that an answer depends on. */
static bool identify(const query_target *target, const query_request *request,
                     const query_range *range, uint32_t columns, uint64_t *identity,
                     cli_error *error) {
    const cli_build_options *common = &request->common;
    softshadow_build build = common->build;
    uint64_t hash = query_hash_text(QUERY_HASH, softshadow_version_string());
    hash = query_hash_text(hash, build.method);
    const double numbers[] = {
        build.samples,        build.resolution,     build.layers,        build.max_samples,
        build.falloff,        build.weighting,      build.mask_taps,     build.blur,
        build.seed,           build.backend,        build.tolerance,     build.depth_bias,
        build.smoothie_width, common->bounds_given, target->format,      columns,
        (double)range->first, (double)range->last,  request->no_normals, request->bounds,
        request->input_format, build.propagate, build.sub_lights};
    hash = query_hash(hash, numbers, sizeof numbers);
    hash = query_hash(hash, common->bounds, sizeof common->bounds);
    hash = query_hash_text(hash, request->channels);
    for (uint32_t i = 0; i < common->light_count; i++) {
        const softshadow_light *light = &common->lights[i];
        double kind[2] = {light->type, light->radius};
        hash = query_hash(hash, kind, sizeof kind);
        hash = query_hash(hash, light->position, sizeof light->position);
        hash = query_hash(hash, light->direction, sizeof light->direction);
        hash = query_hash(hash, light->u, sizeof light->u);
        hash = query_hash(hash, light->v, sizeof light->v);
        if (light->profile)
            hash = query_hash(hash, light->profile, light->profile_count * sizeof *light->profile);
    }
    for (int i = 0; i < request->mesh_count; i++)
        if (!query_hash_file(&hash, request->meshes[i], error)) return false;
    *identity = hash;
    return query_hash_file(identity, request->points, error);
}

static char *make_path(const char *format, const char *path, uint64_t shard, uint64_t shards) {
    size_t room = strlen(path) + 64;
    char *made = malloc(room);
    if (made)
        snprintf(made, room, format, path, (unsigned long long)shard, (unsigned long long)shards);
    return made;
}

static bool open_journal(query_target *target, const query_request *request,
                         const query_range *range, uint32_t columns, cli_error *error) {
    uint64_t identity;
    size_t record = columns * sizeof(float);
    uint64_t begin = target->placed ? target->header + range->first * record : 0;
    if (!identify(target, request, range, columns, &identity, error)) return false;
    char *path = request->sharded ? make_path("%s.%llu-of-%llu.resume", target->path,
                                              request->shard, request->shards)
                                  : make_path("%s.resume", target->path, 0, 0);
    if (!path) return cli_fail(error, CLI_FAILED, "memory ran out");
    const char *unfinished = target->part_path ? target->part_path : target->path;
    bool fine = query_journal_open(&target->journal, path, identity, target->path, unfinished,
                                   begin, error);
    free(path);
    return fine;
}

/* ---- Opening and closing ------------------------------------------------------------------- */

static bool open_placed(query_target *target, const query_range *range, uint32_t columns,
                        cli_error *error) {
    uint64_t record = columns * sizeof(float);
    const char *path = target->part_path ? target->part_path : target->path;
    if (!cli_output_open_part(&target->output, path, target->header + range->total * record,
                              target->header + range->first * record, error))
        return false;
    if (target->format != POINTS_NPY) return true;
    char header[POINTS_NPY_HEADER];
    points_npy_header(header, range->total, columns);
    return cli_output_rewrite(&target->output, 0, header, sizeof header, error);
}

bool query_target_open(query_target *target, const query_request *request, query_range *range,
                       uint32_t columns, bool *whole, cli_error *error) {
    *whole = false;
    /* Only a shard's file may be seen half done. */
    if (target->placed && !request->sharded &&
        !(target->part_path = make_path("%s.part", target->path, 0, 0)))
        return cli_fail(error, CLI_FAILED, "memory ran out");
    if (request->resume) {
        if (!open_journal(target, request, range, columns, error)) return false;
        *whole = target->journal.whole;
        if (*whole) return true;
        if (target->placed) range->first += target->journal.done / (columns * sizeof(float));
    }
    if (target->placed) return open_placed(target, range, columns, error);
    return cli_output_open(&target->output, request->output, error);
}

static bool finish_journal(query_target *target, cli_error *error) {
    struct stat about;
    char shown[208];
    if (target->journal.fd < 0) return true;
    if (!target->placed) {
        /* One piece: the file as it now is. */
        FILE *file = fopen(target->path, "re");
        bool fine =
            file && fstat(fileno(file), &about) == 0 &&
            query_journal_add(&target->journal, fileno(file), (uint64_t)about.st_size, error);
        if (!file)
            cli_fail(error, CLI_FAILED, "%s: %s", cli_show_path(target->path, shown),
                     strerror(errno));
        if (file) fclose(file);
        if (!fine) return false;
    }
    return query_journal_finish(&target->journal, error);
}

bool query_target_commit(query_target *target, cli_error *error) {
    char shown[208];
    if (!cli_output_commit(&target->output, error)) return false;
    if (target->part_path && rename(target->part_path, target->path) != 0)
        return cli_fail(error, CLI_FAILED, "%s: %s", cli_show_path(target->path, shown),
                        strerror(errno));
    return finish_journal(target, error);
}

void query_target_free(query_target *target) {
    cli_output_abandon(&target->output);
    query_journal_close(&target->journal);
    free(target->path);
    free(target->part_path);
    target->path = target->part_path = NULL;
}
