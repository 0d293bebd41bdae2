/* Growing text. */
#include "text_buffer.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

char *cli_text_more(cli_text *text, size_t bytes) {
    if (text->room - text->length < bytes) {
        size_t room = text->room * 2 + bytes + 256;
        char *larger = realloc(text->begin, room);
        if (!larger) return text->failed = true, NULL;
        text->begin = larger;
        text->room = room;
    }
    return text->begin + text->length;
}

void cli_text_append(cli_text *text, const char *from, size_t length) {
    char *to = length ? cli_text_more(text, length) : NULL;
    if (!to) return;
    memcpy(to, from, length);
    text->length += length;
}

void cli_text_printf(cli_text *text, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(NULL, 0, format, arguments);
    va_end(arguments);
    char *to = length < 0 ? NULL : cli_text_more(text, (size_t)length + 1);
    if (!to) {
        text->failed = true;
        return;
    }
    va_start(arguments, format);
    vsnprintf(to, (size_t)length + 1, format, arguments);
    va_end(arguments);
    text->length += (size_t)length;
}

void cli_text_json(cli_text *text, const char *string) {
    cli_text_append(text, "\"", 1);
    for (const char *c = string; *c; c++) {
        if (*c == '"' || *c == '\\')
            cli_text_printf(text, "\\%c", *c);
        else if ((unsigned char)*c < 0x20)
            cli_text_printf(text, "\\u%04x", *c);
        else
            cli_text_append(text, c, 1);
    }
    cli_text_append(text, "\"", 1);
}

void cli_text_free(cli_text *text) {
    free(text->begin);
    *text = (cli_text){0};
}
