/* Which triangles touch which band of rows, in their own order: bands are then drawn by any
 * thread. */
#ifndef SS_RASTER_CPU_BINS_H
#define SS_RASTER_CPU_BINS_H

#include "raster/cpu/scan.h"

typedef struct ss_bins {
    uint32_t bands;
    uint32_t *first; /* bands + 1 */
    uint32_t *order; /* bands, those with most items first: no thread is left alone with one */
    uint32_t *item; /* with SS_BIN_MARK, where it has one: see ss_bin_spans */
} ss_bins;
#define SS_BIN_MARK 0x80000000u

/* The rows item i touches, within the map; false: none. Called once an item. */
typedef bool ss_bin_rows(const void *ctx, size_t i, int32_t *first, int32_t *last);
/* The same of items begin .. end - 1: the first band and one after the last, 0 0 for none; with
 * SS_BIN_MARKED in the first, items get the mark. */
typedef uint16_t ss_bin_span[2];
typedef void ss_bin_spans(const void *ctx, size_t begin, size_t end, ss_bin_span *span);
#define SS_BIN_MARKED 0x8000u

/* By `spans`, or by rows where it is NULL. */
softshadow_status ss_bins_build(ss_bins *bins, size_t n, uint32_t resolution, ss_bin_rows *rows,
                                ss_bin_spans *spans, const void *ctx, ss_pool *pool);
void ss_bins_free(ss_bins *bins);

#endif
