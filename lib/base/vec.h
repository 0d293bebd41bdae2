/* Three numbers. */
#ifndef SS_BASE_VEC_H
#define SS_BASE_VEC_H

#include <math.h>
#include <stdbool.h>

/* One instruction each, where fmin() and fmax() are calls. b where one is NaN. */
static inline double ss_min(double a, double b) { return a < b ? a : b; }
static inline double ss_max(double a, double b) { return a > b ? a : b; }
/* Three terms added smallest first: the sum does not depend on their order, so that permuting the
 * axes of a scene permutes its results bit for bit. */
static inline double ss_sum3(double x, double y, double z) {
    const double low = ss_min(x, y), high = ss_max(x, y);
    return (ss_min(low, z) + ss_max(low, ss_min(high, z))) + ss_max(high, z);
}
static inline double ss_dot(const double a[3], const double b[3]) {
    return ss_sum3(a[0] * b[0], a[1] * b[1], a[2] * b[2]);
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
/* The power of two that brings a to a size whose square neither overflows nor underflows; 0 for no
 * direction (zero, infinite, NaN). Mostly 1, which costs nothing. */
static inline double ss_safe_scale(const double a[3]) {
    const double most = ss_max(fabs(a[0]), ss_max(fabs(a[1]), fabs(a[2])));
    if (most > 0x1p-400 && most < 0x1p+400) return 1;
    if (!(most > 0) || isinf(most)) return 0;
    return most < 1 ? 0x1p+600 : 0x1p-600;
}
/* Of (x, y). Not hypot, which takes care of numbers near the largest and the smallest there are. */
static inline double ss_length_2(double x, double y) { return sqrt(x * x + y * y); }

static inline double ss_length(const double a[3]) {
    const double scale = ss_safe_scale(a);
    if (scale == 0) return fmax(fabs(a[0]), fmax(fabs(a[1]), fabs(a[2])));
    const double b[3] = {a[0] * scale, a[1] * scale, a[2] * scale};
    return sqrt(ss_dot(b, b)) / scale;
}
/* Makes a unit vector; false (and a unchanged) for a vector of no direction. */
static inline bool ss_normalize(double a[3]) {
    const double scale = ss_safe_scale(a);
    if (scale == 0 || isnan(a[0] + a[1] + a[2])) return false;
    const double b[3] = {a[0] * scale, a[1] * scale, a[2] * scale};
    const double length = sqrt(ss_dot(b, b));
    for (int k = 0; k < 3; k++) a[k] = b[k] / length;
    return true;
}
static inline bool ss_finite3(const double a[3]) {
    return isfinite(a[0]) && isfinite(a[1]) && isfinite(a[2]);
}

#endif
