/* Fewer triangles for nearly the same surface. */
#ifndef SS_TOPOLOGY_SIMPLIFY_H
#define SS_TOPOLOGY_SIMPLIFY_H

#include "base/parallel.h"

typedef struct ss_simplifier ss_simplifier;

/* Takes welded triangles, none of them degenerate. Coordinates within about [0, 1]. */
softshadow_status ss_simplifier_create(ss_simplifier **out, const float *vertices,
                                       size_t vertex_count, const uint32_t *triangles,
                                       size_t triangle_count, ss_pool *pool);
void ss_simplifier_destroy(ss_simplifier *s);

/* Collapses edges until at most `target` triangles are left or none can go without folding the
 * surface over. Edges whose uses cancel before still cancel: what was closed stays closed. Looks at
 * progress between passes, for cancelling only; NULL is fine. */
softshadow_status ss_simplify(ss_simplifier *s, size_t target, ss_progress *progress);

size_t ss_simplifier_vertices(const ss_simplifier *s);
size_t ss_simplifier_triangles(const ss_simplifier *s);
/* Share of the edges that were not between two triangles with the same orientation when it was
 * made. Near 1 for a soup. */
double ss_simplifier_rim(const ss_simplifier *s);
/* vertices x 3, triangles x 3. */
void ss_simplifier_read(const ss_simplifier *s, float *vertices, uint32_t *triangles);
/* Which vertex now stands for one of the vertices given at first. */
uint32_t ss_simplifier_where(const ss_simplifier *s, size_t original);

#endif
