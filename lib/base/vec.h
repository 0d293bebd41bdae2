/* Three numbers. */
#ifndef SS_BASE_VEC_H
#define SS_BASE_VEC_H

#include <math.h>
#include <stdbool.h>

static inline double ss_dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
static inline void ss_cross(const double a[3], const double b[3], double out[3]) {
    const double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2],
                 z = a[0] * b[1] - a[1] * b[0];
    out[0] = x, out[1] = y, out[2] = z;
}
static inline void ss_sub(const double a[3], const double b[3], double out[3]) {
    for (int k = 0; k < 3; k++) out[k] = a[k] - b[k];
}
static inline void ss_add_scaled(const double a[3], double s, const double b[3], double out[3]) {
    for (int k = 0; k < 3; k++) out[k] = a[k] + s * b[k];
}
/* Length without overflow or underflow for any finite vector. */
static inline double ss_length(const double a[3]) { return hypot(hypot(a[0], a[1]), a[2]); }
static inline bool ss_normalize(double a[3]) {
    const double length = ss_length(a);
    if (!(length > 0) || isinf(length)) return false;
    for (int k = 0; k < 3; k++) a[k] /= length;
    return true;
}
static inline bool ss_finite3(const double a[3]) {
    return isfinite(a[0]) && isfinite(a[1]) && isfinite(a[2]);
}

#endif
