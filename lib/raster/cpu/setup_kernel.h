/* Compiled once for each rung. */
#include <math.h>
#include <string.h>

#include "base/wide.h"
#include "raster/cpu/setup.h"

#define INLINE static inline __attribute__((always_inline))

/* To the nearest whole number, ties to even, as lrintf() has it. */
INLINE void whole_of(const ss_wide *x, ss_wide_ints *out) {
#if SS_FOURS == 4
    *out = (ss_wide_ints)_mm512_cvtps_epi32((__m512)*x);
#elif SS_FOURS == 2
    *out = (ss_wide_ints)_mm256_cvtps_epi32((__m256)*x);
#else
    *out = (ss_wide_ints){(int32_t)lrintf((*x)[0]), (int32_t)lrintf((*x)[1]),
                          (int32_t)lrintf((*x)[2]), (int32_t)lrintf((*x)[3])};
#endif
}

#define INTS_PICK(mask, yes, no) (((mask) & (yes)) | (~(mask) & (no)))

typedef struct corners {
    ss_wide x[3], y[3], h[3];
} corners;

/* Of SS_LANES triangles from t on; *plain: those that nothing cuts. */
INLINE void read_corners(const ss_casters *c, size_t t, corners *out, ss_wide_ints *plain) {
    const uint32_t *index = c->asked->world->indices + 3 * t;
    const float *vertices = &c->vertex->x;
    *plain = ~(ss_wide_ints){0};
    for (int k = 0; k < 3; k++) {
        ss_wide_ints at;
        for (int i = 0; i < SS_LANES; i++) at[i] = (int32_t)(3 * index[3 * i + k]);
        ss_wide_gather(vertices, &at, &out->x[k]);
        ss_wide_gather(vertices + 1, &at, &out->y[k]);
        ss_wide_gather(vertices + 2, &at, &out->h[k]);
        *plain &= out->x[k] == out->x[k];
    }
}

typedef struct snapped {
    ss_wide_ints x[3], y[3], low_x, high_x, low_y, high_y;
} snapped;

INLINE void least_most(const ss_wide_ints v[3], ss_wide_ints *low, ss_wide_ints *high) {
    const ss_wide_ints a = v[0] < v[1], least = INTS_PICK(a, v[0], v[1]);
    const ss_wide_ints most = INTS_PICK(a, v[1], v[0]), b = v[2] < least, d = v[2] > most;
    *low = INTS_PICK(b, v[2], least), *high = INTS_PICK(d, v[2], most);
}

INLINE void snap(const corners *c, snapped *out) {
    for (int k = 0; k < 3; k++) {
        const ss_wide x = c->x[k] * SS_SUBTEXELS, y = c->y[k] * SS_SUBTEXELS;
        whole_of(&x, &out->x[k]), whole_of(&y, &out->y[k]);
    }
    least_most(out->x, &out->low_x, &out->high_x);
    least_most(out->y, &out->low_y, &out->high_y);
}

/* Small triangles that turn their back to the light: the products are far below 2^31. What is not
 * small has no area here. */
INLINE void turned_of(const snapped *s, bool mirrored, ss_wide_ints *out) {
    const int32_t most = SS_SCAN_BLOCK / 2 * SS_SUBTEXELS;
    const ss_wide_ints small = (s->high_x - s->low_x < most) & (s->high_y - s->low_y < most);
    const ss_wide_ints right = small & (s->x[1] - s->x[0]), up = small & (s->y[1] - s->y[0]);
    const ss_wide_ints area =
        right * (small & (s->y[2] - s->y[0])) - (small & (s->x[2] - s->x[0])) * up;
    const ss_wide_ints left = area > 0;
    *out = small & (mirrored ? left : ~left);
}

/* Bands as ss_scan_box() has the rows; *any: those that can cover a texel's centre. */
INLINE void bands_of(const snapped *s, int32_t last, ss_wide_ints *first, ss_wide_ints *end,
                     ss_wide_ints *any) {
    const ss_wide_ints zero = {0}, most = last + zero;
    ss_wide_ints x = (s->low_x + 127) >> 8, to_x = (s->high_x - 128) >> 8;
    ss_wide_ints y = (s->low_y + 127) >> 8, to_y = (s->high_y - 128) >> 8;
    x = INTS_PICK(x < 0, zero, x), y = INTS_PICK(y < 0, zero, y);
    to_x = INTS_PICK(to_x > last, most, to_x), to_y = INTS_PICK(to_y > last, most, to_y);
    *any = (x <= to_x) & (y <= to_y);
    *first = y / SS_BAND, *end = to_y / SS_BAND + 1;
}

/* The triangles that are to be drawn and those that have to be looked at alone: what is not over
 * the map, to know whether it is held, and what is cut. */
INLINE void wanted_of(const ss_casters *c, const corners *at, ss_wide_ints plain,
                      ss_wide_ints *wanted, ss_wide_ints *alone) {
    const ss_raster_casters *asked = c->asked;
    const float most = (float)asked->resolution, near = (float)asked->deepest;
    const float deepest = (double)near > asked->deepest ? nextafterf(near, -INFINITY) : near;
    const ss_wide_ints deep =
        (at->h[0] > deepest) & (at->h[1] > deepest) & (at->h[2] > deepest);
    const ss_wide_ints over =
        ((at->x[0] >= 0) | (at->x[1] >= 0) | (at->x[2] >= 0)) &
        ((at->y[0] >= 0) | (at->y[1] >= 0) | (at->y[2] >= 0)) &
        ((at->x[0] < most) | (at->x[1] < most) | (at->x[2] < most)) &
        ((at->y[0] < most) | (at->y[1] < most) | (at->y[2] < most));
    *alone = ~plain | (~deep & ~over);
    *wanted = ~*alone & ~deep;
}

INLINE void bands_from(const ss_casters *c, size_t t, ss_bin_span *span) {
    const ss_raster_casters *asked = c->asked;
    corners at;
    snapped s;
    ss_wide_ints plain, wanted, alone, turned, first, end, any;
    read_corners(c, t, &at, &plain);
    wanted_of(c, &at, plain, &wanted, &alone);
    for (int k = 0; k < 3; k++) { /* numbers that can be snapped, for all */
        at.x[k] = SS_WIDE_PICK(plain, at.x[k], SS_WIDE_ALL(0.f));
        at.y[k] = SS_WIDE_PICK(plain, at.y[k], SS_WIDE_ALL(0.f));
    }
    snap(&at, &s);
    turned_of(&s, c->mirrored, &turned);
    bands_of(&s, (int32_t)asked->resolution - 1, &first, &end, &any);
    any &= wanted;
    if (asked->front_only) any &= ~turned;
    first = (first | (turned & (int32_t)SS_BIN_MARKED)) & any;
    end = (end & any & ~alone) | (alone & (int32_t)SS_SETUP_ALONE);
    const ss_wide_ints both = first | end << 16;
    for (int i = 0; i < SS_LANES; i++) {
        span[i][0] = (uint16_t)both[i], span[i][1] = (uint16_t)((uint32_t)both[i] >> 16);
        if (asked->held && wanted[i]) asked->held[t + (size_t)i] = 1;
    }
}

void RUNG(ss_setup_bands)(const ss_casters *c, size_t begin, size_t end, ss_bin_span *span) {
    size_t t = begin;
    for (; t + SS_LANES <= end; t += SS_LANES) bands_from(c, t, span + (t - begin));
    for (; t < end; t++) span[t - begin][0] = 0, span[t - begin][1] = SS_SETUP_ALONE;
}
