/* The oracles against each other: a test's truth has to be true. */
#include "ask.h"
#include "oracle/oracle.h"

static void edge_is_the_integral_of_chords(void **state) {
    (void)state;
    for (double t = -1; t <= 1; t += 0.125) {
        double area = 0;
        const int n = 200000;
        for (int i = 0; i < n; i++) {
            const double x = -1 + (t + 1) * (i + 0.5) / n;
            area += 2 * sqrt(1 - x * x) * (t + 1) / n;
        }
        CHECK(fabs(oracle_edge(t) - area / SCENE_PI) < 1e-7, "t = %g", t);
        CHECK(fabs(oracle_limb_edge(t, 0, 0) - oracle_edge(t)) < 1e-14, "t = %g", t);
        double bright = 0;
        for (int i = 0; i < 1000; i++) { /* chords of the darkened disk */
            const double x = -1 + (t + 1) * (i + 0.5) / 1000, h = sqrt(1 - x * x);
            for (int k = 0; k < 1000; k++) {
                const double y = h * (2 * (k + 0.5) / 1000 - 1);
                bright +=
                    oracle_limb(sqrt(x * x + y * y), 0.4, 0.3) * 2 * h / 1000 * (t + 1) / 1000;
            }
        }
        const double whole = SCENE_PI * (1 - 0.4 / 3 - 0.3 / 6);
        CHECK(fabs(oracle_limb_edge(t, 0.4, 0.3) - bright / whole) < 2e-5, "t = %g", t);
    }
}

/* A half-plane in general position before each kind of light. */
static void union_agrees_with_edges(void **state) {
    (void)state;
    uint64_t s = 1;
    for (int i = 0; i < 200; i++) {
        const softshadow_light lights[3] = {scene_sphere_light(0.3, -0.2, 5, 0.8),
                                            scene_disk_light(0, 0, 5, 0.2, 0.1, -1, 0.9),
                                            scene_sun_light(-0.1, 0.2, -1, 0.15)};
        const softshadow_light *light = &lights[i % 3];
        double turn[9], p[3] = {scene_uniform(&s, -1, 1), scene_uniform(&s, -1, 1), 0};
        scene_rotation(&s, turn);
        const double q[4][2] = {{0, -300}, {0, 300}, {300, 300}, {300, -300}};
        double corner[4][3];
        for (int k = 0; k < 4; k++) {
            for (int a = 0; a < 3; a++) {
                corner[k][a] = turn[3 * a] * q[k][0] * (a == 2 ? 0.3 : 1) +
                               turn[3 * a + 1] * q[k][1] * (a == 2 ? 0.001 : 1) + (a == 2) * 2;
            }
        }
        for (int a = 0; a < 3; a++) corner[2][a] = corner[1][a] + corner[3][a] - corner[0][a];
        scene_mesh mesh = {0};
        scene_quad(&mesh, (const double(*)[3])corner);
        const oracle_view view = oracle_see(light, p);
        double seen[3]; /* the other way from the edge */
        for (int a = 0; a < 3; a++) {
            seen[a] = (corner[0][a] + corner[1][a]) / 2 - 1e-3 * (corner[3][a] - corner[0][a]);
        }
        const double edge = oracle_edge_before(&view, p, corner[0], corner[1], seen);
        const double exact = oracle_union(&mesh, light, p, NULL);
        const double brute = oracle_brute(&mesh, light, p, NULL, SOFTSHADOW_UNIFORM, 10000);
        /* Where the plane passes the point or ends inside the pyramid the quad is no half-plane:
         * brute force says so. */
        CHECK(fabs(exact - brute) < 0.01, "case %d: union %g, brute %g", i, exact, brute);
        if (fabs(edge - brute) < 0.01) CHECK(fabs(edge - exact) < 1e-9, "case %d", i);
        scene_free(&mesh);
    }
}

static void union_agrees_with_disks(void **state) {
    (void)state;
    const unsigned n = 720;
    for (double c = 0; c < 2; c += 0.2) {
        scene_mesh mesh = {0};
        scene_disk(&mesh, c, 0, 2, 0.7, n); /* seen from 0 through z = 2: 1.4 at z = 4 */
        const softshadow_light light = scene_disk_light(0, 0, 4, 0, 0, -1, 1);
        const double p[3] = {0, 0, 0}, v = oracle_union(&mesh, &light, p, NULL);
        /* The polygon lacks a part (2 pi / n)^2 / 6 of its disk. */
        CHECK(fabs(v - oracle_disks(1, 1.4, 2 * c)) < 3e-5, "c = %g: %g", c, v);
        scene_free(&mesh);
    }
}

static void union_agrees_with_overlaps(void **state) {
    (void)state;
    uint64_t s = 3;
    for (int i = 0; i < 200; i++) {
        const double x0 = scene_uniform(&s, -2, 1), x1 = x0 + scene_uniform(&s, 0, 2);
        const double y0 = scene_uniform(&s, -2, 1), y1 = y0 + scene_uniform(&s, 0, 2);
        scene_mesh mesh = {0};
        scene_rect(&mesh, x0, x1, y0, y1, 3);
        const softshadow_light light = scene_rect_light(0.1, 0.2, 9, 3, 2);
        const double p[3] = {0, 0, 0}, v = oracle_union(&mesh, &light, p, NULL);
        const double hidden = oracle_overlap((3 * x0 - 0.1) / 3, (3 * x1 - 0.1) / 3) *
                              oracle_overlap((3 * y0 - 0.2) / 2, (3 * y1 - 0.2) / 2);
        CHECK(fabs(v - (1 - hidden)) < 1e-12, "case %d: %g, %g", i, v, 1 - hidden);
        scene_free(&mesh);
    }
}

/* Soup, all lights, with and without a horizon. */
static void union_agrees_with_brute_force(void **state) {
    (void)state;
    uint64_t s = 5;
    double sum = 0;
    int n = 0;
    for (int i = 0; i < 60; i++) {
        scene_mesh mesh = {0};
        scene_garbage(&mesh, (uint64_t)i);
        const softshadow_light lights[4] = {
            scene_sphere_light(0.3, -0.2, 5, 1.5), scene_disk_light(0, 0, 6, 0.2, 0.1, -1, 1.9),
            scene_sun_light(-0.1, 0.2, -1, 0.3), scene_rect_light(0, 0, 5, 1.5, 1)};
        for (int k = 0; k < 3; k++) {
            const double p[3] = {scene_uniform(&s, -2, 2), scene_uniform(&s, -2, 2), 0};
            const double normal[3] = {1, 0.2, 0.1};
            const double v = oracle_union(&mesh, &lights[i % 4], p, k == 2 ? normal : NULL);
            const double b = oracle_brute(&mesh, &lights[i % 4], p, k == 2 ? normal : NULL,
                                          SOFTSHADOW_UNIFORM, 22500);
            CHECK(fabs(v - b) < 0.015, "scene %d, point %d: union %g, brute %g", i, k, v, b);
            sum += (v - b) * (v - b), n++;
        }
        scene_free(&mesh);
    }
    print_message("           RMS %.5f\n", sqrt(sum / n));
    /* A regular grid of 150 x 150 against a handful of edges: about 1/150/sqrt(150) each. */
    CHECK(sqrt(sum / n) < 0.002, "RMS %g", sqrt(sum / n));
}

static double limb(double rho, void *user) { return (void)user, oracle_limb(rho, 0.4, 0.3); }

static void profile_agrees_with_limb_edge(void **state) {
    (void)state;
    const softshadow_light light = scene_disk_light(0, 0, 4, 0, 0, -1, 1);
    for (double t = -0.9; t < 1; t += 0.3) {
        scene_mesh mesh = {0};
        scene_rect(&mesh, t / 2, 9, -9, 9, 2);
        const double p[3] = {0, 0, 0};
        const double v = oracle_union_profile(&mesh, &light, p, limb, NULL, 400);
        /* The profile is constant on each of 400 rings: (1/400)^1.5 at its steep end. */
        const double truth = oracle_limb_edge(t, 0.4, 0.3);
        CHECK(fabs(v - truth) < 1e-4, "t = %g: %g, %g", t, v, truth);
        scene_free(&mesh);
    }
}

/* Caps against brute force by solid angle; polygons likewise by irradiance. */
static void weightings_agree_with_brute_force(void **state) {
    (void)state;
    const double p[3] = {0, 0, 0};
    for (double theta = 0; theta < 0.5; theta += 0.1) {
        scene_mesh ball = {0};
        const double far = 3, beta = 0.2;
        scene_icosphere(&ball, (const double[3]){far * sin(theta), 0, far * cos(theta)},
                        far * sin(beta), 3, 0);
        const softshadow_light light = scene_sphere_light(0, 0, 10, 10 * sin(0.3));
        const double b = oracle_brute(&ball, &light, p, NULL, SOFTSHADOW_SOLID_ANGLE, 10000);
        CHECK(fabs(oracle_caps(0.3, beta, theta) - b) < 0.008, "theta %g: %g", theta, b);
        scene_free(&ball);
    }
    const softshadow_light light = scene_rect_light(1, 0, 3, 2, 1);
    const double up[3] = {0, 0, 1}, w[4][3] = {{-1, -1, 3}, {3, -1, 3}, {3, 1, 3}, {-1, 1, 3}};
    for (double x = 0; x < 2; x += 0.5) { /* hidden: x > x */
        scene_mesh mesh = {0};
        scene_rect(&mesh, x / 2, 9, -9, 9, 1.5);
        const double seen[4][3] = {{-1, -1, 3}, {x, -1, 3}, {x, 1, 3}, {-1, 1, 3}};
        const double v =
            oracle_polygon_irradiance(seen, 4, up) / oracle_polygon_irradiance(w, 4, up);
        const double b = oracle_brute(&mesh, &light, p, up, SOFTSHADOW_IRRADIANCE, 40000);
        CHECK(fabs(v - b) < 0.004, "x = %g: closed %g, brute %g", x, v, b);
        scene_free(&mesh);
    }
}

static void bench_scenes_are_as_large_as_they_say(void **state) {
    (void)state;
    for (size_t i = 0; i < scene_entry_count; i++) {
        const scene_entry *e = &scene_entries[i];
        scene_mesh mesh = {0};
        e->make(&mesh);
        double most = 0;
        for (size_t k = 0; k < mesh.vertices; k++) {
            const double *v = mesh.xyz + 3 * k;
            most = fmax(
                most, hypot(hypot(v[0] - e->centre[0], v[1] - e->centre[1]), v[2] - e->centre[2]));
        }
        print_message("           %s: %zu triangles, radius %.3f\n", e->name, mesh.triangles, most);
        CHECK(most <= e->radius && most > 0.9 * e->radius, "%s: %g, said %g", e->name, most,
              e->radius);
        scene_free(&mesh);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(edge_is_the_integral_of_chords),
        cmocka_unit_test(union_agrees_with_edges),
        cmocka_unit_test(union_agrees_with_disks),
        cmocka_unit_test(union_agrees_with_overlaps),
        cmocka_unit_test(union_agrees_with_brute_force),
        cmocka_unit_test(profile_agrees_with_limb_edge),
        cmocka_unit_test(weightings_agree_with_brute_force),
        cmocka_unit_test(bench_scenes_are_as_large_as_they_say),
    };
    return cmocka_run_group_tests_name("oracles", tests, NULL, NULL);
}
