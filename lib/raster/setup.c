/* The fill rule's arithmetic: corners on a grid of 1/256 texel, edge functions in whole numbers.
 *
 * based on: [Pin88]. The functions are exact, so that neighbours agree about every centre. Centres
 * lie 256 steps apart, so a function's low eight bits never change across the map: dropping them
 * (floor) keeps every sign and makes 32 bits enough inside a block. */
#include "raster/setup.h"

#include <math.h>

/* Beyond what a block of 32 x 32 texels can change: |edge| < 2^24, 31 + 31 steps. */
#define LARGE (1 << 30)

bool ss_scan_snap(ss_scan *scan, const ss_scan_corner corner[3], uint32_t resolution) {
    for (int i = 0; i < 3; i++) {
        scan->x[i] = (int32_t)lrint(corner[i].x * SS_SUBTEXELS);
        scan->y[i] = (int32_t)lrint(corner[i].y * SS_SUBTEXELS);
    }
    return ss_scan_box(scan, resolution);
}

void ss_scan_gradients(ss_scan *scan, const ss_scan_corner corner[3], uint32_t used) {
    const double x[3] = {corner[0].x, corner[1].x, corner[2].x},
                 y[3] = {corner[0].y, corner[1].y, corner[2].y};
    const ss_scan_plane plane = ss_scan_plane_of(scan, x, y);
    for (uint32_t k = 0; k < used; k++) {
        const double at[3] = {corner[0].attribute[k], corner[1].attribute[k],
                              corner[2].attribute[k]};
        ss_scan_gradient(scan, &plane, k, at);
    }
}

/* The function is positive inside. */
static inline bool set_edge(ss_scan_edge *e, const ss_scan *s, int i, int j, int32_t x, int32_t y) {
    const int32_t dx = s->x[j] - s->x[i], dy = s->y[j] - s->y[i];
    const int64_t px = (int64_t)x * SS_SUBTEXELS + 128 - s->x[i];
    const int64_t py = (int64_t)y * SS_SUBTEXELS + 128 - s->y[i];
    int64_t value = dx * py - dy * px - !ss_scan_top_or_left(dx, dy);
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
