/* Threads, memory, messages, the order of points, and the structs that cross the ABI. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "api/structs.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/status.h"
#include "base/vec.h"
#include "engine/order.h"
#include "scene/light.h"

#define N 10007

typedef struct visits {
    _Atomic int count[N];
    ss_pool *pool;
    uint64_t fail_from;
} visits;

static softshadow_status visit(void *ctx, uint64_t begin, uint64_t end) {
    visits *v = ctx;
    for (uint64_t i = begin; i < end; i++) {
        atomic_fetch_add(&v->count[i], 1);
        if (i >= v->fail_from) return ss_fail(SOFTSHADOW_E_MESH, "item %d", (int)(begin));
    }
    return SOFTSHADOW_OK;
}

static softshadow_status nest(void *ctx, uint64_t begin, uint64_t end) {
    visits *v = ctx;
    (void)begin, (void)end;
    return ss_parallel_for(v->pool, N, 100, visit, v);
}

static ss_pool *make_pool(unsigned threads, visits *v) {
    const softshadow_options options = {.threads = threads};
    ss_pool *pool;
    assert_int_equal(ss_pool_create(&pool, &options), SOFTSHADOW_OK);
    v->pool = pool, v->fail_from = UINT64_MAX;
    for (int i = 0; i < N; i++) v->count[i] = 0;
    return pool;
}

static void covers_every_item_once(void **state) {
    (void)state;
    static visits v;
    for (unsigned threads = 1; threads <= 7; threads += 3) {
        ss_pool *pool = make_pool(threads, &v);
        for (int round = 1; round <= 50; round++) {
            assert_int_equal(ss_parallel_for(pool, N, 13, visit, &v), SOFTSHADOW_OK);
            for (int i = 0; i < N; i++) assert_int_equal(v.count[i], round);
        }
        ss_pool_destroy(pool);
    }
}

static void lowest_failure_wins(void **state) {
    (void)state;
    static visits v;
    for (int round = 0; round < 200; round++) {
        ss_pool *pool = make_pool(3, &v);
        v.fail_from = 777;
        assert_int_equal(ss_parallel_for(pool, N, 10, visit, &v), SOFTSHADOW_E_MESH);
        assert_string_equal(ss_message(), "item 770");
        ss_pool_destroy(pool);
    }
}

static void nested_loops_run(void **state) {
    (void)state;
    static visits v;
    ss_pool *pool = make_pool(4, &v);
    assert_int_equal(ss_parallel_for(pool, 8, 1, nest, &v), SOFTSHADOW_OK);
    for (int i = 0; i < N; i++) assert_int_equal(v.count[i], 8);
    ss_pool_destroy(pool);
}

static void arena_keeps_its_pointers(void **state) {
    (void)state;
    ss_arena arena = {0};
    unsigned char *kept[200];
    for (int round = 0; round < 3; round++) {
        for (int i = 0; i < 200; i++) {
            kept[i] = ss_arena_alloc(&arena, (size_t)i * 97 + 1, 5);
            assert_non_null(kept[i]);
            assert_int_equal((uintptr_t)kept[i] % 64, 0);
            memset(kept[i], i, ((size_t)i * 97 + 1) * 5);
        }
        for (int i = 0; i < 200; i++) assert_int_equal(kept[i][(size_t)i * 97 * 5], i);
        ss_arena_reset(&arena);
    }
    assert_null(ss_arena_alloc(&arena, SIZE_MAX / 2, 3));
    assert_null(ss_alloc(SIZE_MAX / 2, 3));
    ss_arena_free(&arena);
}

/* Neighbours in the order are near in space: the mean step of random points on a square is a small
 * multiple of their spacing; far outliers do not spoil it, equal points do not hang it. */
static void check_order(int n, ss_pool *pool) {
    ss_arena arena = {0};
    float(*points)[3] = ss_alloc((size_t)n, sizeof *points);
    unsigned char *seen = ss_alloc((size_t)n, 1);
    srand(7);
    for (int i = 0; i < n; i++) {
        points[i][0] = rand() / (float)RAND_MAX, points[i][1] = rand() / (float)RAND_MAX;
        if (i % 10 == 0) points[i][0] = points[i][1] = 0.25f;
    }
    points[5][2] = 1e15f;
    points[6][0] = points[6][1] = points[6][2] = NAN;
    ss_order order;
    assert_true(ss_order_reserve(&order, (size_t)n, &arena));
    memcpy(order.at, points, (size_t)n * sizeof *points);
    assert_int_equal(ss_order_morton(&order, (size_t)n, pool), SOFTSHADOW_OK);
    double step = 0;
    int met = 0;
    size_t last = 5;
    for (size_t i = 0; i < order.count; i++) {
        const size_t first = ss_order_first(&order.item[i]);
        for (size_t place = first; place < first + ss_order_length(&order.item[i]); place++) {
            assert_false(seen[place]);
            seen[place] = 1, met++;
            const float *a = points[place], *b = points[last];
            if (place != 5 && last != 5) step += hypot(a[0] - b[0], a[1] - b[1]);
            last = place;
        }
    }
    assert_int_equal(met, n - 1);
    assert_false(seen[6]);
    assert_true(step / n < 3 / sqrt(n));
    ss_arena_free(&arena);
    ss_free(points);
    ss_free(seen);
}

static void order_is_a_permutation_and_local(void **state) {
    (void)state;
    static visits v;
    ss_pool *pool = make_pool(2, &v);
    check_order(1000, pool);
    check_order(N, pool);
    check_order(200000, pool);
    ss_pool_destroy(pool);
}

static void structs_of_all_sizes(void **state) {
    (void)state;
    struct {
        uint32_t struct_size, a, b, c;
    } given = {16, 1, 2, 0}, ours;
    assert_int_equal(ss_struct_in("x", &given, &ours, 12, 12), SOFTSHADOW_OK);
    assert_int_equal(ours.b, 2);
    given.c = 9;
    assert_int_equal(ss_struct_in("x", &given, &ours, 12, 12), SOFTSHADOW_E_ARGUMENT);
    given.struct_size = 8;
    assert_int_equal(ss_struct_in("x", &given, &ours, 16, 8), SOFTSHADOW_OK);
    assert_int_equal(ours.b, 0);
    assert_int_equal(ss_struct_in("x", &given, &ours, 16, 12), SOFTSHADOW_E_ARGUMENT);
    assert_int_equal(ss_struct_in("x", NULL, &ours, 16, 12), SOFTSHADOW_E_ARGUMENT);
    ours.a = 5, ours.b = 6;
    assert_int_equal(ss_struct_out("x", &given, &ours, 16, 8), SOFTSHADOW_OK);
    assert_int_equal(given.a, 5);
    assert_int_equal(given.b, 2);
    assert_int_equal(given.struct_size, 8);
}

static void bases_are_orthogonal_and_permute(void **state) {
    (void)state;
    srand(3);
    for (int i = 0; i < 1000; i++) {
        double n[3], a[3], b[3], m[3], c[3], d[3];
        for (int k = 0; k < 3; k++) n[k] = rand() / (double)RAND_MAX - 0.5;
        if (i < 6) n[0] = n[1] = n[2] = 0, n[i % 3] = i < 3 ? 1 : -1;
        ss_normalize(n);
        ss_basis(n, a, b);
        assert_true(fabs(ss_dot(n, a)) < 1e-15 && fabs(ss_dot(n, b)) < 1e-15);
        assert_true(fabs(ss_dot(a, b)) < 1e-15);
        assert_true(fabs(ss_dot(a, a) - 1) < 1e-14 && fabs(ss_dot(b, b) - 1) < 1e-14);
        for (int k = 0; k < 3 && i >= 6; k++) m[k] = n[(k + 1) % 3];
        if (i < 6) continue;
        ss_basis(m, c, d);
        for (int k = 0; k < 3; k++) {
            assert_true(c[k] == a[(k + 1) % 3] && d[k] == b[(k + 1) % 3]);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(covers_every_item_once),
        cmocka_unit_test(lowest_failure_wins),
        cmocka_unit_test(nested_loops_run),
        cmocka_unit_test(arena_keeps_its_pointers),
        cmocka_unit_test(order_is_a_permutation_and_local),
        cmocka_unit_test(structs_of_all_sizes),
        cmocka_unit_test(bases_are_orthogonal_and_permute),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
