/* Inputs at the edge of what is allowed: points that are none, far scenes, far lights, horizons,
 * points inside lamps, casters behind them, contact at every scale, opacity, flags. */
#include "property/truth.h"

enum { SIDE = 24, N = SIDE * SIDE, SAMPLES = 512 };

static scene_mesh thing(void) {
    scene_mesh mesh = {0};
    scene_garbage(&mesh, 21);
    scene_icosphere(&mesh, (const double[3]){0.2, 0.1, 2}, 0.9, 2, 0.1);
    return mesh;
}

static double (*grid(double (*points)[3]))[3] {
    scene_grid(points, SIDE, -2, 2, -2, 2, 0);
    return points;
}

/* ---- Points that are none ---------------------------------------------------------------------*/

static void bad_points_are_nan_and_counted(void **state) {
    double good[N][3], mixed[N][3];
    grid(good);
    memcpy(mixed, good, sizeof mixed);
    const double bad[] = {NAN, INFINITY, -INFINITY, 1.1e15, -1e300, 1e308};
    for (int i = 0; i < 60; i++) mixed[7 + 9 * i][i % 3] = bad[i % 6];
    scene_mesh mesh = thing();
    ask a = ask_new(*state, &mesh, scene_sphere_light(0, 0, 7, 1), (const double(*)[3])good, N,
                    SAMPLES);
    ask b = a;
    b.points = (const double(*)[3])mixed;
    ask_do(&a), ask_do(&b);
    CHECK(a.stats.points_bad == 0 && b.stats.points_bad == 60, "points_bad %llu, 60 expected",
          (unsigned long long)b.stats.points_bad);
    CHECK(b.stats.points == N, "points %llu", (unsigned long long)b.stats.points);
    for (int i = 0; i < N; i++) {
        const bool is_bad = i >= 7 && (i - 7) % 9 == 0 && (i - 7) / 9 < 60;
        CHECK(!is_bad == !isnan(b.visibility[i]), "point %d: %g", i, b.visibility[i]);
        CHECK(!is_bad || isnan(b.bound[i]), "point %d: bound %g", i, b.bound[i]);
        /* auto sees another batch; the others answer point by point. */
        const double most = ask_auto(*state) ? a.bound[i] + b.bound[i] + 0.02 : 0;
        CHECK(is_bad || fabs((double)a.visibility[i] - b.visibility[i]) <= most,
              "point %d: %g beside bad points, %g without", i, b.visibility[i], a.visibility[i]);
    }
    ask_free(&a), ask_free(&b);
    scene_free(&mesh);
}

static void points_outside_bounds(void **state) {
    double points[N][3];
    grid(points);
    scene_mesh mesh = thing();
    const double bounds[6] = {-1, -1.5, -0.1, 1, 1.5, 0.1};
    ask q = ask_new(*state, &mesh, scene_sphere_light(0, 0, 7, 1), (const double(*)[3])points, N,
                    SAMPLES);
    q.build.bounds = bounds;
    ask_do(&q);
    uint64_t outside = 0;
    for (int i = 0; i < N; i++) {
        const bool out = fabs(points[i][0]) > 1 || fabs(points[i][1]) > 1.5;
        outside += out;
        CHECK(!out == !isnan(q.visibility[i]), "point %d: %g", i, q.visibility[i]);
    }
    CHECK(q.stats.points_bad == outside, "points_bad %llu of %llu",
          (unsigned long long)q.stats.points_bad, (unsigned long long)outside);
    ask_free(&q);
    scene_free(&mesh);
}

/* Casters far from everything between the bounds and the light are told of as needless. */
static void bounds_make_casters_needless(void **state) {
    static const double bounds[6] = {-1, -1.5, -0.1, 1, 1.5, 0.1};
    static const double shift[12] = {1, 0, 0, 40, 0, 1, 0, 0, 0, 0, 1, 0};
    double points[N][3];
    grid(points);
    scene_mesh mesh = thing(), far = thing(), both = thing();
    scene_transform(&far, shift);
    scene_append(&both, &far);
    const scene_mesh *const meshes[] = {&mesh, &both, &both};
    uint64_t culled[3];
    for (int i = 0; i < 3; i++) {
        ask q = ask_new(*state, meshes[i], scene_sphere_light(0, 0, 7, 1),
                        (const double(*)[3])points, N, SAMPLES);
        q.build.bounds = i < 2 ? bounds : NULL;
        ask_do(&q);
        culled[i] = q.stats.casters_culled;
        ask_free(&q);
    }
    CHECK(culled[1] == culled[0] + far.triangles && culled[0] < mesh.triangles,
          "%llu, and with %zu far ones %llu", (unsigned long long)culled[0], far.triangles,
          (unsigned long long)culled[1]);
    CHECK(culled[2] == 0, "%llu without bounds", (unsigned long long)culled[2]);
    scene_free(&mesh), scene_free(&far), scene_free(&both);
}

/* No casters at all, and the world's worst normals: V = 1, or 0 below the horizon. */
static void nothing_casts(void **state) {
    double points[N][3];
    grid(points);
    scene_mesh empty = {0};
    const softshadow_light lights[] = {
        scene_rect_light(0, 0, 5, 1, 1), scene_disk_light(0, 0, 5, 0, 0, 1, 1),
        scene_sphere_light(0, 0, 5, 1), scene_sun_light(0, 0, -1, 0.1)};
    for (size_t i = 0; i < COUNT(lights); i++) {
        ask q = ask_new(*state, &empty, lights[i], (const double(*)[3])points, N, 0);
        ask_do(&q);
        for (int k = 0; k < N; k++)
            CHECK(q.visibility[k] == 1, "light %zu: %g", i, q.visibility[k]);
        float down[N][3];
        for (int k = 0; k < N; k++)
            down[k][0] = down[k][1] = 0, down[k][2] = k % 2 ? -1e-30f : -1e30f;
        q.normals = (const float(*)[3])down;
        ask_do(&q);
        for (int k = 0; k < N; k++)
            CHECK(q.visibility[k] == 0, "light %zu, turned away: %g", i, q.visibility[k]);
        memset(down, 0, sizeof down); /* 0 0 0: no normal */
        ask_do(&q);
        for (int k = 0; k < N; k++)
            CHECK(q.visibility[k] == 1, "light %zu, no normal: %g", i, q.visibility[k]);
        ask_free(&q);
    }
}

/* ---- Far away ---------------------------------------------------------------------------------*/

static void far_scenes(void **state) {
    static const double moves[][3] = {{1e5 + 0.1, 3e4, -1e5}, {1e7 + 0.3, -1e7 + 0.7, 1e7 + 0.1}};
    scene_mesh here = thing();
    double points[N][3], there[N][3];
    grid(points);
    for (size_t m = 0; m < COUNT(moves); m++) {
        const double *t = moves[m];
        scene_mesh far = scene_copy(&here);
        scene_transform(&far, (const double[12]){1, 0, 0, t[0], 0, 1, 0, t[1], 0, 0, 1, t[2]});
        for (int i = 0; i < N; i++) {
            for (int k = 0; k < 3; k++) there[i][k] = points[i][k] + t[k];
        }
        for (int type = 0; type < 3; type++) {
            softshadow_light light = type == 0   ? scene_sphere_light(0.3, 0.1, 7, 1)
                                     : type == 1 ? scene_rect_light(0.3, 0.1, 7, 1, 1)
                                                 : scene_sun_light(0.1, 0.1, -1, 0.12);
            ask a = ask_new(*state, &here, light, (const double(*)[3])points, N, SAMPLES);
            for (int k = 0; k < 3; k++) light.position[k] += t[k];
            ask b = ask_new(*state, &far, light, (const double(*)[3])there, N, SAMPLES);
            ask_do(&a), ask_do(&b);
            char what[64];
            snprintf(what, sizeof what, "moved by %g, light %d", t[0], type);
            /* Doubles at 1e7 are rounded to 2e-9: a sample in a million changes sides. */
            if (ask_noise_free(*state))
                ask_same_samples(a.visibility, b.visibility, N, SAMPLES, 0.9999, what);
            else
                ask_same_truth(&a, &b, what);
            ask_free(&a), ask_free(&b);
        }
        scene_free(&far);
    }
    scene_free(&here);
}

static void a_far_lamp_is_a_sun(void **state) {
    scene_mesh mesh = thing();
    double points[N][3];
    grid(points);
    const double d[3] = {0.3, -0.2, sqrt(1 - 0.13)};
    ask sun = ask_new(*state, &mesh, scene_sun_light(-d[0], -d[1], -d[2], asin(0.1)),
                      (const double(*)[3])points, N, 2 * SAMPLES);
    ask lamp = ask_new(*state, &mesh, scene_sphere_light(1e9 * d[0], 1e9 * d[1], 1e9 * d[2], 1e8),
                       (const double(*)[3])points, N, 2 * SAMPLES);
    ask_do(&sun), ask_do(&lamp);
    ask_same_truth(&sun, &lamp, "a lamp of radius 1e8 at 1e9");
    double truth[N];
    for (int i = 0; i < N; i++) truth[i] = oracle_union(&mesh, &sun.light, points[i], NULL);
    ask_compare(&lamp, truth, "far lamp", 1.0 / 256, 2 * truth_max(*state), 1e-6);
    ask_free(&sun), ask_free(&lamp);
    scene_free(&mesh);
}

/* ---- Contact at every scale -------------------------------------------------------------------*/

/* Points on a convex body, up to the rounding of their type: they never shadow themselves, and
 * facets that look away are dark. */
static void on_a_ball(const char *method, double scale, double offset, bool floats, bool named) {
    enum { POINTS = 1500 };
    scene_mesh ball = {0};
    scene_icosphere(&ball, (const double[3]){offset * scale, 0, 0}, scale, 3, 0);
    static double points[POINTS][3];
    static float points32[POINTS][3], normals[POINTS][3], visibility[POINTS];
    static uint64_t primitives[POINTS];
    static bool lit[POINTS];
    uint64_t s = 8;
    const softshadow_light light = scene_sun_light(-0.3, 0.2, -1, 0.05);
    if (floats)
        for (size_t i = 0; i < 3 * ball.vertices; i++) ball.xyz[i] = (float)ball.xyz[i];
    for (int i = 0; i < POINTS;) {
        const uint32_t t = (uint32_t)(scene_random(&s) % ball.triangles);
        const double *v[3], u = sqrt(scene_uniform(&s, 0, 1)), w = scene_uniform(&s, 0, 1);
        double n[3], e[2][3], cosine = 0;
        for (int k = 0; k < 3; k++) v[k] = ball.xyz + 3 * (size_t)ball.indices[3 * t + k];
        for (int k = 0; k < 3; k++) e[0][k] = v[1][k] - v[0][k], e[1][k] = v[2][k] - v[0][k];
        for (int k = 0; k < 3; k++) {
            n[k] = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
        }
        const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int k = 0; k < 3; k++) {
            points[i][k] = (1 - u) * v[0][k] + u * (1 - w) * v[1][k] + u * w * v[2][k];
            points32[i][k] = (float)points[i][k];
            normals[i][k] = (float)(n[k] / length);
            cosine -= n[k] / length * light.direction[k] / sqrt(1.13);
        }
        if (fabs(cosine) < 0.15) continue; /* half the sun's width, and neighbouring facets */
        lit[i] = cosine > 0;
        primitives[i++] = t;
    }
    softshadow *handle = NULL;
    OK(NULL, softshadow_create(&handle, NULL));
    const softshadow_mesh mesh = ask_mesh(&ball);
    OK(handle, softshadow_add_mesh(handle, &mesh, NULL));
    OK(handle, softshadow_set_light(handle, &light));
    softshadow_build build = SOFTSHADOW_BUILD_INIT;
    build.method = method, build.samples = 256;
    OK(handle, softshadow_build_maps(handle, &build));
    softshadow_points batch = ask_points((const double(*)[3])points, POINTS);
    if (floats) batch.position_type = SOFTSHADOW_F32, batch.positions = points32;
    batch.normals = (const float *)normals;
    if (named) batch.primitives = primitives;
    OK(handle, softshadow_query_visibility(handle, &batch, visibility));
    size_t acne = 0, leaks = 0;
    for (int i = 0; i < POINTS; i++)
        acne += lit[i] && visibility[i] != 1, leaks += !lit[i] && visibility[i] != 0;
    CHECK(acne == 0 && leaks == 0,
          "scale %g, offset %g, %s, %s: %zu shadowed by themselves, %zu lit through", scale, offset,
          floats ? "float" : "double", named ? "primitives" : "normals", acne, leaks);
    softshadow_destroy(handle);
    scene_free(&ball);
}

static void contact_at_every_scale(void **state) {
    static const double scale[] = {1e-6, 0x1p-10, 1, 1e3, 1e6};
    for (size_t i = 0; i < COUNT(scale); i++) {
        for (int k = 0; k < 4; k++) {
            on_a_ball(*state, scale[i], 0, k & 1, k & 2);
            on_a_ball(*state, scale[i], 1000.7, k & 1, k & 2);
        }
    }
    on_a_ball(*state, 1, 1e6 + 0.3, false, false);
    on_a_ball(*state, 1, 1e6 + 0.3, false, true);
}

/* A ground that is a caster itself, at a height no float holds; the points lie on it. */
static void a_ground_that_casts(void **state) {
    double points[N][3], truth[N];
    float up[N][3];
    grid(points);
    scene_mesh mesh = thing(), above = thing();
    scene_rect(&mesh, -30, 31, -32, 33, 0.1);
    const softshadow_light light = scene_sphere_light(0, 0.5, 7, 1.2);
    for (int i = 0; i < N; i++) {
        points[i][2] = 0.1;
        up[i][0] = up[i][1] = 0, up[i][2] = 1;
        truth[i] = oracle_union(&above, &light, points[i], NULL);
    }
    ask q = ask_new(*state, &mesh, light, (const double(*)[3])points, N, truth_samples(*state));
    q.normals = (const float(*)[3])up;
    ask_do(&q);
    ask_compare(&q, truth, "on a ground that casts", 1.0 / 256, 2 * truth_max(*state), 1e-6);
    q.normals = NULL; /* on the light's side, then */
    ask_do(&q);
    ask_compare(&q, truth, "the same without normals", 1.0 / 256, 2 * truth_max(*state), 1e-6);
    ask_free(&q);
    scene_free(&mesh), scene_free(&above);
}

/* ---- Lamps ------------------------------------------------------------------------------------*/

static void inside_and_behind_a_lamp(void **state) {
    scene_mesh mesh = {0};
    scene_box(&mesh, (const double[3]){-0.5, -0.5, 4.5}, (const double[3]){0.5, 0.5, 5.5});
    scene_rect(&mesh, -9, 9, -9, 9, 9); /* behind the lamp, seen from below */
    const softshadow_light lamp = scene_sphere_light(0, 0, 5, 2);
    /* Inside; on its surface; and below it, where the box inside the lamp hides something only as
     * far as the circle where the tangent cone touches: z = 5 - 4/d. */
    const double points[4][3] = {{0.1, 0.2, 5.9}, {0, 0, 5}, {0, 0, 3}, {0, 0, 0}};
    double truth[4];
    for (int i = 0; i < 4; i++) truth[i] = oracle_union(&mesh, &lamp, points[i], NULL);
    CHECK(truth[0] == 1 && truth[1] == 1 && truth[2] == 1, "inside is inside");
    CHECK(truth[3] == 1, "z = 4.2 is below the box: it does not count");
    ask q = ask_new(*state, &mesh, lamp, points, 4, truth_samples(*state));
    ask_do(&q);
    for (int i = 0; i < 4; i++) CHECK(q.visibility[i] == 1, "point %d: %g", i, q.visibility[i]);
    ask_free(&q);
    scene_free(&mesh);
}

/* Below the emitting side nothing is seen under irradiance (0/0 = 0); from both sides otherwise. */
static void sides_of_a_flat_lamp(void **state) {
    const double points[2][3] = {{0.3, 0.1, 0}, {0.3, 0.1, 9}};
    const float normals[2][3] = {{0, 0, 1}, {0, 0, -1}};
    scene_mesh empty = {0};
    const softshadow_light lamps[2] = {scene_rect_light(0, 0, 5, 1, 1),
                                       scene_disk_light(0, 0, 5, 0, 0, -1, 1)};
    for (int i = 0; i < 2; i++) {
        for (uint32_t weighting = 0; weighting < 3; weighting++) {
            ask q = ask_new(*state, &empty, lamps[i], points, 2, truth_samples(*state));
            q.normals = normals;
            q.build.weighting = weighting;
            ask_do(&q);
            const float other = weighting == SOFTSHADOW_IRRADIANCE ? 0 : 1;
            CHECK(q.visibility[0] == 1 && q.visibility[1] == other, "lamp %d, weighting %u: %g %g",
                  i, weighting, q.visibility[0], q.visibility[1]);
            ask_free(&q);
        }
    }
}

/* ---- Meshes that do not cast, or not everywhere -----------------------------------------------*/

static void opacity(void **state) {
    /* 4 x 2 texels over a rectangle of 4 x 2: texels that reach the threshold cast. */
    static const uint8_t texels[8] = {255, 0, 128, 127, 0, 200, 127, 255};
    scene_mesh plate = {0}, squares = {0};
    scene_rect(&plate, -2, 2, -1, 1, 3);
    static const float uv[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    static const float tiled[4][2] = {{-1, 2}, {0, 2}, {0, 3}, {-1, 3}}; /* u and v repeat */
    for (int i = 0; i < 8; i++) {
        if (texels[i] / 255.0 < 0.5) continue;
        scene_rect(&squares, i % 4 - 2, i % 4 - 1, i / 4 - 1, i / 4, 3);
    }
    double points[N][3], truth[N];
    grid(points);
    const softshadow_light light = scene_disk_light(0.2, 0.1, 6, 0, 0, -1, 0.8);
    for (int i = 0; i < N; i++) truth[i] = oracle_union(&squares, &light, points[i], NULL);
    for (int k = 0; k < 2; k++) {
        ask q = ask_new(*state, NULL, light, (const double(*)[3])points, N, truth_samples(*state));
        softshadow *handle = ask_handle(&q);
        softshadow_mesh mesh = ask_mesh(&plate);
        mesh.uvs = (const float *)(k ? tiled : uv);
        mesh.opacity = (softshadow_texture){4, 2, texels};
        mesh.opacity_threshold = 0.5f;
        OK(handle, softshadow_add_mesh(handle, &mesh, NULL));
        softshadow_build build = q.build;
        build.method = *state;
        OK(handle, softshadow_build_maps(handle, &build));
        ask_query(handle, &q);
        ask_compare(&q, truth, k ? "tiled opacity" : "opacity", 1.0 / 256, 2 * truth_max(*state),
                    1e-6);
        softshadow_destroy(handle);
        ask_free(&q);
    }
    scene_free(&plate), scene_free(&squares);
}

static void flags_decide_what_casts(void **state) {
    double points[N][3];
    grid(points);
    scene_mesh mesh = thing();
    ask casts = ask_new(*state, &mesh, scene_sphere_light(0, 0, 7, 1), (const double(*)[3])points,
                        N, SAMPLES);
    ask_do(&casts);
    static const uint32_t flags[] = {SOFTSHADOW_CASTS, SOFTSHADOW_RECEIVES,
                                     SOFTSHADOW_CASTS | SOFTSHADOW_RECEIVES | SOFTSHADOW_BORROW};
    for (size_t i = 0; i < COUNT(flags); i++) {
        ask q = ask_new(*state, NULL, casts.light, (const double(*)[3])points, N, SAMPLES);
        softshadow *handle = ask_handle(&q);
        softshadow_mesh given = ask_mesh(&mesh);
        given.flags = flags[i];
        OK(handle, softshadow_add_mesh(handle, &given, NULL));
        softshadow_build build = q.build;
        build.method = *state;
        OK(handle, softshadow_build_maps(handle, &build));
        ask_query(handle, &q);
        if (flags[i] & SOFTSHADOW_CASTS) ask_same_bits(casts.visibility, q.visibility, N, "flags");
        for (int k = 0; k < N && !(flags[i] & SOFTSHADOW_CASTS); k++) {
            CHECK(q.visibility[k] == 1, "a mesh that only receives shadows point %d: %g", k,
                  q.visibility[k]);
        }
        softshadow_destroy(handle);
        ask_free(&q);
    }
    ask_free(&casts);
    scene_free(&mesh);
}

/* auto keeps the tolerance it is asked for; more samples come closer to the truth. */
static void tolerances_are_kept(void **state) {
    static const double tolerance[] = {1.0 / 64, 1.0 / 256, 1.0 / 1024};
    scene_mesh mesh = thing();
    double points[N][3], truth[N];
    grid(points);
    const softshadow_light light = scene_sphere_light(0, 0.3, 7, 1.2);
    for (int i = 0; i < N; i++) truth[i] = oracle_union(&mesh, &light, points[i], NULL);
    for (size_t i = 0; i < COUNT(tolerance); i++) {
        ask q = ask_new(*state, &mesh, light, (const double(*)[3])points, N, 0);
        q.build.tolerance = tolerance[i];
        ask_do(&q);
        char what[48];
        snprintf(what, sizeof what, "tolerance 1/%g", 1 / tolerance[i]);
        ask_compare(&q, truth, what, tolerance[i], 1, 1e-6);
        ask_free(&q);
    }
    scene_free(&mesh);
}

/* Light from so thin a ring, or so small a spot, that samples may miss it: a fraction even then,
 * and never outside the bound, of which the truth (the hard shadow of the spot) is the test. */
static void spikes_of_a_profile(void **state) {
    static float profile[4096];
    scene_mesh mesh = thing();
    double points[N][3], truth[N];
    grid(points);
    softshadow_light light = scene_sphere_light(0, 0.3, 7, 1.2), spot = light;
    spot.radius = 1.2e-4;
    for (int i = 0; i < N; i++) truth[i] = oracle_union(&mesh, &spot, points[i], NULL);
    memset(profile, 0, sizeof profile);
    profile[0] = 1;
    light.profile = profile, light.profile_count = COUNT(profile);
    ask q = ask_new(*state, &mesh, light, (const double(*)[3])points, N, 0);
    ask_do(&q);
    for (int i = 0; i < N; i++) {
        const float v = q.visibility[i];
        CHECK(v >= 0 && v <= 1, "point %d: %g", i, v);
        /* Statistical bounds know nothing of what no ray was aimed at. */
        if (!ask_certified(q.method)) continue;
        CHECK(fabs(v - truth[i]) <= q.bound[i] + 1e-6, "point %d: %g, truth %g, bound %g", i, v,
              truth[i], q.bound[i]);
    }
    ask_free(&q);
    scene_free(&mesh);
}

/* A point that is none may name a triangle that is none: the others are answered. */
static void bad_points_name_anything(void **state) {
    scene_mesh mesh = thing();
    double points[N][3];
    uint64_t primitives[N];
    grid(points);
    for (int i = 0; i < N; i++) primitives[i] = SOFTSHADOW_NO_PRIMITIVE;
    points[3][1] = NAN, primitives[3] = 77;
    ask q = ask_new(*state, &mesh, scene_sphere_light(0, 0.3, 7, 1.2), (const double(*)[3])points,
                    N, 0);
    q.primitives = primitives;
    ask_do(&q);
    for (int i = 0; i < N; i++) {
        CHECK(isnan(q.visibility[i]) == (i == 3), "point %d: %g", i, q.visibility[i]);
    }
    ask_free(&q);
    scene_free(&mesh);
}

/* Whole numbers, and as many of the least number there is: rays are refused, all others answer as
 * well as they do. Maps have another lattice there: points at edges differ, a few in a hundred. */
static void the_least_numbers(void **state) {
    double whole[N][3], least[N][3];
    scene_mesh mesh = thing();
    for (size_t i = 0; i < 3 * mesh.vertices; i++) mesh.xyz[i] = rint(256 * mesh.xyz[i]);
    scene_grid(whole, SIDE, -1500, 1500, -1500, 1500, 0);
    ask a = ask_new(*state, &mesh, scene_sphere_light(60, -40, 1800, 100),
                    (const double(*)[3])whole, N, SAMPLES);
    ask_do(&a);
    for (size_t i = 0; i < 3 * mesh.vertices; i++) mesh.xyz[i] = ldexp(mesh.xyz[i], -1074);
    for (int i = 0; i < N; i++)
        for (int k = 0; k < 3; k++) least[i][k] = ldexp(whole[i][k], -1074);
    ask b = a;
    b.points = (const double(*)[3])least, b.visibility = b.bound = NULL;
    for (int k = 0; k < 3; k++) b.light.position[k] = ldexp(a.light.position[k], -1074);
    b.light.radius = ldexp(a.light.radius, -1074);
    if (strcmp(*state, "raytrace") == 0) {
        softshadow *handle = ask_handle(&(ask){.method = "exact", .mesh = &mesh, .light = b.light,
                                               .build = b.build, .options = b.options});
        softshadow_build build = a.build;
        build.method = "raytrace";
        CHECK(softshadow_build_maps(handle, &build) == SOFTSHADOW_E_UNSUPPORTED, "%s",
              softshadow_last_message(handle));
        softshadow_destroy(handle);
    } else {
        ask_do(&b);
        int lit = 0, dark = 0, others = 0;
        for (int i = 0; i < N; i++) {
            const double off = fabs(a.visibility[i] - b.visibility[i]);
            lit += a.visibility[i] > .5f, dark += a.visibility[i] < .5f;
            CHECK(!ask_truthful(*state) || off <= a.bound[i] + b.bound[i], "point %d: %g, %g", i,
                  a.visibility[i], b.visibility[i]);
            others += off > .02;
        }
        CHECK(lit > 20 && dark > 20 && others < N / 20, "%d lit, %d dark, %d otherwise", lit, dark,
              others);
        ask_free(&b);
    }
    ask_free(&a);
    scene_free(&mesh);
}

/* One sliver in a scene a thousand times as wide and more, the lamp wholly above its plane: no
 * point of it is dark. Floats know the plane of such a triangle badly, or not at all. */
static void slivers_stay_lit(void **state) {
    enum { SLIVERS = 500, ON = 12 };
    uint64_t s = 1;
    for (int t = 0; t < SLIVERS; t++) {
        scene_mesh mesh = {0};
        double r[9], at[3], points[ON][3], lamp[3];
        uint64_t primitives[ON] = {0};
        scene_rotation(&s, r);
        const double width = pow(10, scene_uniform(&s, -12, -3)), length = scene_uniform(&s, .3, 1);
        const double corner[3][2] = {
            {-length, 0}, {length, 0}, {scene_uniform(&s, -length, length), width}};
        for (int k = 0; k < 3; k++) at[k] = scene_uniform(&s, -.3, .3);
        for (int i = 0; i < 3; i++) {
            double x[3];
            for (int k = 0; k < 3; k++)
                x[k] = at[k] + r[3 * k] * corner[i][0] + r[3 * k + 1] * corner[i][1];
            scene_vertex(&mesh, x[0], x[1], x[2]);
        }
        scene_triangle(&mesh, 0, 1, 2);
        for (int i = -1; i <= 1; i += 2) { /* no area: there to make the scene wide */
            const uint32_t v = scene_vertex(&mesh, i, i, i);
            scene_triangle(&mesh, v, v, v);
        }
        const double far = scene_uniform(&s, 2, 5), up = far * scene_uniform(&s, .1, 1),
                     turn = scene_uniform(&s, 0, 2 * SCENE_PI);
        for (int k = 0; k < 3; k++) {
            lamp[k] = at[k] + r[3 * k] * far * cos(turn) + r[3 * k + 1] * far * sin(turn) +
                      r[3 * k + 2] * up;
        }
        for (int i = 0; i < ON; i++) {
            const double u = scene_uniform(&s, 0, .5), v = scene_uniform(&s, 0, .5);
            for (int k = 0; k < 3; k++) {
                const double *x = mesh.xyz + k;
                points[i][k] = (1 - u - v) * x[0] + u * x[3] + v * x[6];
            }
        }
        ask q = ask_new(*state, &mesh, scene_sphere_light(lamp[0], lamp[1], lamp[2], .4 * up),
                        (const double(*)[3])points, ON, 256);
        q.primitives = primitives;
        ask_do(&q);
        for (int i = 0; i < ON; i++)
            CHECK(q.visibility[i] == 1, "sliver %d, %g wide: %g", t, width, q.visibility[i]);
        ask_free(&q);
        scene_free(&mesh);
    }
}

int main(void) {
    const ask_test tests[] = {
        {"bad points are NaN and counted", bad_points_are_nan_and_counted, NULL},
        {"points outside the bounds", points_outside_bounds, NULL},
        {"bounds make casters needless", bounds_make_casters_needless, ask_certified},
        {"bad points name anything", bad_points_name_anything, NULL},
        {"spikes of a profile", spikes_of_a_profile, ask_truthful},
        {"nothing casts", nothing_casts, ask_truthful},
        {"scenes at 1e5 and 1e7", far_scenes, ask_truthful},
        {"a far lamp is a sun", a_far_lamp_is_a_sun, ask_truthful},
        {"contact at every scale", contact_at_every_scale, ask_truthful},
        {"a ground that casts", a_ground_that_casts, ask_truthful},
        {"inside and behind a lamp", inside_and_behind_a_lamp, ask_truthful},
        {"sides of a flat lamp", sides_of_a_flat_lamp, ask_truthful},
        {"the least numbers", the_least_numbers, NULL},
        {"slivers stay lit", slivers_stay_lit, ask_truthful},
        {"opacity", opacity, ask_truthful},
        {"flags decide what casts", flags_decide_what_casts, NULL},
        {"tolerances are kept", tolerances_are_kept, ask_truthful},
    };
    return ask_run("inputs", tests, COUNT(tests));
}
