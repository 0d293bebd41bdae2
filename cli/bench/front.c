/* The Pareto front of run time and error: the rows that no other beats in both. */
#include <string.h>

#include "matrix.h"

/* Over penumbrae, where methods differ; over all points where there are none. */
static double error_of(const matrix_cell *cell, const matrix_way *w) {
    return cell->penumbra > 0 ? w->way.penumbra_rms : w->way.rms;
}

/* The row that takes least of all others which err no more than row i; count if there is none. */
static uint32_t fastest(const matrix_cell *cell, uint32_t i, bool ours) {
    const double error = error_of(cell, &cell->ways[i]);
    uint32_t best = cell->count;
    for (uint32_t k = 0; k < cell->count; k++) {
        const matrix_way *w = &cell->ways[k];
        if (k == i || (ours && !w->ours) || error_of(cell, w) > error) continue;
        if (best == cell->count || w->way.seconds < cell->ways[best].way.seconds) best = k;
    }
    return best;
}

void front_mark(matrix_cell *cell) {
    for (uint32_t i = 0; i < cell->count; i++) {
        matrix_way *w = &cell->ways[i];
        w->ahead = fastest(cell, i, false), w->ahead_ours = fastest(cell, i, true);
        w->behind = w->behind_ours = 0;
        if (w->ahead < cell->count) w->behind = w->way.seconds / cell->ways[w->ahead].way.seconds;
        if (w->ahead_ours < cell->count)
            w->behind_ours = w->way.seconds / cell->ways[w->ahead_ours].way.seconds;
    }
}

bool front_must(const matrix_way *w) {
    return strcmp(w->method, "auto") == 0 && w->way.penumbra_rms <= FRONT_ERROR;
}
