/* auto with coarser levels of a dense mesh, and with rays where there are none: within its
 * tolerance and its bound, the same with any number of threads; exact never uses them. */
#include "property/truth.h"

enum { GROUND = 32, ON = 512, N = GROUND * GROUND + ON };
#define AHEAD ((uint64_t)1 << 20) /* points that repay levels of any mesh, ... */
#define SOME  ((uint64_t)1 << 17) /* ... and that do not, but rays */

typedef struct place {
    scene_mesh mesh;
    double points[N][3];
    uint64_t primitives[N];
} place;

/* A bumpy sphere over the ground; points on both. */
static place *make_place(unsigned levels) {
    static const double centre[3] = {0.1, -0.05, 1.2};
    place *p = calloc(1, sizeof *p);
    uint64_t state = 7;
    scene_icosphere(&p->mesh, centre, 0.9, levels, 0.12);
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
    place *p = make_place(5);
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
    place *p = make_place(5);
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
    place *p = make_place(5);
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
    place *p = make_place(5);
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

typedef struct listener {
    double share;
    bool stop;
} listener;

static int listen(void *user, double share) {
    listener *l = user;
    l->share = share;
    return l->stop && share > 0 && share < 1;
}

/* Levels are part of the work that a build, or a query, tells of, and can be cancelled. */
static void tell_of_their_making(void **state) {
    (void)state;
    place *p = make_place(5);
    for (int in_query = 0; in_query < 2; in_query++) {
        for (int stop = 0; stop < 2; stop++) {
            listener l = {0, false};
            ask q = ask_place(p, "auto", 0, 0);
            q.options.progress = listen, q.options.user = &l;
            softshadow *handle = ask_handle(&q); /* without levels */
            q.build.method = "auto", q.build.points_ahead = AHEAD;
            l = (listener){0, stop};
            softshadow_points many = SOFTSHADOW_POINTS_INIT;
            many.count = (size_t)1 << 18;
            float *at = calloc(3 * many.count, sizeof *at),
                  *seen = calloc(many.count, sizeof *seen);
            many.positions = at;
            softshadow_status status = SOFTSHADOW_OK;
            if (!in_query)
                status = softshadow_build_maps(handle, &q.build);
            else
                status = softshadow_query_visibility(handle, &many, seen);
            CHECK(status == (stop ? SOFTSHADOW_E_CANCELLED : SOFTSHADOW_OK), "%s, %s: %d",
                  in_query ? "query" : "build", stop ? "stopped" : "let go", status);
            CHECK(stop ? l.share < 1 : l.share == 1, "told of %g", l.share);
            softshadow_destroy(handle);
            ask_free(&q);
            free(at), free(seen);
        }
    }
    free_place(p);
}

/* So dense that rays are the faster way for many groups, and too few points for levels. */
static void traces_what_is_too_dense(void **state) {
    static const double tolerance[] = {1.0 / 64, 1.0 / 256};
    (void)state;
    place *p = make_place(7);
    for (int light = 0; light < 3; light++) {
        ask truth = ask_place(p, "exact", light, 0);
        truth.build.samples = 8192;
        ask_do(&truth);
        for (size_t t = 0; t < COUNT(tolerance); t++) {
            ask one = ask_place(p, "auto", light, SOME), two = one, bounded = one;
            one.build.tolerance = two.build.tolerance = bounded.build.tolerance = tolerance[t];
            one.unbounded = two.unbounded = true;
            one.options.threads = 1, two.options.threads = 2;
            ask_do(&one);
            ask_do(&two);
            ask_do(&bounded);
            ask_same_bits(one.visibility, two.visibility, N, "threads, with rays");
            double sum = 0;
            size_t n = 0;
            for (int i = 0; i < N; i++) {
                const double v = truth.visibility[i], e = fabs(one.visibility[i] - v);
                CHECK(e <= 0.1, "light %d, point %d: off by %g", light, i, e);
                if (v > 0 && v < 1) sum += e * e, n++;
            }
            const double rms = sqrt(sum / (double)n);
            print_message("           light %d, 1/%.0f: %d of %d traced, RMS %.5f\n", light,
                          1 / tolerance[t], (int)one.stats.points_traced, N, rms);
            CHECK(rms <= tolerance[t], "light %d: RMS %g", light, rms);
            CHECK(one.stats.points_traced > 0 && one.stats.rays > 0, "light %d: no rays", light);
            CHECK(one.stats.lod_triangles == 0, "light %d: levels", light);
            CHECK(bounded.stats.rays == 0, "rays cannot certify a bound");
            ask_free(&one);
            ask_free(&two);
            ask_free(&bounded);
        }
        ask_free(&truth);
    }
    free_place(p);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(stays_within_tolerance_and_bound),
        cmocka_unit_test(does_not_depend_on_threads),
        cmocka_unit_test(come_only_where_they_pay),
        cmocka_unit_test(follow_the_light),
        cmocka_unit_test(tell_of_their_making),
        cmocka_unit_test(traces_what_is_too_dense),
    };
    return cmocka_run_group_tests_name("levels", tests, NULL, NULL);
}
