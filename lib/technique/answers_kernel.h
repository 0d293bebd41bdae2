/* Compiled once for each rung. */
#include <math.h>
#include <string.h>

#include "technique/answers.h"
#include "technique/four_texels.h"
#include "technique/limit.h"

/* A gap between occluder and receiver smaller than this, relative to their depth, is none: 8 units in
 * the last place of a float (design: techniques.md, Depth). */

void RUNG(ss_answer_hard)(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    const int32_t side = (int32_t)maps->frames.resolution;
    const float *depth = maps->depth;
    for (size_t i = 0; i < n; i += 8) {
        ss_eight_ints base = *(const ss_eight_ints_there *)(looks->base + i);
        const ss_eight x = *(const ss_eight_there *)(looks->x + i);
        const ss_eight y = *(const ss_eight_there *)(looks->y + i);
        const ss_eight h = *(const ss_eight_there *)(looks->h + i);
        ss_eight seen;
        uint32_t at[8];
        base += __builtin_convertvector(y, ss_eight_ints) * side;
        base += __builtin_convertvector(x, ss_eight_ints);
        memcpy(at, &base, sizeof at);
        if (n - i < 8) memset(at + (n - i), 0, (8 - (n - i)) * sizeof *at); /* nobody's: any number */
        for (int k = 0; k < 8; k++) seen[k] = depth[at[k]];
        const ss_eight_ints one = (ss_eight_ints)(1 - (ss_eight){0}), lit = ~(seen < h) & one;
        memcpy(out + i, &lit, (n - i < 8 ? n - i : 8) * sizeof *out);
    }
}
/* The sum over the four texels, pairs first. */
static inline ss_floats sum_of(const ss_floats part[4]) {
    return (part[0] + part[1]) + (part[2] + part[3]);
}

/* Coordinates, as many as a block may have, to shares; 0 and 1 stay what they are. See falloff.h. */
static inline void shares_of(const ss_falloff *falloff, float *linear, size_t n, float *out) {
    const ss_wide one = SS_WIDE_ALL(1.f), zero = SS_WIDE_ALL(0.f);
    for (size_t i = 0; i < n; i += SS_LANES) {
        ss_wide low, high, x = *(const ss_wide_there *)(linear + i);
        x = SS_WIDE_PICK(x > zero, x, zero);
        x = SS_WIDE_PICK(x < one, x, one) * SS_FALLOFF_STEPS;
        const ss_wide_ints at = __builtin_convertvector(x, ss_wide_ints);
        ss_wide_gather(falloff->value, &at, &low);
        ss_wide_gather(falloff->value + 1, &at, &high);
        low += (x - __builtin_convertvector(at, ss_wide)) * (high - low);
        *(ss_wide_there *)(linear + i) = low;
    }
    memcpy(out, linear, n * sizeof *out);
}

/* A bit for each point where it is so in some texel, or in all: of sixteen bits as lanes are. */
static inline uint32_t in_some(uint32_t bits) {
    bits |= bits >> 8;
    return (bits | bits >> 4) & 15;
}

static inline uint32_t in_all(uint32_t bits) {
    bits &= bits >> 8;
    return bits & bits >> 4 & 15;
}

/* ---- penumbra-map and smoothie --------------------------------------------------------------- */

/* The outer coordinates of texels for receivers at h, by their weights. */
static inline void outer_share(const ss_wide channel[4], ss_wide *weight, const ss_wide *h) {
    const ss_wide vertex = channel[SS_OUTER_VERTEX], one = SS_WIDE_ALL(1.f),
                  zero = SS_WIDE_ALL(0.f);
    const ss_wide gap = *h - vertex, part = channel[SS_OUTER_RISE] / gap;
    const ss_wide size = (ss_wide)((ss_wide_ints)*h & INT32_MAX);
    const ss_wide_ints soft = (gap > SS_MAP_ALIKE * size) & (part < one),
                       dark = channel[SS_OUTER_DEPTH] < *h;
    const ss_wide share = SS_WIDE_PICK(soft, part, one);
    *weight *= SS_WIDE_PICK(dark, zero, share);
}

/* The points that have something before them in some of their texels; in all. */
static inline void outer_hidden(ss_wide channel[SS_PARTS][4], const ss_wide *h, uint32_t *some,
                                uint32_t *all) {
    uint32_t either = 0, both = 0;
    for (int k = 0; k < SS_PARTS; k++) {
        const ss_wide_ints dark = channel[k][SS_OUTER_DEPTH] < *h;
        const ss_wide_ints any = dark | (channel[k][SS_OUTER_VERTEX] < *h);
        either |= ss_wide_bits(&any) << SS_LANES * k, both |= ss_wide_bits(&dark) << SS_LANES * k;
    }
    *some = in_some(either), *all = in_all(both);
}

void RUNG(ss_answer_outer)(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    ss_cells all_cells[SS_LOOKS / 4];
    float linear[SS_LOOKS];
    ss_cells_find_all(all_cells, maps, looks, n);
    for (size_t i = 0; i < n; i += 4) {
        const ss_cells *cells = &all_cells[i / 4];
        ss_wide channel[SS_PARTS][4], h;
        uint32_t some, all;
        ss_wide_repeat(ss_floats_load(looks->h + i), &h);
        for (int k = 0; k < SS_PARTS; k++) ss_cells_load(cells, k, channel[k]);
        outer_hidden(channel, &h, &some, &all);
        /* four that say the same are that, whatever their weights sum up to */
        ss_floats l = ss_floats_pick(ss_floats_mask(some), ss_floats_all(0), ss_floats_all(1));
        if (some & ~all) {
            ss_floats part[4];
            for (int k = 0; k < SS_PARTS; k++) {
                ss_wide weight;
                ss_cells_weights(cells, k, &weight);
                outer_share(channel[k], &weight, &h);
                ss_wide_split(&weight, part + SS_FOURS * k);
            }
            l = ss_floats_pick(ss_floats_mask(some & ~all), sum_of(part), l);
        }
        ss_floats_store(linear + i, l);
    }
    shares_of(&maps->falloff, linear, n, out);
}

/* ---- penumbra-limit -------------------------------------------------------------------------- */

/* Equation 2 for four points. A gap that rounding could have made is none: the sign of q alone
 * decides. */
static inline ss_floats equation_2(const ss_floats t[4], ss_floats z) {
    const ss_floats one = ss_floats_all(1), zero = ss_floats_all(0), half = ss_floats_all(.5f);
    const ss_floats gap = ss_floats_more(z - t[LIMIT_C], SS_MAP_ALIKE * ss_floats_size(z));
    const ss_floats l = half + half * t[LIMIT_Q] / gap;
    const ss_ints dark = (ss_ints)(z < t[LIMIT_C]) | (ss_ints)(z > t[LIMIT_B]);
    const ss_floats soft = ss_floats_pick(dark, zero, ss_floats_less(ss_floats_more(l, zero), one));
    return ss_floats_pick((ss_ints)(z < t[LIMIT_G]), one, soft);
}

/* Of texels of one occluder: what is between them. */
static inline ss_floats between(ss_wide channel[SS_PARTS][4], const ss_wide weight[SS_PARTS],
                                ss_floats z) {
    ss_floats t[4];
    for (int c = 0; c < 4; c++) {
        ss_floats part[4];
        for (int k = 0; k < SS_PARTS; k++) {
            const ss_wide share = weight[k] * channel[k][c];
            ss_wide_split(&share, part + SS_FOURS * k);
        }
        t[c] = part[0] + part[1] + part[2] + part[3];
    }
    return equation_2(t, z);
}

/* Each alone; where there is no penumbra, or under the paper's way, the hard shadow of each, g and b
 * brought together at the surface that is on top. */
static inline void alone(const ss_wide channel[4], ss_wide *weight, const ss_wide *z, bool paper) {
    const ss_wide c = channel[LIMIT_C], g = channel[LIMIT_G], b = channel[LIMIT_B],
                  q = channel[LIMIT_Q];
    const ss_wide one = SS_WIDE_ALL(1.f), zero = SS_WIDE_ALL(0.f), half = SS_WIDE_ALL(.5f);
    const ss_wide least = SS_MAP_ALIKE * (ss_wide)((ss_wide_ints)*z & INT32_MAX), gap = *z - c;
    const ss_wide_ints above = *z < g, below = *z > b, none = c == SS_MAP_FAR;
    ss_wide l = half + half * q / SS_WIDE_PICK(gap > least, gap, least);
    l = SS_WIDE_PICK(l > zero, l, zero);
    l = SS_WIDE_PICK(l < one, l, one);
    const ss_wide soft = SS_WIDE_PICK((*z < c) | below, zero, l);
    const ss_wide_ints past = ~none & (q > zero), lit = (past & ~below) | (~past & above);
    const ss_wide_ints is_hard = paper ? ~(none & ~none) : none;
    const ss_wide hard = SS_WIDE_PICK(lit, one, zero), own = SS_WIDE_PICK(above, one, soft);
    *weight *= SS_WIDE_PICK(is_hard, hard, own);
}

static inline ss_floats each(ss_wide channel[SS_PARTS][4], const ss_wide weight[SS_PARTS],
                             const ss_wide *z, bool paper) {
    ss_floats part[4];
    for (int k = 0; k < SS_PARTS; k++) {
        ss_wide share = weight[k];
        alone(channel[k], &share, z, paper);
        ss_wide_split(&share, part + SS_FOURS * k);
    }
    return sum_of(part);
}

/* The points whose four are of one occluder. */
static inline ss_ints alike(ss_wide channel[SS_PARTS][4], ss_floats same) {
    ss_floats c[4];
    for (int k = 0; k < SS_PARTS; k++) ss_wide_split(&channel[k][LIMIT_C], c + SS_FOURS * k);
    const ss_floats most = ss_floats_more(ss_floats_more(c[0], c[1]), ss_floats_more(c[2], c[3]));
    const ss_floats least = ss_floats_less(ss_floats_less(c[0], c[1]), ss_floats_less(c[2], c[3]));
    return (ss_ints)(most - least <= same) & (ss_ints)(c[0] < SS_MAP_FAR);
}

/* The points that are above whatever there is, also between the four. */
static inline uint32_t above_all(ss_wide channel[SS_PARTS][4], const ss_wide *z) {
    uint32_t bits = 0;
    for (int k = 0; k < SS_PARTS; k++) {
        const ss_wide_ints above = *z < channel[k][LIMIT_G];
        bits |= ss_wide_bits(&above) << SS_LANES * k;
    }
    return in_all(bits);
}

void RUNG(ss_answer_limit)(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    const ss_limit_state *state = (const ss_limit_state *)maps;
    ss_cells all_cells[SS_LOOKS / 4];
    float linear[SS_LOOKS];
    ss_cells_find_all(all_cells, maps, looks, n);
    for (size_t i = 0; i < n; i += 4) {
        const ss_cells *cells = &all_cells[i / 4];
        ss_wide channel[SS_PARTS][4], weight[SS_PARTS], h;
        const ss_floats z = ss_floats_load(looks->h + i), one = ss_floats_all(1);
        ss_wide_repeat(z, &h);
        for (int k = 0; k < SS_PARTS; k++) ss_cells_load(cells, k, channel[k]);
        const uint32_t lit = above_all(channel, &h);
        ss_floats answer = one;
        if (lit != 15) {
            ss_floats same, l;
            for (int p = 0; p < 4; p++) same[p] = state->same[looks->face[i + (size_t)p]];
            const ss_ints of_one = alike(channel, same);
            const int bits = ss_floats_bits(of_one);
            for (int k = 0; k < SS_PARTS; k++) ss_cells_weights(cells, k, &weight[k]);
            if (bits == 15) l = between(channel, weight, z);
            else l = each(channel, weight, &h, state->paper);
            if (bits && bits != 15) l = ss_floats_pick(of_one, between(channel, weight, z), l);
            answer = ss_floats_pick(ss_floats_mask(lit), one, l);
        }
        ss_floats_store(linear + i, answer);
    }
    shares_of(&maps->falloff, linear, n, out);
}
