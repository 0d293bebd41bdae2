/* An image of positions as points: every pixel is one, in rows; answers become channels. */
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "../image/image.h"
#include "points.h"

typedef struct image_state {
    const image_module *module;
    image_file *file;
    image_info info;
    uint32_t position[3], normal[3];
} image_state;

static bool image_open_points(points_source *source, cli_error *error) {
    char why[IMAGE_WHY];
    image_state *state = calloc(1, sizeof *state);
    source->state = state;
    if (!state) return cli_fail(error, CLI_FAILED, "%s: memory ran out", source->input.name);
    state->module = image_load(error);
    if (!state->module) return false;
    state->file = state->module->open(source->path, why);
    if (!state->file) return cli_fail(error, CLI_FAILED, "%s: %s", source->input.name, why);
    state->module->about(state->file, &state->info);
    if (!image_find_positions(&state->info, source->channels, source->path, state->position, error))
        return false;
    source->normals = image_find_normals(&state->info, state->normal);
    source->type = SOFTSHADOW_F32;
    source->count = (uint64_t)state->info.width * state->info.height;
    return true;
}

/* A blur runs along the rows, so the whole image is one block. */
static bool image_read_points(points_source *source, points_block *block, size_t most,
                              cli_error *error) {
    image_state *state = source->state;
    char why[IMAGE_WHY];
    source->ended = true;
    if (!state->file || source->given) return true;
    if (most < source->count)
        return cli_fail(error, CLI_FAILED, "%s: a part of an image, the whole is allowed",
                        source->input.name);
    for (uint32_t axis = 0; axis < 3; axis++) {
        if (!state->module->read(state->file, state->position[axis],
                                 (float *)block->positions + axis, 3, why) ||
            (block->normals &&
             !state->module->read(state->file, state->normal[axis], block->normals + axis, 3, why)))
            return cli_fail(error, CLI_FAILED, "%s: %s", source->input.name, why);
    }
    block->count = (size_t)source->count;
    block->width = state->info.width;
    return true;
}

static void image_close_points(points_source *source) {
    image_state *state = source->state;
    if (state && state->file) state->module->close(state->file);
}

static bool ends_with(const char *name, const char *ending) {
    size_t n = strlen(name), e = strlen(ending);
    return n >= e && strcasecmp(name + n - e, ending) == 0;
}

bool points_image_end(points_sink *sink, cli_error *error) {
    const image_state *state = sink->source->state;
    uint32_t columns = points_sink_columns(sink);
    image_plane planes[128];
    char names[128][32], why[IMAGE_WHY];
    void *bytes;
    size_t size;
    for (uint32_t c = 0; c < columns; c++)
        planes[c] = (image_plane){points_sink_column_name(sink, c, names[c]),
                                  sink->kept + c * sink->count, 1};
    image_picture picture = {.width = state->info.width,
                             .height = state->info.height,
                             .planes = planes,
                             .plane_count = columns};
    bool like = !ends_with(sink->output->name, ".png") && !ends_with(sink->output->name, ".tif") &&
                !ends_with(sink->output->name, ".tiff");
    image_format format = ends_with(sink->output->name, ".png") ? IMAGE_PNG : IMAGE_TIFF;
    bool fine = like ? state->module->encode_like(state->file, &picture, &bytes, &size, why)
                     : state->module->encode(&picture, format, &bytes, &size, why);
    if (!fine) return cli_fail(error, CLI_FAILED, "%s: %s", sink->output->name, why);
    fine = cli_output_write(sink->output, bytes, size, error);
    state->module->free_bytes(bytes);
    return fine;
}

const points_reader points_image_reader = {
    .open = image_open_points, .read = image_read_points, .close = image_close_points};
