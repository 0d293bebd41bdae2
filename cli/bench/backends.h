#ifndef CLI_BENCH_BACKENDS_H
#define CLI_BENCH_BACKENDS_H

#include "../text_buffer.h"
#include "bench.h"

/* Prints what each method takes on both backends, and how far their answers differ; adds the same
 * as lines between commas to times, and writes those to path unless it is NULL. */
bool bench_backends(const bench_cell *cell, const bench_options *options, const char *path,
                    cli_text *times, cli_error *error);

#endif
