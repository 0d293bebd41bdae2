/* Output that is whole or not there: a file is written beside its place and renamed when
 * everything, close included, has succeeded; an error, SIGINT, SIGTERM or SIGHUP removes it. "-" is
 * stdout; what is no regular file (a pipe, a device) is written directly. Each write is checked. */
#ifndef CLI_OUTPUT_H
#define CLI_OUTPUT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "error.h"

typedef struct cli_output {
    int fd;
    char name[208];   /* for messages */
    char *path;       /* its place, symbolic links followed; NULL: stdout or a device */
    char *temporary;  /* where it is written until then, in the same folder */
    uint64_t written; /* bytes, flushed or not */
    int64_t origin;   /* where the output began in fd; -1: one cannot go back in it */
    char *buffer;
    size_t held;
} cli_output;

/* Call once at the start of main(): signals remove what is half written; SIGPIPE and SIGXFSZ become
 * errors of write(2). */
void cli_output_prepare(void);

bool cli_output_open(cli_output *output, const char *path, cli_error *error);
/* A part of a file that others write parts of, or that an earlier run began: bytes from offset on
 * of a file of size bytes, made if it is not there. It is written in place; nothing is ever
 * removed. */
bool cli_output_open_part(cli_output *output, const char *path, uint64_t size, uint64_t offset,
                          cli_error *error);
bool cli_output_write(cli_output *output, const void *data, size_t bytes, cli_error *error);
/* Hands everything written so far to the system. */
bool cli_output_flush(cli_output *output, cli_error *error);
/* Writes over what was written before, for a header that has to wait for a count. */
bool cli_output_rewrite(cli_output *output, uint64_t offset, const void *data, size_t bytes,
                        cli_error *error);
/* Makes it whole: flush, fsync, close, rename. On an error nothing is left behind. */
bool cli_output_commit(cli_output *output, cli_error *error);
/* Gives up: removes the temporary file. Fine after a commit and on a zeroed output. */
void cli_output_abandon(cli_output *output);

#endif
