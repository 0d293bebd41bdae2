/* Compiled once for each rung. */
#include <string.h>

#include "base/wide.h"
#include "engine/places.h"

/* Of a host: at any byte. */
typedef float eight_there __attribute__((vector_size(32), aligned(1), may_alias));

/* ---- as the caller has them ----------------------------------------------------------------- */

static void read_one(const softshadow_points *points, size_t i, double p[3]) {
    const char *at = (const char *)points->positions + i * points->position_stride;
    float f[3];
    if (points->position_type == SOFTSHADOW_F64) {
        memcpy(p, at, 3 * sizeof *p);
    } else {
        memcpy(f, at, sizeof f);
        for (int k = 0; k < 3; k++) p[k] = (double)f[k];
    }
}

/* Eight packed points of floats: x y z x y z ... */
static inline void read_eight(const char *at, ss_places *out, size_t i) {
    const ss_eight a = *(const eight_there *)at, b = *(const eight_there *)(at + sizeof a);
    const ss_eight c = *(const eight_there *)(at + 2 * sizeof a);
    const ss_eight x = __builtin_shufflevector(a, b, 0, 3, 6, 9, 12, 15, 0, 0);
    const ss_eight y = __builtin_shufflevector(a, b, 1, 4, 7, 10, 13, 0, 0, 0);
    const ss_eight z = __builtin_shufflevector(a, b, 2, 5, 8, 11, 14, 0, 0, 0);
    const ss_eight all[3] = {__builtin_shufflevector(x, c, 0, 1, 2, 3, 4, 5, 10, 13),
                          __builtin_shufflevector(y, c, 0, 1, 2, 3, 4, 8, 11, 14),
                          __builtin_shufflevector(z, c, 0, 1, 2, 3, 4, 9, 12, 15)};
    for (int k = 0; k < 3; k++) {
        for (int j = 0; j < 8; j++) out->at[k][i + (size_t)j] = (double)all[k][j];
    }
}

static inline void read_all(const softshadow_points *points, size_t first, size_t n,
                            ss_places *out) {
    size_t i = 0;
    if (points->position_type != SOFTSHADOW_F64 && points->position_stride == 3 * sizeof(float)) {
        const char *at = (const char *)points->positions + first * points->position_stride;
        for (; i + 8 <= n; i += 8) read_eight(at + i * points->position_stride, out, i);
    }
    for (; i < (n + 7) / 8 * 8; i++) {
        double p[3];
        read_one(points, first + (i < n ? i : n - 1), p);
        for (int k = 0; k < 3; k++) out->at[k][i] = p[k];
    }
}

/* ---- as the techniques want them ------------------------------------------------------------ */

/* *good: may all of them be answered? */
void RUNG(ss_places_read)(const ss_stage *stage, const softshadow_points *points, size_t first,
                          size_t n, ss_places *out, bool *good) {
    const ss_world *world = stage->world;
    const double *bounds = stage->params->bounds;
    const bool bounded = stage->params->bounded;
    ss_doubles_mask fine = ~(ss_doubles_mask){0};
    read_all(points, first, n, out);
    for (int k = 0; k < 3; k++) {
        for (size_t i = 0; i < n; i += SS_DOUBLES) {
            ss_doubles at = *(const ss_doubles_there *)(out->at[k] + i);
            fine &= (at <= SS_COORDINATE_LIMIT) & (at >= -SS_COORDINATE_LIMIT);
            at = ((at - world->low[k]) - world->half[k]) * world->scale;
            if (bounded) fine &= (at >= bounds[k]) & (at <= bounds[3 + k]);
            *(ss_doubles_there *)(out->at[k] + i) = at;
        }
    }
    int64_t all = -1;
    for (int i = 0; i < SS_DOUBLES; i++) all &= fine[i];
    *good = all;
}
