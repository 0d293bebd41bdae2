/* A triangle made ready for whatever machine walks it: every backend covers the same texels. */
#ifndef SS_RASTER_SETUP_H
#define SS_RASTER_SETUP_H

#include <math.h>

#include "raster/raster.h"

#define SS_SCAN_BLOCK 32 /* largest side of a block */
#define SS_SUBTEXELS 256
#define SS_GUARD 32768.0 /* corners are clipped to +- this many texels: edges then fit in 32 bits */

/* Before loops over corners, edges, attributes: not more than four, and -O2 would go round. */
#define SS_UNROLL _Pragma("GCC unroll 4")

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

/* The texels whose centres can be inside, from the snapped corners; false: there are none. */
static inline bool ss_scan_box(ss_scan *s, uint32_t resolution) {
    int32_t low[2] = {s->x[0], s->y[0]}, high[2] = {s->x[0], s->y[0]};
    SS_UNROLL
    for (int i = 1; i < 3; i++) {
        low[0] = s->x[i] < low[0] ? s->x[i] : low[0], low[1] = s->y[i] < low[1] ? s->y[i] : low[1];
        high[0] = s->x[i] > high[0] ? s->x[i] : high[0];
        high[1] = s->y[i] > high[1] ? s->y[i] : high[1];
    }
    /* centres are at 256 i + 128 */
    s->first_x = (low[0] + 127) >> 8, s->last_x = (high[0] - 128) >> 8;
    s->first_y = (low[1] + 127) >> 8, s->last_y = (high[1] - 128) >> 8;
    const int32_t last = (int32_t)resolution - 1;
    if (s->first_x < 0) s->first_x = 0;
    if (s->first_y < 0) s->first_y = 0;
    if (s->last_x > last) s->last_x = last;
    if (s->last_y > last) s->last_y = last;
    return s->first_x <= s->last_x && s->first_y <= s->last_y;
}

/* Only what says which rows it touches; false: it covers no texel. */
bool ss_scan_snap(ss_scan *scan, const ss_scan_corner corner[3], uint32_t resolution);
/* What gradients need of the corners, as they were before snapping: that moves what is covered, not
 * what it says. */
typedef struct ss_scan_plane {
    double ax, ay, bx, by, per_area, dx, dy;
} ss_scan_plane;

static inline double ss_scan_less(double a, double b) { return a < b ? a : b; }
static inline double ss_scan_more(double a, double b) { return a > b ? a : b; }

static inline ss_scan_plane ss_scan_plane_of(const ss_scan *s, const double x[3],
                                             const double y[3]) {
    const double ax = x[1] - x[0], ay = y[1] - y[0], bx = x[2] - x[0], by = y[2] - y[0];
    const double area = ax * by - bx * ay;
    const double size = ss_scan_more(ss_scan_more(fabs(ax), fabs(ay)),
                                     ss_scan_more(fabs(bx), fabs(by)));
    /* Thinner than rounding can tell: no gradient, which the clamp would have eaten anyway. */
    const double per = fabs(area) > 1e-12 * size * size ? 1 / area : 0;
    return (ss_scan_plane){ax, ay, bx, by, per, s->first_x + 0.5 - x[0], s->first_y + 0.5 - y[0]};
}

/* Of attribute k, which is at[] at the corners. */
static inline void ss_scan_gradient(ss_scan *scan, const ss_scan_plane *p, uint32_t k,
                                    const double at[3]) {
    const double a = at[1] - at[0], b = at[2] - at[0];
    const double sx = (a * p->by - b * p->ay) * p->per_area,
                 sy = (b * p->ax - a * p->bx) * p->per_area;
    scan->start[k] = (float)(at[0] + sx * p->dx + sy * p->dy);
    scan->step_x[k] = (float)sx, scan->step_y[k] = (float)sy;
    scan->least[k] = (float)(at[0] + ss_scan_less(0, ss_scan_less(a, b)));
    scan->most[k] = (float)(at[0] + ss_scan_more(0, ss_scan_more(a, b)));
}

/* The gradients of the first `used` attributes. */
void ss_scan_gradients(ss_scan *scan, const ss_scan_corner corner[3], uint32_t used);

/* Twice the snapped area, > 0 counter-clockwise. */
static inline int64_t ss_scan_area(const ss_scan *s) {
    return (int64_t)(s->x[1] - s->x[0]) * (s->y[2] - s->y[0]) -
           (int64_t)(s->x[2] - s->x[0]) * (s->y[1] - s->y[0]);
}

/* The inside is on the left of an edge, counter-clockwise with Y up. A left edge runs down; a top
 * edge, horizontal at the upper end, runs left. */
static inline bool ss_scan_top_or_left(int32_t dx, int32_t dy) {
    return dy < 0 || (dy == 0 && dx < 0);
}

/* One edge inside one block: its value at the block's first centre, and its steps. A texel is
 * inside where no edge's value is negative. */
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
