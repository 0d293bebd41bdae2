/* vector.h - three doubles. */
#ifndef CLI_RENDER_VECTOR_H
#define CLI_RENDER_VECTOR_H

#include <math.h>

typedef struct vector {
    double x, y, z;
} vector;

static inline vector vector_of(const double *p) { return (vector){p[0], p[1], p[2]}; }
static inline vector vector_add(vector a, vector b) {
    return (vector){a.x + b.x, a.y + b.y, a.z + b.z};
}
static inline vector vector_sub(vector a, vector b) {
    return (vector){a.x - b.x, a.y - b.y, a.z - b.z};
}
static inline vector vector_scale(vector a, double s) {
    return (vector){a.x * s, a.y * s, a.z * s};
}
static inline double vector_dot(vector a, vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline vector vector_cross(vector a, vector b) {
    return (vector){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline double vector_length(vector a) { return sqrt(vector_dot(a, a)); }

/* Of length 1; what has no direction stays zero. */
static inline vector vector_unit(vector a) {
    const double length = vector_length(a);
    return length > 0 && isfinite(length) ? vector_scale(a, 1 / length) : (vector){0, 0, 0};
}

#endif
