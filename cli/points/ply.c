/* The vertices of a PLY file as points: ascii or binary of either byte order. The properties x y z
 * [nx ny nz] are read; all others, and what follows the vertices (faces), are carried to a PLY
 * sink. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../number.h"
#include "points.h"

enum { MOST_HEADER = 65536, MOST_PROPERTIES = 256, AXES = 6 };

typedef enum { INT8, UINT8, INT16, UINT16, INT32, UINT32, FLOAT, DOUBLE } number_type;

typedef struct ply_state {
    bool ascii, big;
    uint32_t properties;
    struct {
        number_type type;
        size_t offset;
    } property[MOST_PROPERTIES];
    int place[AXES];
    uint64_t header; /* bytes */
    uint64_t header_lines;
    uint64_t left;  /* vertices not read yet */
    size_t scanned; /* ascii: bytes at hand that hold no newline */
} ply_state;

static const size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};

static bool find_type(const char *name, number_type *type) {
    static const char *const names[][2] = {
        {"char", "int8"}, {"uchar", "uint8"}, {"short", "int16"},   {"ushort", "uint16"},
        {"int", "int32"}, {"uint", "uint32"}, {"float", "float32"}, {"double", "float64"}};
    for (number_type t = INT8; t <= DOUBLE; t++) {
        if (strcmp(name, names[t][0]) != 0 && strcmp(name, names[t][1]) != 0) continue;
        *type = t;
        return true;
    }
    return false;
}

static bool complain(const points_source *source, const char *what, cli_error *error) {
    return cli_fail(error, CLI_FAILED, "%s:%llu:1: %s", source->input.name,
                    (unsigned long long)source->line, what);
}

/* ---- The header ---------------------------------------------------------------------------- */

static bool add_property(points_source *source, const char *type, const char *name,
                         cli_error *error) {
    static const char *const axes[AXES] = {"x", "y", "z", "nx", "ny", "nz"};
    ply_state *state = source->state;
    number_type t;
    if (strcmp(type, "list") == 0)
        return complain(source, "a list in a vertex, single numbers are allowed", error);
    if (!find_type(type, &t))
        return complain(source, "a property of unknown type, char to double are allowed", error);
    if (state->properties == MOST_PROPERTIES)
        return complain(source, "more than 256 properties of a vertex", error);
    for (int axis = 0; axis < AXES; axis++) {
        if (strcmp(name, axes[axis]) != 0) continue;
        if (state->place[axis] >= 0)
            return complain(source, "a property that is there twice", error);
        state->place[axis] = (int)state->properties;
    }
    state->property[state->properties].type = t;
    state->property[state->properties++].offset = source->record;
    source->record += sizes[t];
    return true;
}

/* One line, its words split; in_vertex: 0 before, 1 within, 2 behind the vertex element. */
static bool header_line(points_source *source, char *line, int *in_vertex, cli_error *error) {
    ply_state *state = source->state;
    char word[4][64] = {"", "", "", ""}, more[2];
    int words = sscanf(line, "%63s %63s %63s %63s %1s", word[0], word[1], word[2], word[3], more);
    if (words <= 0 || strcmp(word[0], "comment") == 0 || strcmp(word[0], "obj_info") == 0)
        return true;
    if (strcmp(word[0], "format") == 0 && words == 3) {
        state->ascii = strcmp(word[1], "ascii") == 0;
        state->big = strcmp(word[1], "binary_big_endian") == 0;
        if (state->ascii || state->big || strcmp(word[1], "binary_little_endian") == 0) return true;
        return complain(source,
                        "unknown format, ascii, binary_little_endian and binary_big_endian "
                        "are allowed",
                        error);
    }
    if (strcmp(word[0], "element") == 0 && words == 3) {
        const char *at = word[2], *end = word[2] + strlen(word[2]);
        int64_t count;
        if (cli_number_int(&at, end, &count) != CLI_NUMBER_OK || at != end || count < 0)
            return complain(source, "an element's count is no whole number from 0", error);
        if (*in_vertex == 0 && strcmp(word[1], "vertex") != 0)
            return complain(source, "another element before vertex, vertex is allowed first",
                            error);
        if (*in_vertex == 0) source->count = (uint64_t)count;
        (*in_vertex)++;
        return true;
    }
    if (strcmp(word[0], "property") == 0 && words >= 3 && *in_vertex > 0) {
        if (*in_vertex == 1) return add_property(source, word[1], word[2], error);
        return true; /* of what follows: carried, not understood */
    }
    return complain(source, "no line of a PLY header", error);
}

/* The lines up to end_header are kept; header_cut is where the vertex element ends. */
static bool read_header(points_source *source, cli_error *error) {
    cli_input *input = &source->input;
    int in_vertex = 0;
    while (true) {
        const char *begin = cli_input_at(input);
        size_t waiting = cli_input_waiting(input);
        const char *newline = memchr(begin, '\n', waiting);
        if (!newline && waiting < MOST_HEADER && !input->ended) {
            if (!cli_input_more(input, error)) return false;
            continue;
        }
        source->line++;
        size_t length = newline ? (size_t)(newline - begin) : waiting;
        if (!newline || source->header.length + length > MOST_HEADER)
            return complain(source, "no end_header within 65536 bytes", error);
        char line[256];
        size_t copied = length < sizeof line ? length : sizeof line - 1;
        memcpy(line, begin, copied);
        line[copied] = 0;
        line[strcspn(line, "\r")] = 0;
        bool last = strcmp(line, "end_header") == 0;
        bool first = source->line == 1;
        if (first && strcmp(line, "ply") != 0)
            return complain(source, "is no PLY file, a first line 'ply' is allowed", error);
        int before = in_vertex;
        if (!first && !last && !header_line(source, line, &in_vertex, error)) return false;
        if ((in_vertex == 2 && before == 1) || (last && in_vertex <= 1))
            source->header_cut = source->header.length;
        cli_text_append(&source->header, begin, length + 1);
        cli_input_take(input, length + 1);
        if (last) break;
    }
    return in_vertex > 0 || complain(source, "no element vertex", error);
}

static bool check(points_source *source, cli_error *error) {
    ply_state *state = source->state;
    const int *place = state->place;
    const cli_input *input = &source->input;
    if (place[0] < 0 || place[1] < 0 || place[2] < 0)
        return cli_fail(error, CLI_FAILED, "%s: its vertices lack x, y or z", input->name);
    source->normals = place[3] >= 0 && place[4] >= 0 && place[5] >= 0;
    /* ascii: a vertex takes two bytes a property at least. */
    uint64_t least = state->ascii ? 2 * (uint64_t)state->properties : source->record;
    if (!input->regular) return true;
    uint64_t rest = input->size - input->taken + state->ascii; /* the last newline may be missing */
    if (source->count <= rest / least) return true;
    return cli_fail(error, CLI_FAILED, "%s: %llu vertices in %llu bytes: it is not whole",
                    input->name, (unsigned long long)source->count, (unsigned long long)rest);
}

static bool ply_open(points_source *source, cli_error *error) {
    ply_state *state = calloc(1, sizeof *state);
    source->state = state;
    if (!state) return cli_fail(error, CLI_FAILED, "%s: memory ran out", source->input.name);
    for (int axis = 0; axis < AXES; axis++) state->place[axis] = -1;
    if (!read_header(source, error) || !check(source, error)) return false;
    source->lines = state->ascii;
    state->header = source->input.taken;
    state->left = source->count;
    state->header_lines = source->line;
    source->type = SOFTSHADOW_F32;
    for (int axis = 0; axis < 3; axis++) {
        number_type type = state->property[state->place[axis]].type;
        bool wide = type == DOUBLE || type == INT32 || type == UINT32;
        if (wide) source->type = SOFTSHADOW_F64; /* float would round */
    }
    return true;
}

/* ---- Binary records ------------------------------------------------------------------------ */

static double number(const ply_state *state, int property, const char *record) {
    number_type type = state->property[property].type;
    const unsigned char *from = (const unsigned char *)record + state->property[property].offset;
    unsigned char little[8];
    for (size_t i = 0; i < sizes[type]; i++) little[i] = from[state->big ? sizes[type] - 1 - i : i];
    uint32_t bits = 0;
    for (size_t i = 0; i < sizes[type] && i < 4; i++) bits |= (uint32_t)little[i] << 8 * i;
    switch (type) {
    case INT8:
        return (int8_t)bits;
    case UINT8:
        return (uint8_t)bits;
    case INT16:
        return (int16_t)bits;
    case UINT16:
        return (uint16_t)bits;
    case INT32:
        return (int32_t)bits;
    case UINT32:
        return bits;
    case FLOAT:
        return points_le_float(little);
    default:
        return points_le_double(little);
    }
}

static void put(points_block *block, int axis, double value) {
    size_t at = 3 * block->count + (size_t)axis % 3;
    if (axis >= 3)
        block->normals[at] = (float)value;
    else if (block->type == SOFTSHADOW_F64)
        ((double *)block->positions)[at] = value;
    else
        ((float *)block->positions)[at] = (float)value;
}

static bool truncated(const points_source *source, const ply_state *state, cli_error *error) {
    return cli_fail(error, CLI_FAILED, "%s: ends after %llu of %llu vertices", source->input.name,
                    (unsigned long long)(source->count - state->left),
                    (unsigned long long)source->count);
}

static bool read_records(points_source *source, points_block *block, size_t most,
                         cli_error *error) {
    ply_state *state = source->state;
    cli_input *input = &source->input;
    while (block->count < most && state->left && block->carried.length < POINTS_CARRY) {
        if (cli_input_waiting(input) < source->record) {
            if (input->ended) return truncated(source, state, error);
            if (block->count && !cli_input_ready(input)) break;
            if (!cli_input_more(input, error)) return false;
            continue;
        }
        const char *record = cli_input_at(input);
        for (int axis = 0; axis < (source->normals ? AXES : 3); axis++)
            put(block, axis, number(state, state->place[axis], record));
        cli_text_append(&block->carried, record, source->record);
        cli_input_take(input, source->record);
        block->count++;
        state->left--;
    }
    return true;
}

/* ---- ascii lines --------------------------------------------------------------------------- */

static bool blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

static bool line_number(const points_source *source, const char *line, const char **at,
                        const char *end, double *value, cli_error *error) {
    const char *begin;
    while (*at < end && blank(**at)) (*at)++;
    begin = *at;
    cli_number result = cli_number_double(at, end, value);
    if (result == CLI_NUMBER_OK && (*at == end || blank(**at))) return true;
    cli_shown shown;
    if (result == CLI_NUMBER_OK) result = CLI_NUMBER_NONE;
    size_t length = 0;
    while (begin + length < end && !blank(begin[length])) length++;
    return cli_fail(error, CLI_FAILED, "%s:%llu:%zu: '%s' %s, numbers like -1.5e3 are allowed",
                    source->input.name, (unsigned long long)source->line,
                    (size_t)(begin - line) + 1, cli_show(&shown, begin, length),
                    cli_number_problem(result));
}

static bool take_line(points_source *source, points_block *block, const char *line, size_t length,
                      cli_error *error) {
    const ply_state *state = source->state;
    const char *at = line, *end = line + length;
    while (end > line && blank(end[-1])) end--;
    for (int p = 0; p < (int)state->properties; p++) {
        double value;
        if (!line_number(source, line, &at, end, &value, error)) return false;
        for (int axis = 0; axis < (source->normals ? AXES : 3); axis++)
            if (state->place[axis] == p) put(block, axis, value);
    }
    if (at != end)
        return cli_fail(error, CLI_FAILED, "%s:%llu:%zu: more than the %u numbers of a vertex",
                        source->input.name, (unsigned long long)source->line,
                        (size_t)(at - line) + 1, state->properties);
    block->cuts[block->count] = block->carried.length + (size_t)(end - line);
    cli_text_append(&block->carried, line, length);
    cli_text_append(&block->carried, "\n", 1);
    block->ends[block->count] = block->carried.length;
    return true;
}

/* The length of the next line at hand; false when there is none yet. */
static bool find_line(const points_source *source, ply_state *state, size_t *length) {
    const char *begin = cli_input_at(&source->input);
    size_t waiting = cli_input_waiting(&source->input);
    const char *newline = NULL;
    if (waiting > state->scanned)
        newline = memchr(begin + state->scanned, '\n', waiting - state->scanned);
    *length = newline ? (size_t)(newline - begin) : waiting;
    if (newline || (source->input.ended && waiting)) return true;
    state->scanned = waiting;
    return false;
}

static bool read_lines(points_source *source, points_block *block, size_t most, cli_error *error) {
    ply_state *state = source->state;
    cli_input *input = &source->input;
    while (block->count < most && state->left && block->carried.length < POINTS_CARRY) {
        size_t length;
        bool there = find_line(source, state, &length);
        if (length > MOST_HEADER)
            return source->line++, complain(source, "line is longer than 65536 bytes", error);
        if (!there) {
            if (input->ended) return truncated(source, state, error);
            if (block->count && !cli_input_ready(input)) break;
            if (!cli_input_more(input, error)) return false;
            continue;
        }
        source->line++;
        if (!take_line(source, block, cli_input_at(input), length, error)) return false;
        cli_input_take(input, length < cli_input_waiting(input) ? length + 1 : length);
        state->scanned = 0;
        state->left--;
        block->count++;
    }
    return true;
}

static bool ply_read(points_source *source, points_block *block, size_t most, cli_error *error) {
    ply_state *state = source->state;
    if (!(state->ascii ? read_lines : read_records)(source, block, most, error)) return false;
    source->ended = state->left == 0;
    return true;
}

static bool ply_seek(points_source *source, uint64_t first, cli_error *error) {
    ply_state *state = source->state;
    cli_input *input = &source->input;
    if (first > source->count) first = source->count;
    uint64_t offset = state->ascii ? 0 : first * source->record;
    if (!cli_input_seek(input, state->header + offset, error)) return false;
    state->left = source->count - first;
    state->scanned = 0;
    source->line = state->header_lines;
    for (uint64_t i = 0; state->ascii && i < first;) {
        size_t length;
        if (find_line(source, state, &length)) {
            cli_input_take(input, length < cli_input_waiting(input) ? length + 1 : length);
            state->scanned = 0;
            source->line++;
            i++;
        } else if (input->ended) {
            return truncated(source, state, error);
        } else if (!cli_input_more(input, error)) {
            return false;
        }
    }
    return true;
}

static bool ply_big_endian(const points_source *source) {
    const ply_state *state = source->state;
    return state->big;
}

bool points_ply_rest(points_source *source, const char **data, size_t *size, cli_error *error) {
    cli_input *input = &source->input;
    if (!cli_input_waiting(input) && !input->ended && !cli_input_more(input, error)) return false;
    *data = cli_input_at(input);
    *size = cli_input_waiting(input);
    cli_input_take(input, *size);
    return true;
}

const points_reader points_ply_reader = {
    .open = ply_open, .read = ply_read, .seek = ply_seek, .big_endian = ply_big_endian};
