/* The layout of the wide BVH: what whoever walks it by himself reads. Sixteen children to a node
 * and up to sixteen triangles to a leaf, structure of arrays, so that one vector operation tests
 * them all. */
#ifndef SS_TRACE_BVH_NODE_H
#define SS_TRACE_BVH_NODE_H

#include "trace/bvh.h"

#define SS_BVH_WIDTH 16
#define SS_BVH_LEAF 0x80000000u /* in child[]: the rest is a leaf's index */
#define SS_BVH_DEPTH 100        /* no path from the root is longer */
#define SS_BVH_STACK (SS_BVH_DEPTH * (SS_BVH_WIDTH - 1) + SS_BVH_WIDTH)

typedef struct ss_bvh_node {
    float low[3][SS_BVH_WIDTH], high[3][SS_BVH_WIDTH]; /* [axis][child]; beyond count: inf .. -inf */
    uint32_t child[SS_BVH_WIDTH];
    uint32_t first[SS_BVH_WIDTH], last[SS_BVH_WIDTH]; /* its triangles: order[first .. last-1] */
    uint32_t count, least, unused[14]; /* least: of the world triangles below it */
} ss_bvh_node;

typedef struct ss_bvh_leaf {
    float corner[3][3][SS_BVH_WIDTH]; /* [corner][axis][slot]; beyond count: slot 0 again */
    uint32_t triangle[SS_BVH_WIDTH];
    uint32_t first, count, unused[14];
} ss_bvh_leaf;

struct ss_bvh {
    const ss_world *world;
    ss_bvh_node *nodes; /* nodes[0] is the root, also of an empty world */
    ss_bvh_leaf *leaves;
    uint32_t *order; /* world triangles as the leaves hold them */
    uint32_t node_count, leaf_count;
};

#endif
