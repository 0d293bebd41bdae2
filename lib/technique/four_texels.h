/* The four texels around each of four points, for maps of four channels a texel: sixteen lanes, four j
 * being texel j (lower left, lower right, upper left, upper right) and its lanes the points. */
#ifndef SS_TECHNIQUE_FOUR_TEXELS_H
#define SS_TECHNIQUE_FOUR_TEXELS_H

#include "base/wide.h"
#include "technique/light_maps.h"

/* Of four looks: the first of the four texels, what is added for the one to the right and the one above,
 * and the shares of those. */
typedef struct ss_cells {
    const float *plane;
    size_t at[4], right, up; /* in floats */
    ss_floats u, v;
} ss_cells;

static inline void ss_cells_find(ss_cells *out, const ss_light_maps *maps, const ss_looks *looks,
                                 size_t i) {
    const uint32_t side = maps->frames.resolution;
    const ss_floats most = ss_floats_all((float)side - 1.5f), zero = {0, 0, 0, 0};
    ss_floats x = ss_floats_load(looks->x + i) - .5f, y = ss_floats_load(looks->y + i) - .5f;
    x = ss_floats_more(ss_floats_less(x, most), zero);
    y = ss_floats_more(ss_floats_less(y, most), zero);
    const ss_ints column = __builtin_convertvector(x, ss_ints);
    const ss_ints line = __builtin_convertvector(y, ss_ints);
    ss_uints base;
    memcpy(&base, looks->base + i, sizeof base);
    const ss_uints at = base + (ss_uints)line * side + (ss_uints)column;
    out->plane = maps->plane;
    out->right = side > 1 ? 4 : 0, out->up = out->right * side;
    for (size_t p = 0; p < 4; p++) out->at[p] = 4 * (size_t)at[p];
    out->u = x - __builtin_convertvector(column, ss_floats);
    out->v = y - __builtin_convertvector(line, ss_floats);
}

/* All of a block's, whose texels then are on their way to the cache while the first are used. */
static inline void ss_cells_find_all(ss_cells cells[SS_LOOKS / 4], const ss_light_maps *maps,
                                     const ss_looks *looks, size_t n) {
    for (size_t i = 0; i < n; i += 4) {
        ss_cells *c = &cells[i / 4];
        ss_cells_find(c, maps, looks, i);
        for (int p = 0; p < 4; p++) {
            __builtin_prefetch(c->plane + c->at[p]);
            __builtin_prefetch(c->plane + c->at[p] + c->up);
        }
    }
}

/* A point's texels of part k. */
static inline void ss_cells_load_row(const ss_cells *c, int p, int k, ss_wide *row) {
    const size_t step[4] = {0, c->right, c->up, c->up + c->right};
    const float *texel = c->plane + c->at[p];
    ss_floats four[SS_FOURS];
    four[0] = ss_floats_load(texel + step[SS_FOURS * k]);
#if SS_FOURS > 1
    four[1] = ss_floats_load(texel + step[SS_FOURS * k + 1]);
#endif
#if SS_FOURS > 2
    four[2] = ss_floats_load(texel + step[2]), four[3] = ss_floats_load(texel + step[3]);
#endif
    ss_wide_make(four, row);
}

/* The channels of part k. */
static inline void ss_cells_load(const ss_cells *c, int k, ss_wide channel[4]) {
    ss_wide row[4];
    ss_cells_load_row(c, 0, k, &row[0]), ss_cells_load_row(c, 1, k, &row[1]);
    ss_cells_load_row(c, 2, k, &row[2]), ss_cells_load_row(c, 3, k, &row[3]);
    ss_wide_turn(row, channel);
}

/* Of part k. */
static inline void ss_cells_weights(const ss_cells *c, int k, ss_wide *weight) {
    const ss_floats u = 1 - c->u, v = 1 - c->v;
    const ss_floats all[4] = {u * v, c->u * v, u * c->v, c->u * c->v};
    ss_wide_make(all + SS_FOURS * k, weight);
}

#endif
