/* Polygons into triangles, held against what does not know how it is done: areas by the shoelace
 * formula, insideness by crossing numbers. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "cli/mesh/polygon.h"

enum { MOST = 9000 };

static double p[MOST][2];
static uint32_t count;
static cli_polygon polygon;
static uint64_t seed = 5;

static double uniform(void) {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (double) (seed >> 11) * 0x1p-53;
}

static void corner(double x, double y) {
    assert_true(count < MOST);
    p[count][0] = x;
    p[count++][1] = y;
}

/* A plane in space: the drawing's x and y go along these. */
typedef struct plane {
    double x[3], y[3], origin[3];
} plane;

static const plane flat = {{1, 0, 0}, {0, 1, 0}, {0, 0, 0}};

static plane random_plane(double far) {
    double q[4], length = 0;
    for (int i = 0; i < 4; i++) q[i] = uniform() - .5, length += q[i] * q[i];
    for (int i = 0; i < 4; i++) q[i] /= sqrt(length);
    return (plane){{1 - 2 * (q[2] * q[2] + q[3] * q[3]), 2 * (q[1] * q[2] + q[0] * q[3]),
                    2 * (q[1] * q[3] - q[0] * q[2])},
                   {2 * (q[1] * q[2] - q[0] * q[3]), 1 - 2 * (q[1] * q[1] + q[3] * q[3]),
                    2 * (q[2] * q[3] + q[0] * q[1])},
                   {far, -far, far}};
}

static cli_tiling tile(const plane *in) {
    assert_true(cli_polygon_reserve(&polygon, count));
    for (uint32_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            polygon.points[i][k] = in->origin[k] + p[i][0] * in->x[k] + p[i][1] * in->y[k];
    return cli_polygon_tile(&polygon, count);
}

static double area_of(const double *a, const double *b, const double *c) {
    return ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
}

static double whole_area(void) {
    double area = 0;
    for (uint32_t i = 0; i < count; i++) {
        const double *a = p[i], *b = p[(i + 1) % count];
        area += (a[0] * b[1] - a[1] * b[0]) / 2;
    }
    return area;
}

static bool inside(double x, double y) {
    bool in = false;
    for (uint32_t i = 0; i < count; i++) {
        const double *a = p[i], *b = p[(i + 1) % count];
        if ((a[1] > y) != (b[1] > y) && x < a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]))
            in = !in;
    }
    return in;
}

/* Every triangle is wound like the outline and inside it, and they add up to its area. Rounding of
 * corners onto a tilted plane moves the drawing by a few 2^-53 of its distance: `slack` allows for
 * triangles that have no more area than that. */
static void check_tiles(double slack) {
    double whole = whole_area(), sum = 0;
    for (uint32_t t = 0; t + 2 < count; t++) {
        const uint32_t *v = polygon.triangles + 3 * (size_t) t;
        assert_true(v[0] < count && v[1] < count && v[2] < count);
        double area = area_of(p[v[0]], p[v[1]], p[v[2]]);
        sum += fabs(area);
        if (fabs(area) <= slack) continue;
        assert_true((area > 0) == (whole > 0));
        assert_true(inside((p[v[0]][0] + p[v[1]][0] + p[v[2]][0]) / 3,
                           (p[v[0]][1] + p[v[1]][1] + p[v[2]][1]) / 3));
    }
    if (fabs(sum - fabs(whole)) > 1e-12 * fabs(whole) + slack * count)
        fail_msg("%u corners: area %.17g becomes %.17g", count, fabs(whole), sum);
}

/* Both windings; in the drawing's plane, and in one that is tilted and far away. */
static void check_polygon(void) {
    for (int winding = 0; winding < 2; winding++) {
        assert_int_equal(tile(&flat), CLI_TILING_CLEAN);
        check_tiles(0);
        for (double far = 0; far < 1e4; far = far * 100 + 10) {
            plane tilted = random_plane(far);
            tile(&tilted); /* clean but for corners that rounding has put on the other side */
            check_tiles(1e-13 * (far + 10));
        }
        for (uint32_t i = 0; i < count / 2; i++)
            for (int k = 0; k < 2; k++) {
                double swap = p[i][k];
                p[i][k] = p[count - 1 - i][k];
                p[count - 1 - i][k] = swap;
            }
    }
}

static void star(uint32_t corners, double ragged) {
    count = 0;
    for (uint32_t i = 0; i < corners; i++) {
        double angle = 2 * 3.141592653589793 * i / corners, r = 1 - ragged * uniform();
        corner(r * cos(angle), r * sin(angle));
    }
}

static void tiles_stars(void **state) {
    (void) state;
    for (uint32_t corners = 4; corners < 200; corners += 1 + corners / 8)
        for (int i = 0; i < 20; i++) {
            star(corners, i % 4 == 0 ? 0 : .9);
            check_polygon();
        }
}

/* All quads with corners on a grid of 4 x 4 whose sides do not cross: convex, concave, with a
 * straight corner. */
static bool sides_cross(uint32_t i, uint32_t j) {
    const double *a = p[i], *b = p[(i + 1) % count], *c = p[j], *d = p[(j + 1) % count];
    return area_of(a, b, c) * area_of(a, b, d) <= 0 && area_of(c, d, a) * area_of(c, d, b) <= 0;
}

static void tiles_every_quad(void **state) {
    (void) state;
    uint32_t quads = 0;
    for (uint32_t code = 0; code < 1 << 16; code++) {
        count = 0;
        for (int i = 0; i < 4; i++) corner(code >> 4 * i & 3, code >> (4 * i + 2) & 3);
        bool simple = whole_area() != 0 && !sides_cross(0, 2) && !sides_cross(1, 3);
        for (uint32_t i = 0; simple && i < 4; i++) /* no spike back along a side */
            simple = area_of(p[i], p[(i + 1) % 4], p[(i + 2) % 4]) != 0 ||
                     (p[(i + 1) % 4][0] - p[i][0]) * (p[(i + 2) % 4][0] - p[(i + 1) % 4][0]) +
                             (p[(i + 1) % 4][1] - p[i][1]) *
                                 (p[(i + 2) % 4][1] - p[(i + 1) % 4][1]) > 0;
        if (!simple) continue;
        quads++;
        assert_int_equal(tile(&flat), CLI_TILING_CLEAN);
        check_tiles(0);
    }
    assert_true(quads > 10000);
}

static void comb(uint32_t teeth) {
    count = 0;
    corner(0, -1);
    corner(2 * teeth, -1);
    for (uint32_t i = 0; i < 2 * teeth; i++) corner(2 * teeth - i, i % 2 ? 3 : i * 1e-3);
}

static void spiral(uint32_t turns) {
    count = 0;
    for (uint32_t i = 0; i <= 8 * turns; i++)
        corner((1 + i) * cos(i * .7853981633974483), (1 + i) * sin(i * .7853981633974483));
    for (uint32_t i = 8 * turns; i > 0; i--)
        corner((.5 + i) * cos(i * .7853981633974483), (.5 + i) * sin(i * .7853981633974483));
}

static void tiles_combs_and_spirals(void **state) {
    (void) state;
    for (uint32_t n = 2; n < 120; n += 7) {
        comb(n);
        check_polygon();
        spiral(n);
        check_polygon();
    }
}

/* Corners in the middle of sides, as neighbours with finer faces leave them. */
static void tiles_straight_corners(void **state) {
    (void) state;
    for (uint32_t n = 1; n < 20; n++) {
        count = 0;
        for (uint32_t i = 0; i < n; i++) corner(i, 0);
        for (uint32_t i = 0; i < n; i++) corner(n, i);
        for (uint32_t i = 0; i < n; i++) corner(n - i, n);
        for (uint32_t i = 0; i < n; i++) corner(0, n - i);
        check_polygon();
        uint32_t flat_ones = 0;
        assert_int_equal(tile(&flat), CLI_TILING_CLEAN);
        for (uint32_t t = 0; t + 2 < count; t++) {
            const uint32_t *v = polygon.triangles + 3 * (size_t) t;
            flat_ones += area_of(p[v[0]], p[v[1]], p[v[2]]) == 0;
        }
        assert_int_equal(flat_ones, 0);
    }
}

/* A hole, reached by a bridge that is walked in both directions: corners and sides coincide. */
static void tiles_holes(void **state) {
    (void) state;
    for (uint32_t n = 3; n < 60; n++) {
        count = 0;
        for (uint32_t i = 0; i <= n; i++)
            corner(cos(6.283185307179586 * (i % n) / n), sin(6.283185307179586 * (i % n) / n));
        for (uint32_t i = 0; i <= n; i++)
            corner(.3 * cos(6.283185307179586 * ((n - i) % n) / n),
                   .3 * sin(6.283185307179586 * ((n - i) % n) / n));
        assert_int_equal(tile(&flat), CLI_TILING_CLEAN);
        check_tiles(1e-15);
    }
}

static void counts_what_is_no_polygon(void **state) {
    (void) state;
    static const double bad[][10] = {{0, 0, 1, 1, 1, 0, 0, 2, 0, 0}, /* a bow-tie, 4 corners of 5 */
                                     {0, 0, 1, 0, 2, 0, 3, 0, 4, 0}, /* all on a line */
                                     {1, 1, 1, 1, 1, 1, 1, 1, 1, 1}}; /* all in one place */
    for (int i = 0; i < 3; i++) {
        count = 0;
        for (int k = 0; k < (i ? 5 : 4); k++) corner(bad[i][2 * k], bad[i][2 * k + 1]);
        assert_int_equal(tile(&flat), CLI_TILING_UNCLEAN);
    }
    count = 0; /* a pentagram turns left at every corner */
    for (int i = 0; i < 5; i++) corner(cos(2.5132741228718345 * i), sin(2.5132741228718345 * i));
    assert_int_equal(tile(&flat), CLI_TILING_UNCLEAN);
    for (int round = 0; round < 2000; round++) { /* scribbles: n - 2 triangles whatever they are */
        count = 0;
        uint32_t corners = 4 + (uint32_t) (uniform() * 40);
        while (count < corners) corner(floor(8 * uniform()), floor(8 * uniform()));
        memset(polygon.triangles, 0xff, 12 * (size_t) (polygon.room ? polygon.room : 0));
        tile(&flat);
        for (uint32_t i = 0; i < 3 * (count - 2); i++) assert_true(polygon.triangles[i] < count);
    }
}

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double) now.tv_sec + 1e-9 * (double) now.tv_nsec;
}

/* The largest that is allowed, as intricate as is allowed: far from the minutes that a cubic search
 * would take, and what is beyond is refused. */
static void is_bounded_in_time(void **state) {
    (void) state;
    double start = seconds();
    spiral(360);
    assert_int_equal(tile(&flat), CLI_TILING_CLEAN);
    check_tiles(0);
    comb(2000);
    assert_int_equal(tile(&flat), CLI_TILING_CLEAN);
    check_tiles(0);
    count = 0; /* a scribble of the largest kind */
    while (count < 5600) corner(uniform(), uniform());
    assert_int_equal(tile(&flat), CLI_TILING_UNCLEAN);
    assert_true(seconds() - start <
                20); /* half a second on an idle core; sanitizers and load take theirs */
    count = 0;
    while (count < MOST) corner(uniform(), uniform());
    assert_int_equal(tile(&flat), CLI_TILING_TOO_LARGE);
    cli_polygon_free(&polygon);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tiles_stars),
        cmocka_unit_test(tiles_every_quad),
        cmocka_unit_test(tiles_combs_and_spirals),
        cmocka_unit_test(tiles_straight_corners),
        cmocka_unit_test(tiles_holes),
        cmocka_unit_test(counts_what_is_no_polygon),
        cmocka_unit_test(is_bounded_in_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
