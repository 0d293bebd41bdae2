/* The method "exact": against every sample of the same set tested in double
 * against every triangle, on every instruction set; against closed forms; and the relations that
 * need no truth. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "base/vec.h"
#include "coverage/direct.h"
#include "coverage/lattice.h"
#include "shapes.h"
#include "technique/exact.h"
#include "topology/topology.h"
#include "trace/bvh.h"

static const ss_technique *const exact = &ss_exact;

static uint64_t state;
static double uniform(void) { /* 0..1 */
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}
static double wide(void) { return 2 * uniform() - 1; }

/* A technique's stage, made by hand: what the engine would hand over. */
typedef struct asked {
    ss_scene scene;
    ss_world *world;
    ss_light light;
    ss_params params;
    ss_pool *pool;
    ss_bvh *bvh;
    ss_topology *topology;
    ss_stage stage;
    void *state;
} asked;

static void make(asked *a, const softshadow_mesh *mesh, const softshadow_light *light,
                 uint32_t samples, uint32_t weighting) {
    *a = (asked){.params = {.samples = samples, .weighting = weighting, .tolerance = 1.0 / 256}};
    a->pool = test_pool(1);
    uint32_t id;
    assert_int_equal(ss_scene_add_mesh(&a->scene, mesh, &id), SOFTSHADOW_OK);
    assert_int_equal(ss_world_create(&a->world, &a->scene), SOFTSHADOW_OK);
    ss_world_light(a->world, light, &a->light);
    assert_int_equal(ss_bvh_build(&a->bvh, a->world, a->pool, NULL), SOFTSHADOW_OK);
    assert_int_equal(ss_topology_build(&a->topology, a->world, a->pool), SOFTSHADOW_OK);
    a->stage = (ss_stage){.topology = a->topology,
                          .world = a->world,
                          .light = &a->light,
                          .params = &a->params,
                          .pool = a->pool,
                          .bvh = a->bvh};
    assert_int_equal(exact->build(&a->stage, &a->state), SOFTSHADOW_OK);
}

static void drop(asked *a) {
    exact->destroy(a->state);
    ss_topology_destroy(a->topology);
    ss_bvh_destroy(a->bvh);
    ss_world_destroy(a->world);
    ss_scene_free(&a->scene);
    ss_pool_destroy(a->pool);
}

/* Points as doubles of the host, no primitive known; normals may be NULL. */
static void ask_bound(asked *a, const double (*p)[3], const float (*normal)[3], size_t n, float *v,
                      float *bound) {
    ss_point *points = calloc(n, sizeof *points);
    ss_arena arena = {0};
    ss_counts counts = {0};
    for (size_t i = 0; i < n; i++) {
        ss_world_local(a->world, p[i], points[i].p);
        if (normal) memcpy(points[i].normal, normal[i], sizeof points[i].normal);
        points[i].ulp = 0x1p-52f;
        points[i].triangle = SS_NO_TRIANGLE, points[i].place = (uint32_t)i;
    }
    assert_int_equal(exact->query(&a->stage, a->state, points, n, v, bound, &arena, &counts),
                     SOFTSHADOW_OK);
    assert_int_equal(counts.lit + counts.umbra + counts.penumbra, n);
    ss_arena_free(&arena);
    free(points);
}

static void ask(asked *a, const double (*p)[3], const float (*normal)[3], size_t n, float *v) {
    ask_bound(a, p, normal, n, v, NULL);
}

/* ---- every sample in double ----------------------------------------------------------------- */

static void random_soup(shape *s, size_t n) {
    s->vertex_count = 3 * n, s->triangle_count = n;
    s->vertices = malloc(3 * n * sizeof *s->vertices);
    s->triangles = malloc(n * sizeof *s->triangles);
    for (size_t t = 0; t < n; t++) {
        const double reach = 0.02 + 0.8 * pow(uniform(), 3);
        const double middle[3] = {wide(), wide(), wide()};
        for (size_t c = 0; c < 3; c++) {
            for (int k = 0; k < 3; k++) {
                s->vertices[3 * t + c][k] = (float)(middle[k] + reach * wide());
            }
            s->triangles[t][c] = (uint32_t)(3 * t + c);
        }
    }
}

static void random_light(softshadow_light *light, uint32_t type) {
    *light = (softshadow_light)SOFTSHADOW_LIGHT_INIT;
    light->type = type;
    const double far = uniform() < 0.5 ? 1 : uniform() < 0.8 ? 3 : 100;
    const double size = (0.05 + uniform()) * (far < 2 ? 0.6 : far / 3);
    double n[3] = {wide(), wide(), wide()}, a[3], b[3];
    ss_normalize(n);
    ss_basis(n, a, b);
    for (int k = 0; k < 3; k++) {
        light->position[k] = far * wide();
        if (type == SOFTSHADOW_DISK || type == SOFTSHADOW_SUN) light->direction[k] = n[k];
        if (type == SOFTSHADOW_RECT) light->u[k] = a[k] * size, light->v[k] = b[k] * size * 0.6;
    }
    if (type != SOFTSHADOW_RECT) light->radius = type == SOFTSHADOW_SUN ? uniform() : size;
}

/* What `exact` must answer, up to the rounding of floats: weights of samples no triangle hides. */
static double brute(const ss_world *world, const ss_light *light, const ss_lattice *samples,
                    const double host[3], double *margin) {
    double p[3], total = 0, seen = 0;
    ss_view view;
    ss_world_local(world, host, p);
    ss_light_view(light, p, &view);
    *margin = 0;
    if (view.inside) return 1;
    ss_direct *all = malloc(world->triangle_count * sizeof *all);
    for (uint32_t t = 0; t < world->triangle_count; t++) ss_direct_set(&all[t], world, t, p);
    for (uint32_t i = 0; i < samples->blocks * SS_BLOCK * 32; i++) {
        if (!samples->weight[i]) continue;
        double d[3];
        for (int k = 0; k < 3; k++) {
            d[k] = view.centre[k] + samples->s[i] * view.a[k] + samples->t[i] * view.b[k];
        }
        bool hidden = false;
        for (uint32_t t = 0; t < world->triangle_count && !hidden; t++) {
            hidden = ss_direct_blocks(&all[t], world, d, view.t_end);
        }
        total += samples->weight[i];
        if (!hidden) seen += samples->weight[i];
        *margin = fmax(*margin, samples->weight[i]);
    }
    *margin /= total;
    free(all);
    return seen / total;
}

static const char *const rungs[] = {"avx512", "avx2", "scalar"};

static void matches_brute_force_on_every_rung(void **unused) {
    (void)unused;
    enum { POINTS = 40 };
    size_t differing = 0, total = 0, partly = 0;
    for (uint32_t round = 0; round < 60; round++) {
        state = 1000 + round;
        shape s;
        softshadow_light given;
        random_soup(&s, 1 + round);
        random_light(&given, round % 4);
        const softshadow_mesh mesh = shape_mesh(&s);
        const uint32_t count = round % 5 == 0 ? 256 : round % 7 == 0 ? 1500 : 512;
        double p[POINTS][3];
        for (int i = 0; i < POINTS; i++) {
            const double far = i % 8 == 0 ? 10 : 1.3;
            for (int k = 0; k < 3; k++) p[i][k] = far * wide();
        }
        float first[POINTS], v[POINTS];
        asked a;
        for (int r = 0; r < 3; r++) {
            setenv("SOFTSHADOW_CPU", rungs[r], 1);
            if (r) drop(&a);
            make(&a, &mesh, &given, count, SOFTSHADOW_UNIFORM);
            ask(&a, p, NULL, POINTS, v);
            if (r == 0) memcpy(first, v, sizeof v);
            assert_memory_equal(first, v, sizeof v);
        }
        unsetenv("SOFTSHADOW_CPU");
        ss_lattice *samples;
        assert_int_equal(ss_lattice_create(&samples, &a.light, count), SOFTSHADOW_OK);
        for (int i = 0; i < POINTS; i++) {
            double margin;
            const double want = brute(a.world, &a.light, samples, p[i], &margin);
            total++;
            partly += want > 0 && want < 1;
            differing += fabs(want - v[i]) > 1e-6;
            /* A sample may fall to the other side of an edge by rounding; three are a fault. */
            if (fabs(want - v[i]) > 2.01 * margin) {
                fail_msg("round %u point %d (%g %g %g): %g, brute force %g", round, i, p[i][0],
                         p[i][1], p[i][2], v[i], want);
            }
        }
        ss_lattice_destroy(samples);
        drop(&a);
        shape_free(&s);
    }
    print_message("%zu points, %zu in penumbra, %zu differ from doubles\n", total, partly,
                  differing);
    assert_true(partly > total / 4);
    assert_true(differing <= total / 100);
}

/* ---- what needs no truth --------------------------------------------------------------------- */

/* A bumpy ball over a floor, points all around, on the floor and on the ball. */
enum { MANY = 3000 };
static void ball(shape *s, double (*p)[3], float (*normal)[3]) {
    *s = shape_sphere(40, 0.08);
    const size_t v = s->vertex_count, t = s->triangle_count;
    s->vertices = realloc(s->vertices, (v + 4) * sizeof *s->vertices);
    s->triangles = realloc(s->triangles, (t + 2) * sizeof *s->triangles);
    for (size_t i = 0; i < 4; i++) {
        s->vertices[v + i][0] = i & 1 ? 4 : -4, s->vertices[v + i][1] = i & 2 ? 4 : -4;
        s->vertices[v + i][2] = -1.5;
    }
    const uint32_t floor[2][3] = {{(uint32_t)v, (uint32_t)v + 1, (uint32_t)v + 3},
                                  {(uint32_t)v, (uint32_t)v + 3, (uint32_t)v + 2}};
    memcpy(s->triangles[t], floor, sizeof floor);
    s->vertex_count += 4, s->triangle_count += 2;
    for (size_t i = 0; i < MANY; i++) {
        for (int k = 0; k < 3; k++) p[i][k] = 2.5 * wide(), normal[i][k] = 0;
        if (i % 3 == 0) p[i][2] = -1.5, normal[i][2] = 1;
        if (i % 3 == 1) {
            const uint32_t *c = s->triangles[(size_t)(uniform() * (double)t)];
            double e[3], f[3], n[3];
            ss_sub(s->vertices[c[1]], s->vertices[c[0]], e);
            ss_sub(s->vertices[c[2]], s->vertices[c[0]], f);
            ss_cross(e, f, n);
            if (!ss_normalize(n)) continue;
            for (int k = 0; k < 3; k++) {
                p[i][k] = s->vertices[c[0]][k] + 0.3 * e[k] + 0.4 * f[k];
                normal[i][k] = (float)n[k];
            }
        }
    }
}

static softshadow_light lamp(uint32_t type, double size) {
    softshadow_light light = SOFTSHADOW_LIGHT_INIT;
    light.type = type;
    light.position[0] = 2, light.position[1] = 1, light.position[2] = 4;
    light.direction[0] = -0.4, light.direction[1] = -0.3, light.direction[2] = -1;
    if (type == SOFTSHADOW_RECT) {
        light.direction[0] = light.direction[1] = light.direction[2] = 0;
        light.u[0] = size, light.v[1] = -size * 0.7, light.v[2] = size * 0.2; /* shines down */
    } else {
        light.radius = size;
    }
    return light;
}

/* One by one, backwards, and in Morton-less disorder: the same bits, bounds included. */
static void does_not_depend_on_company(void **unused) {
    (void)unused;
    static double p[MANY][3];
    static float normal[MANY][3], v[MANY], bound[MANY], one, one_bound;
    for (uint32_t type = 0; type < 4; type++) {
        shape s;
        asked a;
        size_t partly = 0;
        state = 77 + type;
        ball(&s, p, normal);
        const softshadow_mesh mesh = shape_mesh(&s);
        const softshadow_light light = lamp(type, type == SOFTSHADOW_SUN ? 0.2 : 0.9);
        make(&a, &mesh, &light, 0, SOFTSHADOW_UNIFORM);
        ask_bound(&a, p, normal, MANY, v, bound);
        for (size_t i = 0; i < MANY; i++) {
            ask_bound(&a, &p[i], &normal[i], 1, &one, &one_bound);
            if (one != v[i] || one_bound != bound[i]) {
                fail_msg("light %u point %zu: alone %.9g +- %g, among others %.9g +- %g", type, i,
                         one, one_bound, v[i], bound[i]);
            }
            partly += v[i] > 0 && v[i] < 1;
        }
        assert_true(partly > MANY / 20);
        drop(&a);
        shape_free(&s);
    }
}

/* 16,384 samples of another lattice are the truth to 5e-4 (they are 20 times as many as asked). */
static void truth_is_within_the_bound(void **unused) {
    (void)unused;
    static double p[MANY][3];
    static float normal[MANY][3], v[MANY], bound[MANY], truth[MANY];
    for (uint32_t type = 0; type < 4; type++) {
        for (uint32_t weighting = 0; weighting < 3; weighting++) {
            shape s;
            asked a, fine;
            double worst = 0, mean = 0;
            state = 99 + type;
            ball(&s, p, normal);
            const softshadow_mesh mesh = shape_mesh(&s);
            softshadow_light light = lamp(type, type == SOFTSHADOW_SUN ? 0.2 : 0.9);
            static const float dark_rim[] = {1, 0.9f, 0.7f, 0.3f};
            if (type == SOFTSHADOW_SPHERE) light.profile = dark_rim, light.profile_count = 4;
            make(&a, &mesh, &light, 0, weighting);
            make(&fine, &mesh, &light, 16384, weighting);
            ask_bound(&a, p, normal, 600, v, bound);
            ask(&fine, p, normal, 600, truth);
            for (size_t i = 0; i < 600; i++) {
                const double error = fabs(v[i] - truth[i]);
                assert_true(bound[i] >= 0 && bound[i] <= 1);
                if (error > bound[i] + 1e-3) {
                    fail_msg("light %u weighting %u point %zu: %g +- %g, truth %g", type, weighting,
                             i, v[i], bound[i], truth[i]);
                }
                /* At a point's horizon next to nothing counts, and the bound says so. */
                if (bound[i] < 0.25) worst = fmax(worst, error);
                mean += bound[i] / 600;
            }
            print_message("light %u weighting %u: worst error %.4f, mean bound %.4f\n", type,
                          weighting, worst, mean);
            assert_true(worst < 1.0 / 64);
            assert_true(mean < 0.1);
            drop(&a), drop(&fine);
            shape_free(&s);
        }
    }
}

/* Stacks of equal faces hide what one hides: counters that wrap would let light through. */
static void equal_layers_hide_alike(void **unused) {
    (void)unused;
    static const size_t layers[] = {2, 3, 7, 8, 15, 16, 17, 100, 5000};
    float first[64];
    double p[64][3];
    for (int i = 0; i < 64; i++) p[i][0] = i % 8 * 0.3 - 1, p[i][1] = i / 8 * 0.3 - 1, p[i][2] = -2;
    const softshadow_light light = lamp(SOFTSHADOW_SPHERE, 0.8);
    for (size_t l = 0; l < sizeof layers / sizeof *layers; l++) {
        shape s = shape_cube();
        const size_t n = s.triangle_count;
        s.triangles = realloc(s.triangles, n * layers[l] * sizeof *s.triangles);
        for (size_t i = n; i < n * layers[l]; i++) memcpy(s.triangles[i], s.triangles[i % n], 12);
        s.triangle_count = n * layers[l];
        const softshadow_mesh mesh = shape_mesh(&s);
        asked a;
        float v[64];
        make(&a, &mesh, &light, 0, SOFTSHADOW_UNIFORM);
        ask(&a, (const double(*)[3])p, NULL, 64, v);
        if (l == 0) memcpy(first, v, sizeof v);
        for (int i = 0; i < 64; i++) assert_true(v[i] == first[i]);
        drop(&a);
        shape_free(&s);
    }
}

/* Half of every unit square of the texture casts: as much light passes as past the same stripes
 * made of triangles. */
static void textures_cut_holes(void **unused) {
    (void)unused;
    static const uint8_t texels[2] = {255, 0};
    static const double v[4][3] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    static const uint32_t t[2][3] = {{0, 1, 2}, {0, 2, 3}};
    static const float uv[4][2] = {{0, 0}, {4, 0}, {4, 1}, {0, 1}};
    double stripes[16][3];
    uint32_t faces[8][3];
    for (uint32_t i = 0; i < 4; i++) {
        for (uint32_t c = 0; c < 4; c++) {
            stripes[4 * i + c][0] = -1 + 0.5 * i + (c == 1 || c == 2 ? 0.25 : 0);
            stripes[4 * i + c][1] = c < 2 ? -1 : 1, stripes[4 * i + c][2] = 0;
        }
        const uint32_t two[2][3] = {{4 * i, 4 * i + 1, 4 * i + 2}, {4 * i, 4 * i + 2, 4 * i + 3}};
        memcpy(faces[2 * i], two, sizeof two);
    }
    shape plain = SHAPE(v, t), cut = shape_of((const double(*)[3])stripes, 16, faces, 8);
    softshadow_mesh textured = shape_mesh(&plain);
    const softshadow_mesh striped = shape_mesh(&cut);
    textured.uvs = &uv[0][0];
    textured.opacity = (softshadow_texture){2, 1, texels}, textured.opacity_threshold = 0.5f;
    double p[200][3];
    for (int i = 0; i < 200; i++) p[i][0] = wide(), p[i][1] = wide(), p[i][2] = -0.2 - uniform();
    for (uint32_t type = 0; type < 4; type++) {
        const softshadow_light light = lamp(type, type == SOFTSHADOW_SUN ? 0.2 : 0.9);
        asked a, b;
        float with[200], without[200];
        size_t partly = 0;
        make(&a, &textured, &light, 0, SOFTSHADOW_UNIFORM);
        make(&b, &striped, &light, 0, SOFTSHADOW_UNIFORM);
        ask(&a, (const double(*)[3])p, NULL, 200, with);
        ask(&b, (const double(*)[3])p, NULL, 200, without);
        for (int i = 0; i < 200; i++) {
            assert_true(fabs(with[i] - without[i]) < 2.5 / 512); /* two samples, by rounding */
            partly += with[i] > 0 && with[i] < 1;
        }
        assert_true(partly > 100);
        drop(&a), drop(&b);
    }
    shape_free(&plain);
    shape_free(&cut);
}

/* Naming the axes otherwise, and scaling by a power of two, changes no bit. */
static void turns_and_scales_with_the_scene(void **unused) {
    (void)unused;
    static double p[MANY][3], q[MANY][3];
    static float normal[MANY][3], turned[MANY][3], v[MANY], w[MANY];
    static const int order[5][3] = {{1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {0, 1, 2}};
    for (uint32_t type = 0; type < 4; type++) {
        shape s;
        asked a, b;
        state = 5 + type;
        ball(&s, p, normal);
        softshadow_mesh mesh = shape_mesh(&s);
        softshadow_light light = lamp(type, type == SOFTSHADOW_SUN ? 0.2 : 0.9);
        make(&a, &mesh, &light, 0, SOFTSHADOW_UNIFORM);
        ask(&a, p, normal, MANY, v);
        for (int o = 0; o < 5; o++) {
            const double scale = ldexp(1, 7 * o - 14);
            shape other = shape_of((const double(*)[3])s.vertices, s.vertex_count,
                                   (const uint32_t(*)[3])s.triangles, s.triangle_count);
            softshadow_light l = light;
            for (int k = 0; k < 3; k++) {
                const int from = order[o][k];
                for (size_t i = 0; i < s.vertex_count; i++) {
                    other.vertices[i][k] = scale * s.vertices[i][from];
                }
                for (size_t i = 0; i < MANY; i++) {
                    q[i][k] = scale * p[i][from], turned[i][k] = normal[i][from];
                }
                l.position[k] = scale * light.position[from],
                l.direction[k] = light.direction[from];
                l.u[k] = scale * light.u[from], l.v[k] = scale * light.v[from];
            }
            if (type != SOFTSHADOW_SUN) l.radius *= scale;
            mesh = shape_mesh(&other);
            make(&b, &mesh, &l, 0, SOFTSHADOW_UNIFORM);
            ask(&b, q, turned, MANY, w);
            size_t different = 0;
            for (size_t i = 0; i < MANY; i++) different += v[i] != w[i];
            if (different)
                fail_msg("light %u order %d: %zu of %d differ", type, o, different, MANY);
            drop(&b);
            shape_free(&other);
        }
        drop(&a);
        shape_free(&s);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(matches_brute_force_on_every_rung),
        cmocka_unit_test(does_not_depend_on_company),
        cmocka_unit_test(truth_is_within_the_bound),
        cmocka_unit_test(equal_layers_hide_alike),
        cmocka_unit_test(textures_cut_holes),
        cmocka_unit_test(turns_and_scales_with_the_scene),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
