/* Silhouettes: the edges where what a light sees of the casters ends.
 *
 * Every face has ONE sign as seen from the eye: 1 front, -1 back, exactly edge-on counts as back.
 * An edge is a silhouette when the sum over its uses of (sign of the face) x (direction of the use)
 * is not zero. Where the uses balance (a closed surface) that is twice the signed sum of the uses
 * by light-facing faces, so "not zero" means the same; where they do not, a sheet that turns its
 * back to the light counts as well, because it casts as well. One rule for boundary, manifold,
 * complex and flipped edges, and the silhouettes always close to loops: at every vertex as many
 * edges enter as leave, counted with their multiplicity. */
#ifndef SS_SILHOUETTE_SILHOUETTE_H
#define SS_SILHOUETTE_SILHOUETTE_H

#include "base/parallel.h"
#include "scene/connectivity.h"
#include "scene/scene.h"

/* Where the light's centre is, in local coordinates: a place (w = 1) or a direction towards it (w =
 * 0). */
typedef struct ss_eye {
    double place[3];
    int w;
} ss_eye;
ss_eye ss_eye_of(const ss_light *light);

/* From vertex[0] to vertex[1] (welded) the occluder lies on the left as the eye sees it, counted
 * `count` > 0 times; a fold of a closed surface counts 2, a free border 1. */
typedef struct ss_silhouette_edge {
    uint32_t vertex[2];
    uint32_t edge;  /* of the topology */
    uint32_t count;
} ss_silhouette_edge;

typedef struct ss_silhouette {
    ss_silhouette_edge *edges; /* in an order that depends on the scene only */
    size_t count;
} ss_silhouette;

/* What makes finding silhouettes fast: edges in clusters, and clusters of clusters, each with a
 * sphere around it and a cone around its faces' normals. Depends on the geometry only. */
typedef struct ss_silhouette_tree ss_silhouette_tree;

softshadow_status ss_silhouette_tree_build(ss_silhouette_tree **out, const ss_world *world,
                                           const ss_topology *topology, ss_pool *pool);
void ss_silhouette_tree_destroy(ss_silhouette_tree *tree);
size_t ss_silhouette_tree_bytes(const ss_silhouette_tree *tree);

softshadow_status ss_silhouette_find(ss_silhouette *out, const ss_silhouette_tree *tree,
                                     const ss_world *world, const ss_topology *topology,
                                     const ss_eye *eye, ss_pool *pool);
void ss_silhouette_free(ss_silhouette *silhouette);

/* How many edges a walk from this eye looks at one by one. */
size_t ss_silhouette_tested(const ss_silhouette_tree *tree, const ss_eye *eye);

/* The sign of one face, exactly: 1 or -1. */
int ss_silhouette_sign(const ss_world *world, uint32_t triangle, const ss_eye *eye);

#endif
