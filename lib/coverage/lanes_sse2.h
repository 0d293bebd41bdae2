/* Sixteen lanes in four SSE2 registers, which every x86-64 has: see lanes_scalar.h for what each
 * operation means. */
#ifndef SS_COVERAGE_LANES_H
#define SS_COVERAGE_LANES_H

#include <emmintrin.h>
#include <stdint.h>

#include "coverage/fma_once.h"

typedef struct vf {
    __m128 q[4];
} vf;
typedef struct vi {
    __m128i q[4];
} vi;
typedef struct vm {
    __m128 q[4];
} vm;

#define EACH(type, expression)                                                                     \
    type r;                                                                                        \
    for (int i = 0; i < 4; i++) r.q[i] = (expression);                                             \
    return r

static inline __m128 to_f(__m128i a) { return _mm_castsi128_ps(a); }
static inline __m128i to_i(__m128 a) { return _mm_castps_si128(a); }

static inline vf f_set(float a) { EACH(vf, _mm_set1_ps(a)); }
static inline vf f_load(const float *p) { EACH(vf, _mm_load_ps(p + 4 * i)); }
static inline void f_store(float *p, vf a) {
    for (int i = 0; i < 4; i++) _mm_store_ps(p + 4 * i, a.q[i]);
}
static inline vf f_add(vf a, vf b) { EACH(vf, _mm_add_ps(a.q[i], b.q[i])); }
static inline vf f_sub(vf a, vf b) { EACH(vf, _mm_sub_ps(a.q[i], b.q[i])); }
static inline vf f_mul(vf a, vf b) { EACH(vf, _mm_mul_ps(a.q[i], b.q[i])); }
static inline vf f_div(vf a, vf b) { EACH(vf, _mm_div_ps(a.q[i], b.q[i])); }
static inline vf f_min(vf a, vf b) { EACH(vf, _mm_min_ps(a.q[i], b.q[i])); }
static inline vf f_max(vf a, vf b) { EACH(vf, _mm_max_ps(a.q[i], b.q[i])); }
static inline vf f_abs(vf a) { EACH(vf, _mm_andnot_ps(_mm_set1_ps(-0.0f), a.q[i])); }
static inline vf f_sqrt(vf a) { EACH(vf, _mm_sqrt_ps(a.q[i])); }

/* Lanes of which fma_once() may not take the sums in double as they are: see there. Their low words
 * tell sums in the middle between two floats; what rounds to less than 2^-120, but not to 0, is
 * small: sums below that have so few digits that doubles hold them. */
static inline __m128i unsure(__m128d low, __m128d high, __m128 sum) {
    const __m128i bits = to_i(_mm_shuffle_ps(_mm_castpd_ps(low), _mm_castpd_ps(high),
                                             _MM_SHUFFLE(2, 0, 2, 0)));
    const __m128i middle = _mm_cmpeq_epi32(_mm_slli_epi32(bits, 3), _mm_set1_epi32(INT32_MIN));
    const __m128i size = _mm_add_epi32(_mm_slli_epi32(to_i(sum), 1), _mm_set1_epi32(INT32_MAX));
    return _mm_or_si128(middle, _mm_cmplt_epi32(size, _mm_set1_epi32(INT32_MIN + 0x06ffffff)));
}

static __attribute__((noinline, unused)) void mend_sums(const vf *a, const vf *b, const vf *c,
                                                        vf *sum) {
    for (int i = 0; i < 4; i++) {
        _Alignas(16) float x[4], y[4], z[4], r[4];
        _mm_store_ps(x, a->q[i]), _mm_store_ps(y, b->q[i]), _mm_store_ps(z, c->q[i]);
        for (int k = 0; k < 4; k++) r[k] = fma_once(x[k], y[k], z[k]);
        sum->q[i] = _mm_load_ps(r);
    }
}

static inline vf f_fma(vf a, vf b, vf c) {
    vf sum;
    __m128i any = _mm_setzero_si128();
    for (int i = 0; i < 4; i++) {
        const __m128 x = a.q[i], y = b.q[i], z = c.q[i];
        const __m128d low =
            _mm_add_pd(_mm_mul_pd(_mm_cvtps_pd(x), _mm_cvtps_pd(y)), _mm_cvtps_pd(z));
        const __m128d high = _mm_add_pd(_mm_mul_pd(_mm_cvtps_pd(_mm_movehl_ps(x, x)),
                                                   _mm_cvtps_pd(_mm_movehl_ps(y, y))),
                                        _mm_cvtps_pd(_mm_movehl_ps(z, z)));
        sum.q[i] = _mm_movelh_ps(_mm_cvtpd_ps(low), _mm_cvtpd_ps(high));
        any = _mm_or_si128(any, unsure(low, high, sum.q[i]));
    }
    if (__builtin_expect(_mm_movemask_epi8(any), 0)) mend_sums(&a, &b, &c, &sum);
    return sum;
}
static inline vf f_fnma(vf a, vf b, vf c) {
    vf minus;
    for (int i = 0; i < 4; i++) minus.q[i] = _mm_xor_ps(_mm_set1_ps(-0.0f), a.q[i]);
    return f_fma(minus, b, c);
}

static inline __m128 either(__m128 m, __m128 yes, __m128 no) {
    return _mm_or_ps(_mm_and_ps(m, yes), _mm_andnot_ps(m, no));
}
/* Whole numbers are as they are, beyond 2^23 all are; the sign of a zero is kept. */
static inline __m128 ceil_of(__m128 a) {
    const __m128 sign = _mm_and_ps(a, _mm_set1_ps(-0.0f));
    const __m128 down = _mm_cvtepi32_ps(_mm_cvttps_epi32(a));
    const __m128 up = _mm_add_ps(down, _mm_and_ps(_mm_cmplt_ps(down, a), _mm_set1_ps(1)));
    const __m128 near = _mm_cmplt_ps(_mm_xor_ps(a, sign), _mm_set1_ps(0x1p23f));
    return either(near, _mm_or_ps(up, sign), a);
}
static inline vf f_ceil(vf a) { EACH(vf, ceil_of(a.q[i])); }
static inline vm f_lt(vf a, vf b) { EACH(vm, _mm_cmplt_ps(a.q[i], b.q[i])); }
static inline vm f_le(vf a, vf b) { EACH(vm, _mm_cmple_ps(a.q[i], b.q[i])); }
static inline vf f_blend(vm m, vf a, vf b) { EACH(vf, either(m.q[i], b.q[i], a.q[i])); }
static inline vf f_invert(vf a) { EACH(vf, _mm_div_ps(_mm_set1_ps(1), a.q[i])); }

static inline uint32_t m_bits(vm m) {
    uint32_t bits = 0;
    for (int i = 0; i < 4; i++) bits |= (uint32_t)_mm_movemask_ps(m.q[i]) << 4 * i;
    return bits;
}
static inline vm m_from(uint32_t bits) {
    vm r;
    const __m128i all = _mm_set1_epi32((int)bits);
    for (int i = 0; i < 4; i++) {
        const __m128i one = _mm_slli_epi32(_mm_setr_epi32(1, 2, 4, 8), 4 * i);
        r.q[i] = to_f(_mm_cmpeq_epi32(_mm_and_si128(all, one), one));
    }
    return r;
}
static inline vm m_and(vm a, vm b) { EACH(vm, _mm_and_ps(a.q[i], b.q[i])); }
static inline vm m_or(vm a, vm b) { EACH(vm, _mm_or_ps(a.q[i], b.q[i])); }
static inline vm m_xor(vm a, vm b) { EACH(vm, _mm_xor_ps(a.q[i], b.q[i])); }
static inline vm m_andnot(vm a, vm b) { EACH(vm, _mm_andnot_ps(b.q[i], a.q[i])); }

static inline vi i_zero(void) { EACH(vi, _mm_setzero_si128()); }
static inline vi i_set(uint32_t a) { EACH(vi, _mm_set1_epi32((int)a)); }
static inline vi i_load(const uint32_t *p) { EACH(vi, _mm_load_si128((const __m128i *)p + i)); }
static inline void i_store(uint32_t *p, vi a) {
    for (int i = 0; i < 4; i++) _mm_store_si128((__m128i *)p + i, a.q[i]);
}
static inline vi i_or(vi a, vi b) { EACH(vi, _mm_or_si128(a.q[i], b.q[i])); }
static inline vi i_and(vi a, vi b) { EACH(vi, _mm_and_si128(a.q[i], b.q[i])); }
static inline vi i_andnot(vi a, vi b) { EACH(vi, _mm_andnot_si128(b.q[i], a.q[i])); }
static inline vi i_xor(vi a, vi b) { EACH(vi, _mm_xor_si128(a.q[i], b.q[i])); }
static inline vi i_xor3(vi a, vi b, vi c) { return i_xor(i_xor(a, b), c); }
static inline vi i_majority(vi a, vi b, vi c) { return i_or(i_and(a, b), i_and(c, i_or(a, b))); }
static inline int i_all_ones(vi a) {
    const __m128i all =
        _mm_and_si128(_mm_and_si128(a.q[0], a.q[1]), _mm_and_si128(a.q[2], a.q[3]));
    return _mm_movemask_epi8(_mm_cmpeq_epi32(all, _mm_set1_epi32(-1))) == 0xffff;
}
static inline int i_any(vi a) {
    const __m128i any = _mm_or_si128(_mm_or_si128(a.q[0], a.q[1]), _mm_or_si128(a.q[2], a.q[3]));
    return _mm_movemask_epi8(_mm_cmpeq_epi32(any, _mm_setzero_si128())) != 0xffff;
}
static inline vi i_halve(vi a) { EACH(vi, _mm_srli_epi32(a.q[i], 1)); }
static inline vi i_next(vi a) {
    vi r;
    for (int i = 0; i < 4; i++) {
        const __m128 here = to_f(a.q[i]), next = to_f(a.q[(i + 1) % 4]);
        const __m128 mixed = _mm_move_ss(here, next); /* the next one's first, then ours */
        r.q[i] = to_i(_mm_shuffle_ps(mixed, mixed, _MM_SHUFFLE(0, 3, 2, 1)));
    }
    return r;
}
/* Of each byte in parallel; then bytes are added up. */
static inline __m128i ones_of(__m128i x) {
    const __m128i two = _mm_set1_epi8(0x55), four = _mm_set1_epi8(0x33), low = _mm_set1_epi8(15);
    x = _mm_sub_epi8(x, _mm_and_si128(_mm_srli_epi16(x, 1), two));
    x = _mm_add_epi8(_mm_and_si128(x, four), _mm_and_si128(_mm_srli_epi16(x, 2), four));
    x = _mm_and_si128(_mm_add_epi8(x, _mm_srli_epi16(x, 4)), low);
    return _mm_sad_epu8(x, _mm_setzero_si128());
}
static inline vi i_count(vi sum, vi a, uint32_t shift) {
    const __m128i by = _mm_cvtsi32_si128((int)shift);
    EACH(vi, _mm_add_epi64(sum.q[i], _mm_sll_epi64(ones_of(a.q[i]), by)));
}
static inline uint64_t i_total(vi sum) {
    uint64_t part[2];
    const __m128i all = _mm_add_epi64(_mm_add_epi64(sum.q[0], sum.q[1]),
                                      _mm_add_epi64(sum.q[2], sum.q[3]));
    _mm_storeu_si128((__m128i *)part, all);
    return part[0] + part[1];
}

/* The bits from trunc(u) on are minus two to that power, which a float's exponent makes; 2^31
 * converts to the one number that has its bit pattern. */
static inline __m128i columns_from(__m128 u, __m128 rows) {
    const __m128 at = _mm_min_ps(_mm_max_ps(u, _mm_setzero_ps()), _mm_set1_ps(32));
    const __m128i count = _mm_cvttps_epi32(at);
    const __m128i power = _mm_slli_epi32(_mm_add_epi32(count, _mm_set1_epi32(127)), 23);
    const __m128i bits = _mm_sub_epi32(_mm_setzero_si128(), _mm_cvttps_epi32(to_f(power)));
    const __m128i few = _mm_cmplt_epi32(count, _mm_set1_epi32(32));
    return _mm_and_si128(bits, _mm_and_si128(to_i(rows), few));
}
static inline vi i_columns_from(vf u, vm rows) { EACH(vi, columns_from(u.q[i], rows.q[i])); }
static inline void i_columns_pair(vf u, vm rows, vi *low, vi *high) {
    *low = i_columns_from(u, rows);
    *high = i_columns_from(f_sub(u, f_set(32)), rows);
}

static inline uint64_t lane_bits(const uint16_t lanes[64], unsigned lane) {
    const __m128i shift = _mm_cvtsi32_si128(15 - (int)lane);
    uint64_t bits = 0;
    for (int i = 0; i < 64; i += 16) { /* the bit to each word's sign, words to bytes, signs out */
        const __m128i a = _mm_sll_epi16(_mm_load_si128((const __m128i *)(lanes + i)), shift);
        const __m128i b = _mm_sll_epi16(_mm_load_si128((const __m128i *)(lanes + i + 8)), shift);
        const __m128i both = _mm_packs_epi16(_mm_srai_epi16(a, 15), _mm_srai_epi16(b, 15));
        bits |= (uint64_t)(uint32_t)_mm_movemask_epi8(both) << i;
    }
    return bits;
}
#undef EACH

#endif
