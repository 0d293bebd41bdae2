/* The map techniques that look at an area of texels: backprojection, pcss, single-sample. What
 * their papers promise and what every map must keep. Through the public header only. */
#include "maps.h"

static const char *const area[] = {"backprojection", "pcss", "single-sample"};

/* ---- a straight edge ------------------------------------------------------------------------- */

enum { ACROSS = 401 };
static double t_of(int i) { return maps_t((size_t)i, ACROSS); }

/* What a straight edge leaves of the light, or of its inner half; t as in closed form 1. */
static double edge_truth(const char *method, bool rect, double t) {
    if (strcmp(method, "single-sample") == 0) return t >= 0 ? 1 : oracle_edge(2 * (1 + t) - 1);
    return rect ? fmin(fmax((1 + t) / 2, 0), 1) : oracle_edge(t);
}

/* Must hold 1: backprojection to 1/32; with one depth pcss is as good, and single-sample exact
 * inside. */
static void test_straight_edge(void **state) {
    (void)state;
    scene_mesh mesh = maps_half_plane();
    const double same = .25 * sqrt(SCENE_PI) / 2; /* single-sample takes a rect as a disk */
    const struct {
        const char *name;
        softshadow_light light;
        double half;
        bool rect;
    } lights[] = {
        {"disk", scene_disk_light(0, 0, 4, 0, 0, -1, .25), .25 / 3, false},
        {"sphere", scene_sphere_light(0, 0, 4, .25), .25 / 3, false},
        {"sun", scene_sun_light(0, 0, -1, atan(.1)), .1, false},
        {"rect", scene_rect_light(0, 0, 4, .25, .125), .25 / 3, true},
        {"rect of that area", scene_rect_light(0, 0, 4, same, same), same / 3, true},
    };
    for (size_t m = 0; m < COUNT(area); m++) {
        for (size_t l = 0; l < COUNT(lights); l++) {
            const bool round = m == 2;
            if (round && l == 3) continue;
            const double half = round && l == 4 ? .25 / 3 : lights[l].half;
            ask q = maps_across(area[m], &mesh, lights[l].light, half, .05, ACROSS);
            ask_do(&q);
            double worst = 0;
            for (int i = 0; i < ACROSS; i++) {
                worst = fmax(worst,
                             fabs(q.visibility[i] - edge_truth(area[m], lights[l].rect, t_of(i))));
            }
            print_message("%s, %s: worst %.5f\n", area[m], lights[l].name, worst);
            CHECK(worst <= 1.0 / 32, "%s, %s: off by %g", area[m], lights[l].name, worst);
            ask_free(&q);
        }
    }
    scene_free(&mesh);
}

/* A small rectangle before lights that stand crooked to it, against the exact area. */
static void test_crooked_lights(void **state) {
    (void)state;
    scene_mesh mesh = {0};
    scene_rect(&mesh, -.2, .2, -.1, .3, 1);
    softshadow_light turned = scene_rect_light(0, 0, 4, .5, .3);
    const double c = cos(.5), s = sin(.5);
    memcpy(turned.u, (double[3]){.5 * c, .5 * s, 0}, sizeof turned.u);
    memcpy(turned.v, (double[3]){.3 * s, -.3 * c, 0}, sizeof turned.v);
    const softshadow_light lights[] = {turned, scene_disk_light(.8, -.4, 4, .3, .1, -1, .4),
                                       scene_sphere_light(1.5, -1, 3, .3),
                                       scene_sun_light(.3, .2, -1, .1)};
    enum { N = 24 };
    static double points[N * N][3];
    for (size_t l = 0; l < COUNT(lights); l++) {
        const double x = l == 1 ? -.27 : l == 2 ? -.75 : l == 3 ? .3 : 0;
        const double y = l == 1 ? .13 : l == 2 ? .5 : l == 3 ? .2 : 0;
        scene_grid(points, N, x - .7, x + .7, y - .6, y + .8, 0);
        for (size_t m = 0; m < 2; m++) {
            ask q = ask_new(area[m], &mesh, lights[l], (const double(*)[3])points, N * N, 0);
            double worst = 0;
            size_t soft = 0;
            ask_do(&q);
            for (size_t i = 0; i < q.count; i++) {
                const double truth = oracle_union(&mesh, &lights[l], points[i], NULL);
                soft += truth > 0 && truth < 1;
                worst = fmax(worst, fabs(q.visibility[i] - truth));
            }
            print_message("%s, crooked light %zu: worst %.5f, %zu in penumbra\n", area[m], l, worst,
                          soft);
            /* seen through a tilt, the light is moved into the map's plane to first order in its
             * size over its distance, a tenth here; pcss has one depth for what is tilted to the
             * map */
            const double most = m == 1 && l == 2 ? 1.0 / 12 : 1.0 / 32;
            CHECK(soft > N * N / 10 && worst <= most, "%s, light %zu: off by %g", area[m], l,
                  worst);
            ask_free(&q);
        }
    }
    scene_free(&mesh);
}

/* ---- hair ------------------------------------------------------------------------------------ */

/* Strands as upright and lying ribbons that cross one another, and a head below them. */
static scene_mesh hair(void) {
    scene_mesh mesh = {0};
    uint64_t seed = 11;
    const double centre[3] = {0, 0, .8};
    scene_icosphere(&mesh, centre, .25, 3, 0);
    for (int i = 0; i < 500; i++) {
        double from[3], to[3], along[3], across[3], corner[4][3];
        scene_direction(&seed, from);
        scene_direction(&seed, to);
        for (int k = 0; k < 3; k++) {
            const double middle = k == 2 ? 1 : 0;
            along[k] = .6 * to[k];
            from[k] = middle + .7 * from[k] * (k == 2 ? .6 : 1);
        }
        /* across the strand, level: its broad side looks up as far as it can */
        across[0] = -along[1], across[1] = along[0], across[2] = 0;
        const double wide = hypot(across[0], across[1]);
        for (int k = 0; k < 3; k++) {
            const double w = .006 * across[k] / wide;
            corner[0][k] = from[k] - w, corner[1][k] = from[k] + w;
            corner[2][k] = from[k] + along[k] + w, corner[3][k] = from[k] + along[k] - w;
        }
        scene_quad(&mesh, (const double(*)[3])corner);
    }
    return mesh;
}

static ask over_ground(const char *method, const scene_mesh *mesh, softshadow_light light,
                       uint32_t resolution) {
    return maps_over_ground(method, mesh, light, 64, 1.4, resolution);
}

/* Mean of what is too bright, or too dark. */
static double excess(const ask *q, const ask *truth, double sign) {
    double sum = 0;
    for (size_t i = 0; i < q->count; i++) {
        sum += fmax(0, sign * (q->visibility[i] - truth->visibility[i]));
    }
    return sum / (double)q->count;
}

/* Must hold 3, [BCS06] figures 2 and 6: more layers, less bleeding; filled gaps darken. */
static void test_bleeding(void **state) {
    (void)state;
    scene_mesh mesh = hair();
    const softshadow_light lights[] = {scene_rect_light(.3, .2, 4, .4, .4),
                                       scene_sphere_light(.3, .2, 4, .45)};
    for (size_t l = 0; l < COUNT(lights); l++) {
        ask truth = over_ground("exact", &mesh, lights[l], 0), q[3];
        truth.build.samples = 512;
        ask_do(&truth);
        double bleed[3], dark[3];
        const char *const name[] = {"one layer", "three layers", "one layer, gaps filled"};
        for (int i = 0; i < 3; i++) {
            q[i] = over_ground("backprojection", &mesh, lights[l], 512);
            q[i].build.layers = i == 1 ? 3 : 1;
            q[i].build.falloff = i == 2 ? SOFTSHADOW_FALLOFF_PAPER : SOFTSHADOW_FALLOFF_DISK;
            ask_do(&q[i]);
            bleed[i] = excess(&q[i], &truth, 1), dark[i] = excess(&q[i], &truth, -1);
            print_message("light %zu, %s: bleeding %.5f, darkening %.5f\n", l, name[i], bleed[i],
                          dark[i]);
        }
        CHECK(bleed[0] > .004, "nothing bleeds with one layer: %g", bleed[0]);
        CHECK(bleed[1] <= bleed[0] / 2, "three layers bleed %g, one %g", bleed[1], bleed[0]);
        CHECK(dark[2] > dark[0] && dark[2] > dark[1], "filling darkens by %g, layers by %g and %g",
              dark[2], dark[0], dark[1]);
        for (int i = 0; i < 3; i++) ask_free(&q[i]);
        ask_free(&truth);
    }
    scene_free(&mesh);
}

/* ---- a body over the ground ------------------------------------------------------------------ */

/* Must hold 6: the light shrinks to a point, and every technique to the hard shadow. */
static void test_radius_to_zero(void **state) {
    (void)state;
    scene_mesh mesh = maps_body();
    for (size_t m = 0; m < COUNT(area); m++) {
        ask hard = over_ground("hard", &mesh, scene_sphere_light(1, .6, 4, 0), 512);
        ask point = over_ground(area[m], &mesh, scene_sphere_light(1, .6, 4, 0), 512);
        ask_do(&hard), ask_do(&point);
        CHECK(maps_rms(&point, &hard) < .04, "%s: point light off by %g", area[m],
              maps_rms(&point, &hard));
        double before = 1;
        for (double radius = .1; radius > 1e-13; radius *= 1e-4) {
            ask small = over_ground(area[m], &mesh, scene_sphere_light(1, .6, 4, radius), 512);
            ask_do(&small);
            const double off = maps_rms(&small, &hard);
            print_message("%s radius %g: RMS %.4f from hard\n", area[m], radius, off);
            /* the frame shrinks with the penumbra: texels on the outline fall to the other side */
            CHECK(off < fmax(before, .06), "%s radius %g: off by %g", area[m], radius, off);
            before = off;
            ask_free(&small);
        }
        CHECK(before < .06, "%s: off by %g", area[m], before);
        ask_free(&hard), ask_free(&point);
    }
    scene_free(&mesh);
}

/* Must hold 6: more texels, no more error: against the technique's own limit, the finest map. */
static void test_resolution(void **state) {
    (void)state;
    scene_mesh mesh = maps_body();
    const softshadow_light light = scene_sphere_light(1, .6, 4, .2);
    ask truth = over_ground("exact", &mesh, light, 0);
    truth.build.samples = 512;
    ask_do(&truth);
    for (size_t m = 0; m < COUNT(area); m++) {
        ask fine = over_ground(area[m], &mesh, light, 2048);
        ask_do(&fine);
        double before = 1;
        for (uint32_t side = 64; side <= 512; side *= 2) {
            ask q = over_ground(area[m], &mesh, light, side);
            ask_do(&q);
            const double error = maps_rms(&q, &fine);
            print_message("%s %4u^2: %.4f from 2048^2, %.4f from the truth\n", area[m], side, error,
                          maps_rms(&q, &truth));
            CHECK(error <= before, "%s %u: %g after %g", area[m], side, error, before);
            before = error;
            ask_free(&q);
        }
        ask_free(&fine);
    }
    ask_free(&truth);
    scene_free(&mesh);
}

/* Bounded work: fewer samples, nearly the same answer, down to a single one that is still an
 * answer. */
static void test_max_samples(void **state) {
    (void)state;
    scene_mesh mesh = maps_body();
    for (size_t m = 0; m < 2; m++) {
        const softshadow_light light = scene_sphere_light(1, .6, 4, .3);
        ask all = over_ground(area[m], &mesh, light, 256);
        ask_do(&all);
        const uint32_t limits[] = {400, 121, 25, 1};
        for (size_t i = 0; i < COUNT(limits); i++) {
            ask few = over_ground(area[m], &mesh, light, 256);
            few.build.max_samples = limits[i];
            ask_do(&few);
            print_message("%s, %u samples: RMS %.4f\n", area[m], limits[i], maps_rms(&few, &all));
            maps_in_range(&few);
            if (limits[i] >= 121)
                CHECK(maps_rms(&few, &all) < .03, "%s, %u: %g", area[m], limits[i],
                      maps_rms(&few, &all));
            ask_free(&few);
        }
        ask_free(&all);
    }
    scene_free(&mesh);
}

/* The same bits for any number of threads and any split. */
static void test_determinism(void **state) {
    (void)state;
    scene_mesh mesh = hair();
    for (size_t m = 0; m < COUNT(area); m++) {
        ask one = over_ground(area[m], &mesh, scene_sphere_light(.3, .2, 4, .3), 128);
        one.options.threads = 1;
        ask_do(&one);
        for (uint32_t threads = 2; threads <= 7; threads += 5) {
            ask many = over_ground(area[m], &mesh, scene_sphere_light(.3, .2, 4, .3), 128);
            many.options.threads = threads;
            softshadow *handle = ask_handle(&many);
            many.visibility = calloc(many.count, sizeof(float));
            for (size_t first = 0; first < many.count; first += 1009) {
                const size_t n = many.count - first < 1009 ? many.count - first : 1009;
                const softshadow_points part = ask_points(many.points + first, n);
                OK(handle, softshadow_query_visibility(handle, &part, many.visibility + first));
            }
            softshadow_destroy(handle);
            ask_same_bits(one.visibility, many.visibility, one.count, area[m]);
            ask_free(&many);
        }
        ask_free(&one);
    }
    scene_free(&mesh);
}

/* Surfaces that lie on one another are one layer: peeling ends, and the deeper ones are still
 * found. */
static void test_duplicates(void **state) {
    (void)state;
    const softshadow_light light = scene_sphere_light(1, .6, 4, .3);
    scene_mesh mesh = maps_body(), same = maps_body(), near = maps_body();
    for (int i = 0; i < 5; i++) {
        const double up = 1e-9 * (i + 1), shift[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, up};
        scene_mesh copy = maps_body();
        scene_append(&same, &copy);
        scene_transform(&copy, shift);
        scene_append(&near, &copy);
        scene_free(&copy);
    }
    for (size_t m = 0; m < COUNT(area); m++) {
        for (uint32_t layers = 1; layers <= 64; layers += 21) {
            ask one = over_ground(area[m], &mesh, light, 128),
                six = over_ground(area[m], &same, light, 128);
            ask close = over_ground(area[m], &near, light, 128);
            one.build.layers = six.build.layers = close.build.layers = layers;
            ask_do(&one), ask_do(&six), ask_do(&close);
            ask_same_bits(one.visibility, six.visibility, one.count, area[m]);
            CHECK(maps_rms(&one, &close) < .01,
                  "%s, %u layers: copies 1e-9 apart change answers by %g", area[m], layers,
                  maps_rms(&one, &close));
            ask_free(&one), ask_free(&six), ask_free(&close);
            if (m > 0) break; /* without layers */
        }
    }
    scene_free(&mesh), scene_free(&same), scene_free(&near);
}

/* ---- where things are odd -------------------------------------------------------------------- */

/* Acne: points on the lit side of a body never shadow themselves; on the dark side they are dark,
 * but where single-sample sees past the rim. */
static void test_acne(void **state) {
    (void)state;
    static maps_ball ball;
    const double to[3] = {1, .6, 4};
    maps_ball_make(&ball, to);
    for (size_t m = 0; m < COUNT(area); m++) {
        for (uint32_t layers = m == 0 ? 1 : 3; layers <= 3; layers += 2) {
            ask q = ask_new(area[m], &ball.mesh, scene_sphere_light(to[0], to[1], to[2], .05),
                            (const double(*)[3])ball.points, MAPS_BALL, 0);
            size_t lit = 0, acne = 0, dark = 0, leaks = 0;
            double most = 0;
            q.build.layers = layers;
            ask_do(&q);
            for (int i = 0; i < MAPS_BALL; i++) {
                if (ball.cosine[i] > .15) lit++, acne += q.visibility[i] < 1;
                if (ball.cosine[i] < -.15)
                    dark++, leaks += q.visibility[i] > 1.0 / 64, most = fmax(most, q.visibility[i]);
            }
            print_message("%s, %u layers: acne %zu of %zu, leaks %zu of %zu, most %g\n", area[m],
                          layers, acne, lit, leaks, dark, most);
            CHECK(acne == 0 && (m == 2 || leaks == 0),
                  "%s, %u layers: acne %zu of %zu, leaks %zu of %zu", area[m], layers, acne, lit,
                  leaks, dark);
            ask_free(&q);
        }
    }
    scene_free(&ball.mesh);
}

/* A wide light over a slope that casts, too: it must not darken itself, at any filter's width. */
static void test_slope(void **state) {
    (void)state;
    scene_mesh mesh = {0};
    const double corners[4][3] = {{-3, -3, -1.5}, {3, -3, 1.5}, {3, 3, 1.5}, {-3, 3, -1.5}};
    scene_quad(&mesh, corners);
    static double points[32 * 32][3];
    scene_grid(points, 32, -1, 1, -1, 1, 0);
    for (int i = 0; i < 32 * 32; i++) points[i][2] = .5 * points[i][0];
    for (size_t m = 0; m < COUNT(area); m++) {
        ask q = ask_new(area[m], &mesh, scene_sphere_light(0, 0, 5, 1), (const double(*)[3])points,
                        1024, 0);
        ask_do(&q);
        for (size_t i = 0; i < q.count; i++) {
            CHECK(q.visibility[i] == 1, "%s: %g %g %g: %g", area[m], points[i][0], points[i][1],
                  points[i][2], (double)q.visibility[i]);
        }
        ask_free(&q);
    }
    scene_free(&mesh);
}

/* Points on and very near to occluders, huge lights, sheets edge-on: numbers between 0 and 1. */
static void test_never_nan(void **state) {
    (void)state;
    scene_mesh mesh = {0};
    scene_garbage(&mesh, 9);
    enum { N = 3000 };
    static double points[N][3];
    uint64_t seed = 6;
    for (int i = 0; i < N; i++) {
        const double *v = mesh.xyz + 3 * (scene_random(&seed) % mesh.vertices);
        const double away = pow(10, scene_uniform(&seed, -16, 0));
        for (int k = 0; k < 3; k++)
            points[i][k] = v[k] + (i % 3 ? away * scene_uniform(&seed, -1, 1) : 0);
    }
    const softshadow_light lights[] = {
        scene_sphere_light(0, 0, 9, 3),          scene_sphere_light(0, 0, 2.5, 1.5),
        scene_disk_light(0, 0, 2.5, 1, 0, 0, 1), scene_rect_light(.1, .2, 2.5, 2, 1e-9),
        scene_sun_light(1, 0, 0, 1.3),           scene_sphere_light(1e6, 0, 1e6, 1e-6),
    };
    for (size_t m = 0; m < COUNT(area); m++) {
        for (size_t l = 0; l < COUNT(lights); l++) {
            ask q = ask_new(area[m], &mesh, lights[l], (const double(*)[3])points, N, 0);
            q.build.resolution = 64;
            ask_do(&q);
            maps_in_range(&q);
            ask_free(&q);
        }
    }
    scene_free(&mesh);
}

/* A limb-darkened disk behind a straight edge: closed form 2. */
static void test_profile(void **state) {
    (void)state;
    scene_mesh mesh = maps_half_plane();
    static float profile[64];
    const double u1 = .4, u2 = .3;
    for (int i = 0; i < 64; i++) profile[i] = (float)oracle_limb(i / 63.0, u1, u2);
    softshadow_light light = scene_disk_light(0, 0, 4, 0, 0, -1, .25);
    light.profile = profile, light.profile_count = 64;
    ask q = maps_across("backprojection", &mesh, light, .25 / 3, .05, ACROSS);
    double worst = 0;
    ask_do(&q);
    for (int i = 0; i < ACROSS; i++) {
        worst = fmax(worst, fabs(q.visibility[i] - oracle_limb_edge(t_of(i), u1, u2)));
    }
    print_message("limb-darkened disk: worst %.5f\n", worst);
    CHECK(worst <= 1.0 / 32, "off by %g", worst);
    ask_free(&q);
    scene_free(&mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_straight_edge), cmocka_unit_test(test_crooked_lights),
        cmocka_unit_test(test_bleeding),      cmocka_unit_test(test_radius_to_zero),
        cmocka_unit_test(test_resolution),    cmocka_unit_test(test_max_samples),
        cmocka_unit_test(test_determinism),   cmocka_unit_test(test_duplicates),
        cmocka_unit_test(test_acne),          cmocka_unit_test(test_slope),
        cmocka_unit_test(test_never_nan),     cmocka_unit_test(test_profile),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
