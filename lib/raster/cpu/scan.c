/* The scan converter: blocks of a band, four texels at a time. */
#include "raster/cpu/scan.h"

#include <string.h>

#include "base/lanes.h"

#define LANES 4

typedef int32_t ints __attribute__((vector_size(4 * LANES)));
typedef float floats __attribute__((vector_size(4 * LANES)));

static const ints lane_number = {0, 1, 2, 3};

static inline ints all_ints(int32_t x) { return x - (ints){0}; }
static inline floats all_floats(float x) { return x - (floats){0}; }
static inline floats pick(ints mask, floats yes, floats no) {
    return (floats)((mask & (ints)yes) | (~mask & (ints)no));
}

static inline floats load(const float *from, int32_t n) {
    floats v = {0};
    if (n >= LANES)
        memcpy(&v, from, sizeof v);
    else
        memcpy(&v, from, (size_t)n * sizeof *from);
    return v;
}

static inline void store(float *to, floats v, int32_t n) {
    if (n >= LANES)
        memcpy(to, &v, sizeof v);
    else
        memcpy(to, &v, (size_t)n * sizeof *to);
}

/* Where the next layer begins. */
static inline floats below(const ss_scan_rows *to, floats h) {
    return h + to->alike * ss_floats_size(h);
}

/* Of two layers: what is nearer pushes the first down, where it may become the second, or be alike
 * and vanish. */
static inline void keep_two(const ss_scan_rows *to, size_t at, int32_t n, ints in, floats h,
                            floats first) {
    const floats second = load(to->second + at, n);
    const ints nearer = in & (ints)(h < first);
    const floats now = pick(nearer, h, first), pushed = pick(nearer, first, h);
    const ints apart = (ints)(pushed > below(to, now));
    store(to->plane + at, now, n);
    store(to->second + at, pick(in & apart & (ints)(pushed < second), pushed, second), n);
    if (ss_floats_bits(nearer & ~apart)) *to->doubt = true;
}

/* The lanes of `in` that the planes have room for: what is not nearer stays. */
static inline void keep_depth(const ss_scan_rows *to, size_t at, int32_t n, ints in, floats h) {
    const floats first = load(to->plane + at, n);
    if (to->above) in &= (ints)(h > below(to, load(to->above + at, n)));
    if (to->second) keep_two(to, at, n, in, h, first);
    else store(to->plane + at, pick(in & (ints)(h < first), h, first), n);
}

/* Four columns of a block, from `column` on: what a row needs is added up from the row before. */
static inline void depth_columns(const ss_scan *s, const ss_scan_rows *to, float bias,
                                 const ss_scan_block *b, int32_t column) {
    const ints places = column + lane_number, wanted = (ints)(places < b->width);
    const floats across =
        s->step_x[0] * __builtin_convertvector(places + (b->x - s->first_x), floats);
    const floats least_of = all_floats(s->least[0]), most_of = all_floats(s->most[0]);
    const int32_t wide = (int32_t)to->resolution;
    const int32_t n = wide - b->x - column; /* lanes that are not inside keep what they hold */
    size_t at = (size_t)b->y * (size_t)wide + (size_t)(b->x + column);
    ints edge[3];
    SS_UNROLL
    for (int i = 0; i < 3; i++) {
        const int32_t r = b->e[i].right;
        edge[i] = b->e[i].at + r * column + (ints){0, r, 2 * r, 3 * r};
    }
    for (int32_t row = 0; row < b->height; row++, at += (size_t)wide) {
        const ints out = (edge[0] | edge[1] | edge[2]) >> 31; /* a negative value is outside */
        const ints in = ~out & wanted;
        SS_UNROLL
        for (int i = 0; i < 3; i++) edge[i] += b->e[i].up;
        if (!ss_floats_bits(in)) continue;
        floats h = (s->start[0] + s->step_y[0] * (float)(b->y + row - s->first_y)) + across;
        h = ss_floats_less(most_of, ss_floats_more(least_of, h)) + bias;
        keep_depth(to, at, n, in, h);
    }
}

static int32_t least(int32_t a, int32_t b) { return a < b ? a : b; }
static int32_t greatest(int32_t a, int32_t b) { return a > b ? a : b; }

void ss_scan_depth(const ss_scan *s, const ss_scan_rows *to, float bias) {
    if (ss_scan_area(s) == 0) return;
    const int32_t top = least(s->last_y, to->last);
    for (int32_t y = greatest(s->first_y, to->first); y <= top; y += SS_BAND) {
        for (int32_t x = s->first_x; x <= s->last_x; x += SS_BAND) {
            ss_scan_block b = {.x = x,
                       .y = y,
                       .width = least(SS_BAND, s->last_x - x + 1),
                       .height = least(SS_BAND, top - y + 1)};
            if (!ss_scan_block_set(&b, s)) continue;
            for (int32_t column = 0; column < b.width; column += LANES)
                depth_columns(s, to, bias, &b, column);
        }
    }
}

/* Corners are within 30 texels of each other: 32 bits hold all products. */
static inline void set_small_edge(ss_scan_edge *e, const ss_scan *s, int i, int j, int32_t x,
                                  int32_t y) {
    const int32_t dx = s->x[j] - s->x[i], dy = s->y[j] - s->y[i];
    const int32_t px = x * SS_SUBTEXELS + 128 - s->x[i], py = y * SS_SUBTEXELS + 128 - s->y[i];
    e->at = (dx * py - dy * px - !ss_scan_top_or_left(dx, dy)) >> 8;
    e->right = -dy, e->up = dx;
}

void ss_scan_small(const ss_scan *s, const ss_scan_rows *to, float bias) {
    const int64_t area = ss_scan_area(s);
    const int32_t y = greatest(s->first_y, to->first);
    ss_scan_block b = {.x = s->first_x, .y = y, .width = s->last_x - s->first_x + 1,
                       .height = least(s->last_y, to->last) - y + 1};
    if (area == 0) return;
    const int second = area < 0 ? 2 : 1, third = 3 - second;
    set_small_edge(&b.e[0], s, 0, second, b.x, y);
    set_small_edge(&b.e[1], s, second, third, b.x, y);
    set_small_edge(&b.e[2], s, third, 0, b.x, y);
    for (int32_t column = 0; column < b.width; column += LANES)
        depth_columns(s, to, bias, &b, column);
}

bool ss_scan_hidden(const ss_scan *s, const ss_scan_rows *to, float least_h, float most_h) {
    const int32_t bottom = greatest(s->first_y, to->first), top = least(s->last_y, to->last);
    const floats h = all_floats(least_h), deepest = all_floats(most_h);
    for (int32_t y = bottom; y <= top; y++) {
        const size_t first = (size_t)y * to->resolution;
        for (int32_t x = s->first_x; x <= s->last_x; x += LANES) {
            const int32_t n = (int32_t)to->resolution - x;
            ints open = (ints)(h < load(to->plane + first + (size_t)x, n));
            if (to->above)
                open &= (ints)(below(to, load(to->above + first + (size_t)x, n)) < deepest);
            if (ss_floats_bits(open)) return false;
        }
    }
    return true;
}

/* ---- runs ----------------------------------------------------------------------------------- */

static void shade_run(const ss_scan *s, uint32_t used, int32_t x, int32_t y, int32_t n,
                      uint32_t tag, ss_raster_shade *shade, void *ctx) {
    floats values[SS_RASTER_ATTRIBUTES][SS_BAND / LANES];
    ss_raster_run run = {.x = (uint32_t)x, .y = (uint32_t)y, .n = (uint32_t)n, .tag = tag};
    for (uint32_t k = 0; k < used; k++) {
        const float row = s->start[k] + s->step_y[k] * (float)(y - s->first_y);
        const floats least_of = all_floats(s->least[k]), most_of = all_floats(s->most[k]);
        for (int32_t i = 0; i < n; i += LANES) {
            const ints column = lane_number + (x + i - s->first_x);
            floats v = row + s->step_x[k] * __builtin_convertvector(column, floats);
            values[k][i / LANES] = ss_floats_less(most_of, ss_floats_more(least_of, v));
        }
        run.attribute[k] = (const float *)values[k];
    }
    shade(ctx, &run);
}

/* Adds to each row's covered columns, a bit each, those of the four from `column` on. */
static inline void cover_columns(const ss_scan_block *b, int32_t column, uint32_t *covered) {
    ints edge[4];
    for (int i = 0; i < 4; i++) {
        edge[i] = b->e[i].at + b->e[i].right * (column + lane_number);
    }
    for (int32_t row = 0; row < b->height; row++) {
        const ints in = ~(edge[0] | edge[1] | edge[2] | edge[3]);
        covered[row] |= (uint32_t)ss_floats_bits(in >> 31) << column;
        for (int i = 0; i < 4; i++) edge[i] += b->e[i].up;
    }
}

static void block_runs(const ss_scan *s, const ss_scan_block *b, uint32_t used, uint32_t tag,
                       ss_raster_shade *shade, void *ctx) {
    uint32_t covered[SS_BAND] = {0};
    for (int32_t column = 0; column < b->width; column += LANES) cover_columns(b, column, covered);
    for (int32_t row = 0; row < b->height; row++) {
        const uint32_t columns = covered[row] & (UINT32_MAX >> (32 - b->width));
        if (!columns) continue; /* else one run, the triangle being convex */
        const int32_t first = __builtin_ctz(columns), last = 31 - __builtin_clz(columns);
        shade_run(s, used, b->x + first, b->y + row, last - first + 1, tag, shade, ctx);
    }
}

void ss_scan_tile_runs(const ss_scan *s, const int32_t box[4], uint32_t tag, ss_raster_shade *shade,
                       void *ctx) {
    const int32_t x = greatest(s->first_x, box[0]), y = greatest(s->first_y, box[1]);
    ss_scan_block b = {.x = x,
                       .y = y,
                       .width = least(s->last_x, box[2]) - x + 1,
                       .height = least(s->last_y, box[3]) - y + 1};
    if (ss_scan_block_lines(&b, s, 4)) block_runs(s, &b, SS_RASTER_ATTRIBUTES, tag, shade, ctx);
}

void ss_scan_runs(const ss_scan *s, int32_t first_row, int32_t last_row, uint32_t used,
                  uint32_t tag, ss_raster_shade *shade, void *ctx) {
    if (ss_scan_area(s) == 0) return;
    const int32_t top = least(s->last_y, last_row);
    for (int32_t y = greatest(s->first_y, first_row); y <= top; y += SS_BAND) {
        for (int32_t x = s->first_x; x <= s->last_x; x += SS_BAND) {
            ss_scan_block b = {.x = x,
                       .y = y,
                       .width = least(SS_BAND, s->last_x - x + 1),
                       .height = least(SS_BAND, top - y + 1)};
            if (!ss_scan_block_set(&b, s)) continue;
            block_runs(s, &b, used, tag, shade, ctx);
        }
    }
}

/* ---- with holes ----------------------------------------------------------------------------- */

/* The weights of the corners at a texel's centre, from the snapped corners. */
static void weights_at(const ss_scan *s, int32_t x, int32_t y, double weight[3]) {
    const double area = (double)ss_scan_area(s);
    const double px = (double)x * SS_SUBTEXELS + 128, py = (double)y * SS_SUBTEXELS + 128;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        weight[i] =
            ((s->x[k] - s->x[j]) * (py - s->y[j]) - (s->y[k] - s->y[j]) * (px - s->x[j])) / area;
    }
}

typedef struct masked {
    const ss_scan *scan;
    const ss_scan_rows *to;
    float bias;
    ss_scan_keep *keep;
    void *ctx;
} masked;

static void shade_masked(void *ctx, const ss_raster_run *run) {
    const masked *m = ctx;
    const ss_scan_rows *to = m->to;
    const float *last = to->second ? to->second : to->plane;
    for (uint32_t i = 0; i < run->n; i++) {
        const size_t at = (size_t)run->y * to->resolution + run->x + i;
        const float h = run->attribute[0][i] + m->bias;
        double weight[3];
        if (!(h < last[at])) continue;
        if (to->above && !(h > below(to, all_floats(to->above[at]))[0])) continue;
        weights_at(m->scan, (int32_t)(run->x + i), (int32_t)run->y, weight);
        if (m->keep(m->ctx, weight)) keep_depth(to, at, 1, (ints){-1}, all_floats(h));
    }
}

void ss_scan_masked(const ss_scan *scan, const ss_scan_rows *to, float bias, ss_scan_keep *keep,
                    void *ctx) {
    masked m = {scan, to, bias, keep, ctx};
    ss_scan_runs(scan, to->first, to->last, 1, 0, shade_masked, &m);
}
