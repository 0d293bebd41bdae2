/* Text that grows, for output made piece by piece. Memory running out is remembered, not answered
 * at each call: look at failed before it is used. */
#ifndef CLI_TEXT_BUFFER_H
#define CLI_TEXT_BUFFER_H

#include <stdbool.h>
#include <stddef.h>

typedef struct cli_text {
    char *begin; /* not terminated by a zero */
    size_t length, room;
    bool failed;
} cli_text;

/* Room for so many more bytes, to be written at begin + length; NULL when memory ran out. */
char *cli_text_more(cli_text *text, size_t bytes);
void cli_text_append(cli_text *text, const char *from, size_t length);
void cli_text_printf(cli_text *text, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* A string as JSON writes it, quotes included. */
void cli_text_json(cli_text *text, const char *string);
void cli_text_free(cli_text *text);

#endif
