/* base/predicate: against exact integer arithmetic: generic, near-degenerate, degenerate. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/predicate.h"

typedef __int128 wide;
static uint64_t state;

static uint64_t next(void) {
    state += 0x9e3779b97f4a7c15u;
    uint64_t x = state;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}
/* -2^bits < n < 2^bits */
static int64_t whole(int bits) { return (int64_t)(next() >> (63 - bits)) - ((int64_t)1 << bits); }

static int sign(wide x) { return (x > 0) - (x < 0); }

static wide determinant(const int64_t u[3], const int64_t v[3], const int64_t w[3]) {
    wide sum = 0;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        sum += ((wide)u[i] * v[j] - (wide)u[j] * v[i]) * w[k];
    }
    return sum;
}

static void check(int64_t n[4][3], const int exponent[3]) {
    double p[4][3];
    int64_t u[3], v[3], w[3];
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < 4; i++) p[i][k] = ldexp((double)n[i][k], exponent[k]);
        u[k] = n[1][k] - n[0][k], v[k] = n[2][k] - n[0][k], w[k] = n[3][k] - n[0][k];
    }
    const int expected = sign(determinant(u, v, w));
    assert_int_equal(ss_orient3d(p[0], p[1], p[2], p[3]), expected);
    assert_int_equal(ss_orient3d(p[1], p[2], p[0], p[3]), expected);
    assert_int_equal(ss_orient3d(p[1], p[0], p[2], p[3]), -expected);
    assert_int_equal(ss_orient3d(p[3], p[1], p[0], p[2]), expected);
    assert_int_equal(ss_orient3d_towards(p[0], p[1], p[2], p[3]), sign(determinant(u, v, n[3])));
    const bool line = (wide)u[0] * v[1] == (wide)u[1] * v[0] &&
                      (wide)u[1] * v[2] == (wide)u[2] * v[1] &&
                      (wide)u[2] * v[0] == (wide)u[0] * v[2];
    assert_int_equal(ss_collinear(p[0], p[1], p[2]), line);
}

/* 2^39: differences 2^40, products 2^120, sums below 2^123. */
static void random_points(void **unused) {
    (void)unused;
    for (int round = 0; round < 200000; round++) {
        int64_t n[4][3];
        int exponent[3];
        const int bits = 3 + (int)(next() % 36);
        for (int k = 0; k < 3; k++) {
            for (int i = 0; i < 4; i++) n[i][k] = whole(bits);
            exponent[k] = (int)(next() % 200) - 100; /* axes of very different size */
        }
        check(n, exponent);
    }
}

/* d = a + s (b - a) + t (c - a), then moved by at most one unit: zero or nearly zero. */
static void almost_coplanar(void **unused) {
    (void)unused;
    int zeros = 0;
    static const int same[3];
    for (int round = 0; round < 200000; round++) {
        int64_t n[4][3];
        const int64_t s = whole(6), t = whole(6);
        const int bits = 4 + (int)(next() % 28), nudge = (int)(next() % 3);
        for (int k = 0; k < 3; k++) {
            for (int i = 0; i < 3; i++) n[i][k] = whole(bits);
            n[3][k] = n[0][k] + s * (n[1][k] - n[0][k]) + t * (n[2][k] - n[0][k]);
        }
        if (nudge) n[3][next() % 3] += nudge == 1 ? 1 : -1;
        if (round % 5 == 0) { /* three on a line as well */
            for (int k = 0; k < 3; k++) n[2][k] = n[0][k] + s * (n[1][k] - n[0][k]);
            if (nudge) n[2][next() % 3]++;
        }
        check(n, same);
        zeros += nudge == 0;
    }
    assert_true(zeros > 50000);
}

/* Coordinates that no integer arithmetic of the test holds: the plane x + y + z = h through doubles
 * far from the origin, where the answer is known by construction. */
static void far_and_small(void **unused) {
    (void)unused;
    for (int exponent = -500; exponent <= 40; exponent += 20) {
        const double h = ldexp(1, exponent), ulp = ldexp(h, -52);
        const double a[3] = {h, 0, 0}, b[3] = {0, h, 0}, c[3] = {0, 0, h};
        double d[3] = {h / 2, h / 4, h / 4};
        assert_int_equal(ss_orient3d(a, b, c, d), 0);
        d[2] = h / 4 + ulp / 4;
        assert_int_equal(ss_orient3d(a, b, c, d), 1);
        d[2] = h / 4 - ulp / 4;
        assert_int_equal(ss_orient3d(a, b, c, d), -1);
        d[2] = h / 4 + ldexp(h, -540); /* rounds to h / 4 */
        assert_int_equal(ss_orient3d(a, b, c, d), 0);
        const double e[3] = {h, -h, ldexp(h, -540)};
        assert_int_equal(ss_orient3d_towards(a, b, c, e), 1);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_points),
        cmocka_unit_test(almost_coplanar),
        cmocka_unit_test(far_and_small),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
