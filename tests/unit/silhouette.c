/* silhouette: the hierarchy against all edges one by one; loops close; any number of threads. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "base/memory.h"
#include "base/predicate.h"
#include "shapes.h"
#include "silhouette/silhouette.h"
#include "topology/topology.h"

typedef struct scene {
    ss_scene scene;
    ss_world *world;
    ss_topology *topology;
    ss_silhouette_tree *tree;
} scene;

static scene make(const shape *s) {
    scene b = {0};
    uint32_t id;
    ss_pool *pool = test_pool(2);
    const softshadow_mesh mesh = shape_mesh(s);
    assert_int_equal(ss_scene_add_mesh(&b.scene, &mesh, &id), SOFTSHADOW_OK);
    assert_int_equal(ss_world_create(&b.world, &b.scene), SOFTSHADOW_OK);
    assert_int_equal(ss_topology_build(&b.topology, b.world, pool), SOFTSHADOW_OK);
    assert_int_equal(ss_silhouette_tree_build(&b.tree, b.world, b.topology, pool), SOFTSHADOW_OK);
    ss_pool_destroy(pool);
    return b;
}

static void drop(scene *b) {
    ss_silhouette_tree_destroy(b->tree);
    ss_topology_destroy(b->topology);
    ss_world_destroy(b->world);
    ss_scene_free(&b->scene);
}

static ss_silhouette find(const scene *b, const ss_eye *eye, uint32_t threads) {
    ss_silhouette out;
    ss_pool *pool = test_pool(threads);
    assert_int_equal(ss_silhouette_find(&out, b->tree, b->world, b->topology, eye, pool),
                     SOFTSHADOW_OK);
    ss_pool_destroy(pool);
    return out;
}

/* Twice the definition: the exact predicate alone, no filter and no hierarchy. */
static int exact_sign(const ss_world *w, uint32_t t, const ss_eye *eye) {
    double v[3][3];
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) v[i][k] = w->vertices[3 * w->indices[3 * t + i] + k];
    }
    const int sign = eye->w ? ss_orient3d(v[0], v[1], v[2], eye->place)
                            : ss_orient3d_towards(v[0], v[1], v[2], eye->place);
    return sign > 0 ? 1 : -1;
}

static int64_t brute(const scene *b, size_t e, const ss_eye *eye) {
    const ss_edge *edge = b->topology->edges + e;
    int64_t sum = 0;
    for (uint32_t i = edge[0].first_use; i < edge[1].first_use; i++) {
        const uint32_t use = b->topology->uses[i];
        sum += exact_sign(b->world, ss_use_triangle(use), eye) * ss_use_sign(use);
    }
    return sum;
}

static size_t check(const scene *b, const ss_eye *eye) {
    const ss_silhouette found = find(b, eye, 1);
    int64_t *sum = calloc(b->topology->edge_count + 1, sizeof *sum);
    int64_t *balance = calloc(b->world->vertex_count + 1, sizeof *balance);
    for (size_t i = 0; i < found.count; i++) {
        const ss_silhouette_edge *s = &found.edges[i];
        const ss_edge *edge = &b->topology->edges[s->edge];
        assert_true(s->count > 0 && sum[s->edge] == 0);
        sum[s->edge] = s->vertex[0] < s->vertex[1] ? s->count : -(int64_t)s->count;
        assert_true((s->vertex[0] == edge->vertex[0] && s->vertex[1] == edge->vertex[1]) ||
                    (s->vertex[1] == edge->vertex[0] && s->vertex[0] == edge->vertex[1]));
        balance[s->vertex[0]] += s->count, balance[s->vertex[1]] -= s->count;
    }
    for (size_t e = 0; e < b->topology->edge_count; e++) assert_int_equal(sum[e], brute(b, e, eye));
    for (size_t v = 0; v < b->world->vertex_count; v++) assert_int_equal(balance[v], 0);
    free(sum), free(balance);
    for (uint32_t threads = 2; threads <= 7; threads += 5) {
        ss_silhouette again = find(b, eye, threads);
        assert_int_equal(again.count, found.count);
        if (found.count)
            assert_memory_equal(again.edges, found.edges, found.count * sizeof *found.edges);
        ss_silhouette_free(&again);
    }
    const size_t count = found.count;
    ss_silhouette_free((ss_silhouette *)&found);
    return count;
}

static ss_eye eye_at(double x, double y, double z, int w) {
    const ss_eye eye = {{x, y, z}, w};
    return eye;
}

static void test_cube(void **state) {
    (void)state;
    shape s = shape_cube();
    scene b = make(&s);
    const ss_eye above = eye_at(.1, .2, 5, 1), corner = eye_at(4, 5, 6, 1),
                 side = eye_at(1, .3, 5, 1), sun = eye_at(0, 0, 1, 0), skew = eye_at(.3, .5, .7, 0);
    assert_int_equal(check(&b, &above), 4);
    assert_int_equal(check(&b, &corner), 6);
    assert_int_equal(check(&b, &side), 4); /* in the plane x = 1: that side counts as back */
    assert_int_equal(check(&b, &sun), 4);
    assert_int_equal(check(&b, &skew), 6);
    const ss_eye inside = eye_at(.1, .1, .1, 1);
    assert_int_equal(check(&b, &inside), 0);
    drop(&b);
    shape_free(&s);
}

static void test_sheets(void **state) {
    (void)state;
    static const double v[][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0},
                                  {0, 1, 0}, {0, 0, 1}, {.5, .5, -.5}};
    static const uint32_t front[][3] = {{0, 1, 2}, {0, 2, 3}},
                          flipped[][3] = {{0, 1, 2}, {0, 3, 2}},
                          fan[][3] = {{0, 1, 2}, {0, 2, 3}, {0, 2, 4}, {2, 0, 5}};
    shape shapes[] = {SHAPE(v, front), SHAPE(v, flipped), SHAPE(v, fan)};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        scene b = make(&shapes[i]);
        const ss_eye above = eye_at(.2, .1, 3, 1), below = eye_at(.2, .1, -3, 0),
                     far = eye_at(1e9, 3e9, 7e9, 1), in_plane = eye_at(3, 4, 0, 1);
        const size_t seen = check(&b, &above);
        if (i == 0) assert_int_equal(seen, 4); /* whatever side it shows, a sheet has a border */
        check(&b, &far), check(&b, &in_plane);
        assert_int_equal(i == 0 ? check(&b, &below) : 4, 4);
        drop(&b);
        shape_free(&shapes[i]);
    }
}

static void test_bodies(void **state) {
    (void)state;
    for (int bump = 0; bump < 2; bump++) {
        shape s = shape_sphere(60, bump * .1);
        scene b = make(&s);
        uint64_t random = 1;
        for (int i = 0; i < 30; i++) {
            double p[3];
            for (int k = 0; k < 3; k++) {
                random = random * 6364136223846793005u + 1442695040888963407u;
                p[k] = ((double)(random >> 11) * 0x1p-53 - .5) * (i % 3 ? 4 : 1e4);
            }
            const ss_eye eye = eye_at(p[0], p[1], p[2], i % 2);
            check(&b, &eye);
        }
        drop(&b);
        shape_free(&s);
    }
}

static void test_nothing(void **state) {
    (void)state;
    static const double v[][3] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
    static const uint32_t t[][3] = {{0, 1, 1}};
    shape s = SHAPE(v, t);
    scene b = make(&s);
    const ss_eye eye = eye_at(0, 0, 4, 1);
    assert_int_equal(check(&b, &eye), 0);
    drop(&b);
    shape_free(&s);
}

/* What hierarchy is for: far fewer faces are looked at than there are. */
static void test_sublinear(void **state) {
    (void)state;
    shape s = shape_sphere(200, 0);
    scene b = make(&s);
    const ss_eye eye = eye_at(3, 2, 5, 1);
    const size_t tested = ss_silhouette_tested(b.tree, &eye);
    print_message("%zu edges, %zu looked at, %zu silhouettes\n", b.topology->edge_count, tested,
                  check(&b, &eye));
    assert_true(tested * 10 < b.topology->edge_count);
    drop(&b);
    shape_free(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cube),      cmocka_unit_test(test_sheets),
        cmocka_unit_test(test_bodies),    cmocka_unit_test(test_nothing),
        cmocka_unit_test(test_sublinear),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
