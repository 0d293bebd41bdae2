/* Triangles that are there more than once: Embree's tree cannot part them, so that each ray that
 * misses one tests all. */
#ifndef SS_TRACE_DISTINCT_H
#define SS_TRACE_DISTINCT_H

#include "scene/scene.h"

/* The world's triangles, in their order, less those whose three corners are an earlier triangle's
 * in float, in any order; such as an opacity texture cuts out all stay. *numbers is NULL if all of
 * them are distinct, else to be freed with ss_free(). */
softshadow_status ss_distinct_find(const ss_world *world, uint32_t **numbers, size_t *count);

#endif
