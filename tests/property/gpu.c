/* The GPU gives what the CPU gives: every method that runs there, on the bunny, on leaves and on
 * Lawlor's figure 10; the same bits from run to run, and for any split of a batch.
 *
 * No texel-edge ties are left out: triangles are set up and points are taken into the map by the
 * same C code for both, so that both look at the same texel of the same map. What may differ is how
 * much of a texel's patch is behind the rim of a disk: floats there, doubles here. backprojection
 * shows it most, as a patch that only just touches the rim decides whether a nearer layer counts:
 * one texel's share of the light, .04 at most where the light is a dozen texels wide. */
#include "gpu.h"
#include "maps.h"

enum { N = 64, POINTS = N * N };
static double points[POINTS][3];

static scene_mesh figure_10(void) {
    static const double corners[3][3] = {{.925, .8125, 0}, {.0375, .8, .1}, {.675, .25, .475}};
    scene_mesh mesh = {0};
    for (int i = 0; i < 3; i++) scene_vertex(&mesh, corners[i][0], corners[i][1], corners[i][2]);
    scene_triangle(&mesh, 0, 1, 2);
    return mesh;
}

static scene_mesh leaves(void) {
    scene_mesh mesh = {0};
    scene_leaves(&mesh, 1000, 1);
    return mesh;
}

/* The stand-in that every build has: closed, curved, shadowing itself. */
static scene_mesh lumps(void) {
    scene_mesh mesh = {0};
    scene_icosphere(&mesh, (const double[3]){0, 0, 1.2}, 1, 5, .35);
    return mesh;
}

static scene_mesh bunny(void) {
    scene_mesh mesh = {0};
    if (scene_bunny(&mesh)) maps_move(&mesh, 0, 0, 1.3);
    return mesh;
}

/* The ground, and on the casters themselves, where acne would show any difference of the maps. */
static void place_points(const scene_mesh *mesh, double low, double high) {
    uint64_t random = 5;
    scene_grid(points, N, low, high, low, high, 0);
    for (size_t i = 0; i < POINTS; i += 4) maps_on_surface(mesh, &random, points[i], NULL);
}

static const struct scene {
    const char *name;
    scene_mesh (*make)(void);
    double low, high;
    uint32_t resolution;
    softshadow_light light[4];
    uint32_t lights;
} * scene_list(size_t *count) {
    static struct scene list[4];
    *count = COUNT(list);
    list[0] =
        (struct scene){"figure 10", figure_10, 0, 1, 64, {scene_sun_light(0, 0, -1, .28849)}, 1};
    list[1] = (struct scene){"leaves",
                             leaves,
                             -2,
                             2,
                             256,
                             {scene_sphere_light(1, 2, 5, .3), scene_rect_light(0, 0, 5, .4, .2),
                              scene_sun_light(.3, .2, -1, .02),
                              scene_sphere_light(0, 0, 1.5, .005)}, /* among them: a cube of maps */
                             4};
    list[2] = (struct scene){"lumps",
                             lumps,
                             -2,
                             2,
                             256,
                             {scene_disk_light(1, 1, 5, -.2, -.2, -1, .3),
                              scene_sphere_light(0, 0, 1.2, .1), /* inside: all is dark */
                              scene_sphere_light(1, 2, 5, 0)},
                             3};
    list[3] = (struct scene){
        "bunny", bunny, -2,
        2,       256,   {scene_sphere_light(1, 2, 5, .3), scene_sun_light(.5, .1, -1, .03)},
        2};
    return list;
}

/* ---- CPU and GPU ---------------------------------------------------------------------------- */

typedef struct difference {
    double rms, max;
} difference;

static difference compare(const float *a, const float *b, size_t n) {
    difference d = {0, 0};
    for (size_t i = 0; i < n; i++) {
        const double by = fabs((double)a[i] - b[i]);
        d.rms += by * by, d.max = fmax(d.max, by);
    }
    d.rms = sqrt(d.rms / (double)n);
    return d;
}

static ask question(const char *method, const scene_mesh *mesh, const struct scene *s,
                    const softshadow_light *light, uint32_t backend) {
    ask q = ask_new(method, mesh, *light, (const double(*)[3])points, POINTS, 0);
    q.build.resolution = s->resolution, q.build.backend = backend;
    return q;
}

/* Planes as they were read back. What is drawn is the same to the last bits of a device's divisions
 * and roots, which decide, now and then, between two edges that are as good. */
static void compare_maps(const char *what, softshadow *cpu, softshadow *gpu) {
    uint32_t count, same;
    OK(cpu, softshadow_map_count(cpu, &count));
    OK(gpu, softshadow_map_count(gpu, &same));
    CHECK(count == same && count > 0, "%s: %u maps, %u maps", what, count, same);
    for (uint32_t i = 0; i < count; i++) {
        softshadow_map a = SOFTSHADOW_MAP_INIT, b = SOFTSHADOW_MAP_INIT;
        OK(cpu, softshadow_get_map(cpu, i, &a));
        OK(gpu, softshadow_get_map(gpu, i, &b));
        const size_t texels = (size_t)a.width * a.height;
        CHECK(a.channels == b.channels && b.width == a.width && b.height == a.height, "%s", what);
        size_t other = 0, held = 0;
        for (size_t t = 0; t < texels; t++) {
            const float *p = a.pixels + t * a.channels, *q = b.pixels + t * a.channels;
            bool differs = false;
            for (uint32_t k = 0; k < a.channels; k++)
                differs |= !(fabsf(p[k] - q[k]) <= 1e-5f * (1 + fabsf(p[k])));
            other += differs, held += p[0] != 1e30f;
        }
        CHECK(other <= texels / 1000, "%s: map %u: %zu of %zu texels differ", what, i, other,
              texels);
        CHECK(held > 0, "%s: map %u is empty", what, i);
    }
}

static void test_alike(void **state) {
    const char *method = *state;
    size_t scenes;
    const struct scene *list = scene_list(&scenes);
    for (size_t s = 0; s < scenes; s++) {
        scene_mesh mesh = list[s].make();
        if (!mesh.triangles) print_message("%s is not installed\n", list[s].name);
        if (mesh.triangles) place_points(&mesh, list[s].low, list[s].high);
        for (uint32_t l = 0; l < list[s].lights && mesh.triangles; l++) {
            ask cpu = question(method, &mesh, &list[s], &list[s].light[l], SOFTSHADOW_CPU);
            ask gpu = question(method, &mesh, &list[s], &list[s].light[l], SOFTSHADOW_EGL);
            softshadow *here = ask_handle(&cpu), *there = ask_handle(&gpu);
            if (l % 3 == 0) compare_maps(list[s].name, here, there); /* one frame, a cube */
            ask_query(here, &cpu), ask_query(there, &gpu);
            softshadow_destroy(here), softshadow_destroy(there);
            const difference d = compare(cpu.visibility, gpu.visibility, POINTS);
            print_message("%-14s %-9s light %u: rms %.2e max %.2e\n", method, list[s].name, l,
                          d.rms, d.max);
            CHECK(strcmp(gpu.stats.backend_used, "egl") == 0, "%s", gpu.stats.backend_used);
            CHECK(d.rms <= 1.0 / 255, "%s, %s: rms %g", method, list[s].name, d.rms);
            /* one texel's share of the light, see above; other methods look at no rim */
            const double most = strcmp(method, "backprojection") == 0 ? .04 : .001;
            CHECK(d.max <= most, "%s, %s: max %g", method, list[s].name, d.max);
            CHECK(gpu.stats.points_traced == cpu.stats.points_traced &&
                      gpu.stats.silhouette_edges == cpu.stats.silhouette_edges &&
                      gpu.stats.map_bytes == cpu.stats.map_bytes,
                  "%s, %s: other sums", method, list[s].name);
            ask_free(&cpu), ask_free(&gpu);
        }
        scene_free(&mesh);
    }
}

static bool looks_at_all(const char *method) {
    return strcmp(method, "pcss") == 0 || strcmp(method, "backprojection") == 0;
}

/* A lamp as large as the map is wide: points look at all 65,536 texels, in more steps than Mesa's
 * software device lets a shader's loops take. */
static void test_wide(void **state) {
    const char *method = *state;
    enum { FEW = 48 };
    size_t scenes;
    const struct scene *s = &scene_list(&scenes)[1];
    const softshadow_light light = scene_sphere_light(0, 0, 1.5, .1);
    scene_mesh mesh = s->make();
    scene_grid(points, N, s->low, s->high, s->low, s->high, 0);
    ask cpu = question(method, &mesh, s, &light, SOFTSHADOW_CPU), gpu;
    cpu.points = (const double(*)[3])points + POINTS / 2 + 8, cpu.count = FEW, gpu = cpu;
    gpu.build.backend = SOFTSHADOW_EGL;
    ask_do(&cpu), ask_do(&gpu);
    const difference d = compare(cpu.visibility, gpu.visibility, FEW);
    print_message("%-14s a wide lamp: rms %.2e max %.2e\n", method, d.rms, d.max);
    CHECK(d.rms <= 1.0 / 255 && d.max <= 1.0 / 16, "%s: rms %g max %g", method, d.rms, d.max);
    ask_free(&cpu), ask_free(&gpu);
    scene_free(&mesh);
}

/* What the defaults leave out: every branch of the texts. */
static void one_variant(const char *method, const char *what, softshadow_build build,
                        softshadow_light light) {
    size_t scenes;
    const struct scene *s = &scene_list(&scenes)[1];
    scene_mesh mesh = s->make();
    place_points(&mesh, s->low, s->high);
    ask cpu = question(method, &mesh, s, &light, SOFTSHADOW_CPU), gpu;
    build.resolution = cpu.build.resolution;
    cpu.build = build, gpu = cpu;
    gpu.build.backend = SOFTSHADOW_EGL;
    ask_do(&cpu), ask_do(&gpu);
    const difference d = compare(cpu.visibility, gpu.visibility, POINTS);
    print_message("%-16s %-26s rms %.2e max %.2e\n", method, what, d.rms, d.max);
    CHECK(strcmp(gpu.stats.backend_used, "egl") == 0, "%s", gpu.stats.backend_used);
    CHECK(d.rms <= 1.0 / 255, "%s, %s: rms %g", method, what, d.rms);
    /* Few samples start at the corner of what the point looks at. Where that is on a texel's edge,
     * floats and doubles may begin a texel apart, and all samples with them: two shares. */
    const double most = build.max_samples ? fmax(2.0 / build.max_samples, 1.0 / 16) : 1.0 / 16;
    CHECK(d.max <= most, "%s, %s: max %g", method, what, d.max);
    ask_free(&cpu), ask_free(&gpu);
    scene_free(&mesh);
}

static void test_variants(void **state) {
    (void)state;
    static const float rim[] = {1, .9f, .7f, .3f};
    const softshadow_build plain = SOFTSHADOW_BUILD_INIT;
    softshadow_light sphere = scene_sphere_light(1, 2, 5, .3), dark = sphere;
    const softshadow_light sun = scene_sun_light(.3, .2, -1, .02);
    dark.profile = rim, dark.profile_count = COUNT(rim);
    softshadow_light turned = scene_rect_light(0, 0, 5, .4, .2);
    turned.u[0] = .3, turned.u[1] = .3, turned.v[0] = -.1, turned.v[1] = .1, turned.v[2] = .1;
    softshadow_build b = plain;
    b.max_samples = 16;
    one_variant("pcf", "bicubic", b, sphere);
    one_variant("pcss", "16 samples", b, sphere);
    one_variant("backprojection", "16 samples", b, sphere);
    b = plain, b.layers = 1;
    one_variant("backprojection", "one layer", b, sphere);
    b.falloff = SOFTSHADOW_FALLOFF_PAPER;
    one_variant("backprojection", "gaps filled", b, sphere);
    one_variant("backprojection", "profile", plain, dark);
    one_variant("pcss", "profile", plain, dark);
    one_variant("backprojection", "turned rect", plain, turned);
    one_variant("pcss", "turned rect", plain, turned);
    b = plain, b.smoothie_width = .05;
    one_variant("smoothie", "a width", b, sphere);
    one_variant("smoothie", "a width under a sun", b, sun);
    b = plain, b.falloff = SOFTSHADOW_FALLOFF_PAPER;
    const char *const paper[] = {"smoothie", "penumbra-map", "penumbra-volume", "penumbra-limit",
                                 "single-sample"};
    for (size_t i = 0; i < COUNT(paper); i++) {
        one_variant(paper[i], "paper", b, sphere);
        one_variant(paper[i], "profile", plain, dark);
    }
    b.mask_taps = 5, b.seed = 0xfedcba98;
    one_variant("penumbra-mask", "paper, a seed", b, turned);
    one_variant("penumbra-mask", "profile", plain, dark);
    one_variant("penumbra-mask", "turned rect", plain, turned);
    b = plain, b.sub_lights = 2;
    one_variant("penumbra-volume", "sub-lights", b, sphere);
    one_variant("penumbra-mask", "sub-lights", b, turned);
    b = plain, b.propagate = 1;
    one_variant("penumbra-limit", "propagated", b, sphere);
    b = plain, b.depth_bias = .01;
    one_variant("hard", "depth_bias", b, sphere);
}

/* ---- images ---------------------------------------------------------------------------------- */

typedef struct picture {
    float v[POINTS];
    softshadow_stats stats;
} picture;

/* The ground in rows, of two objects, with a few points that cannot be answered. */
static void take(picture *out, const scene_mesh *mesh, const struct scene *s, uint32_t backend,
                 uint32_t blur, bool ids) {
    static uint32_t id[POINTS];
    static float normals[POINTS][3];
    ask q = question("penumbra-mask", mesh, s, &s->light[0], backend);
    q.build.blur = blur, q.build.mask_taps = 2; /* noise */
    scene_grid(points, N, s->low, s->high, s->low, s->high, 0);
    for (int i = 0; i < POINTS; i++) {
        id[i] = (i % N + i / N) / 24 % 2 ? 0xffffffff : 0;
        normals[i][0] = (float)i / POINTS, normals[i][2] = i % 7 ? 1 : 0;
        if (i % 97 == 0) points[i][0] = NAN;
    }
    softshadow *handle = ask_handle(&q);
    softshadow_points batch = ask_points((const double(*)[3])points, POINTS);
    batch.width = N, batch.ids = ids ? id : NULL, batch.normals = &normals[0][0];
    OK(handle, softshadow_query_visibility(handle, &batch, out->v));
    out->stats = (softshadow_stats)SOFTSHADOW_STATS_INIT;
    OK(handle, softshadow_get_stats(handle, &out->stats));
    CHECK(strcmp(out->stats.backend_used, backend == SOFTSHADOW_EGL ? "egl" : "cpu") == 0, "%s",
          out->stats.backend_used);
    softshadow_destroy(handle);
}

static double largest_change(const picture *a, const picture *b) {
    double most = 0;
    for (int i = 0; i < POINTS; i++) {
        CHECK(isnan(a->v[i]) == isnan(b->v[i]), "pixel %d: %g, %g", i, a->v[i], b->v[i]);
        if (isnan(a->v[i])) continue;
        CHECK(!signbit(a->v[i]) && !signbit(b->v[i]), "pixel %d keeps its mark", i);
        most = fmax(most, fabs((double)a->v[i] - b->v[i]));
    }
    return most;
}

/* Sums of up to 65 floats where C has doubles: 1e-5 is four times what those can be off by. A mean
 * that is all but 1 may be 1 on one of the two, and is counted so. */
static void test_image(void **state) {
    (void)state;
    size_t scenes;
    const struct scene *s = &scene_list(&scenes)[1];
    scene_mesh mesh = s->make();
    static picture cpu, gpu, plain, apart;
    take(&plain, &mesh, s, SOFTSHADOW_EGL, 0, true);
    take(&apart, &mesh, s, SOFTSHADOW_EGL, 12, false);
    static const uint32_t across[] = {1, 3, 12, 64};
    for (size_t i = 0; i < COUNT(across); i++) {
        take(&cpu, &mesh, s, SOFTSHADOW_CPU, across[i], true);
        take(&gpu, &mesh, s, SOFTSHADOW_EGL, across[i], true);
        const double most = largest_change(&cpu, &gpu);
        print_message("blur over %u: max %.2e\n", across[i], most);
        CHECK(most <= 1e-5, "blur over %u: %g", across[i], most);
        CHECK(gpu.stats.points_traced == cpu.stats.points_traced, "other points in the mask");
        CHECK(gpu.stats.points_lit + gpu.stats.points_umbra + gpu.stats.points_penumbra ==
                  POINTS - gpu.stats.points_bad,
              "sums of an image");
        CHECK(fabs((double)gpu.stats.points_umbra - (double)cpu.stats.points_umbra) <= 4 &&
                  fabs((double)gpu.stats.points_lit - (double)cpu.stats.points_lit) <= 4,
              "lit and umbra");
        CHECK(largest_change(&gpu, &plain) > .1, "nothing was blurred");
        if (across[i] == 12) CHECK(largest_change(&gpu, &apart) > .1, "ids do not matter");
    }
    take(&plain, &mesh, s, SOFTSHADOW_EGL, 12, true);
    take(&gpu, &mesh, s, SOFTSHADOW_EGL, 12, true);
    CHECK(memcmp(gpu.v, plain.v, sizeof gpu.v) == 0, "other bits in another run");
    scene_free(&mesh);
}

/* A build with several lights, normals and an opacity texture: what C adds to a GPU's answers. */
static void test_texture(void **state) {
    (void)state;
    static uint8_t holes[8 * 8];
    static float uv[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}, v[2][2][POINTS];
    static float normals[POINTS][3];
    scene_mesh plate = {0};
    scene_rect(&plate, -1, 1, -1, 1, 1);
    scene_grid(points, N, -2, 2, -2, 2, 0);
    for (int i = 0; i < 64; i++) holes[i] = (i + i / 8) % 2 ? 255 : 0;
    for (int i = 0; i < POINTS; i++) normals[i][2] = 1, normals[i][0] = (float)i / POINTS;
    for (uint32_t backend = SOFTSHADOW_CPU; backend <= SOFTSHADOW_EGL; backend++) {
        softshadow *handle;
        softshadow_mesh mesh = ask_mesh(&plate);
        mesh.opacity = (softshadow_texture){8, 8, holes};
        mesh.opacity_threshold = .5f, mesh.uvs = &uv[0][0];
        OK(NULL, softshadow_create(&handle, NULL));
        OK(handle, softshadow_add_mesh(handle, &mesh, NULL));
        const softshadow_light light[] = {scene_sphere_light(0, 0, 4, .2),
                                          scene_sphere_light(3, 0, 1, .5)};
        OK(handle, softshadow_add_light(handle, &light[0], NULL));
        OK(handle, softshadow_add_light(handle, &light[1], NULL));
        softshadow_build build = SOFTSHADOW_BUILD_INIT;
        build.method = "hard", build.resolution = 256, build.backend = backend;
        OK(handle, softshadow_build_maps(handle, &build));
        for (uint32_t l = 0; l < 2; l++) {
            softshadow_points batch = ask_points((const double(*)[3])points, POINTS);
            batch.light = l, batch.normals = &normals[0][0];
            OK(handle, softshadow_query_visibility(handle, &batch, v[backend][l]));
        }
        softshadow_destroy(handle);
    }
    for (int l = 0; l < 2; l++)
        ask_same_bits(v[0][l], v[1][l], POINTS, "holes, normals, two lights");
    size_t lit = 0;
    for (int i = 0; i < POINTS; i++) lit += v[1][0][i] > 0;
    CHECK(lit > POINTS / 2 && lit < POINTS, "%zu points lit", lit);
    scene_free(&plate);
}

/* Built and asked twice, and asked in parts. */
static void test_stable(void **state) {
    const char *method = *state;
    size_t scenes;
    const struct scene *s = &scene_list(&scenes)[1];
    scene_mesh mesh = s->make();
    place_points(&mesh, s->low, s->high);
    ask first = question(method, &mesh, s, &s->light[0], SOFTSHADOW_EGL), again = first;
    ask_do(&first);
    ask_do(&again);
    ask_same_bits(first.visibility, again.visibility, POINTS, "two runs");
    softshadow *handle = ask_handle(&first);
    static float parts[POINTS];
    for (size_t at = 0, n = 1; at < POINTS; at += n, n = 1 + n * 3 % 4001) {
        if (n > POINTS - at) n = POINTS - at;
        const softshadow_points part = ask_points((const double(*)[3])(points + at), n);
        OK(handle, softshadow_query_visibility(handle, &part, parts + at));
    }
    softshadow_destroy(handle);
    ask_same_bits(first.visibility, parts, POINTS, "a split batch");
    ask_free(&first), ask_free(&again);
    scene_free(&mesh);
}

/* ---- methods that do not run there ----------------------------------------------------------- */

static void test_unsupported(void **state) {
    (void)state;
    size_t count;
    const softshadow_method *methods = ask_methods(&count);
    scene_mesh mesh = figure_10();
    scene_grid(points, N, 0, 1, 0, 1, 0);
    for (size_t i = 0; i < count; i++) {
        if (gpu_runs(methods[i].name)) continue;
        ask q = ask_new(methods[i].name, &mesh, scene_sun_light(0, 0, -1, .3),
                        (const double(*)[3])points, POINTS, 0);
        q.build.backend = SOFTSHADOW_ANY;
        ask_do(&q);
        CHECK(strcmp(q.stats.backend_used, "cpu") == 0, "%s: %s", methods[i].name,
              q.stats.backend_used);
        ask_free(&q);
    }
    scene_free(&mesh);
}

int main(void) {
    gpu_required();
    const ask_test tests[] = {{"CPU and GPU", test_alike, gpu_runs},
                              {"wide", test_wide, looks_at_all},
                              {"stable", test_stable, gpu_runs}};
    const struct CMUnitTest others[] = {cmocka_unit_test(test_variants),
                                        cmocka_unit_test(test_image),
                                        cmocka_unit_test(test_texture),
                                        cmocka_unit_test(test_unsupported)};
    const int failed = ask_run("gpu", tests, COUNT(tests));
    return cmocka_run_group_tests(others, NULL, NULL) + failed;
}
