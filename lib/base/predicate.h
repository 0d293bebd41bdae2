/* Signs that are never wrong. Coordinates are finite, below 1e300, and the exponents of all that is
 * not zero in one call lie within 600 of each other (a scene's within +-1e15 and above 1e-165 do).
 */
#ifndef SS_BASE_PREDICATE_H
#define SS_BASE_PREDICATE_H

#include <stdbool.h>

/* The sign (-1, 0, 1) of (b - a) x (c - a) . (d - a): 1 where d is on the side of the plane a b c
 * from which a, b, c run counter-clockwise. */
int ss_orient3d(const double a[3], const double b[3], const double c[3], const double d[3]);
/* The same for a direction: the sign of (b - a) x (c - a) . d. */
int ss_orient3d_towards(const double a[3], const double b[3], const double c[3], const double d[3]);
/* Do the three lie on one line (or two of them in one place)? */
bool ss_collinear(const double a[3], const double b[3], const double c[3]);

#endif
