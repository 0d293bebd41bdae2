/* Cournia's two techniques, penumbra-volume and penumbra-mask: what the thesis promises and what
 * every map must keep. Through the public header only. */
#include "maps.h"

/* ---- straight edges -------------------------------------------------------------------------- */

enum { ACROSS = 1001 };
static double t_of(int i) { return maps_t((size_t)i, ACROSS); }

static const double same_area = .25 * .886226925452758; /* sqrt(pi) / 2 */

typedef struct edge_case {
    const char *name;
    softshadow_light light;
    double half; /* of the penumbra on the ground */
} edge_case;

/* Must hold 1: to 1/128 across the whole penumbra. */
static void test_volume_straight_edge(void **state) {
    (void)state;
    scene_mesh mesh = maps_half_plane();
    const edge_case cases[] = {
        {"disk", scene_disk_light(0, 0, 4, 0, 0, -1, .25), .25 / 3},
        {"sphere", scene_sphere_light(0, 0, 4, .25), .25 / 3},
        {"sun", scene_sun_light(0, 0, -1, atan(.1)), .1},
        {"rect of that area", scene_rect_light(0, 0, 4, same_area, same_area), .25 / 3},
    };
    for (size_t l = 0; l < COUNT(cases); l++) {
        ask q = maps_across("penumbra-volume", &mesh, cases[l].light, cases[l].half, .05, ACROSS);
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

/* The cut is exact whatever the edge, the light and the point are: crooked ones, at any resolution
 * that tells which edge it is. */
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
            ask q =
                ask_new("penumbra-volume", &mesh, lights[l], (const double(*)[3])points, N * N, 0);
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

/* falloff=paper: k of a disk across the plane, t = s / r, then 3 k^2 - 2 k^3; linear: a square
 * light. */
static void test_volume_falloffs(void **state) {
    (void)state;
    scene_mesh mesh = maps_half_plane();
    const softshadow_light light = scene_disk_light(0, 0, 4, 0, 0, -1, .25);
    for (uint32_t f = SOFTSHADOW_FALLOFF_DISK; f <= SOFTSHADOW_FALLOFF_PROFILE; f++) {
        ask q = maps_across("penumbra-volume", &mesh, light, .25 / 3, .05, ACROSS);
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

static ask over_ground(const char *method, const scene_mesh *mesh, softshadow_light light,
                       uint32_t resolution) {
    return maps_over_ground(method, mesh, light, SIDE, 2, resolution);
}

/* Against the truth: no worse with more texels, up to what a single edge and a single silhouette
 * make of a lumpy body (.018 to .021, however fine the map is: .003 is how its folds happen to lie
 * in the texels). Less than a third of what a technique without an inner penumbra is off by. */
static void test_volume_accuracy(void **state) {
    (void)state;
    scene_mesh mesh = maps_body();
    const softshadow_light light = scene_sphere_light(1, .6, 4, .2);
    ask truth = over_ground("exact", &mesh, light, 0), outer;
    truth.build.samples = 1024;
    ask_do(&truth);
    outer = over_ground("penumbra-map", &mesh, light, 1024);
    ask_do(&outer);
    const double bad = maps_rms(&outer, &truth);
    double before = 1, error = 1;
    for (uint32_t side = 64; side <= 2048; side *= 2) {
        ask q = over_ground("penumbra-volume", &mesh, light, side);
        ask_do(&q);
        error = maps_rms(&q, &truth);
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

/* ---- penumbra-mask --------------------------------------------------------------------------- */

/* One depth of edges, so the filter is the light: right on average, within what 64 jittered taps
 * make of it. Their spread is that of a cut through 8 x 8 cells, of which 8 or so are crossed:
 * sqrt(8) / 2 / 64 = .022; 1001 points go to four times that. A rect is native: a straight ramp. */
static void test_mask_straight_edge(void **state) {
    (void)state;
    scene_mesh mesh = maps_half_plane();
    const edge_case cases[] = {
        {"disk", scene_disk_light(0, 0, 4, 0, 0, -1, .25), .25 / 3},
        {"sphere", scene_sphere_light(0, 0, 4, .25), .25 / 3},
        {"sun", scene_sun_light(0, 0, -1, atan(.1)), .1},
        {"rect", scene_rect_light(0, 0, 4, .25, .125), .25 / 3},
    };
    for (size_t l = 0; l < COUNT(cases); l++) {
        ask q = maps_across("penumbra-mask", &mesh, cases[l].light, cases[l].half, .05, ACROSS);
        ask_do(&q);
        double worst = 0, sum = 0, squares = 0;
        for (int i = 0; i < ACROSS; i++) {
            const double t = t_of(i), ramp = fmin(fmax(t / 2 + .5, 0), 1);
            const double off = q.visibility[i] - (l == 3 ? ramp : oracle_edge(t));
            worst = fmax(worst, fabs(off)), sum += off, squares += off * off;
        }
        print_message("penumbra-mask, %s: mean %.5f, RMS %.5f, worst %.5f\n", cases[l].name,
                      sum / ACROSS, sqrt(squares / ACROSS), worst);
        CHECK(fabs(sum) / ACROSS <= 1.0 / 256, "%s: mean %g", cases[l].name, sum / ACROSS);
        CHECK(sqrt(squares / ACROSS) <= .022 && worst <= .088, "%s: RMS %g, worst %g",
              cases[l].name, sqrt(squares / ACROSS), worst);
        ask_free(&q);
    }
    scene_free(&mesh);
}

/* More taps, less noise; jitter is a function of the point and the seed. */
static void test_mask_taps(void **state) {
    (void)state;
    scene_mesh mesh = maps_body();
    const softshadow_light light = scene_sphere_light(1, .6, 4, .4);
    ask many = over_ground("penumbra-mask", &mesh, light, 512);
    many.build.mask_taps = 64;
    ask_do(&many);
    double before = 1;
    for (uint32_t taps = 2; taps <= 32; taps *= 2) {
        ask q = over_ground("penumbra-mask", &mesh, light, 512);
        q.build.mask_taps = taps;
        ask_do(&q);
        const double off = maps_rms(&q, &many);
        print_message("%u x %u taps: RMS %.5f from 64 x 64\n", taps, taps, off);
        CHECK(off < before, "%u taps: %g after %g", taps, off, before);
        before = off;
        ask seeded = over_ground("penumbra-mask", &mesh, light, 512);
        seeded.build.mask_taps = taps, seeded.build.seed = 1;
        ask_do(&seeded);
        CHECK(maps_rms(&seeded, &q) > off / 4, "%u taps: another seed gives the same", taps);
        ask_free(&q), ask_free(&seeded);
    }
    ask_free(&many);
    scene_free(&mesh);
}

/* Asks for the image that the ground's points are. */
static void ask_image(softshadow *handle, const ask *q, const uint32_t *ids, float *out) {
    softshadow_points points = ask_points(q->points, q->count);
    points.width = SIDE, points.ids = ids;
    OK(handle, softshadow_query_visibility(handle, &points, out));
}

/* The blur makes an image of 16 taps a point smoother than it was, the same for any number of
 * threads, and says what it did to the counts; without it, rows of an image are points like any
 * others. */
static void test_blur(void **state) {
    (void)state;
    scene_mesh mesh = maps_body();
    static float plain[SIDE * SIDE], smooth[SIDE * SIDE], again[SIDE * SIDE];
    const softshadow_light light = scene_sphere_light(1, .6, 4, .8);
    ask truth = over_ground("exact", &mesh, light, 0);
    truth.build.samples = 1024;
    ask_do(&truth);
    for (uint32_t threads = 1; threads <= 7; threads += 3) {
        ask q = over_ground("penumbra-mask", &mesh, light, 512);
        q.build.mask_taps = 2, q.build.blur = 0, q.options.threads = threads;
        softshadow *handle = ask_handle(&q);
        ask_query(handle, &q);
        ask_image(handle, &q, NULL, plain);
        ask_same_bits(q.visibility, plain, SIDE * SIDE, "rows without blur");
        softshadow_build build = q.build;
        build.method = "penumbra-mask", build.blur = 4;
        OK(handle, softshadow_build_maps(handle, &build));
        ask_image(handle, &q, NULL, threads == 1 ? smooth : again);
        if (threads > 1) ask_same_bits(smooth, again, SIDE * SIDE, "blur on more threads");
        softshadow_stats stats = SOFTSHADOW_STATS_INIT;
        OK(handle, softshadow_get_stats(handle, &stats));
        uint64_t lit = 0, dark = 0;
        for (int i = 0; i < SIDE * SIDE; i++) lit += smooth[i] == 1, dark += smooth[i] == 0;
        CHECK(stats.points_lit == lit && stats.points_umbra == dark &&
                  stats.points_penumbra == SIDE * SIDE - lit - dark,
              "counted %llu lit, %llu dark, not %llu, %llu", (unsigned long long)stats.points_lit,
              (unsigned long long)stats.points_umbra, (unsigned long long)lit,
              (unsigned long long)dark);
        ask_query(handle, &q); /* no rows, no blur */
        ask_same_bits(q.visibility, plain, SIDE * SIDE, "blur without rows");
        softshadow_destroy(handle);
        if (threads == 1) {
            ask blurred = q;
            blurred.visibility = smooth;
            print_message("2 x 2 taps: RMS %.4f, blurred %.4f\n", maps_rms(&q, &truth),
                          maps_rms(&blurred, &truth));
            CHECK(maps_rms(&blurred, &truth) < .75 * maps_rms(&q, &truth), "%g after %g",
                  maps_rms(&blurred, &truth), maps_rms(&q, &truth));
        }
        ask_free(&q);
    }
    ask_free(&truth);
    scene_free(&mesh);
}

/* An object's pixels do not know of another's: what those hold, or that they hold nothing, is the
 * same. */
static void test_blur_ids(void **state) {
    (void)state;
    scene_mesh mesh = maps_body();
    static float both[SIDE * SIDE], one[SIDE * SIDE], crossed[SIDE * SIDE];
    static uint32_t ids[SIDE * SIDE];
    static double half[SIDE * SIDE][3];
    ask q = over_ground("penumbra-mask", &mesh, scene_sphere_light(1, .6, 4, .6), 512);
    q.build.blur = 1;
    softshadow *handle = ask_handle(&q);
    for (int i = 0; i < SIDE * SIDE; i++) ids[i] = (i % SIDE + i / SIDE) / 11 % 2 ? 7 : UINT32_MAX;
    ask_image(handle, &q, ids, both);
    ask_image(handle, &q, NULL, crossed);
    for (int part = 0; part < 2; part++) {
        for (int i = 0; i < SIDE * SIDE; i++) {
            const bool mine = (ids[i] == 7) == (part == 0);
            for (int k = 0; k < 3; k++) half[i][k] = mine ? q.points[i][k] : NAN;
        }
        ask h = q;
        h.points = (const double(*)[3])half;
        ask_image(handle, &h, NULL, one);
        for (int i = 0; i < SIDE * SIDE; i++) {
            const bool mine = (ids[i] == 7) == (part == 0);
            CHECK(mine ? one[i] == both[i] : isnan(one[i]),
                  "pixel %d: %g alone, %g with the others", i, (double)one[i], (double)both[i]);
        }
    }
    int differ = 0;
    for (int i = 0; i < SIDE * SIDE; i++) differ += crossed[i] != both[i];
    CHECK(differ > 100, "only %d pixels would have been crossed", differ);
    softshadow_destroy(handle);
    ask_free(&q);
    scene_free(&mesh);
}

/* ---- both ------------------------------------------------------------------------------------ */

/* Casters that overlap as the light sees them, [Cou05] figure 4.7: panels at several heights, each
 * turned, so that every edge's penumbra lies across those of others. */
static scene_mesh panels(double apart) {
    scene_mesh mesh = {0};
    uint64_t seed = 5;
    for (int i = 0; i < 9; i++) {
        const double x = scene_uniform(&seed, -.8, .8), y = scene_uniform(&seed, -.8, .8);
        const double z = .4 + apart * i, turn = scene_uniform(&seed, 0, 2 * SCENE_PI);
        double corner[4][3];
        for (int k = 0; k < 4; k++) {
            const double a = turn + k * SCENE_PI / 2 + (k % 2 ? .25 : -.25);
            corner[k][0] = x + .4 * cos(a), corner[k][1] = y + .4 * sin(a), corner[k][2] = z;
        }
        scene_quad(&mesh, (const double(*)[3])corner);
    }
    return mesh;
}

/* Must hold 4: penumbra-mask is off by half of what penumbra-volume is, at most, where the panels
 * lie so close that one map sees nearly all that any part of the light does. Farther apart what the
 * light's centre does not see bleeds through; the thesis's own volumes are still more than twice as
 * bad. */
static void test_overlap(void **state) {
    (void)state;
    const softshadow_light light = scene_sphere_light(.4, .3, 5, .5);
    const char *const names[] = {"penumbra-volume", "penumbra-volume, falloff=paper",
                                 "penumbra-mask"};
    for (int far = 0; far < 2; far++) {
        scene_mesh mesh = panels(far ? .15 : .05);
        double error[3];
        ask truth = over_ground("exact", &mesh, light, 0);
        truth.build.samples = 1024;
        ask_do(&truth);
        for (int i = 0; i < 3; i++) {
            ask q = over_ground(i < 2 ? names[0] : names[i], &mesh, light, 1024);
            if (i == 1) q.build.falloff = SOFTSHADOW_FALLOFF_PAPER;
            ask_do(&q);
            error[i] = maps_rms(&q, &truth);
            print_message("panels %s, %s: RMS %.4f\n", far ? "apart" : "close", names[i], error[i]);
            ask_free(&q);
        }
        CHECK(error[2] <= error[far] / 2, "mask %g, volume %g", error[2], error[far]);
        CHECK(error[2] < error[0], "mask %g, volume %g", error[2], error[0]);
        ask_free(&truth);
        scene_free(&mesh);
    }
}

/* ---- the bunny ------------------------------------------------------------------------------- */

/* Must hold 4: at 70 % of the points, at least, penumbra-mask takes no tap: on the ground around
 * the bunny and, as a picture shows it, on every eighth of its triangles. Both are off by half of
 * what the hard shadow is, at most: of the points on the body many lie in the shadow of a bump a
 * few texels away, where neither is better than the map. */
static void test_bunny(void **state) {
    (void)state;
    scene_mesh mesh = {0};
    if (!scene_bunny(&mesh)) {
        print_message("glmark2-data's bunny is not there\n");
        scene_free(&mesh);
        skip();
        return;
    }
    const size_t most = SIDE * SIDE + mesh.triangles / 8;
    double(*points)[3] = calloc(most, sizeof *points);
    float(*normals)[3] = calloc(most, sizeof *normals);
    CHECK(points && normals, "out of memory");
    scene_grid(points, SIDE, -2, 2, -2, 2, -.9913);
    size_t n = SIDE * SIDE;
    for (size_t i = 0; i < n; i++) normals[i][2] = 1;
    for (size_t t = 0; t + 8 <= mesh.triangles; t += 8, n++) {
        const uint32_t *corner = mesh.indices + 3 * t;
        double e[2][3];
        for (int k = 0; k < 3; k++) {
            const double p = mesh.xyz[3 * corner[0] + k];
            e[0][k] = mesh.xyz[3 * corner[1] + k] - p, e[1][k] = mesh.xyz[3 * corner[2] + k] - p;
            points[n][k] = p + (e[0][k] + e[1][k]) / 3;
        }
        for (int k = 0; k < 3; k++) {
            const int i = (k + 1) % 3, j = (k + 2) % 3;
            normals[n][k] = (float)(e[0][i] * e[1][j] - e[0][j] * e[1][i]);
        }
    }
    const softshadow_light light = scene_sphere_light(2.5, -3, 5, .25);
    const char *const names[] = {"penumbra-volume", "penumbra-mask"};
    ask truth = ask_new("exact", &mesh, light, (const double(*)[3])points, n, 1024);
    truth.normals = (const float(*)[3])normals;
    ask_do(&truth);
    ask hard = ask_new("hard", &mesh, light, (const double(*)[3])points, n, 0);
    hard.normals = (const float(*)[3])normals;
    ask_do(&hard);
    const double limit = maps_rms(&hard, &truth) / 2;
    for (int m = 0; m < 2; m++) {
        ask q = ask_new(names[m], &mesh, light, (const double(*)[3])points, n, 0);
        q.normals = (const float(*)[3])normals;
        ask_do(&q);
        const double error = maps_rms(&q, &truth), taps = (double)q.stats.points_traced / (double)n;
        print_message("%s, bunny: RMS %.4f (hard: %.4f)\n", names[m], error, 2 * limit);
        CHECK(error < limit, "%s: RMS %g, hard %g", names[m], error, 2 * limit);
        if (m == 1) { /* what it counts as traced */
            print_message("%.1f %% of %zu points take no tap\n", 100 * (1 - taps), n);
            CHECK(taps > 0 && taps <= .3, "%g take taps", taps);
        }
        ask_free(&q);
    }
    ask_free(&truth), ask_free(&hard);
    free(points), free(normals);
    scene_free(&mesh);
}

/* The umbra of a mesh under a growing light, as a technique has it and as it is: points that see
 * less than 1/64. It shrinks. `most`: how much of the truth's the two may differ by. */
static void grow(const char *method, const scene_mesh *mesh, uint32_t sub_lights, double most) {
    size_t before = SIZE_MAX;
    for (double radius = .1; radius < .65; radius += .25) {
        const softshadow_light light = scene_sphere_light(1, .6, 4, radius);
        ask q = over_ground(method, mesh, light, 512), truth;
        truth = over_ground("exact", mesh, light, 0);
        truth.build.samples = 512, q.build.sub_lights = sub_lights;
        ask_do(&q), ask_do(&truth);
        size_t dark = 0, true_dark = 0;
        for (size_t i = 0; i < q.count; i++) {
            dark += q.visibility[i] < 1.0 / 64, true_dark += truth.visibility[i] < 1.0 / 64;
        }
        print_message("%s, %u sub-lights a side, radius %.2f: umbra %zu, truth's %zu, RMS %.4f\n",
                      method, sub_lights, radius, dark, true_dark, maps_rms(&q, &truth));
        CHECK(dark < before, "%s, radius %g: umbra %zu after %zu", method, radius, dark, before);
        CHECK(fabs((double)dark - (double)true_dark) <= most * (double)true_dark,
              "%s, radius %g: umbra %zu, truth's %zu", method, radius, dark, true_dark);
        before = dark;
        ask_free(&q), ask_free(&truth);
    }
}

/* [CD03] figure 8, with techniques that know both penumbrae: the umbra shrinks as the true one
 * does.
 * - Of a flat convex caster every part of the light sees the same silhouette, so nothing but the
 *   map is between the two: no point of 1,600 differs for penumbra-volume, .7 % for penumbra-mask,
 *   whose 64 jittered taps tell 1/64 by luck.
 * - Of a lumpy body each part sees another. One silhouette for all of a light as large as the body
 *   is wrong by a third of the umbra, which is too large for penumbra-volume and too small for
 *   penumbra-mask; one for each of 4 x 4 parts by 4 % at most. */
static void test_growing_light(void **state) {
    (void)state;
    scene_mesh panel = {0}, body = maps_body();
    scene_rect(&panel, -.8, .7, -.75, .85, 1);
    grow("penumbra-volume", &panel, 1, .002);
    grow("penumbra-mask", &panel, 1, .01);
    grow("penumbra-volume", &body, 1, .35);
    grow("penumbra-mask", &body, 1, .3);
    grow("penumbra-volume", &body, 4, .05);
    grow("penumbra-mask", &body, 4, .05);
    scene_free(&panel), scene_free(&body);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_volume_straight_edge),
        cmocka_unit_test(test_volume_crooked_edge),
        cmocka_unit_test(test_volume_falloffs),
        cmocka_unit_test(test_volume_accuracy),
        cmocka_unit_test(test_mask_straight_edge),
        cmocka_unit_test(test_mask_taps),
        cmocka_unit_test(test_blur),
        cmocka_unit_test(test_blur_ids),
        cmocka_unit_test(test_overlap),
        cmocka_unit_test(test_growing_light),
        cmocka_unit_test(test_bunny),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
