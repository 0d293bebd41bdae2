/* One triangle at a time into one band of rows. */
#ifndef SS_RASTER_CPU_SCAN_H
#define SS_RASTER_CPU_SCAN_H

#include "raster/setup.h"

#define SS_BAND SS_SCAN_BLOCK /* rows of a band, and side of the blocks it is walked in */

/* Rows first_row .. last_row of the map only. Depth is attribute 0. */
void ss_scan_depth(const ss_scan *scan, int32_t first_row, int32_t last_row, uint32_t resolution,
                   float bias, float *plane);
void ss_scan_peel(const ss_scan *scan, int32_t first_row, int32_t last_row, uint32_t resolution,
                  float bias, const float *above, float *plane);
void ss_scan_runs(const ss_scan *scan, int32_t first_row, int32_t last_row, uint32_t used,
                  uint32_t tag, ss_raster_shade *shade, void *ctx);
/* The same within a box, first and last column and row: {x, y, x, y}; at most a block. */
void ss_scan_tile_runs(const ss_scan *scan, const int32_t box[4], uint32_t tag,
                       ss_raster_shade *shade, void *ctx);
/* Triangles of a few texels, which is what meshes are made of: the same texels and bits as
 * ss_scan_depth or, where `above` is given, ss_scan_peel, with less ado. */
static inline bool ss_scan_is_small(const ss_scan *s) {
    const int32_t most = (SS_BAND - 2) * SS_SUBTEXELS;
    SS_UNROLL
    for (int i = 1; i < 3; i++) {
        const int32_t x = s->x[i] - s->x[0], y = s->y[i] - s->y[0];
        if (x > most / 2 || y > most / 2 || x < -most / 2 || y < -most / 2) return false;
    }
    return true;
}
void ss_scan_small(const ss_scan *scan, int32_t first_row, int32_t last_row, uint32_t resolution,
                   float bias, const float *above, float *plane);
/* Is there no texel where a small triangle is that holds something deeper than `least`, and less
 * than `most` above, if that is given? */
bool ss_scan_hidden(const ss_scan *scan, int32_t first_row, int32_t last_row, uint32_t resolution,
                    float least, float most, const float *above, const float *plane);
/* Like depth, but a texel counts only where keep(ctx, weights of the corners) says so. */
typedef bool ss_scan_keep(void *ctx, const double weight[3]);
void ss_scan_masked(const ss_scan *scan, int32_t first_row, int32_t last_row, uint32_t resolution,
                    float bias, const float *above, float *plane, ss_scan_keep *keep, void *ctx);

#endif
