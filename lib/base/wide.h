/* Sixteen floats at once as four fours, in as many registers as they take: for kernels that are
 * compiled for each rung (cpu.h). A wide holds SS_FOURS of the fours, SS_PARTS wides hold all.
 * Results go through pointers: returned, such vectors have one ABI with AVX-512 and another
 * without. */
#ifndef SS_BASE_WIDE_H
#define SS_BASE_WIDE_H

#include "base/lanes.h"

#ifdef __AVX2__
#include <immintrin.h>
#endif

#if defined __AVX512F__
#define SS_FOURS 4
#elif defined __AVX2__
#define SS_FOURS 2
#else
#define SS_FOURS 1
#endif
#define SS_PARTS (4 / SS_FOURS)
#define SS_LANES (4 * SS_FOURS)

typedef float ss_wide __attribute__((vector_size(16 * SS_FOURS)));
typedef int32_t ss_wide_ints __attribute__((vector_size(16 * SS_FOURS)));
/* As many doubles as the same register holds. */
#define SS_DOUBLES (2 * SS_FOURS)
typedef double ss_doubles __attribute__((vector_size(8 * SS_DOUBLES)));
typedef int64_t ss_doubles_mask __attribute__((vector_size(8 * SS_DOUBLES)));
typedef float ss_eight __attribute__((vector_size(32)));
typedef int32_t ss_eight_ints __attribute__((vector_size(32)));

/* In memory, anywhere: a memcpy of more than sixteen bytes goes through the stack in two halves. */
typedef float ss_wide_there __attribute__((vector_size(16 * SS_FOURS), aligned(4), may_alias));
typedef int32_t ss_wide_ints_there
    __attribute__((vector_size(16 * SS_FOURS), aligned(4), may_alias));
typedef double ss_doubles_there __attribute__((vector_size(8 * SS_DOUBLES), aligned(8), may_alias));
typedef float ss_eight_there __attribute__((vector_size(32), aligned(4), may_alias));
typedef int32_t ss_eight_ints_there __attribute__((vector_size(32), aligned(4), may_alias));

#define SS_WIDE_ALL(x) ((x) - (ss_wide){0})
#define SS_WIDE_FOUR(a, j)                                                                         \
    __builtin_shufflevector(a, a, 4 * (j), 4 * (j) + 1, 4 * (j) + 2, 4 * (j) + 3)
/* yes where the mask is all ones, no where it is zero. */
#define SS_WIDE_PICK(mask, yes, no)                                                                \
    ((ss_wide)(((mask) & (ss_wide_ints)(yes)) | (~(mask) & (ss_wide_ints)(no))))

/* What a comparison says of each lane, where that need not be a vector: a | b, a & b, ~a. */
#if SS_FOURS == 4
typedef __mmask16 ss_wide_mask;
#define SS_WIDE_IS_LESS(a, b)   _mm512_cmp_ps_mask((__m512)(a), (__m512)(b), _CMP_LT_OQ)
#define SS_WIDE_CHOOSE(mask, yes, no)                                                              \
    ((ss_wide)_mm512_mask_blend_ps((__mmask16)(mask), (__m512)(no), (__m512)(yes)))
#else
typedef ss_wide_ints ss_wide_mask;
#define SS_WIDE_IS_LESS(a, b)         ((a) < (b))
#define SS_WIDE_CHOOSE(mask, yes, no) SS_WIDE_PICK(mask, yes, no)
#endif
#if SS_FOURS == 4
#define SS_WIDE_NEGATIVE(ints) ((ss_wide_mask)_mm512_movepi32_mask((__m512i)(ints)))
#else
#define SS_WIDE_NEGATIVE(ints) ((ints) >> 31)
#endif
#define SS_WIDE_NONE ((ss_wide_mask){0})

/* a where it is the less (more), b where it is not or one is NaN. */
#if SS_FOURS == 4
#define SS_WIDE_LESS(a, b) ((ss_wide)_mm512_min_ps((__m512)(a), (__m512)(b)))
#define SS_WIDE_MORE(a, b) ((ss_wide)_mm512_max_ps((__m512)(a), (__m512)(b)))
#elif SS_FOURS == 2
#define SS_WIDE_LESS(a, b) ((ss_wide)_mm256_min_ps((__m256)(a), (__m256)(b)))
#define SS_WIDE_MORE(a, b) ((ss_wide)_mm256_max_ps((__m256)(a), (__m256)(b)))
#else
#define SS_WIDE_LESS(a, b) ss_floats_less(a, b)
#define SS_WIDE_MORE(a, b) ss_floats_more(a, b)
#endif

/* Of two eights, the first lowest. */
#if SS_FOURS == 4
#define SS_WIDE_EIGHTS(a, b)                                                                       \
    __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)
#endif
/* Of fours, the first lowest. */
static inline void ss_wide_make(const ss_floats four[SS_FOURS], ss_wide *out) {
#if SS_FOURS == 1
    *out = four[0];
#elif SS_FOURS == 2
    *out = __builtin_shufflevector(four[0], four[1], 0, 1, 2, 3, 4, 5, 6, 7);
#else
    const ss_eight low = __builtin_shufflevector(four[0], four[1], 0, 1, 2, 3, 4, 5, 6, 7);
    const ss_eight high = __builtin_shufflevector(four[2], four[3], 0, 1, 2, 3, 4, 5, 6, 7);
    *out = SS_WIDE_EIGHTS(low, high);
#endif
}

static inline void ss_wide_repeat(ss_floats four, ss_wide *out) {
    const ss_floats same[4] = {four, four, four, four};
    ss_wide_make(same, out);
}

/* The fours. */
static inline void ss_wide_split(const ss_wide *wide, ss_floats four[SS_FOURS]) {
    four[0] = SS_WIDE_FOUR(*wide, 0);
#if SS_FOURS > 1
    four[1] = SS_WIDE_FOUR(*wide, 1);
#endif
#if SS_FOURS > 2
    four[2] = SS_WIDE_FOUR(*wide, 2), four[3] = SS_WIDE_FOUR(*wide, 3);
#endif
}

/* The least and the most of all lanes. */
static inline float ss_wide_least(const ss_wide *wide) {
    ss_floats four[SS_FOURS];
    ss_wide_split(wide, four);
    for (int i = 1; i < SS_FOURS; i++) four[0] = ss_floats_less(four[i], four[0]);
    const ss_floats turned = __builtin_shufflevector(four[0], four[0], 2, 3, 0, 1);
    const ss_floats two = ss_floats_less(turned, four[0]);
    return two[0] < two[1] ? two[0] : two[1];
}

static inline float ss_wide_most(const ss_wide *wide) {
    ss_floats four[SS_FOURS];
    ss_wide_split(wide, four);
    for (int i = 1; i < SS_FOURS; i++) four[0] = ss_floats_more(four[i], four[0]);
    const ss_floats turned = __builtin_shufflevector(four[0], four[0], 2, 3, 0, 1);
    const ss_floats two = ss_floats_more(turned, four[0]);
    return two[0] > two[1] ? two[0] : two[1];
}

/* A bit for each lane of a mask. */
static inline uint32_t ss_wide_bits(const ss_wide_ints *mask) {
#if SS_FOURS == 4
    return _mm512_movepi32_mask((__m512i)*mask);
#elif SS_FOURS == 2
    return (uint32_t)_mm256_movemask_ps((__m256)*mask);
#else
    return (uint32_t)ss_floats_bits(*mask);
#endif
}

/* In any lane? */
static inline int ss_wide_any(ss_wide_mask mask) {
#if SS_FOURS == 4
    return mask != 0;
#else
    return ss_wide_bits(&mask) != 0;
#endif
}

/* As many floats as a wide has, from places of a table. */
static inline void ss_wide_gather(const float *table, const ss_wide_ints *at, ss_wide *out) {
#if SS_FOURS == 4
    *out = (ss_wide)_mm512_i32gather_ps((__m512i)*at, table, 4);
#elif SS_FOURS == 2
    *out = (ss_wide)_mm256_i32gather_ps(table, (__m256i)*at, 4);
#else
    *out = (ss_wide){table[(*at)[0]], table[(*at)[1]], table[(*at)[2]], table[(*at)[3]]};
#endif
}

/* Within each four of a and b: its lower or upper halves one from each in turn; pairs of them. */
#if SS_FOURS == 1
#define SS_WIDE_LOW(a, b)         __builtin_shufflevector(a, b, 0, 4, 1, 5)
#define SS_WIDE_HIGH(a, b)        __builtin_shufflevector(a, b, 2, 6, 3, 7)
#define SS_WIDE_LOW_PAIRS(a, b)   __builtin_shufflevector(a, b, 0, 1, 4, 5)
#define SS_WIDE_HIGH_PAIRS(a, b)  __builtin_shufflevector(a, b, 2, 3, 6, 7)
#elif SS_FOURS == 2
#define SS_WIDE_LOW(a, b)         __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13)
#define SS_WIDE_HIGH(a, b)        __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15)
#define SS_WIDE_LOW_PAIRS(a, b)   __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13)
#define SS_WIDE_HIGH_PAIRS(a, b)  __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15)
#else
#define SS_WIDE_LOW(a, b)                                                                          \
    __builtin_shufflevector(a, b, 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29)
#define SS_WIDE_HIGH(a, b)                                                                         \
    __builtin_shufflevector(a, b, 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31)
#define SS_WIDE_LOW_PAIRS(a, b)                                                                    \
    __builtin_shufflevector(a, b, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29)
#define SS_WIDE_HIGH_PAIRS(a, b)                                                                   \
    __builtin_shufflevector(a, b, 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31)
#endif

/* In each four: rows become columns. */
static inline void ss_wide_turn(const ss_wide row[4], ss_wide column[4]) {
    const ss_wide ab = SS_WIDE_LOW(row[0], row[1]), cd = SS_WIDE_LOW(row[2], row[3]);
    const ss_wide AB = SS_WIDE_HIGH(row[0], row[1]), CD = SS_WIDE_HIGH(row[2], row[3]);
    column[0] = SS_WIDE_LOW_PAIRS(ab, cd), column[1] = SS_WIDE_HIGH_PAIRS(ab, cd);
    column[2] = SS_WIDE_LOW_PAIRS(AB, CD), column[3] = SS_WIDE_HIGH_PAIRS(AB, CD);
}

#endif
