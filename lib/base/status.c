#include "base/status.h"

#include <stdarg.h>
#include <stdio.h>

static _Thread_local char message[SS_MESSAGE_SIZE];

softshadow_status ss_fail(softshadow_status status, const char *format, ...) {
    /* Formatted apart: an argument may be the old message. */
    char text[SS_MESSAGE_SIZE];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    snprintf(message, sizeof message, "%s", text);
    return status;
}

const char *ss_message(void) { return message; }

void ss_message_clear(void) { message[0] = '\0'; }
