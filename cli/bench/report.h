/* What the bench says: a table, a file of ratios and errors, a file of times. */
#ifndef CLI_BENCH_REPORT_H
#define CLI_BENCH_REPORT_H

#include "../output.h"
#include "../text_buffer.h"
#include "bench.h"

typedef struct report {
    cli_text ratios, times;
    const char *ratios_path, *times_path;
    bool headed;
} report;

bool report_open(report *report, const bench_options *options, const char *ratios,
                 const char *times, cli_error *error);
/* Prints it and writes the files anew. */
bool report_cell(report *report, const bench_cell *cell, const bench_options *options,
                 const bench_result *result, cli_error *error);
void report_close(report *report);
/* Writes a whole file. */
bool report_save(const cli_text *text, const char *path, cli_error *error);

#endif
