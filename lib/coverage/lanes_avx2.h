/* Sixteen lanes in two AVX2 registers: see lanes_scalar.h for what each operation means. */
#ifndef SS_COVERAGE_LANES_H
#define SS_COVERAGE_LANES_H

#include <immintrin.h>
#include <stdint.h>

typedef struct vf {
    __m256 a, b;
} vf;
typedef struct vi {
    __m256i a, b;
} vi;
typedef struct vm {
    __m256 a, b;
} vm;

#define BOTH(type, x, y) ((type){x, y})
static inline vf f_set(float x) { return BOTH(vf, _mm256_set1_ps(x), _mm256_set1_ps(x)); }
static inline vf f_load(const float *p) {
    return BOTH(vf, _mm256_load_ps(p), _mm256_load_ps(p + 8));
}
static inline void f_store(float *p, vf x) { _mm256_store_ps(p, x.a), _mm256_store_ps(p + 8, x.b); }
static inline vf f_add(vf x, vf y) {
    return BOTH(vf, _mm256_add_ps(x.a, y.a), _mm256_add_ps(x.b, y.b));
}
static inline vf f_sub(vf x, vf y) {
    return BOTH(vf, _mm256_sub_ps(x.a, y.a), _mm256_sub_ps(x.b, y.b));
}
static inline vf f_mul(vf x, vf y) {
    return BOTH(vf, _mm256_mul_ps(x.a, y.a), _mm256_mul_ps(x.b, y.b));
}
static inline vf f_div(vf x, vf y) {
    return BOTH(vf, _mm256_div_ps(x.a, y.a), _mm256_div_ps(x.b, y.b));
}
static inline vf f_fma(vf x, vf y, vf z) {
    return BOTH(vf, _mm256_fmadd_ps(x.a, y.a, z.a), _mm256_fmadd_ps(x.b, y.b, z.b));
}
static inline vf f_fnma(vf x, vf y, vf z) {
    return BOTH(vf, _mm256_fnmadd_ps(x.a, y.a, z.a), _mm256_fnmadd_ps(x.b, y.b, z.b));
}
static inline vf f_min(vf x, vf y) {
    return BOTH(vf, _mm256_min_ps(x.a, y.a), _mm256_min_ps(x.b, y.b));
}
static inline vf f_max(vf x, vf y) {
    return BOTH(vf, _mm256_max_ps(x.a, y.a), _mm256_max_ps(x.b, y.b));
}
static inline vf f_abs(vf x) {
    const __m256 sign = _mm256_set1_ps(-0.0f);
    return BOTH(vf, _mm256_andnot_ps(sign, x.a), _mm256_andnot_ps(sign, x.b));
}
static inline vf f_sqrt(vf x) { return BOTH(vf, _mm256_sqrt_ps(x.a), _mm256_sqrt_ps(x.b)); }
static inline vf f_ceil(vf x) { return BOTH(vf, _mm256_ceil_ps(x.a), _mm256_ceil_ps(x.b)); }
static inline vm f_lt(vf x, vf y) {
    return BOTH(vm, _mm256_cmp_ps(x.a, y.a, _CMP_LT_OQ), _mm256_cmp_ps(x.b, y.b, _CMP_LT_OQ));
}
static inline vm f_le(vf x, vf y) {
    return BOTH(vm, _mm256_cmp_ps(x.a, y.a, _CMP_LE_OQ), _mm256_cmp_ps(x.b, y.b, _CMP_LE_OQ));
}
static inline vf f_blend(vm m, vf x, vf y) {
    return BOTH(vf, _mm256_blendv_ps(x.a, y.a, m.a), _mm256_blendv_ps(x.b, y.b, m.b));
}
static inline vf f_invert(vf x) {
    const __m256 one = _mm256_set1_ps(1);
    return BOTH(vf, _mm256_div_ps(one, x.a), _mm256_div_ps(one, x.b));
}

static inline uint32_t m_bits(vm m) {
    return (uint32_t)_mm256_movemask_ps(m.a) | (uint32_t)_mm256_movemask_ps(m.b) << 8;
}
static inline vm m_from(uint32_t bits) {
    const __m256i low = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    const __m256i a = _mm256_and_si256(_mm256_set1_epi32((int)bits), low);
    const __m256i b = _mm256_and_si256(_mm256_set1_epi32((int)(bits >> 8)), low);
    return BOTH(vm, _mm256_castsi256_ps(_mm256_cmpeq_epi32(a, low)),
                _mm256_castsi256_ps(_mm256_cmpeq_epi32(b, low)));
}
static inline vm m_and(vm x, vm y) {
    return BOTH(vm, _mm256_and_ps(x.a, y.a), _mm256_and_ps(x.b, y.b));
}
static inline vm m_or(vm x, vm y) {
    return BOTH(vm, _mm256_or_ps(x.a, y.a), _mm256_or_ps(x.b, y.b));
}
static inline vm m_xor(vm x, vm y) {
    return BOTH(vm, _mm256_xor_ps(x.a, y.a), _mm256_xor_ps(x.b, y.b));
}
static inline vm m_andnot(vm x, vm y) {
    return BOTH(vm, _mm256_andnot_ps(y.a, x.a), _mm256_andnot_ps(y.b, x.b));
}

static inline vi i_zero(void) { return BOTH(vi, _mm256_setzero_si256(), _mm256_setzero_si256()); }
static inline vi i_set(uint32_t x) {
    return BOTH(vi, _mm256_set1_epi32((int)x), _mm256_set1_epi32((int)x));
}
static inline vi i_load(const uint32_t *p) {
    return BOTH(vi, _mm256_load_si256((const __m256i *)p),
                _mm256_load_si256((const __m256i *)p + 1));
}
static inline void i_store(uint32_t *p, vi x) {
    _mm256_store_si256((__m256i *)p, x.a), _mm256_store_si256((__m256i *)p + 1, x.b);
}
static inline vi i_or(vi x, vi y) {
    return BOTH(vi, _mm256_or_si256(x.a, y.a), _mm256_or_si256(x.b, y.b));
}
static inline vi i_and(vi x, vi y) {
    return BOTH(vi, _mm256_and_si256(x.a, y.a), _mm256_and_si256(x.b, y.b));
}
static inline vi i_andnot(vi x, vi y) {
    return BOTH(vi, _mm256_andnot_si256(y.a, x.a), _mm256_andnot_si256(y.b, x.b));
}
static inline vi i_xor(vi x, vi y) {
    return BOTH(vi, _mm256_xor_si256(x.a, y.a), _mm256_xor_si256(x.b, y.b));
}
static inline vi i_xor3(vi x, vi y, vi z) { return i_xor(i_xor(x, y), z); }
static inline vi i_majority(vi x, vi y, vi z) { return i_or(i_and(x, y), i_and(z, i_or(x, y))); }
static inline int i_all_ones(vi x) {
    const __m256i both = _mm256_and_si256(x.a, x.b);
    return _mm256_testc_si256(both, _mm256_set1_epi32(-1));
}
static inline int i_any(vi x) {
    const __m256i both = _mm256_or_si256(x.a, x.b);
    return !_mm256_testz_si256(both, both);
}
static inline __m256i columns_from(__m256 u, __m256 rows) {
    const __m256i count = _mm256_cvttps_epi32(_mm256_max_ps(u, _mm256_setzero_ps()));
    return _mm256_sllv_epi32(_mm256_castps_si256(rows), count);
}
static inline vi i_halve(vi x) {
    return BOTH(vi, _mm256_srli_epi32(x.a, 1), _mm256_srli_epi32(x.b, 1));
}
static inline vi i_next(vi x) {
    const __m256i turn = _mm256_setr_epi32(1, 2, 3, 4, 5, 6, 7, 0);
    const __m256i a = _mm256_permutevar8x32_epi32(x.a, turn),
                  b = _mm256_permutevar8x32_epi32(x.b, turn);
    return BOTH(vi, _mm256_blend_epi32(a, b, 128), _mm256_blend_epi32(b, a, 128));
}
/* By nibbles. */
static inline __m256i count_half(__m256i sum, __m256i x, uint32_t shift) {
    const __m256i ones = _mm256_broadcastsi128_si256(
        _mm_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4));
    const __m256i low = _mm256_set1_epi8(15);
    const __m256i bytes = _mm256_add_epi8(
        _mm256_shuffle_epi8(ones, _mm256_and_si256(x, low)),
        _mm256_shuffle_epi8(ones, _mm256_and_si256(_mm256_srli_epi16(x, 4), low)));
    const __m256i counts = _mm256_sad_epu8(bytes, _mm256_setzero_si256());
    return _mm256_add_epi64(sum, _mm256_sll_epi64(counts, _mm_cvtsi32_si128((int)shift)));
}
static inline vi i_count(vi sum, vi x, uint32_t shift) {
    return BOTH(vi, count_half(sum.a, x.a, shift), count_half(sum.b, x.b, shift));
}
static inline uint64_t i_total(vi sum) {
    const __m256i all = _mm256_add_epi64(sum.a, sum.b);
    const __m128i half =
        _mm_add_epi64(_mm256_castsi256_si128(all), _mm256_extracti128_si256(all, 1));
    return (uint64_t)_mm_extract_epi64(half, 0) + (uint64_t)_mm_extract_epi64(half, 1);
}
static inline vi i_columns_from(vf u, vm rows) {
    return BOTH(vi, columns_from(u.a, rows.a), columns_from(u.b, rows.b));
}

static inline void columns_pair(__m256 u, __m256 rows, __m256i *low, __m256i *high) {
    const __m256i count = _mm256_cvttps_epi32(_mm256_max_ps(u, _mm256_setzero_ps()));
    const __m256i less = _mm256_subs_epu16(count, _mm256_set1_epi32(32));
    *low = _mm256_sllv_epi32(_mm256_castps_si256(rows), count);
    *high = _mm256_sllv_epi32(_mm256_castps_si256(rows), less);
}
static inline void i_columns_pair(vf u, vm rows, vi *low, vi *high) {
    columns_pair(u.a, rows.a, &low->a, &high->a);
    columns_pair(u.b, rows.b, &low->b, &high->b);
}

static inline uint64_t lane_bits(const uint16_t lanes[64], unsigned lane) {
    const __m128i shift = _mm_cvtsi32_si128(15 - (int)lane);
    uint64_t bits = 0;
    for (int i = 0; i < 64; i += 32) { /* the bit to each word's sign, words to bytes, signs out */
        const __m256i a = _mm256_sll_epi16(_mm256_load_si256((const __m256i *)(lanes + i)), shift);
        const __m256i b =
            _mm256_sll_epi16(_mm256_load_si256((const __m256i *)(lanes + i + 16)), shift);
        const __m256i both = _mm256_packs_epi16(_mm256_srai_epi16(a, 15), _mm256_srai_epi16(b, 15));
        const __m256i ordered = _mm256_permute4x64_epi64(both, 0xd8);
        bits |= (uint64_t)(uint32_t)_mm256_movemask_epi8(ordered) << i;
    }
    return bits;
}
#undef BOTH

#endif
