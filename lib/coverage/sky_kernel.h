/* Compiled once for each rung. */
#include <math.h>

#include "base/wide.h"
#include "coverage/sky.h"

#define ALL(x)     ((x) - (ss_doubles){0})
#define LEAST_SINE 0.01    /* of the light's height over a face */
#define FARTHEST   0x1p+20 /* local units: beyond, rounding takes more than the map's margins */

typedef int32_t wide_ints __attribute__((vector_size(4 * SS_DOUBLES)));

static inline ss_doubles along(const ss_doubles d[3], const double n[3]) {
    return d[0] * n[0] + d[1] * n[1] + d[2] * n[2];
}

static inline ss_doubles root(ss_doubles a) {
#if SS_FOURS == 4
    return (ss_doubles)_mm512_sqrt_pd((__m512d)a);
#elif SS_FOURS == 2
    return (ss_doubles)_mm256_sqrt_pd((__m256d)a);
#else
    return (ss_doubles){sqrt(a[0]), sqrt(a[1])};
#endif
}

/* As floor.h's: over the face, or so little below that the face is touched where it could be
 * met. */
static inline ss_doubles_mask is_over(const ss_sky *sky, const ss_doubles p[3], double ulp) {
    ss_doubles square = {0};
    for (int k = 0; k < 3; k++) square += (p[k] - sky->centre[k]) * (p[k] - sky->centre[k]);
    const ss_doubles way = root(square) * sky->finite + sky->reach;
    const ss_doubles height = along(p, sky->normal) - sky->offset;
    return (sky->lowest >= LEAST_SINE * way) &
           (height * (way + sky->lowest) >= ALL(-2 * ulp * sky->lowest));
}

/* Each lane's number of the map, for lanes that are in it. */
static inline ss_doubles look(const float *map, const wide_ints *at) {
    ss_doubles out = {0};
    for (int i = 0; i < SS_DOUBLES; i++) out[i] = (double)map[(*at)[i]];
    return out;
}

static inline bool any(ss_doubles_mask mask) {
#if SS_FOURS == 4
    return _mm512_movepi64_mask((__m512i)mask) != 0;
#else
    int64_t all = 0;
    for (int i = 0; i < SS_DOUBLES; i++) all |= mask[i];
    return all != 0;
#endif
}

/* Where points are on the plane, and how near: one division does for both. */
static inline void project(const ss_sky_frame *f, const ss_doubles d[3], ss_doubles *x,
                           ss_doubles *y, ss_doubles *nearness, ss_doubles *far) {
    const ss_doubles z = along(d, f->axis[2]);
    *x = along(d, f->axis[0]), *y = along(d, f->axis[1]);
    if (f->sun) {
        *nearness = -z, *far = z;
        return;
    }
    const ss_doubles r = root(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), sum = z + r;
    const ss_doubles one = f->distance / (sum * r), s = 2 * r * one;
    *x *= s, *y *= s, *nearness = (f->distance - r) * sum * one, *far = r;
}

/* Of the points `in` the map those that see nothing. */
static inline ss_doubles_mask dark_of(const ss_sky *sky, ss_doubles_mask in, ss_doubles nearness,
                                      const wide_ints *at) {
    const ss_doubles bin = (nearness - sky->bin_low) * sky->bins;
    for (int i = 0; i < SS_DOUBLES; i++) {
        if (!in[i] || !(bin[i] < SS_SKY_BINS)) {
            in[i] = 0;
            continue;
        }
        const int texel = (*at)[i];
        if (bin[i] < 0) in[i] = -(int64_t)(nearness[i] > (double)sky->below[texel]);
        else in[i] = -(int64_t)(sky->dark[texel] >> (int)bin[i] & 1);
    }
    return in;
}

/* Some of the points, as many as a register holds. What hardly any needs comes last. */
static inline ss_doubles_mask ask(const ss_sky *sky, const ss_doubles p[3], double ulp,
                                  ss_doubles_mask *dark) {
    const ss_sky_frame *f = &sky->frame;
    const double per = 1 / f->texel;
    ss_doubles d[3], x, y, nearness, far;
    for (int k = 0; k < 3; k++) d[k] = p[k] - f->origin[k];
    project(f, d, &x, &y, &nearness, &far);
    const ss_doubles square = x * x + y * y;
    const ss_doubles column = (x - f->low[0]) * per, row = (y - f->low[1]) * per;
    const ss_doubles_mask in = (column >= 0) & (row >= 0) & (column < f->width) &
                               (row < f->height) & (square < sky->inside * sky->inside);
    const wide_ints at =
        __builtin_convertvector((ss_doubles)(in & (ss_doubles_mask)row), wide_ints) *
            (int32_t)f->width +
        __builtin_convertvector((ss_doubles)(in & (ss_doubles_mask)column), wide_ints);
    ss_doubles_mask fine = (far < f->least) | (in & (nearness > look(sky->all, &at)));
    if (any(~fine)) {
        const ss_doubles radius = root(square);
        fine |= (radius > sky->outside) |
                (nearness > sky->most - (radius - sky->around) * sky->slope);
    }
    if (sky->over && any(in & ~fine)) {
        fine |= in & is_over(sky, p, ulp) & (nearness > look(sky->over, &at));
    }
    *dark = (ss_doubles_mask){0};
    if (sky->dark && any(in & ~fine))
        *dark = dark_of(sky, in & ~fine & (far < FARTHEST), nearness, &at);
    return fine & (far < FARTHEST);
}

static inline uint64_t bits_of(ss_doubles_mask mask) {
#if SS_FOURS == 4
    return (uint64_t)_mm512_movepi64_mask((__m512i)mask);
#else
    uint64_t bits = 0;
    for (size_t j = 0; j < SS_DOUBLES; j++) bits |= (uint64_t)(mask[j] & 1) << j;
    return bits;
#endif
}

void RUNG(ss_sky_ask)(const ss_sky *sky, const ss_places *places, size_t n, double ulp,
                      uint64_t *lit, uint64_t *dark) {
    const uint64_t asked = n < 64 ? (UINT64_C(1) << n) - 1 : UINT64_MAX;
    uint64_t bright = 0, black = 0;
    for (size_t i = 0; i < n; i += SS_DOUBLES) {
        ss_doubles p[3];
        ss_doubles_mask none;
        for (int k = 0; k < 3; k++) p[k] = *(const ss_doubles_there *)(places->at[k] + i);
        bright |= bits_of(ask(sky, p, ulp, &none)) << i;
        black |= bits_of(none) << i;
    }
    *lit = bright & asked, *dark = black & asked;
}
