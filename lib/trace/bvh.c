/* Walking the wide BVH for the faces near a point, and to tell that a shaft is empty. */
#include "trace/bvh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "trace/bvh_node.h"
#include "trace/shaft.h"

void ss_bvh_destroy(ss_bvh *bvh) {
    if (!bvh) return;
    ss_free(bvh->nodes);
    ss_free(bvh->leaves);
    ss_free(bvh->order);
    ss_free(bvh);
}

size_t ss_bvh_bytes(const ss_bvh *bvh) {
    return bvh->node_count * sizeof *bvh->nodes + bvh->leaf_count * sizeof *bvh->leaves +
           bvh->world->triangle_count * sizeof *bvh->order;
}

/* ---- near faces --------------------------------------------------------------------------------*/

/* Four lanes at once, in the compiler's own vectors. */
typedef float floats __attribute__((vector_size(16)));
typedef int ints __attribute__((vector_size(16)));

static inline floats four(const float *values) {
    floats all;
    memcpy(&all, values, sizeof all);
    return all;
}

static uint32_t children_near(const ss_bvh_node *node, const float below[3], const float above[3]) {
    ints bits = {0};
    for (int i = 0; i < SS_BVH_WIDTH; i += 4) {
        ints touched = {1 << i, 2 << i, 4 << i, 8 << i};
        for (int k = 0; k < 3; k++) {
            touched &= (four(node->low[k] + i) <= above[k]) & (four(node->high[k] + i) >= below[k]);
        }
        bits |= touched;
    }
    return (uint32_t)(bits[0] | bits[1] | bits[2] | bits[3]) & ((1u << node->count) - 1);
}

static inline floats least(floats a, floats b) {
    const ints less = a < b;
    return (floats)(((ints)a & less) | ((ints)b & ~less));
}

static inline floats most(floats a, floats b) {
    const ints less = a < b;
    return (floats)(((ints)b & less) | ((ints)a & ~less));
}

/* Slots that triangle_near() may find near, by floats that were rounded outwards. */
static uint32_t slots_near(const ss_bvh_leaf *leaf, const float below[3], const float above[3]) {
    ints bits = {0};
    for (int i = 0; i < SS_BVH_WIDTH; i += 4) {
        ints touched = {1 << i, 2 << i, 4 << i, 8 << i};
        for (int k = 0; k < 3; k++) {
            const floats a = four(leaf->corner[0][k] + i), b = four(leaf->corner[1][k] + i),
                         c = four(leaf->corner[2][k] + i);
            touched &= (least(a, least(b, c)) <= above[k]) & (most(a, most(b, c)) >= below[k]);
        }
        bits |= touched;
    }
    return (uint32_t)(bits[0] | bits[1] | bits[2] | bits[3]) & ((1u << leaf->count) - 1);
}

static bool triangle_near(const ss_bvh_leaf *leaf, uint32_t slot, const double from[3],
                          const double to[3], double radius) {
    for (int k = 0; k < 3; k++) {
        const float a = leaf->corner[0][k][slot], b = leaf->corner[1][k][slot],
                    c = leaf->corner[2][k][slot];
        const double low = fminf(a, fminf(b, c)), high = fmaxf(a, fmaxf(b, c));
        if (low - to[k] > radius || from[k] - high > radius) return false;
    }
    return true;
}

static int ascending(const void *a, const void *b) {
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* Keeps the `room` smallest, as a heap with the largest of them at the root: the list is cut, never
 * chosen by the order of the walk. */
static void keep(uint32_t *heap, size_t room, size_t *stored, uint32_t triangle) {
    if (*stored < room) {
        size_t at = (*stored)++;
        for (; at > 0 && heap[(at - 1) / 2] < triangle; at = (at - 1) / 2)
            heap[at] = heap[(at - 1) / 2];
        heap[at] = triangle;
        return;
    }
    if (room == 0 || triangle > heap[0]) return;
    size_t at = 0;
    for (size_t child = 1; child < room; child = 2 * at + 1) {
        if (child + 1 < room && heap[child + 1] > heap[child]) child++;
        if (heap[child] <= triangle) break;
        heap[at] = heap[child], at = child;
    }
    heap[at] = triangle;
}

/* A ball about a point, and its box: a float outwards, so that no rounding there drops what
 * triangle_near() would keep. */
typedef struct ball {
    const double *p;
    double radius;
    float below[3], above[3];
} ball;

/* The inner children of a node that come near, that with the lowest triangle last. */
static size_t push_by_least(const ss_bvh *bvh, const ss_bvh_node *node, uint32_t near,
                            uint32_t *stack) {
    size_t count = 0;
    for (uint32_t m = near; m; m &= m - 1) {
        const uint32_t child = node->child[__builtin_ctz(m)];
        if (child & SS_BVH_LEAF) continue;
        const uint32_t least = bvh->nodes[child].least;
        size_t at = count++;
        for (; at > 0 && bvh->nodes[stack[at - 1]].least < least; at--) stack[at] = stack[at - 1];
        stack[at] = child;
    }
    return count;
}

/* The `room` lowest of more than that, without looking at each: of a million faces in one place. */
static size_t lowest_near(const ss_bvh *bvh, const ball *b, uint32_t *triangles, size_t room) {
    uint32_t stack[SS_BVH_STACK];
    size_t depth = 0, stored = 0;
    stack[depth++] = 0;
    while (depth && room) {
        const ss_bvh_node *node = &bvh->nodes[stack[--depth]];
        if (stored == room && node->least > triangles[0]) continue;
        const uint32_t near = children_near(node, b->below, b->above);
        depth += push_by_least(bvh, node, near, stack + depth);
        for (uint32_t m = near; m; m &= m - 1) {
            const uint32_t child = node->child[__builtin_ctz(m)];
            if (!(child & SS_BVH_LEAF)) continue;
            const ss_bvh_leaf *leaf = &bvh->leaves[child & ~SS_BVH_LEAF];
            for (uint32_t t = slots_near(leaf, b->below, b->above); t; t &= t - 1) {
                const uint32_t s = (uint32_t)__builtin_ctz(t);
                if (!triangle_near(leaf, s, b->p, b->p, b->radius)) continue;
                keep(triangles, room, &stored, leaf->triangle[s]);
            }
        }
    }
    return stored;
}

/* Stops at more than room. */
static size_t walk_near(const ss_bvh *bvh, const ball *b, uint32_t *triangles, size_t room) {
    uint32_t stack[SS_BVH_STACK];
    size_t depth = 0, found = 0;
    stack[depth++] = 0;
    while (depth) {
        const ss_bvh_node *node = &bvh->nodes[stack[--depth]];
        for (uint32_t m = children_near(node, b->below, b->above); m; m &= m - 1) {
            const uint32_t child = node->child[__builtin_ctz(m)];
            if (!(child & SS_BVH_LEAF)) {
                stack[depth++] = child;
                continue;
            }
            const ss_bvh_leaf *leaf = &bvh->leaves[child & ~SS_BVH_LEAF];
            for (uint32_t t = slots_near(leaf, b->below, b->above); t; t &= t - 1) {
                const uint32_t s = (uint32_t)__builtin_ctz(t);
                if (!triangle_near(leaf, s, b->p, b->p, b->radius)) continue;
                if (found == room) return room + 1;
                triangles[found++] = leaf->triangle[s];
            }
        }
    }
    return found;
}

size_t ss_bvh_near(const ss_bvh *bvh, const double p[3], double radius, uint32_t *triangles,
                   size_t room) {
    ball b = {.p = p, .radius = radius};
    for (int k = 0; k < 3; k++) {
        b.below[k] = nextafterf((float)(p[k] - radius), -INFINITY);
        b.above[k] = nextafterf((float)(p[k] + radius), INFINITY);
    }
    const size_t found = walk_near(bvh, &b, triangles, room);
    const size_t stored = found > room ? lowest_near(bvh, &b, triangles, room) : found;
    if (stored > 1) qsort(triangles, stored, sizeof *triangles, ascending);
    return found;
}

size_t ss_bvh_near_box(const ss_bvh *bvh, const double low[3], const double high[3], double radius,
                       uint32_t *triangles, size_t room) {
    uint32_t stack[SS_BVH_STACK];
    size_t depth = 0, found = 0;
    float below[3], above[3];
    for (int k = 0; k < 3; k++) {
        below[k] = nextafterf((float)(low[k] - radius), -INFINITY);
        above[k] = nextafterf((float)(high[k] + radius), INFINITY);
    }
    stack[depth++] = 0;
    while (depth) {
        const ss_bvh_node *node = &bvh->nodes[stack[--depth]];
        for (uint32_t m = children_near(node, below, above); m; m &= m - 1) {
            const uint32_t child = node->child[__builtin_ctz(m)];
            if (!(child & SS_BVH_LEAF)) {
                stack[depth++] = child;
                continue;
            }
            const ss_bvh_leaf *leaf = &bvh->leaves[child & ~SS_BVH_LEAF];
            for (uint32_t t = slots_near(leaf, below, above); t; t &= t - 1) {
                const uint32_t s = (uint32_t)__builtin_ctz(t);
                if (!triangle_near(leaf, s, low, high, radius)) continue;
                if (found == room) return room + 1;
                triangles[found++] = leaf->triangle[s];
            }
        }
    }
    return found;
}

/* ---- empty shafts ------------------------------------------------------------------------------*/

static uint32_t children_inside(const ss_bvh_node *node, const ss_shaft *shaft) {
    uint32_t mask = (1u << node->count) - 1;
    for (int k = 0; k < 3; k++) {
        uint32_t touched = 0;
        for (int i = 0; i < SS_BVH_WIDTH; i++) {
            touched |= (uint32_t)(node->low[k][i] <= shaft->high[k] &&
                                  node->high[k][i] >= shaft->low[k])
                       << i;
        }
        mask &= touched;
    }
    for (unsigned p = 0; p < shaft->planes && mask; p++) {
        const float *n = shaft->normal[p];
        const float *x = n[0] > 0 ? node->low[0] : node->high[0],
                    *y = n[1] > 0 ? node->low[1] : node->high[1],
                    *z = n[2] > 0 ? node->low[2] : node->high[2];
        uint32_t outside = 0;
        for (int i = 0; i < SS_BVH_WIDTH; i++) {
            outside |= (uint32_t)(n[0] * x[i] + n[1] * y[i] + n[2] * z[i] > shaft->limit[p]) << i;
        }
        mask &= ~outside;
    }
    return mask;
}

static bool triangle_outside(const ss_bvh_leaf *leaf, uint32_t slot, const ss_shaft *shaft) {
    for (int k = 0; k < 3; k++) {
        const float a = leaf->corner[0][k][slot], b = leaf->corner[1][k][slot],
                    c = leaf->corner[2][k][slot];
        if (fminf(a, fminf(b, c)) > shaft->high[k] || fmaxf(a, fmaxf(b, c)) < shaft->low[k]) {
            return true;
        }
    }
    for (unsigned p = 0; p < shaft->planes; p++) {
        bool all = true;
        for (int c = 0; c < 3; c++) {
            const float height = shaft->normal[p][0] * leaf->corner[c][0][slot] +
                                 shaft->normal[p][1] * leaf->corner[c][1][slot] +
                                 shaft->normal[p][2] * leaf->corner[c][2][slot];
            all = all && height > shaft->limit[p];
        }
        if (all) return true;
    }
    return false;
}

size_t ss_bvh_shaft(const ss_bvh *bvh, const ss_light *light, const double low[3],
                    const double high[3], uint32_t *triangles, size_t room) {
    ss_shaft shaft;
    ss_shaft_make(&shaft, light, bvh->world->extent, low, high);
    uint32_t stack[SS_BVH_STACK];
    size_t depth = 0, found = 0;
    stack[depth++] = 0;
    while (depth) {
        const ss_bvh_node *node = &bvh->nodes[stack[--depth]];
        for (uint32_t m = children_inside(node, &shaft); m; m &= m - 1) {
            const uint32_t child = node->child[__builtin_ctz(m)];
            if (!(child & SS_BVH_LEAF)) {
                stack[depth++] = child;
                continue;
            }
            const ss_bvh_leaf *leaf = &bvh->leaves[child & ~SS_BVH_LEAF];
            for (uint32_t s = 0; s < leaf->count; s++) {
                if (triangle_outside(leaf, s, &shaft)) continue;
                if (found == room) return room + 1;
                triangles[found++] = leaf->triangle[s];
            }
        }
    }
    return found;
}

bool ss_bvh_shaft_empty(const ss_bvh *bvh, const ss_light *light, const double low[3],
                        const double high[3]) {
    return ss_bvh_shaft(bvh, light, low, high, NULL, 0) == 0;
}
