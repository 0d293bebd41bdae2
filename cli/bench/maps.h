/* The error table of the map methods: every one that the library lists, at map sizes of 256 to
 * 4096. */
#ifndef CLI_BENCH_MAPS_H
#define CLI_BENCH_MAPS_H

#include "../text_buffer.h"
#include "bench.h"

/* Prints the table of a cell and adds its rows to the CSV, which is written anew at path (NULL:
 * not) with every cell. */
bool bench_maps(const bench_cell *cell, const bench_options *options, const char *path,
                cli_text *csv, cli_error *error);

#endif
