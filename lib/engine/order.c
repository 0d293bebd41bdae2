/* Morton order by a radix sort of 24-bit keys in two passes, on all threads: the items are cut into
 * chunks of a fixed size, each counts its digits, and from the counts of all each knows where its
 * own go. Items that share a key (a far point makes the grid coarse) are sorted again on a grid of
 * their own. */
#include "engine/order.h"

#include <math.h>
#include <string.h>

#define AXIS_BITS 8
#define DIGIT_BITS 12
#define DIGITS (1u << DIGIT_BITS)
#define CHUNK ((size_t)1 << 15) /* points */
#define SAME 16    /* items that may share a key: about one group */
#define FEW 64     /* items that are sorted by insertion */
#define DEEPEST 12 /* refinements: 2^(8 * 12) cells are finer than any float */
/* A run may be this many times longer than the points' spacing would be if they were spread evenly
 * over a square as wide as points mostly lie apart: a picture's pixels are spread so, but for those
 * seen at a slant. */
#define LOOSE 16
#define PAIRS 64 /* of points, whose median distance says how far apart they mostly lie */

static size_t chunks_of(size_t n) { return (n + CHUNK - 1) / CHUNK; }

bool ss_order_reserve(ss_order *order, size_t n, ss_arena *arena) {
    const size_t chunks = chunks_of(n) + 1;
    order->at = ss_arena_alloc(arena, n + 1, sizeof *order->at); /* four floats are read at each */
    order->item = ss_arena_alloc(arena, n, sizeof *order->item);
    order->other = ss_arena_alloc(arena, n, sizeof *order->other);
    order->start = ss_arena_alloc(arena, chunks * DIGITS, sizeof *order->start);
    order->bounds = ss_arena_alloc(arena, chunks * 6, sizeof *order->bounds);
    order->counts = ss_arena_alloc(arena, chunks, sizeof *order->counts);
    order->count = 0;
    return order->at && order->item && order->other && order->start && order->bounds &&
           order->counts;
}

/* A grid of 2^8 cubes along the longest side of what it holds. */
typedef struct grid {
    float low[3], scale;
} grid;

/* Spreads 8 bits so that two zeros follow each. */
static uint32_t spread(uint32_t x) {
    x = (x | x << 8) & 0x0000f00f;
    x = (x | x << 4) & 0x000c30c3;
    return (x | x << 2) & 0x00249249;
}

static uint32_t cell(float x, float low, float scale) {
    const float at = (x - low) * scale, most = (1 << AXIS_BITS) - 1;
    return (uint32_t)(int32_t)(at < most ? at : most);
}

static uint32_t key_of(const grid *g, const float p[3]) {
    return spread(cell(p[0], g->low[0], g->scale)) | spread(cell(p[1], g->low[1], g->scale)) << 1 |
           spread(cell(p[2], g->low[2], g->scale)) << 2;
}

static void empty_bounds(float *bounds) {
    for (int k = 0; k < 3; k++) bounds[k] = INFINITY, bounds[3 + k] = -INFINITY;
}

/* NaN widens nothing. */
static void widen(float *bounds, const float low[3], const float high[3]) {
    for (int k = 0; k < 3; k++) {
        bounds[k] = low[k] < bounds[k] ? low[k] : bounds[k];
        bounds[3 + k] = high[k] > bounds[3 + k] ? high[k] : bounds[3 + k];
    }
}

/* false: they are all in one place */
static bool make_grid(grid *g, const float *bounds) {
    float size = 0;
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

/* ---- runs ----------------------------------------------------------------------------------- */

static float distance(const float a[3], const float b[3]) {
    float most = 0;
    for (int k = 0; k < 3; k++) most = fmaxf(most, fabsf(a[k] - b[k]));
    return most;
}

/* How long a run may be. Far points and those that are none (NaN is at no distance) hardly
 * count. */
static float longest_run(const float (*at)[3], size_t n) {
    float apart[PAIRS];
    for (size_t i = 0; i < PAIRS; i++) {
        const float here = distance(at[i * n / PAIRS], at[(i + PAIRS / 2) % PAIRS * n / PAIRS]);
        size_t j = i;
        for (; j > 0 && apart[j - 1] > here; j--) apart[j] = apart[j - 1];
        apart[j] = here;
    }
    return LOOSE * apart[PAIRS / 2] / sqrtf((float)n);
}

/* Four numbers at once, in the compiler's own vectors. The fourth is the next point's first. */
typedef float four __attribute__((vector_size(16)));
typedef int truths __attribute__((vector_size(16)));

static inline four choose(truths which, four a, four b) {
    return (four)(((truths)a & which) | ((truths)b & ~which));
}

/* NaN is in no run. */
static bool lie_together(const float (*at)[3], float size) {
    four p[SS_ORDER_RUN], low, high;
    for (int i = 0; i < SS_ORDER_RUN; i++) memcpy(&p[i], at[i], sizeof p[i]);
    low = high = p[0];
    for (int i = 1; i < SS_ORDER_RUN; i++) {
        low = choose(p[i] < low, p[i], low), high = choose(p[i] > high, p[i], high);
    }
    const four length = high - low, all = p[0] + p[1] + p[2] + p[3];
    return all[0] == all[0] && length[0] <= size && length[1] <= size && length[2] <= size;
}

/* Points begin..end as items with their keys; returns how many. */
static size_t make_items(const ss_order *order, const grid *g, float size, size_t begin, size_t end,
                         ss_order_item *to) {
    size_t n = 0;
    for (size_t i = begin, length; i < end; i += length) {
        const float(*at)[3] = (const float(*)[3])order->at + i;
        length = end - i >= SS_ORDER_RUN && lie_together(at, size) ? SS_ORDER_RUN : 1;
        if (at[0][0] != at[0][0]) continue;
        to[n].key = key_of(g, at[0]);
        to[n++].run = (uint32_t)(i + (length - 1) * SS_ORDER_MOST);
    }
    return n;
}

/* ---- the sort on all threads ---------------------------------------------------------------- */

typedef struct pass {
    ss_order *order;
    size_t points;
    grid grid;
    float size; /* of the longest run */
    const ss_order_item *from;
    ss_order_item *to;
    int shift;
} pass;

static size_t points_end(const pass *p, uint64_t chunk) {
    const size_t end = (chunk + 1) * CHUNK;
    return end < p->points ? end : p->points;
}

static softshadow_status bound_chunk(void *ctx, uint64_t chunk, uint64_t end) {
    pass *p = ctx;
    for (; chunk < end; chunk++) {
        four low[2], high[2];
        for (int j = 0; j < 2; j++) {
            low[j] = (four){INFINITY, INFINITY, INFINITY, INFINITY};
            high[j] = -low[j];
        }
        const size_t last = points_end(p, chunk);
        for (size_t i = chunk * CHUNK; i < last; i += 2) {
            for (size_t j = 0; j < 2; j++) { /* two, so that neither waits for the other */
                four at;
                memcpy(&at, p->order->at[i + j < last ? i + j : i], sizeof at);
                low[j] = choose(at < low[j], at, low[j]);
                high[j] = choose(at > high[j], at, high[j]);
            }
        }
        float *bounds = p->order->bounds + 6 * chunk;
        for (int k = 0; k < 3; k++) {
            bounds[k] = fminf(low[0][k], low[1][k]), bounds[3 + k] = fmaxf(high[0][k], high[1][k]);
        }
    }
    return SOFTSHADOW_OK;
}

/* A chunk's items lie where its points would. */
static softshadow_status item_chunk(void *ctx, uint64_t chunk, uint64_t end) {
    pass *p = ctx;
    for (; chunk < end; chunk++) {
        const size_t begin = chunk * CHUNK;
        p->order->counts[chunk] = make_items(p->order, &p->grid, p->size, begin,
                                             points_end(p, chunk), p->order->other + begin);
    }
    return SOFTSHADOW_OK;
}

static softshadow_status count_chunk(void *ctx, uint64_t chunk, uint64_t end) {
    pass *p = ctx;
    for (; chunk < end; chunk++) {
        uint32_t *start = p->order->start + chunk * DIGITS;
        const ss_order_item *from = p->from + chunk * CHUNK;
        memset(start, 0, DIGITS * sizeof *start);
        for (size_t i = 0; i < p->order->counts[chunk]; i++) {
            start[from[i].key >> p->shift & (DIGITS - 1)]++;
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
        const ss_order_item *from = p->from + chunk * CHUNK;
        for (size_t i = 0; i < p->order->counts[chunk]; i++) {
            p->to[start[from[i].key >> p->shift & (DIGITS - 1)]++] = from[i];
        }
    }
    return SOFTSHADOW_OK;
}

static softshadow_status sort_by_digit(pass *p, size_t chunks, ss_pool *pool) {
    softshadow_status status = ss_parallel_for(pool, chunks, 1, count_chunk, p);
    if (status) return status;
    place_digits(p, chunks);
    return ss_parallel_for(pool, chunks, 1, move_chunk, p);
}

/* ---- items that share a key ----------------------------------------------------------------- */

static void sort_again(ss_order *order, ss_order_item *item, size_t n) {
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
}

/* Few items, or many in a small place: one thread, on a finer grid. */
static void refine(ss_order *order, ss_order_item *item, size_t n, int depth) {
    float bounds[6];
    grid g;
    empty_bounds(bounds);
    for (size_t i = 0; i < n; i++) {
        const float *at = order->at[ss_order_first(&item[i])];
        widen(bounds, at, at);
    }
    if (n < 2 || depth == DEEPEST || !make_grid(&g, bounds)) return;
    for (size_t i = 0; i < n; i++) item[i].key = key_of(&g, order->at[ss_order_first(&item[i])]);
    if (n <= FEW) {
        insertion_sort(item, n);
        return;
    }
    sort_again(order, item, n);
    for (size_t first = 0, end; first < n; first = end) {
        for (end = first + 1; end < n && item[end].key == item[first].key;) end++;
        if (end - first > SAME) refine(order, item + first, end - first, depth + 1);
    }
}

/* Chunks of items that lie one behind the other. */
static size_t cut(ss_order *order) {
    const size_t chunks = chunks_of(order->count);
    for (size_t i = 0; i < chunks; i++) {
        order->counts[i] = i + 1 < chunks ? CHUNK : order->count - i * CHUNK;
    }
    return chunks;
}

softshadow_status ss_order_morton(ss_order *order, size_t n, ss_pool *pool) {
    pass p = {.order = order, .points = n};
    const size_t chunks = chunks_of(n);
    float bounds[6];
    softshadow_status status = ss_parallel_for(pool, chunks, 1, bound_chunk, &p);
    if (status) return status;
    empty_bounds(bounds);
    for (size_t i = 0; i < chunks; i++)
        widen(bounds, order->bounds + 6 * i, order->bounds + 6 * i + 3);
    const bool apart = make_grid(&p.grid, bounds);
    if (!apart) p.grid.scale = 0;
    p.size = longest_run((const float(*)[3])order->at, n);
    status = ss_parallel_for(pool, chunks, 1, item_chunk, &p);
    order->count = 0;
    for (size_t i = 0; i < chunks; i++) order->count += order->counts[i];
    if (status) return status;
    if (chunks == 1 && order->count <= FEW) {
        memcpy(order->item, order->other, order->count * sizeof *order->item);
        insertion_sort(order->item, order->count);
        return SOFTSHADOW_OK;
    }
    p.from = order->other, p.to = order->item, p.shift = 0;
    status = sort_by_digit(&p, chunks, pool);
    p.from = order->item, p.to = order->other, p.shift = DIGIT_BITS;
    if (!status) status = sort_by_digit(&p, cut(order), pool);
    ss_order_item *sorted = order->other;
    order->other = order->item, order->item = sorted;
    for (size_t first = 0, end; !status && first < order->count; first = end) {
        const uint32_t key = order->item[first].key;
        for (end = first + 1; end < order->count && order->item[end].key == key;) end++;
        if (apart && end - first > SAME) refine(order, order->item + first, end - first, 1);
    }
    return status;
}
