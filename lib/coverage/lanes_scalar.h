/* Sixteen lanes in plain C. What lanes_sse2.h, lanes_avx2.h and lanes_avx512.h do with vector
 * registers, bit for bit: vf  sixteen floats     vi  sixteen 32-bit words     vm  a truth value for
 * each lane f_fma rounds once. f_min and f_max give b when either is NaN, as the instructions do.
 * f_blend gives b where m is true. f_invert gives 1 / a. i_columns_from gives the bits trunc(u) ..
 * 31 in rows where `rows` is true, all of them for u <= 0 or NaN, none for u >= 32. i_columns_pair
 * gives those of u and of u - 32. lane_bits gives bit `lane` of sixty-four numbers. i_halve shifts
 * each word by one bit, i_next gives each the word after it, the last the first. i_count adds to
 * counters the number of ones << shift, and i_total sums these counters up; how many of them there
 * are differs. */
#ifndef SS_COVERAGE_LANES_H
#define SS_COVERAGE_LANES_H

#include <stdint.h>
#include <string.h>

#include "coverage/fma_once.h"

typedef struct vf {
    float v[16];
} vf;
typedef struct vi {
    uint32_t v[16];
} vi;
typedef struct vm {
    uint32_t v[16]; /* 0 or ~0 */
} vm;

#define EACH(type, expression)                                                                     \
    type r;                                                                                        \
    for (int i = 0; i < 16; i++) r.v[i] = (expression);                                            \
    return r

static inline uint32_t bits_from(float u) {
    return !(u > 0) ? ~0u : u >= 32 ? 0 : ~0u << (uint32_t)u;
}

static inline vf f_set(float a) { EACH(vf, a); }
static inline vf f_load(const float *p) { EACH(vf, p[i]); }
static inline void f_store(float *p, vf a) { memcpy(p, a.v, sizeof a.v); }
static inline vf f_add(vf a, vf b) { EACH(vf, a.v[i] + b.v[i]); }
static inline vf f_sub(vf a, vf b) { EACH(vf, a.v[i] - b.v[i]); }
static inline vf f_mul(vf a, vf b) { EACH(vf, a.v[i] * b.v[i]); }
static inline vf f_div(vf a, vf b) { EACH(vf, a.v[i] / b.v[i]); }
static inline vf f_fma(vf a, vf b, vf c) { EACH(vf, fma_once(a.v[i], b.v[i], c.v[i])); }
static inline vf f_fnma(vf a, vf b, vf c) { EACH(vf, fma_once(-a.v[i], b.v[i], c.v[i])); }
static inline vf f_min(vf a, vf b) { EACH(vf, a.v[i] < b.v[i] ? a.v[i] : b.v[i]); }
static inline vf f_max(vf a, vf b) { EACH(vf, a.v[i] > b.v[i] ? a.v[i] : b.v[i]); }
static inline vf f_abs(vf a) { EACH(vf, __builtin_fabsf(a.v[i])); }
static inline vf f_sqrt(vf a) { EACH(vf, __builtin_sqrtf(a.v[i])); }
static inline vf f_ceil(vf a) { EACH(vf, __builtin_ceilf(a.v[i])); }
static inline vm f_lt(vf a, vf b) { EACH(vm, a.v[i] < b.v[i] ? ~0u : 0); }
static inline vm f_le(vf a, vf b) { EACH(vm, a.v[i] <= b.v[i] ? ~0u : 0); }
static inline vf f_blend(vm m, vf a, vf b) { EACH(vf, m.v[i] ? b.v[i] : a.v[i]); }
static inline vf f_invert(vf a) { EACH(vf, 1 / a.v[i]); }

static inline uint32_t m_bits(vm a) {
    uint32_t bits = 0;
    for (int i = 0; i < 16; i++) bits |= (a.v[i] & 1) << i;
    return bits;
}
static inline vm m_from(uint32_t bits) { EACH(vm, bits >> i & 1 ? ~0u : 0); }
static inline vm m_and(vm a, vm b) { EACH(vm, a.v[i] & b.v[i]); }
static inline vm m_or(vm a, vm b) { EACH(vm, a.v[i] | b.v[i]); }
static inline vm m_xor(vm a, vm b) { EACH(vm, a.v[i] ^ b.v[i]); }
static inline vm m_andnot(vm a, vm b) { EACH(vm, a.v[i] & ~b.v[i]); }

static inline vi i_zero(void) { EACH(vi, 0); }
static inline vi i_set(uint32_t a) { EACH(vi, a); }
static inline vi i_load(const uint32_t *p) { EACH(vi, p[i]); }
static inline void i_store(uint32_t *p, vi a) { memcpy(p, a.v, sizeof a.v); }
static inline vi i_or(vi a, vi b) { EACH(vi, a.v[i] | b.v[i]); }
static inline vi i_and(vi a, vi b) { EACH(vi, a.v[i] & b.v[i]); }
static inline vi i_andnot(vi a, vi b) { EACH(vi, a.v[i] & ~b.v[i]); }
static inline vi i_xor(vi a, vi b) { EACH(vi, a.v[i] ^ b.v[i]); }
static inline vi i_xor3(vi a, vi b, vi c) { EACH(vi, a.v[i] ^ b.v[i] ^ c.v[i]); }
static inline vi i_majority(vi a, vi b, vi c) {
    EACH(vi, (a.v[i] & b.v[i]) | (c.v[i] & (a.v[i] | b.v[i])));
}
static inline int i_all_ones(vi a) {
    uint32_t all = ~0u;
    for (int i = 0; i < 16; i++) all &= a.v[i];
    return all == ~0u;
}
static inline int i_any(vi a) {
    uint32_t any = 0;
    for (int i = 0; i < 16; i++) any |= a.v[i];
    return any != 0;
}
static inline vi i_halve(vi a) { EACH(vi, a.v[i] >> 1); }
static inline vi i_next(vi a) { EACH(vi, a.v[(i + 1) % 16]); }
static inline vi i_count(vi sum, vi a, uint32_t shift) {
    EACH(vi, sum.v[i] + ((uint32_t)__builtin_popcount(a.v[i]) << shift));
}
static inline uint64_t i_total(vi sum) {
    uint64_t all = 0;
    for (int i = 0; i < 16; i++) all += sum.v[i];
    return all;
}
static inline vi i_columns_from(vf u, vm rows) { EACH(vi, bits_from(u.v[i]) & rows.v[i]); }

static inline void i_columns_pair(vf u, vm rows, vi *low, vi *high) {
    *low = i_columns_from(u, rows);
    *high = i_columns_from(f_sub(u, f_set(32)), rows);
}

static inline uint64_t lane_bits(const uint16_t lanes[64], unsigned lane) {
    uint64_t bits = 0;
    for (int i = 0; i < 64; i++) bits |= (uint64_t)(lanes[i] >> lane & 1) << i;
    return bits;
}
#undef EACH

#endif
