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

/* A corner in the frame's axes, and its weights of the triangle's 2nd and 3rd vertex. */
typedef struct framed {
    double at[3], weight[2];
} framed;

static void project(const ss_frame *frame, const framed *c, ss_scan_corner *out) {
    const double s = 1 / (1 + c->at[2] * frame->inverse);
    out->x = (c->at[0] * s - frame->low[0]) / frame->texel;
    out->y = (c->at[1] * s - frame->low[1]) / frame->texel;
    out->attribute[0] = c->at[2] * s;
    for (int k = 0; k < 2; k++) out->attribute[1 + k] = c->weight[k] * s;
}

/* Where the edge meets the near plane. */
static void meet(const ss_frame *frame, const framed *from, const framed *to, framed *out) {
    const double t = (frame->nearest - from->at[2]) / (to->at[2] - from->at[2]);
    for (int k = 0; k < 2; k++) {
        out->at[k] = from->at[k] + t * (to->at[k] - from->at[k]);
        out->weight[k] = from->weight[k] + t * (to->weight[k] - from->weight[k]);
    }
    out->at[2] = frame->nearest;
}

int ss_clip_caster(const ss_frame *frame, const double corner[3][3],
                   ss_scan_corner out[SS_CLIP_MOST]) {
    framed c[3] = {{.weight = {0, 0}}, {.weight = {1, 0}}, {.weight = {0, 1}}};
    int count = 0;
    for (int i = 0; i < 3; i++) {
        double d[3];
        ss_sub(corner[i], frame->origin, d);
        c[i].at[0] = ss_dot(d, frame->x), c[i].at[1] = ss_dot(d, frame->y);
        c[i].at[2] = ss_dot(d, frame->z);
    }
    for (int i = 0; i < 3; i++) {
        const framed *a = &c[i], *b = &c[(i + 1) % 3];
        const bool in = a->at[2] > frame->nearest, next = b->at[2] > frame->nearest;
        if (in) project(frame, a, &out[count++]);
        if (in == next) continue;
        framed cut;
        meet(frame, in ? b : a, in ? a : b, &cut); /* always from the corner that is out */
        project(frame, &cut, &out[count++]);
    }
    return count < 3 ? 0 : ss_clip_guard(out, count, SS_CASTER_ATTRIBUTES);
}
