/* Sample sets: inside the light, without bias, better spread than chance, any count. */
#include "trace_scene.h"
#include "trace/samples.h"

#define PI 3.14159265358979323846

static double share_beyond(const ss_samples *samples, uint64_t hash, double edge, double angle) {
    const ss_turn turn = ss_samples_turn(ss_hash(hash));
    const uint32_t count = ss_samples_count(samples);
    uint32_t beyond = 0;
    for (uint32_t first = 0; first < count; first += 16) {
        float s[16], t[16];
        ss_samples_get(samples, &turn, first, s, t);
        for (uint32_t i = 0; i < 16 && first + i < count; i++) {
            beyond += s[i] * cos(angle) + t[i] * sin(angle) > edge;
        }
    }
    return (double)beyond / count;
}

/* Area of the unit disk beyond a line at distance t from its centre. */
static double disk_beyond(double t) { return 0.5 - (t * sqrt(1 - t * t) + asin(t)) / PI; }

static void inside_the_light(void **unused) {
    (void)unused;
    const uint32_t counts[] = {1, 2, 15, 16, 17, 100, 1000};
    for (int kind = 0; kind < 4; kind++) {
        for (size_t c = 0; c < sizeof counts / sizeof counts[0]; c++) {
            ss_samples *samples;
            assert_int_equal(
                ss_samples_create(&samples, counts[c], kind & 1, (ss_sequence)(kind >> 1)),
                SOFTSHADOW_OK);
            for (uint32_t first = 0; first < counts[c]; first += 16) {
                const ss_turn turn = ss_samples_turn(ss_hash(first + c));
                float s[16], t[16];
                ss_samples_get(samples, &turn, first, s, t);
                for (int i = 0; i < 16; i++) {
                    /* 4 roundings of single precision */
                    const float reach = kind & 1 ? s[i] * s[i] + t[i] * t[i]
                                                 : fmaxf(fabsf(s[i]), fabsf(t[i]));
                    assert_true(reach <= 1 + 0x1p-21f);
                }
            }
            ss_samples_destroy(samples);
        }
    }
}

/* RMS over turns of the share beyond random edges, against the closed form. */
static double edge_error(uint32_t count, ss_sequence sequence, double *bias) {
    ss_samples *samples;
    assert_int_equal(ss_samples_create(&samples, count, true, sequence), SOFTSHADOW_OK);
    uint64_t state = 7;
    double squares = 0, sum = 0;
    const int trials = 4000;
    for (int i = 0; i < trials; i++) {
        const double edge = 2 * chance(&state) - 1, angle = 2 * PI * chance(&state);
        const double error = share_beyond(samples, (uint64_t)i, edge, angle) - disk_beyond(edge);
        squares += error * error, sum += error;
    }
    ss_samples_destroy(samples);
    *bias = sum / trials;
    return sqrt(squares / trials);
}

/* Random samples err by the mean of sqrt(V (1 - V) / N): .40 / sqrt(N) for these edges. */
static void better_than_chance(void **unused) {
    (void)unused;
    const uint32_t counts[] = {16, 64, 250, 1024};
    for (int c = 0; c < 4; c++) {
        for (int kind = 0; kind < 2; kind++) {
            double bias;
            const double rms = edge_error(counts[c], (ss_sequence)kind, &bias);
            const double random = 0.40 / sqrt(counts[c]);
            print_message("edge, %4u samples, %s: rms %.5f (random %.5f) bias %+.6f\n", counts[c],
                          kind ? "sobol" : "spiral", rms, random, bias);
            assert_true(rms < random / (kind ? 2 : 2.5));
            assert_true(fabs(bias) < 4 * rms / sqrt(4000)); /* four sigma */
        }
    }
}

/* Each sample alone is uniform over all turns: quadrants and rings of the disk, halves of the
 * square. */
static void no_sample_is_biased(void **unused) {
    (void)unused;
    for (int kind = 0; kind < 4; kind++) {
        ss_samples *samples;
        assert_int_equal(ss_samples_create(&samples, 16, kind & 1, (ss_sequence)(kind >> 1)),
                         SOFTSHADOW_OK);
        const int trials = 20000;
        int right[16] = {0}, outer[16] = {0};
        for (int i = 0; i < trials; i++) {
            const ss_turn turn = ss_samples_turn(ss_hash((uint64_t)i));
            float s[16], t[16];
            ss_samples_get(samples, &turn, 0, s, t);
            for (int k = 0; k < 16; k++) right[k] += s[k] > 0, outer[k] += t[k] > 0.5f;
        }
        /* Spiral: radius is stratified, so only the direction of one sample is uniform. */
        for (int k = 0; k < 16; k++) {
            assert_true(abs(right[k] - trials / 2) < 5 * sqrt(trials * 0.25));
            if (!(kind & 1)) assert_true(abs(outer[k] - trials / 4) < 5 * sqrt(trials * 0.19));
        }
        ss_samples_destroy(samples);
    }
}

/* A (0,2)-sequence stays one under nested scrambling: 256 samples, one in each of 16 x 16 cells and
 * of 64 x 4 and 4 x 64. */
static void sobol_is_a_net(void **unused) {
    (void)unused;
    ss_samples *samples;
    assert_int_equal(ss_samples_create(&samples, 256, false, SS_SOBOL), SOFTSHADOW_OK);
    for (uint64_t hash = 0; hash < 20; hash++) {
        const ss_turn turn = ss_samples_turn(ss_hash(hash));
        int cells[3][256] = {{0}};
        for (uint32_t first = 0; first < 256; first += 16) {
            float s[16], t[16];
            ss_samples_get(samples, &turn, first, s, t);
            for (int i = 0; i < 16; i++) {
                const double x = (s[i] + 1) / 2, y = (t[i] + 1) / 2;
                cells[0][(int)(x * 16) * 16 + (int)(y * 16)]++;
                cells[1][(int)(x * 64) * 4 + (int)(y * 4)]++;
                cells[2][(int)(x * 4) * 64 + (int)(y * 64)]++;
            }
        }
        for (int k = 0; k < 3; k++) {
            for (int i = 0; i < 256; i++) assert_int_equal(cells[k][i], 1);
        }
    }
    ss_samples_destroy(samples);
}

/* The boxes of all packets together cover little more than the light. */
static void packets_lie_close(void **unused) {
    (void)unused;
    const uint32_t counts[] = {61, 992, 1024, 5000};
    for (int kind = 0; kind < 4; kind++) {
        for (int c = 0; c < 4; c++) {
            ss_samples *samples;
            const uint32_t count = counts[c];
            assert_int_equal(ss_samples_create(&samples, count, kind & 1, (ss_sequence)(kind >> 1)),
                             SOFTSHADOW_OK);
            const ss_turn still = {.cosine = 1};
            double area = 0;
            for (uint32_t first = 0; first < count; first += 16) {
                float s[16], t[16], low[2] = {2, 2}, high[2] = {-2, -2};
                ss_samples_get(samples, &still, first, s, t);
                for (uint32_t i = 0; i < 16 && first + i < count; i++) {
                    low[0] = fminf(low[0], s[i]), high[0] = fmaxf(high[0], s[i]);
                    low[1] = fminf(low[1], t[i]), high[1] = fmaxf(high[1], t[i]);
                }
                area += (double)(high[0] - low[0]) * (high[1] - low[1]);
            }
            print_message("%u samples, kind %d: boxes of packets cover %.2f lights\n", count, kind,
                          area / (kind & 1 ? PI : 4));
            /* A set along its own order: 16 samples of a spiral or lattice reach all over the
             * light, so that 4 packets cover some 4 of it and 312 packets hundreds. */
            if (!(kind >> 1)) assert_true(area / (kind & 1 ? PI : 4) < 1.3);
            ss_samples_destroy(samples);
        }
    }
}

/* A set in packets is still the whole set. */
static void no_sample_is_lost(void **unused) {
    (void)unused;
    enum { COUNT = 992 };
    ss_samples *samples;
    assert_int_equal(ss_samples_create(&samples, COUNT, true, SS_SPIRAL), SOFTSHADOW_OK);
    const ss_turn still = {.cosine = 1, .x = 0.5f};
    int ring[COUNT] = {0};
    for (uint32_t first = 0; first < COUNT; first += 16) {
        float s[16], t[16];
        ss_samples_get(samples, &still, first, s, t);
        for (int i = 0; i < 16; i++) {
            const double area = (double)s[i] * s[i] + (double)t[i] * t[i];
            ring[(int)(area * COUNT)]++; /* half a ring from either neighbour: floats suffice */
        }
    }
    for (int i = 0; i < COUNT; i++) assert_int_equal(ring[i], 1);
    ss_samples_destroy(samples);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(inside_the_light),
        cmocka_unit_test(better_than_chance),
        cmocka_unit_test(no_sample_is_biased),
        cmocka_unit_test(sobol_is_a_net),
        cmocka_unit_test(packets_lie_close),
        cmocka_unit_test(no_sample_is_lost),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
