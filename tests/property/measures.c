/* What the library says of itself: errors that shrink as samples grow, measure_error() against the
 * oracle's truth, explain() against the same. */
#include "property/truth.h"

enum { SIDE = 24, N = SIDE * SIDE, SCENES = 20 };

static scene_mesh thing(uint64_t seed) {
    scene_mesh mesh = {0};
    scene_garbage(&mesh, seed);
    return mesh;
}

static const softshadow_light *light_of(int scene) {
    static softshadow_light light;
    light = scene % 3 == 0   ? scene_sphere_light(0.3, -0.2, 6, 1.2)
            : scene % 3 == 1 ? scene_rect_light(0.2, 0, 5.5, 1.5, 0.7)
                             : scene_sun_light(-0.1, 0.2, -1, 0.25);
    return &light;
}

/* RMS over the penumbrae of twenty scenes. */
static double error_at(const char *method, uint32_t samples, double (*truth)[N]) {
    double points[N][3], sum = 0;
    size_t n = 0;
    scene_grid(points, SIDE, -2, 2, -2, 2, 0);
    for (int scene = 0; scene < SCENES; scene++) {
        scene_mesh mesh = thing((uint64_t)scene + 300);
        ask q = ask_new(method, &mesh, *light_of(scene), (const double(*)[3])points, N, samples);
        ask_do(&q);
        for (int i = 0; i < N; i++) {
            if (isnan(truth[scene][i]))
                truth[scene][i] = oracle_union(&mesh, &q.light, points[i], NULL);
            const double t = truth[scene][i], e = q.visibility[i] - t;
            if (t > 1e-9 && t < 1 - 1e-9) sum += e * e, n++;
        }
        ask_free(&q);
        scene_free(&mesh);
    }
    return sqrt(sum / (double)n);
}

static void more_samples_come_closer(void **state) {
    static const uint32_t samples[] = {512, 1024, 2048, 4096};
    double(*truth)[N] = malloc(SCENES * sizeof *truth), rms[COUNT(samples)];
    for (int i = 0; i < SCENES * N; i++) truth[i / N][i % N] = NAN;
    for (size_t i = 0; i < COUNT(samples); i++) {
        rms[i] = error_at(*state, samples[i], truth);
        print_message("           %u samples: RMS %.6f\n", samples[i], rms[i]);
    }
    free(truth);
    const double slope = log(rms[3] / rms[0]) / log(8);
    print_message("           slope %.2f\n", slope);
    CHECK(rms[0] <= 1.0 / 256 && rms[1] <= 1.0 / 512, "512 samples: %g, 1024: %g", rms[0], rms[1]);
    CHECK(slope < -0.65, "N^%.2f", slope);
}

static void measured_errors_are_the_errors(void **state) {
    scene_mesh mesh = thing(21);
    double points[N][3], sum = 0, most = 0;
    scene_grid(points, SIDE, -2, 2, -2, 2, 0);
    ask q = ask_new(*state, &mesh, *light_of(0), (const double(*)[3])points, N, 512);
    softshadow *handle = ask_handle(&q);
    ask_query(handle, &q);
    for (int i = 0; i < N; i++) {
        const double e = q.visibility[i] - oracle_union(&mesh, &q.light, points[i], NULL);
        sum += e * e, most = fmax(most, fabs(e));
    }
    const double rms = sqrt(sum / N);
    const softshadow_points batch = ask_points((const double(*)[3])points, N);
    softshadow_error error = SOFTSHADOW_ERROR_INIT;
    OK(handle, softshadow_measure_error(handle, &batch, &error));
    print_message("           RMS %.5f, measured %.5f; reference %.5f\n", rms, error.rms,
                  error.reference_error);
    CHECK(error.points == N, "%llu points", (unsigned long long)error.points);
    CHECK(error.rms <= error.max && error.p99 <= error.max && fabs(error.mean) <= error.rms,
          "order");
    CHECK(error.reference_error > 0 && error.reference_error < 1.0 / 512, "reference %g",
          error.reference_error);
    /* The reference's own error adds to the method's; it may hide or double a part of it. */
    CHECK(fabs(error.rms - rms) <= 2 * error.reference_error, "measured %g, true %g", error.rms,
          rms);
    CHECK(fabs(error.max - most) <= 10 * error.reference_error, "measured %g, true %g", error.max,
          most);
    error.max_points = 50, error.samples = 256;
    OK(handle, softshadow_measure_error(handle, &batch, &error));
    CHECK(error.points > 0 && error.points <= 50, "%llu of 50", (unsigned long long)error.points);
    softshadow_destroy(handle);
    ask_free(&q);
    scene_free(&mesh);
}

static void explanations_show_what_hides(void **state) {
    enum { SIZE = 96 };
    static float image[SIZE * SIZE];
    static uint64_t hider[SIZE * SIZE];
    scene_mesh mesh = thing(21);
    double points[16][3];
    scene_grid(points, 4, -1.5, 1.5, -1.5, 1.5, 0);
    for (int scene = 0; scene < 3; scene++) {
        ask q = ask_new(*state, &mesh, *light_of(scene), (const double(*)[3])points, 16, 256);
        softshadow *handle = ask_handle(&q);
        for (int i = 0; i < 16; i++) {
            softshadow_explanation e = SOFTSHADOW_EXPLANATION_INIT;
            memcpy(e.point, points[i], sizeof e.point);
            e.size = SIZE, e.image = image, e.hider = hider;
            OK(handle, softshadow_explain(handle, &e));
            const double truth = oracle_union(&mesh, &q.light, points[i], NULL);
            /* Pixels cut by a dozen edges: each is off by a half at most. */
            CHECK(fabs(e.visibility - truth) < 0.01, "light %d, point %d: %g, truth %g", scene, i,
                  e.visibility, truth);
            size_t seen = 0, part = 0;
            for (int k = 0; k < SIZE * SIZE; k++) {
                if (isnan(image[k])) continue;
                part++, seen += image[k] == 1;
                CHECK(image[k] == 0 || image[k] == 1, "pixel %d: %g", k, image[k]);
                CHECK((image[k] == 0) == (hider[k] != SOFTSHADOW_NO_PRIMITIVE), "pixel %d", k);
                CHECK(image[k] == 1 || hider[k] < mesh.triangles, "pixel %d: mesh %llu", k,
                      (unsigned long long)(hider[k] >> 32));
            }
            CHECK(fabs((double)seen / (double)part - e.visibility) < 1e-5, "%zu of %zu", seen,
                  part);
            CHECK((e.triangles == 0) == (seen == part), "%llu triangles",
                  (unsigned long long)e.triangles);
        }
        softshadow_destroy(handle);
    }
    scene_free(&mesh);
}

int main(void) {
    const ask_test tests[] = {
        {"more samples come closer", more_samples_come_closer, ask_noise_free},
        {"measured errors are the errors", measured_errors_are_the_errors, NULL},
        {"explanations show what hides", explanations_show_what_hides, NULL},
    };
    return ask_run("measures", tests, COUNT(tests));
}
