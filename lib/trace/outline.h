/* The outlines of the BVH's subtrees. Seen from where all faces of a subtree show the same side,
 * its inner edges cancel and only its boundary edges are left: a few hundred edges then stand for
 * tens of thousands of triangles, and where subtrees meet, their boundaries cancel in turn. */
#ifndef SS_TRACE_OUTLINE_H
#define SS_TRACE_OUTLINE_H

#include "scene/connectivity.h"
#include "scene/light.h"
#include "trace/bvh_node.h"

#define SS_NO_USE UINT32_MAX /* of a triangle without area */

/* What a face's side may be misjudged by in float arithmetic, in local units: more than the
 * rounding of its corners, of a point and of the sums, all within [-1, 1]. */
#define SS_SIDE_ERROR 0x1p-18f

/* For each child of the BVH node of the same index. A face's plane is n . (x - middle) = offset,
 * with n the unit normal of its winding; the ranges hold for all faces below. */
typedef struct ss_outline_node {
    float middle[3][SS_BVH_WIDTH];
    float normal_low[3][SS_BVH_WIDTH], normal_high[3][SS_BVH_WIDTH];
    float offset_low[SS_BVH_WIDTH], offset_high[SS_BVH_WIDTH];
    /* All normals n have n . axis >= cosine; cosine <= 0: no cone. */
    float axis[3][SS_BVH_WIDTH], cosine[SS_BVH_WIDTH], sine[SS_BVH_WIDTH];
    uint32_t first[SS_BVH_WIDTH], count[SS_BVH_WIDTH]; /* boundary uses */
    uint32_t whole; /* a bit for each child whose boundary may stand for it, and is worth it */
    /* Bits for children all of whose faces need not be drawn where they show their front, or back:
     * that of a solid is left to others, or all of the light is on that side, too. */
    uint16_t drop_front, drop_back;
    uint32_t unused[14];
} ss_outline_node;

/* Of a solid, a closed surface with the light outside, one kind of faces is enough: those that
 * face away from the point. A segment that is inside must leave through one, whether the point is
 * outside, on or in the solid. */
enum { SS_DRAW_BOTH = 0, SS_DROP_FRONT, SS_DROP_BACK };

/* A use is edge << 1 | against: against is 1 where the face runs from the edge's end to its start.
 */
typedef struct ss_outline {
    ss_outline_node *nodes;
    uint32_t (*leaf_uses)[3][SS_BVH_WIDTH]; /* for each leaf, [edge of face][slot] */
    uint16_t (
        *leaf_drop)[2]; /* for each leaf, slots not to be drawn that show their front, or back */
    uint32_t *uses;
    float (*ends)[8]; /* for each edge: start x y z, 0, end x y z, 0 */
    uint32_t edge_count, use_count, use_room, node_count, leaf_count;
} ss_outline;

/* tested: per world triangle, those that no outline may stand for; NULL: none. */
softshadow_status ss_outline_build(ss_outline **out, const ss_bvh *bvh, const ss_topology *topology,
                                   const uint8_t *tested, const ss_light *light, ss_pool *pool);
void ss_outline_destroy(ss_outline *outline);
size_t ss_outline_bytes(const ss_outline *outline);

#endif
