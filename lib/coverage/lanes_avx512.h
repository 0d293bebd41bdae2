/* Sixteen lanes in AVX-512: see lanes_scalar.h for what each operation means. */
#ifndef SS_COVERAGE_LANES_H
#define SS_COVERAGE_LANES_H

#include <immintrin.h>
#include <stdint.h>

typedef __m512 vf;
typedef __m512i vi;
typedef __mmask16 vm;

static inline vf f_set(float a) { return _mm512_set1_ps(a); }
static inline vf f_load(const float *p) { return _mm512_load_ps(p); }
static inline void f_store(float *p, vf a) { _mm512_store_ps(p, a); }
static inline vf f_add(vf a, vf b) { return _mm512_add_ps(a, b); }
static inline vf f_sub(vf a, vf b) { return _mm512_sub_ps(a, b); }
static inline vf f_mul(vf a, vf b) { return _mm512_mul_ps(a, b); }
static inline vf f_div(vf a, vf b) { return _mm512_div_ps(a, b); }
static inline vf f_fma(vf a, vf b, vf c) { return _mm512_fmadd_ps(a, b, c); }
static inline vf f_fnma(vf a, vf b, vf c) { return _mm512_fnmadd_ps(a, b, c); }
static inline vf f_min(vf a, vf b) { return _mm512_min_ps(a, b); }
static inline vf f_max(vf a, vf b) { return _mm512_max_ps(a, b); }
static inline vf f_abs(vf a) { return _mm512_abs_ps(a); }
static inline vf f_sqrt(vf a) { return _mm512_sqrt_ps(a); }
static inline vf f_ceil(vf a) {
    return _mm512_roundscale_ps(a, _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC);
}
static inline vm f_lt(vf a, vf b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
static inline vm f_le(vf a, vf b) { return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ); }
static inline vf f_blend(vm m, vf a, vf b) { return _mm512_mask_blend_ps(m, a, b); }
static inline vf f_invert(vf a) { return _mm512_div_ps(_mm512_set1_ps(1), a); }

static inline uint32_t m_bits(vm a) { return a; }
static inline vm m_from(uint32_t bits) { return (vm)bits; }
static inline vm m_and(vm a, vm b) { return (vm)(a & b); }
static inline vm m_or(vm a, vm b) { return (vm)(a | b); }
static inline vm m_xor(vm a, vm b) { return (vm)(a ^ b); }
static inline vm m_andnot(vm a, vm b) { return (vm)(a & ~b); }

static inline vi i_zero(void) { return _mm512_setzero_si512(); }
static inline vi i_set(uint32_t a) { return _mm512_set1_epi32((int)a); }
static inline vi i_load(const uint32_t *p) { return _mm512_load_si512(p); }
static inline void i_store(uint32_t *p, vi a) { _mm512_store_si512(p, a); }
static inline vi i_or(vi a, vi b) { return _mm512_or_si512(a, b); }
static inline vi i_and(vi a, vi b) { return _mm512_and_si512(a, b); }
static inline vi i_andnot(vi a, vi b) { return _mm512_andnot_si512(b, a); }
static inline vi i_xor(vi a, vi b) { return _mm512_xor_si512(a, b); }
static inline vi i_xor3(vi a, vi b, vi c) { return _mm512_ternarylogic_epi32(a, b, c, 0x96); }
static inline vi i_majority(vi a, vi b, vi c) { return _mm512_ternarylogic_epi32(a, b, c, 0xe8); }
static inline int i_all_ones(vi a) {
    return _mm512_cmpneq_epi32_mask(a, _mm512_set1_epi32(-1)) == 0;
}
static inline int i_any(vi a) { return _mm512_test_epi32_mask(a, a) != 0; }
static inline vi i_columns_from(vf u, vm rows) {
    const vi count = _mm512_cvttps_epi32(_mm512_max_ps(u, _mm512_setzero_ps()));
    return _mm512_maskz_sllv_epi32(rows, _mm512_set1_epi32(-1), count);
}

static inline vi i_halve(vi a) { return _mm512_srli_epi32(a, 1); }
static inline vi i_next(vi a) { return _mm512_alignr_epi32(a, a, 1); }
/* By nibbles. */
static inline vi i_count(vi sum, vi a, uint32_t shift) {
    const vi ones = _mm512_broadcast_i32x4(
        _mm_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4));
    const vi low = _mm512_set1_epi8(15);
    const vi bytes = _mm512_add_epi8(
        _mm512_shuffle_epi8(ones, _mm512_and_si512(a, low)),
        _mm512_shuffle_epi8(ones, _mm512_and_si512(_mm512_srli_epi16(a, 4), low)));
    const vi counts = _mm512_sad_epu8(bytes, _mm512_setzero_si512());
    return _mm512_add_epi64(sum, _mm512_sll_epi64(counts, _mm_cvtsi32_si128((int)shift)));
}
static inline uint64_t i_total(vi sum) { return (uint64_t)_mm512_reduce_add_epi64(sum); }

static inline void i_columns_pair(vf u, vm rows, vi *low, vi *high) {
    const vi count = _mm512_cvttps_epi32(_mm512_max_ps(u, _mm512_setzero_ps()));
    const vi less = _mm512_subs_epu16(count, _mm512_set1_epi32(32));
    *low = _mm512_maskz_sllv_epi32(rows, _mm512_set1_epi32(-1), count);
    *high = _mm512_maskz_sllv_epi32(rows, _mm512_set1_epi32(-1), less);
}

static inline uint64_t lane_bits(const uint16_t lanes[64], unsigned lane) {
    const __m512i bit = _mm512_set1_epi16((short)(1 << lane));
    const uint64_t low = _mm512_test_epi16_mask(_mm512_load_si512(lanes), bit);
    const uint64_t high = _mm512_test_epi16_mask(_mm512_load_si512(lanes + 32), bit);
    return high << 32 | low;
}

#endif
