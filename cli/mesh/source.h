/* A mesh file in memory, and places in it for messages. Inside cli/mesh only. */
#ifndef CLI_MESH_SOURCE_H
#define CLI_MESH_SOURCE_H

#include "error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { CLI_LINE_LIMIT = 64 << 10, CLI_FACE_LINE_LIMIT = 1 << 20 };

/* The file is read, not mapped: a file that another process cuts short would kill us by SIGBUS. */
typedef struct cli_source {
    char name[208];
    char *data; /* size bytes and a terminating zero, which ends every scan of text */
    size_t size;
} cli_source;

bool cli_source_read(cli_source *source, const char *path, cli_error *error);
void cli_source_free(cli_source *source);

/* Checks that what begins at offset is text: no NUL (so that the terminating zero is the only one),
 * no carriage return but before a newline (a reader that took one for a blank would hide the lines
 * that follow a comment), no line over CLI_LINE_LIMIT, or CLI_FACE_LINE_LIMIT where its first
 * character is one of those that a face can begin with. */
bool cli_source_text(const cli_source *source, size_t offset, const char *face_begins,
                     cli_error *error);

/* "name:line:column: " and the message; lines are counted only now, when a message needs them. */
bool cli_source_fail(const cli_source *source, const char *at, cli_error *error, const char *format,
                     ...) __attribute__((format(printf, 4, 5)));
/* "name: byte N: " and the message. */
bool cli_source_fail_byte(const cli_source *source, size_t byte, cli_error *error,
                          const char *format, ...) __attribute__((format(printf, 4, 5)));

/* ---- Text -------------------------------------------------------------------------------------*/

/* A position in checked text. Scans need no end: a zero byte stops them. */
typedef struct cli_scan {
    const cli_source *source;
    cli_error *error;
    const char *at;
    bool continued; /* a backslash before a newline is a blank (OBJ) */
} cli_scan;

static inline bool cli_is_line_end(char c) { return c == '\n' || c == '\r' || c == 0; }
static inline bool cli_is_blank(char c) { return c == ' ' || c == '\t'; }

/* How long a backslash and the newline behind it are; 0: there is none at c. */
static inline size_t cli_continuation(const char *c) {
    if (*c != '\\') return 0;
    if (c[1] == '\n') return 2;
    return c[1] == '\r' && c[2] == '\n' ? 3 : 0;
}

static inline void cli_scan_blanks(cli_scan *text) {
    const char *c = text->at;
    size_t skip;
    for (;;) {
        while (cli_is_blank(*c)) c++;
        if (!text->continued || !(skip = cli_continuation(c))) break;
        c += skip;
    }
    text->at = c;
}

/* After blanks: is the line over? A comment ends it, too. */
static inline bool cli_scan_line_over(cli_scan *text) {
    cli_scan_blanks(text);
    return cli_is_line_end(*text->at) || *text->at == '#';
}

/* The end of the word at at. */
const char *cli_scan_word_end(const cli_scan *text);
bool cli_scan_word_is(const cli_scan *text, const char *word);

/* To the beginning of the next line; a continued one is passed over as a whole. */
void cli_scan_next_line(cli_scan *text);
/* To the next line with something on it, past comments; false at the end of the file. */
bool cli_scan_next_record(cli_scan *text);

/* One number after blanks, with a blank or the line's end behind it; what names it in a message. A
 * coordinate is within +-1e15. */
bool cli_scan_double(cli_scan *text, const char *what, double *value);
bool cli_scan_float(cli_scan *text, const char *what, float *value);
bool cli_scan_coordinate(cli_scan *text, const char *what, double *value);
bool cli_scan_count(cli_scan *text, const char *what, uint64_t *value);

/* "LINE:COLUMN: 'word' is not a ..." */
bool cli_scan_fail_word(const cli_scan *text, const char *problem);

#endif
