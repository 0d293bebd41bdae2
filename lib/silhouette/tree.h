/* The hierarchy over balanced edges; see tree.c. */
#ifndef SS_SILHOUETTE_TREE_H
#define SS_SILHOUETTE_TREE_H

#include "silhouette/silhouette.h"

#define SS_SILHOUETTE_LEAF 16 /* edges of a leaf */
#define SS_SILHOUETTE_FAN 8   /* children of a node */
#define SS_SILHOUETTE_LEVELS 12

/* A sphere that holds the edges, and a cone that holds the unit normals of their faces. */
typedef struct ss_silhouette_node {
    float centre[3], radius;
    float axis[3];
    float angle; /* half the cone's opening, radians; above pi/2: tells nothing */
    float cosine, sine; /* of the angle */
} ss_silhouette_node;

/* A face's plane: what is at x lies before it where normal . x > offset. */
typedef struct ss_silhouette_plane {
    float normal[3]; /* unit, or 0 0 0 where the face is too thin to have one */
    float offset;
} ss_silhouette_plane;

struct ss_silhouette_tree {
    ss_silhouette_plane *planes; /* of all triangles, good to a few units in the last place */
    size_t triangle_count;
    uint32_t *balanced; /* edges whose uses cancel, in the order of the leaves */
    uint32_t (*faces)[2]; /* their two faces, so that most walks never touch the edge table; the one
                             used in the edge's own direction first; SS_NO_TRIANGLE: more than two */
    size_t balanced_count;
    uint32_t *free_edges; /* the others: silhouettes wherever the eye is, or nearly so */
    size_t free_count;
    uint32_t levels; /* node[0] are the leaves; 0 when there are none */
    size_t count[SS_SILHOUETTE_LEVELS];
    ss_silhouette_node *node[SS_SILHOUETTE_LEVELS];
};

#endif
