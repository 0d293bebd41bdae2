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

/* extent: the largest |coordinate| of what will be tested. */
void ss_shaft_make(ss_shaft *shaft, const ss_light *light, double extent, const double low[3],
                   const double high[3]);

/* The same for some points, more tightly than for the box around them, which it gives. */
void ss_shaft_around(ss_shaft *shaft, const ss_light *light, double extent,
                     const double (*points)[3], size_t count, double low[3], double high[3]);

/* The largest normal . x of the light as seen from anywhere in the box, -INFINITY where it recedes
 * to infinity that way, INFINITY where it grows to it. */
double ss_light_support(const ss_light *light, const double low[3], const double high[3],
                        const double normal[3]);

#endif
