/* The map techniques: what their papers promise and what every map must keep. Through the public header
 * only. */
#include "ask.h"
#include "oracle/oracle.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

static const char *const outer[] = {"penumbra-map", "smoothie"};
static const char *const maps[] = {"hard",     "pcf",            "penumbra-map",
                                   "smoothie", "penumbra-limit", "penumbra-volume",
                                   "penumbra-mask"};

/* A half plane at z = 1 that ends at x = 0, a light above the edge, points on a line across. */
enum { ACROSS = 2001 };
static double line[ACROSS][3];

static scene_mesh half_plane(void) {
    scene_mesh mesh = {0};
    scene_rect(&mesh, -3, 0, -3, 3, 1);
    return mesh;
}

/* t is the signed distance of the edge from the light's centre, in radii, > 0: the centre is seen. */
static void lay_line(double half_width) {
    for (int i = 0; i < ACROSS; i++) {
        const double t = -1.5 + 3.0 * i / (ACROSS - 1);
        line[i][0] = t * half_width, line[i][1] = .05, line[i][2] = 0;
    }
}
static double t_of(int i) { return -1.5 + 3.0 * i / (ACROSS - 1); }

static ask straight(const char *method, const scene_mesh *mesh, softshadow_light light, uint32_t side) {
    static double bounds[6];
    ask q = ask_new(method, mesh, light, (const double(*)[3])line, ACROSS, 0);
    const double reach = fabs(line[0][0]);
    memcpy(bounds, (double[6]){-reach, -reach, 0, reach, reach, 0}, sizeof bounds);
    q.build.method = method, q.build.resolution = side, q.build.bounds = bounds;
    return q;
}

/* Must hold 1: 0 where the centre is hidden, E(2t - 1) beyond, to 1/64; E is closed form 1. */
static void test_straight_edge(void **state) {
    (void)state;
    scene_mesh mesh = half_plane();
    /* a light of radius .25 at z = 4: the edge at 1 makes a half width of .25 / 3 on the ground */
    const struct {
        const char *name;
        softshadow_light light;
        double half_width;
    } lights[] = {
        {"disk", scene_disk_light(0, 0, 4, 0, 0, -1, .25), .25 / 3},
        {"sphere", scene_sphere_light(0, 0, 4, .25), .25 / 3},
        {"sun", scene_sun_light(0, 0, -1, atan(.1)), .1},
        {"rect of that area", scene_rect_light(0, 0, 4, .25 * sqrt(SCENE_PI) / 2, .25 * sqrt(SCENE_PI) / 2),
         .25 / 3},
    };
    for (size_t m = 0; m < COUNT(outer); m++) {
        for (size_t l = 0; l < COUNT(lights); l++) {
            lay_line(lights[l].half_width);
            ask q = straight(outer[m], &mesh, lights[l].light, 1024);
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

/* Must hold 1: both penumbrae, to 1/128; and so at any resolution: the limit is a plane. A tilted edge
 * under a sun, slope m along its own direction, makes t / sqrt(1 + m^2 tan^2 alpha t^2) of t. */
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
                lay_line(half);
                for (int i = 0; i < ACROSS; i++) line[i][1] = 0;
                ask q = straight("penumbra-limit", &mesh, lights[l], side);
                ask_do(&q);
                double worst = 0;
                for (int i = 0; i < ACROSS; i++) {
                    const double t = t_of(i), m = slopes[s] * .1;
                    /* t: how far the light's centre is past the edge, along the ground */
                    const double truth = oracle_edge(t / sqrt(1 + m * m * t * t));
                    worst = fmax(worst, fabs(q.visibility[i] - truth));
                }
                print_message("slope %g light %zu %u^2: worst %.5f\n", slopes[s], l, side, worst);
                CHECK(worst <= 1.0 / 128, "slope %g, light %zu, %u^2: off by %g", slopes[s], l, side, worst);
                ask_free(&q);
            }
        }
        scene_free(&mesh);
    }
}

/* What the falloff names say, where the coordinate is 1/4, 1/2, 3/4. */
static void test_falloffs(void **state) {
    (void)state;
    scene_mesh mesh = half_plane();
    const softshadow_light light = scene_disk_light(0, 0, 4, 0, 0, -1, .25);
    lay_line(.25 / 3);
    for (size_t m = 0; m < COUNT(outer); m++) {
        for (uint32_t f = SOFTSHADOW_FALLOFF_DISK; f <= SOFTSHADOW_FALLOFF_PROFILE; f++) {
            ask q = straight(outer[m], &mesh, light, 1024);
            q.build.falloff = f;
            ask_do(&q);
            for (int i = 0; i < ACROSS; i++) {
                const double l = fmin(fmax(t_of(i), 0), 1);
                const double paper = m == 0 ? 3 * l * l - 2 * l * l * l : (1 - cos(SCENE_PI * l)) / 2;
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

enum { SIDE = 96 };
static double ground[SIDE * SIDE][3];

static ask over_ground(const char *method, const scene_mesh *mesh, softshadow_light light, uint32_t side) {
    static const double bounds[6] = {-2, -2, 0, 2, 2, 0};
    scene_grid(ground, SIDE, -2, 2, -2, 2, 0);
    ask q = ask_new(method, mesh, light, (const double(*)[3])ground, SIDE * SIDE, 0);
    q.build.method = method, q.build.resolution = side, q.build.bounds = bounds;
    return q;
}

static scene_mesh body(void) {
    scene_mesh mesh = {0};
    const double centre[3] = {0, 0, 1};
    scene_icosphere(&mesh, centre, .6, 3, .3);
    return mesh;
}

static size_t count_dark(const ask *q) {
    size_t n = 0;
    for (size_t i = 0; i < q->count; i++) n += q->visibility[i] == 0;
    return n;
}

static double rms(const ask *a, const ask *b) {
    double sum = 0;
    for (size_t i = 0; i < a->count; i++) {
        const double d = a->visibility[i] - b->visibility[i];
        sum += d * d;
    }
    return sqrt(sum / (double)a->count);
}

/* Must hold 5: the umbra is the hard shadow however large the light is; the error it makes is told. */
static void test_umbra_stays(void **state) {
    (void)state;
    scene_mesh mesh = body();
    for (size_t m = 0; m < COUNT(outer); m++) {
        size_t hard = 0;
        for (int step = 0; step < 4; step++) {
            const double radius = step == 0 ? 1e-6 : .15 * step;
            ask q = over_ground(outer[m], &mesh, scene_sphere_light(1, .6, 4, radius), 512);
            ask truth = over_ground("exact", &mesh, scene_sphere_light(1, .6, 4, radius), 0);
            truth.build.samples = 512;
            ask_do(&q), ask_do(&truth);
            const size_t dark = count_dark(&q);
            if (step == 0) hard = dark;
            print_message("%s radius %.2f: umbra %zu, truth's %zu, RMS error %.4f\n", outer[m], radius,
                          dark, count_dark(&truth), rms(&q, &truth));
            /* a filter of 2 x 2 texels moves the umbra's rim by half a texel: .4 % of its points here */
            CHECK(fabs((double)dark - (double)hard) <= .03 * (double)hard, "%s radius %g: umbra %zu, hard %zu",
                  outer[m], radius, dark, hard);
            ask_free(&q), ask_free(&truth);
        }
    }
    scene_free(&mesh);
}

/* Must hold 6: the light shrinks to a point, and every technique to the hard shadow. */
static void test_radius_to_zero(void **state) {
    (void)state;
    scene_mesh mesh = body();
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
        CHECK(rms(&point, &hard) < .06, "%s: point light off by %g", maps[m], rms(&point, &hard));
        CHECK(point.stats.silhouette_edges == 0, "%s: a point light needs no silhouettes", maps[m]);
        ask_free(&hard), ask_free(&point), ask_free(&small);
    }
    scene_free(&mesh);
}

/* Must hold 6: more texels, no more error: against the technique's own limit, the finest map. */
static void test_resolution(void **state) {
    (void)state;
    scene_mesh mesh = body();
    for (size_t m = 0; m < COUNT(maps); m++) {
        ask fine = over_ground(maps[m], &mesh, scene_sphere_light(1, .6, 4, .2), 4096);
        fine.build.mask_taps = 32; /* so that noise is no error */
        ask_do(&fine);
        double before = 1;
        for (uint32_t side = 64; side <= 1024; side *= 2) {
            ask q = over_ground(maps[m], &mesh, scene_sphere_light(1, .6, 4, .2), side);
            q.build.mask_taps = 32;
            ask_do(&q);
            const double error = rms(&q, &fine);
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

/* ---- skipping ------------------------------------------------------------------------------- */

static void test_skipping(void **state) {
    (void)state;
    scene_mesh mesh = body(), many = body();
    const size_t near = mesh.triangles;
    const double shift[12] = {1, 0, 0, 40, 0, 1, 0, 0, 0, 0, 1, 0};
    scene_mesh far = body();
    scene_transform(&far, shift);
    scene_append(&many, &far);
    for (size_t m = 0; m < COUNT(maps); m++) {
        const softshadow_light light = scene_sphere_light(1, .6, 4, .2);
        ask q = over_ground(maps[m], &mesh, light, 256), more = over_ground(maps[m], &many, light, 256);
        ask_do(&q), ask_do(&more);
        CHECK(q.stats.casters_culled == 0, "%s: culled %llu", maps[m],
              (unsigned long long)q.stats.casters_culled);
        CHECK(more.stats.casters_culled == near, "%s: culled %llu of %zu far ones", maps[m],
              (unsigned long long)more.stats.casters_culled, near);
        /* Far casters turn the frame a little: texels on the outline fall to the other side. */
        CHECK(rms(&q, &more) < .05, "%s: far casters change answers by %g", maps[m], rms(&q, &more));
        ask_free(&q), ask_free(&more);

        ask none = over_ground(maps[m], NULL, light, 256);
        softshadow *handle = ask_handle(&none);
        uint32_t count = 7;
        OK(handle, softshadow_build_maps(handle, &none.build));
        OK(handle, softshadow_map_count(handle, &count));
        CHECK(count == 0, "%s: %u maps of nothing", maps[m], count);
        softshadow_destroy(handle);
        ask_do(&none);
        for (size_t i = 0; i < none.count; i++) CHECK(none.visibility[i] == 1, "%s", maps[m]);
        ask_free(&none);
    }
    scene_free(&mesh), scene_free(&many), scene_free(&far);
}

/* One map for a point light; a second one only where there is a silhouette to draw. */
static void test_planes(void **state) {
    (void)state;
    scene_mesh mesh = body();
    for (size_t m = 0; m < COUNT(maps); m++) {
        for (int soft = 0; soft < 2; soft++) {
            ask q = over_ground(maps[m], &mesh, scene_sphere_light(1, .6, 4, .2 * soft), 128);
            softshadow *handle = ask_handle(&q);
            uint32_t count = 0;
            OK(handle, softshadow_build_maps(handle, &q.build));
            OK(handle, softshadow_map_count(handle, &count));
            CHECK(count == (soft && m >= 2 ? 2u : 1u), "%s: %u planes", maps[m], count);
            for (uint32_t i = 0; i < count; i++) {
                softshadow_map map = SOFTSHADOW_MAP_INIT;
                OK(handle, softshadow_get_map(handle, i, &map));
                CHECK(map.width == 128 && map.height == 128 && map.channels >= 1, "%s", maps[m]);
                /* the body's middle is in the middle part of the map */
                const double at[4] = {0, 0, 1, 1};
                double clip[4] = {0};
                for (int r = 0; r < 4; r++) {
                    for (int k = 0; k < 4; k++) clip[r] += map.matrix[4 * r + k] * at[k];
                }
                CHECK(fabs(clip[0] / clip[3]) < .7 && fabs(clip[1] / clip[3]) < .7, "%s: %g %g", maps[m],
                      clip[0] / clip[3], clip[1] / clip[3]);
                const int x = (int)((clip[0] / clip[3] + 1) * 64), y = (int)((clip[1] / clip[3] + 1) * 64);
                const float depth = map.pixels[(size_t)(y * 128 + x) * map.channels];
                CHECK(i > 0 || depth < 1e20f, "%s: the body's middle holds %g", maps[m], (double)depth);
            }
            softshadow_destroy(handle);
            ask_free(&q);
        }
    }
    scene_free(&mesh);
}

/* ---- where things are odd ------------------------------------------------------------------- */

/* Acne: points on the lit side of a body never shadow themselves; on the dark side they are dark. */
static void test_acne(void **state) {
    (void)state;
    scene_mesh mesh = {0};
    const double centre[3] = {0, 0, 1};
    scene_icosphere(&mesh, centre, .6, 4, 0);
    enum { N = 4000 };
    static double points[N][3];
    static float normals[N][3];
    uint64_t seed = 3;
    for (int i = 0; i < N; i++) {
        const uint32_t *c = &mesh.indices[3 * (scene_random(&seed) % mesh.triangles)];
        double u = scene_uniform(&seed, 0, 1), v = scene_uniform(&seed, 0, 1), e[2][3], n[3];
        if (u + v > 1) u = 1 - u, v = 1 - v;
        for (int k = 0; k < 3; k++) {
            e[0][k] = mesh.xyz[3 * c[1] + k] - mesh.xyz[3 * c[0] + k];
            e[1][k] = mesh.xyz[3 * c[2] + k] - mesh.xyz[3 * c[0] + k];
            points[i][k] = mesh.xyz[3 * c[0] + k] + u * e[0][k] + v * e[1][k];
        }
        for (int k = 0; k < 3; k++) {
            n[k] = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
        }
        for (int k = 0; k < 3; k++) normals[i][k] = (float)n[k];
    }
    const double to[3] = {1, .6, 4};
    for (size_t m = 0; m < COUNT(maps); m++) {
        ask q = ask_new(maps[m], &mesh, scene_sphere_light(to[0], to[1], to[2], .05),
                        (const double(*)[3])points, N, 0);
        q.normals = (const float(*)[3])normals;
        ask_do(&q);
        size_t lit = 0, acne = 0, dark = 0, leaks = 0;
        for (int i = 0; i < N; i++) {
            double dot = 0, ln = 0, ll = 0;
            for (int k = 0; k < 3; k++) {
                const double l = to[k] - points[i][k];
                dot += l * normals[i][k], ln += normals[i][k] * normals[i][k], ll += l * l;
            }
            const double cosine = dot / sqrt(ln * ll);
            if (cosine > .15) lit++, acne += q.visibility[i] < 1;
            if (cosine < -.15) dark++, leaks += q.visibility[i] > 0;
        }
        print_message("%s: acne %zu of %zu, leaks %zu of %zu\n", maps[m], acne, lit, leaks, dark);
        CHECK(acne == 0 && leaks == 0, "%s: acne %zu of %zu, leaks %zu of %zu", maps[m], acne, lit, leaks,
              dark);
        ask_free(&q);
    }
    scene_free(&mesh);
}

/* A lamp inside a closed body, casters all around it, receivers behind everything, far from home. */
static void test_odd_places(void **state) {
    (void)state;
    scene_mesh mesh = {0};
    const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1};
    scene_box(&mesh, low, high);
    enum { N = 2000 };
    static double points[N][3];
    for (int far = 0; far < 2; far++) {
        const double offset = far * 1e7;
        const double move[12] = {1, 0, 0, offset, 0, 1, 0, -offset, 0, 0, 1, offset};
        scene_mesh moved = scene_copy(&mesh);
        scene_transform(&moved, move);
        uint64_t seed = 5;
        for (int i = 0; i < N; i++) {
            double d[3];
            scene_direction(&seed, d);
            const double r = i < N / 2 ? scene_uniform(&seed, .1, .95) : scene_uniform(&seed, 2, 1000);
            for (int k = 0; k < 3; k++) points[i][k] = r * d[k] + move[4 * k + 3];
        }
        for (size_t m = 0; m < COUNT(maps); m++) {
            const softshadow_light light = scene_sphere_light(offset + .1, .05 - offset, offset - .1, .05);
            ask q = ask_new(maps[m], &moved, light, (const double(*)[3])points, N, 0);
            q.build.resolution = 128;
            ask_do(&q);
            for (int i = 0; i < N; i++) {
                CHECK(q.visibility[i] == (i < N / 2 ? 1 : 0), "%s, offset %g, point %d (%g %g %g): %g", maps[m],
                      offset, i, points[i][0] - offset, points[i][1] + offset, points[i][2] - offset,
                      (double)q.visibility[i]);
            }
            ask_free(&q);
        }
        scene_free(&moved);
    }
    scene_free(&mesh);
}

static void test_bad_input(void **state) {
    (void)state;
    scene_mesh mesh = body();
    for (size_t m = 0; m < COUNT(maps); m++) {
        ask q = over_ground(maps[m], &mesh, scene_sphere_light(1, .6, 4, .2), 0);
        softshadow *handle = ask_handle(&q);
        softshadow_map map = SOFTSHADOW_MAP_INIT;
        OK(handle, softshadow_build_maps(handle, &q.build));
        OK(handle, softshadow_get_map(handle, 0, &map));
        CHECK(map.width == 1024, "%s: default side %u", maps[m], map.width);
        q.build.resolution = 100000;
        CHECK(softshadow_build_maps(handle, &q.build) == SOFTSHADOW_E_ARGUMENT, "%s", maps[m]);
        CHECK(strstr(softshadow_last_message(handle), "resolution"), "%s", softshadow_last_message(handle));
        q.build.resolution = 1; /* the smallest there is: an answer, whatever it is worth */
        OK(handle, softshadow_build_maps(handle, &q.build));
        ask_query(handle, &q);
        for (size_t i = 0; i < q.count; i++) CHECK(q.visibility[i] >= 0 && q.visibility[i] <= 1, "%s", maps[m]);
        q.build.resolution = 64, q.build.weighting = SOFTSHADOW_SOLID_ANGLE;
        CHECK(softshadow_build_maps(handle, &q.build) == SOFTSHADOW_E_UNSUPPORTED, "%s", maps[m]);
        softshadow_destroy(handle);
        ask_free(&q);
    }
    scene_free(&mesh);
}

/* The committed table technique x light. */
static void test_lights(void **state) {
    (void)state;
    static const struct {
        const char *name, *lights; /* sphere, disk, rect, sun: n native, a approximated, - refused */
    } table[] = {{"hard", "nnnn"}, {"pcf", "nnnn"}, {"penumbra-map", "nnan"}, {"smoothie", "nnan"}, {"penumbra-limit", "nnan"},
                 {"penumbra-volume", "nnan"}, {"penumbra-mask", "nnnn"}};
    size_t n, found = 0;
    const softshadow_method *methods = ask_methods(&n);
    for (size_t i = 0; i < n; i++) {
        for (size_t m = 0; m < COUNT(table); m++) {
            if (strcmp(methods[i].name, table[m].name)) continue;
            found++;
            for (uint32_t type = SOFTSHADOW_SPHERE; type <= SOFTSHADOW_SUN; type++) {
                const char is = methods[i].lights_native >> type & 1          ? 'n'
                                : methods[i].lights_approximated >> type & 1 ? 'a'
                                                                             : '-';
                CHECK(is == table[m].lights[type], "%s: light %u is %c", table[m].name, type, is);
            }
            if (strchr(table[m].lights, 'a')) CHECK(strstr(methods[i].notes, "rect"), "%s", table[m].name);
        }
    }
    CHECK(found == COUNT(table), "%zu of the methods are listed", found);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_straight_edge), cmocka_unit_test(test_limit_straight_edge),
        cmocka_unit_test(test_falloffs),
        cmocka_unit_test(test_umbra_stays),   cmocka_unit_test(test_radius_to_zero),
        cmocka_unit_test(test_resolution),    cmocka_unit_test(test_skipping),
        cmocka_unit_test(test_planes),        cmocka_unit_test(test_acne),
        cmocka_unit_test(test_odd_places),    cmocka_unit_test(test_bad_input),
        cmocka_unit_test(test_lights),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
