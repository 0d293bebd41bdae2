/* Every operation of one of the lanes_*.h over the same numbers: include that first and define
 * LANES, the name of what comes out. */
#include <math.h>

#include "unit/lanes_results.h"

static uint32_t next_number(uint64_t *state) {
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(*state >> 32);
}

/* Half of them of the sizes that views have, with few digits now and then, so that sums land in the
 * middle between two floats; the others any bits at all. */
static float next_float(uint64_t *state) {
    static const float special[] = {0,        -0.0f,     1,         -1,       0.75f,
                                    32.25f,   0x1p-149f, -0x1p-126f, INFINITY, -INFINITY,
                                    0x1p-30f, 16777215,  31.5f,     32,       0x1p31f, 64};
    const uint32_t kind = next_number(state) % 8, bits = next_number(state);
    float any;
    memcpy(&any, &bits, sizeof any);
    if (kind == 0) return special[bits % (sizeof special / sizeof *special)];
    if (kind == 1) return any;
    if (kind < 4) return (float)((int32_t)bits >> 20) * 0.125f;
    return (float)(int32_t)bits * 0x1p-25f;
}

static void keep_words(lanes_results *out, int op, const uint32_t *words, int count) {
    for (int i = 0; i < count; i++) {
        float f;
        uint32_t word = words[i];
        memcpy(&f, &word, sizeof f);
        if (op < LANES_FLOATS && isnan(f)) word = 0x7fc00000; /* which NaN is nobody's business */
        out->digest[op] = (out->digest[op] ^ word) * 0x100000001b3u;
    }
}

static void keep_f(lanes_results *out, int op, vf a) {
    _Alignas(64) float f[16];
    uint32_t words[16];
    f_store(f, a);
    memcpy(words, f, sizeof words);
    keep_words(out, op, words, 16);
}

static void keep_i(lanes_results *out, int op, vi a) {
    _Alignas(64) uint32_t words[16];
    i_store(words, a);
    keep_words(out, op, words, 16);
}

static void keep_bits(lanes_results *out, int op, uint64_t bits) {
    const uint32_t words[2] = {(uint32_t)bits, (uint32_t)(bits >> 32)};
    keep_words(out, op, words, 2);
}

static void do_floats(lanes_results *out, vf a, vf b, vf c) {
    keep_f(out, 0, f_add(a, b)), keep_f(out, 1, f_sub(a, b)), keep_f(out, 2, f_mul(a, b));
    keep_f(out, 3, f_fma(a, b, c)), keep_f(out, 4, f_fnma(a, b, c));
    keep_f(out, 5, f_min(a, b)), keep_f(out, 6, f_max(a, b)), keep_f(out, 7, f_abs(a));
    keep_f(out, 8, f_sqrt(f_abs(a))), keep_f(out, 9, f_ceil(a)), keep_f(out, 10, f_invert(a));
    keep_f(out, 12, f_div(a, b));
    keep_f(out, 11, f_blend(f_lt(a, b), c, f_set(2)));
    const vm less = f_lt(a, b), other = m_from(m_bits(f_le(b, c)));
    keep_bits(out, 20, m_bits(less)), keep_bits(out, 21, m_bits(f_le(a, b)));
    keep_bits(out, 22, m_bits(m_and(less, other))), keep_bits(out, 23, m_bits(m_or(less, other)));
    keep_bits(out, 24, m_bits(m_xor(less, other)));
    keep_bits(out, 25, m_bits(m_andnot(less, other)));
    vi low, high;
    i_columns_pair(a, other, &low, &high);
    keep_i(out, 26, i_columns_from(a, other)), keep_i(out, 27, low), keep_i(out, 28, high);
}

static void do_words(lanes_results *out, vi a, vi b, vi c) {
    keep_i(out, 29, i_or(a, b)), keep_i(out, 30, i_and(a, b)), keep_i(out, 31, i_andnot(a, b));
    keep_i(out, 32, i_xor(a, b)), keep_i(out, 33, i_xor3(a, b, c));
    keep_i(out, 34, i_majority(a, b, c)), keep_i(out, 35, i_halve(a)), keep_i(out, 36, i_next(a));
    const vi sparse = i_and(i_and(a, b), c), full = i_or(i_set(~0u), sparse);
    const bool any = i_any(i_and(sparse, i_andnot(b, a))), all = i_all_ones(full);
    keep_bits(out, 37, (uint64_t)any + 2 * (uint64_t)all + 4 * (uint64_t)(i_all_ones(a) != 0));
    keep_bits(out, 38, i_total(i_count(i_count(i_zero(), a, 0), b, 3)));
}

void LANES(lanes_results *out) {
    uint64_t state = 11;
    *out = (lanes_results){{0}};
    for (int round = 0; round < 20000; round++) {
        _Alignas(64) float f[3][16];
        _Alignas(64) uint32_t words[3][16];
        _Alignas(64) uint16_t lanes[64];
        for (int i = 0; i < 48; i++) {
            f[i / 16][i % 16] = next_float(&state);
            words[i / 16][i % 16] = next_number(&state);
        }
        for (int i = 0; i < 64; i++) lanes[i] = (uint16_t)next_number(&state);
        do_floats(out, f_load(f[0]), f_load(f[1]), f_load(f[2]));
        do_words(out, i_load(words[0]), i_load(words[1]), i_load(words[2]));
        for (unsigned lane = 0; lane < 16; lane++) keep_bits(out, 39, lane_bits(lanes, lane));
    }
}
