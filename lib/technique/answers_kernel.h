/* Compiled once for each rung. */
#include <math.h>
#include <string.h>

#include "technique/answers.h"
#include "technique/four_texels.h"
#include "technique/limit.h"
#include "technique/single_sample.h"

/* A gap between occluder and receiver smaller than this, relative to their depth, is none: 8 units
 * in the last place of a float (design: techniques.md, Depth). */

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
/* Floats at places of a table that may be larger than a gather reaches. */
static inline void take(const float *table, const uint32_t at[SS_LANES], size_t channels,
                        ss_wide *out) {
    float taken[SS_LANES];
    for (int i = 0; i < SS_LANES; i++) taken[i] = table[at[i] * channels];
    *out = *(const ss_wide_there *)taken;
}

/* Coordinates, as many as a block may have, to shares; 0 and 1 stay what they are. See
 * falloff.h. */
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

/* ---- pcf ------------------------------------------------------------------------------------- */

/* Where the tap at the lower left is, -1 before the first, and how far the point is beyond it. */
static inline void split(const float *place, ss_wide_ints *cell, ss_wide *share) {
    const ss_wide low = *(const ss_wide_there *)place - .5f;
    *cell = (__builtin_convertvector(low, ss_wide_ints) & (low >= 0)) | (low < 0);
    *share = low - __builtin_convertvector(*cell, ss_wide);
}

static inline void lit_at(const ss_light_maps *maps, const ss_looks *looks, size_t i, size_t n,
                          ss_wide_ints x, ss_wide_ints y, ss_wide *out) {
    const int32_t last = (int32_t)maps->frames.resolution - 1;
    uint32_t at[SS_LANES];
    ss_wide depth;
    x &= x > 0, x = (x & (x <= last)) | (last & (x > last));
    y &= y > 0, y = (y & (y <= last)) | (last & (y > last));
    *(ss_wide_ints_there *)at = *(const ss_wide_ints_there *)(looks->base + i) + y * (last + 1) + x;
    for (size_t k = n - i; k < SS_LANES; k++) at[k] = 0;
    take(maps->depth, at, 1, &depth);
    const ss_wide_mask dark = SS_WIDE_IS_LESS(depth, *(const ss_wide_there *)(looks->h + i));
    *out = SS_WIDE_CHOOSE(dark, SS_WIDE_ALL(0.f), SS_WIDE_ALL(1.f));
}

void RUNG(ss_answer_tent)(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    float answers[SS_LOOKS];
    for (size_t i = 0; i < n; i += SS_LANES) {
        ss_wide_ints x, y;
        ss_wide u, v, lit[4];
        split(looks->x + i, &x, &u), split(looks->y + i, &y, &v);
        lit_at(maps, looks, i, n, x, y, &lit[0]), lit_at(maps, looks, i, n, x + 1, y, &lit[1]);
        lit_at(maps, looks, i, n, x, y + 1, &lit[2]);
        lit_at(maps, looks, i, n, x + 1, y + 1, &lit[3]);
        const ss_wide below = (1 - u) * lit[0] + u * lit[1], above = (1 - u) * lit[2] + u * lit[3];
        *(ss_wide_there *)(answers + i) = (1 - v) * below + v * above;
    }
    memcpy(out, answers, n * sizeof *out);
}

/* ---- single-sample --------------------------------------------------------------------------- */

/* The inner coordinate of one texel for receivers at h: 1 at the rim of the hard shadow, 0 where
 * the shadow is as wide as the penumbra. */
static inline void inner_of(const ss_light_maps *maps, const uint32_t at[SS_LANES], ss_wide h,
                            ss_wide rate, ss_wide *out) {
    const ss_wide one = SS_WIDE_ALL(1.f), zero = SS_WIDE_ALL(0.f);
    const ss_wide least = SS_MAP_ALIKE * (ss_wide)((ss_wide_ints)h & INT32_MAX);
    ss_wide depth, inside;
    take(maps->plane + SINGLE_DEPTH, at, SINGLE_CHANNELS, &depth);
    take(maps->plane + SINGLE_INSIDE, at, SINGLE_CHANNELS, &inside);
    const ss_wide gap = h - depth, open = 1 - inside / (rate * gap),
                  kept = SS_WIDE_MORE(open, zero);
    const ss_wide soft = SS_WIDE_CHOOSE(SS_WIDE_IS_LESS(least, gap), SS_WIDE_LESS(kept, one), zero);
    *out = SS_WIDE_CHOOSE(SS_WIDE_IS_LESS(zero, gap), soft, one);
}

void RUNG(ss_answer_single)(const ss_light_maps *maps, const ss_looks *looks, size_t n,
                            float *out) {
    const ss_single_state *state = (const ss_single_state *)maps;
    const uint32_t side = maps->frames.resolution, right = side > 1, up = side > 1 ? side : 0;
    float linear[SS_LOOKS];
    for (size_t i = 0; i < n; i += SS_LANES) {
        const ss_wide h = *(const ss_wide_there *)(looks->h + i);
        ss_wide rate = SS_WIDE_ALL(state->rate[0]), open[4];
        uint32_t at[4][SS_LANES];
        ss_cells cells;
        ss_cells_find(&cells, maps, looks, i, n);
        for (size_t p = 0; maps->frames.cube && p < SS_LANES && i + p < n; p++) {
            rate[p] = state->rate[looks->face[i + p]];
        }
        for (int p = 0; p < SS_LANES; p++) {
            at[0][p] = cells.at[p], at[1][p] = cells.at[p] + right;
            at[2][p] = cells.at[p] + up, at[3][p] = cells.at[p] + up + right;
        }
        for (int k = 0; k < 4; k++) inner_of(maps, at[k], h, rate, &open[k]);
        const ss_wide u = cells.u, v = cells.v;
        const ss_wide below = (1 - u) * open[0] + u * open[1];
        const ss_wide above = (1 - u) * open[2] + u * open[3];
        *(ss_wide_there *)(linear + i) = (1 - v) * below + v * above;
    }
    shares_of(&maps->falloff, linear, n, out);
}

/* ---- penumbra-map and smoothie --------------------------------------------------------------- */

/* The outer coordinate of one texel for receivers at h, times its weight. What is before them:
 * *some is set where anything is, *all cleared where they are not in the hard shadow. */
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

static inline __attribute__((always_inline)) ss_wide
outer_of(const ss_light_maps *maps, const ss_cells *cells, size_t up, ss_wide h) {
    const bool one = up == 0;
    ss_wide below[2][4], above[2][4], weight[4], part[4];
    ss_wide_mask some = SS_WIDE_NONE, all = ~some;
    ss_cells_weights(cells, weight);
    ss_cells_load(maps, cells, 0, one, below);
    part[0] = outer_share(below[0], weight[0], h, &some, &all);
    part[1] = outer_share(below[1], weight[1], h, &some, &all);
    ss_cells_load(maps, cells, up, one, above);
    part[2] = outer_share(above[0], weight[2], h, &some, &all);
    part[3] = outer_share(above[1], weight[3], h, &some, &all);
    /* four that say the same are that, whatever their weights sum up to */
    const ss_wide sum = (part[0] + part[1]) + (part[2] + part[3]);
    const ss_wide mixed = SS_WIDE_CHOOSE(all, SS_WIDE_ALL(0.f), sum);
    return SS_WIDE_CHOOSE(some, mixed, SS_WIDE_ALL(1.f));
}

void RUNG(ss_answer_outer)(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out) {
    ss_cells ring[SS_CELLS];
    float linear[SS_LOOKS];
    const size_t up = ss_cells_up(maps);
    for (size_t i = 0; i < SS_CELLS_AHEAD; i += SS_LANES) ss_cells_fetch(ring, maps, looks, i, n);
    for (size_t i = 0; i < n; i += SS_LANES) {
        const ss_wide h = *(const ss_wide_there *)(looks->h + i);
        const ss_cells *cells = &ring[i / SS_LANES % SS_CELLS];
        *(ss_wide_there *)(linear + i) =
            cells->lit ? SS_WIDE_ALL(1.f)
            : up       ? outer_of(maps, cells, up, h)
                       : outer_of(maps, cells, 0, h);
        ss_cells_fetch(ring, maps, looks, i + SS_CELLS_AHEAD, n);
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

/* A texel alone; where there is no penumbra, or under the paper's way, its hard shadow, g and b
 * brought together at the surface that is on top. */
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
#define MEAN(c)                                                                                    \
    (weight[0] * t[0][c] + weight[1] * t[1][c] + weight[2] * t[2][c] + weight[3] * t[3][c])
    const ss_wide sum[4] = {[LIMIT_C] = MEAN(LIMIT_C), [LIMIT_G] = MEAN(LIMIT_G),
                            [LIMIT_B] = MEAN(LIMIT_B), [LIMIT_Q] = MEAN(LIMIT_Q)};
#undef MEAN
    return equation_2(sum, z);
}

/* Most registers' points are all above whatever there is, also between the four, or all below one
 * occluder: what they do not need is not done. */
static inline __attribute__((always_inline)) ss_wide limit_of(const ss_limit_state *state,
                                                              const ss_cells *cells,
                                                              size_t up, ss_wide z,
                                                              ss_wide same) {
    ss_wide t[4][4], weight[4], l = SS_WIDE_ALL(1.f);
    const bool one = up == 0;
    ss_cells_load(&state->maps, cells, 0, one, t),
        ss_cells_load(&state->maps, cells, up, one, t + 2);
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
    const size_t up = ss_cells_up(maps);
    for (size_t i = 0; i < SS_CELLS_AHEAD; i += SS_LANES) ss_cells_fetch(ring, maps, looks, i, n);
    for (size_t i = 0; i < n; i += SS_LANES) {
        const ss_wide z = *(const ss_wide_there *)(looks->h + i);
        const ss_cells *cells = &ring[i / SS_LANES % SS_CELLS];
        ss_wide same = SS_WIDE_ALL(state->same[0]);
        for (size_t p = 0; maps->frames.cube && p < SS_LANES && i + p < n; p++) {
            same[p] = state->same[looks->face[i + p]];
        }
        *(ss_wide_there *)(linear + i) =
            cells->lit ? SS_WIDE_ALL(1.f)
            : up       ? limit_of(state, cells, up, z, same)
                       : limit_of(state, cells, 0, z, same);
        ss_cells_fetch(ring, maps, looks, i + SS_CELLS_AHEAD, n);
    }
    shares_of(&maps->falloff, linear, n, out);
}
