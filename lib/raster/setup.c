/* The fill rule's arithmetic: corners on a grid of 1/256 texel, edge functions in whole numbers.
 *
 * based on: [Pin88]. The functions are exact, so that neighbours agree about every centre. Centres lie
 * 256 steps apart, so a function's low eight bits never change across the map: dropping them (floor)
 * keeps every sign and makes 32 bits enough inside a block. */
#include "raster/setup.h"

#include <math.h>

/* Beyond what a block of 32 x 32 texels can change: |edge| < 2^24, 31 + 31 steps. */
#define LARGE (1 << 30)

/* Not fmin and fmax: those are calls. */
static inline double less(double a, double b) { return a < b ? a : b; }
static inline double more(double a, double b) { return a > b ? a : b; }

bool ss_scan_snap(ss_scan *scan, const ss_scan_corner corner[3], uint32_t resolution) {
    int32_t low[2] = {INT32_MAX, INT32_MAX}, high[2] = {INT32_MIN, INT32_MIN};
    for (int i = 0; i < 3; i++) {
        scan->x[i] = (int32_t)lrint(corner[i].x * SS_SUBTEXELS);
        scan->y[i] = (int32_t)lrint(corner[i].y * SS_SUBTEXELS);
        low[0] = scan->x[i] < low[0] ? scan->x[i] : low[0];
        low[1] = scan->y[i] < low[1] ? scan->y[i] : low[1];
        high[0] = scan->x[i] > high[0] ? scan->x[i] : high[0];
        high[1] = scan->y[i] > high[1] ? scan->y[i] : high[1];
    }
    /* centres are at 256 i + 128 */
    scan->first_x = (low[0] + 127) >> 8, scan->last_x = (high[0] - 128) >> 8;
    scan->first_y = (low[1] + 127) >> 8, scan->last_y = (high[1] - 128) >> 8;
    const int32_t last = (int32_t)resolution - 1;
    if (scan->first_x < 0) scan->first_x = 0;
    if (scan->first_y < 0) scan->first_y = 0;
    if (scan->last_x > last) scan->last_x = last;
    if (scan->last_y > last) scan->last_y = last;
    return scan->first_x <= scan->last_x && scan->first_y <= scan->last_y;
}

int64_t ss_scan_area(const ss_scan *s) {
    return (int64_t)(s->x[1] - s->x[0]) * (s->y[2] - s->y[0]) -
           (int64_t)(s->x[2] - s->x[0]) * (s->y[1] - s->y[0]);
}

/* From the corners as given: snapping moves what is covered, not what it says. */
void ss_scan_gradients(ss_scan *scan, const ss_scan_corner corner[3], uint32_t used) {
    const double ax = corner[1].x - corner[0].x, ay = corner[1].y - corner[0].y;
    const double bx = corner[2].x - corner[0].x, by = corner[2].y - corner[0].y;
    const double area = ax * by - bx * ay;
    const double size = more(more(fabs(ax), fabs(ay)), more(fabs(bx), fabs(by)));
    /* Thinner than rounding can tell: no gradient, which the clamp would have eaten anyway. */
    const double per = fabs(area) > 1e-12 * size * size ? 1 / area : 0;
    const double dx = scan->first_x + 0.5 - corner[0].x, dy = scan->first_y + 0.5 - corner[0].y;
    for (uint32_t k = 0; k < used; k++) {
        const double a = corner[1].attribute[k] - corner[0].attribute[k];
        const double b = corner[2].attribute[k] - corner[0].attribute[k];
        const double sx = (a * by - b * ay) * per, sy = (b * ax - a * bx) * per;
        const double at = corner[0].attribute[k];
        scan->start[k] = (float)(at + sx * dx + sy * dy);
        scan->step_x[k] = (float)sx, scan->step_y[k] = (float)sy;
        scan->least[k] = (float)(at + less(0, less(a, b)));
        scan->most[k] = (float)(at + more(0, more(a, b)));
    }
}

static inline bool top_or_left(int32_t dx, int32_t dy) { return dy < 0 || (dy == 0 && dx < 0); }

/* Counter-clockwise with Y up: the inside is on the left, where the function is positive. A left
 * edge runs down; a top edge, horizontal at the upper end, runs left. */
static inline bool set_edge(ss_scan_edge *e, const ss_scan *s, int i, int j, int32_t x, int32_t y) {
    const int32_t dx = s->x[j] - s->x[i], dy = s->y[j] - s->y[i];
    const int64_t px = (int64_t)x * SS_SUBTEXELS + 128 - s->x[i];
    const int64_t py = (int64_t)y * SS_SUBTEXELS + 128 - s->y[i];
    int64_t value = dx * py - dy * px - !top_or_left(dx, dy);
    value >>= 8; /* floor */
    e->right = -dy, e->up = dx;
    e->at = (int32_t)(value > LARGE ? LARGE : value < -LARGE ? -LARGE : value);
    return value >= -LARGE;
}

bool ss_scan_block_set(ss_scan_block *b, const ss_scan *s) {
    const bool turn = ss_scan_area(s) < 0;
    const int order[3] = {0, turn ? 2 : 1, turn ? 1 : 2};
    for (int i = 0; i < 3; i++) {
        ss_scan_edge *e = &b->e[i];
        if (!set_edge(e, s, order[i], order[(i + 1) % 3], b->x, b->y)) return false;
        /* the best corner of the block */
        const int32_t right = e->right > 0 ? e->right * (b->width - 1) : 0;
        const int32_t up = e->up > 0 ? e->up * (b->height - 1) : 0;
        if (e->at + right + up < 0) return false;
    }
    return true;
}
