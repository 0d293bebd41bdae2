/* penumbra-limit's two builders: silhouette ribbons, and propagation from the depth image. Through
 * the public header only. */
#include "maps.h"

static ask over_ground(const char *method, const scene_mesh *mesh, softshadow_light light,
                       bool propagate) {
    ask q = maps_over_ground(method, mesh, light, 128, 2, 512);
    q.build.propagate = propagate;
    return q;
}

/* A half plane turned by some degrees, points on a line across its edge. */
static double straight(double degrees, uint32_t side, softshadow_light light, double half) {
    enum { ACROSS = 801 };
    static double line[ACROSS][3];
    static double bounds[6] = {-1, -1, 0, 1, 1, 0};
    const double c = cos(degrees * SCENE_PI / 180), s = sin(degrees * SCENE_PI / 180);
    scene_mesh mesh = {0};
    scene_rect(&mesh, -4, 0, -4, 4, 1);
    const double turn[12] = {c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0};
    scene_transform(&mesh, turn);
    double worst = 0;
    for (int i = 0; i < ACROSS; i++) {
        const double t = maps_t((size_t)i, ACROSS) * half;
        line[i][0] = c * t, line[i][1] = s * t, line[i][2] = 0;
    }
    ask q = ask_new("penumbra-limit", &mesh, light, (const double(*)[3])line, ACROSS, 0);
    q.build.resolution = side, q.build.propagate = true, q.build.bounds = bounds;
    ask_do(&q);
    for (int i = 0; i < ACROSS; i++) {
        worst = fmax(worst, fabs(q.visibility[i] - oracle_edge(maps_t((size_t)i, ACROSS))));
    }
    ask_free(&q);
    scene_free(&mesh);
    return worst;
}

/* A depth image knows an edge to half a texel only; lines laid through it find it better, whichever
 * way it runs, and a texel is 1/40 of this penumbra. */
static void test_straight_edge(void **state) {
    (void)state;
    const struct {
        softshadow_light light;
        double half;
    } lights[] = {{scene_disk_light(0, 0, 4, 0, 0, -1, .5), .5 / 3},
                  {scene_sun_light(0, 0, -1, atan(.17)), .17},
                  {scene_sphere_light(0, 0, 4, .5), .5 / 3 / sqrt(1 - .125 * .125)}};
    const double degrees[] = {0, 7, 26.6, 45, 63, 90, 200, 301};
    for (size_t l = 0; l < COUNT(lights); l++) {
        for (size_t d = 0; d < COUNT(degrees); d++) {
            const double worst = straight(degrees[d], 512, lights[l].light, lights[l].half);
            print_message("light %zu, %g degrees: worst %.4f\n", l, degrees[d], worst);
            CHECK(worst <= 1.0 / 64, "light %zu, %g degrees: off by %g", l, degrees[d], worst);
        }
    }
}

static scene_mesh leaves(void) {
    scene_mesh mesh = {0};
    scene_leaves(&mesh, 300, 7);
    return mesh;
}

static scene_mesh folded(void) {
    scene_mesh mesh = {0};
    const double centre[3] = {0, 0, 1};
    scene_icosphere(&mesh, centre, .7, 5, .5);
    return mesh;
}

/* How often light is seen where the truth is none. */
static size_t leaks_of(const ask *q, const ask *truth) {
    size_t n = 0;
    for (size_t i = 0; i < q->count; i++)
        n += truth->visibility[i] == 0 && q->visibility[i] > 1.0 / 64;
    return n;
}

/* Both builders on foliage and on a body with folds: nearer to the truth than half of what the hard
 * shadow is off by, and than .6 of it in foliage, where penumbrae overlap everywhere. What leaks on
 * the body leaks in the paper's own way, not in ours. */
static void test_truth(void **state) {
    (void)state;
    const struct {
        const char *name;
        scene_mesh (*make)(void);
        bool folds;
    } scenes[] = {{"leaves", leaves, false}, {"folded body", folded, true}};
    for (size_t s = 0; s < 2 * COUNT(scenes); s++) {
        const bool wide = s & 1;
        scene_mesh mesh = scenes[s / 2].make();
        const softshadow_light light = scene_sphere_light(1, .6, 5, wide ? .4 : .1);
        ask truth = over_ground("exact", &mesh, light, false);
        ask hard = over_ground("hard", &mesh, light, false);
        ask paper = over_ground("penumbra-limit", &mesh, light, false);
        truth.build.samples = 512, paper.build.falloff = SOFTSHADOW_FALLOFF_PAPER;
        ask_do(&truth), ask_do(&hard), ask_do(&paper);
        const size_t papers = leaks_of(&paper, &truth), umbra = maps_dark(&truth, 0);
        for (int propagate = 0; propagate < 2; propagate++) {
            ask q = over_ground("penumbra-limit", &mesh, light, propagate);
            ask_do(&q);
            const size_t leaks = leaks_of(&q, &truth);
            const char *way = propagate ? "propagated" : "ribbons";
            print_message(
                "%s, %s light, %s: RMS %.4f, paper %.4f, hard %.4f; leaks %zu, paper %zu, of %zu\n",
                scenes[s / 2].name, wide ? "wide" : "small", way, maps_rms(&q, &truth),
                maps_rms(&paper, &truth), maps_rms(&hard, &truth), leaks, papers, umbra);
            CHECK((q.stats.silhouette_edges == 0) == propagate, "%s: %llu silhouette edges", way,
                  (unsigned long long)q.stats.silhouette_edges);
            const double most = (scenes[s / 2].folds ? .5 : .6) * maps_rms(&hard, &truth);
            CHECK(maps_rms(&q, &truth) <= most, "%s, %s", scenes[s / 2].name, way);
            if (scenes[s / 2].folds)
                CHECK(2 * leaks <= papers, "%s: %zu and %zu", way, leaks, papers);
            ask_free(&q);
        }
        ask_free(&truth), ask_free(&hard), ask_free(&paper);
        scene_free(&mesh);
    }
}

/* Leaves cut out of cards: silhouettes are those of the cards, the depth image has the leaves. */
static void test_cut_out(void **state) {
    (void)state;
    enum { W = 64 };
    static uint8_t texels[W * W];
    static const float corners[4][3] = {{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}},
                       uvs[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const softshadow_light light = scene_sphere_light(0, 0, 4, .3);
    double error[2];
    for (int y = 0; y < W; y++)
        for (int x = 0; x < W; x++) texels[y * W + x] = hypot(x - 31.5, y - 31.5) < 20 ? 0 : 255;
    for (int propagate = 0; propagate < 2; propagate++) {
        ask question = over_ground("penumbra-limit", NULL, light, propagate), truth = question;
        softshadow_mesh card = SOFTSHADOW_MESH_INIT;
        card.positions = corners, card.vertex_count = 4, card.indices = indices,
        card.triangle_count = 2;
        card.uvs = uvs[0], card.opacity = (softshadow_texture){W, W, texels};
        card.opacity_threshold = .5f;
        question.build.method = question.method, truth.build.method = truth.method = "exact",
        truth.build.samples = 512;
        ask *const both[2] = {&question, &truth};
        for (int i = 0; i < 2; i++) {
            softshadow *handle = ask_handle(both[i]);
            OK(handle, softshadow_add_mesh(handle, &card, NULL));
            OK(handle, softshadow_build_maps(handle, &both[i]->build));
            both[i]->visibility = calloc(both[i]->count, sizeof(float));
            ask_query(handle, both[i]);
            softshadow_destroy(handle);
        }
        error[propagate] = maps_rms(&question, &truth);
        ask_free(&question), ask_free(&truth);
    }
    print_message("a hole in a card: RMS %.4f by its silhouette, %.4f propagated\n", error[0],
                  error[1]);
    CHECK(error[1] <= .03 && 2 * error[1] <= error[0], "%g and %g", error[0], error[1]);
}

/* The same bits for any number of threads; small maps, points and lights of no size. */
static void test_odd(void **state) {
    (void)state;
    scene_mesh mesh = leaves();
    ask one = over_ground("penumbra-limit", &mesh, scene_sphere_light(1, .6, 5, .3), true),
        many = one;
    one.options.threads = 1, many.options.threads = 5;
    ask_do(&one), ask_do(&many);
    ask_same_bits(one.visibility, many.visibility, one.count, "threads");
    for (uint32_t side = 1; side <= 8; side++) {
        ask q = over_ground("penumbra-limit", &mesh, scene_sun_light(.1, .2, -1, .05), true);
        q.build.resolution = side;
        ask_do(&q);
        maps_in_range(&q);
        ask_free(&q);
    }
    /* it is penumbra-limit's only: others have their silhouettes still */
    ask smooth = over_ground("smoothie", &mesh, scene_sphere_light(1, .6, 5, .3), true);
    ask_do(&smooth);
    CHECK(smooth.stats.silhouette_edges > 0, "smoothie");
    ask_free(&one), ask_free(&many), ask_free(&smooth);
    scene_free(&mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_straight_edge),
                                       cmocka_unit_test(test_truth), cmocka_unit_test(test_cut_out),
                                       cmocka_unit_test(test_odd)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
