/* The four texels around a place, for maps of four channels a texel. */
#ifndef SS_TECHNIQUE_FOUR_TEXELS_H
#define SS_TECHNIQUE_FOUR_TEXELS_H

#include "base/lanes.h"
#include "technique/light_maps.h"

/* Of a block of looks: the first of the four, and the shares of the second and the third. */
typedef struct ss_cells {
    uint32_t at[SS_LOOKS];
    float u[SS_LOOKS], v[SS_LOOKS];
} ss_cells;

/* Fills up to whole fours; looks beyond n hold anything. */
static inline void ss_cells_find(ss_cells *out, const ss_looks *looks, size_t n, uint32_t side) {
    const ss_floats most = ss_floats_all((float)side - 1.5f), zero = {0, 0, 0, 0};
    for (size_t i = 0; i < n; i += 4) {
        ss_floats x = ss_floats_load(looks->x + i) - .5f, y = ss_floats_load(looks->y + i) - .5f;
        x = ss_floats_more(ss_floats_less(x, most), zero);
        y = ss_floats_more(ss_floats_less(y, most), zero);
        const ss_ints column = __builtin_convertvector(x, ss_ints);
        const ss_ints line = __builtin_convertvector(y, ss_ints);
        ss_uints at; /* beyond n any number, which wraps */
        memcpy(&at, looks->base + i, sizeof at);
        at += (ss_uints)line * side + (ss_uints)column;
        memcpy(out->at + i, &at, sizeof at);
        ss_floats_store(out->u + i, x - __builtin_convertvector(column, ss_floats));
        ss_floats_store(out->v + i, y - __builtin_convertvector(line, ss_floats));
    }
}

/* Lower left, lower right, upper left, upper right. */
static inline ss_floats ss_cells_weights(float u, float v) {
    return (ss_floats){1 - u, u, 1 - u, u} * (ss_floats){1 - v, 1 - v, v, v};
}

#endif
