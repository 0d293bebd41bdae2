/* The lattice of light samples: as many as asked, where the grid says they are, and weights that
 * measure the light's area: a straight cut through the light is right to a few samples' share. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "coverage/lattice.h"
#include "coverage/sky_parts.h"

static const uint32_t types[] = {SOFTSHADOW_RECT, SOFTSHADOW_SPHERE};
static const uint32_t counts[] = {256, 300, 512, 528, 768, 1024, 4096, 16384};
#define EACH(type, count)                                                                          \
    for (size_t t_ = 0; t_ < 2; t_++)                                                              \
        for (size_t c_ = 0; c_ < sizeof counts / sizeof *counts; c_++)                             \
            for (uint32_t type = types[t_], count = counts[c_], once_ = 1; once_; once_ = 0)

static ss_lattice *make(uint32_t type, uint32_t count) {
    const ss_light light = {.type = type};
    ss_lattice *lattice;
    assert_int_equal(ss_lattice_create(&lattice, &light, count), SOFTSHADOW_OK);
    return lattice;
}

static bool is_sample(const ss_lattice *l, uint32_t place) {
    return !(l->outside[place / 32] >> (place % 32) & 1);
}

static void has_the_samples_asked_for(void **unused) {
    (void)unused;
    EACH(type, count) {
        ss_lattice *l = make(type, count);
        uint32_t found = 0;
        uint64_t total = 0;
        for (uint32_t i = 0; i < l->blocks * SS_BLOCK * 32; i++) {
            if (!is_sample(l, i)) {
                assert_int_equal(l->weight[i], 0);
                continue;
            }
            const uint32_t block = i / 32 / SS_BLOCK;
            const double column = block % l->words * 32 + i % 32;
            const double row = block / l->words * SS_BLOCK + i / 32 % SS_BLOCK;
            /* Positions are floats. */
            const double x = l->grid[0][0] * l->s[i] + l->grid[0][1] * l->t[i] + l->grid[0][2];
            const double y = l->grid[1][0] * l->s[i] + l->grid[1][1] * l->t[i] + l->grid[1][2];
            assert_true(fabs(x - column - 1) < 1e-4 && fabs(y - row - 1) < 1e-4);
            assert_true(l->weight[i] > 0);
            found++, total += l->weight[i];
        }
        assert_int_equal(found, count);
        assert_int_equal(l->count, count);
        assert_int_equal(l->total, total);
        assert_int_equal(ss_lattice_visible(l, l->outside), total);
        ss_lattice_destroy(l);
    }
}

/* The share of the shape with s cos + t sin < cut. */
static double area_below(bool disk, double angle, double cut) {
    if (disk) {
        const double x = fmin(fmax(cut, -1), 1);
        return 0.5 + (x * sqrt(1 - x * x) + asin(x)) / M_PI;
    }
    const double a = fabs(cos(angle)), b = fabs(sin(angle));
    const double far = fmin(fmax(a + b + cut, 0), 2 * (a + b)); /* from the lowest corner on */
    const double triangle = far * far / 2, over_a = fmax(far - 2 * a, 0),
                 over_b = fmax(far - 2 * b, 0);
    return (triangle - over_a * over_a / 2 - over_b * over_b / 2) / (4 * a * b);
}

/* Cuts at many angles: an RMS error of half a sample for each root of the samples along the cut,
 * which is what the power of -3/4 comes from. */
static void measures_straight_cuts(void **unused) {
    (void)unused;
    double last = 1;
    EACH(type, count) {
        ss_lattice *l = make(type, count);
        double square = 0;
        int n = 0;
        for (double angle = 0.003; angle < 2 * M_PI; angle += 0.05) {
            for (double cut = -0.95; cut < 1; cut += 0.07) {
                uint64_t below = 0;
                for (uint32_t i = 0; i < l->blocks * SS_BLOCK * 32; i++) {
                    if (l->s[i] * cos(angle) + l->t[i] * sin(angle) < cut) below += l->weight[i];
                }
                const double want = area_below(type != SOFTSHADOW_RECT, angle, cut);
                const double error = (double)below / (double)l->total - want;
                square += error * error, n++;
            }
        }
        const double rms = sqrt(square / n);
        print_message("type %u, %u samples: %.5f\n", type, count, rms);
        assert_true(rms < 0.55 * pow(count, -0.75));
        assert_true(count < 4096 || rms < last);
        last = rms;
        ss_lattice_destroy(l);
    }
}

/* The largest way that ss_sky_holds() lets contact move a point, in any direction: is it within the
 * room, in nearness and on the plane? */
static void moves_points_no_farther_than_the_sky_has_room(void **unused) {
    (void)unused;
    static const double least[] = {3.5, 2, 1, 0.25, 0.0625};
    ss_sky sky = {.frame = {.axis = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .distance = 4}, .size = 7};
    const ss_sky_frame *f = &sky.frame;
    uint64_t state = 5;
    for (size_t l = 0; l < sizeof least / sizeof *least; l++) {
        sky.frame.least = least[l];
        double ulp = 1;
        while (!ss_sky_holds(&sky, ulp)) ulp /= 1.25;
        const double way = 8 * ulp * (sky.size + 1);
        assert_true(way > 0);
        for (int i = 0; i < 20000; i++) {
            double at[3], to[3], by[3], on[2], moved[2];
            for (int k = 0; k < 3; k++) {
                state = state * 6364136223846793005u + 1442695040888963407u;
                at[k] = (double)(state >> 11) * 0x1p-52 - 1;
                state = state * 6364136223846793005u + 1442695040888963407u;
                by[k] = (double)(state >> 11) * 0x1p-52 - 1;
            }
            if (!ss_normalize(at) || !ss_normalize(by)) continue;
            if (i % 2) memcpy(by, at, sizeof by); /* along the ray, where nearness changes most */
            const double r = least[l] * (1 + (i % 7) / 4.0) + way;
            for (int k = 0; k < 3; k++) at[k] *= r, to[k] = at[k] - way * by[k];
            ss_sky_project(f, at, on);
            ss_sky_project(f, to, moved);
            if (!(hypot(on[0], on[1]) < 2 * f->distance)) continue; /* beyond any map */
            const double nearer =
                ss_sky_nearness_at(f, ss_length(to)) - ss_sky_nearness_at(f, ss_length(at));
            assert_true(fabs(nearer) <= SS_SKY_ROOM);
            assert_true(hypot(moved[0] - on[0], moved[1] - on[1]) <= 1.001 * SS_SKY_ROOM);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(has_the_samples_asked_for),
        cmocka_unit_test(measures_straight_cuts),
        cmocka_unit_test(moves_points_no_farther_than_the_sky_has_room),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
