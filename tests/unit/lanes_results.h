#ifndef TESTS_UNIT_LANES_RESULTS_H
#define TESTS_UNIT_LANES_RESULTS_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#define LANES_OPS    40
#define LANES_FLOATS 20 /* operations up to here give floats */

typedef struct lanes_results {
    uint64_t digest[LANES_OPS];
} lanes_results;

void lanes_plain(lanes_results *out);
void lanes_sse2(lanes_results *out);

#endif
