/* What a rectangle of a map hides of a light, against counting; the pyramid of least depths against
 * looking everywhere. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

/* After the others: it uses their types. */
#include <cmocka.h>

#include "map/pyramid.h"
#include "technique/lamp.h"

static uint64_t random_state = 5;
static double uniform(double low, double high) {
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(random_state >> 11) * 0x1p-53;
}

/* A frame that looks straight down from 4, its reference plane at 0, a hundred texels a unit. */
static ss_frame frame_down(void) {
    return (ss_frame){.x = {1, 0, 0},
                      .y = {0, 1, 0},
                      .z = {0, 0, -1},
                      .inverse = .25,
                      .nearest = -3.9,
                      .low = {-2, -2},
                      .texel = .01,
                      .far_h = 3};
}

static ss_light flat(uint32_t type, double turn, double tilt, double a, double b) {
    const double c = cos(turn), s = sin(turn);
    return (ss_light){.type = type,
                      .centre = {0, 0, 4},
                      .normal = {0, sin(tilt), -cos(tilt)},
                      .u = {a * c, a * s, 0},
                      .v = {-b * s * cos(tilt), b * c * cos(tilt), b * c * sin(tilt)},
                      .radius = a};
}

/* The share of n x n places of the light whose rectangle is between low and high. */
static double count(const ss_lamp_view *view, const double low[2], const double high[2]) {
    enum { N = 400 };
    const double(*m)[2] = view->to_light;
    const double det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    long all = 0, in = 0;
    for (int j = 0; j < N; j++) {
        for (int i = 0; i < N; i++) {
            const double s = (2 * i + 1.0) / N - 1, t = (2 * j + 1.0) / N - 1;
            if (view->lamp->disk && s * s + t * t > 1) continue;
            const double x = (m[1][1] * s - m[0][1] * t) / det,
                         y = (m[0][0] * t - m[1][0] * s) / det;
            all++, in += x > low[0] && x < high[0] && y > low[1] && y < high[1];
        }
    }
    return (double)in / (double)all;
}

static void test_hidden(void **state) {
    (void)state;
    const ss_frame frame = frame_down();
    for (int trial = 0; trial < 400; trial++) {
        const uint32_t type = trial & 1 ? SOFTSHADOW_RECT : SOFTSHADOW_DISK;
        const double turn = trial % 4 < 2 ? 0 : uniform(0, 6),
                     tilt = trial % 8 < 4 ? 0 : uniform(-1, 1);
        const ss_light light = flat(type, turn, tilt, .4, type == SOFTSHADOW_DISK ? .4 : .25);
        ss_lamp lamp;
        ss_lamp_view view;
        ss_lamp_make(&lamp, &light, &frame);
        assert_true(ss_lamp_see(&lamp, uniform(0, 400), uniform(0, 400), 1, &view));
        double low[2], high[2];
        const double size = pow(2, uniform(-3, 2));
        for (int k = 0; k < 2; k++) {
            low[k] = uniform(-1.5, 1.2) * view.reach[k];
            high[k] = low[k] + size * view.reach[k];
        }
        const double hidden = ss_lamp_hidden(&view, low, high), truth = count(&view, low, high);
        assert_true(fabs(hidden - truth) < .01);
        const double middle[2] = {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2};
        const double side = fmax(high[0] - low[0], high[1] - low[1]);
        if (ss_lamp_misses(&view, middle[0], middle[1], 1, side)) assert_true(hidden < 1e-9);
    }
}

/* Patches that tile the plane hide the light once, whatever their size. */
static void test_tiling(void **state) {
    (void)state;
    const ss_frame frame = frame_down();
    for (int trial = 0; trial < 200; trial++) {
        const uint32_t type = trial % 3 == 0   ? SOFTSHADOW_RECT
                              : trial % 3 == 1 ? SOFTSHADOW_DISK
                                               : SOFTSHADOW_SPHERE;
        const ss_light light =
            flat(type, uniform(0, 6), uniform(-.5, .5), .4, type == SOFTSHADOW_RECT ? .2 : .4);
        const double gap = pow(10, uniform(-12, 1));
        ss_lamp lamp;
        ss_lamp_view view;
        ss_lamp_kernel k;
        ss_lamp_make(&lamp, &light, &frame);
        const double x = uniform(180, 220), y = uniform(180, 220);
        assert_true(ss_lamp_see(&lamp, x, y, 1, &view));
        const double used = gap > view.least ? gap : view.least;
        if (!(view.reach[0] * used < 100 && view.reach[1] * used < 100)) continue;
        assert_true(ss_lamp_footprint(&view, 400, x, y, used, &k));
        ss_lamp_thin(&k, trial % 2 ? 50 : 0);
        double sum = 0;
        for (int j = 0; j < k.count[1]; j++) {
            for (int i = 0; i < k.count[0]; i++) {
                const double edge[2] = {k.low[0] + i * k.step - x, k.low[1] + j * k.step - y};
                const double low[2] = {edge[0] / used, edge[1] / used};
                const double high[2] = {(edge[0] + k.step) / used, (edge[1] + k.step) / used};
                sum += ss_lamp_hidden(&view, low, high);
            }
        }
        assert_true(fabs(sum - 1) < 1e-6);
        if (trial % 2) assert_true(k.count[0] * k.count[1] <= 50);
    }
}

/* Seen along its plane a light is a line: said, not divided by. */
static void test_edge_on(void **state) {
    (void)state;
    const ss_frame frame = frame_down();
    const ss_light light = flat(SOFTSHADOW_DISK, 0, M_PI / 2, .4, .4);
    ss_lamp lamp;
    ss_lamp_view view;
    ss_lamp_make(&lamp, &light, &frame);
    assert_false(ss_lamp_see(&lamp, 200, 200, 1, &view));
}

static void test_pyramid(void **state) {
    (void)state;
    const uint32_t sides[] = {1, 2, 3, 8, 13, 64, 100, 300};
    ss_pool *pool;
    assert_int_equal(ss_pool_create(&pool, NULL), SOFTSHADOW_OK);
    for (size_t s = 0; s < sizeof sides / sizeof *sides; s++) {
        const int32_t side = (int32_t)sides[s];
        float *plane = malloc((size_t)(side * side) * sizeof *plane);
        for (int i = 0; i < side * side; i++) plane[i] = (float)uniform(0, 1);
        ss_pyramid p;
        assert_int_equal(ss_pyramid_build(&p, plane, sides[s], pool), SOFTSHADOW_OK);
        float all = 2;
        for (int i = 0; i < side * side; i++) all = fminf(all, plane[i]);
        assert_true(*p.level[p.levels - 1] == all && p.side[p.levels - 1] == 1);
        for (int trial = 0; trial < 300; trial++) {
            int32_t low[2], high[2];
            for (int k = 0; k < 2; k++) {
                low[k] = (int32_t)uniform(0, side),
                high[k] = low[k] + (int32_t)uniform(0, side - low[k]);
            }
            float least = 2;
            for (int32_t y = low[1]; y <= high[1]; y++) {
                for (int32_t x = low[0]; x <= high[0]; x++)
                    least = fminf(least, plane[y * side + x]);
            }
            const float found = ss_pyramid_least(&p, low, high);
            assert_true(found <= least && found >= all);
            if (high[0] - low[0] <= 2 && high[1] - low[1] <= 2) assert_true(found == least);
        }
        ss_pyramid_free(&p);
        free(plane);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_hidden),
        cmocka_unit_test(test_tiling),
        cmocka_unit_test(test_edge_on),
        cmocka_unit_test(test_pyramid),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
