/* The shaft between a box of points and a light: planes and a box around everything that could be
 * between them. What is outside any plane, or outside the box, is not between; that is certain, in
 * float arithmetic too, because every plane was moved out by its rounding error. */
#ifndef SS_TRACE_SHAFT_H
#define SS_TRACE_SHAFT_H

#include <stddef.h>

#include "scene/light.h"

#define SS_SHAFT_PLANES 6

typedef struct ss_shaft {
    unsigned planes; /* 0: no plane is known */
    float normal[SS_SHAFT_PLANES][3];
    float limit[SS_SHAFT_PLANES]; /* outside: normal . x > limit */
    float low[3], high[3];        /* may be infinite */
} ss_shaft;

/* What the shafts of boxes near each other share: made for a box, right for every box inside it. */
typedef struct ss_shaft_frame {
    double low[3], high[3];
    double axis[3], side[2][3]; /* towards the light, and unit vectors across; axis 0 0 0: none */
    double depth, disk;         /* from the box to the light; widest facing disk of a sphere */
    double light_low[3], light_high[3];
} ss_shaft_frame;
void ss_shaft_frame_make(ss_shaft_frame *frame, const ss_light *light, const double low[3],
                         const double high[3]);

/* The shaft from a box, or more tightly from `count` points in it (at: their x, y, z; NULL: all of
 * the box), within the frame's. extent: the largest |coordinate| of what will be tested. */
void ss_shaft_in_frame(ss_shaft *shaft, const ss_shaft_frame *frame, const ss_light *light,
                       double extent, const double low[3], const double high[3],
                       const double *const at[3], size_t count);

/* Without a frame made before. */
void ss_shaft_make(ss_shaft *shaft, const ss_light *light, double extent, const double low[3],
                   const double high[3]);

/* The largest normal . x of the light as seen from anywhere in the box, -INFINITY where it recedes
 * to infinity that way, INFINITY where it grows to it. */
double ss_light_support(const ss_light *light, const double low[3], const double high[3],
                        const double normal[3]);

#endif
