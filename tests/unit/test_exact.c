/* The method "exact": against every sample of the same set tested in double
 * against every triangle, on every instruction set; against closed forms; and the relations that need no
 * truth. */
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
    a->stage = (ss_stage){.topology = a->topology, .world = a->world, .light = &a->light, .params = &a->params,
                          .pool = a->pool, .bvh = a->bvh};
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
static void ask(asked *a, const double (*p)[3], const float (*normal)[3], size_t n, float *v) {
    ss_point *points = calloc(n, sizeof *points);
    ss_arena arena = {0};
    ss_counts counts = {0};
    for (size_t i = 0; i < n; i++) {
        ss_world_local(a->world, p[i], points[i].p);
        if (normal) memcpy(points[i].normal, normal[i], sizeof points[i].normal);
        points[i].ulp = 0x1p-52f;
        points[i].triangle = SS_NO_TRIANGLE, points[i].place = (uint32_t)i;
    }
    assert_int_equal(exact->query(&a->stage, a->state, points, n, v, NULL, &arena, &counts),
                     SOFTSHADOW_OK);
    assert_int_equal(counts.lit + counts.umbra + counts.penumbra, n);
    ss_arena_free(&arena);
    free(points);
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
            /* A sample may fall to the other side of an edge by rounding; three would be a fault. */
            if (fabs(want - v[i]) > 2.01 * margin) {
                fail_msg("round %u point %d (%g %g %g): %g, brute force %g", round, i, p[i][0],
                         p[i][1], p[i][2], v[i], want);
            }
        }
        ss_lattice_destroy(samples);
        drop(&a);
        shape_free(&s);
    }
    print_message("%zu points, %zu in penumbra, %zu differ from doubles\n", total, partly, differing);
    assert_true(partly > total / 4);
    assert_true(differing <= total / 100);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(matches_brute_force_on_every_rung),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
