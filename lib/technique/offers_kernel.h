/* Compiled once for each rung: the bits of the techniques' own shade(), a row of a tile at a time. */
#include <math.h>
#include <string.h>

#include "raster/cpu/tile_kernel.h"
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
    const ss_wide strip = (ss_wide)((ss_wide_ints)a[0] & INT32_MAX);
    if (!(tag & SS_RIM_CORNER)) return SS_WIDE_IS_LESS(more, strip);
    const ss_wide square = a[0] * a[0] + a[2] * a[2], all = square + a[3] * a[3];
    return SS_WIDE_IS_LESS(more * more * all, square * square) | SS_WIDE_IS_LESS(more, zero);
}

/* ---- penumbra-map and smoothie --------------------------------------------------------------- */

enum { OUTER_VERTEX, OUTER_RISE };

static void outer_begin(const void *ctx, ss_raster_tile *tile) {
    const ss_outer_sheet *s = ctx;
    for (int32_t row = 0; row < tile->height; row++) {
        ss_tile_read(tile, s->depth, s->side, row, tile->depth[row]);
        for (int32_t x = 0; x < SS_RASTER_TILE; x++) {
            tile->key[row][x] = x < tile->width;
            tile->value[OUTER_VERTEX][row][x] = SS_MAP_FAR, tile->value[OUTER_RISE][row][x] = 0;
        }
    }
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
    const ss_wide_mask better = may & SS_WIDE_IS_LESS(vertex + rise, receiver) &
                                SS_WIDE_IS_LESS(key, before);
    if (!ss_wide_any(better)) return;
    ss_wide_there *vertices = SS_TILE_AT(tile->value[OUTER_VERTEX], row, x);
    ss_wide_there *rises = SS_TILE_AT(tile->value[OUTER_RISE], row, x);
    *kept = SS_WIDE_CHOOSE(better, key, before);
    *vertices = SS_WIDE_CHOOSE(better, vertex, (ss_wide)*vertices);
    *rises = SS_WIDE_CHOOSE(better, rise, (ss_wide)*rises);
}

static void outer_draw(const void *ctx, ss_raster_tile *tile, const ss_scan *scan, uint32_t tag) {
    if (tag & SS_RIM_CORNER) ss_tile_walk(tile, scan, 4, SS_RIM_CORNER, outer_offer, ctx);
    else ss_tile_walk(tile, scan, 2, 0, outer_offer, ctx);
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
    most[0] = 0;
    for (int i = 0; i < SS_LANES; i++) most[0] = sum[i] > most[0] ? sum[i] : most[0];
    most[1] = most[0];
}

static void outer_end(const void *ctx, const ss_raster_tile *tile) {
    const ss_outer_sheet *s = ctx;
    for (int32_t row = 0; row < tile->height; row++) {
        const float *const channel[SS_OUTER_CHANNELS] = {
            tile->depth[row], tile->value[OUTER_VERTEX][row], tile->value[OUTER_RISE][row],
            tile->key[row]};
        ss_tile_write(tile, channel, s->texels, s->side, row);
    }
}

const ss_raster_tiler RUNG(ss_offers_outer) = {outer_begin, outer_draw, outer_room, outer_end};
