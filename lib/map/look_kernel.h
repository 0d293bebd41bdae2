/* Compiled once for each rung. */
#include <math.h>
#include <string.h>

#include "base/wide.h"
#include "map/look.h"

typedef int32_t ints_there __attribute__((vector_size(4 * SS_DOUBLES), aligned(4), may_alias));
typedef float wide_floats __attribute__((vector_size(4 * SS_DOUBLES)));
typedef int32_t wide_ints __attribute__((vector_size(4 * SS_DOUBLES)));

void RUNG(ss_look_single)(const ss_frames *frames, const ss_places *places, size_t n,
                          ss_looks *out) {
    const ss_frame f = frames->face[0];
    const double per = 1 / f.texel, low_x = f.low[0] * per, low_y = f.low[1] * per;
    const double behind = f.inverse > 0 ? 1 / f.inverse : INFINITY; /* the light, on the axis */
    const wide_floats most = (float)frames->resolution - (wide_floats){0}, zero = {0};
    ss_doubles least = INFINITY - (ss_doubles){0};
    for (size_t i = 0; i < n; i += SS_DOUBLES) {
        ss_doubles d[3];
        for (int k = 0; k < 3; k++) {
            d[k] = *(const ss_doubles_there *)(places->at[k] + i) - f.origin[k];
        }
        const ss_doubles x = d[0] * f.x[0] + d[1] * f.x[1] + d[2] * f.x[2];
        const ss_doubles y = d[0] * f.y[0] + d[1] * f.y[1] + d[2] * f.y[2];
        const ss_doubles z = d[0] * f.z[0] + d[1] * f.z[1] + d[2] * f.z[2];
        const ss_doubles s = 1 / (1 + z * f.inverse), scaled = s * per, far = z + behind;
        const ss_doubles square = x * x + y * y + far * far;
        const ss_doubles_mask less = square < least, seen = z > f.nearest;
        least = (ss_doubles)((less & (ss_doubles_mask)square) | (~less & (ss_doubles_mask)least));
        /* before the near plane: as if it were outside of the map */
        const ss_doubles across = x * scaled - low_x, outside = -1 - (ss_doubles){0};
        const ss_doubles kept =
            (ss_doubles)((seen & (ss_doubles_mask)across) | (~seen & (ss_doubles_mask)outside));
        const wide_floats column = __builtin_convertvector(kept, wide_floats);
        const wide_floats row = __builtin_convertvector(y * scaled - low_y, wide_floats);
        const wide_floats h = __builtin_convertvector(z * s, wide_floats);
        /* outside of the map, or NaN from a division by nothing: the corner, which holds nothing */
        const wide_ints in = (column >= zero) & (row >= zero) & (column < most) & (row < most);
        const wide_floats far_off = -SS_MAP_FAR - zero;
        const wide_ints deep = (in & (wide_ints)h) | (~in & (wide_ints)far_off);
        const wide_ints to_x = in & (wide_ints)column, to_y = in & (wide_ints)row;
        *(ints_there *)(out->x + i) = to_x;
        *(ints_there *)(out->y + i) = to_y;
        *(ints_there *)(out->h + i) = deep;
    }
    out->nearest = INFINITY;
    for (int k = 0; k < SS_DOUBLES; k++)
        out->nearest = least[k] < out->nearest ? least[k] : out->nearest;
    memset(out->base, 0, sizeof out->base);
    memset(out->face, 0, sizeof out->face);
}
