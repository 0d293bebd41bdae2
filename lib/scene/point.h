/* A point to answer. */
#ifndef SS_SCENE_POINT_H
#define SS_SCENE_POINT_H

#include <stdint.h>

/* In local coordinates (scene.h). The engine has checked that it is finite. */
typedef struct ss_point {
    double p[3];
    float normal[3];   /* unit, or 0 0 0 */
    float ulp;         /* spacing of the given position's numbers relative to their size: 2^-23 or
                          2^-52; 0 where the primitive is known. A face within 4 ulp at the largest
                          coordinate of face and point counts as touched */
    uint32_t triangle; /* the world triangle it lies on, SS_NO_TRIANGLE: not known or casts nothing */
    uint32_t place;    /* where its answer goes in the caller's batch */
} ss_point;

/* Points of which nothing is asked but where they are, a block of at most SS_PLACES at a time;
 * after the last it stands again up to a whole eight. */
#define SS_PLACES 256
typedef struct ss_places {
    _Alignas(64) double at[3][SS_PLACES]; /* local */
} ss_places;

#endif
