/* A triangle made ready for whatever machine walks it: every backend covers the same texels. */
#ifndef SS_RASTER_SETUP_H
#define SS_RASTER_SETUP_H

#include "raster/raster.h"

#define SS_SCAN_BLOCK 32 /* largest side of a block */
#define SS_SUBTEXELS 256
#define SS_GUARD 32768.0 /* corners are clipped to +- this many texels: edges then fit in 32 bits */

/* A corner in map coordinates, and what varies. */
typedef struct ss_scan_corner {
    double x, y, attribute[SS_RASTER_ATTRIBUTES];
} ss_scan_corner;

/* A triangle ready to be walked: snapped, its corners in the order given. */
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

/* Twice the snapped area, > 0 counter-clockwise. */
int64_t ss_scan_area(const ss_scan *scan);

/* One edge inside one block: its value at the block's first centre, and its steps. A texel is inside
 * where no edge's value is negative. */
typedef struct ss_scan_edge {
    int32_t at, right, up;
} ss_scan_edge;

/* A block of the map's texels, edges counter-clockwise and rebased to its corner. */
typedef struct ss_scan_block {
    ss_scan_edge e[3];
    int32_t x, y, width, height;
} ss_scan_block;

/* Sets the edges from place and size; false: the triangle covers none of it. */
bool ss_scan_block_set(ss_scan_block *block, const ss_scan *scan);

#endif
