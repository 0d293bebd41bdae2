/* Where answers go: text, NPY and raw; PLY and images have files of their own. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../numbers.h"
#include "points.h"

const char *points_sink_column_name(const points_sink *sink, uint32_t column, char name[32]) {
    const char *what = column < sink->lights ? "visibility" : "error_bound";
    if (sink->lights == 1)
        snprintf(name, 32, "%s", what);
    else
        snprintf(name, 32, "%s_%u", what, column % sink->lights);
    return name;
}

static bool emit(points_sink *sink, cli_error *error) {
    if (sink->scratch.failed)
        return cli_fail(error, CLI_FAILED, "%s: memory ran out", sink->output->name);
    bool fine = cli_output_write(sink->output, sink->scratch.begin, sink->scratch.length, error);
    sink->scratch.length = 0;
    return fine;
}

/* ---- Text ---------------------------------------------------------------------------------- */

static char separator_of(const points_sink *sink) {
    if (sink->source->format == POINTS_TEXT) return sink->source->separator;
    return sink->commas ? ',' : ' ';
}

static void put_names(points_sink *sink, cli_text *out) {
    char name[32], separator = separator_of(sink);
    for (uint32_t c = 0; c < points_sink_columns(sink); c++)
        cli_text_printf(out, "%c%s", separator, points_sink_column_name(sink, c, name));
}

static bool begin_text(points_sink *sink, cli_error *error) {
    const points_source *source = sink->source;
    cli_text *out = &sink->scratch;
    if (source->format == POINTS_TEXT) {
        const char *names = source->header.begin; /* NULL: there is none */
        const size_t cut = source->header_cut;
        cli_text_append(out, names, cut);
        if (cut) put_names(sink, out);
        if (names) cli_text_append(out, names + cut, source->header.length - cut);
    } else {
        const char *names = source->normals ? "x,y,z,nx,ny,nz" : "x,y,z";
        if (!sink->commas) cli_text_append(out, "# ", 2);
        for (const char *c = names; *c; c++)
            cli_text_printf(out, "%c", *c == ',' ? separator_of(sink) : *c);
        put_names(sink, out);
        cli_text_append(out, "\n", 1);
    }
    return emit(sink, error);
}

static void put_float(cli_text *out, char separator, float value) {
    char *to = cli_text_more(out, CLI_NUMBER_ROOM + 1);
    if (!to) return;
    if (separator) *to++ = separator;
    out->length += (separator != 0) + cli_numbers_print_float(to, value);
}

static void put_values(points_sink *sink, float *const *columns, size_t i) {
    char separator = separator_of(sink);
    for (uint32_t c = 0; c < points_sink_columns(sink); c++)
        put_float(&sink->scratch, separator, columns[c][i]);
}

static void put_point(points_sink *sink, const points_block *block, size_t i) {
    cli_text *out = &sink->scratch;
    char separator = separator_of(sink);
    for (size_t axis = 0; axis < 3; axis++) {
        char between = axis ? separator : 0;
        if (block->type == SOFTSHADOW_F32) {
            put_float(out, between, ((const float *)block->positions)[3 * i + axis]);
            continue;
        }
        char *to = cli_text_more(out, CLI_NUMBER_ROOM + 1);
        if (!to) return;
        if (between) *to++ = between;
        out->length += (between != 0) + cli_numbers_print_double(
                                            to, ((const double *)block->positions)[3 * i + axis]);
    }
    for (size_t axis = 0; block->normals && axis < 3; axis++)
        put_float(out, separator, block->normals[3 * i + axis]);
}

static bool write_text(points_sink *sink, const points_block *block, float *const *columns,
                       cli_error *error) {
    cli_text *out = &sink->scratch;
    const cli_text *carried = &block->carried;
    bool as_given = sink->source->format == POINTS_TEXT;
    size_t at = 0;
    for (size_t i = 0; i < block->count; i++) {
        if (as_given) {
            cli_text_append(out, carried->begin + at, block->cuts[i] - at);
            put_values(sink, columns, i);
            cli_text_append(out, carried->begin + block->cuts[i], block->ends[i] - block->cuts[i]);
            at = block->ends[i];
        } else {
            put_point(sink, block, i);
            put_values(sink, columns, i);
            cli_text_append(out, "\n", 1);
        }
        if (out->length > 1 << 19 && !emit(sink, error)) return false;
    }
    if (as_given && carried->length > at)
        cli_text_append(out, carried->begin + at, carried->length - at);
    return emit(sink, error);
}

/* ---- NPY and raw --------------------------------------------------------------------------- */

void points_npy_header(char header[POINTS_NPY_HEADER], uint64_t count, uint32_t columns) {
    char text[POINTS_NPY_HEADER];
    int length = snprintf(text, sizeof text,
                          "{'descr': '<f4', 'fortran_order': False, 'shape': (%llu, %u), }",
                          (unsigned long long)count, columns);
    memset(header, ' ', POINTS_NPY_HEADER);
    memcpy(header, "\x93NUMPY\x01\x00\x76\x00", 10); /* version 1.0, 118 bytes follow */
    memcpy(header + 10, text, (size_t)length);
    header[POINTS_NPY_HEADER - 1] = '\n';
}

static bool write_floats(points_sink *sink, const points_block *block, float *const *columns,
                         cli_error *error) {
    uint32_t count = points_sink_columns(sink);
    for (size_t i = 0; i < block->count; i++) {
        char *to = cli_text_more(&sink->scratch, count * sizeof(float));
        if (!to) break;
        for (uint32_t c = 0; c < count; c++) points_put_le_float(to + 4 * c, columns[c][i]);
        sink->scratch.length += count * sizeof(float);
    }
    return emit(sink, error);
}

static bool write_npy_header(points_sink *sink, uint64_t count, bool again, cli_error *error) {
    char header[POINTS_NPY_HEADER];
    points_npy_header(header, count, points_sink_columns(sink));
    if (again) return cli_output_rewrite(sink->output, 0, header, sizeof header, error);
    return cli_output_write(sink->output, header, sizeof header, error);
}

/* ---- All of them --------------------------------------------------------------------------- */

bool points_sink_check(const points_sink *sink, cli_error *error) {
    const char *name = sink->output->name;
    if (sink->format == POINTS_RAW6)
        return cli_fail(error, CLI_USAGE, "%s: raw6 is an input format, raw is allowed", name);
    if (sink->format == POINTS_IMAGE && sink->source->format != POINTS_IMAGE)
        return cli_fail(
            error, CLI_USAGE,
            "%s: an image is made from an image of positions only, .csv .ply .npy .raw are "
            "allowed",
            name);
    bool counted = sink->format == POINTS_NPY || sink->format == POINTS_PLY;
    if (counted && sink->count == POINTS_UNKNOWN && sink->output->origin < 0)
        return cli_fail(
            error, CLI_USAGE,
            "%s: %s begins with the number of points, which is not known beforehand here; a "
            "file, csv or raw is allowed",
            name, points_format_names[sink->format]);
    return true;
}

bool points_sink_begin(points_sink *sink, cli_error *error) {
    uint64_t count = sink->count == POINTS_UNKNOWN ? 0 : sink->count;
    if (sink->placed) return true;
    switch (sink->format) {
    case POINTS_TEXT:
        return begin_text(sink, error);
    case POINTS_PLY:
        return points_ply_begin(sink, error);
    case POINTS_NPY:
        return write_npy_header(sink, count, false, error);
    default:
        return true;
    }
}

static bool keep(points_sink *sink, const points_block *block, float *const *columns,
                 cli_error *error) {
    uint32_t count = points_sink_columns(sink);
    if (!sink->kept) sink->kept = malloc(count * sink->count * sizeof(float));
    if (!sink->kept) return cli_fail(error, CLI_FAILED, "%s: memory ran out", sink->output->name);
    for (uint32_t c = 0; c < count; c++)
        memcpy(sink->kept + c * sink->count + sink->written, columns[c],
               block->count * sizeof(float));
    return true;
}

bool points_sink_write(points_sink *sink, const points_block *block, float *const *columns,
                       cli_error *error) {
    bool fine;
    switch (sink->format) {
    case POINTS_TEXT:
        fine = write_text(sink, block, columns, error);
        break;
    case POINTS_PLY:
        fine = points_ply_write(sink, block, columns, error) && emit(sink, error);
        break;
    case POINTS_IMAGE:
        fine = keep(sink, block, columns, error);
        break;
    default:
        fine = write_floats(sink, block, columns, error);
        break;
    }
    sink->written += block->count;
    return fine;
}

bool points_sink_end(points_sink *sink, cli_error *error) {
    switch (sink->format) {
    case POINTS_PLY:
        return points_ply_end(sink, error);
    case POINTS_NPY:
        return sink->placed || sink->count == sink->written ||
               write_npy_header(sink, sink->written, true, error);
    case POINTS_IMAGE:
        return points_image_end(sink, error);
    default:
        return true;
    }
}

void points_sink_free(points_sink *sink) {
    cli_text_free(&sink->scratch);
    free(sink->kept);
    sink->kept = NULL;
}
