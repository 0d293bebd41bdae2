/* Four floats at once, for work that every machine does alike: the compiler's vectors on the least
 * instruction set, so that there is one rung only and its bits. */
#ifndef SS_BASE_LANES_H
#define SS_BASE_LANES_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

typedef float ss_floats __attribute__((vector_size(16)));
typedef int32_t ss_ints __attribute__((vector_size(16)));
typedef uint32_t ss_uints __attribute__((vector_size(16)));

static inline ss_floats ss_floats_all(float x) { return (ss_floats){x, x, x, x}; }
static inline ss_floats ss_floats_load(const float *from) {
    ss_floats v;
    memcpy(&v, from, sizeof v);
    return v;
}
static inline void ss_floats_store(float *to, ss_floats v) { memcpy(to, &v, sizeof v); }
/* yes where the mask is all ones, no where it is zero. */
static inline ss_floats ss_floats_pick(ss_ints mask, ss_floats yes, ss_floats no) {
    return (ss_floats)((mask & (ss_ints)yes) | (~mask & (ss_ints)no));
}
/* A bit for each lane of a mask. */
static inline int ss_floats_bits(ss_ints mask) {
#ifdef __SSE__
    return __builtin_ia32_movmskps((ss_floats)mask);
#else
    return (mask[0] & 1) | (mask[1] & 2) | (mask[2] & 4) | (mask[3] & 8);
#endif
}
/* The mask of four such bits. */
static inline ss_ints ss_floats_mask(uint32_t bits) {
    const ss_ints each = {1, 2, 4, 8},
                  all = {(int32_t)bits, (int32_t)bits, (int32_t)bits, (int32_t)bits};
    return (all & each) == each;
}
/* a where it is the less (more), b where it is not or one is NaN. */
static inline ss_floats ss_floats_less(ss_floats a, ss_floats b) {
#ifdef __SSE__
    return __builtin_ia32_minps(a, b);
#else
    return ss_floats_pick((ss_ints)(a < b), a, b);
#endif
}
static inline ss_floats ss_floats_more(ss_floats a, ss_floats b) {
#ifdef __SSE__
    return __builtin_ia32_maxps(a, b);
#else
    return ss_floats_pick((ss_ints)(a > b), a, b);
#endif
}
static inline ss_floats ss_floats_size(ss_floats a) {
    return (ss_floats)((ss_ints)a & (ss_ints){INT32_MAX, INT32_MAX, INT32_MAX, INT32_MAX});
}
/* The sum of the products, pairs first. */
static inline float ss_floats_dot(ss_floats a, ss_floats b) {
    const ss_floats p = a * b;
    return (p[0] + p[1]) + (p[2] + p[3]);
}
/* Rows become columns. */
static inline void ss_floats_turn(ss_floats *a, ss_floats *b, ss_floats *c, ss_floats *d) {
    const ss_floats ab = __builtin_shufflevector(*a, *b, 0, 4, 1, 5);
    const ss_floats cd = __builtin_shufflevector(*c, *d, 0, 4, 1, 5);
    const ss_floats AB = __builtin_shufflevector(*a, *b, 2, 6, 3, 7);
    const ss_floats CD = __builtin_shufflevector(*c, *d, 2, 6, 3, 7);
    *a = __builtin_shufflevector(ab, cd, 0, 1, 4, 5);
    *b = __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
    *c = __builtin_shufflevector(AB, CD, 0, 1, 4, 5);
    *d = __builtin_shufflevector(AB, CD, 2, 3, 6, 7);
}
/* Places x to x + 3 of four channels, as four texels. */
static inline void ss_floats_weave(const float *const channel[4], size_t x, ss_floats texel[4]) {
    for (int c = 0; c < 4; c++) texel[c] = ss_floats_load(channel[c] + x);
    ss_floats_turn(&texel[0], &texel[1], &texel[2], &texel[3]);
}

#endif
