/* A point to answer. */
#ifndef SS_SCENE_POINT_H
#define SS_SCENE_POINT_H

#include <stdint.h>

/* In local coordinates (scene.h). The engine has checked that it is finite. */
typedef struct ss_point {
    double p[3];
    float normal[3];   /* unit, or 0 0 0 */
    float contact;     /* a face this near (local units) counts as touched; 0 with a primitive */
    uint32_t triangle; /* the world triangle it lies on, SS_NO_TRIANGLE: not known or casts nothing */
    uint32_t place;    /* where its answer goes in the caller's batch */
} ss_point;

#endif
