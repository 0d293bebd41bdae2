/* The fill rule's arithmetic: corners on a grid of 1/256 texel, edge functions in whole numbers.
 *
 * based on: [Pin88]. The functions are exact, so that neighbours agree about every centre. Centres
 * lie 256 steps apart, so a function's low eight bits never change across the map: dropping them
 * (floor) keeps every sign and makes 32 bits enough inside a block. */
#include "raster/setup.h"

#include <math.h>
#include <string.h>

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

static int64_t turn_at(const int32_t a[2], const int32_t b[2], const int32_t c[2]) {
    return (int64_t)(b[0] - a[0]) * (c[1] - b[1]) - (int64_t)(b[1] - a[1]) * (c[0] - b[0]);
}

/* 1: counter-clockwise, -1: clockwise, 0: neither. */
static int winding(int32_t p[4][2]) {
    bool left = false, right = false;
    for (int i = 0; i < 4; i++) {
        const int64_t turn = turn_at(p[i], p[(i + 1) % 4], p[(i + 2) % 4]);
        left |= turn > 0, right |= turn < 0;
    }
    return left - right;
}

static void quad_lines(ss_scan *s, int32_t p[4][2], int way) {
    for (int i = 0; i < 4; i++) {
        const int32_t *a = p[way > 0 ? i : 3 - i], *b = p[way > 0 ? (i + 1) % 4 : (6 - i) % 4];
        s->line[i] = (ss_scan_line){0}; /* of corners that are the same: all are inside */
        if (a[0] != b[0] || a[1] != b[1])
            s->line[i] = ss_scan_line_of(a, b, s->first_x, s->first_y);
    }
}

/* Gradients are those of the half that is larger. */
static void quad_gradients(ss_scan *s, const ss_scan_corner corner[4]) {
    double area[2];
    for (int i = 0; i < 2; i++) {
        const ss_scan_corner *a = &corner[0], *b = &corner[1 + i], *c = &corner[2 + i];
        area[i] = fabs((b->x - a->x) * (c->y - a->y) - (c->x - a->x) * (b->y - a->y));
    }
    const bool last = area[1] > area[0];
    const ss_scan_corner half[3] = {corner[0], corner[1 + last], corner[2 + last]};
    const ss_scan_corner *other = &corner[last ? 1 : 3];
    ss_scan_gradients(s, half, SS_RASTER_ATTRIBUTES);
    for (int k = 0; k < SS_RASTER_ATTRIBUTES; k++) {
        s->least[k] = fminf(s->least[k], (float)other->attribute[k]);
        s->most[k] = fmaxf(s->most[k], (float)other->attribute[k]);
    }
}

bool ss_scan_quad(ss_scan *s, const ss_scan_corner corner[4], uint32_t resolution) {
    int32_t p[4][2], low[2], high[2];
    for (int i = 0; i < 4; i++) {
        p[i][0] = (int32_t)lrint(corner[i].x * SS_SUBTEXELS);
        p[i][1] = (int32_t)lrint(corner[i].y * SS_SUBTEXELS);
    }
    for (int k = 0; k < 2; k++) {
        low[k] = high[k] = p[0][k];
        for (int i = 1; i < 4; i++) {
            if (p[i][k] < low[k]) low[k] = p[i][k];
            if (p[i][k] > high[k]) high[k] = p[i][k];
        }
    }
    const int way = winding(p);
    if (way == 0 || !ss_scan_span(s, low, high, resolution)) return false;
    quad_lines(s, p, way);
    quad_gradients(s, corner);
    return true;
}

void ss_scan_share(ss_scan *half, const ss_scan *whole) {
    const ss_scan own = *half;
    *half = *whole;
    memcpy(half->x, own.x, sizeof half->x);
    memcpy(half->y, own.y, sizeof half->y);
}

bool ss_scan_block_set(ss_scan_block *b, const ss_scan *s) {
    const bool turn = ss_scan_area(s) < 0;
    const int order[4] = {0, turn ? 2 : 1, turn ? 1 : 2, 0};
    for (int i = 0; i < 3; i++) {
        const ss_scan_line line = ss_scan_line_at(s, order[i], order[i + 1], b->x, b->y);
        if (!ss_scan_block_edge(b, i, &line)) return false;
    }
    b->e[3] = (ss_scan_edge){0};
    return true;
}
