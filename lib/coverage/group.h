/* What hides the light from a group of nearby points: everything between them and the light is
 * found by one walk through the BVH and drawn, from each point, onto that point's own view of the
 * light.
 *
 * A point's view is a projective map: for a caster's vertex X the three numbers
 *     h = matrix X + shift
 * are grid x times t, grid y times t, and t: how far along the segments from the point (0) to the
 * light (1; sun: any length) X lies. Rect, disk, sphere and sun differ in nothing else. */
#ifndef SS_COVERAGE_GROUP_H
#define SS_COVERAGE_GROUP_H

#include "coverage/lattice.h"
#include "scene/levels.h"
#include "trace/bvh.h"
#include "trace/outline.h"
#include "trace/shaft.h"

#define SS_LANES 16
/* An outline's edges are summed in slots found by hashing: few enough for the caches, and so few of
 * them in use that they seldom collide. Bit-planes count to SS_GROUP_USES. */
#define SS_GROUP_SLOT_BITS  13
#define SS_GROUP_SLOTS      (1u << SS_GROUP_SLOT_BITS)
#define SS_GROUP_LIST       3072
#define SS_GROUP_PLANES     13
#define SS_GROUP_USES       ((1u << SS_GROUP_PLANES) - 1)
#define SS_NO_KEY           UINT32_MAX
#define SS_GROUP_WALK_BYTES 32768 /* scratch of a kernel */
/* Floats reach this near a point's own plane, and the light's, in local units: above the rounding
 * of t for vertices in [-1, 1], below SS_NEAR, so that faces at the point are contact's
 * business. */
#define SS_FLOAT_REACH 0x1p-20

/* A stretch of t, and the scene that stands for the casters there. It begins at t_near, lane by
 * lane: what is nearer is cut off, as a surface would else shadow points on itself. It may go on
 * for longer than it has to: what two slabs draw is hidden once. */
typedef struct ss_slab {
    _Alignas(64) float t_near[SS_LANES], t_far[SS_LANES]; /* casters count between them */
    float t_safe, t_beyond; /* between them nothing is clipped or too near to any lane */
    float t_floor;          /* what lies wholly below it is out of every lane's slab */
    float t_until, t_again; /* what lies wholly between them is left to coarser slabs */
    const ss_bvh *bvh;
    const ss_outline *outline;
    uint32_t skip_count; /* of the group's skipped triangles: none is in a coarser scene */
} ss_slab;

#define SS_SLABS_MOST (SS_LEVELS_MOST + 1)

typedef struct ss_group {
    _Alignas(
        64) float matrix[3][3][SS_LANES]; /* [row][k]: row . X = sum of matrix[row][k] X[axis[k]] */
    float shift[3][SS_LANES];
    float t_near[SS_LANES], t_far[SS_LANES]; /* casters count between them */
    uint32_t lanes;                          /* a bit for every lane that is asked */
    uint8_t axis[3];          /* the order in which axes are summed: see ss_axis_order() */
    _Alignas(64) float apart[3][SS_LANES]; /* points, in the world's axes, from `middle` on */
    ss_shaft shaft;           /* around all lanes asked */
    float middle[3], half[3]; /* a box around them, with room for rounding */
    /* For all lanes, t of a vertex X is within t_least..t_most + t_axis . Y +- t_spread . |Y|, with
     * Y = X - middle. Between t_safe and t_beyond nothing is clipped or too near to any of them. */
    float t_axis[3], t_spread[3], t_least, t_most, t_safe, t_beyond;
    ss_slab slabs[SS_SLABS_MOST]; /* [0]: the casters themselves; then coarser ones, drawn first */
    uint32_t slab_count;
    const ss_slab *slab; /* the one being drawn */
    const ss_bvh *bvh;   /* of the casters */
    const ss_outline *outline;
    const ss_lattice *lattice;
    const uint8_t *tested; /* per world triangle: opacity-tested, or NULL if none is */

    /* Triangles that a lane must not see: found elsewhere. */
    const uint32_t *skip;
    const uint16_t *skip_lanes;
    uint32_t skip_count;
    /* Look first whether what the points lie behind covers all of the light: spares lanes that see
     * nothing the walk. No answer shows it, but where a coarser scene's solids differ. */
    bool fronts_first;

    /* Out. Opacity-tested triangles in the way are not drawn but listed, as far as there is room.
     */
    uint32_t *covered;          /* [lane][samples->blocks x 16] */
    uint32_t lit, dark;         /* lanes that see all of the light's samples, or none */
    uint64_t visible[SS_LANES]; /* weight of the samples seen by the others */
    uint32_t rough[SS_LANES];   /* and the neighbours of which one is seen, within a block */
    uint32_t *listed;
    uint32_t listed_count, listed_room;

    /* If not NULL, two more masks come out for each lane: the cells of the lattice that an edge
     * passes through, and those from whose middle it is at most SS_LATTICE_REACH cells away. Edges
     * that reach beyond t = blur_from are taken to be `blur` cells wider on either side. */
    uint32_t *marks; /* [lane][tight, wide][blocks x 16] */
    float blur_from, blur;

    /* The kernel's own: [lane][block][up, down][plane] x 16, all 0 between calls; the slots' keys,
     * edge
     * << 1 | side of the faces, all SS_NO_KEY between calls; their sums; the slots in use, and one.
     */
    uint32_t nodes, leaves, edges; /* looked at by draw() */
    uint32_t *planes, *keys;
    int16_t *sums;
    uint16_t *list;
    void *walk; /* SS_GROUP_WALK_BYTES */
    uint32_t list_count;
} ss_group;

/* Points, and the light as they see it, with the axes of all but `at` in summing order. */
typedef struct ss_group_views {
    _Alignas(64) double at[3][SS_LANES]; /* in the world's axes; lanes without a point copy another */
    /* s t, t t and t of p + t (c + s a + t b): the inverse of (a, b, c), but for spheres, where a
     * and b are orthogonal to c and these are a / a^2, b / b^2, c / c^2. */
    double row[3][3][SS_LANES];
    double t_end[SS_LANES];
    uint32_t inside, edge_on; /* lanes: as in ss_view */
} ss_group_views;

typedef struct ss_group_kernel {
    /* Fills the maps of all lanes and the rest of the views; group->lanes becomes those for which
     * floats will do: the light is not inside, edge-on or too near. The light's axes are turned. */
    void (*view)(ss_group *group, const ss_light *light, ss_group_views *views);
    /* The range of t over group->lanes. reach: how far from its point a face to be skipped can be.
     */
    void (*depths)(ss_group *group, double reach);
    /* Fills covered, lit, dark and visible for the lanes asked. */
    void (*draw)(ss_group *group);
    /* How long draw() would take, in nanoseconds of a common machine, if nothing was ever hidden;
     * gives up at `most`. Looks at nodes of the tree only. */
    uint32_t (*weigh)(ss_group *group, uint32_t most);
    /* Lists the triangles, opacity-tested or not, that may be in the way of some point of the box;
     * may stop when there is no more room. Reads no lane. */
    void (*survey)(ss_group *group);
} ss_group_kernel;
/* Likewise what the last draw() took. Fitted to groups on 871,000 and a million triangles without
 * levels: a leaf 740 to 1,160 with its faces, a use of an edge 12 to 26; eight in ten groups take
 * .8 to 1.2 times that. */
static inline uint32_t ss_group_took(const ss_group *group) {
    return 100 * group->nodes + 800 * group->leaves + 20 * group->edges;
}
extern const ss_group_kernel ss_group_scalar, ss_group_avx2, ss_group_avx512;
/* The one for this machine and SOFTSHADOW_CPU; all give the same bits. */
const ss_group_kernel *ss_group_kernels_here(void);

static inline uint32_t *ss_group_marks(const ss_group *group, unsigned lane) {
    return group->marks + 2 * (size_t)lane * group->lattice->blocks * SS_BLOCK;
}

static inline uint32_t *ss_group_mask(const ss_group *group, unsigned lane) {
    return group->covered + (size_t)lane * group->lattice->blocks * SS_BLOCK;
}

#endif
