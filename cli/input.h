/* A file or stdin as a stream of bytes: at most what is asked for is held, and it is known whether
 * more is there at once or would have to be waited for. */
#ifndef CLI_INPUT_H
#define CLI_INPUT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "error.h"

typedef struct cli_input {
    int fd;
    char name[208]; /* for messages: "standard input" or the end of the path */
    bool regular;   /* a file whose size is known and in which one can go back */
    bool ended;
    uint64_t size;  /* of a regular file, from where reading began */
    uint64_t taken; /* bytes taken so far */
    char *buffer;
    size_t begin, end, room;
} cli_input;

/* "-" is stdin. A directory, or what cannot be read, is an error. */
bool cli_input_open(cli_input *input, const char *path, cli_error *error);
void cli_input_close(cli_input *input);

/* Bytes at hand, and how many. */
static inline const char *cli_input_at(const cli_input *input) {
    return input->buffer + input->begin;
}
static inline size_t cli_input_waiting(const cli_input *input) { return input->end - input->begin; }
static inline void cli_input_take(cli_input *input, size_t bytes) {
    input->begin += bytes;
    input->taken += bytes;
}

/* Waits for one read: more bytes are at hand, or ended is set. Moves what is at hand. */
bool cli_input_more(cli_input *input, cli_error *error);
/* Reads until that many bytes are at hand, or the end. */
bool cli_input_need(cli_input *input, size_t bytes, cli_error *error);
/* Whether cli_input_more() would return at once. */
bool cli_input_ready(const cli_input *input);
/* Continues at that byte, counted from where reading began; regular files only. */
bool cli_input_seek(cli_input *input, uint64_t offset, cli_error *error);

#endif
