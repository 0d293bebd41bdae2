/* What the command line says when it cannot go on: one line that names the file, the place in it,
 * what is wrong and what is allowed, and the exit status that goes with it. */
#ifndef CLI_ERROR_H
#define CLI_ERROR_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { CLI_FAILED = 1, CLI_USAGE = 2 }; /* exit status: the work failed; it was asked wrongly */

typedef struct cli_error {
    char text[512]; /* one line, no newline at its end; no control characters whatever was read */
    int status;     /* what main() shall return */
} cli_error;

/* Fills the error and returns false, so that a reader can end with return cli_fail(...). */
bool cli_fail(cli_error *error, int status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Input as a message may show it: control characters and bytes beyond ASCII as \xNN, and after 40
 * characters an ellipsis. Returns shown. */
typedef struct cli_shown {
    char text[48];
} cli_shown;
const char *cli_show(cli_shown *shown, const char *begin, size_t length);

/* The end of a path, which tells more than its beginning: at most 200 bytes of it, so that a
 * message has room for what is wrong. */
const char *cli_show_path(const char *path, char shown[208]);

#ifdef __cplusplus
}
#endif
#endif
