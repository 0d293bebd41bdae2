/* based on: [SH74]. */
#include "raster/clip.h"

#include <string.h>

#include "base/vec.h"

static void between(const ss_scan_corner *a, const ss_scan_corner *b, double t, uint32_t used,
                    ss_scan_corner *out) {
    out->x = a->x + t * (b->x - a->x), out->y = a->y + t * (b->y - a->y);
    for (uint32_t k = 0; k < used; k++) {
        out->attribute[k] = a->attribute[k] + t * (b->attribute[k] - a->attribute[k]);
    }
}

/* How far inside of guard plane `side` (0: right, 1: top, 2: left, 3: bottom) a corner is. */
static double height(const ss_scan_corner *c, int side) {
    const double value = side & 1 ? c->y : c->x;
    return side & 2 ? value + SS_GUARD : SS_GUARD - value;
}

static int cut_side(const ss_scan_corner *in, int n, int side, uint32_t used, ss_scan_corner *out) {
    int count = 0;
    for (int i = 0; i < n; i++) {
        const ss_scan_corner *a = &in[i], *b = &in[(i + 1) % n];
        const double ha = height(a, side), hb = height(b, side);
        if (ha >= 0) out[count++] = *a;
        if ((ha >= 0) == (hb >= 0)) continue;
        /* always from the corner that is out */
        if (ha < 0) between(a, b, ha / (ha - hb), used, &out[count++]);
        else between(b, a, hb / (hb - ha), used, &out[count++]);
    }
    return count;
}

int ss_clip_guard(ss_scan_corner corner[SS_CLIP_MOST], int count, uint32_t used) {
    ss_scan_corner other[SS_CLIP_MOST];
    for (int side = 0; side < 4 && count >= 3; side++) {
        count = cut_side(corner, count, side, used, other);
        memcpy(corner, other, sizeof other);
    }
    return count < 3 ? 0 : count;
}

static void project(const ss_frame *frame, const double c[3], ss_scan_corner *out) {
    const double s = 1 / (1 + c[2] * frame->inverse);
    out->x = (c[0] * s - frame->low[0]) / frame->texel;
    out->y = (c[1] * s - frame->low[1]) / frame->texel;
    out->attribute[0] = c[2] * s;
}

int ss_clip_caster(const ss_frame *frame, const double corner[3][3], ss_scan_corner out[SS_CLIP_MOST]) {
    double c[3][3];
    int count = 0;
    for (int i = 0; i < 3; i++) {
        double d[3];
        ss_sub(corner[i], frame->origin, d);
        c[i][0] = ss_dot(d, frame->x), c[i][1] = ss_dot(d, frame->y), c[i][2] = ss_dot(d, frame->z);
    }
    for (int i = 0; i < 3; i++) {
        const double *a = c[i], *b = c[(i + 1) % 3];
        const bool in = a[2] > frame->nearest, next = b[2] > frame->nearest;
        if (in) project(frame, a, &out[count++]);
        if (in == next) continue;
        const double *from = in ? b : a, *to = in ? a : b; /* always from the corner that is out */
        const double t = (frame->nearest - from[2]) / (to[2] - from[2]);
        double at[3];
        for (int k = 0; k < 2; k++) at[k] = from[k] + t * (to[k] - from[k]);
        at[2] = frame->nearest;
        project(frame, at, &out[count++]);
    }
    return count < 3 ? 0 : ss_clip_guard(out, count, 1);
}
