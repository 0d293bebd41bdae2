/* One triangle at a time into one band of rows. */
#ifndef SS_RASTER_CPU_SCAN_H
#define SS_RASTER_CPU_SCAN_H

#include "raster/raster.h"

#define SS_BAND 32       /* rows of a band, and side of the blocks it is walked in */
#define SS_SUBTEXELS 256
#define SS_GUARD 32768.0 /* corners are clipped to +- this many texels: edges then fit in 32 bits */

/* A corner in map coordinates, and what varies. */
typedef struct ss_scan_corner {
    double x, y, attribute[SS_RASTER_ATTRIBUTES];
} ss_scan_corner;

/* A triangle ready to be walked: snapped, counter-clockwise. */
typedef struct ss_scan {
    int32_t x[3], y[3];                /* in subtexels */
    int32_t first_x, last_x, first_y, last_y; /* texels whose centres can be inside, clamped to the map */
    float start[SS_RASTER_ATTRIBUTES]; /* at the centre of texel (first_x, first_y) */
    float step_x[SS_RASTER_ATTRIBUTES], step_y[SS_RASTER_ATTRIBUTES];
    float least[SS_RASTER_ATTRIBUTES], most[SS_RASTER_ATTRIBUTES]; /* of the corners */
} ss_scan;

/* Only what says which rows it touches; false: it covers no texel. */
bool ss_scan_snap(ss_scan *scan, const ss_scan_corner corner[3], uint32_t resolution);
/* The gradients of the first `used` attributes, from the corners as they were before snapping. */
void ss_scan_gradients(ss_scan *scan, const ss_scan_corner corner[3], uint32_t used);

/* Rows first_row .. last_row of the map only. Depth is attribute 0. */
void ss_scan_depth(const ss_scan *scan, int32_t first_row, int32_t last_row, uint32_t resolution,
                   float bias, float *plane);
void ss_scan_peel(const ss_scan *scan, int32_t first_row, int32_t last_row, uint32_t resolution,
                  float bias, const float *above, float *plane);
/* Twice the snapped area, > 0 counter-clockwise. */
int64_t ss_scan_area(const ss_scan *scan);
void ss_scan_runs(const ss_scan *scan, int32_t first_row, int32_t last_row, uint32_t used, uint32_t tag,
                  ss_raster_shade *shade, void *ctx);
/* Like depth, but a texel counts only where keep(ctx, weights of the corners) says so. */
typedef bool ss_scan_keep(void *ctx, const double weight[3]);
void ss_scan_masked(const ss_scan *scan, int32_t first_row, int32_t last_row, uint32_t resolution,
                    float bias, const float *above, float *plane, ss_scan_keep *keep, void *ctx);

#endif
