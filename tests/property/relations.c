/* Relations that need no truth (design/accuracy.md): what must stay equal, add up or grow when a
 * scene changes. Each runs with every method that claims the truth. */
#include "property/truth.h"

enum { SIDE = 32, N = SIDE * SIDE, SAMPLES = 512 };

static const softshadow_light *lights(size_t *count) {
    static softshadow_light list[4];
    list[0] = scene_rect_light(0.25, 0.5, 8, 1.5, 1);
    list[1] = scene_disk_light(0.25, 0.5, 8, 0.1, 0.2, -1, 1.25);
    list[2] = scene_sphere_light(0.25, 0.5, 8, 1.25);
    list[3] = scene_sun_light(0.1, 0.05, -1, 0.15);
    *count = 4;
    return list;
}

static double (*grid(void))[3] {
    double(*points)[3] = malloc(N * sizeof *points);
    scene_grid(points, SIDE, -2, 2, -2, 2, 0);
    return points;
}

/* Open and closed parts with coordinates of few bits: halving and moving them is exact. */
static scene_mesh thing(void) {
    scene_mesh mesh = {0};
    scene_garbage(&mesh, 77);
    scene_box(&mesh, (const double[3]){-1, -1, 1}, (const double[3]){0.5, 0.25, 2});
    scene_icosphere(&mesh, (const double[3]){1, 1, 2.5}, 0.75, 2, 0.1);
    for (size_t i = 0; i < 3 * mesh.vertices; i++) mesh.xyz[i] = round(mesh.xyz[i] * 1024) / 1024;
    return mesh;
}

static ask answer(const char *method, const scene_mesh *mesh, softshadow_light light,
                  double (*points)[3]) {
    ask q = ask_new(method, mesh, light, (const double(*)[3])points, N, SAMPLES);
    ask_do(&q);
    return q;
}

static void complements_add_up(void **state) {
    double(*points)[3] = grid();
    scene_mesh screen = {0}, complement = {0};
    scene_slats(&screen, -5, 1, 0.375, 10, 5, 4);
    scene_slats(&complement, -5 + 0.375, 1, 1 - 0.375, 10, 5, 4);
    size_t n;
    const softshadow_light *list = lights(&n);
    for (size_t i = 0; i < n; i++) {
        ask a = answer(*state, &screen, list[i], points);
        ask b = answer(*state, &complement, list[i], points);
        size_t over = 0;
        for (size_t k = 0; k < N; k++) {
            /* Fixed samples see one or the other, one on a slat's very rim neither; rays are turned
             * from scene to scene. */
            const double most = ask_noise_free(*state) ? 2.01 / SAMPLES
                                                       : ask_claim(&a, k) + ask_claim(&b, k) + 1e-6;
            over += !(fabs((double)a.visibility[k] + b.visibility[k] - 1) <= most);
        }
        CHECK(over <= (ask_noise_free(*state) ? 0u : 8u), "light %zu: %zu of %d sums are not 1", i,
              over, N);
        ask_free(&a), ask_free(&b);
    }
    scene_free(&screen), scene_free(&complement);
    free(points);
}

static void splitting_changes_nothing(void **state) {
    double(*points)[3] = grid();
    scene_mesh whole = thing(), split = scene_split(&whole);
    size_t n;
    const softshadow_light *list = lights(&n);
    for (size_t i = 0; i < n; i++) {
        ask a = answer(*state, &whole, list[i], points),
            b = answer(*state, &split, list[i], points);
        if (ask_auto(*state))
            ask_same_truth(&a, &b, "split");
        else {
            /* The promise of the ABI; rays are not watertight to their last bit. */
            const double same = ask_noise_free(*state) ? 0.9999 : 0.999;
            ask_same_samples(a.visibility, b.visibility, N, SAMPLES, same, "split");
        }
        ask_free(&a), ask_free(&b);
    }
    scene_free(&whole), scene_free(&split);
    free(points);
}

/* A caster within the bounds of the others: strictly, every single point. One far outside moves the
 * origin and the unit of all coordinates, so that the light is sampled on another grid: then no
 * more than the two answers may be off by. */
static void more_casters_never_brighten(void **state) {
    double(*points)[3] = grid();
    size_t n;
    const softshadow_light *list = lights(&n);
    for (size_t i = 0; i < 2 * n; i++) {
        const bool inside = i < n;
        scene_mesh few = thing(), more = thing();
        if (inside) scene_rect(&more, -0.3, 0.9, 0.1, 0.6, 3);
        if (!inside) scene_rect(&more, 0.3, 50.9, 0.1, 70.6, 3);
        ask a = answer(*state, &few, list[i % n], points);
        ask b = answer(*state, &more, list[i % n], points);
        size_t brighter = 0, worst = 0;
        for (size_t k = 0; k < N; k++) {
            const double may = inside ? 0 : ask_claim(&a, k) + ask_claim(&b, k);
            if ((double)b.visibility[k] - a.visibility[k] > may) brighter++, worst = k;
        }
        CHECK(brighter == 0, "light %zu: %zu of %d, as point %zu: %g, then %g", i, brighter, N,
              worst, a.visibility[worst], b.visibility[worst]);
        ask_free(&a), ask_free(&b);
        scene_free(&few), scene_free(&more);
    }
    free(points);
}

static void lights_cut_in_parts_add_up(void **state) {
    double(*points)[3] = grid();
    scene_mesh mesh = thing();
    ask whole = answer(*state, &mesh, scene_rect_light(0, 0, 8, 1.5, 1), points);
    double *sum = calloc(N, sizeof *sum), *bound = calloc(N, sizeof *bound);
    for (int i = 0; i < 4; i++) {
        ask part = answer(*state, &mesh,
                          scene_rect_light(i & 1 ? 0.75 : -0.75, i & 2 ? 0.5 : -0.5, 8, 0.75, 0.5),
                          points);
        for (size_t k = 0; k < N; k++) {
            sum[k] += part.visibility[k] / 4.0, bound[k] += ask_claim(&part, k) / 4.0;
        }
        ask_free(&part);
    }
    size_t over = 0;
    for (size_t k = 0; k < N; k++) {
        over += !(fabs(sum[k] - whole.visibility[k]) <= bound[k] + ask_claim(&whole, k) + 1e-6);
    }
    CHECK(over <= (ask_noise_free(*state) ? 0u : 10u), "%zu of %d", over, N);
    free(sum), free(bound);
    ask_free(&whole);
    scene_free(&mesh);
    free(points);
}

/* Triangles in another order, turned and reversed: the same scene. */
static void triangle_order_does_not_matter(void **state) {
    double(*points)[3] = grid();
    scene_mesh a_mesh = thing(), b_mesh = thing();
    scene_shuffle(&b_mesh, 5);
    size_t n;
    const softshadow_light *list = lights(&n);
    for (size_t i = 0; i < n; i++) {
        ask a = answer(*state, &a_mesh, list[i], points),
            b = answer(*state, &b_mesh, list[i], points);
        if (ask_auto(*state))
            ask_same_truth(&a, &b, "shuffled triangles");
        else
            ask_same_bits(a.visibility, b.visibility, N, "shuffled triangles");
        ask_free(&a), ask_free(&b);
    }
    scene_free(&a_mesh), scene_free(&b_mesh);
    free(points);
}

/* Radius 0 is 0 or 1; a tiny one is the same but where an edge is nearer than the light is wide. */
static void small_lights_tend_to_points(void **state) {
    double(*points)[3] = grid();
    scene_mesh mesh = thing();
    static const double radius[] = {1e-2, 1e-4, 1e-6, 0};
    ask hard = answer(*state, &mesh, scene_sphere_light(0.3, 0.45, 8, 0), points);
    double lit = 0;
    for (size_t k = 0; k < N; k++) {
        CHECK(hard.visibility[k] == 0 || hard.visibility[k] == 1, "point %zu: %g", k,
              hard.visibility[k]);
        lit += hard.visibility[k];
        const double v = oracle_brute(&mesh, &hard.light, points[k], NULL, SOFTSHADOW_UNIFORM, 1);
        CHECK(v == hard.visibility[k], "point %zu: %g, truth %g", k, hard.visibility[k], v);
    }
    CHECK(lit > N / 4.0 && lit < N * 0.9, "%g lit: a scene that shows nothing", lit);
    for (size_t i = 0; i < COUNT(radius); i++) {
        for (int type = 0; type < 3; type++) {
            const softshadow_light list[] = {scene_sphere_light(0.3, 0.45, 8, radius[i]),
                                             scene_disk_light(0.3, 0.45, 8, 0, 0, -1, radius[i]),
                                             scene_rect_light(0.3, 0.45, 8, radius[i], radius[i])};
            ask soft = answer(*state, &mesh, list[type], points);
            size_t differ = 0;
            for (size_t k = 0; k < N; k++) differ += soft.visibility[k] != hard.visibility[k];
            /* The outlines are a dozen units long in an area of 16: within 2 radii of them. */
            const double most = radius[i] == 0 ? 0 : 2 + N * 4 * radius[i];
            CHECK((double)differ <= most, "light %d, radius %g: %zu of %d differ", type, radius[i],
                  differ, N);
            ask_free(&soft);
        }
    }
    ask_free(&hard);
    scene_free(&mesh);
    free(points);
}

static void turn3(const double r[9], const double v[3], double out[3]) {
    for (int k = 0; k < 3; k++)
        out[k] = r[3 * k] * v[0] + r[3 * k + 1] * v[1] + r[3 * k + 2] * v[2];
}

static void rotations_change_only_the_sampling(void **state) {
    double(*points)[3] = grid(), (*turned)[3] = malloc(N * sizeof *turned);
    size_t n;
    const softshadow_light *list = lights(&n);
    uint64_t s = 12;
    for (size_t i = 0; i < 2 * n; i++) {
        double r[9];
        scene_rotation(&s, r);
        scene_mesh mesh = thing(), other = thing();
        scene_transform(&other, (const double[12]){r[0], r[1], r[2], 0, r[3], r[4], r[5], 0, r[6],
                                                   r[7], r[8], 0});
        softshadow_light light = list[i % n];
        turn3(r, list[i % n].position, light.position);
        turn3(r, list[i % n].direction, light.direction);
        turn3(r, list[i % n].u, light.u);
        turn3(r, list[i % n].v, light.v);
        for (size_t k = 0; k < N; k++) turn3(r, points[k], turned[k]);
        ask a = answer(*state, &mesh, list[i % n], points);
        ask b = answer(*state, &other, light, turned);
        ask_same_truth(&a, &b, "rotated");
        ask_free(&a), ask_free(&b);
        scene_free(&mesh), scene_free(&other);
    }
    free(points), free(turned);
}

/* However little a point is behind a face, which is all between it and the light, and however
 * shallow it looks along the light. */
static void faces_hide_from_where_they_are(void **state) {
    double(*points)[3] = malloc(N * sizeof *points), at[3];
    const softshadow_light list[] = {
        scene_disk_light(0, 0.6, 0.8, 0, 0.8, -0.6, 0.3),
        scene_disk_light(0, 1.2, 0.9, 0, 0.6, -0.8, 0.4),
        scene_rect_light(0.5, 1, 0.002, 0.3, 0.5),
        scene_sphere_light(0, 0, 0.31, 0.3),
        scene_sun_light(0.5, 0, -1, 1),
    };
    uint64_t s = 5;
    for (size_t i = 0; i < 3 * COUNT(list); i++) {
        double r[9];
        scene_mesh mesh = {0};
        softshadow_light light = list[i % COUNT(list)];
        scene_rotation(&s, r);
        scene_triangle(&mesh, scene_vertex(&mesh, -9, -7, 0), scene_vertex(&mesh, 9, -7, 0),
                       scene_vertex(&mesh, 0, 10, 0));
        scene_transform(&mesh, (const double[12]){r[0], r[1], r[2], 0, r[3], r[4], r[5], 0, r[6],
                                                  r[7], r[8], 0});
        turn3(r, list[i % COUNT(list)].position, light.position);
        turn3(r, list[i % COUNT(list)].direction, light.direction);
        turn3(r, list[i % COUNT(list)].u, light.u);
        turn3(r, list[i % COUNT(list)].v, light.v);
        for (size_t k = 0; k < N; k++) {
            at[0] = scene_uniform(&s, -0.3, 0.3), at[1] = scene_uniform(&s, -0.3, 0.3);
            at[2] = -pow(10, scene_uniform(&s, -12, -2));
            turn3(r, at, points[k]);
        }
        ask a = answer(*state, &mesh, light, points);
        for (size_t k = 0; k < N; k++) {
            CHECK(a.visibility[k] == 0, "light %zu: point %zu sees %g of it", i, k,
                  (double)a.visibility[k]);
        }
        ask_free(&a);
        scene_free(&mesh);
    }
    free(points);
}

int main(void) {
    const ask_test tests[] = {
        {"a screen and its complement add up to 1", complements_add_up, ask_truthful},
        {"splitting triangles changes nothing", splitting_changes_nothing, ask_truthful},
        {"more casters never brighten", more_casters_never_brighten, ask_noise_free},
        {"a light cut in parts adds up", lights_cut_in_parts_add_up, ask_truthful},
        {"triangle order does not matter", triangle_order_does_not_matter, ask_truthful},
        {"small lights tend to points", small_lights_tend_to_points, ask_truthful},
        {"rotations change only the sampling", rotations_change_only_the_sampling, ask_truthful},
        {"faces hide from where they are", faces_hide_from_where_they_are, ask_truthful},
    };
    return ask_run("relations", tests, COUNT(tests));
}
