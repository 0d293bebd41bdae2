/* What maps cost: queries a point, builds against the depth map's, the depth map against Embree's
 * packets of rays, silhouettes after connectivity, one thread against several. */
#ifndef CLI_BENCH_MAP_TIMES_H
#define CLI_BENCH_MAP_TIMES_H

#include "bench.h"

/* Prints the times of a cell, in turns, medians of options->repeat. methods: names between commas;
 * NULL: every one that builds maps. */
bool bench_map_times(const bench_cell *cell, const bench_options *options, const char *methods,
                     cli_error *error);

#endif
