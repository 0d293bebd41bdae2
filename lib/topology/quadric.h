/* Sums of squared distances to planes, as polynomials of the point.
 * based on: M. Garland, P. S. Heckbert, "Surface Simplification Using Quadric Error Metrics" */
#ifndef SS_TOPOLOGY_QUADRIC_H
#define SS_TOPOLOGY_QUADRIC_H

#include "base/vec.h"

/* x' A x + 2 b x + c, A symmetric: xx xy xz yy yz zz. */
typedef struct ss_quadric {
    double a[6], b[3], c;
} ss_quadric;

/* Adds weight times the squared distance to the plane through p with unit normal n. */
static inline void ss_quadric_add_plane(ss_quadric *q, const double n[3], const double p[3],
                                        double weight) {
    const double d = -ss_dot(n, p);
    q->a[0] += weight * n[0] * n[0], q->a[1] += weight * n[0] * n[1];
    q->a[2] += weight * n[0] * n[2], q->a[3] += weight * n[1] * n[1];
    q->a[4] += weight * n[1] * n[2], q->a[5] += weight * n[2] * n[2];
    for (int k = 0; k < 3; k++) q->b[k] += weight * d * n[k];
    q->c += weight * d * d;
}

static inline void ss_quadric_add(ss_quadric *q, const ss_quadric *other) {
    for (int i = 0; i < 6; i++) q->a[i] += other->a[i];
    for (int k = 0; k < 3; k++) q->b[k] += other->b[k];
    q->c += other->c;
}

/* A x + b, half the gradient. */
static inline void ss_quadric_slope(const ss_quadric *q, const double x[3], double out[3]) {
    out[0] = q->a[0] * x[0] + q->a[1] * x[1] + q->a[2] * x[2] + q->b[0];
    out[1] = q->a[1] * x[0] + q->a[3] * x[1] + q->a[4] * x[2] + q->b[1];
    out[2] = q->a[2] * x[0] + q->a[4] * x[1] + q->a[5] * x[2] + q->b[2];
}

static inline double ss_quadric_at(const ss_quadric *q, const double x[3]) {
    double slope[3];
    ss_quadric_slope(q, x, slope);
    const double value = ss_dot(slope, x) + ss_dot(q->b, x) + q->c;
    return value > 0 ? value : 0; /* a sum of squares, but for rounding */
}

static inline double ss_quadric_trace(const ss_quadric *q) { return q->a[0] + q->a[3] + q->a[5]; }

/* Moves x to the minimum, held back by `pull` > 0 (and so also where planes leave it free). */
static inline void ss_quadric_descend(const ss_quadric *q, double pull, double x[3]) {
    const double xx = q->a[0] + pull, xy = q->a[1], xz = q->a[2], yy = q->a[3] + pull, yz = q->a[4],
                 zz = q->a[5] + pull;
    double g[3];
    ss_quadric_slope(q, x, g);
    const double c0 = yy * zz - yz * yz, c1 = xz * yz - xy * zz, c2 = xy * yz - xz * yy;
    const double determinant = xx * c0 + xy * c1 + xz * c2;
    if (!(determinant > 0)) return;
    const double c3 = xx * zz - xz * xz, c4 = xy * xz - xx * yz, c5 = xx * yy - xy * xy;
    x[0] -= (c0 * g[0] + c1 * g[1] + c2 * g[2]) / determinant;
    x[1] -= (c1 * g[0] + c3 * g[1] + c4 * g[2]) / determinant;
    x[2] -= (c2 * g[0] + c4 * g[1] + c5 * g[2]) / determinant;
}

#endif
