/* Cournia's two techniques, penumbra-volume and penumbra-mask: what the thesis promises and what every
 * map must keep. Through the public header only. */
#include "ask.h"
#include "oracle/oracle.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

/* ---- straight edges -------------------------------------------------------------------------- */

/* A half plane at z = 1 that ends at x = 0, a light above the edge, points on a line across. */
enum { ACROSS = 1001 };
static double line[ACROSS][3];
static double t_of(int i) { return -1.5 + 3.0 * i / (ACROSS - 1); }

static ask straight(const char *method, const scene_mesh *mesh, softshadow_light light,
                    double half) {
    static double bounds[6];
    for (int i = 0; i < ACROSS; i++) {
        line[i][0] = t_of(i) * half, line[i][1] = .05 * half, line[i][2] = 0;
    }
    ask q = ask_new(method, mesh, light, (const double(*)[3])line, ACROSS, 0);
    memcpy(bounds, (double[6]){-1.5 * half, -half, 0, 1.5 * half, half, 0}, sizeof bounds);
    q.build.resolution = 1024, q.build.bounds = bounds;
    return q;
}

static const double same_area = .25 * .886226925452758; /* sqrt(pi) / 2 */

typedef struct edge_case {
    const char *name;
    softshadow_light light;
    double half; /* of the penumbra on the ground */
} edge_case;

/* Must hold 1: to 1/128 across the whole penumbra. */
static void test_volume_straight_edge(void **state) {
    (void)state;
    scene_mesh mesh = {0};
    scene_rect(&mesh, -3, 0, -3, 3, 1);
    const edge_case cases[] = {
        {"disk", scene_disk_light(0, 0, 4, 0, 0, -1, .25), .25 / 3},
        {"sphere", scene_sphere_light(0, 0, 4, .25), .25 / 3},
        {"sun", scene_sun_light(0, 0, -1, atan(.1)), .1},
        {"rect of that area", scene_rect_light(0, 0, 4, same_area, same_area), .25 / 3},
    };
    for (size_t l = 0; l < COUNT(cases); l++) {
        ask q = straight("penumbra-volume", &mesh, cases[l].light, cases[l].half);
        ask_do(&q);
        double worst = 0;
        for (int i = 0; i < ACROSS; i++) {
            worst = fmax(worst, fabs(q.visibility[i] - oracle_edge(t_of(i))));
        }
        print_message("penumbra-volume, %s: worst %.5f\n", cases[l].name, worst);
        CHECK(worst <= 1.0 / 128, "%s: off by %g", cases[l].name, worst);
        ask_free(&q);
    }
    scene_free(&mesh);
}

/* The cut is exact whatever the edge, the light and the point are: crooked ones, at any resolution that
 * tells which edge it is. */
static void test_volume_crooked_edge(void **state) {
    (void)state;
    const softshadow_light lights[] = {scene_disk_light(.8, -.4, 4, .3, .1, -1, .4),
                                       scene_sphere_light(1.5, -1, 3, .6),
                                       scene_sun_light(.3, .2, -1, .15)};
    const double corners[4][3] = {{0, -4, .2}, {.6, 4, 2.2}, {-6, 4, 2.5}, {-6, -4, .3}};
    enum { N = 40 };
    static double points[N * N][3];
    scene_mesh mesh = {0};
    scene_quad(&mesh, corners);
    for (size_t l = 0; l < COUNT(lights); l++) {
        scene_grid(points, N, l == 2 ? -.3 : -1.5, l == 2 ? 1.2 : .9, -.5, .5, 0);
        for (int i = 0; i < N * N; i++) points[i][2] = -.3 * sin(7.0 * i);
        for (uint32_t side = 128; side <= 1024; side *= 8) {
            ask q = ask_new("penumbra-volume", &mesh, lights[l], (const double(*)[3])points, N * N, 0);
            double worst = 0;
            size_t soft = 0;
            q.build.resolution = side;
            ask_do(&q);
            for (size_t i = 0; i < q.count; i++) {
                const double truth = oracle_union(&mesh, &lights[l], points[i], NULL);
                soft += truth > .01 && truth < .99;
                worst = fmax(worst, fabs(q.visibility[i] - truth));
            }
            print_message("light %zu, %u^2: worst %.6f, %zu in penumbra\n", l, side, worst, soft);
            CHECK(soft > N * N / 16 && worst < 1e-3, "light %zu, %u^2: off by %g", l, side, worst);
            ask_free(&q);
        }
    }
    scene_free(&mesh);
}

/* falloff=paper: k of a disk across the plane, t = s / r, then 3 k^2 - 2 k^3; linear: a square light. */
static void test_volume_falloffs(void **state) {
    (void)state;
    scene_mesh mesh = {0};
    scene_rect(&mesh, -3, 0, -3, 3, 1);
    const softshadow_light light = scene_disk_light(0, 0, 4, 0, 0, -1, .25);
    for (uint32_t f = SOFTSHADOW_FALLOFF_DISK; f <= SOFTSHADOW_FALLOFF_PROFILE; f++) {
        ask q = straight("penumbra-volume", &mesh, light, .25 / 3);
        q.build.falloff = f;
        ask_do(&q);
        for (int i = 0; i < ACROSS; i++) {
            /* the plane through the point leans: s = offset sin of its angle */
            const double x = t_of(i) * .25 / 3, s = -3 * x * cos(atan(x)) / .25;
            const double k = oracle_edge(-s), l = fmin(fmax(t_of(i) / 2 + .5, 0), 1);
            const double truth = f == SOFTSHADOW_FALLOFF_LINEAR  ? l
                                 : f == SOFTSHADOW_FALLOFF_PAPER ? k * k * (3 - 2 * k)
                                                                 : oracle_edge(t_of(i));
            CHECK(fabs(q.visibility[i] - truth) <= 1.0 / 512, "falloff %u t %g: %g, not %g", f,
                  t_of(i), (double)q.visibility[i], truth);
        }
        ask_free(&q);
    }
    scene_free(&mesh);
}

/* ---- bodies over the ground ------------------------------------------------------------------ */

enum { SIDE = 96 };
static double ground[SIDE * SIDE][3];

static ask over_ground(const char *method, const scene_mesh *mesh, softshadow_light light,
                       uint32_t side) {
    static const double bounds[6] = {-2, -2, 0, 2, 2, 0};
    scene_grid(ground, SIDE, -2, 2, -2, 2, 0);
    ask q = ask_new(method, mesh, light, (const double(*)[3])ground, SIDE * SIDE, 0);
    q.build.resolution = side, q.build.bounds = bounds;
    return q;
}

static double rms(const ask *a, const ask *b) {
    double sum = 0;
    for (size_t i = 0; i < a->count; i++) {
        const double d = a->visibility[i] - b->visibility[i];
        sum += d * d;
    }
    return sqrt(sum / (double)a->count);
}

static scene_mesh body(void) {
    scene_mesh mesh = {0};
    const double centre[3] = {0, 0, 1};
    scene_icosphere(&mesh, centre, .6, 3, .3);
    return mesh;
}

/* Against the truth: no worse with more texels, up to what a single edge and a single silhouette make
 * of a lumpy body (.018 to .021, however fine the map is: .003 is how its folds happen to lie in the
 * texels). Less than a third of what a technique without an inner penumbra is off by. */
static void test_volume_accuracy(void **state) {
    (void)state;
    scene_mesh mesh = body();
    const softshadow_light light = scene_sphere_light(1, .6, 4, .2);
    ask truth = over_ground("exact", &mesh, light, 0), outer;
    truth.build.samples = 1024;
    ask_do(&truth);
    outer = over_ground("penumbra-map", &mesh, light, 1024);
    ask_do(&outer);
    const double bad = rms(&outer, &truth);
    double before = 1, error = 1;
    for (uint32_t side = 64; side <= 2048; side *= 2) {
        ask q = over_ground("penumbra-volume", &mesh, light, side);
        ask_do(&q);
        error = rms(&q, &truth);
        print_message("penumbra-volume %4u^2: RMS %.4f (penumbra-map, 1024^2: %.4f)\n", side, error,
                      bad);
        CHECK(error <= before + .003, "%u^2: %g after %g", side, error, before);
        before = error;
        ask_free(&q);
    }
    CHECK(error < .025 && error < bad / 3, "RMS %g, penumbra-map %g", error, bad);
    ask_free(&truth), ask_free(&outer);
    scene_free(&mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_volume_straight_edge),
        cmocka_unit_test(test_volume_crooked_edge),
        cmocka_unit_test(test_volume_falloffs),
        cmocka_unit_test(test_volume_accuracy),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
