/* Compiled once for each rung. */
#include <string.h>

#include "base/wide.h"
#include "technique/light_maps.h"
#include "technique/midpoint.h"

#define INLINE static inline __attribute__((always_inline))

/* Texels from x on of a row; nothing is beyond it, nor where there is no row. */
INLINE void texels_at(const float *row, int32_t x, int32_t side, ss_wide *out) {
    if (row && x >= 0 && x + SS_LANES <= side) {
        *out = *(const ss_wide_there *)(row + x);
        return;
    }
    *out = SS_WIDE_ALL(SS_MAP_FAR);
    for (int i = 0; i < SS_LANES && row; i++)
        if (x + i >= 0 && x + i < side) (*out)[i] = row[x + i];
}

INLINE void size_of(ss_wide x, ss_wide *out) { *out = (ss_wide)((ss_wide_ints)x & INT32_MAX); }

/* How much h changes towards the neighbours on both sides, per texel; what changes faster is
 * another surface. Alone, as in a hair: 45 degrees. */
INLINE void slope_along(ss_wide h, ss_wide before, ss_wide after, float one, ss_wide *out) {
    const float steep = (float)SS_MAP_STEEPEST * one;
    const ss_wide none = SS_WIDE_ALL(-1.f), flat = SS_WIDE_ALL(one);
    ss_wide a, b;
    size_of(before - h, &a), size_of(after - h, &b);
    a = SS_WIDE_PICK(a <= steep, a, none), b = SS_WIDE_PICK(b <= steep, b, none);
    const ss_wide slope = SS_WIDE_MORE(a, b);
    *out = SS_WIDE_PICK(slope < 0, flat, slope);
}

/* How far below the layer, of its slopes and how far below the next one is. */
INLINE void away_of(ss_wide across, ss_wide up, ss_wide gap, float one, ss_wide *out) {
    const ss_wide flat = SS_WIDE_ALL(one), half = gap / 2;
    const ss_wide least = SS_MIDPOINT_CAP * (across + up);
    const ss_wide wide = SS_WIDE_MORE(across, flat), tall = SS_WIDE_MORE(up, flat);
    const ss_wide most = SS_MIDPOINT_CAP * (wide + tall), more = SS_WIDE_MORE(half, least);
    *out = SS_WIDE_LESS(more, most);
}

typedef struct rows {
    const float *here, *below, *above, *next; /* the last three may be NULL */
    int32_t side;
    float one;
} rows;

INLINE void compared_at(const rows *r, int32_t x, ss_wide *out) {
    const ss_wide far = SS_WIDE_ALL(SS_MAP_FAR), nothing = {0};
    ss_wide h, before, after, under, across, up, away, size;
    texels_at(r->here, x, r->side, &h), texels_at(r->next, x, r->side, &under);
    texels_at(r->here, x - 1, r->side, &before), texels_at(r->here, x + 1, r->side, &after);
    slope_along(h, before, after, r->one, &across);
    texels_at(r->below, x, r->side, &before), texels_at(r->above, x, r->side, &after);
    slope_along(h, before, after, r->one, &up);
    const ss_wide gap = under - h;
    away_of(across, up, SS_WIDE_PICK(under < far, gap, nothing), r->one, &away);
    size_of(h, &size);
    const ss_wide at = h + away + SS_MAP_ALIKE * (size + r->one);
    *out = SS_WIDE_PICK(h < far, at, far);
}

void RUNG(ss_midpoints_sloped)(const ss_midpoints *m, uint32_t row, float *out) {
    const int32_t side = (int32_t)m->side;
    const size_t first = (size_t)row * m->side;
    const float *here = m->layer + first;
    const rows r = {.here = here,
                    .below = row > 0 ? here - side : NULL,
                    .above = row + 1 < m->side ? here + side : NULL,
                    .next = m->next ? m->next + first : NULL,
                    .side = side,
                    .one = (float)m->frame->texel};
    ss_wide at;
    int32_t x = 0;
    for (; x + SS_LANES <= side; x += SS_LANES) {
        compared_at(&r, x, &at);
        *(ss_wide_there *)(out + x) = at;
    }
    if (x == side) return;
    compared_at(&r, x, &at);
    memcpy(out + x, &at, (size_t)(side - x) * sizeof *out);
}
