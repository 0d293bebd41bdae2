/* Lawlor's figure 10 beside the paper's numbers. */
#ifndef CLI_BENCH_FIGURE10_H
#define CLI_BENCH_FIGURE10_H

#include "../error.h"

/* The table on stdout; figure10.csv and a picture a row into the folder, which is made if need
 * be. */
bool bench_figure10(const char *folder, cli_error *error);

#endif
