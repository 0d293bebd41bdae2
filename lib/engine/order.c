/* Morton order by a radix sort of 24-bit keys; runs that share a key (a far point makes the grid
 * coarse) are sorted again on a grid of their own. */
#include "engine/order.h"

#include <math.h>
#include <string.h>

#define AXIS_BITS 8
#define DIGIT_BITS 12
#define DIGITS (1u << DIGIT_BITS)
#define RUN 64       /* points that may share a key: about one group */
#define DEEPEST 12   /* refinements: 2^(8 * 12) cells are finer than any float */

bool ss_order_reserve(ss_order *order, size_t n, ss_arena *arena) {
    order->item = ss_arena_alloc(arena, n, sizeof *order->item);
    order->other = ss_arena_alloc(arena, n, sizeof *order->other);
    order->start = ss_arena_alloc(arena, DIGITS, sizeof *order->start);
    order->count = 0;
    return order->item && order->other && order->start;
}

void ss_order_given(ss_order *order, const ss_point *points, size_t n) {
    order->count = 0;
    for (size_t i = 0; i < n; i++) {
        if (points[i].place == SS_ORDER_NOT) continue;
        order->item[order->count++] = (ss_order_item){0, (uint32_t)i};
    }
}

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

/* Gives every item its key on the grid of their own bounds; false if they are all in one place. */
static bool make_keys(ss_order_item *item, size_t n, const ss_point *points) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < n; i++) {
        const double *p = points[item[i].place].p;
        for (int k = 0; k < 3; k++) {
            low[k] = p[k] < low[k] ? p[k] : low[k];
            high[k] = p[k] > high[k] ? p[k] : high[k];
        }
    }
    const double size = fmax(high[0] - low[0], fmax(high[1] - low[1], high[2] - low[2]));
    if (!(size > 0)) return false;
    const double scale = (1 << AXIS_BITS) / size;
    if (isinf(scale)) return false;
    for (size_t i = 0; i < n; i++) {
        const double *p = points[item[i].place].p;
        item[i].key = spread(cell(p[0], low[0], scale)) | spread(cell(p[1], low[1], scale)) << 1 |
                      spread(cell(p[2], low[2], scale)) << 2;
    }
    return true;
}

static void sort_by_digit(const ss_order_item *from, ss_order_item *to, size_t n, int shift,
                          uint32_t *start) {
    memset(start, 0, DIGITS * sizeof *start);
    for (size_t i = 0; i < n; i++) start[from[i].key >> shift & (DIGITS - 1)]++;
    for (uint32_t d = 0, sum = 0; d < DIGITS; d++) {
        const uint32_t count = start[d];
        start[d] = sum;
        sum += count;
    }
    for (size_t i = 0; i < n; i++) to[start[from[i].key >> shift & (DIGITS - 1)]++] = from[i];
}

static void insertion_sort(ss_order_item *item, size_t n) {
    for (size_t i = 1; i < n; i++) {
        const ss_order_item moved = item[i];
        size_t j = i;
        for (; j > 0 && item[j - 1].key > moved.key; j--) item[j] = item[j - 1];
        item[j] = moved;
    }
}

static void sort(ss_order_item *item, ss_order_item *other, size_t n, const ss_point *points,
                 uint32_t *start, int depth) {
    if (n < 2 || depth == DEEPEST || !make_keys(item, n, points)) return;
    if (n <= RUN) {
        insertion_sort(item, n);
        return;
    }
    sort_by_digit(item, other, n, 0, start);
    sort_by_digit(other, item, n, DIGIT_BITS, start);
    for (size_t begin = 0, end; begin < n; begin = end) {
        for (end = begin + 1; end < n && item[end].key == item[begin].key;) end++;
        if (end - begin > RUN) sort(item + begin, other, end - begin, points, start, depth + 1);
    }
}

void ss_order_morton(ss_order *order, const ss_point *points, size_t n) {
    ss_order_given(order, points, n);
    sort(order->item, order->other, order->count, points, order->start, 0);
}
