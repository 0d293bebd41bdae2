/* Points as text or CSV: x y z [nx ny nz], separated by blanks, commas or semicolons.
 *
 * A first line of names (also behind # or //) says which column is what; other columns are carried
 * along. Without one there are 3 or 6 columns. The first line with names or numbers settles the
 * separator and the number of columns; a line that differs is an error, not a guess. */
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "../number.h"
#include "points.h"

enum { MOST_LINE = 65536, MOST_COLUMNS = 1024, AXES = 6 };

typedef struct field {
    const char *begin, *end;
} field;

typedef struct text_state {
    uint64_t first_line; /* whose columns the others must have */
    uint32_t columns;    /* 0: not known yet */
    int place[AXES];     /* column of x y z nx ny nz, or -1 */
    bool named;          /* by a header line */
    size_t scanned;      /* bytes at hand that hold no newline */
    field fields[MOST_COLUMNS];
} text_state;

typedef enum { LINE, WAIT, END, WRONG } line_status;

static bool blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

static bool complain(const points_source *source, const char *line, const char *at,
                     const char *what, cli_error *error) {
    return cli_fail(error, CLI_FAILED, "%s:%llu:%zu: %s", source->input.name,
                    (unsigned long long)source->line, (size_t)(at - line) + 1, what);
}

/* The next line, without taking it. wait: rather than waiting for more input, say WAIT. */
static line_status peek_line(points_source *source, bool wait, field *line, cli_error *error) {
    text_state *state = source->state;
    cli_input *input = &source->input;
    while (true) {
        const char *begin = cli_input_at(input);
        size_t waiting = cli_input_waiting(input);
        const char *newline = NULL;
        if (waiting > state->scanned)
            newline = memchr(begin + state->scanned, '\n', waiting - state->scanned);
        size_t length = newline ? (size_t)(newline - begin) : waiting;
        if (length > MOST_LINE) {
            source->line++;
            return complain(source, begin, begin + MOST_LINE, "line is longer than 65536 bytes",
                            error),
                   WRONG;
        }
        if (newline || (input->ended && waiting)) {
            *line = (field){begin, begin + length};
            return LINE;
        }
        if (input->ended) return END;
        state->scanned = waiting;
        if (!wait && !cli_input_ready(input)) return WAIT;
        if (!cli_input_more(input, error)) return WRONG;
    }
}

static void take_line(points_source *source, field line) {
    cli_input *input = &source->input;
    size_t length = (size_t)(line.end - line.begin);
    if (length < cli_input_waiting(input)) length++; /* its newline */
    cli_input_take(input, length);
    ((text_state *)source->state)->scanned = 0;
}

/* The line's content: behind a byte order mark and blanks. */
static field content(const points_source *source, field line) {
    const char *at = line.begin;
    if (source->line == 1 && line.end - at >= 3 && memcmp(at, "\xef\xbb\xbf", 3) == 0) at += 3;
    while (at < line.end && blank(*at)) at++;
    return (field){at, line.end};
}

static size_t comment_mark(field text) {
    if (text.begin < text.end && *text.begin == '#') return 1;
    return text.end - text.begin >= 2 && memcmp(text.begin, "//", 2) == 0 ? 2 : 0;
}

/* ---- Fields -------------------------------------------------------------------------------- */

static char find_separator(field text, bool names) {
    size_t length = (size_t)(text.end - text.begin);
    if (memchr(text.begin, ';', length)) return ';';
    if (memchr(text.begin, ',', length)) return ',';
    return names && memchr(text.begin, '\t', length) ? '\t' : ' ';
}

static field unquoted(field f) {
    while (f.begin < f.end && blank(*f.begin)) f.begin++;
    while (f.end > f.begin && blank(f.end[-1])) f.end--;
    if (f.end - f.begin >= 2 && *f.begin == '"' && f.end[-1] == '"') f.begin++, f.end--;
    return f;
}

/* Where the field that begins at `at` ends: at a separator outside quotes, or at stop. */
static const char *field_end(const char *at, const char *stop, char separator) {
    bool quoted = false;
    for (; at < stop; at++) {
        if (*at == '"') quoted = !quoted;
        if (!quoted && (separator == ' ' ? blank(*at) : *at == separator)) break;
    }
    return at;
}

/* Splits up to a comment; *cut is where the data ends. Returns the number of fields, or
 * MOST_COLUMNS + 1 for more than there is room for. */
static uint32_t split(const points_source *source, field text, bool comments, field *fields,
                      const char **cut) {
    const char *stop = text.end, *at = text.begin;
    char separator = source->separator;
    uint32_t count = 0;
    for (const char *c = text.begin; comments && c < stop; c++)
        if (*c == '#' && (c == text.begin || blank(c[-1]))) stop = c;
    while (stop > text.begin && blank(stop[-1]) && (separator != '\t' || stop[-1] != '\t')) stop--;
    *cut = stop;
    while (at < stop || (separator != ' ' && count && at == stop)) {
        if (separator == ' ' && blank(*at)) {
            at++;
            continue;
        }
        const char *end = field_end(at, stop, separator);
        if (count == MOST_COLUMNS) return MOST_COLUMNS + 1;
        fields[count++] = separator == ' ' ? (field){at, end} : unquoted((field){at, end});
        if (separator == ' ') fields[count - 1] = unquoted(fields[count - 1]);
        if (end == stop) break;
        at = end + 1;
    }
    return count;
}

/* ---- The header ---------------------------------------------------------------------------- */

/* Finds x y z nx ny nz among names: false if x, y or z is missing or one is there twice. */
static bool find_axes(const field *fields, uint32_t count, int place[AXES]) {
    static const char *const names[AXES] = {"x", "y", "z", "nx", "ny", "nz"};
    for (int axis = 0; axis < AXES; axis++) {
        size_t length = strlen(names[axis]);
        place[axis] = -1;
        for (uint32_t i = 0; i < count; i++) {
            if ((size_t)(fields[i].end - fields[i].begin) != length ||
                strncasecmp(fields[i].begin, names[axis], length) != 0)
                continue;
            if (place[axis] >= 0) return false;
            place[axis] = (int)i;
        }
    }
    bool all = place[3] >= 0 && place[4] >= 0 && place[5] >= 0;
    bool none = place[3] < 0 && place[4] < 0 && place[5] < 0;
    return place[0] >= 0 && place[1] >= 0 && place[2] >= 0 && (all || none);
}

static bool is_number(field f) {
    double value;
    const char *at = f.begin;
    return cli_number_double(&at, f.end, &value) != CLI_NUMBER_NONE;
}

static void keep_header(points_source *source, field line, const char *cut) {
    source->header_cut = source->header.length + (size_t)(cut - line.begin);
    cli_text_append(&source->header, line.begin, (size_t)(line.end - line.begin));
    cli_text_append(&source->header, "\n", 1);
}

/* A comment that names x, y and z may be the header: what follows must have as many columns. */
static void consider_comment(points_source *source, field line, field text, size_t mark,
                             uint32_t *columns, int place[AXES]) {
    text_state *state = source->state;
    field names = {text.begin + mark, text.end};
    const char *cut;
    int found[AXES];
    source->separator = find_separator(names, false);
    uint32_t count = split(source, names, false, state->fields, &cut);
    bool fits = count <= MOST_COLUMNS && find_axes(state->fields, count, found);
    if (fits) memcpy(place, found, sizeof found);
    if (fits) *columns = count;
    if (fits) keep_header(source, line, cut);
    if (fits) return;
    cli_text_append(&source->header, line.begin, (size_t)(line.end - line.begin));
    cli_text_append(&source->header, "\n", 1);
}

static bool settle_unnamed(points_source *source, field line, field text, uint32_t count,
                           cli_error *error) {
    text_state *state = source->state;
    if (count != 3 && count != 6)
        return cli_fail(
            error, CLI_FAILED,
            "%s:%llu:%zu: %u columns, 3 (x y z) or 6 (x y z nx ny nz) are allowed, or a "
            "first line that names them",
            source->input.name, (unsigned long long)source->line,
            (size_t)(text.begin - line.begin) + 1, count);
    for (int axis = 0; axis < AXES; axis++) state->place[axis] = axis < (int)count ? axis : -1;
    return true;
}

/* The first line that is neither blank nor comment: a header, or the first data. */
static bool settle(points_source *source, field line, field text, uint32_t commented,
                   const int commented_place[AXES], cli_error *error) {
    text_state *state = source->state;
    const char *cut;
    source->separator = find_separator(text, false);
    uint32_t count = split(source, text, true, state->fields, &cut);
    bool names = count && count <= MOST_COLUMNS && !is_number(state->fields[0]) &&
                 !(commented && commented == count);
    if (names) {
        source->separator = find_separator(text, true);
        count = split(source, text, false, state->fields, &cut);
        if (count > MOST_COLUMNS || !find_axes(state->fields, count, state->place))
            return complain(
                source, line.begin, text.begin,
                "neither numbers nor a header that names x, y and z (and nx, ny, nz or none "
                "of them) once each",
                error);
        source->header_cut = 0;
        keep_header(source, line, cut);
        take_line(source, line);
        state->named = true;
    } else if (count > MOST_COLUMNS) {
        return complain(source, line.begin, text.begin, "more than 1024 columns", error);
    } else if (commented && commented == count) {
        memcpy(state->place, commented_place, sizeof state->place);
        state->named = true;
    } else if (!settle_unnamed(source, line, text, count, error)) {
        return false;
    } else {
        source->header_cut = 0; /* a comment that looked like a header was none */
    }
    state->columns = count;
    state->first_line = source->line;
    if (!names) source->line--; /* it is read again, as data */
    source->normals = state->place[3] >= 0;
    return true;
}

/* Reads up to the first line of data. Without a single one (an empty file) there are no points. */
static bool read_header(points_source *source, cli_error *error) {
    int place[AXES];
    uint32_t commented = 0;
    field line;
    source->header.length = 0;
    while (true) {
        line_status status = peek_line(source, true, &line, error);
        if (status == WRONG) return false;
        if (status == END) return true;
        source->line++;
        if (memchr(line.begin, 0, (size_t)(line.end - line.begin)))
            return complain(source, line.begin,
                            memchr(line.begin, 0, (size_t)(line.end - line.begin)),
                            "a zero byte, text is allowed", error);
        field text = content(source, line);
        size_t mark = comment_mark(text);
        if (text.begin < text.end && !mark)
            return settle(source, line, text, commented, place, error);
        if (mark) {
            consider_comment(source, line, text, mark, &commented, place);
        } else {
            cli_text_append(&source->header, "\n", 1);
        }
        take_line(source, line);
        if (source->header.length > POINTS_CARRY)
            return complain(source, line.begin, line.begin, "32 MiB of comments and no point",
                            error);
    }
}

static bool text_open(points_source *source, cli_error *error) {
    source->state = calloc(1, sizeof(text_state));
    if (!source->state)
        return cli_fail(error, CLI_FAILED, "%s: memory ran out", source->input.name);
    source->type = SOFTSHADOW_F64;
    source->lines = true;
    return read_header(source, error);
}

/* ---- Data ---------------------------------------------------------------------------------- */

static bool parse(const points_source *source, field line, field f, double *value,
                  cli_error *error) {
    const char *at = f.begin;
    cli_number result = cli_number_double(&at, f.end, value);
    if (result == CLI_NUMBER_OK && at == f.end) return true;
    cli_shown shown;
    if (result == CLI_NUMBER_OK) result = CLI_NUMBER_NONE;
    return cli_fail(
        error, CLI_FAILED, "%s:%llu:%zu: '%s' %s, numbers like -1.5e3 are allowed",
        source->input.name, (unsigned long long)source->line, (size_t)(f.begin - line.begin) + 1,
        cli_show(&shown, f.begin, (size_t)(f.end - f.begin)), cli_number_problem(result));
}

static bool wrong_columns(const points_source *source, uint32_t count, cli_error *error) {
    const text_state *state = source->state;
    return cli_fail(
        error, CLI_FAILED, "%s:%llu:1: has %s%u columns, %u are allowed as in line %llu",
        source->input.name, (unsigned long long)source->line,
        count > MOST_COLUMNS ? "more than " : "", count > MOST_COLUMNS ? MOST_COLUMNS : count,
        state->columns, (unsigned long long)state->first_line);
}

static bool take_point(points_source *source, points_block *block, field line, field text,
                       cli_error *error) {
    text_state *state = source->state;
    const char *cut, *zero = memchr(line.begin, 0, (size_t)(line.end - line.begin));
    if (zero) return complain(source, line.begin, zero, "a zero byte, text is allowed", error);
    bool comments = !state->named || source->separator == ' ';
    uint32_t count = split(source, text, comments, state->fields, &cut);
    if (count != state->columns) return wrong_columns(source, count, error);
    double *position = (double *)block->positions + 3 * block->count;
    for (int axis = 0; axis < 3; axis++)
        if (!parse(source, line, state->fields[state->place[axis]], &position[axis], error))
            return false;
    for (int axis = 3; source->normals && axis < AXES; axis++) {
        double value;
        if (!parse(source, line, state->fields[state->place[axis]], &value, error)) return false;
        block->normals[3 * block->count + (size_t)axis - 3] = (float)value;
    }
    block->cuts[block->count] = block->carried.length + (size_t)(cut - line.begin);
    return true;
}

static bool text_read(points_source *source, points_block *block, size_t most, cli_error *error) {
    field line;
    while (block->count < most && block->carried.length < POINTS_CARRY) {
        line_status status = peek_line(source, block->count == 0, &line, error);
        if (status == WRONG) return false;
        source->ended = status == END;
        if (status != LINE) break;
        source->line++;
        field text = content(source, line);
        bool point = text.begin < text.end && !comment_mark(text);
        if (point && !take_point(source, block, line, text, error)) return false;
        cli_text_append(&block->carried, line.begin, (size_t)(line.end - line.begin));
        cli_text_append(&block->carried, "\n", 1);
        if (point) block->ends[block->count++] = block->carried.length;
        take_line(source, line);
    }
    return true;
}

/* Passes over that many points; *passed tells how many there were. */
static bool skip(points_source *source, uint64_t points, uint64_t *passed, cli_error *error) {
    field line;
    for (*passed = 0; *passed < points;) {
        line_status status = peek_line(source, true, &line, error);
        if (status == WRONG) return false;
        if (status == END) break;
        source->line++;
        field text = content(source, line);
        *passed += text.begin < text.end && !comment_mark(text);
        take_line(source, line);
    }
    return true;
}

static bool rewind_text(points_source *source, cli_error *error) {
    text_state *state = source->state;
    if (!cli_input_seek(&source->input, 0, error)) return false;
    source->line = 0;
    state->scanned = 0;
    state->named = false;
    return read_header(source, error);
}

static bool text_seek(points_source *source, uint64_t first, cli_error *error) {
    uint64_t passed;
    return rewind_text(source, error) && skip(source, first, &passed, error);
}

static bool text_tally(points_source *source, cli_error *error) {
    return rewind_text(source, error) && skip(source, POINTS_UNKNOWN, &source->count, error) &&
           rewind_text(source, error);
}

const points_reader points_text_reader = {
    .open = text_open, .read = text_read, .seek = text_seek, .tally = text_tally};
