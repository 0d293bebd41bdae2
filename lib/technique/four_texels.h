/* The four texels around each of as many points as a register has lanes, for maps of four channels
 * a texel: a register is one channel of one of the four texels (lower left, lower right, upper
 * left, upper right). */
#ifndef SS_TECHNIQUE_FOUR_TEXELS_H
#define SS_TECHNIQUE_FOUR_TEXELS_H

#include "base/wide.h"
#include "technique/light_maps.h"

/* The first of each look's four texels, and the shares of those on the right and above. */
typedef struct ss_cells {
    uint32_t at[SS_LANES];
    ss_wide u, v;
    bool lit; /* all of them, as ss_light_maps' lit says: nothing was fetched */
} ss_cells;

/* Are all of a register's looks of one face, before whatever there is in their tiles? */
static inline bool ss_cells_lit(const ss_light_maps *maps, const ss_looks *looks, size_t i,
                                ss_wide_ints column, ss_wide_ints line) {
    const ss_wide_ints tile = line / SS_RASTER_TILE * (int32_t)ss_light_maps_tiles(maps) +
                              column / SS_RASTER_TILE;
    ss_wide depth;
    ss_wide_gather(maps->lit, &tile, &depth);
    return !ss_wide_any(
        (ss_wide_mask)~SS_WIDE_IS_LESS(*(const ss_wide_there *)(looks->h + i), depth));
}

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
    out->lit = maps->lit && !maps->frames.cube && i + SS_LANES <= n &&
               ss_cells_lit(maps, looks, i, column, line);
}

/* Cells are found so many looks before they are used: their texels then are on their way to the
 * cache while others are worked on. */
#define SS_CELLS_AHEAD 64
#define SS_CELLS (SS_CELLS_AHEAD / SS_LANES)

static inline void ss_cells_fetch(ss_cells ring[SS_CELLS], const ss_light_maps *maps,
                                  const ss_looks *looks, size_t i, size_t n) {
    ss_cells *c = &ring[i / SS_LANES % SS_CELLS];
    const size_t up = 4 * (size_t)maps->frames.resolution;
    if (i >= n) return;
    ss_cells_find(c, maps, looks, i, n);
    if (c->lit) return;
#pragma GCC unroll 16
    for (size_t p = 0; p < SS_LANES; p++) {
        const float *texel = maps->plane + 4 * (size_t)c->at[p];
        __builtin_prefetch(texel);
        __builtin_prefetch(texel + up);
    }
}

/* Two texels side by side, of points p, p + 4 and so on: the left ones, the right ones. */
static inline __attribute__((always_inline)) void
ss_cells_load_pairs(const float *texels, const ss_cells *c, int p, ss_wide *left, ss_wide *right) {
#if SS_FOURS == 1
    *left = ss_floats_load(texels + 4 * (size_t)c->at[p]);
    *right = ss_floats_load(texels + 4 * (size_t)c->at[p] + 4);
#else
    ss_eight pair[SS_FOURS];
    pair[0] = *(const ss_eight_there *)(texels + 4 * (size_t)c->at[p]);
    pair[1] = *(const ss_eight_there *)(texels + 4 * (size_t)c->at[p + 4]);
#if SS_FOURS == 2
    *left = __builtin_shufflevector(pair[0], pair[1], 0, 1, 2, 3, 8, 9, 10, 11);
    *right = __builtin_shufflevector(pair[0], pair[1], 4, 5, 6, 7, 12, 13, 14, 15);
#else
    pair[2] = *(const ss_eight_there *)(texels + 4 * (size_t)c->at[p + 8]);
    pair[3] = *(const ss_eight_there *)(texels + 4 * (size_t)c->at[p + 12]);
    const ss_wide low = SS_WIDE_EIGHTS(pair[0], pair[1]), high = SS_WIDE_EIGHTS(pair[2], pair[3]);
    *left = __builtin_shufflevector(low, high, 0, 1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19, 24, 25, 26,
                                    27);
    *right = __builtin_shufflevector(low, high, 4, 5, 6, 7, 12, 13, 14, 15, 20, 21, 22, 23, 28, 29,
                                     30, 31);
#endif
#endif
}

/* The channels of the two texels from so many floats after the first on; `one`: in a map of one
 * texel both are that. */
static inline __attribute__((always_inline)) void ss_cells_load(const ss_light_maps *maps,
                                                                const ss_cells *c, size_t step,
                                                                bool one, ss_wide channel[2][4]) {
    const float *texels = maps->plane + step;
    ss_wide left[4], right[4];
    if (one) {
        for (int p = 0; p < 4; p++) {
            ss_floats four[SS_FOURS];
            for (int k = 0; k < SS_FOURS; k++)
                four[k] = ss_floats_load(texels + 4 * (size_t)c->at[p + 4 * k]);
            ss_wide_make(four, &left[p]), right[p] = left[p];
        }
    } else {
        ss_cells_load_pairs(texels, c, 0, &left[0], &right[0]);
        ss_cells_load_pairs(texels, c, 1, &left[1], &right[1]);
        ss_cells_load_pairs(texels, c, 2, &left[2], &right[2]);
        ss_cells_load_pairs(texels, c, 3, &left[3], &right[3]);
    }
    ss_wide_turn(left, channel[0]), ss_wide_turn(right, channel[1]);
}

/* What is added for the upper two of the four. */
static inline size_t ss_cells_up(const ss_light_maps *maps) {
    const uint32_t side = maps->frames.resolution;
    return side > 1 ? 4 * (size_t)side : 0;
}

/* Their weights. */
static inline void ss_cells_weights(const ss_cells *c, ss_wide weight[4]) {
    const ss_wide u = 1 - c->u, v = 1 - c->v;
    weight[0] = u * v, weight[1] = c->u * v, weight[2] = u * c->v, weight[3] = c->u * c->v;
}

#endif
