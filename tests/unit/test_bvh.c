/* The wide BVH against brute force: it holds every triangle once, gives the same tree for any
 * number of threads, finds what is near a point, and never calls a shaft empty that is not. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <time.h>

#include <cmocka.h>

#include "base/vec.h"
#include "shapes.h"
#include "trace/bvh_node.h"
#include "trace/shaft.h"

static uint64_t state;
static double uniform(void) { /* 0..1 */
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}
static double wide(void) { return 2 * uniform() - 1; }

typedef struct soup {
    ss_world world;
    ss_bvh *bvh;
} soup;

static ss_bvh *build(const ss_world *world, uint32_t threads) {
    ss_pool *pool = test_pool(threads);
    ss_bvh *bvh;
    assert_int_equal(ss_bvh_build(&bvh, world, pool, NULL), SOFTSHADOW_OK);
    ss_pool_destroy(pool);
    return bvh;
}

/* Triangles of every size, some without area, some twice. */
static void make(soup *s, size_t n, double size, uint64_t seed) {
    state = seed;
    *s = (soup){.world = {.vertex_count = 3 * n, .triangle_count = n}};
    s->world.vertices = ss_alloc(9 * n + 4, sizeof(float));
    s->world.indices = ss_alloc(3 * n, sizeof(uint32_t));
    for (size_t t = 0; t < n; t++) {
        const double middle[3] = {wide() * 0.9, wide() * 0.9, wide() * 0.9};
        const double reach = size * pow(uniform(), 4);
        for (size_t i = 0; i < 9; i++) {
            const double at = middle[i % 3] + reach * wide();
            s->world.vertices[9 * t + i] = (float)fmin(fmax(at, -1), 1);
        }
        if (t % 17 == 3) memcpy(&s->world.vertices[9 * t], &s->world.vertices[9 * t - 9], 36);
        if (t % 19 == 5) memcpy(&s->world.vertices[9 * t + 3], &s->world.vertices[9 * t], 12);
        for (size_t i = 0; i < 3; i++) s->world.indices[3 * t + i] = (uint32_t)(3 * t + i);
    }
    s->world.extent = 1;
    s->bvh = build(&s->world, 2);
}

static void drop(soup *s) {
    ss_bvh_destroy(s->bvh);
    ss_free(s->world.vertices);
    ss_free(s->world.indices);
}

static const float *corner(const soup *s, size_t t, int c) {
    return s->world.vertices + 3 * (size_t)s->world.indices[3 * t + c];
}

static void check_below(const soup *s, uint32_t at, const float low[3], const float high[3],
                        uint8_t *seen) {
    const ss_bvh_node *node = &s->bvh->nodes[at];
    for (uint32_t i = 0; i < node->count; i++) {
        float l[3], h[3];
        for (int k = 0; k < 3; k++) {
            l[k] = node->low[k][i], h[k] = node->high[k][i];
            assert_true(l[k] >= low[k] && h[k] <= high[k]);
        }
        if (!(node->child[i] & SS_BVH_LEAF)) {
            check_below(s, node->child[i], l, h, seen);
            continue;
        }
        const ss_bvh_leaf *leaf = &s->bvh->leaves[node->child[i] & ~SS_BVH_LEAF];
        assert_int_equal(leaf->first, node->first[i]);
        assert_int_equal(leaf->count, node->last[i] - node->first[i]);
        for (uint32_t j = 0; j < leaf->count; j++) {
            const uint32_t t = leaf->triangle[j];
            assert_int_equal(s->bvh->order[leaf->first + j], t);
            seen[t]++;
            for (int c = 0; c < 3; c++) {
                for (int k = 0; k < 3; k++) {
                    const float x = corner(s, t, c)[k];
                    assert_true(leaf->corner[c][k][j] == x && x >= l[k] && x <= h[k]);
                }
            }
        }
    }
}

static void holds_every_triangle_once(void **unused) {
    (void)unused;
    static const size_t counts[] = {0, 1, 2, 15, 16, 17, 300, 20000};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        soup s;
        make(&s, counts[i], 0.3, 7 + i);
        uint8_t *seen = calloc(counts[i] + 1, 1);
        const float low[3] = {-2, -2, -2}, high[3] = {2, 2, 2};
        check_below(&s, 0, low, high, seen);
        for (size_t t = 0; t < counts[i]; t++) assert_int_equal(seen[t], 1);
        free(seen);
        drop(&s);
    }
}

/* A thousand copies of one triangle have no cut; points on a curve that shrinks geometrically have
 * only lopsided ones. */
static void survives_what_cannot_be_split(void **unused) {
    (void)unused;
    for (int kind = 0; kind < 2; kind++) {
        soup s;
        make(&s, 5000, 0.3, 3);
        ss_bvh_destroy(s.bvh);
        for (size_t t = 0; t < 5000; t++) {
            for (size_t i = 0; i < 9; i++) {
                s.world.vertices[9 * t + i] = kind ? (float)ldexp(1, -(int)(t % 140)) : (float)i;
            }
        }
        s.bvh = build(&s.world, 1);
        uint32_t found[5000];
        const double p[3] = {0.5, 0.5, 0.5};
        assert_int_equal(ss_bvh_near(s.bvh, p, 100, found, 5000), 5000);
        for (uint32_t t = 0; t < 5000; t++) assert_int_equal(found[t], t);
        drop(&s);
    }
}

/* Processor time of a hundred look-ups among so many copies of one triangle, which find the
 * first. */
static double of_copies(size_t count) {
    soup s;
    uint32_t found[128];
    double least = INFINITY;
    const double p[3] = {1, 2, 3};
    make(&s, count, 0.3, 3);
    ss_bvh_destroy(s.bvh);
    for (size_t i = 0; i < 9 * count; i++) s.world.vertices[i] = (float)(i % 9);
    s.bvh = build(&s.world, 1);
    for (int turn = 0; turn < 5; turn++) {
        const clock_t start = clock();
        for (int i = 0; i < 100; i++) assert_true(ss_bvh_near(s.bvh, p, 0x1p-17, found, 128) > 128);
        least = fmin(least, (double)(clock() - start));
    }
    for (uint32_t t = 0; t < 128; t++) assert_int_equal(found[t], t);
    drop(&s);
    return fmax(least, 1);
}

/* Whoever lies on a million faces in one place must not look at each: 64 times as many take as
 * long, where clocks are even, and not a quarter of 64 times on any machine. */
static void looks_at_few_of_many_copies(void **unused) {
    (void)unused;
    const double few = of_copies(4000), many = of_copies(256000);
    if (many > 16 * few) fail_msg("256000 copies take %.0f times as long as 4000", many / few);
}

static void is_the_same_for_any_number_of_threads(void **unused) {
    (void)unused;
    soup s;
    make(&s, 60000, 0.1, 11);
    static const uint32_t threads[] = {1, 3, 8};
    for (int i = 0; i < 3; i++) {
        ss_bvh *other = build(&s.world, threads[i]);
        assert_int_equal(other->node_count, s.bvh->node_count);
        assert_int_equal(other->leaf_count, s.bvh->leaf_count);
        assert_memory_equal(other->nodes, s.bvh->nodes, other->node_count * sizeof *other->nodes);
        assert_memory_equal(other->leaves, s.bvh->leaves,
                            other->leaf_count * sizeof *other->leaves);
        ss_bvh_destroy(other);
    }
    drop(&s);
}

static bool near(const soup *s, size_t t, const double p[3], double radius) {
    for (int k = 0; k < 3; k++) {
        double low = INFINITY, high = -INFINITY;
        for (int c = 0; c < 3; c++) {
            low = fmin(low, corner(s, t, c)[k]), high = fmax(high, corner(s, t, c)[k]);
        }
        if (low - p[k] > radius || p[k] - high > radius) return false;
    }
    return true;
}

static void finds_what_is_near(void **unused) {
    (void)unused;
    soup s;
    make(&s, 3000, 0.3, 5);
    size_t hits = 0;
    for (int q = 0; q < 2000; q++) {
        double p[3] = {wide(), wide(), wide()};
        if (q % 3 == 0) { /* on a vertex */
            for (int k = 0; k < 3; k++) p[k] = corner(&s, (size_t)q, q % 2)[k];
        }
        const double radius = q % 5 == 0 ? 0 : pow(uniform(), 3) * 0.2;
        uint32_t all[3000], some[7];
        size_t want = 0;
        const size_t found = ss_bvh_near(s.bvh, p, radius, all, 3000);
        for (uint32_t t = 0; t < 3000; t++) {
            if (!near(&s, t, p, radius)) continue;
            assert_true(want < found);
            assert_int_equal(all[want++], t);
        }
        assert_int_equal(want, found);
        assert_int_equal(ss_bvh_near(s.bvh, p, radius, some, 7), found < 8 ? found : 8);
        for (size_t i = 0; i < 7 && i < found; i++) assert_int_equal(some[i], all[i]);
        hits += found;
    }
    assert_true(hits > 2000);
    drop(&s);
}

static void random_light(ss_light *light) {
    *light = (ss_light){.type = (uint32_t)(uniform() * 4)};
    const double size = uniform() < 0.1 ? 0 : 0.7 * uniform() * uniform();
    double n[3] = {wide(), wide(), wide()}, a[3], b[3];
    ss_normalize(n);
    ss_basis(n, a, b);
    light->point = size == 0;
    light->radius = size;
    const double far = uniform() < 0.3 ? 40 : 3;
    for (int k = 0; k < 3; k++) {
        light->centre[k] = far * wide();
        light->normal[k] = n[k];
        light->u[k] = a[k] * size, light->v[k] = b[k] * size * 0.7;
        if (light->type != SOFTSHADOW_RECT) light->v[k] = b[k] * size;
    }
}

/* Does the segment p + t d, 0 <= t <= end, meet the triangle? In double; grazing may do both. */
static bool meets(const soup *s, size_t t, const double p[3], const double d[3], double end) {
    double v[3][3], e1[3], e2[3], h[3], q[3], w[3];
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < 3; k++) v[c][k] = corner(s, t, c)[k];
    }
    ss_sub(v[1], v[0], e1), ss_sub(v[2], v[0], e2), ss_sub(p, v[0], w);
    ss_cross(d, e2, h);
    const double det = ss_dot(e1, h);
    if (det == 0) return false;
    const double u = ss_dot(w, h) / det;
    ss_cross(w, e1, q);
    const double x = ss_dot(d, q) / det, at = ss_dot(e2, q) / det;
    return u >= 0 && x >= 0 && u + x <= 1 && at >= 0 && at <= end;
}

static void check_segments(const soup *s, const ss_light *light, const double low[3],
                           const double high[3]) {
    for (int i = 0; i < 60; i++) {
        double p[3], d[3], x = wide(), y = wide();
        for (int k = 0; k < 3; k++) {
            p[k] =
                i < 8 ? (i >> k & 1 ? high[k] : low[k]) : low[k] + uniform() * (high[k] - low[k]);
        }
        ss_view view;
        ss_light_view(light, p, &view);
        if (view.inside) continue;
        if (view.disk && x * x + y * y > 1) x /= 2, y /= 2;
        if (i % 2 && !view.disk) x = copysign(1, x);
        for (int k = 0; k < 3; k++) d[k] = view.centre[k] + x * view.a[k] + y * view.b[k];
        const double end = fmin(view.t_end, 1e6);
        for (size_t t = 0; t < s->world.triangle_count; t++) assert_false(meets(s, t, p, d, end));
    }
}

static void empty_shafts_are_empty(void **unused) {
    (void)unused;
    size_t empty = 0, full = 0;
    for (int round = 0; round < 3; round++) {
        soup s;
        make(&s, 200, round == 2 ? 0.6 : 0.15, 31 + round);
        for (int q = 0; q < 1500; q++) {
            ss_light light;
            random_light(&light);
            double low[3], high[3];
            const double size = q % 4 == 0 ? 0 : 0.3 * uniform();
            const double far = q % 7 == 0 ? 20 : 1.5;
            for (int k = 0; k < 3; k++) {
                low[k] = far * wide();
                high[k] = low[k] + size * uniform();
            }
            if (ss_bvh_shaft_empty(s.bvh, &light, low, high)) {
                empty++;
                check_segments(&s, &light, low, high);
            } else {
                full++;
            }
        }
        drop(&s);
    }
    assert_true(empty > 200 && full > 200);
}

/* A shaft that touches nothing but a rim is not empty; a clear one is. The planes must be tight
 * enough to say so: a triangle beside the shaft by a tenth of the light's size. */
static void shafts_are_tight(void **unused) {
    (void)unused;
    soup s;
    make(&s, 1, 0.1, 1);
    ss_bvh_destroy(s.bvh);
    const float v[9] = {0.3f, -1, 0.1f, 0.3f, 1, 0.1f, 0.9f, 0, 0.1f};
    memcpy(s.world.vertices, v, sizeof v);
    s.bvh = build(&s.world, 1);
    const double point[3] = {0, 0, -1};
    for (int kind = 0; kind < 4; kind++) {
        /* At z = 0.1 the rim of a light of half width w at z = 3 is at x = 0.275 w. */
        for (int hit = 0; hit < 2; hit++) {
            const double w = (hit ? 0.3 : 0.27) / 0.275 * (kind == SOFTSHADOW_SUN ? 0.25 : 1);
            ss_light light = {.type = (uint32_t)kind,
                              .centre = {0, 0, 3},
                              .normal = {0, 0, 1},
                              .u = {w, 0, 0},
                              .v = {0, w, 0},
                              .radius = w};
            if (kind == SOFTSHADOW_SPHERE && !hit) light.radius *= 0.96; /* its disk is wider */
            assert_int_equal(ss_bvh_shaft_empty(s.bvh, &light, point, point), !hit);
        }
    }
    drop(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(holds_every_triangle_once),
        cmocka_unit_test(survives_what_cannot_be_split),
        cmocka_unit_test(looks_at_few_of_many_copies),
        cmocka_unit_test(is_the_same_for_any_number_of_threads),
        cmocka_unit_test(finds_what_is_near),
        cmocka_unit_test(empty_shafts_are_empty),
        cmocka_unit_test(shafts_are_tight),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
