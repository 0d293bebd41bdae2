/* One triangle at a time into one band of rows. */
#ifndef SS_RASTER_CPU_SCAN_H
#define SS_RASTER_CPU_SCAN_H

#include "raster/setup.h"

#define SS_BAND SS_SCAN_BLOCK /* rows of a band, and side of the blocks it is walked in */

/* Where depths go, which are attribute 0: rows first .. last of the map only; only what is below
 * `above`, if that is given, by more than the share `alike`. With `second` the nearest below the
 * plane goes there in the same pass. That misses one case, and says so: the nearest came after what
 * is alike, to which something was alike that is not alike to the nearest. */
typedef struct ss_scan_rows {
    int32_t first, last;
    uint32_t resolution;
    const float *above;
    float alike;
    float *plane, *second;
    bool *doubt;
} ss_scan_rows;

void ss_scan_depth(const ss_scan *scan, const ss_scan_rows *rows, float bias);
/* Rows first_row .. last_row, too. */
void ss_scan_runs(const ss_scan *scan, int32_t first_row, int32_t last_row, uint32_t used,
                  uint32_t tag, ss_raster_shade *shade, void *ctx);
/* The same by lines, within a box, first and last column and row: {x, y, x, y}; at most a block. */
void ss_scan_tile_runs(const ss_scan *scan, const int32_t box[4], uint32_t tag,
                       ss_raster_shade *shade, void *ctx);
/* Triangles of a few texels, which is what meshes are made of: the same texels and bits as
 * ss_scan_depth, with less ado. */
static inline bool ss_scan_is_small(const ss_scan *s) {
    const int32_t most = (SS_BAND - 2) * SS_SUBTEXELS;
    SS_UNROLL
    for (int i = 1; i < 3; i++) {
        const int32_t x = s->x[i] - s->x[0], y = s->y[i] - s->y[0];
        if (x > most / 2 || y > most / 2 || x < -most / 2 || y < -most / 2) return false;
    }
    return true;
}
void ss_scan_small(const ss_scan *scan, const ss_scan_rows *rows, float bias);
/* Is there no texel where a small triangle is that holds something deeper than `least`, and has
 * less than `most` above? For rows of one plane. */
bool ss_scan_hidden(const ss_scan *scan, const ss_scan_rows *rows, float least, float most);
/* Like depth, but a texel counts only where keep(ctx, weights of the corners) says so. */
typedef bool ss_scan_keep(void *ctx, const double weight[3]);
void ss_scan_masked(const ss_scan *scan, const ss_scan_rows *rows, float bias, ss_scan_keep *keep,
                    void *ctx);

#endif
