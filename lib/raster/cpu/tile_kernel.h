/* How an ink's kernel walks a triangle across a tile: as many texels of a row as a register has
 * lanes. */
#ifndef SS_RASTER_TILE_KERNEL_H
#define SS_RASTER_TILE_KERNEL_H

#include "base/wide.h"
#include "raster/setup.h"

#define SS_TILE_INLINE static inline __attribute__((always_inline))

/* Called for texels from (column, row) of the tile on, those of the lanes in `in`. */
typedef void ss_tile_offer(const void *ctx, ss_raster_tile *tile, int32_t column, int32_t row,
                           const ss_wide attribute[SS_RASTER_ATTRIBUTES], const ss_wide_mask *in,
                           uint32_t tag);

#define SS_TILE_AT(plane, row, column) ((ss_wide_there *)((plane)[row] + (column)))

/* Attribute k in a row, as ss_scan_runs() has it. */
SS_TILE_INLINE void ss_tile_attribute(const ss_scan *s, int k, int32_t y, ss_wide column,
                                      ss_wide *out) {
    const float row = s->start[k] + s->step_y[k] * (float)(y - s->first_y);
    const ss_wide v = row + s->step_x[k] * column;
    const ss_wide least = SS_WIDE_ALL(s->least[k]), most = SS_WIDE_ALL(s->most[k]);
    const ss_wide above = SS_WIDE_MORE(least, v);
    *out = SS_WIDE_LESS(most, above);
}

/* The first `used` attributes. */
SS_TILE_INLINE void ss_tile_columns(ss_raster_tile *tile, const ss_scan *s, const ss_scan_block *b,
                                    int32_t first, int used, uint32_t tag, ss_tile_offer *offer,
                                    const void *ctx) {
    ss_wide_ints lane, edge[3];
    for (int i = 0; i < SS_LANES; i++) lane[i] = first + i;
    const ss_wide column = __builtin_convertvector(lane + (b->x - s->first_x), ss_wide);
    const ss_wide_ints beyond = lane >= tile->width;
    for (int i = 0; i < 3; i++) edge[i] = b->e[i].at + b->e[i].right * lane;
    for (int32_t row = 0; row < b->height; row++) {
        const ss_wide_ints out = edge[0] | edge[1] | edge[2] | beyond;
        const ss_wide_mask in = ~SS_WIDE_NEGATIVE(out);
        for (int i = 0; i < 3; i++) edge[i] += b->e[i].up;
        if (!ss_wide_any(in)) continue;
        ss_wide attribute[SS_RASTER_ATTRIBUTES];
        for (int k = 0; k < used; k++) {
            ss_tile_attribute(s, k, b->y + row, column, &attribute[k]);
        }
        offer(ctx, tile, first, b->y + row - tile->y, attribute, &in, tag);
    }
}

SS_TILE_INLINE void ss_tile_walk(ss_raster_tile *tile, const ss_scan *s, int used, uint32_t tag,
                                 ss_tile_offer *offer, const void *ctx) {
    const int32_t low = s->first_y > tile->y ? s->first_y : tile->y;
    const int32_t end = tile->y + tile->height, high = s->last_y < end ? s->last_y + 1 : end;
    ss_scan_block b = {.x = tile->x, .y = low, .width = tile->width, .height = high - low};
    if (!ss_scan_block_set(&b, s)) return;
    for (int32_t first = 0; first < SS_RASTER_TILE; first += SS_LANES)
        ss_tile_columns(tile, s, &b, first, used, tag, offer, ctx);
}

/* A row of a plane into the tile, zeros beyond the map. */
SS_TILE_INLINE void ss_tile_read(const ss_raster_tile *tile, const float *plane, uint32_t side,
                                 int32_t row, float *out) {
    const float *from = plane + (size_t)(tile->y + row) * side + (size_t)tile->x;
    if (tile->width == SS_RASTER_TILE) {
        memcpy(out, from, SS_RASTER_TILE * sizeof *out);
    } else {
        memset(out, 0, SS_RASTER_TILE * sizeof *out);
        memcpy(out, from, (size_t)tile->width * sizeof *out);
    }
}

/* Four rows of the tile as the channels of a row of texels. */
SS_TILE_INLINE void ss_tile_write(const ss_raster_tile *tile, const float *const channel[4],
                                  float *texels, uint32_t side, int32_t row) {
    float *to = texels + ((size_t)(tile->y + row) * side + (size_t)tile->x) * 4;
    for (int32_t x = 0; x < tile->width; x += 4) {
        ss_floats t[4];
        for (int c = 0; c < 4; c++) t[c] = ss_floats_load(channel[c] + x);
        ss_floats_turn(&t[0], &t[1], &t[2], &t[3]);
        for (int32_t i = 0; i < 4 && x + i < tile->width; i++) {
            ss_floats_store(to + 4 * (x + i), t[i]);
        }
    }
}

#endif
