/* The fill rule's arithmetic: corners on a grid of 1/256 texel, edge functions in whole numbers.
 *
 * based on: [Pin88]. The functions are exact, so that neighbours agree about every centre. Centres
 * lie 256 steps apart, so a function's low eight bits never change across the map: dropping them
 * (floor) keeps every sign and makes 32 bits enough inside a block. */
#include "raster/setup.h"

#include <math.h>

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

bool ss_scan_block_set(ss_scan_block *b, const ss_scan *s) {
    const bool turn = ss_scan_area(s) < 0;
    const int order[4] = {0, turn ? 2 : 1, turn ? 1 : 2, 0};
    for (int i = 0; i < 3; i++) {
        const ss_scan_line line = ss_scan_line_at(s, order[i], order[i + 1], b->x, b->y);
        if (!ss_scan_block_edge(b, i, &line)) return false;
    }
    return true;
}
