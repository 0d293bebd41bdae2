/* softshadow query: read a block, ask for each light, write, again. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "query.h"

typedef struct job {
    query_request *request;
    points_source source;
    query_target target;
    points_sink sink;
    cli_scene scene;
    query_range range;
    points_block block;
    query_sample sample;
    float *columns[2 * CLI_MOST_LIGHTS];
    uint64_t done, bad;
} job;

/* ---- Before the work ----------------------------------------------------------------------- */

static bool choose_range(job *j, cli_error *error) {
    const query_request *request = j->request;
    points_source *source = &j->source;
    bool counted = j->target.format == POINTS_NPY || j->target.format == POINTS_PLY;
    bool needed = request->sharded || j->target.placed || request->resume;
    if (needed && (!source->input.regular || source->format == POINTS_IMAGE))
        return cli_fail(error, CLI_USAGE, "%s: --shard and --resume need a file of points",
                        source->input.name);
    if ((needed || (counted && source->input.regular)) && !points_source_tally(source, error))
        return false;
    j->range = (query_range){0, source->count, source->count};
    if (!request->sharded) return true;
    /* floor(total x i / n) without overflow. */
    uint64_t n = request->shards, i = request->shard < n ? request->shard : n;
    uint64_t each = source->count / n, rest = source->count % n;
    __extension__ typedef unsigned __int128 wide;
    j->range.first = each * i + (uint64_t)((wide)rest * i / n);
    i = i < n ? i + 1 : n;
    j->range.last = each * i + (uint64_t)((wide)rest * i / n);
    return true;
}

static size_t block_size(const job *j) {
    size_t most = POINTS_BLOCK, columns = points_sink_columns(&j->sink);
    while (most * columns > (size_t)1 << 22) most /= 2; /* 16 MiB of answers */
    if (j->source.format == POINTS_IMAGE) most = (size_t)j->source.count;
    if (j->range.last != POINTS_UNKNOWN && j->range.last - j->range.first < most)
        most = (size_t)(j->range.last - j->range.first);
    return most ? most : 1;
}

static bool make_room(job *j, cli_error *error) {
    size_t size = block_size(j);
    if (!points_block_reserve(&j->block, &j->source, size, error)) return false;
    for (uint32_t c = 0; c < points_sink_columns(&j->sink); c++)
        if (!(j->columns[c] = malloc(size * sizeof(float))))
            return cli_fail(error, CLI_FAILED, "memory ran out");
    const cli_build_options *common = &j->request->common;
    return !common->verify ||
           query_sample_init(&j->sample, (size_t)common->verify_points, &j->source, error);
}

static bool open_all(job *j, bool *nothing, cli_error *error) {
    query_request *request = j->request;
    *nothing = false;
    if (!points_source_open(&j->source, request->points, (points_format)request->input_format,
                            request->channels, error))
        return false;
    if (request->no_normals) j->source.normals = false;
    if (!query_target_choose(&j->target, request, &j->source, error) || !choose_range(j, error))
        return false;
    if (request->sharded && j->range.first == j->range.last) {
        if (!request->common.quiet)
            fprintf(stderr, "softshadow query: shard %llu/%llu has no points, nothing to do\n",
                    (unsigned long long)request->shard, (unsigned long long)request->shards);
        *nothing = true;
        return true;
    }
    const char *output = request->output;
    size_t length = strlen(output);
    j->sink = (points_sink){.format = j->target.format,
                            .source = &j->source,
                            .output = &j->target.output,
                            .lights = request->common.light_count,
                            .bounds = request->bounds,
                            .part = request->sharded,
                            .placed = j->target.placed,
                            .commas = strcmp(output, "-") == 0 || length < 4 ||
                                      strcmp(output + length - 4, ".csv") == 0};
    if (!query_target_open(&j->target, request, &j->range, points_sink_columns(&j->sink), nothing,
                           error))
        return false;
    if (*nothing) {
        if (!request->common.quiet)
            fprintf(stderr, "softshadow query: %s is whole, nothing to do\n", output);
        return true;
    }
    j->sink.count =
        j->range.last == POINTS_UNKNOWN ? POINTS_UNKNOWN : j->range.last - j->range.first;
    if (!points_sink_check(&j->sink, error)) return false;
    if ((request->sharded || j->range.first) &&
        !points_source_seek(&j->source, j->range.first, error))
        return false;
    return make_room(j, error);
}

/* ---- The work ------------------------------------------------------------------------------ */

static void tell_progress(job *j, size_t count) {
    const cli_input *input = &j->source.input;
    double from = 0, to = 0;
    if (j->sink.count != POINTS_UNKNOWN && j->sink.count) {
        from = (double)j->done / (double)j->sink.count;
        to = (double)(j->done + count) / (double)j->sink.count;
    } else if (input->regular && input->size) {
        from = to = (double)input->taken / (double)input->size;
    }
    cli_progress_span(&j->scene.progress, from, to < 1 ? to : 1, j->done);
}

static bool ask(job *j, cli_error *error) {
    const points_block *block = &j->block;
    uint32_t lights = j->sink.lights;
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    points.position_type = block->type;
    points.positions = block->positions;
    points.count = block->count;
    points.normals = block->normals;
    points.width = block->width;
    for (uint32_t light = 0; light < lights && block->count; light++) {
        points.light = light;
        points.error_bound = j->sink.bounds ? j->columns[lights + light] : NULL;
        softshadow_status status =
            softshadow_query_visibility(j->scene.handle, &points, j->columns[light]);
        if (status != SOFTSHADOW_OK) return cli_scene_fail(&j->scene, status, NULL, error);
    }
    for (size_t i = 0; i < block->count; i++) j->bad += isnan(j->columns[0][i]) != 0;
    if (j->request->common.verify) query_sample_add(&j->sample, block, j->columns[0]);
    return true;
}

static bool note(job *j, cli_error *error) {
    query_target *target = &j->target;
    if (target->journal.fd < 0 || !target->placed) return true;
    uint64_t record = points_sink_columns(&j->sink) * sizeof(float);
    uint64_t end = target->header + (j->range.first + j->done) * record;
    return query_journal_add(&target->journal, target->output.fd, end, error);
}

static bool work(job *j, cli_error *error) {
    if (!points_sink_begin(&j->sink, error)) return false;
    cli_progress_begin(&j->scene.progress, "asking");
    while (!j->source.ended) {
        size_t most = j->block.room;
        /* A whole input is read until it ends: more or less than was told shows there. */
        if (j->request->sharded && j->sink.count - j->done < most)
            most = (size_t)(j->sink.count - j->done);
        if (!most) break;
        if (!points_source_read(&j->source, &j->block, most, error)) return false;
        tell_progress(j, j->block.count);
        if (!ask(j, error) || !points_sink_write(&j->sink, &j->block, j->columns, error) ||
            !cli_output_flush(&j->target.output, error))
            return false;
        j->done += j->block.count;
        if (!note(j, error)) return false;
    }
    if (j->sink.count != POINTS_UNKNOWN && j->done != j->sink.count)
        return cli_fail(error, CLI_FAILED, "%s: changed while it was read", j->source.input.name);
    return points_sink_end(&j->sink, error) && query_target_commit(&j->target, error);
}

static bool report(job *j, cli_error *error) {
    const cli_build_options *common = &j->request->common;
    cli_progress_free(&j->scene.progress);
    cli_progress_init(&j->scene.progress, common->quiet);
    if (j->bad)
        fprintf(
            stderr,
            "softshadow query: warning: %llu of %llu points are not finite, beyond 1e15 or outside "
            "--bounds: their visibility is nan\n",
            (unsigned long long)j->bad, (unsigned long long)j->done);
    if (common->stats && !cli_scene_print_stats(&j->scene, common->stats_form == 1, error))
        return false;
    if (!common->verify) return true;
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    points.position_type = j->sample.type;
    points.positions = j->sample.positions;
    points.normals = j->sample.normals;
    points.count = j->sample.count;
    return cli_scene_print_error(&j->scene, &points, error);
}

bool query_run(query_request *request, cli_error *error) {
    job *j = calloc(1, sizeof *j);
    if (!j) return cli_fail(error, CLI_FAILED, "memory ran out");
    j->request = request;
    j->source.input.fd = j->target.output.fd = j->target.journal.fd = -1;
    bool nothing = false, fine = open_all(j, &nothing, error);
    if (fine && !nothing) {
        fine = cli_scene_open(&j->scene, &request->common, request->meshes, request->mesh_count,
                              error);
        if (fine) {
            fine = work(j, error) && report(j, error);
            cli_scene_close(&j->scene);
        }
    }
    query_sample_free(&j->sample);
    points_block_free(&j->block);
    for (size_t c = 0; c < sizeof j->columns / sizeof *j->columns; c++) free(j->columns[c]);
    points_sink_free(&j->sink);
    query_target_free(&j->target);
    points_source_close(&j->source);
    free(j);
    return fine;
}
