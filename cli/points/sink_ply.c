/* Answers as float properties scalar_visibility (that is how CloudCompare knows a property it shall
 * keep), scalar_error_bound. A PLY file that was read comes back as it was, faces and all, with
 * these added; other points become a binary file of their own. */
#include <stdio.h>
#include <string.h>

#include "../numbers.h"
#include "points.h"

enum { COUNT_DIGITS = 20 };

static void put_properties(points_sink *sink, const char *newline) {
    char name[32];
    for (uint32_t c = 0; c < points_sink_columns(sink); c++)
        cli_text_printf(&sink->scratch, "property float scalar_%s%s",
                        points_sink_column_name(sink, c, name), newline);
}

/* Where the count of vertices stands in a header. */
static size_t find_count(const cli_text *header, size_t *length) {
    for (size_t at = 0; at < header->length;) {
        const char *line = header->begin + at;
        const char *newline = memchr(line, '\n', header->length - at);
        size_t size = newline ? (size_t)(newline - line) : header->length - at;
        char copy[128];
        int from = 0, to = 0;
        size_t copied = size < sizeof copy ? size : sizeof copy - 1;
        memcpy(copy, line, copied);
        copy[copied] = 0;
        sscanf(copy, "element vertex %n%*s%n", &from, &to);
        if (to > from) return *length = (size_t)(to - from), at + (size_t)from;
        at += size + 1;
    }
    return *length = 0;
}

static bool has_property(const points_sink *sink, const char *name) {
    const cli_text *header = &sink->source->header;
    char wanted[64];
    int length = snprintf(wanted, sizeof wanted, " scalar_%s", name);
    for (size_t at = 0; at + (size_t)length < header->length; at++) {
        char after = header->begin[at + (size_t)length];
        if (memcmp(header->begin + at, wanted, (size_t)length) == 0 &&
            (after == '\n' || after == '\r'))
            return true;
    }
    return false;
}

static bool begin_as_given(points_sink *sink, cli_error *error) {
    const points_source *source = sink->source;
    const cli_text *header = &source->header;
    cli_text *out = &sink->scratch;
    char name[32];
    for (uint32_t c = 0; c < points_sink_columns(sink); c++)
        if (has_property(sink, points_sink_column_name(sink, c, name)))
            return cli_fail(error, CLI_FAILED, "%s: has a property scalar_%s already",
                            source->input.name, name);
    size_t length, at = find_count(header, &length);
    bool crlf = header->length > 4 && header->begin[3] == '\r';
    cli_text_append(out, header->begin, at);
    cli_text_printf(out, "%llu", (unsigned long long)sink->count);
    at += length;
    cli_text_append(out, header->begin + at, source->header_cut - at);
    put_properties(sink, crlf ? "\r\n" : "\n");
    at = source->header_cut;
    if (!sink->part) {
        cli_text_append(out, header->begin + at, header->length - at);
        return true;
    }
    /* What follows the vertices speaks of all of them, not of a part. */
    cli_text_printf(out, "end_header%s", crlf ? "\r\n" : "\n");
    return true;
}

/* The same length whatever the count. */
static void put_own_header(points_sink *sink, uint64_t count) {
    cli_text *out = &sink->scratch;
    char digits[COUNT_DIGITS + 1];
    int used = snprintf(digits, sizeof digits, "%llu", (unsigned long long)count);
    const char *type = sink->source->type == SOFTSHADOW_F64 ? "double" : "float";
    cli_text_printf(out, "ply\nformat binary_little_endian 1.0\ncomment softshadow %*s\n",
                    COUNT_DIGITS - used, "");
    cli_text_printf(out, "element vertex %s\nproperty %s x\nproperty %s y\nproperty %s z\n", digits,
                    type, type, type);
    if (sink->source->normals)
        cli_text_printf(out, "property float nx\nproperty float ny\nproperty float nz\n");
    put_properties(sink, "\n");
    cli_text_printf(out, "end_header\n");
}

bool points_ply_begin(points_sink *sink, cli_error *error) {
    if (sink->source->format == POINTS_PLY) {
        if (!begin_as_given(sink, error)) return false;
    } else {
        put_own_header(sink, sink->count == POINTS_UNKNOWN ? 0 : sink->count);
    }
    bool fine = cli_output_write(sink->output, sink->scratch.begin, sink->scratch.length, error);
    sink->scratch.length = 0;
    return fine;
}

static void put_values(points_sink *sink, float *const *columns, size_t i, bool big) {
    uint32_t count = points_sink_columns(sink);
    char *to = cli_text_more(&sink->scratch, 4 * count);
    for (uint32_t c = 0; to && c < count; c++, to += 4) {
        char little[4];
        points_put_le_float(little, columns[c][i]);
        for (int b = 0; b < 4; b++) to[b] = little[big ? 3 - b : b];
    }
    if (to) sink->scratch.length += 4 * count;
}

static void put_line(points_sink *sink, const points_block *block, float *const *columns,
                     size_t i) {
    cli_text *out = &sink->scratch;
    size_t begin = i ? block->ends[i - 1] : 0;
    cli_text_append(out, block->carried.begin + begin, block->cuts[i] - begin);
    for (uint32_t c = 0; c < points_sink_columns(sink); c++) {
        char number[CLI_NUMBER_ROOM];
        cli_numbers_print_float(number, columns[c][i]);
        cli_text_printf(out, " %s", number);
    }
    cli_text_append(out, block->carried.begin + block->cuts[i], block->ends[i] - block->cuts[i]);
}

static void put_own(points_sink *sink, const points_block *block, size_t i) {
    size_t item = block->type == SOFTSHADOW_F64 ? 8 : 4;
    char *to = cli_text_more(&sink->scratch, 36);
    if (!to) return;
    for (size_t axis = 0; axis < 3; axis++) {
        size_t at = 3 * i + axis;
        if (item == 8)
            points_put_le_double(to + 8 * axis, ((const double *)block->positions)[at]);
        else
            points_put_le_float(to + 4 * axis, ((const float *)block->positions)[at]);
        if (block->normals) points_put_le_float(to + 3 * item + 4 * axis, block->normals[at]);
    }
    sink->scratch.length += 3 * item + (block->normals ? 12 : 0);
}

bool points_ply_write(points_sink *sink, const points_block *block, float *const *columns,
                      cli_error *error) {
    const points_source *source = sink->source;
    bool as_given = source->format == POINTS_PLY;
    bool big = as_given && source->reader->big_endian(source);
    for (size_t i = 0; i < block->count; i++) {
        if (as_given && source->lines) {
            put_line(sink, block, columns, i);
            continue;
        }
        if (as_given)
            cli_text_append(&sink->scratch, block->carried.begin + i * source->record,
                            source->record);
        else
            put_own(sink, block, i);
        put_values(sink, columns, i, big);
    }
    return !sink->scratch.failed ||
           cli_fail(error, CLI_FAILED, "%s: memory ran out", sink->output->name);
}

bool points_ply_end(points_sink *sink, cli_error *error) {
    if (sink->source->format != POINTS_PLY) {
        if (sink->count == sink->written) return true;
        put_own_header(sink, sink->written);
        return cli_output_rewrite(sink->output, 0, sink->scratch.begin, sink->scratch.length,
                                  error);
    }

    points_source *source = sink->source;
    const char *data;
    size_t size;
    while (!sink->part) {
        if (!points_ply_rest(source, &data, &size, error)) return false;
        if (!size) break;
        if (!cli_output_write(sink->output, data, size, error)) return false;
    }
    return true;
}
