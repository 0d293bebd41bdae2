/* based on: J. R. Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
 * Predicates", 1997: the filter of its orient3d, and exact sums as expansions. Two stages instead
 * of its four: what the filter leaves open is nearly always exactly zero, where the stages between
 * give no answer either. */
#include "base/predicate.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Rounding error of the determinant below, relative to its permanent: (7 + 56 u) u, u = 2^-53. */
#define ORIENT_ERROR ((7.0 + 56.0 * 0x1p-53) * 0x1p-53)
/* Below this the filter's own products could have lost bits to underflow. */
#define ORIENT_SMALL 1e-280

/* An exact sum: components that do not overlap, smallest first, none of them zero. */
typedef struct expansion {
    int n;
    double x[208]; /* a determinant adds 192 at most */
} expansion;

/* a - b exactly: x[1] rounded, x[0] what rounding lost. */
typedef struct difference {
    double x[2];
} difference;

static inline void two_sum(double a, double b, double *sum, double *lost) {
    const double s = a + b, from_b = s - a, from_a = s - from_b;
    *sum = s, *lost = (a - from_a) + (b - from_b);
}

static difference subtract(double a, double b) {
    difference d;
    two_sum(a, -b, &d.x[1], &d.x[0]);
    return d;
}

static void add(expansion *e, double value) {
    int kept = 0;
    for (int i = 0; i < e->n; i++) {
        double lost;
        two_sum(value, e->x[i], &value, &lost);
        if (lost != 0) e->x[kept++] = lost;
    }
    if (value != 0) e->x[kept++] = value;
    e->n = kept;
}

static void add_product(expansion *e, double a, double b) {
    const double product = a * b;
    if (product == 0) return;
    add(e, fma(a, b, -product));
    add(e, product);
}

static int sign_of(const expansion *e) {
    if (e->n == 0) return 0;
    return e->x[e->n - 1] > 0 ? 1 : -1;
}

/* a0 b1 - a1 b0 */
static void minor(expansion *e, difference a0, difference a1, difference b0, difference b1) {
    e->n = 0;
    for (int i = 0; i < 2; i++) {
        for (int j = 0; j < 2; j++) {
            add_product(e, a0.x[i], b1.x[j]);
            add_product(e, -a1.x[i], b0.x[j]);
        }
    }
}

/* Puts the largest of the three vectors' components near 2^300, so that no exact product of three
 * leaves the range of double at either end. A common power of two changes no sign. */
static void rescale(difference (*v)[3], int count) {
    double largest = 0;
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++) largest = fmax(largest, fabs(v[i][k].x[1]));
    }
    if (largest == 0) return;
    const int shift = 300 - ilogb(largest);
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++) {
            v[i][k].x[0] = scalbn(v[i][k].x[0], shift), v[i][k].x[1] = scalbn(v[i][k].x[1], shift);
        }
    }
}

/* The sign of v[0] x v[1] . v[2] */
static int exact_sign(difference v[3][3]) {
    expansion sum, part;
    rescale(v, 3);
    sum.n = 0;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        minor(&part, v[0][i], v[0][j], v[1][i], v[1][j]);
        for (int m = 0; m < part.n; m++) {
            add_product(&sum, part.x[m], v[2][k].x[0]);
            add_product(&sum, part.x[m], v[2][k].x[1]);
        }
    }
    return sign_of(&sum);
}

static int orient(const double a[3], const double b[3], const double c[3], const double d[3],
                  const double origin[3]) {
    difference v[3][3];
    for (int k = 0; k < 3; k++) {
        v[0][k] = subtract(b[k], a[k]), v[1][k] = subtract(c[k], a[k]);
        v[2][k] = subtract(d[k], origin[k]);
    }
    double determinant = 0, permanent = 0;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const double p = v[0][i].x[1] * v[1][j].x[1], q = v[0][j].x[1] * v[1][i].x[1];
        determinant += (p - q) * v[2][k].x[1];
        permanent += (fabs(p) + fabs(q)) * fabs(v[2][k].x[1]);
    }
    const double error = ORIENT_ERROR * permanent;
    if (permanent > ORIENT_SMALL && permanent < 1e300) {
        if (determinant > error) return 1;
        if (-determinant > error) return -1;
    }
    return exact_sign(v);
}

int ss_orient3d(const double a[3], const double b[3], const double c[3], const double d[3]) {
    return orient(a, b, c, d, a);
}

int ss_orient3d_towards(const double a[3], const double b[3], const double c[3],
                        const double d[3]) {
    static const double nowhere[3];
    return orient(a, b, c, d, nowhere);
}

double ss_side_exact(const double d[3], const double a[3], const double b[3], double rounded) {
    static const double nowhere[3];
    return ss_orient3d_towards(nowhere, a, b, d) * fmax(fabs(rounded), DBL_MIN);
}

bool ss_collinear(const double a[3], const double b[3], const double c[3]) {
    difference v[2][3];
    for (int k = 0; k < 3; k++) {
        v[0][k] = subtract(b[k], a[k]), v[1][k] = subtract(c[k], a[k]);
    }
    for (int k = 0; k < 3; k++) { /* most triangles are not: their plain minor is far from zero */
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const double p = v[0][i].x[1] * v[1][j].x[1], q = v[0][j].x[1] * v[1][i].x[1];
        const double size = fabs(p) + fabs(q);
        if (size > ORIENT_SMALL && size < 1e300 && fabs(p - q) > ORIENT_ERROR * size) return false;
    }
    rescale(v, 2);
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        expansion part;
        minor(&part, v[0][i], v[0][j], v[1][i], v[1][j]);
        if (sign_of(&part) != 0) return false;
    }
    return true;
}
