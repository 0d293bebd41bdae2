/* A mesh file in memory: opening what may be anything, saying where in it something is wrong. */
#include "mesh/source.h"

#include "number.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static bool read_whole(cli_source *source, int file, cli_error *error) {
    size_t done = 0;
    /* One byte more than the size, the terminator's place, tells a file that has grown. */
    while (done <= source->size) {
        size_t want = source->size + 1 - done;
        ssize_t got = read(file, source->data + done, want < 1 << 30 ? want : 1 << 30);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0)
            return cli_fail(error, CLI_FAILED, "%s: cannot be read: %s", source->name,
                            strerror(errno));
        if (got == 0) break;
        done += (size_t) got;
    }
    if (done != source->size)
        return cli_fail(error, CLI_FAILED, "%s: changed its size while being read", source->name);
    source->data[done] = 0;
    return true;
}

static bool load(cli_source *source, int file, cli_error *error) {
    struct stat status;
    if (fstat(file, &status))
        return cli_fail(error, CLI_FAILED, "%s: %s", source->name, strerror(errno));
    if (!S_ISREG(status.st_mode))
        return cli_fail(error, CLI_FAILED, "%s: is %s; a mesh is read from a regular file",
                        source->name, S_ISDIR(status.st_mode) ? "a directory" : "no regular file");
    if (status.st_size == 0)
        return cli_fail(error, CLI_FAILED, "%s: is empty; a mesh has at least one triangle",
                        source->name);
    /* A sparse file may claim terabytes; without this the machine would swap itself to death. */
    uint64_t size = (uint64_t) status.st_size;
    uint64_t memory = (uint64_t) sysconf(_SC_PHYS_PAGES) * (uint64_t) sysconf(_SC_PAGESIZE);
    if (size > memory / 2 || size >= SIZE_MAX)
        return cli_fail(error, CLI_FAILED,
                        "%s: has %" PRIu64 " bytes; at most half of this machine's memory, "
                        "%" PRIu64 ", can be read", source->name, size, memory / 2);
    source->size = (size_t) size;
    source->data = malloc(source->size + 1);
    if (!source->data)
        return cli_fail(error, CLI_FAILED, "%s: %" PRIu64 " bytes do not fit in memory",
                        source->name, size);
    return read_whole(source, file, error);
}

bool cli_source_read(cli_source *source, const char *path, cli_error *error) {
    *source = (cli_source){.size = 0};
    cli_show_path(path, source->name);
    /* O_NONBLOCK: opening a FIFO that nobody writes to would wait forever. */
    int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (file < 0)
        return cli_fail(error, CLI_FAILED, "%s: cannot be opened: %s", source->name,
                        strerror(errno));
    bool ok = load(source, file, error);
    close(file);
    if (!ok) cli_source_free(source);
    return ok;
}

void cli_source_free(cli_source *source) {
    free(source->data);
    source->data = NULL;
    source->size = 0;
}

static bool check_lines(const cli_source *source, const char *begin, const char *face_begins,
                        cli_error *error) {
    const char *end = source->data + source->size;
    for (const char *next; begin < end; begin = next) {
        const char *newline = memchr(begin, '\n', (size_t) (end - begin));
        next = newline ? newline + 1 : end;
        size_t length = (size_t) (next - begin);
        if (length <= CLI_LINE_LIMIT) continue;
        while (cli_is_blank(*begin)) begin++;
        size_t limit = *begin && strchr(face_begins, *begin) ? CLI_FACE_LINE_LIMIT : CLI_LINE_LIMIT;
        if (length > limit)
            return cli_source_fail(source, begin, error,
                                   "a line of %zu bytes; at most %zu are allowed", length, limit);
    }
    return true;
}

bool cli_source_text(const cli_source *source, size_t offset, const char *face_begins,
                     cli_error *error) {
    const char *begin = source->data + offset, *end = source->data + source->size;
    const char *zero = memchr(begin, 0, (size_t) (end - begin));
    if (zero)
        return cli_source_fail(source, zero, error, "a NUL byte; text is allowed here");
    for (const char *c = begin; (c = memchr(c, '\r', (size_t) (end - c))); c++)
        if (c + 1 < end && c[1] != '\n')
            return cli_source_fail(source, c, error,
                                   "a carriage return alone; a line ends with a newline");
    return check_lines(source, begin, face_begins, error);
}

/* What a file says about itself may be any bytes; only its own name is the user's. */
static bool fail_at(const char *place, cli_error *error, const char *format, va_list arguments) {
    char text[400];
    vsnprintf(text, sizeof text, format, arguments);
    for (char *c = text; *c; c++)
        if ((unsigned char) *c > 0x7e) *c = '?';
    return cli_fail(error, CLI_FAILED, "%s: %s", place, text);
}

bool cli_source_fail(const cli_source *source, const char *at, cli_error *error, const char *format,
                     ...) {
    size_t line = 1;
    const char *begin = source->data;
    for (const char *c; (c = memchr(begin, '\n', (size_t) (at - begin))); line++) begin = c + 1;
    char place[264];
    snprintf(place, sizeof place, "%s:%zu:%zu", source->name, line, (size_t) (at - begin) + 1);
    va_list arguments;
    va_start(arguments, format);
    fail_at(place, error, format, arguments);
    va_end(arguments);
    return false;
}

bool cli_source_fail_byte(const cli_source *source, size_t byte, cli_error *error,
                          const char *format, ...) {
    char place[264];
    snprintf(place, sizeof place, "%s: byte %zu", source->name, byte);
    va_list arguments;
    va_start(arguments, format);
    fail_at(place, error, format, arguments);
    va_end(arguments);
    return false;
}

/* ---- Text -------------------------------------------------------------------------------------*/

const char *cli_scan_word_end(const cli_scan *text) {
    const char *c = text->at;
    while (!cli_is_blank(*c) && !cli_is_line_end(*c) && !(text->continued && cli_continuation(c)))
        c++;
    return c;
}

bool cli_scan_word_is(const cli_scan *text, const char *word) {
    size_t length = strlen(word);
    return (size_t) (cli_scan_word_end(text) - text->at) == length &&
           memcmp(text->at, word, length) == 0;
}

void cli_scan_next_line(cli_scan *text) {
    const char *end = text->source->data + text->source->size;
    const char *begin = text->at;
    /* A comment ends with its line: were it continued, a backslash at its end would hide data. */
    for (bool comment = false;;) {
        const char *newline = memchr(begin, '\n', (size_t) (end - begin));
        comment = comment || memchr(begin, '#', (size_t) ((newline ? newline : end) - begin));
        text->at = newline ? newline + 1 : end;
        if (!newline || !text->continued || comment) return;
        const char *last = newline - 1;
        if (last >= begin && *last == '\r') last--;
        if (last < begin || *last != '\\') return;
        begin = newline + 1;
    }
}

bool cli_scan_next_record(cli_scan *text) {
    while (cli_scan_line_over(text)) {
        if (!*text->at) return false;
        cli_scan_next_line(text);
    }
    return true;
}

bool cli_scan_fail_word(const cli_scan *text, const char *problem) {
    const char *end = cli_scan_word_end(text);
    cli_shown shown;
    bool over = text->at == text->source->data + text->source->size;
    if (end == text->at)
        return cli_source_fail(text->source, text->at, text->error, "%s; %s",
                               over        ? "the file ends here"
                               : *text->at ? "the line ends here"
                                           : "a NUL byte",
                               problem);
    cli_show(&shown, text->at, (size_t) (end - text->at));
    return cli_source_fail(text->source, text->at, text->error, "'%s' %s", shown.text, problem);
}

/* What a number's reader answered, as a message that names the quantity. */
static bool fail_number(const cli_scan *text, const char *what, cli_number result,
                        const char *behind) {
    char problem[160];
    const char *end = cli_scan_word_end(text);
    if (end == text->at)
        snprintf(problem, sizeof problem, "%s must be a number", what);
    else if (result != CLI_NUMBER_OK)
        snprintf(problem, sizeof problem, "%s; %s must be a finite decimal number",
                 cli_number_problem(result), what);
    else
        snprintf(problem, sizeof problem, "is not a number; %s must be one%s", what,
                 *behind == ',' ? ", with a decimal point, not a comma" : "");
    return cli_scan_fail_word(text, problem);
}

/* Is c something that may stand behind a number? */
static bool ends_number(const cli_scan *text, const char *c) {
    return cli_is_blank(*c) || cli_is_line_end(*c) || (text->continued && cli_continuation(c));
}

bool cli_scan_double(cli_scan *text, const char *what, double *value) {
    cli_scan_blanks(text);
    const char *at = text->at, *end = text->source->data + text->source->size;
    cli_number result = cli_number_double(&at, end, value);
    if (result != CLI_NUMBER_OK || !ends_number(text, at))
        return fail_number(text, what, result, at);
    text->at = at;
    return true;
}

bool cli_scan_float(cli_scan *text, const char *what, float *value) {
    cli_scan_blanks(text);
    const char *at = text->at, *end = text->source->data + text->source->size;
    cli_number result = cli_number_float(&at, end, value);
    if (result != CLI_NUMBER_OK || !ends_number(text, at))
        return fail_number(text, what, result, at);
    text->at = at;
    return true;
}

bool cli_scan_coordinate(cli_scan *text, const char *what, double *value) {
    cli_scan_blanks(text);
    cli_scan before = *text;
    if (!cli_scan_double(text, what, value)) return false;
    if (*value >= -1e15 && *value <= 1e15) return true;
    char problem[80];
    snprintf(problem, sizeof problem, "is too large; %s must be within +-1e15", what);
    return cli_scan_fail_word(&before, problem);
}

bool cli_scan_count(cli_scan *text, const char *what, uint64_t *value) {
    cli_scan_blanks(text);
    const char *at = text->at, *end = text->source->data + text->source->size;
    int64_t parsed;
    cli_number result = cli_number_int(&at, end, &parsed);
    *value = parsed > 0 ? (uint64_t) parsed : 0;
    if (result == CLI_NUMBER_OK && parsed >= 0 && ends_number(text, at)) {
        text->at = at;
        return true;
    }
    char problem[80];
    snprintf(problem, sizeof problem, "is no %s; it must be a whole number from 0", what);
    return cli_scan_fail_word(text, problem);
}
