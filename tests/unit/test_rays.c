/* Embree behind its table: what blocks, what does not, and that nothing makes it abort. */
#include "trace_scene.h"

#include <sys/wait.h>
#include <unistd.h>

#include "base/process.h"
#include "trace/distinct.h"

/* From a place straight up, each lane at an own x. */
static ss_segments upwards(float step, float z) {
    ss_segments segments;
    memset(&segments, 0, sizeof segments);
    for (int i = 0; i < 16; i++) {
        segments.ox[i] = ((float)i - 7.5f) * step, segments.oy[i] = 0.01f, segments.oz[i] = z;
        segments.dz[i] = 1, segments.t_end[i] = 10;
    }
    return segments;
}

static void one_quad(stand *s, const softshadow_options *options) {
    const double corner[3] = {-1, -1, 0}, a[3] = {2, 0, 0}, b[3] = {0, 2, 0};
    add_quad(s, corner, a, b);
    raise_stand(s, options);
}

static void between(bool coherent) {
    stand s = {0};
    one_quad(&s, NULL);
    ss_segments up = upwards(0.2f, -0.5f); /* |x| <= 1.5: lanes 3..12 pass below the quad */
    assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, coherent, NULL, 0), 0x1ff8);
    up = upwards(0.2f, -0.5f);
    assert_int_equal(ss_rays_blocked(s.rays, &up, 0x00f0, coherent, NULL, 0), 0x00f0);
    up = upwards(0.2f, 0.5f); /* beyond it */
    assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, coherent, NULL, 0), 0);
    up = upwards(0.2f, -0.5f); /* too short */
    for (int i = 0; i < 16; i++) up.t_end[i] = 0.25f;
    assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, coherent, NULL, 0), 0);
    up = upwards(0.2f, -0.5f); /* begins behind it */
    for (int i = 0; i < 16; i++) up.t_begin[i] = 0.75f;
    assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, coherent, NULL, 0), 0);
    assert_true(ss_rays_bytes(s.rays) > 0);
    fold_stand(&s);
}

static void blocks_what_is_between(void **unused) {
    (void)unused;
    between(false);
    between(true);
}

static void ignores_what_it_is_told(void **unused) {
    (void)unused;
    stand s = {0};
    one_quad(&s, NULL);
    const uint32_t both[2] = {0, 1};
    ss_segments up = upwards(0.1f, -0.5f);
    assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, false, both, 2), 0);
    /* y = 0.01: triangle 0 (corner, +a, +a+b) is hit where x > y. */
    up = upwards(0.1f, -0.5f);
    assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, false, both, 1), 0x00ff);
    up = upwards(0.1f, -0.5f);
    assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, false, both + 1, 1), 0xff00);
    fold_stand(&s);
}

static void sees_through_a_texture(void **unused) {
    (void)unused;
    stand s = {0};
    const float at[4][3] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    const float uvs[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const uint8_t texels[2] = {255, 0}; /* the right half is open */
    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    uint32_t id;
    mesh.positions = at, mesh.vertex_count = 4, mesh.indices = indices, mesh.triangle_count = 2;
    mesh.uvs = &uvs[0][0];
    mesh.opacity = (softshadow_texture){2, 1, texels};
    mesh.opacity_threshold = 0.5f;
    assert_int_equal(ss_scene_add_mesh(&s.scene, &mesh, &id), SOFTSHADOW_OK);
    raise_stand(&s, NULL);
    ss_segments up = upwards(0.1f, -0.5f);
    assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, false, NULL, 0), 0x00ff);
    fold_stand(&s);
}

/* Debian's Embree aborts the process on each of these. */
static void wild_segments(bool coherent) {
    stand s = {0};
    one_quad(&s, NULL);
    const float wild[] = {NAN, INFINITY, -INFINITY, 1.9e18f, -3e38f};
    for (int w = 0; w < 5; w++) {
        for (int field = 0; field < 6; field++) {
            ss_segments up = upwards(0.1f, -0.5f);
            float *fields[6] = {up.ox, up.oy, up.oz, up.dx, up.dy, up.dz};
            fields[field][3] = wild[w];
            assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, coherent, NULL, 0), 0xffff & ~8);
        }
    }
    for (int w = 0; w < 4; w++) {
        ss_segments up = upwards(0.1f, -0.5f);
        const float begin[4] = {NAN, -1, 20, 0}, end[4] = {10, 10, 10, NAN};
        up.t_begin[5] = begin[w], up.t_end[5] = end[w];
        assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, coherent, NULL, 0), 0xffff & ~32);
    }
    ss_segments up = upwards(0.1f, -0.5f); /* the sun is infinitely far */
    for (int i = 0; i < 16; i++) up.t_end[i] = INFINITY;
    assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, coherent, NULL, 0), 0xffff);
    fold_stand(&s);
}

static void survives_wild_segments(void **unused) {
    (void)unused;
    wild_segments(false);
    wild_segments(true);
}

/* A triangle in front, a thousand copies of one behind it, wound in every way, and another. */
static void add_copies(stand *s, const softshadow_texture *opacity) {
    enum { COPIES = 1000 };
    const float at[][3] = {{-1, -1, -0.25f}, {1, -1, -0.25f},  {0, 1, -0.25f}, {-1, -1, 0},
                           {1, -1, 0},       {0.0f, 1, 0},     {-1, -1, 0.5f}, {1, -1, 0.5f},
                           {0, 1, 0.5f},     {-0.0f, 1, -0.0f}};
    static const float uvs[10][2] = {{0}};
    static const uint32_t ways[6][3] = {{3, 4, 5}, {4, 5, 3}, {5, 3, 4},
                                        {4, 3, 9}, {3, 9, 4}, {9, 4, 3}};
    uint32_t indices[COPIES + 2][3] = {{0, 1, 2}};
    for (int i = 0; i < COPIES; i++) memcpy(indices[1 + i], ways[i % 6], sizeof ways[0]);
    for (uint32_t k = 0; k < 3; k++) indices[COPIES + 1][k] = 6 + k;
    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    uint32_t id;
    mesh.positions = at, mesh.vertex_count = 10, mesh.indices = &indices[0][0];
    mesh.triangle_count = COPIES + 2;
    if (opacity) mesh.uvs = &uvs[0][0], mesh.opacity = *opacity, mesh.opacity_threshold = 0.5f;
    assert_int_equal(ss_scene_add_mesh(&s->scene, &mesh, &id), SOFTSHADOW_OK);
}

static void leaves_copies_out(void **unused) {
    (void)unused;
    stand s = {0}, single = {0};
    add_copies(&s, NULL);
    raise_stand(&s, NULL);
    one_quad(&single, NULL);
    uint32_t *numbers;
    size_t count;
    assert_int_equal(ss_distinct_find(s.world, &numbers, &count), SOFTSHADOW_OK);
    assert_int_equal(count, 3);
    assert_int_equal(numbers[0], 0);
    assert_int_equal(numbers[1], 1);
    assert_int_equal(numbers[2], 1001);
    ss_free(numbers);
    assert_int_equal(ss_distinct_find(single.world, &numbers, &count), SOFTSHADOW_OK);
    assert_null(numbers);
    assert_int_equal(count, 2);
    /* Triangles keep the world's numbers: of three before the rays the last two are named. */
    const uint32_t few[2] = {1, 1001}, more[3] = {0, 1, 1001};
    for (int i = 0; i < 2; i++) {
        ss_segments up = upwards(0.01f, -0.5f);
        assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, i, few, 2), 0xffff);
        up = upwards(0.01f, -0.125f); /* beyond the first */
        assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, i, few, 1), 0xffff);
        up = upwards(0.01f, -0.125f);
        assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, i, few, 2), 0);
        up = upwards(0.01f, -0.5f);
        assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, i, more, 3), 0);
    }
    fold_stand(&single);
    fold_stand(&s);
}

/* Copies may be cut out in other places. */
static void keeps_copies_with_a_texture(void **unused) {
    (void)unused;
    const uint8_t texel = 255;
    stand s = {0};
    const softshadow_texture opacity = {1, 1, &texel};
    add_copies(&s, &opacity);
    raise_stand(&s, NULL);
    uint32_t *numbers;
    size_t count;
    assert_int_equal(ss_distinct_find(s.world, &numbers, &count), SOFTSHADOW_OK);
    assert_null(numbers);
    assert_int_equal(count, 1002);
    fold_stand(&s);
}

static void run_serially(void *user, uint64_t n, void (*body)(void *, uint64_t, uint64_t),
                         void *ctx) {
    ++*(int *)user;
    for (uint64_t i = n; i > 0; i--) body(ctx, i - 1, i);
}

/* A host whose scheduler knows one thread, and runs the ranges backwards. */
static void commits_on_any_scheduler(void **unused) {
    (void)unused;
    for (uint32_t threads = 1; threads <= 4; threads++) {
        stand s = {0};
        int calls = 0;
        softshadow_options options = SOFTSHADOW_OPTIONS_INIT;
        options.threads = threads, options.user = &calls;
        if (threads > 2) options.parallel = run_serially;
        one_quad(&s, &options);
        assert_int_equal(calls > 0, threads > 2);
        ss_segments up = upwards(0.2f, -0.5f);
        assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, false, NULL, 0), 0x1ff8);
        fold_stand(&s);
    }
}

static void nothing_casts(void **unused) {
    (void)unused;
    stand s = {0};
    raise_stand(&s, NULL);
    ss_segments up = upwards(0.2f, -0.5f);
    assert_int_equal(ss_rays_blocked(s.rays, &up, 0xffff, false, NULL, 0), 0);
    fold_stand(&s);
}

static void says_what_is_missing(void **unused) {
    (void)unused;
    assert_int_equal(ss_rays_load("libembree-that-is-not-there.so.9"), SOFTSHADOW_E_BACKEND);
    assert_non_null(strstr(ss_message(), "libembree-that-is-not-there.so.9"));
    assert_non_null(strstr(ss_message(), "libembree3-3"));
    assert_int_equal(ss_rays_load("libm.so.6"), SOFTSHADOW_E_BACKEND);
    assert_non_null(strstr(ss_message(), "rtcNewDevice"));
}

static void refuses_in_a_forked_child(void **unused) {
    (void)unused;
    stand s = {0};
    ss_process_watch();
    one_quad(&s, NULL);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        ss_rays *rays;
        const softshadow_status status = ss_rays_create(&rays, s.world, s.pool);
        _exit(status == SOFTSHADOW_E_UNSUPPORTED && rays == NULL ? 0 : 1);
    }
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
    fold_stand(&s);
}

/* A closed ball around the origin of the rays: none may leave. */
static void no_ray_leaks(void **unused) {
    (void)unused;
    enum { RINGS = 40, SIDES = 80 };
    static float at[RINGS + 1][SIDES][3];
    static uint32_t indices[RINGS * SIDES * 6];
    size_t n = 0;
    for (int i = 0; i <= RINGS; i++) {
        for (int j = 0; j < SIDES; j++) {
            const double polar = 3.14159265358979 * i / RINGS,
                         around = 6.28318530717959 * j / SIDES;
            at[i][j][0] = (float)(148376 + sin(polar) * cos(around));
            at[i][j][1] = (float)(1234 + sin(polar) * sin(around));
            at[i][j][2] = (float)(-223423 + cos(polar));
            if (i == RINGS) continue;
            const uint32_t a = (uint32_t)(i * SIDES + j),
                           b = (uint32_t)(i * SIDES + (j + 1) % SIDES);
            const uint32_t six[6] = {a, a + SIDES, b, b, a + SIDES, b + SIDES};
            memcpy(indices + n, six, sizeof six), n += 6;
        }
    }
    stand s = {0};
    add_mesh(&s, SOFTSHADOW_F32, at, (RINGS + 1) * SIDES, indices, n / 3);
    raise_stand(&s, NULL);
    uint64_t state = 3;
    for (int r = 0; r < 20000; r++) {
        ss_segments all;
        memset(&all, 0, sizeof all);
        for (int i = 0; i < 16; i++) {
            float *d[3] = {all.dx, all.dy, all.dz};
            for (int k = 0; k < 3; k++) d[k][i] = (float)(2 * chance(&state) - 1);
            all.t_end[i] = INFINITY;
        }
        assert_int_equal(ss_rays_blocked(s.rays, &all, 0xffff, r & 1, NULL, 0), 0xffff);
    }
    fold_stand(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blocks_what_is_between), cmocka_unit_test(ignores_what_it_is_told),
        cmocka_unit_test(sees_through_a_texture), cmocka_unit_test(survives_wild_segments),
        cmocka_unit_test(commits_on_any_scheduler), cmocka_unit_test(nothing_casts),
        cmocka_unit_test(says_what_is_missing), cmocka_unit_test(refuses_in_a_forked_child),
        cmocka_unit_test(no_ray_leaks),
        cmocka_unit_test(leaves_copies_out), cmocka_unit_test(keeps_copies_with_a_texture),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
