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
/* Coordinates, as many as a block may have, to shares; 0 and 1 stay what they are. See falloff.h. */
static inline void shares_of(const ss_falloff *falloff, float *linear, size_t n, float *out) {
    const ss_wide one = SS_WIDE_ALL(1.f), zero = SS_WIDE_ALL(0.f);
    for (size_t i = 0; i < n; i += SS_LANES) {
        ss_wide low, high, x = *(const ss_wide_there *)(linear + i);
        x = SS_WIDE_MORE(x, zero), x = SS_WIDE_LESS(x, one) * SS_FALLOFF_STEPS;
        const ss_wide_ints at = __builtin_convertvector(x, ss_wide_ints);
        ss_wide_gather(falloff->value, &at, &low);
        ss_wide_gather(falloff->value + 1, &at, &high);
        low += (x - __builtin_convertvector(at, ss_wide)) * (high - low);
        *(ss_wide_there *)(linear + i) = low;
    }
    memcpy(out, linear, n * sizeof *out);
}

/* ---- penumbra-map and smoothie --------------------------------------------------------------- */

/* The outer coordinate of one texel for receivers at h, times its weight. What is before them: *some is
 * set where anything is, *all cleared where they are not in the hard shadow. */
static inline ss_wide outer_share(const ss_wide channel[4], ss_wide weight, ss_wide h,
                                  ss_wide_mask *some, ss_wide_mask *all) {
    const ss_wide vertex = channel[SS_OUTER_VERTEX], one = SS_WIDE_ALL(1.f),
                  zero = SS_WIDE_ALL(0.f);
    const ss_wide gap = h - vertex, part = channel[SS_OUTER_RISE] / gap;
    const ss_wide size = (ss_wide)((ss_wide_ints)h & INT32_MAX);
    const ss_wide_mask soft =
        SS_WIDE_IS_LESS(SS_MAP_ALIKE * size, gap) & SS_WIDE_IS_LESS(part, one);
    const ss_wide_mask dark = SS_WIDE_IS_LESS(channel[SS_OUTER_DEPTH], h);
    *some |= dark | SS_WIDE_IS_LESS(vertex, h), *all &= dark;
    return weight * SS_WIDE_CHOOSE(dark, zero, SS_WIDE_CHOOSE(soft, part, one));
}

static inline ss_wide outer_of(const ss_light_maps *maps, const ss_cells *cells,
                               const size_t step[4], ss_wide h) {
    ss_wide channel[4], weight[4], part[4];
    ss_wide_mask some = SS_WIDE_NONE, all = ~some;
    ss_cells_weights(cells, weight);
    ss_cells_load(maps, cells, step[0], channel);
    part[0] = outer_share(channel, weight[0], h, &some, &all);
    ss_cells_load(maps, cells, step[1], channel);
    part[1] = outer_share(channel, weight[1], h, &some, &all);
    ss_cells_load(maps, cells, step[2], channel);
    part[2] = outer_share(channel, weight[2], h, &some, &all);
    ss_cells_load(maps, cells, step[3], channel);
    part[3] = outer_share(channel, weight[3], h, &some, &all);
    /* four that say the same are that, whatever their weights sum up to */
    const ss_wide sum = (part[0] + part[1]) + (part[2] + part[3]);
    const ss_wide mixed = SS_WIDE_CHOOSE(all, SS_WIDE_ALL(0.f), sum);
    return SS_WIDE_CHOOSE(some, mixed, SS_WIDE_ALL(1.f));
}

void RUNG(ss_answer_outer)(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    ss_cells ring[SS_CELLS];
    float linear[SS_LOOKS];
    size_t step[4];
    ss_cells_steps(maps, step);
    for (size_t i = 0; i < SS_CELLS_AHEAD; i += SS_LANES) ss_cells_fetch(ring, maps, looks, i, n);
    for (size_t i = 0; i < n; i += SS_LANES) {
        const ss_cells cells = ring[i / SS_LANES % SS_CELLS];
        ss_cells_fetch(ring, maps, looks, i + SS_CELLS_AHEAD, n);
        *(ss_wide_there *)(linear + i) =
            outer_of(maps, &cells, step, *(const ss_wide_there *)(looks->h + i));
    }
    shares_of(&maps->falloff, linear, n, out);
}

/* ---- penumbra-limit -------------------------------------------------------------------------- */

/* Equation 2. A gap that rounding could have made is none: the sign of q alone decides. */
static inline __attribute__((always_inline)) ss_wide equation_2(const ss_wide t[4], ss_wide z) {
    const ss_wide one = SS_WIDE_ALL(1.f), zero = SS_WIDE_ALL(0.f), half = SS_WIDE_ALL(.5f);
    const ss_wide least = SS_MAP_ALIKE * (ss_wide)((ss_wide_ints)z & INT32_MAX);
    const ss_wide gap = SS_WIDE_MORE(z - t[LIMIT_C], least);
    const ss_wide l = half + half * t[LIMIT_Q] / gap, kept = SS_WIDE_MORE(l, zero);
    const ss_wide_mask dark = SS_WIDE_IS_LESS(z, t[LIMIT_C]) | SS_WIDE_IS_LESS(t[LIMIT_B], z);
    const ss_wide soft = SS_WIDE_CHOOSE(dark, zero, SS_WIDE_LESS(kept, one));
    return SS_WIDE_CHOOSE(SS_WIDE_IS_LESS(z, t[LIMIT_G]), one, soft);
}

/* A texel alone; where there is no penumbra, or under the paper's way, its hard shadow, g and b brought
 * together at the surface that is on top. */
static inline ss_wide alone(const ss_wide t[4], ss_wide z, bool paper) {
    const ss_wide one = SS_WIDE_ALL(1.f), zero = SS_WIDE_ALL(0.f);
    const ss_wide_mask above = SS_WIDE_IS_LESS(z, t[LIMIT_G]),
                       below = SS_WIDE_IS_LESS(t[LIMIT_B], z),
                       some = SS_WIDE_IS_LESS(t[LIMIT_C], SS_WIDE_ALL(SS_MAP_FAR)),
                       past = some & SS_WIDE_IS_LESS(zero, t[LIMIT_Q]);
    const ss_wide hard = SS_WIDE_CHOOSE((past & ~below) | (~past & above), one, zero);
    if (paper) return hard;
    return SS_WIDE_CHOOSE(some, equation_2(t, z), hard);
}

/* What is between the four. */
static inline __attribute__((always_inline)) ss_wide between(ss_wide t[4][4],
                                                             const ss_wide weight[4], ss_wide z) {
    ss_wide sum[4];
    for (int c = 0; c < 4; c++) {
        sum[c] = weight[0] * t[0][c] + weight[1] * t[1][c];
        sum[c] = sum[c] + weight[2] * t[2][c] + weight[3] * t[3][c];
    }
    return equation_2(sum, z);
}

/* Most registers' points are all above whatever there is, also between the four, or all below one
 * occluder: what they do not need is not done. */
static inline __attribute__((always_inline)) ss_wide limit_of(const ss_limit_state *state,
                                                              const ss_cells *cells,
                                                              const size_t step[4], ss_wide z,
                                                              ss_wide same) {
    ss_wide t[4][4], weight[4], l = SS_WIDE_ALL(1.f);
    ss_cells_load(&state->maps, cells, step[0], t[0]);
    ss_cells_load(&state->maps, cells, step[1], t[1]);
    ss_cells_load(&state->maps, cells, step[2], t[2]);
    ss_cells_load(&state->maps, cells, step[3], t[3]);
    const ss_wide g = SS_WIDE_LESS(SS_WIDE_LESS(t[0][LIMIT_G], t[1][LIMIT_G]),
                                   SS_WIDE_LESS(t[2][LIMIT_G], t[3][LIMIT_G]));
    const ss_wide_mask lit = SS_WIDE_IS_LESS(z, g);
    if (!ss_wide_any((ss_wide_mask)~lit)) return l;
    const ss_wide most = SS_WIDE_MORE(SS_WIDE_MORE(t[0][LIMIT_C], t[1][LIMIT_C]),
                                      SS_WIDE_MORE(t[2][LIMIT_C], t[3][LIMIT_C]));
    const ss_wide least = SS_WIDE_LESS(SS_WIDE_LESS(t[0][LIMIT_C], t[1][LIMIT_C]),
                                       SS_WIDE_LESS(t[2][LIMIT_C], t[3][LIMIT_C]));
    const ss_wide_mask of_one = ~SS_WIDE_IS_LESS(same, most - least) &
                                SS_WIDE_IS_LESS(t[0][LIMIT_C], SS_WIDE_ALL(SS_MAP_FAR));
    ss_cells_weights(cells, weight);
    if (ss_wide_any((ss_wide_mask)(of_one & ~lit))) l = between(t, weight, z);
    if (ss_wide_any((ss_wide_mask)~(of_one | lit))) {
        const bool paper = state->paper;
        const ss_wide each =
            (weight[0] * alone(t[0], z, paper) + weight[1] * alone(t[1], z, paper)) +
            (weight[2] * alone(t[2], z, paper) + weight[3] * alone(t[3], z, paper));
        l = SS_WIDE_CHOOSE(of_one, l, each);
    }
    return SS_WIDE_CHOOSE(lit, SS_WIDE_ALL(1.f), l);
}

void RUNG(ss_answer_limit)(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    const ss_limit_state *state = (const ss_limit_state *)maps;
    ss_cells ring[SS_CELLS];
    float linear[SS_LOOKS];
    size_t step[4];
    ss_cells_steps(maps, step);
    for (size_t i = 0; i < SS_CELLS_AHEAD; i += SS_LANES) ss_cells_fetch(ring, maps, looks, i, n);
    for (size_t i = 0; i < n; i += SS_LANES) {
        const ss_cells cells = ring[i / SS_LANES % SS_CELLS];
        ss_wide same = SS_WIDE_ALL(state->same[0]);
        ss_cells_fetch(ring, maps, looks, i + SS_CELLS_AHEAD, n);
        for (size_t p = 0; maps->frames.cube && p < SS_LANES && i + p < n; p++) {
            same[p] = state->same[looks->face[i + p]];
        }
        *(ss_wide_there *)(linear + i) =
            limit_of(state, &cells, step, *(const ss_wide_there *)(looks->h + i), same);
    }
    shares_of(&maps->falloff, linear, n, out);
}
