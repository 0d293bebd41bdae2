/* Signs that are never wrong. Coordinates are finite, below 1e300, and the exponents of all that is
 * not zero in one call lie within 600 of each other (a scene's within +-1e15 and above 1e-165 do).
 */
#ifndef SS_BASE_PREDICATE_H
#define SS_BASE_PREDICATE_H

#include <math.h>
#include <stdbool.h>

#include "base/vec.h"

/* The sign (-1, 0, 1) of (b - a) x (c - a) . (d - a): 1 where d is on the side of the plane a b c
 * from which a, b, c run counter-clockwise. */
int ss_orient3d(const double a[3], const double b[3], const double c[3], const double d[3]);
/* The same for a direction: the sign of (b - a) x (c - a) . d. */
int ss_orient3d_towards(const double a[3], const double b[3], const double c[3], const double d[3]);
/* Do the three lie on one line (or two of them in one place)? */
bool ss_collinear(const double a[3], const double b[3], const double c[3]);

/* Rounding errors of d . (a x b), with room: seven of the sum of its products' sizes, of which
 * there are two for each number of d. */
static inline double ss_side_limit(double size, const double d[3]) {
    const double products = size * size * (fabs(d[0]) + fabs(d[1]) + fabs(d[2]));
    return products > 1e-280 ? 0x1p-49 * products : INFINITY; /* else they may have underflowed */
}

double ss_side_exact(const double d[3], const double a[3], const double b[3], double rounded);

/* d . (a x b): on which side of the edge a b the segment from the origin along d passes, with a
 * sign that is never wrong: whatever faces share edges and corners, no segment passes between them.
 * Rounding alone keeps neighbours from disagreeing about an edge, but not the faces around a
 * corner.
 *   limit  ss_side_limit() of the largest number in a and b */
static inline double ss_side(const double d[3], const double a[3], const double b[3],
                             double limit) {
    double moment[3];
    ss_cross(a, b, moment);
    const double side = ss_dot(d, moment);
    return fabs(side) > limit ? side : ss_side_exact(d, a, b, side);
}

#endif
