/* Morton order by a radix sort of 24-bit keys in two passes, on all threads: the items are cut into
 * chunks of a fixed size, each counts its digits, and from the counts of all each knows where its own
 * go. Runs that share a key (a far point makes the grid coarse) are sorted again on a grid of their
 * own. */
#include "engine/order.h"

#include <math.h>
#include <string.h>

#define AXIS_BITS 8
#define DIGIT_BITS 12
#define DIGITS (1u << DIGIT_BITS)
#define CHUNK ((size_t)1 << 15)
#define RUN 64     /* points that may share a key: about one group */
#define DEEPEST 12 /* refinements: 2^(8 * 12) cells are finer than any float */

static size_t chunks_of(size_t n) { return (n + CHUNK - 1) / CHUNK; }

bool ss_order_reserve(ss_order *order, size_t n, ss_arena *arena) {
    const size_t chunks = chunks_of(n) + 1;
    order->item = ss_arena_alloc(arena, n, sizeof *order->item);
    order->other = ss_arena_alloc(arena, n, sizeof *order->other);
    order->start = ss_arena_alloc(arena, chunks * DIGITS, sizeof *order->start);
    order->bounds = ss_arena_alloc(arena, chunks * 6, sizeof *order->bounds);
    order->count = 0;
    return order->item && order->other && order->start && order->bounds;
}

static void collect(ss_order *order, const ss_point *points, size_t n) {
    order->count = 0;
    for (size_t i = 0; i < n; i++) {
        if (points[i].place == SS_ORDER_NOT) continue;
        order->item[order->count++] = (ss_order_item){0, (uint32_t)i};
    }
}

/* A grid of 2^8 cubes along the longest side of what it holds. */
typedef struct grid {
    double low[3], scale;
} grid;

/* Spreads 8 bits so that two zeros follow each. */
static uint32_t spread(uint32_t x) {
    x = (x | x << 8) & 0x0000f00f;
    x = (x | x << 4) & 0x000c30c3;
    return (x | x << 2) & 0x00249249;
}

static uint32_t cell(double x, double low, double scale) {
    const double at = (x - low) * scale;
    const double most = (1 << AXIS_BITS) - 1;
    return (uint32_t)(at < most ? (at > 0 ? at : 0) : most);
}

static uint32_t key_of(const grid *g, const double p[3]) {
    return spread(cell(p[0], g->low[0], g->scale)) | spread(cell(p[1], g->low[1], g->scale)) << 1 |
           spread(cell(p[2], g->low[2], g->scale)) << 2;
}

static void empty_bounds(double *bounds) {
    for (int k = 0; k < 3; k++) bounds[k] = INFINITY, bounds[3 + k] = -INFINITY;
}

static void widen(double *bounds, const double low[3], const double high[3]) {
    for (int k = 0; k < 3; k++) {
        bounds[k] = low[k] < bounds[k] ? low[k] : bounds[k];
        bounds[3 + k] = high[k] > bounds[3 + k] ? high[k] : bounds[3 + k];
    }
}

/* false: they are all in one place */
static bool make_grid(grid *g, const double *bounds) {
    double size = 0;
    for (int k = 0; k < 3; k++) {
        g->low[k] = bounds[k];
        size = bounds[3 + k] - bounds[k] > size ? bounds[3 + k] - bounds[k] : size;
    }
    g->scale = (1 << AXIS_BITS) / size;
    return size > 0 && !isinf(g->scale);
}

static void insertion_sort(ss_order_item *item, size_t n) {
    for (size_t i = 1; i < n; i++) {
        const ss_order_item moved = item[i];
        size_t j = i;
        for (; j > 0 && item[j - 1].key > moved.key; j--) item[j] = item[j - 1];
        item[j] = moved;
    }
}

/* ---- the sort on all threads ---------------------------------------------------------------- */

typedef struct pass {
    ss_order *order;
    const ss_point *points;
    grid grid;
    const ss_order_item *from;
    ss_order_item *to;
    int shift;
} pass;

static size_t end_of(const pass *p, uint64_t chunk) {
    const size_t end = (chunk + 1) * CHUNK;
    return end < p->order->count ? end : p->order->count;
}

static softshadow_status bound_chunk(void *ctx, uint64_t chunk, uint64_t end) {
    pass *p = ctx;
    for (; chunk < end; chunk++) {
        double bounds[6]; /* kept out of memory while the loop runs */
        empty_bounds(bounds);
        for (size_t i = chunk * CHUNK; i < end_of(p, chunk); i++) {
            const double *at = p->points[p->order->item[i].place].p;
            widen(bounds, at, at);
        }
        memcpy(p->order->bounds + 6 * chunk, bounds, sizeof bounds);
    }
    return SOFTSHADOW_OK;
}

static softshadow_status key_chunk(void *ctx, uint64_t chunk, uint64_t end) {
    pass *p = ctx;
    for (; chunk < end; chunk++) {
        for (size_t i = chunk * CHUNK; i < end_of(p, chunk); i++) {
            ss_order_item *item = &p->order->item[i];
            item->key = key_of(&p->grid, p->points[item->place].p);
        }
    }
    return SOFTSHADOW_OK;
}

static softshadow_status count_chunk(void *ctx, uint64_t chunk, uint64_t end) {
    pass *p = ctx;
    for (; chunk < end; chunk++) {
        uint32_t *start = p->order->start + chunk * DIGITS;
        memset(start, 0, DIGITS * sizeof *start);
        for (size_t i = chunk * CHUNK; i < end_of(p, chunk); i++) {
            start[p->from[i].key >> p->shift & (DIGITS - 1)]++;
        }
    }
    return SOFTSHADOW_OK;
}

static void place_digits(const pass *p, size_t chunks) {
    uint32_t sum = 0;
    for (uint32_t digit = 0; digit < DIGITS; digit++) {
        for (size_t chunk = 0; chunk < chunks; chunk++) {
            uint32_t *start = p->order->start + chunk * DIGITS + digit;
            const uint32_t count = *start;
            *start = sum;
            sum += count;
        }
    }
}

static softshadow_status move_chunk(void *ctx, uint64_t chunk, uint64_t end) {
    pass *p = ctx;
    for (; chunk < end; chunk++) {
        uint32_t *start = p->order->start + chunk * DIGITS;
        for (size_t i = chunk * CHUNK; i < end_of(p, chunk); i++) {
            p->to[start[p->from[i].key >> p->shift & (DIGITS - 1)]++] = p->from[i];
        }
    }
    return SOFTSHADOW_OK;
}

static softshadow_status sort_by_digit(pass *p, ss_pool *pool) {
    const size_t chunks = chunks_of(p->order->count);
    softshadow_status status = ss_parallel_for(pool, chunks, 1, count_chunk, p);
    if (status) return status;
    place_digits(p, chunks);
    return ss_parallel_for(pool, chunks, 1, move_chunk, p);
}

/* ---- runs that share a key ------------------------------------------------------------------ */

/* Few items, or many in a small place: one thread, on a finer grid. */
static void refine(ss_order *order, size_t begin, size_t n, const ss_point *points, int depth) {
    ss_order_item *item = order->item + begin;
    double bounds[6];
    grid g;
    empty_bounds(bounds);
    for (size_t i = 0; i < n; i++) widen(bounds, points[item[i].place].p, points[item[i].place].p);
    if (n < 2 || depth == DEEPEST || !make_grid(&g, bounds)) return;
    for (size_t i = 0; i < n; i++) item[i].key = key_of(&g, points[item[i].place].p);
    if (n <= RUN) {
        insertion_sort(item, n);
        return;
    }
    for (int shift = 0; shift < 2 * DIGIT_BITS; shift += DIGIT_BITS) {
        uint32_t *start = order->start;
        const ss_order_item *from = shift ? order->other : item;
        ss_order_item *to = shift ? item : order->other;
        memset(start, 0, DIGITS * sizeof *start);
        for (size_t i = 0; i < n; i++) start[from[i].key >> shift & (DIGITS - 1)]++;
        for (uint32_t digit = 0, sum = 0; digit < DIGITS; digit++) {
            const uint32_t count = start[digit];
            start[digit] = sum;
            sum += count;
        }
        for (size_t i = 0; i < n; i++) to[start[from[i].key >> shift & (DIGITS - 1)]++] = from[i];
    }
    for (size_t first = 0, end; first < n; first = end) {
        for (end = first + 1; end < n && item[end].key == item[first].key;) end++;
        if (end - first > RUN) refine(order, begin + first, end - first, points, depth + 1);
    }
}

softshadow_status ss_order_morton(ss_order *order, const ss_point *points, size_t n,
                                  ss_pool *pool) {
    collect(order, points, n);
    if (order->count <= CHUNK / 8) {
        refine(order, 0, order->count, points, 0);
        return SOFTSHADOW_OK;
    }
    pass p = {.order = order, .points = points};
    const size_t chunks = chunks_of(order->count);
    double bounds[6];
    softshadow_status status = ss_parallel_for(pool, chunks, 1, bound_chunk, &p);
    if (status) return status;
    empty_bounds(bounds);
    for (size_t i = 0; i < chunks; i++) widen(bounds, order->bounds + 6 * i, order->bounds + 6 * i + 3);
    if (!make_grid(&p.grid, bounds)) return SOFTSHADOW_OK;
    status = ss_parallel_for(pool, chunks, 1, key_chunk, &p);
    p.from = order->item, p.to = order->other, p.shift = 0;
    if (!status) status = sort_by_digit(&p, pool);
    p.from = order->other, p.to = order->item, p.shift = DIGIT_BITS;
    if (!status) status = sort_by_digit(&p, pool);
    for (size_t first = 0, end; !status && first < order->count; first = end) {
        const uint32_t key = order->item[first].key;
        for (end = first + 1; end < order->count && order->item[end].key == key;) end++;
        if (end - first > RUN) refine(order, first, end - first, points, 1);
    }
    return status;
}
