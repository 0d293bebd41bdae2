/* The order in which points are answered: along a space-filling curve, so that neighbours share what
 * a group of points shares. Answers never depend on it. */
#ifndef SS_ENGINE_ORDER_H
#define SS_ENGINE_ORDER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "scene/point.h"

#define SS_ORDER_NOT UINT32_MAX /* the place of a prepared point that is not to be answered */

typedef struct ss_order_item {
    uint32_t key, place; /* place: index into the prepared points */
} ss_order_item;

typedef struct ss_order {
    ss_order_item *item, *other;
    uint32_t *start; /* where each chunk's items of each digit go; not on a host's small stack */
    double *bounds;  /* of each chunk's points */
    size_t count;
} ss_order;

bool ss_order_reserve(ss_order *order, size_t n, ss_arena *arena);
/* Along a Morton curve, less those whose place is SS_ORDER_NOT; the same order for any number of threads. */
softshadow_status ss_order_morton(ss_order *order, const ss_point *points, size_t n, ss_pool *pool);

#endif
