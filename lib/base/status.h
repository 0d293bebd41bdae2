/* The one way to fail: return ss_fail(SOFTSHADOW_E_X, "what it was, what is allowed"). */
#ifndef SS_BASE_STATUS_H
#define SS_BASE_STATUS_H

#include "softshadow.h"

#define SS_MESSAGE_SIZE 512

/* Stores the message for this thread and returns status. */
softshadow_status ss_fail(softshadow_status status, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* This thread's message; "" when nothing failed since ss_message_clear(). */
const char *ss_message(void);
void ss_message_clear(void);

#endif
