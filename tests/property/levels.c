/* auto with coarser levels of a dense mesh: within its tolerance and its bound, the same with any
 * number of threads; exact never uses them. */
#include "property/truth.h"

enum { GROUND = 32, ON = 512, N = GROUND * GROUND + ON };
#define AHEAD ((uint64_t)1 << 20) /* points that repay levels of any mesh */

typedef struct place {
    scene_mesh mesh;
    double points[N][3];
    uint64_t primitives[N];
} place;

/* A bumpy sphere over the ground; points on both. */
static place *make_place(void) {
    static const double centre[3] = {0.1, -0.05, 1.2};
    place *p = calloc(1, sizeof *p);
    uint64_t state = 7;
    scene_icosphere(&p->mesh, centre, 0.9, 5, 0.12);
    scene_grid(p->points, GROUND, -2, 2, -2, 2, 0);
    for (int i = 0; i < N; i++) p->primitives[i] = SOFTSHADOW_NO_PRIMITIVE;
    for (int i = GROUND * GROUND; i < N; i++) {
        const size_t t = scene_random(&state) % p->mesh.triangles;
        p->primitives[i] = t;
        for (int c = 0; c < 3; c++) {
            const double *v = p->mesh.xyz + 3 * (size_t)p->mesh.indices[3 * t + (size_t)c];
            for (int k = 0; k < 3; k++) p->points[i][k] += v[k] / 3;
        }
    }
    return p;
}

static void free_place(place *p) {
    scene_free(&p->mesh);
    free(p);
}

static softshadow_light light_of(int i) {
    return i == 0   ? scene_sphere_light(1.5, -1, 4, 0.8)
           : i == 1 ? scene_rect_light(0.5, 0.4, 3.5, 1.2, 0.4)
                    : scene_sun_light(-0.5, 0.3, -1, 0.2);
}

static ask ask_place(const place *p, const char *method, int light, uint64_t ahead) {
    ask q = ask_new(method, &p->mesh, light_of(light), p->points, N, 0);
    q.primitives = p->primitives;
    q.build.points_ahead = ahead;
    return q;
}

static void stays_within_tolerance_and_bound(void **state) {
    static const double tolerance[] = {1.0 / 64, 1.0 / 256, 1.0 / 1024};
    (void)state;
    place *p = make_place();
    for (int light = 0; light < 3; light++) {
        ask truth = ask_place(p, "exact", light, 0);
        truth.build.samples = 16384;
        ask_do(&truth);
        for (size_t t = 0; t < COUNT(tolerance); t++) {
            ask q = ask_place(p, "auto", light, AHEAD);
            q.build.tolerance = tolerance[t];
            ask_do(&q);
            double sum = 0;
            size_t n = 0;
            CHECK(q.stats.lod_triangles > 0, "light %d: no levels", light);
            for (int i = 0; i < N; i++) {
                const double v = truth.visibility[i], e = fabs(q.visibility[i] - v);
                CHECK(e <= q.bound[i] + truth.bound[i], "light %d, point %d: off by %g, bound %g",
                      light, i, e, q.bound[i]);
                CHECK(e <= 0.1, "light %d, point %d: off by %g", light, i, e);
                if (v > 0 && v < 1) sum += e * e, n++;
            }
            const double rms = sqrt(sum / (double)n);
            print_message("           light %d, 1/%.0f: RMS %.5f of %zu in penumbra\n", light,
                          1 / tolerance[t], rms, n);
            CHECK(n > 100 && rms <= tolerance[t], "light %d: RMS %g", light, rms);
            ask_free(&q);
        }
        ask_free(&truth);
    }
    free_place(p);
}

static void does_not_depend_on_threads(void **state) {
    (void)state;
    place *p = make_place();
    for (int light = 0; light < 3; light++) {
        ask one = ask_place(p, "auto", light, AHEAD), two = ask_place(p, "auto", light, AHEAD);
        one.options.threads = 1, two.options.threads = 2;
        ask_do(&one);
        ask_do(&two);
        CHECK(one.stats.lod_triangles > 0, "no levels");
        ask_same_bits(one.visibility, two.visibility, N, "threads");
        ask_same_bits(one.bound, two.bound, N, "threads, bound");
        ask_free(&one);
        ask_free(&two);
    }
    free_place(p);
}

static void come_only_where_they_pay(void **state) {
    (void)state;
    place *p = make_place();
    ask few = ask_place(p, "auto", 0, 0), plain = ask_place(p, "exact", 0, 0),
        many = ask_place(p, "exact", 0, AHEAD);
    ask_do(&few);
    ask_do(&plain);
    ask_do(&many);
    CHECK(few.stats.lod_triangles == 0, "%d points made levels", N);
    CHECK(many.stats.lod_triangles == 0, "exact made levels");
    ask_same_bits(plain.visibility, many.visibility, N, "exact, points ahead");
    ask_same_bits(plain.bound, many.bound, N, "exact, points ahead: bound");
    ask_free(&few);
    ask_free(&plain);
    ask_free(&many);
    free_place(p);
}

/* A lamp that moves over a mesh that does not: levels stay, and what hangs on the light is made
 * anew. */
static void follow_the_light(void **state) {
    (void)state;
    place *p = make_place();
    ask q = ask_place(p, "auto", 0, AHEAD), fresh = ask_place(p, "auto", 1, AHEAD);
    softshadow *handle = ask_handle(&q);
    ask_query(handle, &q);
    const softshadow_light light = light_of(1);
    OK(handle, softshadow_set_light(handle, &light));
    softshadow_build build = q.build;
    build.method = "auto";
    OK(handle, softshadow_build_maps(handle, &build));
    ask_query(handle, &q);
    ask_do(&fresh);
    CHECK(q.stats.lod_triangles == fresh.stats.lod_triangles, "levels");
    ask_same_bits(q.visibility, fresh.visibility, N, "after the light moved");
    softshadow_destroy(handle);
    ask_free(&q);
    ask_free(&fresh);
    free_place(p);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(stays_within_tolerance_and_bound),
        cmocka_unit_test(does_not_depend_on_threads),
        cmocka_unit_test(come_only_where_they_pay),
        cmocka_unit_test(follow_the_light),
    };
    return cmocka_run_group_tests_name("levels", tests, NULL, NULL);
}
