/* The scan converter: edge functions in whole numbers, four texels at a time.
 *
 * based on: [Pin88]. Corners lie on a grid of
 * 1/256 texel, so the functions are exact and neighbours agree about every centre. Centres lie 256
 * steps apart, so a function's low eight bits never change across the map: dropping them (floor)
 * keeps every sign and makes 32 bits enough inside a block. */
#include "raster/cpu/scan.h"

#include <math.h>
#include <string.h>

#define LANES 4
/* Beyond what a block of 32 x 32 texels can change: |edge| < 2^24, 31 + 31 steps. */
#define LARGE (1 << 30)

typedef int32_t ints __attribute__((vector_size(4 * LANES)));
typedef float floats __attribute__((vector_size(4 * LANES)));

static const ints lane_number = {0, 1, 2, 3};

static inline ints all_ints(int32_t x) { return x - (ints){0}; }
static inline floats all_floats(float x) { return x - (floats){0}; }
static inline floats pick(ints mask, floats yes, floats no) {
    return (floats)((mask & (ints)yes) | (~mask & (ints)no));
}

/* Not fmin and fmax: those are calls. */
static inline double less(double a, double b) { return a < b ? a : b; }
static inline double more(double a, double b) { return a > b ? a : b; }

bool ss_scan_snap(ss_scan *scan, const ss_scan_corner corner[3], uint32_t resolution) {
    int32_t low[2] = {INT32_MAX, INT32_MAX}, high[2] = {INT32_MIN, INT32_MIN};
    for (int i = 0; i < 3; i++) {
        scan->x[i] = (int32_t)lrint(corner[i].x * SS_SUBTEXELS);
        scan->y[i] = (int32_t)lrint(corner[i].y * SS_SUBTEXELS);
        low[0] = scan->x[i] < low[0] ? scan->x[i] : low[0];
        low[1] = scan->y[i] < low[1] ? scan->y[i] : low[1];
        high[0] = scan->x[i] > high[0] ? scan->x[i] : high[0];
        high[1] = scan->y[i] > high[1] ? scan->y[i] : high[1];
    }
    /* centres are at 256 i + 128 */
    scan->first_x = (low[0] + 127) >> 8, scan->last_x = (high[0] - 128) >> 8;
    scan->first_y = (low[1] + 127) >> 8, scan->last_y = (high[1] - 128) >> 8;
    const int32_t last = (int32_t)resolution - 1;
    if (scan->first_x < 0) scan->first_x = 0;
    if (scan->first_y < 0) scan->first_y = 0;
    if (scan->last_x > last) scan->last_x = last;
    if (scan->last_y > last) scan->last_y = last;
    return scan->first_x <= scan->last_x && scan->first_y <= scan->last_y;
}

int64_t ss_scan_area(const ss_scan *s) {
    return (int64_t)(s->x[1] - s->x[0]) * (s->y[2] - s->y[0]) -
           (int64_t)(s->x[2] - s->x[0]) * (s->y[1] - s->y[0]);
}

/* From the corners as given: snapping moves what is covered, not what it says. */
void ss_scan_gradients(ss_scan *scan, const ss_scan_corner corner[3], uint32_t used) {
    const double ax = corner[1].x - corner[0].x, ay = corner[1].y - corner[0].y;
    const double bx = corner[2].x - corner[0].x, by = corner[2].y - corner[0].y;
    const double area = ax * by - bx * ay;
    const double size = more(more(fabs(ax), fabs(ay)), more(fabs(bx), fabs(by)));
    /* Thinner than rounding can tell: no gradient, which the clamp would have eaten anyway. */
    const double per = fabs(area) > 1e-12 * size * size ? 1 / area : 0;
    const double dx = scan->first_x + 0.5 - corner[0].x, dy = scan->first_y + 0.5 - corner[0].y;
    for (uint32_t k = 0; k < used; k++) {
        const double a = corner[1].attribute[k] - corner[0].attribute[k];
        const double b = corner[2].attribute[k] - corner[0].attribute[k];
        const double sx = (a * by - b * ay) * per, sy = (b * ax - a * bx) * per;
        const double at = corner[0].attribute[k];
        scan->start[k] = (float)(at + sx * dx + sy * dy);
        scan->step_x[k] = (float)sx, scan->step_y[k] = (float)sy;
        scan->least[k] = (float)(at + less(0, less(a, b)));
        scan->most[k] = (float)(at + more(0, more(a, b)));
    }
}

/* One edge inside one block: its value at the block's first centre, and its steps. */
typedef struct edge {
    int32_t at, right, up;
} edge;

/* A block of the map's texels, edges rebased to its corner. */
typedef struct block {
    edge e[3];
    int32_t x, y, width, height;
} block;

static inline bool top_or_left(int32_t dx, int32_t dy) { return dy < 0 || (dy == 0 && dx < 0); }

/* Counter-clockwise with Y up: the inside is on the left, where the function is positive. A left
 * edge runs down; a top edge, horizontal at the upper end, runs left. */
static inline bool set_edge(edge *e, const ss_scan *s, int i, int j, int32_t x, int32_t y) {
    const int32_t dx = s->x[j] - s->x[i], dy = s->y[j] - s->y[i];
    const int64_t px = (int64_t)x * SS_SUBTEXELS + 128 - s->x[i];
    const int64_t py = (int64_t)y * SS_SUBTEXELS + 128 - s->y[i];
    int64_t value = dx * py - dy * px - !top_or_left(dx, dy);
    value >>= 8; /* floor */
    e->right = -dy, e->up = dx;
    e->at = (int32_t)(value > LARGE ? LARGE : value < -LARGE ? -LARGE : value);
    return value >= -LARGE;
}

static inline bool set_block(block *b, const ss_scan *s, const int order[3]) {
    for (int i = 0; i < 3; i++) {
        edge *e = &b->e[i];
        if (!set_edge(e, s, order[i], order[(i + 1) % 3], b->x, b->y)) return false;
        /* the best corner of the block */
        const int32_t right = e->right > 0 ? e->right * (b->width - 1) : 0;
        const int32_t up = e->up > 0 ? e->up * (b->height - 1) : 0;
        if (e->at + right + up < 0) return false;
    }
    return true;
}

/* Lanes whose centre is inside, for the four texels from column x of the block on. */
static inline ints inside(const block *b, int32_t column, int32_t row) {
    ints any_out = all_ints(0);
    for (int i = 0; i < 3; i++) {
        const edge *e = &b->e[i];
        any_out |= (e->at + e->up * row + e->right * column) + e->right * lane_number;
    }
    return ~(any_out >> 31); /* a negative value is outside */
}

/* Where depths go: below `above`, if that is given. */
typedef struct walk {
    const ss_scan *scan;
    int32_t first_row, last_row, resolution;
    float bias;
    const float *above;
    float *plane;
} walk;

static inline floats depth_of(const ss_scan *s, int32_t x, int32_t y) {
    const float row = s->start[0] + s->step_y[0] * (float)(y - s->first_y);
    const floats column = __builtin_convertvector(lane_number + (x - s->first_x), floats);
    floats h = row + s->step_x[0] * column;
    h = pick((ints)(h < s->least[0]), all_floats(s->least[0]), h);
    return pick((ints)(h > s->most[0]), all_floats(s->most[0]), h);
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

static inline void depth_row(const walk *w, const block *b, int32_t row) {
    const int32_t y = b->y + row;
    for (int32_t column = 0; column < b->width; column += LANES) {
        const int32_t x = b->x + column;
        const int32_t n = w->resolution - x; /* lanes that are not inside keep what they hold */
        ints in = inside(b, column, row) & (ints)(column + lane_number < b->width);
        const floats h = depth_of(w->scan, x, y) + w->bias;
        const size_t at = (size_t)y * (size_t)w->resolution + (size_t)x;
        const floats old = load(w->plane + at, n);
        in &= (ints)(h < old);
        if (w->above) in &= (ints)(h > load(w->above + at, n));
        store(w->plane + at, pick(in, h, old), n);
    }
}

static void order_of(const ss_scan *s, int order[3]) {
    const bool turn = ss_scan_area(s) < 0;
    order[0] = 0, order[1] = turn ? 2 : 1, order[2] = turn ? 1 : 2;
}

static int32_t least(int32_t a, int32_t b) { return a < b ? a : b; }
static int32_t greatest(int32_t a, int32_t b) { return a > b ? a : b; }

static void walk_depth(const walk *w) {
    const ss_scan *s = w->scan;
    if (ss_scan_area(s) == 0) return;
    int order[3];
    order_of(s, order);
    const int32_t top = least(s->last_y, w->last_row);
    for (int32_t y = greatest(s->first_y, w->first_row); y <= top; y += SS_BAND) {
        for (int32_t x = s->first_x; x <= s->last_x; x += SS_BAND) {
            block b = {.x = x,
                       .y = y,
                       .width = least(SS_BAND, s->last_x - x + 1),
                       .height = least(SS_BAND, top - y + 1)};
            if (!set_block(&b, s, order)) continue;
            for (int32_t row = 0; row < b.height; row++) depth_row(w, &b, row);
        }
    }
}

void ss_scan_depth(const ss_scan *scan, int32_t first_row, int32_t last_row, uint32_t resolution,
                   float bias, float *plane) {
    const walk w = {scan, first_row, last_row, (int32_t)resolution, bias, NULL, plane};
    walk_depth(&w);
}

void ss_scan_peel(const ss_scan *scan, int32_t first_row, int32_t last_row, uint32_t resolution,
                  float bias, const float *above, float *plane) {
    const walk w = {scan, first_row, last_row, (int32_t)resolution, bias, above, plane};
    walk_depth(&w);
}

/* ---- runs ----------------------------------------------------------------------------------- */

/* A bit for each covered column of one row of a block. */
static uint32_t columns_of(const block *b, int32_t row) {
    static const ints bit = {1, 2, 4, 8};
    uint32_t columns = 0;
    for (int32_t column = 0; column < b->width; column += LANES) {
        const ints in = inside(b, column, row) & bit;
        columns |= (uint32_t)(in[0] | in[1] | in[2] | in[3]) << column;
    }
    return b->width < 32 ? columns & ((1u << b->width) - 1) : columns;
}

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
            v = pick((ints)(v < least_of), least_of, v);
            values[k][i / LANES] = pick((ints)(v > most_of), most_of, v);
        }
        run.attribute[k] = (const float *)values[k];
    }
    shade(ctx, &run);
}

void ss_scan_runs(const ss_scan *s, int32_t first_row, int32_t last_row, uint32_t used,
                  uint32_t tag, ss_raster_shade *shade, void *ctx) {
    if (ss_scan_area(s) == 0) return;
    int order[3];
    order_of(s, order);
    const int32_t top = least(s->last_y, last_row);
    for (int32_t y = greatest(s->first_y, first_row); y <= top; y += SS_BAND) {
        for (int32_t x = s->first_x; x <= s->last_x; x += SS_BAND) {
            block b = {.x = x,
                       .y = y,
                       .width = least(SS_BAND, s->last_x - x + 1),
                       .height = least(SS_BAND, top - y + 1)};
            if (!set_block(&b, s, order)) continue;
            for (int32_t row = 0; row < b.height; row++) {
                const uint32_t columns = columns_of(&b, row);
                if (!columns) continue; /* else one run, the triangle being convex */
                const int32_t first = __builtin_ctz(columns), last = 31 - __builtin_clz(columns);
                shade_run(s, used, x + first, y + row, last - first + 1, tag, shade, ctx);
            }
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
    uint32_t resolution;
    float bias;
    const float *above;
    float *plane;
    ss_scan_keep *keep;
    void *ctx;
} masked;

static void shade_masked(void *ctx, const ss_raster_run *run) {
    const masked *m = ctx;
    for (uint32_t i = 0; i < run->n; i++) {
        const size_t at = (size_t)run->y * m->resolution + run->x + i;
        const float h = run->attribute[0][i] + m->bias;
        double weight[3];
        if (!(h < m->plane[at]) || (m->above && !(h > m->above[at]))) continue;
        weights_at(m->scan, (int32_t)(run->x + i), (int32_t)run->y, weight);
        if (m->keep(m->ctx, weight)) m->plane[at] = h;
    }
}

void ss_scan_masked(const ss_scan *scan, int32_t first_row, int32_t last_row, uint32_t resolution,
                    float bias, const float *above, float *plane, ss_scan_keep *keep, void *ctx) {
    masked m = {scan, resolution, bias, above, plane, keep, ctx};
    ss_scan_runs(scan, first_row, last_row, 1, 0, shade_masked, &m);
}
