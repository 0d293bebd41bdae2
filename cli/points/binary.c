/* Points as records of equal size: NPY (N x 3 or N x 6, float32 or float64, C order) and raw
 * little-endian float32. Numbers may be anything here: what is not finite is answered NaN. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "points.h"

typedef struct binary_state {
    size_t item;     /* bytes of a number */
    size_t columns;  /* 3 or 6 */
    uint64_t header; /* bytes before the first record */
} binary_state;

static bool open_state(points_source *source, size_t item, size_t columns, uint64_t header,
                       cli_error *error) {
    binary_state *state = malloc(sizeof *state);
    source->state = state;
    if (!state) return cli_fail(error, CLI_FAILED, "%s: memory ran out", source->input.name);
    *state = (binary_state){item, columns, header};
    source->type = item == 8 ? SOFTSHADOW_F64 : SOFTSHADOW_F32;
    source->normals = columns == 6;
    source->record = item * columns;
    return true;
}

/* ---- NPY headers --------------------------------------------------------------------------- */

/* The value of 'key' in the header's dictionary, blanks passed over; NULL if it is not there. */
static const char *find_value(const char *header, const char *key) {
    char quoted[32];
    snprintf(quoted, sizeof quoted, "'%s'", key);
    const char *at = strstr(header, quoted);
    if (!at) return NULL;
    at += strlen(quoted);
    at += strspn(at, " ");
    if (*at++ != ':') return NULL;
    return at + strspn(at, " ");
}

static bool parse_header(points_source *source, char *header, uint64_t offset, cli_error *error) {
    const char *name = source->input.name, *descr = find_value(header, "descr");
    const char *order = find_value(header, "fortran_order"), *shape = find_value(header, "shape");
    unsigned long long rows = 0, columns = 0;
    char tail[2] = "";
    cli_shown shown;
    if (!descr || !order || !shape)
        return cli_fail(error, CLI_FAILED, "%s: its NPY header lacks descr, fortran_order or shape",
                        name);
    bool f4 = strncmp(descr, "'<f4'", 5) == 0, f8 = strncmp(descr, "'<f8'", 5) == 0;
    if (!f4 && !f8)
        return cli_fail(error, CLI_FAILED, "%s: its numbers are %s, '<f4' and '<f8' are allowed",
                        name, cli_show(&shown, descr, strcspn(descr, ",}\n")));
    /* The order of a single row or column does not matter to anyone but is still stated. */
    if (strncmp(order, "False", 5) != 0)
        return cli_fail(error, CLI_FAILED, "%s: is in Fortran order, C order is allowed", name);
    /* 18 digits fit 64 bits. */
    if (sscanf(shape, "(%18llu , %18llu %1[,)]", &rows, &columns, tail) != 3 ||
        (columns != 3 && columns != 6))
        return cli_fail(error, CLI_FAILED, "%s: its shape is %s, (N, 3) or (N, 6) is allowed", name,
                        cli_show(&shown, shape, strcspn(shape, ")\n") + 1));
    source->count = rows;
    return open_state(source, f8 ? 8 : 4, (size_t)columns, offset, error);
}

static bool check_size(const points_source *source, cli_error *error) {
    const binary_state *state = source->state;
    uint64_t rest = source->input.size - source->input.taken;
    if (!source->input.regular) return true;
    if (rest % source->record == 0 && rest / source->record == source->count) return true;
    return cli_fail(error, CLI_FAILED,
                    "%s: %llu bytes follow its header, %llu x %zu x %zu are allowed by its shape",
                    source->input.name, (unsigned long long)rest, (unsigned long long)source->count,
                    state->columns, state->item);
}

static bool npy_open(points_source *source, cli_error *error) {
    cli_input *input = &source->input;
    char text[4096];
    if (!cli_input_need(input, 12, error)) return false;
    const unsigned char *b = (const unsigned char *)cli_input_at(input);
    if (cli_input_waiting(input) < 12 || memcmp(b, "\x93NUMPY", 6) != 0)
        return cli_fail(error, CLI_FAILED, "%s: byte 0: is no NPY file, \\x93NUMPY is allowed",
                        input->name);
    if (b[6] < 1 || b[6] > 3)
        return cli_fail(error, CLI_FAILED, "%s: byte 6: NPY version %d, 1 to 3 are allowed",
                        input->name, b[6]);
    size_t prefix = b[6] == 1 ? 10 : 12;
    size_t length = b[8] | (size_t)b[9] << 8;
    if (b[6] > 1) length |= (size_t)b[10] << 16 | (size_t)b[11] << 24;
    if (length >= sizeof text)
        return cli_fail(error, CLI_FAILED, "%s: byte 8: a header of %zu bytes, 4095 are allowed",
                        input->name, length);
    if (!cli_input_need(input, prefix + length, error)) return false;
    if (cli_input_waiting(input) < prefix + length)
        return cli_fail(error, CLI_FAILED, "%s: ends within its NPY header", input->name);
    memcpy(text, cli_input_at(input) + prefix, length);
    text[length] = 0;
    cli_input_take(input, prefix + length);
    return parse_header(source, text, prefix + length, error) && check_size(source, error);
}

/* ---- Records ------------------------------------------------------------------------------- */

static bool raw_open(points_source *source, cli_error *error) {
    if (!open_state(source, 4, source->format == POINTS_RAW6 ? 6 : 3, 0, error)) return false;
    if (!source->input.regular) return true;
    source->count = source->input.size / source->record;
    if (source->input.size % source->record == 0) return true;
    return cli_fail(error, CLI_FAILED, "%s: its %llu bytes are no whole number of records of %zu",
                    source->input.name, (unsigned long long)source->input.size, source->record);
}

static void decode(const binary_state *state, const char *from, points_block *block, size_t at) {
    for (size_t axis = 0; axis < 3; axis++) {
        if (state->item == 8)
            ((double *)block->positions)[3 * at + axis] = points_le_double(from + 8 * axis);
        else
            ((float *)block->positions)[3 * at + axis] = points_le_float(from + 4 * axis);
        if (!block->normals) continue;
        block->normals[3 * at + axis] = state->item == 8
                                            ? (float)points_le_double(from + 8 * (axis + 3))
                                            : points_le_float(from + 4 * (axis + 3));
    }
}

static bool check_end(const points_source *source, uint64_t total, cli_error *error) {
    size_t left = cli_input_waiting(&source->input);
    if (source->count != POINTS_UNKNOWN && total < source->count)
        return cli_fail(error, CLI_FAILED, "%s: ends after %llu of %llu points", source->input.name,
                        (unsigned long long)total, (unsigned long long)source->count);
    if (!left) return true;
    return cli_fail(error, CLI_FAILED, "%s: point %llu: %zu bytes, records of %zu are allowed",
                    source->input.name, (unsigned long long)total, left, source->record);
}

static bool binary_read(points_source *source, points_block *block, size_t most, cli_error *error) {
    const binary_state *state = source->state;
    cli_input *input = &source->input;
    while (block->count < most) {
        size_t whole = cli_input_waiting(input) / source->record;
        if (whole > most - block->count) whole = most - block->count;
        for (size_t i = 0; i < whole; i++)
            decode(state, cli_input_at(input) + i * source->record, block, block->count + i);
        cli_input_take(input, whole * source->record);
        block->count += whole;
        if (block->count == most) break;
        if (input->ended) {
            source->ended = true;
            uint64_t total = (input->taken - state->header) / source->record;
            return check_end(source, total, error);
        }
        if (block->count && !cli_input_ready(input)) break;
        if (!cli_input_more(input, error)) return false;
    }
    /* A pipe may hold more than its header said: that is seen when the last point was read. */
    uint64_t total = (input->taken - state->header) / source->record;
    if (source->count == POINTS_UNKNOWN || total <= source->count) return true;
    return cli_fail(error, CLI_FAILED, "%s: more points follow than the %llu of its header",
                    input->name, (unsigned long long)source->count);
}

static bool binary_seek(points_source *source, uint64_t first, cli_error *error) {
    const binary_state *state = source->state;
    return cli_input_seek(&source->input, state->header + first * source->record, error);
}

const points_reader points_npy_reader = {
    .open = npy_open, .read = binary_read, .seek = binary_seek};
const points_reader points_raw_reader = {
    .open = raw_open, .read = binary_read, .seek = binary_seek};
