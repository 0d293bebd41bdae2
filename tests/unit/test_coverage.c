/* The lattice of light samples: as many as asked, where the grid says they are, and weights that measure
 * the light's area: a straight cut through the light is right to a few samples' share. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "coverage/lattice.h"

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

/* Cuts at many angles: an RMS error of half a sample for each root of the samples along the cut, which is
 * what the power of -3/4 comes from. */
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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(has_the_samples_asked_for),
        cmocka_unit_test(measures_straight_cuts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
