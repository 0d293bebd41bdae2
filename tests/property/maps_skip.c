/* What map methods do not build, read from statistics and planes, and input that is none. Every method
 * that the library lists without an error bound is one. Through the public header only. */
#include "ask.h"

enum { SIDE = 48 };
static double ground[SIDE * SIDE][3];

static ask over_ground(const char *method, const scene_mesh *mesh, softshadow_light light) {
    static const double bounds[6] = {-2, -2, 0, 2, 2, 0};
    scene_grid(ground, SIDE, -2, 2, -2, 2, 0);
    ask q = ask_new(method, mesh, light, (const double(*)[3])ground, SIDE * SIDE, 0);
    q.build.resolution = 128, q.build.bounds = bounds, q.build.max_samples = 256;
    return q;
}

static scene_mesh body(void) {
    scene_mesh mesh = {0};
    const double centre[3] = {0, 0, 1};
    scene_icosphere(&mesh, centre, .6, 3, .3);
    return mesh;
}

static void moved(scene_mesh *mesh, double x, double y, double z) {
    const double matrix[12] = {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z};
    scene_transform(mesh, matrix);
}

typedef void with_method(const char *method);
static void each(with_method *run) {
    size_t n, maps = 0;
    const softshadow_method *methods = ask_methods(&n);
    for (size_t i = 0; i < n; i++) {
        if (methods[i].bound_kind != SOFTSHADOW_BOUND_NONE || ask_auto(methods[i].name)) continue;
        maps++;
        run(methods[i].name);
    }
    CHECK(maps >= 8, "%zu map methods", maps);
}

static void in_range(const ask *q) {
    for (size_t i = 0; i < q->count; i++)
        CHECK(q->visibility[i] >= 0 && q->visibility[i] <= 1, "%s: point %zu: %g", q->method, i,
              (double)q->visibility[i]);
}

/* ---- skipping ------------------------------------------------------------------------------- */

/* Casters that cannot shadow the bounds: beside them, behind them, behind the light. */
static void culled(const char *method) {
    const double place[4][3] = {{40, 0, 0}, {0, -60, 0}, {0, 0, -30}, {4, 2.4, 30}};
    scene_mesh mesh = body(), many = body();
    const size_t near = mesh.triangles;
    for (int i = 0; i < 4; i++) {
        scene_mesh far = body();
        moved(&far, place[i][0], place[i][1], place[i][2]);
        scene_append(&many, &far);
        scene_free(&far);
    }
    const softshadow_light light = scene_sphere_light(1, .6, 4, .2);
    ask few = over_ground(method, &mesh, light), more = over_ground(method, &many, light);
    ask_do(&few), ask_do(&more);
    CHECK(few.stats.casters_culled == 0, "%s: %llu", method, (unsigned long long)few.stats.casters_culled);
    CHECK(more.stats.casters_culled == 4 * near, "%s: culled %llu of %zu", method,
          (unsigned long long)more.stats.casters_culled, 4 * near);
    ask_free(&few), ask_free(&more);
    scene_free(&mesh), scene_free(&many);
}
static void test_culled(void **state) { (void)state, each(culled); }

static uint32_t planes_of(softshadow *handle, const char *name) {
    uint32_t count = 0, found = 0;
    OK(handle, softshadow_map_count(handle, &count));
    for (uint32_t i = 0; i < count; i++) {
        softshadow_map map = SOFTSHADOW_MAP_INIT;
        OK(handle, softshadow_get_map(handle, i, &map));
        found += !name || strcmp(map.name, name) == 0;
    }
    return found;
}

/* A light with casters above it and at one side: of the cube around it two faces are built. */
static void faces(const char *method) {
    scene_mesh mesh = {0};
    scene_rect(&mesh, -.5, .5, -.5, .5, 2);
    const double side[4][3] = {{2, -.5, -.5}, {2, .5, -.5}, {2, .5, .5}, {2, -.5, .5}};
    scene_quad(&mesh, side);
    const double points[4][3] = {{0, 0, 4}, {4, 0, 0}, {-4, 0, 0}, {0, 4, 0}};
    ask q = ask_new(method, &mesh, scene_sphere_light(0, 0, 0, .05), points, 4, 0);
    q.build.resolution = 64;
    softshadow *handle = ask_handle(&q);
    const uint32_t depths = planes_of(handle, "depth");
    CHECK(depths == 2, "%s: %u faces", method, depths);
    ask_query(handle, &q);
    CHECK(q.visibility[0] == 0 && q.visibility[1] == 0 && q.visibility[2] == 1 && q.visibility[3] == 1,
          "%s: %g %g %g %g", method, (double)q.visibility[0], (double)q.visibility[1],
          (double)q.visibility[2], (double)q.visibility[3]);
    softshadow_destroy(handle);
    ask_free(&q);
    scene_free(&mesh);
}
static void test_faces(void **state) { (void)state, each(faces); }

/* A light of no size: the hard map and nothing else. */
static void point_light(const char *method) {
    scene_mesh mesh = body();
    ask q = over_ground(method, &mesh, scene_sphere_light(1, .6, 4, 0));
    softshadow *handle = ask_handle(&q);
    CHECK(planes_of(handle, NULL) == 1 && planes_of(handle, "depth") == 1, "%s: %u planes", method,
          planes_of(handle, NULL));
    ask_query(handle, &q);
    CHECK(q.stats.silhouette_edges == 0, "%s", method);
    softshadow_destroy(handle);
    ask_free(&q);
    scene_free(&mesh);
}
static void test_point_light(void **state) { (void)state, each(point_light); }

/* From inside a closed body there is no silhouette: those who draw them have no penumbra plane. */
static void no_silhouette(const char *method) {
    scene_mesh mesh = body(), room = {0};
    const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1};
    scene_box(&room, low, high);
    ask usual = over_ground(method, &mesh, scene_sphere_light(1, .6, 4, .2));
    ask_do(&usual);
    const bool draws = usual.stats.silhouette_edges > 0;
    ask q = ask_new(method, &room, scene_sphere_light(.1, .2, 0, .1), (const double(*)[3])ground, 1, 0);
    q.build.resolution = 64;
    softshadow *handle = ask_handle(&q);
    const uint32_t all = planes_of(handle, NULL), depths = planes_of(handle, "depth");
    ask_query(handle, &q);
    CHECK(depths == 6 && q.stats.silhouette_edges == 0, "%s: %u faces", method, depths);
    if (draws) CHECK(all == depths, "%s: %u planes", method, all);
    softshadow_destroy(handle);
    ask_free(&q), ask_free(&usual);
    scene_free(&mesh), scene_free(&room);
}
static void test_no_silhouette(void **state) { (void)state, each(no_silhouette); }

/* ---- bad input ------------------------------------------------------------------------------ */

static void numbers(const char *method) {
    scene_mesh mesh = body();
    ask q = over_ground(method, &mesh, scene_sphere_light(1, .6, 4, .2)), three = q;
    three.build.layers = 3;
    ask_do(&q), ask_do(&three); /* layers 0 is the default */
    ask_same_bits(q.visibility, three.visibility, q.count, method);
    softshadow *handle = ask_handle(&q);
    softshadow_build build = q.build;
    build.method = method;
    const struct {
        uint32_t resolution, layers;
        const char *word;
    } wrong[] = {{100000, 0, "resolution"}, {16385, 0, "resolution"}, {128, 65, "layers"}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        build.resolution = wrong[i].resolution, build.layers = wrong[i].layers;
        CHECK(softshadow_build_maps(handle, &build) == SOFTSHADOW_E_ARGUMENT, "%s", method);
        CHECK(strstr(softshadow_last_message(handle), wrong[i].word), "%s: %s", method,
              softshadow_last_message(handle));
    }
    softshadow_destroy(handle);
    ask_free(&q), ask_free(&three);
    scene_free(&mesh);
}
static void test_numbers(void **state) { (void)state, each(numbers); }

/* A caster around the light's centre and through it; the light inside a closed body, which is dark
 * outside; at home and 1e7 away. */
static void around(const char *method) {
    for (int far = 0; far < 2; far++) {
        const double o = far ? 1e7 : 0;
        const double corner[4][3] = {{-1, -1, 2}, {1, -1, 2}, {1, 1, 2}, {-1, 1, 2}};
        scene_mesh through = {0}, closed = {0};
        const double low[3] = {-.5, -.5, 1.5}, high[3] = {.5, .5, 2.5};
        scene_quad(&through, corner);
        scene_box(&closed, low, high);
        moved(&through, o, -o, o), moved(&closed, o, -o, o);
        double points[9][3];
        for (int i = 0; i < 9; i++)
            points[i][0] = o + i % 3 - 1, points[i][1] = i / 3 - 1 - o, points[i][2] = o;
        const softshadow_light light = scene_sphere_light(o, -o, o + 2, .1);
        ask a = ask_new(method, &through, light, (const double(*)[3])points, 9, 0);
        ask b = ask_new(method, &closed, light, (const double(*)[3])points, 9, 0);
        a.build.resolution = b.build.resolution = 64;
        ask_do(&a), ask_do(&b);
        in_range(&a), in_range(&b);
        for (int i = 0; i < 9; i++)
            CHECK(b.visibility[i] <= 1.0 / 64, "%s, point %d: %g", method, i, (double)b.visibility[i]);
        ask_free(&a), ask_free(&b);
        scene_free(&through), scene_free(&closed);
    }
}
static void test_around(void **state) { (void)state, each(around); }

/* Receivers far behind what a map without bounds expects: an answer, and the hard shadow of its axis. */
static void beyond(const char *method) {
    scene_mesh mesh = {0};
    scene_rect(&mesh, -1, 1, -1, 1, 1);
    double points[8][3] = {{0}};
    for (int i = 0; i < 8; i++) points[i][2] = -pow(10, i);
    ask q = ask_new(method, &mesh, scene_sun_light(0, 0, -1, .001), (const double(*)[3])points, 8, 0);
    q.build.resolution = 128;
    ask_do(&q);
    in_range(&q);
    for (int i = 0; i < 2; i++) /* the umbra ends 1000 away */
        CHECK(q.visibility[i] <= 1.0 / 64, "%s: %g at %g", method, (double)q.visibility[i], points[i][2]);
    ask_free(&q);
    scene_free(&mesh);
}
static void test_beyond(void **state) { (void)state, each(beyond); }

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_culled),        cmocka_unit_test(test_faces),
        cmocka_unit_test(test_point_light),   cmocka_unit_test(test_no_silhouette),
        cmocka_unit_test(test_numbers),       cmocka_unit_test(test_around),
        cmocka_unit_test(test_beyond),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
