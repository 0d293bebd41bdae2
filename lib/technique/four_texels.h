/* The four texels around each of as many points as a register has lanes, for maps of four channels a
 * texel: a register is one channel of one of the four texels (lower left, lower right, upper left, upper
 * right). */
#ifndef SS_TECHNIQUE_FOUR_TEXELS_H
#define SS_TECHNIQUE_FOUR_TEXELS_H

#include "base/wide.h"
#include "technique/light_maps.h"

/* The first of each look's four texels, and the shares of those on the right and above. */
typedef struct ss_cells {
    uint32_t at[SS_LANES];
    ss_wide u, v;
} ss_cells;

/* From look i on of n; lanes after the last are of texel 0. */
static inline void ss_cells_find(ss_cells *out, const ss_light_maps *maps, const ss_looks *looks,
                                 size_t i, size_t n) {
    const uint32_t side = maps->frames.resolution;
    const ss_wide most = SS_WIDE_ALL((float)side - 1.5f), zero = SS_WIDE_ALL(0.f);
    ss_wide x = *(const ss_wide_there *)(looks->x + i) - .5f;
    ss_wide y = *(const ss_wide_there *)(looks->y + i) - .5f;
    x = SS_WIDE_LESS(x, most), x = SS_WIDE_MORE(x, zero);
    y = SS_WIDE_LESS(y, most), y = SS_WIDE_MORE(y, zero);
    const ss_wide_ints column = __builtin_convertvector(x, ss_wide_ints);
    const ss_wide_ints line = __builtin_convertvector(y, ss_wide_ints);
    const ss_wide_ints base = *(const ss_wide_ints_there *)(looks->base + i);
    *(ss_wide_ints_there *)out->at = base + line * (int32_t)side + column;
    for (size_t k = n - i; k < SS_LANES; k++) out->at[k] = 0;
    out->u = x - __builtin_convertvector(column, ss_wide);
    out->v = y - __builtin_convertvector(line, ss_wide);
}

/* Cells are found so many looks before they are used: their texels then are on their way to the cache
 * while others are worked on. */
#define SS_CELLS_AHEAD 64
#define SS_CELLS (SS_CELLS_AHEAD / SS_LANES)

static inline void ss_cells_fetch(ss_cells ring[SS_CELLS], const ss_light_maps *maps,
                                  const ss_looks *looks, size_t i, size_t n) {
    ss_cells *c = &ring[i / SS_LANES % SS_CELLS];
    const size_t up = 4 * (size_t)maps->frames.resolution;
    if (i >= n) return;
    ss_cells_find(c, maps, looks, i, n);
    for (size_t p = 0; p < SS_LANES; p++) {
        const float *texel = maps->plane + 4 * (size_t)c->at[p];
        __builtin_prefetch(texel);
        __builtin_prefetch(texel + up);
    }
}

/* One texel of points p, p + 4 and so on. */
static inline void ss_cells_load_row(const float *texels, const ss_cells *c, int p, ss_wide *row) {
    ss_floats four[SS_FOURS];
    four[0] = ss_floats_load(texels + 4 * (size_t)c->at[p]);
#if SS_FOURS > 1
    four[1] = ss_floats_load(texels + 4 * (size_t)c->at[p + 4]);
#endif
#if SS_FOURS > 2
    four[2] = ss_floats_load(texels + 4 * (size_t)c->at[p + 8]);
    four[3] = ss_floats_load(texels + 4 * (size_t)c->at[p + 12]);
#endif
    ss_wide_make(four, row);
}

/* The channels of one texel, its floats being so far from the first's. */
static inline __attribute__((always_inline)) void ss_cells_load(const ss_light_maps *maps, const ss_cells *c, size_t step,
                                 ss_wide channel[4]) {
    const float *texels = maps->plane + step;
    ss_wide row[4];
    ss_cells_load_row(texels, c, 0, &row[0]), ss_cells_load_row(texels, c, 1, &row[1]);
    ss_cells_load_row(texels, c, 2, &row[2]), ss_cells_load_row(texels, c, 3, &row[3]);
    ss_wide_turn(row, channel);
}

/* What is added for each of the four. */
static inline void ss_cells_steps(const ss_light_maps *maps, size_t step[4]) {
    const uint32_t side = maps->frames.resolution;
    const size_t right = side > 1 ? 4 : 0, up = right * side;
    step[0] = 0, step[1] = right, step[2] = up, step[3] = up + right;
}

/* Their weights. */
static inline void ss_cells_weights(const ss_cells *c, ss_wide weight[4]) {
    const ss_wide u = 1 - c->u, v = 1 - c->v;
    weight[0] = u * v, weight[1] = c->u * v, weight[2] = u * c->v, weight[3] = c->u * c->v;
}

#endif
