/* A triangle, or a convex quadrilateral, made ready for whatever machine walks it: every backend
 * covers the same texels. */
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

/* An edge's function at the centre of a triangle's first texel, and its steps. */
typedef struct ss_scan_line {
    int64_t at;
    int32_t right, up;
} ss_scan_line;

/* A triangle ready to be walked: snapped, its corners in the order given; or a quadrilateral, which
 * has lines only. */
typedef struct ss_scan {
    int32_t x[3], y[3];                /* in subtexels */
    int32_t first_x, last_x, first_y, last_y; /* texels whose centres can be inside, clamped to the map */
    float start[SS_RASTER_ATTRIBUTES]; /* at the centre of texel (first_x, first_y) */
    float step_x[SS_RASTER_ATTRIBUTES], step_y[SS_RASTER_ATTRIBUTES];
    float least[SS_RASTER_ATTRIBUTES], most[SS_RASTER_ATTRIBUTES]; /* of the corners */
    ss_scan_line line[4]; /* only by ss_scan_lines() and ss_scan_quad(), counter-clockwise; a
                             triangle's last one has all inside */
} ss_scan;

/* The texels whose centres can be inside of such bounds, in subtexels; false: there are none. */
static inline bool ss_scan_span(ss_scan *s, const int32_t low[2], const int32_t high[2],
                                uint32_t resolution) {
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

/* The same from a triangle's snapped corners. */
static inline bool ss_scan_box(ss_scan *s, uint32_t resolution) {
    int32_t low[2] = {s->x[0], s->y[0]}, high[2] = {s->x[0], s->y[0]};
    SS_UNROLL
    for (int i = 1; i < 3; i++) {
        low[0] = s->x[i] < low[0] ? s->x[i] : low[0], low[1] = s->y[i] < low[1] ? s->y[i] : low[1];
        high[0] = s->x[i] > high[0] ? s->x[i] : high[0];
        high[1] = s->y[i] > high[1] ? s->y[i] : high[1];
    }
    return ss_scan_span(s, low, high, resolution);
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

/* Of the line from a to b, at texel (x, y). The function is positive inside. */
static inline ss_scan_line ss_scan_line_of(const int32_t a[2], const int32_t b[2], int32_t x,
                                           int32_t y) {
    const int32_t dx = b[0] - a[0], dy = b[1] - a[1];
    const int64_t px = (int64_t)x * SS_SUBTEXELS + 128 - a[0];
    const int64_t py = (int64_t)y * SS_SUBTEXELS + 128 - a[1];
    const int64_t value = dx * py - dy * px - !ss_scan_top_or_left(dx, dy);
    return (ss_scan_line){value >> 8 /* floor */, -dy, dx};
}

static inline ss_scan_line ss_scan_line_at(const ss_scan *s, int i, int j, int32_t x, int32_t y) {
    const int32_t a[2] = {s->x[i], s->y[i]}, b[2] = {s->x[j], s->y[j]};
    return ss_scan_line_of(a, b, x, y);
}

/* For triangles that are asked about block after block. */
static inline void ss_scan_lines(ss_scan *s) {
    const bool turn = ss_scan_area(s) < 0;
    const int order[4] = {0, turn ? 2 : 1, turn ? 1 : 2, 0};
    SS_UNROLL
    for (int i = 0; i < 3; i++)
        s->line[i] = ss_scan_line_at(s, order[i], order[i + 1], s->first_x, s->first_y);
    s->line[3] = (ss_scan_line){0};
}

/* A convex quadrilateral with its lines and the gradients of all attributes; false: it covers no
 * texel, or is not convex once it is snapped, and has to be drawn as two triangles. */
bool ss_scan_quad(ss_scan *scan, const ss_scan_corner corner[4], uint32_t resolution);
/* To one of the two, the bits that the whole has at each texel. */
void ss_scan_share(ss_scan *half, const ss_scan *whole);

/* One edge inside one block: its value at the block's first centre, and its steps. A texel is
 * inside where no edge's value is negative. */
typedef struct ss_scan_edge {
    int32_t at, right, up;
} ss_scan_edge;

/* A block of the map's texels, edges counter-clockwise and rebased to its corner. */
typedef struct ss_scan_block {
    ss_scan_edge e[4];
    int32_t x, y, width, height;
} ss_scan_block;

/* Beyond what a block of 32 x 32 texels can change: |edge| < 2^24, 31 + 31 steps. */
#define SS_SCAN_LARGE (1 << 30)

/* False: all of the block is outside of the edge, as its best corner is. */
static inline bool ss_scan_block_edge(ss_scan_block *b, int i, const ss_scan_line *line) {
    const int64_t at = line->at;
    ss_scan_edge *e = &b->e[i];
    e->right = line->right, e->up = line->up;
    e->at = (int32_t)(at > SS_SCAN_LARGE ? SS_SCAN_LARGE : at < -SS_SCAN_LARGE ? -SS_SCAN_LARGE : at);
    const int32_t right = e->right > 0 ? e->right * (b->width - 1) : 0;
    const int32_t up = e->up > 0 ? e->up * (b->height - 1) : 0;
    return at >= -SS_SCAN_LARGE && e->at + right + up >= 0;
}

/* Sets the edges from a triangle, by place and size; false: it covers none of it. */
bool ss_scan_block_set(ss_scan_block *block, const ss_scan *scan);
/* The same by a polygon's first three or four lines. */
static inline __attribute__((always_inline)) bool ss_scan_block_lines(ss_scan_block *b,
                                                                      const ss_scan *s, int lines) {
    SS_UNROLL
    for (int i = 0; i < lines; i++) {
        ss_scan_line line = s->line[i];
        line.at += (int64_t)(b->x - s->first_x) * line.right + (int64_t)(b->y - s->first_y) * line.up;
        if (!ss_scan_block_edge(b, i, &line)) return false;
    }
    return true;
}

#endif
