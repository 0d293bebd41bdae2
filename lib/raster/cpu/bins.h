/* Which triangles touch which band of rows, in their own order: bands are then drawn by any thread. */
#ifndef SS_RASTER_CPU_BINS_H
#define SS_RASTER_CPU_BINS_H

#include "raster/cpu/scan.h"

typedef struct ss_bins {
    uint32_t bands;
    uint32_t *first; /* bands + 1 */
    uint32_t *item;
} ss_bins;

/* The rows item i touches, within the map; false: none. Called once an item. */
typedef bool ss_bin_rows(const void *ctx, size_t i, int32_t *first, int32_t *last);

softshadow_status ss_bins_build(ss_bins *bins, size_t n, uint32_t resolution, ss_bin_rows *rows,
                                const void *ctx, ss_pool *pool);
void ss_bins_free(ss_bins *bins);

#endif
