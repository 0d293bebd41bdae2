/* Lights divided in sub-lights ([Cou05] 4.3): what they add up to, and what that is good for.
 * Through the public header only. */
#include "maps.h"

enum { SIDE = 96, ACROSS = 1001 };

static const char *const methods[] = {"penumbra-volume", "penumbra-mask"};

static ask divided(const char *method, const scene_mesh *mesh, softshadow_light light,
                   uint32_t side, uint32_t resolution) {
    ask q = maps_over_ground(method, mesh, light, SIDE, 2, resolution);
    q.build.sub_lights = side;
    return q;
}

/* Past one silhouette for the whole light its parts see others; one for each part leaves of that
 * what is as small as the parts: no more than .6 of it where they are half as wide. Taps are noise,
 * which the mean over the parts lessens by half as well. */
static void test_error_falls(void **state) {
    (void)state;
    scene_mesh mesh = maps_body();
    const softshadow_light lights[] = {
        scene_sphere_light(1, .6, 4, .6), scene_disk_light(1, .6, 4, -.25, -.15, -1, .6),
        scene_rect_light(1, .6, 4, .6, .5), scene_sun_light(-.25, -.15, -1, .15)};
    for (size_t l = 0; l < COUNT(lights); l++) {
        ask truth = maps_over_ground("exact", &mesh, lights[l], SIDE, 2, 0);
        truth.build.samples = 1024;
        ask_do(&truth);
        for (size_t m = 0; m < COUNT(methods); m++) {
            double before = 1;
            for (uint32_t side = 1; side <= 4; side *= 2) {
                ask q = divided(methods[m], &mesh, lights[l], side, 512);
                ask_do(&q);
                maps_in_range(&q);
                const double error = maps_rms(&q, &truth);
                print_message("%s, light %zu in %u x %u: RMS %.4f\n", methods[m], l, side, side,
                              error);
                CHECK(error <= .6 * before, "%s, light %zu in %u x %u: RMS %g after %g",
                      methods[m], l, side, side, error, before);
                before = error;
                ask_free(&q);
            }
        }
        ask_free(&truth);
    }
    scene_free(&mesh);
}

/* Four rects are the rect: the mean of what the host gets for each of them, to the rounding of
 * those four floats. penumbra-volume takes each for a disk, so that this is a sum of disks. */
static void test_sum_of_rects(void **state) {
    (void)state;
    scene_mesh mesh = maps_body();
    const double half[2] = {.3, .25};
    for (size_t m = 0; m < COUNT(methods); m++) {
        ask all = divided(methods[m], &mesh, scene_rect_light(1, .6, 4, 2 * half[0], 2 * half[1]),
                          2, 256);
        ask_do(&all);
        static double sum[SIDE * SIDE];
        memset(sum, 0, sizeof sum);
        for (int i = 0; i < 4; i++) {
            const double x = 1 + (i & 1 ? 1 : -1) * half[0], y = .6 + (i & 2 ? 1 : -1) * half[1];
            ask part = divided(methods[m], &mesh, scene_rect_light(x, y, 4, half[0], half[1]), 0,
                               256);
            ask_do(&part);
            for (size_t k = 0; k < part.count; k++) sum[k] += (double)part.visibility[k] / 4;
            ask_free(&part);
        }
        double worst = 0;
        for (size_t k = 0; k < all.count; k++) {
            worst = fmax(worst, fabs(all.visibility[k] - sum[k]));
        }
        CHECK(worst <= 0x1p-20, "%s: off by %g", methods[m], worst);
        ask_free(&all);
    }
    scene_free(&mesh);
}

/* Along one edge nothing is gained, and little may be lost: less than 1/32, as the sum of the
 * smaller disks has the light's area and second moments, and less the more there are. */
static void test_straight_edge(void **state) {
    (void)state;
    scene_mesh mesh = maps_half_plane();
    const struct {
        softshadow_light light;
        double half_width;
    } lights[] = {{scene_disk_light(0, 0, 4, 0, 0, -1, .25), .25 / 3},
                  {scene_sphere_light(0, 0, 4, .25), .25 / 3},
                  {scene_sun_light(0, 0, -1, atan(.1)), .1}};
    for (size_t l = 0; l < COUNT(lights); l++) {
        double before = 1;
        for (uint32_t side = 2; side <= 8; side *= 2) {
            ask q = maps_across("penumbra-volume", &mesh, lights[l].light, lights[l].half_width,
                                .05, ACROSS);
            q.build.sub_lights = side;
            ask_do(&q);
            double worst = 0;
            for (size_t i = 0; i < ACROSS; i++) {
                worst = fmax(worst, fabs(q.visibility[i] - oracle_edge(maps_t(i, ACROSS))));
            }
            print_message("edge, light %zu in %u x %u: worst %.5f\n", l, side, side, worst);
            CHECK(worst <= 1.0 / 32 && worst < before, "light %zu in %u x %u: off by %g after %g",
                  l, side, side, worst, before);
            before = worst;
            ask_free(&q);
        }
    }
    scene_free(&mesh);
}

/* Maps of each part; a light that is a point has one. Silhouettes are found for each. */
static void test_maps(void **state) {
    (void)state;
    scene_mesh mesh = maps_body();
    for (size_t m = 0; m < COUNT(methods); m++) {
        for (uint32_t side = 0; side <= 3; side++) {
            for (int point = 0; point < 2; point++) {
                ask q = divided(methods[m], &mesh, scene_sphere_light(1, .6, 4, point ? 0 : .5),
                                side, 64);
                softshadow *handle = ask_handle(&q);
                uint32_t count;
                OK(handle, softshadow_map_count(handle, &count));
                const uint32_t parts = side > 1 && !point ? side * side : 1;
                CHECK(count == parts * (point ? 1 : 2), "%s, %u: %u maps", q.method, side, count);
                for (uint32_t i = 0; i < count; i++) {
                    softshadow_map map = SOFTSHADOW_MAP_INIT;
                    OK(handle, softshadow_get_map(handle, i, &map));
                    CHECK(map.width == 64 && map.pixels, "%s: map %u", q.method, i);
                }
                softshadow_destroy(handle);
                ask_free(&q);
            }
        }
    }
    scene_free(&mesh);
}

/* Points inside a sphere see all of it, also between its parts; what an image counts is what it
 * shows, and its blur leaves no marks; threads change nothing. */
static void test_image(void **state) {
    (void)state;
    scene_mesh mesh = maps_body();
    for (size_t m = 0; m < COUNT(methods); m++) {
        static float seen[2][SIDE * SIDE];
        for (uint32_t threads = 1; threads <= 2; threads++) {
            ask q = divided(methods[m], &mesh, scene_sphere_light(.4, .3, .5, .7), 2, 128);
            q.build.blur = 4, q.options.threads = threads;
            softshadow *handle = ask_handle(&q);
            softshadow_points points = ask_points(q.points, q.count);
            softshadow_stats stats = SOFTSHADOW_STATS_INIT;
            points.width = SIDE;
            OK(handle, softshadow_query_visibility(handle, &points, seen[threads - 1]));
            OK(handle, softshadow_get_stats(handle, &stats));
            uint64_t lit = 0, dark = 0;
            for (size_t i = 0; i < q.count; i++) {
                const float v = seen[threads - 1][i];
                CHECK(v >= 0 && v <= 1 && !signbit(v), "%s: %g", q.method, (double)v);
                lit += v == 1, dark += v == 0;
            }
            CHECK(stats.points == q.count && stats.points_lit == lit &&
                      stats.points_umbra == dark &&
                      stats.points_penumbra == q.count - lit - dark,
                  "%s: counted %llu lit, %llu dark", q.method, (unsigned long long)stats.points_lit,
                  (unsigned long long)stats.points_umbra);
            ask_query(handle, &q); /* no rows, no blur */
            for (size_t i = 0; i < q.count; i++) {
                const double x = q.points[i][0] - .4, y = q.points[i][1] - .3;
                CHECK(x * x + y * y + .25 > .49 || q.visibility[i] == 1, "%s: %g inside", q.method,
                      (double)q.visibility[i]);
            }
            softshadow_destroy(handle);
            ask_free(&q);
        }
        ask_same_bits(seen[0], seen[1], SIDE * SIDE, methods[m]);
    }
    scene_free(&mesh);
}

static void test_refused(void **state) {
    (void)state;
    scene_mesh mesh = maps_body();
    ask q = divided(methods[0], &mesh, scene_sphere_light(1, .6, 4, .5), 1, 64);
    softshadow *handle = ask_handle(&q);
    softshadow_build build = q.build;
    build.method = methods[0], build.sub_lights = 9;
    CHECK(softshadow_build_maps(handle, &build) == SOFTSHADOW_E_ARGUMENT &&
              strstr(softshadow_last_message(handle), "sub_lights"),
          "%s", softshadow_last_message(handle));
    softshadow_destroy(handle);
    ask_free(&q);
    scene_free(&mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_error_falls),   cmocka_unit_test(test_sum_of_rects),
        cmocka_unit_test(test_straight_edge), cmocka_unit_test(test_maps),
        cmocka_unit_test(test_image),         cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
