/* The preview's own geometry: first hits, cameras, normals, shading against plain computations. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "cli/render/camera.h"
#include "cli/render/normals.h"
#include "cli/render/raster.h"
#include "cli/render/shade.h"

enum { W = 61, H = 47, TRIANGLES = 200 };

static double random_unit(void) { return rand() / (double)RAND_MAX; }

static viewpoint aimed(const char *text, char up) {
    viewpoint c;
    cli_error error;
    assert_true(camera_parse(&c, text, &error));
    assert_true(camera_aim(&c, up, W, H, &error));
    return c;
}

/* Where a ray from the eye meets a triangle, in the world's frame (Moller and Trumbore 1997); 0:
 * nowhere. */
static double meet(const viewpoint *c, vector ray, const raster_surface *s, size_t triangle) {
    const uint32_t *i = s->indices + 3 * triangle;
    const vector a = vector_of(s->positions + 3 * (size_t)i[0]);
    const vector u = vector_sub(vector_of(s->positions + 3 * (size_t)i[1]), a);
    const vector v = vector_sub(vector_of(s->positions + 3 * (size_t)i[2]), a);
    const vector d = vector_add(
        vector_add(vector_scale(c->right, ray.x), vector_scale(c->up, ray.y)), c->forward);
    const vector from = vector_sub(c->eye, a), p = vector_cross(d, v), q = vector_cross(from, u);
    const double det = vector_dot(u, p);
    if (det == 0) return 0;
    const double x = vector_dot(from, p) / det, y = vector_dot(d, q) / det,
                 t = vector_dot(v, q) / det;
    return t > 0 && x >= 0 && y >= 0 && x + y <= 1 ? t : 0;
}

static double nearest(const viewpoint *c, vector ray, const raster_surface *s) {
    double best = INFINITY;
    for (size_t k = 0; k < s->triangle_count; k++) {
        const double t = meet(c, ray, s, k);
        if (t > 0) best = fmin(best, t);
    }
    return best;
}

/* Random triangles around the eye, many of them through its plane, against every triangle tried. */
static void first_hits_are_the_nearest(void **state) {
    (void)state;
    static double positions[TRIANGLES * 9];
    static uint32_t indices[TRIANGLES * 3];
    static raster_hit hits[W * H];
    srand(7);
    for (int i = 0; i < TRIANGLES; i++) {
        double centre[3];
        for (int k = 0; k < 3; k++) centre[k] = 8 * random_unit() - 4;
        for (int k = 0; k < 9; k++) positions[9 * i + k] = centre[k % 3] + 3 * random_unit() - 1.5;
        for (int k = 0; k < 3; k++) indices[3 * i + k] = (uint32_t)(3 * i + k);
    }
    raster_surface s = {positions, indices, TRIANGLES * 3, TRIANGLES, NULL};
    const viewpoint c = aimed("0.3,0.2,0.1/3,1,-2/75", 'y');
    assert_true(raster_see(&s, &c));
    raster_band band = {W, H, 0, H, hits};
    raster_fill(&band, &c, &s, 1);
    int met = 0, differ = 0;
    for (uint32_t y = 0; y < H; y++)
        for (uint32_t x = 0; x < W; x++) {
            const vector ray = raster_ray(&c, W, H, x, y);
            const raster_hit hit = hits[y * W + x];
            const double t = nearest(&c, ray, &s);
            met += isfinite(t);
            /* 1e-9: both are doubles of a scene of size 8; a ray through an edge may do both */
            if (isinf(t) != isinf(hit.depth) || (isfinite(t) && fabs(t - hit.depth) > 1e-9 * t))
                differ++;
        }
    assert_true(met > W * H / 2);
    assert_true(differ <= 1);
    free(s.seen);
}

/* A grid of triangles seen from above leaves no ray through, also where bands meet. */
static void shared_edges_do_not_leak(void **state) {
    (void)state;
    enum { N = 23 };
    static double positions[(N + 1) * (N + 1) * 3];
    static uint32_t indices[N * N * 6];
    static raster_hit hits[W * H];
    srand(3);
    for (uint32_t i = 0; i <= N; i++)
        for (uint32_t j = 0; j <= N; j++) {
            double *p = positions + 3 * (i * (N + 1) + j);
            p[0] = (double)i - N / 2.0;
            p[1] = 0.3 * random_unit();
            p[2] = (double)j - N / 2.0;
        }
    for (uint32_t i = 0, *t = indices; i < N; i++)
        for (uint32_t j = 0; j < N; j++, t += 6) {
            const uint32_t a = i * (N + 1) + j, b = a + N + 1;
            const uint32_t two[6] = {a, b, b + 1, a, b + 1, a + 1};
            memcpy(t, two, sizeof two);
        }
    raster_surface s = {positions, indices, (N + 1) * (N + 1), N * N * 2, NULL};
    const viewpoint c = aimed("0,9,0/0,0,0/60", 'y'); /* through vertices and along edges */
    assert_true(raster_see(&s, &c));
    for (uint32_t first = 0; first < H; first += 10) {
        raster_band band = {W, H, first, H - first < 10 ? H - first : 10, hits};
        raster_fill(&band, &c, &s, 1);
        for (uint32_t i = 0; i < W * band.rows; i++) assert_true(hits[i].surface == 0);
    }
    free(s.seen);
}

static const double cube[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0,
                              0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1};
static const uint32_t cube_faces[] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                      2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};

/* Faces that share vertices at 90 degrees stay flat; a bent strip of 20 degrees becomes round. */
static void creases_stay(void **state) {
    (void)state;
    raster_surface s = {cube, cube_faces, 8, 12, NULL};
    facing n;
    assert_true(normals_make(&n, &s, true));
    const double corner[3] = {1, 0, 0};
    for (uint32_t t = 0; t < 12; t++) {
        const vector flat = normals_flat(&n, t), smooth = normals_smooth(&n, &s, t, corner);
        assert_true(vector_length(vector_sub(flat, smooth)) < 1e-12);
        const vector out =
            vector_sub(vector_of(cube + 3 * cube_faces[3 * t]), (vector){0.5, 0.5, 0.5});
        assert_true(vector_dot(flat, out) > 0);
    }
    normals_free(&n);
    const double rise = tan(20 * M_PI / 180);
    const double strip[] = {-1, 0, 0, -1, 0, 1, 0, 0, 0, 0, 0, 1, 1, rise, 0, 1, rise, 1};
    const uint32_t faces[] = {0, 1, 3, 0, 3, 2, 2, 3, 5, 2, 5, 4};
    raster_surface bent = {strip, faces, 6, 4, NULL};
    assert_true(normals_make(&n, &bent, true));
    const double at_edge[3] = {0, 0, 1}; /* vertex 3 of the first face: on the bend */
    const vector smooth = normals_smooth(&n, &bent, 0, at_edge);
    const double angle = acos(vector_dot(smooth, normals_flat(&n, 0))) * 180 / M_PI;
    assert_true(angle > 5 && angle < 15);
    normals_free(&n);
}

/* The default camera holds every corner of the box, whatever the picture's shape. */
static void frames_hold_the_box(void **state) {
    (void)state;
    static const uint32_t sizes[][2] = {{800, 600}, {300, 900}, {1000, 100}, {1, 1}};
    const double box[6] = {1e3, -2, 5, 1e3 + 4, 7, 6};
    for (int up = 0; up < 2; up++)
        for (int k = 0; k < 4; k++) {
            viewpoint c;
            cli_error error;
            camera_frame(&c, box, "yz"[up], sizes[k][0], sizes[k][1]);
            assert_true(camera_aim(&c, "yz"[up], sizes[k][0], sizes[k][1], &error));
            for (int i = 0; i < 8; i++) {
                const double p[3] = {box[i & 1 ? 3 : 0], box[i & 2 ? 4 : 1], box[i & 4 ? 5 : 2]};
                const vector seen = camera_see(&c, vector_of(p));
                assert_true(seen.z > 0);
                assert_true(fabs(seen.x) < 0.8 * c.tan_x * seen.z &&
                            fabs(seen.y) < 0.8 * c.tan_y * seen.z);
            }
        }
}

static void cameras_are_parsed(void **state) {
    (void)state;
    static const char *const bad[] = {"",
                                      "1,2,3",
                                      "1,2,3/4,5",
                                      "1,2,3/4,5,6/",
                                      "1,2,3/4,5,6/0",
                                      "1,2,3/4,5,6/171",
                                      "1,2,3/4,5,6/30x",
                                      "1,2,nan/0,0,0",
                                      "1;2;3/0,0,0"};
    cli_error error;
    viewpoint c;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_false(camera_parse(&c, bad[i], &error));
        assert_int_equal(error.status, CLI_USAGE);
    }
    assert_true(camera_parse(&c, "1,2,-3e0/0,0,0/40", &error));
    assert_true(c.eye.z == -3 && c.fov == 40);
    assert_true(camera_parse(&c, "1,2,3/1,2,3", &error));
    assert_false(camera_aim(&c, 'y', 8, 8, &error));
}

/* At the reference, facing: 1. Twice as far from a sphere: a quarter. Below the horizon: none. */
static void shading_is_scaled(void **state) {
    (void)state;
    const vector here = {0, 0, 0}, up = {0, 1, 0}, down = {0, -1, 0};
    softshadow_light sphere = {.type = SOFTSHADOW_SPHERE, .position = {0, 2, 0}, .radius = 0.1};
    softshadow_light sun = {.type = SOFTSHADOW_SUN, .direction = {0, -3, 0}, .radius = 0.005};
    softshadow_light disk = {
        .type = SOFTSHADOW_DISK, .position = {0, 2, 0}, .direction = {0, 1, 0}, .radius = 0.5};
    const softshadow_light *const lights[] = {&sphere, &sun, &disk};
    for (int i = 0; i < 3; i++) {
        assert_true(fabs(shade_irradiance(lights[i], SOFTSHADOW_UNIFORM, here, here, up, 1) - 1) <
                    1e-12);
        assert_true(fabs(shade_irradiance(lights[i], SOFTSHADOW_UNIFORM, here, here, up, 0.25) -
                         0.25) < 1e-12);
        assert_true(shade_irradiance(lights[i], SOFTSHADOW_UNIFORM, here, here, down, 1) == 0);
    }
    const vector below = {0, -2, 0}, beyond = {0, 4, 0};
    assert_true(fabs(shade_irradiance(&sphere, SOFTSHADOW_UNIFORM, here, below, up, 1) - 0.25) <
                1e-12);
    /* This disk's normal looks up: under irradiance its light goes only there. */
    assert_true(shade_irradiance(&disk, SOFTSHADOW_IRRADIANCE, here, here, up, 1) == 0);
    assert_true(shade_irradiance(&disk, SOFTSHADOW_IRRADIANCE, here, beyond, down, 1) > 0.9);
    /* A lamp cut in half by the horizon gives something in both measures, and less in the second:
     * (c+s)/2 of what is seen, against (c+s)^2/4s in all. */
    const vector side = {1, 0, 0};
    const double half = shade_irradiance(&sphere, SOFTSHADOW_UNIFORM, here, here, side, 0.5);
    const double ratio = shade_irradiance(&sphere, SOFTSHADOW_IRRADIANCE, here, here, side, 1);
    assert_true(half > 0 && fabs(half - ratio) < 1e-12);
    assert_true(shade_srgb(0) == 0 && shade_srgb(2) == 1 &&
                fabsf(shade_srgb(0.5f) - 0.735357f) < 1e-5f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(first_hits_are_the_nearest),
        cmocka_unit_test(shared_edges_do_not_leak),
        cmocka_unit_test(creases_stay),
        cmocka_unit_test(frames_hold_the_box),
        cmocka_unit_test(cameras_are_parsed),
        cmocka_unit_test(shading_is_scaled),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
