/* The order in which points are answered: along a space-filling curve, so that neighbours share
 * what a group of points shares. Answers never depend on it.
 *
 * What is put in order are runs of up to SS_ORDER_RUN points that follow each other in the batch
 * and lie close together, as the pixels of a picture do; where they do not, single points. */
#ifndef SS_ENGINE_ORDER_H
#define SS_ENGINE_ORDER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/memory.h"
#include "base/parallel.h"

#define SS_ORDER_RUN 4
#define SS_ORDER_MOST ((size_t)1 << 28) /* points */

typedef struct ss_order_item {
    uint32_t key, run; /* its first point's index, and in the highest bits how many more */
} ss_order_item;

typedef struct ss_order {
    float (*at)[3]; /* for the caller to fill: where each point lies; NaN: not to be answered */
    ss_order_item *item, *other;
    uint32_t *start; /* where each chunk's items of each digit go; not on a host's small stack */
    float *bounds;   /* of each chunk's points */
    size_t *counts;  /* of each chunk's items */
    size_t count;    /* of items */
} ss_order;

bool ss_order_reserve(ss_order *order, size_t n, ss_arena *arena);
/* Along a Morton curve; the same order for any number of threads. */
softshadow_status ss_order_morton(ss_order *order, size_t n, ss_pool *pool);

static inline size_t ss_order_first(const ss_order_item *item) {
    return item->run & (SS_ORDER_MOST - 1);
}
static inline size_t ss_order_length(const ss_order_item *item) {
    return item->run / SS_ORDER_MOST + 1;
}

#endif
