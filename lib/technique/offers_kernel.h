/* Compiled once for each rung: the bits of the techniques' own shade(), a row of a tile at a time.
 */
#include <math.h>
#include <string.h>

#include "raster/cpu/tile_kernel.h"
#include "technique/limit.h"
#include "technique/offers.h"
#include "technique/outer.h"

SS_TILE_INLINE void root_of(const ss_wide *x, ss_wide *out) {
#if SS_FOURS == 4
    *out = (ss_wide)_mm512_sqrt_ps((__m512)*x);
#elif SS_FOURS == 2
    *out = (ss_wide)_mm256_sqrt_ps((__m256)*x);
#else
    for (int i = 0; i < 4; i++) (*out)[i] = sqrtf((*x)[i]);
#endif
}

static const ss_tile_shape strip = {.lines = 4, .used = 2}, piece = {.lines = 3, .used = 4};

/* ss_rim_away() of corners. */
SS_TILE_INLINE void corner_away(const ss_wide a[SS_RASTER_ATTRIBUTES], ss_wide *out) {
    const ss_wide square = a[0] * a[0] + a[2] * a[2], all = square + a[3] * a[3], zero = {0};
    ss_wide root;
    root_of(&all, &root);
    *out = SS_WIDE_CHOOSE(SS_WIDE_IS_LESS(zero, square), square / root, zero);
}

/* Surely farther away than `reach`, whatever rounding does: most texels are, and need no roots. */
SS_TILE_INLINE ss_wide_mask too_far(const ss_wide a[SS_RASTER_ATTRIBUTES], ss_wide reach,
                                    uint32_t tag) {
    const ss_wide more = reach * (1 + 0x1p-8f), zero = {0};
    const ss_wide across = (ss_wide)((ss_wide_ints)a[0] & INT32_MAX);
    if (!(tag & SS_RIM_CORNER)) return SS_WIDE_IS_LESS(more, across);
    const ss_wide square = a[0] * a[0] + a[2] * a[2], all = square + a[3] * a[3];
    return SS_WIDE_IS_LESS(more * more * all, square * square) | SS_WIDE_IS_LESS(more, zero);
}

/* ---- which tiles ----------------------------------------------------------------------------- */

#ifdef SS_TILE_VISITS
/* ss_rim_least() */
SS_TILE_INLINE void rim_least(uint32_t tag, const ss_tile_bounds *of, ss_tile_floats *out) {
    const ss_tile_floats zero = {0};
    const ss_tile_floats west = SS_TILE_PICK(of->high[0] < 0, -of->high[0], zero);
    const ss_tile_floats x = SS_TILE_PICK(of->low[0] > 0, of->low[0], west);
    *out = x * (1 - 0x1p-16f);
    if (!(tag & SS_RIM_CORNER)) return;
    const ss_tile_floats south = SS_TILE_PICK(of->high[2] < 0, -of->high[2], zero);
    const ss_tile_floats y = SS_TILE_PICK(of->low[2] > 0, of->low[2], south);
    const ss_tile_floats from = (ss_tile_floats)((ss_tile_ints)of->low[3] & INT32_MAX);
    const ss_tile_floats to = (ss_tile_floats)((ss_tile_ints)of->high[3] & INT32_MAX);
    const ss_tile_floats lean = SS_TILE_MORE(from, to), square = x * x + y * y;
    const ss_tile_floats away = square / ss_tile_root(square + lean * lean);
    *out = SS_TILE_PICK(square > 0, away * (1 - 0x1p-16f), zero);
}

/* least_rise() of outer.c, of a plain pen. */
SS_TILE_INLINE uint32_t outer_least(const void *ctx, uint32_t tag, const ss_tile_bounds *of,
                                    ss_tile_floats *out) {
    const ss_outer_sheet *s = ctx;
    rim_least(tag, of, out);
    *out *= s->per_texel;
    return 0;
}

/* Of techniques that tell the inside from the outside, which is kind 0: ss_rim_reaches_in(). */
SS_TILE_INLINE uint32_t sided_least(const void *ctx, uint32_t tag, const ss_tile_bounds *of,
                                    ss_tile_floats *out) {
    const ss_offer_face *f = ctx;
    rim_least(tag, of, out);
    *out = f->paper ? (ss_tile_floats){0} : *out * f->per_texel;
    if (!(tag & SS_RIM_CORNER)) return ss_tile_bits(of->low[0] < 0);
    return tag & (SS_RIM_INSIDE | SS_RIM_DISC) ? ~0u : 0;
}

/* least_rise() of penumbra_mask.c */
SS_TILE_INLINE uint32_t mask_least(const void *ctx, uint32_t tag, const ss_tile_bounds *of,
                                   ss_tile_floats *out) {
    const ss_offer_face *f = ctx;
    rim_least(tag, of, out);
    const ss_tile_floats away = *out - 2;
    *out = SS_TILE_PICK(away > 0, away * f->per_texel, (ss_tile_floats){0});
    return 0;
}

/* A tiler's visit. */
#define VISIT(name, least)                                                                         \
    static uint32_t name(const void *ctx, const ss_scan *scan, uint32_t tag,                       \
                         const ss_raster_band *band, uint32_t part, ss_raster_visit *out) {        \
        if (tag & SS_RIM_CORNER)                                                                   \
            return ss_tile_visits(scan, tag | SS_RIM_CORNER, band, part, piece, least, ctx, out);  \
        return ss_tile_visits(scan, tag & ~(uint32_t)SS_RIM_CORNER, band, part, strip, least, ctx, \
                              out);                                                                \
    }
VISIT(outer_visit, outer_least)
VISIT(sided_visit, sided_least)
VISIT(mask_visit, mask_least)
#else
#define outer_visit NULL
#define sided_visit NULL
#define mask_visit  NULL
#endif

#define CONSTANT_AT(plane, row, column) (*(const ss_wide_there *)((plane)[row] + (column)))

/* ---- penumbra-map and smoothie --------------------------------------------------------------- */

enum { OUTER_VERTEX, OUTER_RISE };

static void outer_begin(const void *ctx, ss_raster_tile *tile) {
    const ss_outer_sheet *s = ctx;
    const float first[] = {[OUTER_VERTEX] = SS_MAP_FAR, [OUTER_RISE] = 0};
    ss_tile_begin(tile, s->depth, s->side, 1, 0, first, 2);
}

/* ss_outer_offer() */
SS_TILE_INLINE void outer_offer(const void *ctx, ss_raster_tile *tile, int32_t x, int32_t row,
                                const ss_wide a[SS_RASTER_ATTRIBUTES], const ss_wide_mask *in,
                                uint32_t tag) {
    const ss_outer_sheet *s = ctx;
    const ss_wide depth = *SS_TILE_AT(tile->depth, row, x), far = SS_WIDE_ALL(s->far);
    const ss_wide receiver = SS_WIDE_LESS(depth, far), vertex = a[1];
    ss_wide_there *kept = SS_TILE_AT(tile->key, row, x);
    const ss_wide before = *kept, reach = before * (receiver - vertex) * s->texels_per;
    ss_wide away = a[0];
    const ss_wide_mask may = *in & ~too_far(a, reach, tag);
    if (!ss_wide_any(may)) return;
    if (tag & SS_RIM_CORNER) corner_away(a, &away);
    const ss_wide rise = away * s->per_texel, key = rise / (receiver - vertex);
    const ss_wide_mask better =
        may & SS_WIDE_IS_LESS(vertex + rise, receiver) & SS_WIDE_IS_LESS(key, before);
    if (!ss_wide_any(better)) return;
    ss_wide_there *vertices = SS_TILE_AT(tile->value[OUTER_VERTEX], row, x);
    ss_wide_there *rises = SS_TILE_AT(tile->value[OUTER_RISE], row, x);
    *kept = SS_WIDE_CHOOSE(better, key, before);
    *vertices = SS_WIDE_CHOOSE(better, vertex, (ss_wide)*vertices);
    *rises = SS_WIDE_CHOOSE(better, rise, (ss_wide)*rises);
}

static void outer_draw(const void *ctx, ss_raster_tile *tile, const ss_scan *scan, uint32_t tag) {
    if (tag & SS_RIM_CORNER)
        ss_tile_walk(tile, scan, piece, SS_RIM_CORNER, outer_offer, ctx);
    else
        ss_tile_walk(tile, scan, strip, 0, outer_offer, ctx);
}

/* A rise is kept where it is less than key (receiver - vertex). */
static void outer_room(const void *ctx, const ss_raster_tile *tile, float nearest, float most[2]) {
    const ss_outer_sheet *s = ctx;
    const ss_wide far = SS_WIDE_ALL(s->far);
    ss_wide sum = SS_WIDE_ALL(0.f);
    for (int32_t row = 0; row < tile->height; row++) {
        for (int32_t x = 0; x < SS_RASTER_TILE; x += SS_LANES) {
            const ss_wide key = *SS_TILE_AT((float(*)[SS_RASTER_TILE])tile->key, row, x);
            const ss_wide depth = *SS_TILE_AT((float(*)[SS_RASTER_TILE])tile->depth, row, x);
            const ss_wide receiver = SS_WIDE_LESS(depth, far), wide = key * (receiver - nearest);
            sum = SS_WIDE_MORE(wide, sum);
        }
    }
    most[0] = most[1] = ss_wide_most(&sum);
}

static void outer_end(const void *ctx, ss_raster_tile *tile) {
    const ss_outer_sheet *s = ctx;
    ss_wide least = SS_WIDE_ALL(SS_MAP_FAR);
    for (int32_t row = 0; row < tile->height; row++) {
        const float *const channel[SS_OUTER_CHANNELS] = {
            tile->depth[row], tile->value[OUTER_VERTEX][row], tile->value[OUTER_RISE][row],
            tile->key[row]};
        ss_tile_write(tile, channel, s->texels, s->side, row);
        for (int32_t x = 0; x < SS_RASTER_TILE; x += SS_LANES) {
            const ss_wide depth = CONSTANT_AT(tile->depth, row, x);
            const ss_wide vertex = CONSTANT_AT(tile->value[OUTER_VERTEX], row, x);
            const ss_wide first = SS_WIDE_LESS(depth, vertex);
            least = SS_WIDE_LESS(first, least);
        }
    }
    ss_light_maps_set_lit(s->lit, s->side, tile, ss_wide_least(&least));
}

const ss_raster_tiler RUNG(ss_offers_outer) = {outer_visit, NULL, outer_begin, outer_draw,
                                               outer_room, outer_end};

/* ---- what a texel hangs on ------------------------------------------------------------------- */

SS_TILE_INLINE ss_wide size_of(ss_wide x) { return (ss_wide)((ss_wide_ints)x & INT32_MAX); }

/* How far it is from it, the sign as ss_rim_foot has it, and which lanes are inside. */
typedef struct reach {
    ss_wide away;
    ss_wide_mask inside;
} reach;

SS_TILE_INLINE void strip_reach(const ss_wide a[SS_RASTER_ATTRIBUTES], reach *out) {
    const ss_wide zero = {0};
    out->away = a[0], out->inside = SS_WIDE_IS_LESS(a[0], zero);
}

/* Of corners; what is inside of them the tag says or, for discs, what covers the texel. */
SS_TILE_INLINE void corner_reach(const ss_wide a[SS_RASTER_ATTRIBUTES], uint32_t tag,
                                 ss_wide_mask covered, reach *out) {
    const ss_wide_mask all = (ss_wide_mask)~SS_WIDE_NONE;
    out->inside = tag & SS_RIM_DISC ? covered : tag & SS_RIM_INSIDE ? all : SS_WIDE_NONE;
    corner_away(a, &out->away);
    out->away = SS_WIDE_CHOOSE(out->inside, -out->away, out->away);
}

/* The rest of ss_rim_foot. */
typedef struct foot {
    ss_wide place[2], outwards[2];
} foot;

SS_TILE_INLINE void strip_foot(const float *rim, int32_t x, int32_t y, const reach *r, foot *out) {
    ss_wide_ints lane;
    for (int i = 0; i < SS_LANES; i++) lane[i] = x + i;
    const ss_wide column = __builtin_convertvector(lane, ss_wide) + .5f;
    const ss_wide along = rim[SS_RIM_WIDE] * r->away;
    const float row = (float)y + .5f;
    out->place[0] = column - along * rim[SS_RIM_RIGHT];
    out->place[1] = row - along * rim[SS_RIM_RIGHT + 1];
    for (int k = 0; k < 2; k++) out->outwards[k] = SS_WIDE_ALL(rim[SS_RIM_RIGHT + k]);
}

SS_TILE_INLINE void corner_foot(const float *rim, const ss_wide a[SS_RASTER_ATTRIBUTES],
                                const ss_wide *square, const reach *r, foot *out) {
    const ss_wide one = SS_WIDE_ALL(1.f), zero = {0};
    const ss_wide sign = SS_WIDE_CHOOSE(r->inside, -one, one);
    ss_wide length;
    root_of(square, &length);
    const ss_wide per = SS_WIDE_CHOOSE(SS_WIDE_IS_LESS(zero, length), sign / length, zero);
    out->outwards[0] = a[0] * per, out->outwards[1] = a[2] * per;
    for (int k = 0; k < 2; k++) out->place[k] = SS_WIDE_ALL(rim[SS_RIM_PLACE + k]);
}

SS_TILE_INLINE void depth_past(const ss_offer_face *f, const foot *at, float way, ss_wide *out) {
    const ss_wide most = SS_WIDE_ALL((float)(f->side - 1)), zero = {0};
    ss_wide x = at->place[0] + way * at->outwards[0], y = at->place[1] + way * at->outwards[1];
    x = SS_WIDE_MORE(x, zero), x = SS_WIDE_LESS(x, most);
    y = SS_WIDE_MORE(y, zero), y = SS_WIDE_LESS(y, most);
    const ss_wide_ints column = __builtin_convertvector(x, ss_wide_ints);
    const ss_wide_ints row = __builtin_convertvector(y, ss_wide_ints);
    const ss_wide_ints index = row * (int32_t)f->side + column;
    ss_wide_gather(f->depth, &index, out);
}

/* ss_rim_open() of the lanes that may: known under open sky, but within a texel of a corner, where
 * outwards is not known well; the nearer place alone where it is deeper than `enough`. */
SS_TILE_INLINE void open_past(const ss_offer_face *f, const ss_raster_tile *tile, int32_t x,
                              int32_t row, const ss_wide a[SS_RASTER_ATTRIBUTES],
                              const reach *from, uint32_t tag, const ss_wide_mask *may,
                              ss_wide enough, ss_wide *out) {
    const float *rim = f->rows + (size_t)ss_rim_number(tag) * SS_RIM_ROW;
    const ss_wide one = SS_WIDE_ALL(1.f), square = a[0] * a[0] + a[2] * a[2];
    const bool corner = tag & SS_RIM_CORNER, sky = tag & SS_RIM_SKY;
    foot at;
    ss_wide near, far;
    *out = SS_WIDE_ALL(SS_MAP_FAR);
    if (sky && !(corner && ss_wide_any(SS_WIDE_IS_LESS(square, one)))) return;
    if (corner)
        corner_foot(rim, a, &square, from, &at);
    else
        strip_foot(rim, tile->x + x, tile->y + row, from, &at);
    depth_past(f, &at, 1.5f, &near);
    *out = near;
    if (!ss_wide_any(*may & ~SS_WIDE_IS_LESS(enough, near))) return;
    depth_past(f, &at, 2.5f, &far);
    *out = SS_WIDE_MORE(near, far);
}

/* The most of two sums over a tile's texels, begun at 0. */
SS_TILE_INLINE void most_of(const ss_wide sum[2], float most[2]) {
    most[0] = ss_wide_most(&sum[0]), most[1] = ss_wide_most(&sum[1]);
}

SS_TILE_INLINE void keep_value(float (*plane)[SS_RASTER_TILE], int32_t row, int32_t x,
                               ss_wide_mask better, ss_wide value) {
    ss_wide_there *to = SS_TILE_AT(plane, row, x);
    *to = SS_WIDE_CHOOSE(better, value, (ss_wide)*to);
}

/* ---- penumbra-limit -------------------------------------------------------------------------- */

static void limit_begin(const void *ctx, ss_raster_tile *tile) {
    const ss_offer_face *f = ctx;
    const float first[] = {SS_MAP_FAR, 0, 0};
    ss_tile_begin(tile, f->depth, f->side, SS_MAP_FAR, 0, first, 3);
}

/* The depth of whom it is for, from c on: ss_limit_receiver(). */
SS_TILE_INLINE ss_wide limit_receiver(const ss_offer_face *f, ss_wide depth, ss_wide c,
                                      ss_wide_mask outside) {
    const ss_wide far = SS_WIDE_ALL(f->far), near = c + f->near;
    const ss_wide_mask before = SS_WIDE_IS_LESS(depth, far) & outside;
    const ss_wide most = SS_WIDE_CHOOSE(before, depth, far);
    return SS_WIDE_MORE(most, near);
}

/* ss_limit_outside() */
SS_TILE_INLINE ss_wide_mask limit_outside(const ss_offer_face *f, ss_wide depth, ss_wide c,
                                          ss_wide q) {
    const ss_wide per = SS_WIDE_ALL(f->per_texel), edge = c - f->near, limit = c + q;
    const ss_wide reached = depth + SS_LIMIT_RAISE * f->per_texel;
    const ss_wide_mask beyond = SS_WIDE_IS_LESS(per, q), at_edge = SS_WIDE_IS_LESS(edge, depth);
    const ss_wide_mask begun = SS_WIDE_IS_LESS(c, depth) & SS_WIDE_IS_LESS(limit, reached);
    return (beyond & begun) | (~beyond & at_edge);
}

/* The key where light gets down to `open`: ss_limit_away(). */
SS_TILE_INLINE ss_wide limit_folded(const ss_offer_face *f, ss_wide c, ss_wide size,
                                    ss_wide receiver, ss_wide away, ss_wide open,
                                    ss_wide_mask outside) {
    const ss_wide one = SS_WIDE_ALL(1.f), opened = open + f->near;
    const ss_wide_mask fold =
        ~outside & SS_WIDE_IS_LESS(opened, receiver) & SS_WIDE_IS_LESS(away, one);
    if (!ss_wide_any(fold)) return away;
    const ss_wide top = SS_WIDE_MORE(open, c), behind = size / (receiver - top);
    const ss_wide folded = 1 - (SS_WIDE_LESS(behind, one) - away);
    return SS_WIDE_CHOOSE(fold, folded, away);
}

SS_TILE_INLINE void limit_offer(const void *ctx, ss_raster_tile *tile, int32_t x, int32_t row,
                                const ss_wide a[SS_RASTER_ATTRIBUTES], const ss_wide_mask *in,
                                uint32_t tag) {
    const ss_offer_face *f = ctx;
    const ss_wide depth = CONSTANT_AT(tile->depth, row, x), c = a[1], zero = {0};
    const ss_wide before = CONSTANT_AT(tile->key, row, x);
    const ss_wide most = SS_WIDE_MORE(SS_WIDE_ALL(f->far), c + f->near);
    ss_wide_mask may = *in;
    if (!f->paper) may &= ~too_far(a, before * (most - c) * f->texels_per, tag);
    if (!ss_wide_any(may)) return;
    ss_wide open;
    reach from;
    if (tag & SS_RIM_CORNER)
        corner_reach(a, tag, SS_WIDE_IS_LESS(depth, c + f->near), &from);
    else
        strip_reach(a, &from);
    const ss_wide q = from.away * f->per_texel, size = size_of(q);
    const ss_wide_mask outside = SS_WIDE_IS_LESS(zero, q);
    const ss_wide receiver = limit_receiver(f, depth, c, outside);
    const ss_wide wide = f->paper ? c + size : size / (receiver - c);
    may &= SS_WIDE_IS_LESS(wide, before) & (~outside | limit_outside(f, depth, c, q));
    if (!ss_wide_any(may)) return;
    open_past(f, tile, x, row, a, &from, tag, &may, SS_WIDE_ALL(SS_MAP_FAR), &open);
    const ss_wide key = f->paper ? wide : limit_folded(f, c, size, receiver, wide, open, outside);
    const ss_wide_mask better =
        may & ~SS_WIDE_IS_LESS(open, c - f->near) & SS_WIDE_IS_LESS(key, before);
    keep_value(tile->key, row, x, better, key);
    keep_value(tile->value[0], row, x, better, c);
    keep_value(tile->value[1], row, x, better, open);
    keep_value(tile->value[2], row, x, better, q);
}

static void limit_draw(const void *ctx, ss_raster_tile *tile, const ss_scan *scan, uint32_t tag) {
    if (tag & SS_RIM_CORNER)
        ss_tile_walk(tile, scan, piece, tag, limit_offer, ctx);
    else
        ss_tile_walk(tile, scan, strip, tag & ~(uint32_t)SS_RIM_CORNER, limit_offer, ctx);
}

/* By ss_limit_away() and ss_limit_outside(). */
static void limit_room(const void *ctx, const ss_raster_tile *tile, float nearest, float most[2]) {
    const ss_offer_face *f = ctx;
    const float deepest = f->far - nearest > f->near ? f->far - nearest : f->near;
    const ss_wide near = SS_WIDE_ALL(f->near), far = SS_WIDE_ALL(f->far);
    ss_wide sum[2] = {SS_WIDE_ALL(0.f), SS_WIDE_ALL(0.f)};
    for (int32_t row = 0; row < tile->height; row++) {
        for (int32_t x = 0; x < SS_RASTER_TILE; x += SS_LANES) {
            const ss_wide key = CONSTANT_AT(tile->key, row, x);
            const ss_wide depth = CONSTANT_AT(tile->depth, row, x);
            const ss_wide below = SS_WIDE_LESS(depth, far) - nearest;
            const ss_wide gap = SS_WIDE_MORE(below, near), by_key = key * gap, in = key * deepest;
            const ss_wide begun = depth - nearest + SS_LIMIT_RAISE * f->per_texel;
            const ss_wide out = SS_WIDE_LESS(by_key, begun);
            sum[0] = SS_WIDE_MORE(out, sum[0]), sum[1] = SS_WIDE_MORE(in, sum[1]);
        }
    }
    most_of(sum, most);
    for (int k = 0; k < 2; k++) most[k] *= 1 + 0x1p-16f;
}

/* The limits above and below, as limit_rows() has them. */
SS_TILE_INLINE void limit_texels(const ss_offer_face *f, ss_raster_tile *tile, int32_t row,
                                 int32_t x, ss_wide *upper) {
    const ss_wide all = SS_WIDE_ALL(SS_MAP_FAR), per = SS_WIDE_ALL(f->per_texel), zero = {0};
    const ss_wide c = CONSTANT_AT(tile->value[0], row, x), q = CONSTANT_AT(tile->value[2], row, x);
    const ss_wide depth = CONSTANT_AT(tile->depth, row, x), far = SS_WIDE_ALL(f->far);
    const ss_wide past_it = CONSTANT_AT(tile->value[1], row, x), open = SS_WIDE_LESS(past_it, far);
    const ss_wide half = (c + open) / 2, sunk = c + f->near, from = SS_WIDE_MORE(half, depth);
    const ss_wide_mask some = SS_WIDE_IS_LESS(c, all), outside = SS_WIDE_IS_LESS(per, q);
    const ss_wide above = SS_WIDE_CHOOSE(some & ~outside, from, all);
    const ss_wide_mask past = ~SS_WIDE_IS_LESS(depth, half) & SS_WIDE_IS_LESS(sunk, depth) &
                              SS_WIDE_IS_LESS(-per, q);
    const ss_wide_mask open_sky = some & (SS_WIDE_IS_LESS(zero, q) | past);
    const ss_wide lower = SS_WIDE_CHOOSE(SS_WIDE_IS_LESS(above, all), past_it, all);
    *upper = SS_WIDE_CHOOSE(open_sky, c, depth);
    *SS_TILE_AT(tile->value[1], row, x) = SS_WIDE_CHOOSE(outside, depth, lower);
    *SS_TILE_AT(tile->key, row, x) = above;
    *SS_TILE_AT(tile->depth, row, x) = *upper;
}

static void limit_end(const void *ctx, ss_raster_tile *tile) {
    const ss_offer_face *f = ctx;
    ss_wide least = SS_WIDE_ALL(SS_MAP_FAR);
    for (int32_t row = 0; row < tile->height; row++) {
        for (int32_t x = 0; x < SS_RASTER_TILE; x += SS_LANES) {
            ss_wide upper;
            limit_texels(f, tile, row, x, &upper);
            least = SS_WIDE_LESS(upper, least);
        }
        const float *const channel[LIMIT_CHANNELS] = {tile->value[0][row], tile->depth[row],
                                                      tile->value[1][row], tile->value[2][row]};
        ss_tile_write(tile, channel, f->texels, f->side, row);
        memcpy(f->above + (size_t)(tile->y + row) * f->side + (size_t)tile->x, tile->key[row],
               (size_t)tile->width * sizeof *f->above);
    }
    ss_light_maps_set_lit(f->lit, f->side, tile, ss_wide_least(&least));
}

const ss_raster_tiler RUNG(ss_offers_limit) = {sided_visit, NULL, limit_begin, limit_draw,
                                               limit_room, limit_end};

/* ---- penumbra-volume ------------------------------------------------------------------------- */

enum { VOLUME_BEGIN, VOLUME_END, VOLUME_TAG };

static void volume_begin(const void *ctx, ss_raster_tile *tile) {
    const ss_offer_face *f = ctx;
    const float first[] = {0, 0, 0}; /* read with a key only, but for what checkers can tell */
    ss_tile_begin(tile, f->depth, f->side, SS_MAP_FAR, 0, first, 3);
}

/* Whether it stands before anything there: matters(). */
SS_TILE_INLINE ss_wide_mask volume_matters(const ss_offer_face *f, const reach *at, ss_wide edge,
                                           ss_wide depth, ss_wide rise, ss_wide open) {
    const ss_wide one = SS_WIDE_ALL(1.f), zero = {0}, above = edge - f->near;
    const ss_wide below = edge + f->steep - f->near * at->away, begun = edge + rise;
    const ss_wide_mask out = SS_WIDE_IS_LESS(zero, at->away), past = SS_WIDE_IS_LESS(one, at->away);
    const ss_wide_mask inside = SS_WIDE_IS_LESS(depth, below), near = SS_WIDE_IS_LESS(above, depth);
    const ss_wide_mask far = SS_WIDE_IS_LESS(edge, depth) & SS_WIDE_IS_LESS(begun, depth);
    return ~SS_WIDE_IS_LESS(open, above) & ((~out & inside) | (out & ~past & near) | (past & far));
}

/* end_of() but for the paper's way. */
SS_TILE_INLINE ss_wide volume_end_of(const ss_offer_face *f, const reach *at, ss_wide edge,
                                     ss_wide depth, ss_wide open) {
    const ss_wide one = SS_WIDE_ALL(1.f), zero = {0}, far = SS_WIDE_ALL(SS_MAP_FAR);
    const ss_wide sunk = edge + f->steep;
    const ss_wide top = SS_WIDE_MORE(open, sunk), lower = top + f->near * (2.5f - at->away);
    const ss_wide_mask out = SS_WIDE_IS_LESS(zero, at->away), past = SS_WIDE_IS_LESS(one, at->away);
    const ss_wide_mask none = ~SS_WIDE_IS_LESS(open, far), low = SS_WIDE_IS_LESS(depth, sunk);
    const ss_wide within = SS_WIDE_CHOOSE(none, far, lower);
    return SS_WIDE_CHOOSE(out, SS_WIDE_CHOOSE(~past & low, far, depth), within);
}

SS_TILE_INLINE void volume_offer(const void *ctx, ss_raster_tile *tile, int32_t x, int32_t row,
                                 const ss_wide a[SS_RASTER_ATTRIBUTES], const ss_wide_mask *in,
                                 uint32_t tag) {
    const ss_offer_face *f = ctx;
    const ss_wide depth = CONSTANT_AT(tile->depth, row, x), edge = a[1], zero = {0};
    const ss_wide before = CONSTANT_AT(tile->key, row, x), near = SS_WIDE_ALL(f->near);
    const ss_wide gap = SS_WIDE_ALL(f->far) - edge, deepest = SS_WIDE_MORE(gap, near);
    ss_wide_mask may = *in;
    if (!f->paper) may &= ~too_far(a, before * deepest * f->texels_per, tag);
    if (!ss_wide_any(may)) return;
    ss_wide open;
    reach at;
    if (tag & SS_RIM_CORNER) {
        const ss_wide square = a[0] * a[0] + a[2] * a[2];
        corner_reach(a, tag, SS_WIDE_IS_LESS(depth, edge + f->steep), &at);
        may &= SS_WIDE_IS_LESS(zero, square); /* on the vertex there is no outwards */
    } else {
        strip_reach(a, &at);
    }
    const ss_wide size = size_of(at.away), beyond = size - 2, climbed = beyond * f->climb;
    const ss_wide rise = SS_WIDE_CHOOSE(SS_WIDE_IS_LESS(zero, beyond), climbed, zero);
    const ss_wide far = SS_WIDE_ALL(f->far);
    const ss_wide_mask short_of = SS_WIDE_IS_LESS(depth, far) & SS_WIDE_IS_LESS(zero, at.away);
    const ss_wide receiver = SS_WIDE_CHOOSE(short_of, depth, far), to = receiver - edge;
    const ss_wide least = SS_WIDE_MORE(to, near);
    const ss_wide key = f->paper ? edge + rise : size * f->per_texel / least;
    may &= SS_WIDE_IS_LESS(key, before);
    if (!ss_wide_any(may)) return;
    open_past(f, tile, x, row, a, &at, tag, &may, SS_WIDE_ALL(SS_MAP_FAR), &open);
    if (!f->paper) may &= volume_matters(f, &at, edge, depth, rise, open);
    if (!ss_wide_any(may)) return;
    const ss_wide one = SS_WIDE_ALL(1.f), begin = edge + rise;
    const ss_wide_mask out = SS_WIDE_IS_LESS(zero, at.away), past = SS_WIDE_IS_LESS(one, at.away);
    const ss_wide_mask covered = ~out | (~past & SS_WIDE_IS_LESS(depth, edge + f->steep));
    const ss_wide_mask lower = covered & SS_WIDE_IS_LESS(begin, depth);
    const ss_wide_ints plain = (int32_t)(tag & ~SS_RIM_SKY) - (ss_wide_ints){0};
    const ss_wide tagged =
        SS_WIDE_CHOOSE(at.inside, (ss_wide)(plain | SS_RIM_INSIDE), (ss_wide)plain);
    keep_value(tile->key, row, x, may, key);
    keep_value(tile->value[VOLUME_TAG], row, x, may, tagged);
    keep_value(tile->value[VOLUME_BEGIN], row, x, may,
               f->paper ? begin : SS_WIDE_CHOOSE(lower, depth, begin));
    keep_value(tile->value[VOLUME_END], row, x, may,
               f->paper ? SS_WIDE_ALL(SS_MAP_FAR) : volume_end_of(f, &at, edge, depth, open));
}

static void volume_draw(const void *ctx, ss_raster_tile *tile, const ss_scan *scan, uint32_t tag) {
    if (tag & SS_RIM_CORNER)
        ss_tile_walk(tile, scan, piece, tag, volume_offer, ctx);
    else
        ss_tile_walk(tile, scan, strip, tag & ~(uint32_t)SS_RIM_CORNER, volume_offer, ctx);
}

/* By key_of() and matters(). */
static void volume_room(const void *ctx, const ss_raster_tile *tile, float nearest, float most[2]) {
    const ss_offer_face *f = ctx;
    const float gap = f->far - nearest, deepest = (gap > f->near ? gap : f->near) * (1 + 0x1p-16f);
    const float per_climb = f->per_texel / f->climb;
    const ss_wide near = SS_WIDE_ALL(f->near), far = SS_WIDE_ALL(f->far);
    ss_wide sum[2] = {SS_WIDE_ALL(0.f), SS_WIDE_ALL(0.f)};
    most[0] = most[1] = INFINITY;
    for (int32_t row = 0; row < tile->height && !f->paper; row++) {
        for (int32_t x = 0; x < SS_RASTER_TILE; x += SS_LANES) {
            const ss_wide key = CONSTANT_AT(tile->key, row, x);
            const ss_wide depth = CONSTANT_AT(tile->depth, row, x);
            const ss_wide to = SS_WIDE_LESS(depth, far) - nearest, wide = SS_WIDE_MORE(to, near);
            const ss_wide begun =
                ((depth - nearest) * per_climb + 2 * f->per_texel) * (1 + 0x1p-16f);
            const ss_wide by_key = key * wide, out = SS_WIDE_LESS(by_key, begun);
            const ss_wide in = key * deepest;
            sum[0] = SS_WIDE_MORE(out, sum[0]), sum[1] = SS_WIDE_MORE(in, sum[1]);
        }
    }
    if (!f->paper) most_of(sum, most), most[0] *= 1 + 0x1p-16f;
}

/* A texel of eight channels is written at once: what is read in other pieces than it was just
 * written in is waited for. */
SS_TILE_INLINE void volume_texel(const ss_offer_face *f, const ss_raster_tile *tile, int32_t row,
                                 int32_t x, float *texel) {
    uint32_t tag;
    memcpy(&tag, &tile->value[VOLUME_TAG][row][x], sizeof tag);
    const bool corner = tag & SS_RIM_CORNER;
    ss_eight whole = *(const ss_eight_there *)f->ends[corner ? 0 : tag / SS_RIM_TAG];
    whole[0] = tile->value[VOLUME_BEGIN][row][x], whole[1] = tile->value[VOLUME_END][row][x];
    *(ss_eight_there *)texel = whole;
    if (corner)
        f->around(f->of, tag, (uint32_t)(tile->x + x), (uint32_t)(tile->y + row), texel + 2);
}

static void volume_end(const void *ctx, ss_raster_tile *tile) {
    const ss_offer_face *f = ctx;
    for (int32_t row = 0; row < tile->height; row++) {
        float *texel = f->texels + ((size_t)(tile->y + row) * f->side + (size_t)tile->x) * 8;
        for (int32_t x = 0; x < tile->width; x++, texel += 8) {
            if (tile->key[row][x] != SS_MAP_FAR)
                volume_texel(f, tile, row, x, texel);
            else
                *(ss_eight_there *)texel = (ss_eight){SS_MAP_FAR};
        }
    }
}

static void volume_blank(const void *ctx, const ss_raster_tile *tile) {
    const ss_offer_face *f = ctx;
    for (int32_t row = 0; row < tile->height; row++) {
        float *texel = f->texels + ((size_t)(tile->y + row) * f->side + (size_t)tile->x) * 8;
        for (int32_t x = 0; x < tile->width; x++, texel += 8)
            *(ss_eight_there *)texel = (ss_eight){SS_MAP_FAR};
    }
}

const ss_raster_tiler RUNG(ss_offers_volume) = {sided_visit, volume_blank, volume_begin,
                                                volume_draw, volume_room, volume_end};

/* ---- penumbra-mask --------------------------------------------------------------------------- */

static void mask_begin(const void *ctx, ss_raster_tile *tile) {
    const float first[] = {0};
    (void)ctx; /* no offer looks at the texel's own depth */
    ss_tile_begin(tile, NULL, 0, SS_MAP_FAR, -SS_MAP_FAR, first, 1);
}

SS_TILE_INLINE void mask_offer(const void *ctx, ss_raster_tile *tile, int32_t x, int32_t row,
                               const ss_wide a[SS_RASTER_ATTRIBUTES], const ss_wide_mask *in,
                               uint32_t tag) {
    const ss_offer_face *f = ctx;
    const ss_wide edge = a[1], zero = {0}, before = CONSTANT_AT(tile->key, row, x);
    const ss_wide other = CONSTANT_AT(tile->value[0], row, x);
    const ss_wide to = (before - edge) * f->texels_per + 2.5f;
    ss_wide_mask may = *in & ~too_far(a, to, tag) & ~SS_WIDE_IS_LESS(before, edge);
    if (!ss_wide_any(may)) return;
    ss_wide open;
    reach from;
    if (tag & SS_RIM_CORNER)
        corner_reach(a, tag, SS_WIDE_NONE, &from);
    else
        strip_reach(a, &from);
    const ss_wide beyond = size_of(from.away) - 2, climbed = beyond * f->per_texel;
    const ss_wide begins = edge + SS_WIDE_CHOOSE(SS_WIDE_IS_LESS(zero, beyond), climbed, zero);
    /* the order of edges that meet must not matter */
    may &= SS_WIDE_IS_LESS(begins, before) |
           (~SS_WIDE_IS_LESS(before, begins) & SS_WIDE_IS_LESS(edge, other));
    if (!ss_wide_any(may)) return;
    const ss_wide least = edge + f->near;
    open_past(f, tile, x, row, a, &from, tag, &may, least, &open);
    may &= SS_WIDE_IS_LESS(least, open);
    keep_value(tile->key, row, x, may, begins);
    keep_value(tile->value[0], row, x, may, edge);
}

static void mask_draw(const void *ctx, ss_raster_tile *tile, const ss_scan *scan, uint32_t tag) {
    if (tag & SS_RIM_CORNER)
        ss_tile_walk(tile, scan, piece, tag, mask_offer, ctx);
    else
        ss_tile_walk(tile, scan, strip, tag & ~(uint32_t)SS_RIM_CORNER, mask_offer, ctx);
}

static void mask_room(const void *ctx, const ss_raster_tile *tile, float nearest, float most[2]) {
    ss_wide sum[2] = {SS_WIDE_ALL(0.f), SS_WIDE_ALL(0.f)};
    (void)ctx;
    for (int32_t row = 0; row < tile->height; row++) {
        for (int32_t x = 0; x < SS_RASTER_TILE; x += SS_LANES) {
            const ss_wide rest = CONSTANT_AT(tile->key, row, x) - nearest;
            sum[0] = SS_WIDE_MORE(rest, sum[0]);
        }
    }
    most_of(sum, most);
    most[0] = most[1] = most[0] * (1 + 0x1p-16f) + 0x1p-20f;
}

static void mask_end(const void *ctx, ss_raster_tile *tile) {
    const ss_offer_face *f = ctx;
    for (int32_t row = 0; row < tile->height; row++) {
        float *texel = f->texels + ((size_t)(tile->y + row) * f->side + (size_t)tile->x) * 4;
        for (int32_t x = 0; x < tile->width; x++, texel += 4) {
            texel[2] = tile->key[row][x], texel[3] = tile->value[0][row][x];
        }
    }
}

/* Texels begin without volumes. */
static void mask_blank(const void *ctx, const ss_raster_tile *tile) { (void)ctx, (void)tile; }

const ss_raster_tiler RUNG(ss_offers_mask) = {mask_visit, mask_blank, mask_begin, mask_draw,
                                              mask_room, mask_end};
