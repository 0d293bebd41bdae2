/* How an ink's kernel walks a polygon across a tile: as many texels of a row as a register has
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

/* What an ink knows of its shapes: how many lines are around them at most, and how many of their
 * attributes it reads. */
typedef struct ss_tile_shape {
    int lines, used;
} ss_tile_shape;

SS_TILE_INLINE void ss_tile_columns(ss_raster_tile *tile, const ss_scan *s, const ss_scan_block *b,
                                    int32_t first, ss_tile_shape shape, uint32_t tag,
                                    ss_tile_offer *offer, const void *ctx) {
    ss_wide_ints lane, edge[4];
    for (int i = 0; i < SS_LANES; i++) lane[i] = first + i;
    const ss_wide column = __builtin_convertvector(lane + (b->x - s->first_x), ss_wide);
    const ss_wide_ints beyond = lane >= tile->width;
    SS_UNROLL
    for (int i = 0; i < shape.lines; i++) edge[i] = b->e[i].at + b->e[i].right * lane;
    for (int32_t row = 0; row < b->height; row++) {
        ss_wide_ints out = edge[0] | edge[1] | edge[2] | beyond;
        if (shape.lines > 3) out |= edge[3];
        const ss_wide_mask in = ~SS_WIDE_NEGATIVE(out);
        SS_UNROLL
        for (int i = 0; i < shape.lines; i++) edge[i] += b->e[i].up;
        if (!ss_wide_any(in)) continue;
        ss_wide attribute[SS_RASTER_ATTRIBUTES];
        SS_UNROLL
        for (int k = 0; k < shape.used; k++) {
            ss_tile_attribute(s, k, b->y + row, column, &attribute[k]);
        }
        offer(ctx, tile, first, b->y + row - tile->y, attribute, &in, tag);
    }
}

SS_TILE_INLINE void ss_tile_walk(ss_raster_tile *tile, const ss_scan *s, ss_tile_shape shape,
                                 uint32_t tag, ss_tile_offer *offer, const void *ctx) {
    const int32_t low = s->first_y > tile->y ? s->first_y : tile->y;
    const int32_t end = tile->y + tile->height, high = s->last_y < end ? s->last_y + 1 : end;
    ss_scan_block b = {.x = tile->x, .y = low, .width = tile->width, .height = high - low};
    if (!ss_scan_block_lines(&b, s, shape.lines)) return;
    for (int32_t first = 0; first < SS_RASTER_TILE; first += SS_LANES)
        ss_tile_columns(tile, s, &b, first, shape, tag, offer, ctx);
}

/* ---- which tiles a polygon touches, some of a row of them at a time ------------------------- */

/* As many as a register has doubles; on the least instruction set one by one are faster. */
#if SS_FOURS > 1
#define SS_TILE_VISITS
typedef float ss_tile_floats __attribute__((vector_size(4 * SS_DOUBLES)));
typedef int32_t ss_tile_ints __attribute__((vector_size(4 * SS_DOUBLES)));

/* What the attributes that are used are within. */
typedef struct ss_tile_bounds {
    ss_tile_floats low[SS_RASTER_ATTRIBUTES], high[SS_RASTER_ATTRIBUTES];
} ss_tile_bounds;

/* The ink's `least`; gives the kinds, a bit for each. */
typedef uint32_t ss_tile_least(const void *ctx, uint32_t tag, const ss_tile_bounds *of,
                               ss_tile_floats *least);

#define SS_TILE_PICK(mask, yes, no)                                                               \
    ((ss_tile_floats)(((mask) & (ss_tile_ints)(yes)) | (~(mask) & (ss_tile_ints)(no))))
#define SS_TILE_LESS(a, b) SS_TILE_PICK((a) < (b), a, b)
#define SS_TILE_MORE(a, b) SS_TILE_PICK((a) > (b), a, b)

SS_TILE_INLINE uint32_t ss_tile_bits(ss_tile_ints mask) {
#if SS_FOURS == 4
    return (uint32_t)_mm256_movemask_ps((__m256)mask);
#else
    return (uint32_t)_mm_movemask_ps((__m128)mask);
#endif
}

SS_TILE_INLINE ss_tile_floats ss_tile_root(ss_tile_floats x) {
#if SS_FOURS == 4
    return (ss_tile_floats)_mm256_sqrt_ps((__m256)x);
#else
    return (ss_tile_floats)_mm_sqrt_ps((__m128)x);
#endif
}

/* Texels from the polygon's first one on. */
typedef struct ss_tile_boxes {
    ss_tile_ints left, right;
    int32_t low, high;
} ss_tile_boxes;

/* Which boxes are wholly outside of an edge? Then their best corner is. Whole numbers below 2^42,
 * which doubles hold. */
SS_TILE_INLINE uint32_t ss_tile_missed(const ss_scan_line *e, int lines, const ss_tile_boxes *b) {
    const ss_doubles left = __builtin_convertvector(b->left, ss_doubles);
    const ss_doubles right = __builtin_convertvector(b->right, ss_doubles);
    ss_doubles_mask out = {0};
    SS_UNROLL
    for (int k = 0; k < lines; k++) {
        const int64_t y = e[k].up > 0 ? b->high : b->low;
        const double here = (double)(e[k].at + y * e[k].up), per = e[k].right;
        out |= (ss_doubles_mask)(here + (per > 0 ? right : left) * per < 0);
    }
    return ss_tile_bits(__builtin_convertvector(out, ss_tile_ints));
}

SS_TILE_INLINE void ss_tile_bound(const ss_scan *s, const ss_tile_boxes *b, int used,
                                  ss_tile_bounds *out) {
    const ss_tile_floats zero = {0}, west = __builtin_convertvector(b->left, ss_tile_floats);
    const ss_tile_floats east = __builtin_convertvector(b->right, ss_tile_floats);
    SS_UNROLL
    for (int k = 0; k < used; k++) {
        const float below = s->step_y[k] * (float)b->low, above = s->step_y[k] * (float)b->high;
        const ss_tile_floats left = s->step_x[k] * west, right = s->step_x[k] * east;
        const ss_tile_floats least = s->least[k] + zero, most = s->most[k] + zero;
        const ss_tile_floats low =
            s->start[k] + SS_TILE_LESS(left, right) + (below < above ? below : above);
        const ss_tile_floats high =
            s->start[k] + SS_TILE_MORE(left, right) + (below > above ? below : above);
        const ss_tile_floats from = SS_TILE_MORE(low, least), to = SS_TILE_MORE(high, least);
        out->low[k] = SS_TILE_LESS(from, most), out->high[k] = SS_TILE_LESS(to, most);
    }
}

SS_TILE_INLINE uint32_t ss_tile_visits(const ss_scan *s, uint32_t tag, const ss_raster_band *band,
                                       uint32_t part, ss_tile_shape shape,
                                       ss_tile_least *least_of, const void *ctx,
                                       ss_raster_visit *out) {
    ss_tile_ints lane;
    for (int i = 0; i < SS_DOUBLES; i++) lane[i] = i;
    const int32_t low = s->first_y > band->first_row ? s->first_y : band->first_row;
    const int32_t high = s->last_y < band->last_row ? s->last_y : band->last_row;
    const int32_t first = s->first_x / SS_RASTER_TILE, last = s->last_x / SS_RASTER_TILE;
    const int32_t wide = s->last_x - s->first_x;
    uint32_t count = 0;
    for (int32_t row = (low - band->first_row) / SS_RASTER_TILE;
         row <= (high - band->first_row) / SS_RASTER_TILE; row++) {
        const int32_t y = band->first_row + row * SS_RASTER_TILE, end = y + SS_RASTER_TILE - 1;
        ss_tile_boxes b = {.low = (y > low ? y : low) - s->first_y,
                           .high = (end < high ? end : high) - s->first_y};
        for (int32_t column = first; column <= last; column += SS_DOUBLES) {
            const ss_tile_ints x = (column + lane) * SS_RASTER_TILE - s->first_x;
            const ss_tile_ints to = x + (SS_RASTER_TILE - 1), beyond = x > wide;
            b.left = x & (x > 0), b.right = (to & (to < wide)) | (wide & (to >= wide));
            uint32_t in = ~(ss_tile_missed(s->line, shape.lines, &b) | ss_tile_bits(beyond)) &
                          ((1u << SS_DOUBLES) - 1);
            if (!in) continue;
            ss_tile_bounds of;
            ss_tile_floats least;
            ss_tile_bound(s, &b, shape.used, &of);
            const uint32_t kinds = least_of(ctx, tag, &of, &least);
            for (; in; in &= in - 1) {
                const int i = __builtin_ctz(in);
                out[count++] = (ss_raster_visit){
                    .part = part,
                    .tile = (uint16_t)((uint32_t)row * band->across + (uint32_t)(column + i)),
                    .kind = (uint8_t)(kinds >> i & 1),
                    .least = ((const float *)&least)[i],
                    .nearest = ((const float *)&of.low[1])[i]};
            }
        }
    }
    return count;
}
#endif

/* ---- the map's rows ------------------------------------------------------------------------- */

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

/* What a tile has at first: depths from the map, if there is one, its keys, `none` in columns beyond
 * the map, and some of its values. */
SS_TILE_INLINE void ss_tile_begin(ss_raster_tile *tile, const float *depth, uint32_t side,
                                  float key, float none, const float *value, int values) {
    const ss_wide first = SS_WIDE_ALL(key), last = SS_WIDE_ALL(none);
    ss_wide_ints lane;
    for (int i = 0; i < SS_LANES; i++) lane[i] = i;
    for (int32_t row = 0; row < tile->height; row++) {
        if (depth) ss_tile_read(tile, depth, side, row, tile->depth[row]);
        for (int32_t x = 0; x < SS_RASTER_TILE; x += SS_LANES) {
            const ss_wide_ints within = lane + x < tile->width;
            *SS_TILE_AT(tile->key, row, x) = SS_WIDE_PICK(within, first, last);
            for (int k = 0; k < values; k++)
                *SS_TILE_AT(tile->value[k], row, x) = SS_WIDE_ALL(value[k]);
        }
    }
}

/* Four rows of the tile as the channels of a row of texels. */
SS_TILE_INLINE void ss_tile_write(const ss_raster_tile *tile, const float *const channel[4],
                                  float *texels, uint32_t side, int32_t row) {
    float *to = texels + ((size_t)(tile->y + row) * side + (size_t)tile->x) * 4;
    for (int32_t x = 0; x < tile->width; x += 4) {
        ss_floats t[4];
        ss_floats_weave(channel, (size_t)x, t);
        for (int32_t i = 0; i < 4 && x + i < tile->width; i++) {
            ss_floats_store(to + 4 * (x + i), t[i]);
        }
    }
}

#endif
