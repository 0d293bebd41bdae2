/* Messages of one line, made of text that may come from a hostile file. */
#include "error.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

bool cli_fail(cli_error *error, int status, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->text, sizeof error->text, format, arguments);
    va_end(arguments);
    error->status = status;
    /* A path may hold a newline or an escape sequence for the terminal. */
    for (char *c = error->text; *c; c++)
        if ((unsigned char) *c < 0x20 || *c == 0x7f) *c = '?';
    return false;
}

const char *cli_show(cli_shown *shown, const char *begin, size_t length) {
    char *out = shown->text, *limit = shown->text + 40;
    size_t i = 0;
    for (; i < length; i++) {
        unsigned char c = (unsigned char) begin[i];
        bool plain = c >= 0x20 && c < 0x7f;
        if (out + (plain ? 1 : 4) > limit) break;
        if (plain)
            *out++ = (char) c;
        else
            out += snprintf(out, 5, "\\x%02x", c);
    }
    memcpy(out, i < length ? "..." : "", i < length ? 4 : 1);
    return shown->text;
}

const char *cli_show_path(const char *path, char shown[208]) {
    size_t length = strlen(path);
    if (length <= 200)
        memcpy(shown, path, length + 1);
    else
        snprintf(shown, 208, "...%s", path + length - 200);
    return shown;
}
