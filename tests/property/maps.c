/* The map techniques: what their papers promise and what every map must keep. Through the public
 * header only. */
#include "maps.h"

static const char *const outer[] = {"penumbra-map", "smoothie"};
static const char *const maps[] = {
    "hard",         "pcf", "penumbra-map", "smoothie", "penumbra-limit", "penumbra-volume",
    "penumbra-mask"};

enum { ACROSS = 2001 };
/* The signed distance of the edge from the light's centre, in radii, > 0: the centre is seen. */
static double t_of(int i) { return maps_t((size_t)i, ACROSS); }

/* Must hold 1: 0 where the centre is hidden, E(2t - 1) beyond, to 1/64; E is closed form 1. */
static void test_straight_edge(void **state) {
    (void)state;
    scene_mesh mesh = maps_half_plane();
    /* a light of radius .25 at z = 4: the edge at 1 makes a half width of .25 / 3 on the ground */
    const struct {
        const char *name;
        softshadow_light light;
        double half_width;
    } lights[] = {
        {"disk", scene_disk_light(0, 0, 4, 0, 0, -1, .25), .25 / 3},
        {"sphere", scene_sphere_light(0, 0, 4, .25), .25 / 3},
        {"sun", scene_sun_light(0, 0, -1, atan(.1)), .1},
        {"rect of that area",
         scene_rect_light(0, 0, 4, .25 * sqrt(SCENE_PI) / 2, .25 * sqrt(SCENE_PI) / 2), .25 / 3},
    };
    for (size_t m = 0; m < COUNT(outer); m++) {
        for (size_t l = 0; l < COUNT(lights); l++) {
            ask q =
                maps_across(outer[m], &mesh, lights[l].light, lights[l].half_width, .05, ACROSS);
            ask_do(&q);
            double worst = 0;
            for (int i = 0; i < ACROSS; i++) {
                const double t = t_of(i), truth = t <= 0 ? 0 : oracle_edge(2 * t - 1);
                worst = fmax(worst, fabs(q.visibility[i] - truth));
            }
            print_message("%s, %s: worst %.5f\n", outer[m], lights[l].name, worst);
            CHECK(worst <= 1.0 / 64, "%s, %s: off by %g", outer[m], lights[l].name, worst);
            ask_free(&q);
        }
    }
    scene_free(&mesh);
}

/* Must hold 1: both penumbrae, to 1/128; and so at any resolution: the limit is a plane. A tilted
 * edge under a sun, slope m along itself, makes t / sqrt(1 + m^2 tan^2 alpha t^2) of t. */
static void test_limit_straight_edge(void **state) {
    (void)state;
    const double slopes[] = {0, .5};
    for (int s = 0; s < 2; s++) {
        scene_mesh mesh = {0};
        for (int i = 0; i < 4; i++) {
            const double y = i & 1 ? 1.5 : -1.5;
            scene_vertex(&mesh, i & 2 ? 0 : -3, y, 1 + slopes[s] * y);
        }
        scene_triangle(&mesh, 0, 1, 2), scene_triangle(&mesh, 1, 2, 3);
        const softshadow_light lights[] = {scene_disk_light(0, 0, 4, 0, 0, -1, .25),
                                           scene_sun_light(0, 0, -1, atan(.1)),
                                           scene_sphere_light(0, 0, 4, .25)};
        for (size_t l = 0; l < COUNT(lights); l++) {
            if (s && l != 1) continue;
            for (uint32_t side = 16; side <= 1024; side *= 4) {
                const double half = l == 1 ? .1 : .25 / 3;
                ask q = maps_across("penumbra-limit", &mesh, lights[l], half, 0, ACROSS);
                q.build.resolution = side;
                ask_do(&q);
                double worst = 0;
                for (int i = 0; i < ACROSS; i++) {
                    const double t = t_of(i), m = slopes[s] * .1;
                    /* t: how far the light's centre is past the edge, along the ground */
                    const double truth = oracle_edge(t / sqrt(1 + m * m * t * t));
                    worst = fmax(worst, fabs(q.visibility[i] - truth));
                }
                print_message("slope %g light %zu %u^2: worst %.5f\n", slopes[s], l, side, worst);
                CHECK(worst <= 1.0 / 128, "slope %g, light %zu, %u^2: off by %g", slopes[s], l,
                      side, worst);
                ask_free(&q);
            }
        }
        scene_free(&mesh);
    }
}

/* What the falloff names say, where the coordinate is 1/4, 1/2, 3/4. */
static void test_falloffs(void **state) {
    (void)state;
    scene_mesh mesh = maps_half_plane();
    const softshadow_light light = scene_disk_light(0, 0, 4, 0, 0, -1, .25);
    for (size_t m = 0; m < COUNT(outer); m++) {
        for (uint32_t f = SOFTSHADOW_FALLOFF_DISK; f <= SOFTSHADOW_FALLOFF_PROFILE; f++) {
            ask q = maps_across(outer[m], &mesh, light, .25 / 3, .05, ACROSS);
            q.build.falloff = f;
            ask_do(&q);
            for (int i = 0; i < ACROSS; i++) {
                const double l = fmin(fmax(t_of(i), 0), 1);
                const double paper =
                    m == 0 ? 3 * l * l - 2 * l * l * l : (1 - cos(SCENE_PI * l)) / 2;
                const double truth = f == SOFTSHADOW_FALLOFF_LINEAR  ? l
                                     : f == SOFTSHADOW_FALLOFF_PAPER ? paper
                                                                     : oracle_edge(2 * l - 1);
                CHECK(fabs(q.visibility[i] - truth) <= 1.0 / 64, "%s falloff %u t %g: %g, not %g",
                      outer[m], f, t_of(i), (double)q.visibility[i], truth);
            }
            ask_free(&q);
        }
    }
    scene_free(&mesh);
}

/* ---- a body over the ground ----------------------------------------------------------------- */

static ask over_ground(const char *method, const scene_mesh *mesh, softshadow_light light,
                       uint32_t resolution) {
    return maps_over_ground(method, mesh, light, 96, 2, resolution);
}

/* Must hold 5: the umbra is the hard shadow however large the light is; its error is told. */
static void test_umbra_stays(void **state) {
    (void)state;
    scene_mesh mesh = maps_body();
    for (size_t m = 0; m < COUNT(outer); m++) {
        size_t hard = 0;
        for (int step = 0; step < 4; step++) {
            const double radius = step == 0 ? 1e-6 : .15 * step;
            ask q = over_ground(outer[m], &mesh, scene_sphere_light(1, .6, 4, radius), 512);
            ask truth = over_ground("exact", &mesh, scene_sphere_light(1, .6, 4, radius), 0);
            truth.build.samples = 512;
            ask_do(&q), ask_do(&truth);
            const size_t dark = maps_dark(&q, 0);
            if (step == 0) hard = dark;
            print_message("%s radius %.2f: umbra %zu, truth's %zu, RMS error %.4f\n", outer[m],
                          radius, dark, maps_dark(&truth, 0), maps_rms(&q, &truth));
            /* a filter of 2 x 2 texels moves the umbra's rim by half a texel: .4 % of its points
             * here; twice that, as a row of points may lie along the rim */
            CHECK(fabs((double)dark - (double)hard) <= .008 * (double)hard,
                  "%s radius %g: umbra %zu, hard %zu", outer[m], radius, dark, hard);
            ask_free(&q), ask_free(&truth);
        }
    }
    scene_free(&mesh);
}

/* What a nearer caster hides adds nothing: its rim's penumbra comes out from under that, where the
 * nearer rim's is the darker. */
static void test_hidden_rim(void **state) {
    (void)state;
    const softshadow_light lights[] = {scene_disk_light(0, 0, 4, 0, 0, -1, .25),
                                       scene_sun_light(0, 0, -1, atan(.1))};
    for (size_t k = 0; k < 2 * COUNT(outer); k++) {
        const char *method = outer[k / 2];
        scene_mesh mesh = maps_half_plane();
        ask alone = maps_across(method, &mesh, lights[k % 2], .1, .05, ACROSS);
        ask_do(&alone);
        scene_rect(&mesh, -3, -.03, -3, 3, .7);
        ask both = maps_across(method, &mesh, lights[k % 2], .1, .05, ACROSS);
        ask_do(&both);
        double worst = 0;
        for (int i = 0; i < ACROSS; i++)
            worst = fmax(worst, fabs(both.visibility[i] - alone.visibility[i]));
        CHECK(worst <= 1e-4, "%s: a hidden rim changes %g", method, worst);
        ask_free(&alone), ask_free(&both), scene_free(&mesh);
    }
}

/* Four edges meet at the corner of a plate that a triangle hangs from, which nobody sees: the
 * penumbra around the corner, outside of one and inside of the other, is the plate's alone. */
static void test_crowded_corner(void **state) {
    (void)state;
    static const char *const methods[] = {"penumbra-map", "smoothie", "penumbra-volume",
                                          "penumbra-mask", "penumbra-limit"};
    for (size_t k = 0; k < 2 * COUNT(methods); k++) {
        const char *method = methods[k / 2];
        const bool inner = k % 2;
        scene_mesh mesh = {0};
        scene_rect(&mesh, -3, 0, -3, 0, 1);
        if (inner) scene_rect(&mesh, -3, 0, 0, 3, 1), scene_rect(&mesh, 0, 3, -3, 0, 1);
        const softshadow_light light = scene_disk_light(0, 0, 4, 0, 0, -1, .5);
        ask alone = maps_over_ground(method, &mesh, light, 96, 2, 1024);
        ask_do(&alone);
        const uint32_t first = (uint32_t)mesh.vertices;
        scene_vertex(&mesh, 0, 0, 1);
        scene_vertex(&mesh, -1, -.8, .5);
        scene_vertex(&mesh, -.8, -1, .5);
        scene_triangle(&mesh, first, first + 1, first + 2);
        ask both = maps_over_ground(method, &mesh, light, 96, 2, 1024);
        ask_do(&both);
        size_t penumbra = 0, changed = 0;
        for (size_t i = 0; i < alone.count; i++) {
            changed += fabs(both.visibility[i] - alone.visibility[i]) > 1e-3;
            penumbra += alone.visibility[i] > 0 && alone.visibility[i] < 1;
        }
        CHECK(penumbra > 100, "%s: there is no penumbra", method);
        /* where the triangle begins it is no deeper than the plate: 8 points at most are its own */
        CHECK(changed <= (inner ? 10 : 0), "%s, %s corner: a triangle that hangs from it "
              "changes %zu of %zu points", method, inner ? "inner" : "outer", changed, penumbra);
        ask_free(&alone), ask_free(&both), scene_free(&mesh);
    }
}

/* Look-ups are compiled for each instruction set: the same bits, for points in any number. */
static void test_rungs(void **state) {
    (void)state;
    static const char *const names[] = {"hard", "penumbra-map", "smoothie", "penumbra-limit"};
    static const char *const rungs[] = {"scalar", "avx2", "avx512"};
    scene_mesh mesh = maps_body();
    for (size_t m = 0; m < COUNT(names); m++) {
        ask least = over_ground(names[m], &mesh, scene_sphere_light(1, .6, 4, .3), 256);
        setenv("SOFTSHADOW_CPU", rungs[0], 1);
        ask_do(&least);
        for (size_t r = 1; r < COUNT(rungs); r++) {
            ask more = over_ground(names[m], &mesh, scene_sphere_light(1, .6, 4, .3), 256);
            more.count -= r; /* no whole blocks at the end */
            setenv("SOFTSHADOW_CPU", rungs[r], 1);
            ask_do(&more);
            CHECK(memcmp(least.visibility, more.visibility, more.count * sizeof(float)) == 0,
                  "%s: %s is not as %s", names[m], rungs[r], rungs[0]);
            ask_free(&more);
        }
        ask_free(&least);
    }
    unsetenv("SOFTSHADOW_CPU");
    scene_free(&mesh);
}

/* Must hold 6: the light shrinks to a point, and every technique to the hard shadow. */
static void test_radius_to_zero(void **state) {
    (void)state;
    scene_mesh mesh = maps_body();
    for (size_t m = 0; m < COUNT(maps); m++) {
        ask hard = over_ground("hard", &mesh, scene_sphere_light(1, .6, 4, 0), 512);
        ask point = over_ground(maps[m], &mesh, scene_sphere_light(1, .6, 4, 0), 512);
        ask small = over_ground(maps[m], &mesh, scene_sphere_light(1, .6, 4, 1e-4), 512);
        ask_do(&hard), ask_do(&point), ask_do(&small);
        size_t off = 0;
        for (size_t i = 0; i < hard.count; i++) {
            if (m != 1) CHECK(point.visibility[i] == 0 || point.visibility[i] == 1, "%s", maps[m]);
            off += fabsf(small.visibility[i] - hard.visibility[i]) > .5f;
        }
        /* nothing but texels that the outline crosses */
        CHECK(off * 200 < hard.count, "%s: %zu of %zu differ", maps[m], off, hard.count);
        CHECK(maps_rms(&point, &hard) < .06, "%s: point light off by %g", maps[m],
              maps_rms(&point, &hard));
        CHECK(point.stats.silhouette_edges == 0, "%s: a point light needs no silhouettes", maps[m]);
        ask_free(&hard), ask_free(&point), ask_free(&small);
    }
    scene_free(&mesh);
}

/* Must hold 6: more texels, no more error: against the technique's own limit, the finest map. */
static void test_resolution(void **state) {
    (void)state;
    scene_mesh mesh = maps_body();
    for (size_t m = 0; m < COUNT(maps); m++) {
        ask fine = over_ground(maps[m], &mesh, scene_sphere_light(1, .6, 4, .2), 4096);
        fine.build.mask_taps = 32; /* so that noise is no error */
        ask_do(&fine);
        double before = 1;
        for (uint32_t side = 64; side <= 1024; side *= 2) {
            ask q = over_ground(maps[m], &mesh, scene_sphere_light(1, .6, 4, .2), side);
            q.build.mask_taps = 32;
            ask_do(&q);
            const double error = maps_rms(&q, &fine);
            print_message("%s %4u^2: %.4f\n", maps[m], side, error);
            /* below 1e-3 it is how the two grids happen to lie */
            CHECK(error <= fmax(before, 1e-3), "%s %u: %g after %g", maps[m], side, error, before);
            before = error;
            ask_free(&q);
        }
        ask_free(&fine);
    }
    scene_free(&mesh);
}

/* ---- where things are odd ------------------------------------------------------------------- */

/* Acne: points on the lit side of a body never shadow themselves; on the other they are dark. */
static void test_acne(void **state) {
    (void)state;
    static maps_ball ball;
    const double to[3] = {1, .6, 4};
    maps_ball_make(&ball, to);
    for (size_t m = 0; m < COUNT(maps); m++) {
        ask q = ask_new(maps[m], &ball.mesh, scene_sphere_light(to[0], to[1], to[2], .05),
                        (const double(*)[3])ball.points, MAPS_BALL, 0);
        q.normals = (const float(*)[3])ball.normals;
        ask_do(&q);
        size_t lit = 0, acne = 0, dark = 0, leaks = 0;
        for (int i = 0; i < MAPS_BALL; i++) {
            if (ball.cosine[i] > .15) lit++, acne += q.visibility[i] < 1;
            if (ball.cosine[i] < -.15) dark++, leaks += q.visibility[i] > 0;
        }
        print_message("%s: acne %zu of %zu, leaks %zu of %zu\n", maps[m], acne, lit, leaks, dark);
        CHECK(acne == 0 && leaks == 0, "%s: acne %zu of %zu, leaks %zu of %zu", maps[m], acne, lit,
              leaks, dark);
        ask_free(&q);
    }
    scene_free(&ball.mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_straight_edge),  cmocka_unit_test(test_limit_straight_edge),
        cmocka_unit_test(test_falloffs),       cmocka_unit_test(test_umbra_stays),
        cmocka_unit_test(test_hidden_rim),     cmocka_unit_test(test_crowded_corner),
        cmocka_unit_test(test_rungs),
        cmocka_unit_test(test_radius_to_zero), cmocka_unit_test(test_resolution),
        cmocka_unit_test(test_acne),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
