/* What all map methods have in common: what they build and do not, read from statistics and planes,
 * and input that is none. Every method that the library lists without an error bound is one.
 * Through the public header only. */
#include "maps.h"

static ask over_ground(const char *method, const scene_mesh *mesh, softshadow_light light) {
    ask q = maps_over_ground(method, mesh, light, 48, 2, 128);
    q.build.max_samples = 256;
    return q;
}

typedef void with_method(const char *method);
static void each(with_method *run) {
    size_t n, maps = 0;
    const softshadow_method *methods = ask_methods(&n);
    for (size_t i = 0; i < n; i++) {
        if (methods[i].bound_kind != SOFTSHADOW_BOUND_NONE) continue;
        maps++;
        run(methods[i].name);
    }
    CHECK(maps >= 8, "%zu map methods", maps);
}

/* ---- skipping ------------------------------------------------------------------------------- */

/* Casters that cannot shadow the bounds: beside them, behind them, behind the light. */
static void culled(const char *method) {
    const double place[4][3] = {{40, 0, 0}, {0, -60, 0}, {0, 0, -30}, {4, 2.4, 30}};
    scene_mesh mesh = maps_body(), many = maps_body();
    const size_t near = mesh.triangles;
    for (int i = 0; i < 4; i++) {
        scene_mesh far = maps_body();
        maps_move(&far, place[i][0], place[i][1], place[i][2]);
        scene_append(&many, &far);
        scene_free(&far);
    }
    const softshadow_light light = scene_sphere_light(1, .6, 4, .2);
    ask few = over_ground(method, &mesh, light), more = over_ground(method, &many, light);
    few.build.resolution = more.build.resolution = 256;
    ask_do(&few), ask_do(&more);
    CHECK(few.stats.casters_culled == 0, "%s: %llu", method,
          (unsigned long long)few.stats.casters_culled);
    CHECK(more.stats.casters_culled == 4 * near, "%s: culled %llu of %zu", method,
          (unsigned long long)more.stats.casters_culled, 4 * near);
    /* Far casters turn the frame a little: texels on the outline fall to the other side. */
    CHECK(maps_rms(&few, &more) < .05, "%s: far casters change answers by %g", method,
          maps_rms(&few, &more));
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

/* No caster, no map, and all is lit. */
static void nothing(const char *method) {
    ask none = over_ground(method, NULL, scene_sphere_light(1, .6, 4, .2));
    softshadow *handle = ask_handle(&none);
    CHECK(planes_of(handle, NULL) == 0, "%s: %u maps", method, planes_of(handle, NULL));
    ask_query(handle, &none);
    for (size_t i = 0; i < none.count; i++) CHECK(none.visibility[i] == 1, "%s", method);
    softshadow_destroy(handle);
    ask_free(&none);
}
static void test_nothing(void **state) { (void)state, each(nothing); }

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
    CHECK(q.visibility[0] == 0 && q.visibility[1] == 0 && q.visibility[2] == 1 &&
              q.visibility[3] == 1,
          "%s: %g %g %g %g", method, (double)q.visibility[0], (double)q.visibility[1],
          (double)q.visibility[2], (double)q.visibility[3]);
    softshadow_destroy(handle);
    ask_free(&q);
    scene_free(&mesh);
}
static void test_faces(void **state) { (void)state, each(faces); }

/* A light of no size: the hard map and nothing else. */
static void point_light(const char *method) {
    scene_mesh mesh = maps_body();
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
    scene_mesh mesh = maps_body(), room = {0};
    const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1};
    scene_box(&room, low, high);
    ask usual = over_ground(method, &mesh, scene_sphere_light(1, .6, 4, .2));
    ask_do(&usual);
    const bool draws = usual.stats.silhouette_edges > 0;
    ask q = ask_new(method, &room, scene_sphere_light(.1, .2, 0, .1), usual.points, 1, 0);
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

/* ---- the committed table -------------------------------------------------------------------- */

/* Lights: sphere, disk, rect, sun; n native, a approximated. Planes: under a light of some size. */
static const struct promise {
    const char *name, *lights;
    uint32_t planes;
} promises[] = {
    {"hard", "nnnn", 1},
    {"pcf", "nnnn", 1},
    {"pcss", "nnnn", 1},
    {"single-sample", "nnan", 2},
    {"penumbra-map", "nnan", 2},
    {"smoothie", "nnan", 2},
    {"penumbra-volume", "nnan", 2},
    {"penumbra-mask", "nnnn", 2},
    {"penumbra-limit", "nnan", 2},
    {"backprojection", "nnnn", 2},
};

static const struct promise *promise_of(const char *method) {
    for (size_t i = 0; i < COUNT(promises); i++)
        if (strcmp(promises[i].name, method) == 0) return &promises[i];
    CHECK(false, "%s is not in the table", method);
    return NULL;
}

static void lights(const char *method) {
    const struct promise *promise = promise_of(method);
    softshadow_method info = SOFTSHADOW_METHOD_INIT;
    for (uint32_t i = 0; !info.name || strcmp(info.name, method) != 0; i++)
        OK(NULL, softshadow_method_info(i, &info));
    for (uint32_t type = SOFTSHADOW_SPHERE; type <= SOFTSHADOW_SUN; type++) {
        const bool native = info.lights_native >> type & 1;
        const char is = native ? 'n' : info.lights_approximated >> type & 1 ? 'a' : '-';
        CHECK(is == promise->lights[type], "%s: light %u is %c", method, type, is);
    }
    if (strchr(promise->lights, 'a'))
        CHECK(strstr(info.notes, "rect"), "%s: %s", method, info.notes);
}
static size_t listed;
static void count_method(const char *method) { (void)method, listed++; }
static void test_lights(void **state) {
    (void)state, each(lights);
    listed = 0, each(count_method);
    CHECK(listed == COUNT(promises), "%zu of %zu methods are listed", listed, COUNT(promises));
}

/* As many planes as the table says, as large as was asked for, which look at the body. */
static void planes(const char *method) {
    scene_mesh mesh = maps_body();
    ask q = over_ground(method, &mesh, scene_sphere_light(1, .6, 4, .2));
    softshadow *handle = ask_handle(&q);
    const uint32_t count = planes_of(handle, NULL);
    CHECK(count == promise_of(method)->planes, "%s: %u planes", method, count);
    for (uint32_t i = 0; i < count; i++) {
        softshadow_map map = SOFTSHADOW_MAP_INIT;
        OK(handle, softshadow_get_map(handle, i, &map));
        CHECK(map.width == 128 && map.height == 128 && map.channels >= 1, "%s", method);
        /* the body's middle is in the middle part of the map */
        const double at[4] = {0, 0, 1, 1};
        double clip[4] = {0};
        for (int r = 0; r < 4; r++)
            for (int k = 0; k < 4; k++) clip[r] += map.matrix[4 * r + k] * at[k];
        const double x = clip[0] / clip[3], y = clip[1] / clip[3];
        CHECK(fabs(x) < .7 && fabs(y) < .7, "%s: %g %g", method, x, y);
        const size_t texel = (size_t)((y + 1) * 64) * 128 + (size_t)((x + 1) * 64);
        const float depth = map.pixels[texel * map.channels];
        CHECK(i > 0 || depth < 1e20f, "%s: the body's middle holds %g", method, (double)depth);
    }
    softshadow_destroy(handle);
    ask_free(&q);
    scene_free(&mesh);
}
static void test_planes(void **state) { (void)state, each(planes); }

/* ---- bad input ------------------------------------------------------------------------------ */

static void numbers(const char *method) {
    scene_mesh mesh = maps_body();
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
    for (size_t i = 0; i < COUNT(wrong); i++) {
        build.resolution = wrong[i].resolution, build.layers = wrong[i].layers;
        CHECK(softshadow_build_maps(handle, &build) == SOFTSHADOW_E_ARGUMENT, "%s", method);
        CHECK(strstr(softshadow_last_message(handle), wrong[i].word), "%s: %s", method,
              softshadow_last_message(handle));
    }
    build.resolution = 0, build.layers = 0;
    softshadow_map map = SOFTSHADOW_MAP_INIT;
    OK(handle, softshadow_build_maps(handle, &build));
    OK(handle, softshadow_get_map(handle, 0, &map));
    CHECK(map.width == 1024, "%s: default side %u", method, map.width);
    build.weighting = SOFTSHADOW_SOLID_ANGLE;
    CHECK(softshadow_build_maps(handle, &build) == SOFTSHADOW_E_UNSUPPORTED, "%s", method);
    softshadow_destroy(handle);
    ask_free(&q), ask_free(&three);
    scene_free(&mesh);
}
static void test_numbers(void **state) { (void)state, each(numbers); }

/* The smallest maps there are: an answer, whatever it is worth. */
static void small_maps(const char *method) {
    scene_mesh mesh = maps_body();
    const uint32_t sides[] = {1, 2, 3, 7, 17};
    for (size_t s = 0; s < COUNT(sides); s++) {
        ask q = over_ground(method, &mesh, scene_sphere_light(1, .6, 4, .2));
        q.build.resolution = sides[s], q.build.max_samples = 0;
        ask_do(&q);
        maps_in_range(&q);
        ask_free(&q);
    }
    scene_free(&mesh);
}
static void test_small_maps(void **state) { (void)state, each(small_maps); }

/* A caster through the light's centre, at home and 1e7 away. */
static void through(const char *method) {
    for (int far = 0; far < 2; far++) {
        const double o = far ? 1e7 : 0;
        const double corner[4][3] = {{-1, -1, 2}, {1, -1, 2}, {1, 1, 2}, {-1, 1, 2}};
        scene_mesh mesh = {0};
        scene_quad(&mesh, corner);
        maps_move(&mesh, o, -o, o);
        double points[9][3];
        for (int i = 0; i < 9; i++)
            points[i][0] = o + i % 3 - 1, points[i][1] = i / 3 - 1 - o, points[i][2] = o;
        ask q = ask_new(method, &mesh, scene_sphere_light(o, -o, o + 2, .1),
                        (const double(*)[3])points, 9, 0);
        q.build.resolution = 64;
        ask_do(&q);
        maps_in_range(&q);
        ask_free(&q);
        scene_free(&mesh);
    }
}
static void test_through(void **state) { (void)state, each(through); }

/* Those that look at an area of texels: the walls of a closed body that run away from a light
 * inside it leave gaps between their patches, at 128^2. */
static bool has_gaps(const char *method) {
    return strcmp(method, "backprojection") == 0 || strcmp(method, "pcss") == 0 ||
           strcmp(method, "single-sample") == 0;
}

/* A lamp inside a closed body, casters all around, receivers behind everything, far from home. */
static void inside(const char *method) {
    enum { N = 2000 };
    static double points[N][3];
    const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1};
    for (int far = 0; far < 2; far++) {
        const double o = far * 1e7, x = o + .1, y = .05 - o, z = o - .1;
        scene_mesh mesh = {0};
        scene_box(&mesh, low, high);
        maps_move(&mesh, o, -o, o);
        uint64_t seed = 5;
        for (int i = 0; i < N; i++) {
            double d[3];
            scene_direction(&seed, d);
            const double r =
                i < N / 2 ? scene_uniform(&seed, .1, .95) : scene_uniform(&seed, 2, 1000);
            for (int k = 0; k < 3; k++) points[i][k] = r * d[k] + (k == 1 ? -o : o);
        }
        const softshadow_light lamps[] = {scene_sphere_light(x, y, z, .05),
                                          scene_disk_light(x, y, z, .1, .2, 1, .05)};
        for (size_t l = 0; l < COUNT(lamps); l++) {
            ask q = ask_new(method, &mesh, lamps[l], (const double(*)[3])points, N, 0);
            q.build.resolution = 128;
            ask_do(&q);
            for (int i = 0; i < N; i++) {
                const double v = q.visibility[i];
                CHECK(i < N / 2 ? v == 1 : v <= (has_gaps(method) ? 1.0 / 64 : 0),
                      "%s, light %zu, offset %g, point %d (%g %g %g): %g", method, l, o, i,
                      points[i][0] - o, points[i][1] + o, points[i][2] - o, v);
            }
            ask_free(&q);
        }
        scene_free(&mesh);
    }
}
static void test_inside(void **state) { (void)state, each(inside); }

/* Receivers far behind what a map without bounds expects: an answer, and the hard shadow of its
 * axis. */
static void beyond(const char *method) {
    scene_mesh mesh = {0};
    scene_rect(&mesh, -1, 1, -1, 1, 1);
    double points[8][3] = {{0}};
    for (int i = 0; i < 8; i++) points[i][2] = -pow(10, i);
    ask q =
        ask_new(method, &mesh, scene_sun_light(0, 0, -1, .001), (const double(*)[3])points, 8, 0);
    q.build.resolution = 128;
    ask_do(&q);
    maps_in_range(&q);
    for (int i = 0; i < 2; i++) /* the umbra ends 1000 away */
        CHECK(q.visibility[i] <= 1.0 / 64, "%s: %g at %g", method, (double)q.visibility[i],
              points[i][2]);
    ask_free(&q);
    scene_free(&mesh);
}
static void test_beyond(void **state) { (void)state, each(beyond); }

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_culled),        cmocka_unit_test(test_nothing),
        cmocka_unit_test(test_faces),         cmocka_unit_test(test_point_light),
        cmocka_unit_test(test_no_silhouette), cmocka_unit_test(test_lights),
        cmocka_unit_test(test_planes),        cmocka_unit_test(test_numbers),
        cmocka_unit_test(test_small_maps),    cmocka_unit_test(test_through),
        cmocka_unit_test(test_inside),        cmocka_unit_test(test_beyond),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
