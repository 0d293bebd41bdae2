#ifndef CLI_BACKENDS_H
#define CLI_BACKENDS_H

#include <stdbool.h>

#include "text_buffer.h"

/* Writes what each backend is, or why it is not here. */
void cli_backends(cli_text *out, bool json);

#endif
