#include "ask.h"

/* ---- Methods --------------------------------------------------------------------------------*/

const softshadow_method *ask_methods(size_t *count) {
    static softshadow_method list[64];
    static uint32_t n;
    bool has_auto = false;
    if (!n) {
        if (softshadow_method_count(&n) != SOFTSHADOW_OK || n > 63) {
            fprintf(stderr, "softshadow_method_count: %s\n", softshadow_last_message(NULL));
            exit(99);
        }
        for (uint32_t i = 0; i < n; i++) {
            list[i] = (softshadow_method)SOFTSHADOW_METHOD_INIT;
            if (softshadow_method_info(i, &list[i]) != SOFTSHADOW_OK) exit(99);
            has_auto |= strcmp(list[i].name, "auto") == 0;
        }
        /* It is promised to exist, listed or not. */
        if (!has_auto) list[n++].name = "auto";
    }
    *count = n;
    return list;
}

static uint32_t bound_kind(const char *method) {
    size_t n;
    const softshadow_method *list = ask_methods(&n);
    for (size_t i = 0; i < n; i++) {
        if (strcmp(list[i].name, method) == 0) return list[i].bound_kind;
    }
    return SOFTSHADOW_BOUND_NONE;
}

bool ask_auto(const char *method) { return strcmp(method, "auto") == 0; }

bool ask_certified(const char *method) {
    return bound_kind(method) == SOFTSHADOW_BOUND_CERTIFIED && !ask_auto(method);
}

bool ask_noise_free(const char *method) {
    return strcmp(method, "exact") == 0 || ask_certified(method);
}

bool ask_truthful(const char *method) {
    return bound_kind(method) != SOFTSHADOW_BOUND_NONE || ask_auto(method) ||
           ask_noise_free(method);
}

int ask_run(const char *group, const ask_test *tests, size_t count) {
    size_t methods, n = 0;
    const softshadow_method *list = ask_methods(&methods);
    struct CMUnitTest *all = calloc(count * methods + 1, sizeof *all);
    char(*names)[96] = calloc(count * methods + 1, sizeof *names);
    if (!all || !names) return 99;
    for (size_t m = 0; m < methods; m++) {
        for (size_t i = 0; i < count; i++) {
            if (tests[i].wanted && !tests[i].wanted(list[m].name)) continue;
            snprintf(names[n], sizeof *names, "%s: %s", list[m].name, tests[i].name);
            all[n] = (struct CMUnitTest){names[n], tests[i].run, NULL, NULL,
                                         (void *)(uintptr_t)list[m].name};
            n++;
        }
    }
    if (n == 0) {
        fprintf(stderr, "%s: no method to test\n", group);
        return 99;
    }
    const int failed = _cmocka_run_group_tests(group, all, n, NULL, NULL);
    free(all);
    free(names);
    return failed;
}

/* ---- Questions ------------------------------------------------------------------------------*/

softshadow_mesh ask_mesh(const scene_mesh *mesh) {
    softshadow_mesh out = SOFTSHADOW_MESH_INIT;
    out.position_type = SOFTSHADOW_F64;
    if (!mesh) return out;
    out.positions = mesh->xyz;
    out.vertex_count = mesh->vertices;
    out.indices = mesh->indices;
    out.triangle_count = mesh->triangles;
    return out;
}

softshadow_points ask_points(const double (*points)[3], size_t count) {
    softshadow_points out = SOFTSHADOW_POINTS_INIT;
    out.position_type = SOFTSHADOW_F64;
    out.positions = points;
    out.count = count;
    return out;
}

ask ask_new(const char *method, const scene_mesh *mesh, softshadow_light light,
            const double (*points)[3], size_t count, uint32_t samples) {
    ask out = {.method = method, .mesh = mesh, .light = light, .points = points, .count = count};
    out.build = (softshadow_build)SOFTSHADOW_BUILD_INIT;
    out.options = (softshadow_options)SOFTSHADOW_OPTIONS_INIT;
    out.stats = (softshadow_stats)SOFTSHADOW_STATS_INIT;
    out.build.samples = samples;
    return out;
}

softshadow *ask_handle(const ask *question) {
    softshadow *handle = NULL;
    OK(NULL, softshadow_create(&handle, &question->options));
    if (question->mesh && question->mesh->triangles) {
        const softshadow_mesh mesh = ask_mesh(question->mesh);
        OK(handle, softshadow_add_mesh(handle, &mesh, NULL));
    }
    OK(handle, softshadow_set_light(handle, &question->light));
    softshadow_build build = question->build;
    build.method = question->method;
    OK(handle, softshadow_build_maps(handle, &build));
    return handle;
}

void ask_query(softshadow *handle, ask *question) {
    const size_t n = question->count ? question->count : 1;
    if (!question->visibility) question->visibility = calloc(n, sizeof(float));
    if (!question->bound) question->bound = calloc(n, sizeof(float));
    CHECK(question->visibility && question->bound, "out of memory");
    softshadow_points points = ask_points(question->points, question->count);
    points.normals = (const float *)question->normals;
    points.primitives = question->primitives;
    points.error_bound = question->unbounded ? NULL : question->bound;
    OK(handle, softshadow_query_visibility(handle, &points, question->visibility));
    OK(handle, softshadow_get_stats(handle, &question->stats));
}

void ask_do(ask *question) {
    softshadow *handle = ask_handle(question);
    ask_query(handle, question);
    softshadow_destroy(handle);
}

void ask_free(ask *question) {
    free(question->visibility);
    free(question->bound);
    question->visibility = question->bound = NULL;
}

double ask_claim(const ask *q, size_t i) {
    const bool bounded = ask_auto(q->method) || bound_kind(q->method) != SOFTSHADOW_BOUND_NONE;
    return bounded ? q->bound[i] : 1.0 / 64;
}

/* ---- Comparing ------------------------------------------------------------------------------*/

/* How often something of probability 1/1000 may happen in n tries before chance is no excuse: mean
 * and five standard deviations, and three for small n (Poisson: 5 of 100 is one run in 10^7). */
static size_t chance(size_t n) {
    const double mean = (double)n / 1000;
    return (size_t)(mean + 5 * sqrt(mean)) + 3;
}

void ask_compare(const ask *q, const double *truth, const char *what, double rms, double max,
                 double slack) {
    double worst = 0, sum = 0, worst_over = 0;
    size_t at = 0, penumbra = 0, over = 0, at_over = 0;
    const uint32_t kind =
        ask_auto(q->method) ? SOFTSHADOW_BOUND_STATISTICAL : bound_kind(q->method);
    for (size_t i = 0; i < q->count; i++) {
        const double v = q->visibility[i], e = fabs(v - truth[i]);
        CHECK(v >= 0 && v <= 1, "%s: point %zu (%.17g %.17g %.17g): %g", what, i, q->points[i][0],
              q->points[i][1], q->points[i][2], v);
        if (e > worst) worst = e, at = i;
        if (truth[i] > 1e-9 && truth[i] < 1 - 1e-9) sum += e * e, penumbra++;
        const double excess = e - q->bound[i] - slack;
        if (kind != SOFTSHADOW_BOUND_NONE && !(excess <= 0)) {
            if (!over || !(excess <= worst_over)) worst_over = excess, at_over = i;
            over++;
        }
    }
    const double reached = penumbra ? sqrt(sum / (double)penumbra) : 0;
    print_message("           %s: RMS %.5f, max %.5f, %zu of %zu points in penumbra, %zu beyond "
                  "their bound\n",
                  what, reached, worst, penumbra, q->count, over);
    CHECK(
        over <= (kind == SOFTSHADOW_BOUND_CERTIFIED ? 0 : chance(q->count)),
        "%s: %zu of %zu truths beyond error_bound, as point %zu (%.17g %.17g %.17g): visibility %g "
        "+- %g, truth %.9g",
        what, over, q->count, at_over, q->points[at_over][0], q->points[at_over][1],
        q->points[at_over][2], q->visibility[at_over], q->bound[at_over], truth[at_over]);
    if (!ask_truthful(q->method)) return;
    CHECK(worst <= max + slack,
          "%s: point %zu (%.17g %.17g %.17g): %g, truth %.9g, off by more than %g", what, at,
          q->points[at][0], q->points[at][1], q->points[at][2], q->visibility[at], truth[at], max);
    CHECK(reached <= rms + slack, "%s: RMS %g over the penumbra, allowed %g", what, reached, rms);
}

void ask_same_bits(const float *a, const float *b, size_t n, const char *what) {
    size_t differ = 0, first = 0;
    for (size_t i = 0; i < n; i++) {
        if (memcmp(a + i, b + i, sizeof *a) != 0 && differ++ == 0) first = i;
    }
    CHECK(differ == 0, "%s: %zu of %zu differ, first %zu: %.9g and %.9g", what, differ, n, first,
          a[first], b[first]);
}

void ask_same_samples(const float *a, const float *b, size_t n, unsigned samples, double same,
                      const char *what) {
    size_t differ = 0, worst = 0;
    for (size_t i = 0; i < n; i++) {
        differ += a[i] != b[i];
        if (!(fabsf(a[i] - b[i]) <= fabsf(a[worst] - b[worst]))) worst = i;
    }
    CHECK(fabsf(a[worst] - b[worst]) <= 2.0f / (float)samples * 1.0001f,
          "%s: point %zu: %g and %g, more than two of %u samples apart", what, worst, a[worst],
          b[worst], samples);
    CHECK((double)differ <= (1 - same) * (double)n, "%s: %zu of %zu differ", what, differ, n);
}

void ask_same_truth(const ask *a, const ask *b, const char *what) {
    size_t over = 0, worst = 0;
    double most = -1;
    for (size_t i = 0; i < a->count; i++) {
        const double excess = fabs((double)a->visibility[i] - b->visibility[i]) - ask_claim(a, i) -
                              ask_claim(b, i) - 1e-6;
        if (!(excess <= 0)) over++;
        if (!(excess <= most)) most = excess, worst = i;
    }
    const size_t allowed = ask_noise_free(a->method) ? 0 : 2 * chance(a->count);
    CHECK(over <= allowed,
          "%s: %zu of %zu differ by more than their bounds, as point %zu: %g +- %g, %g +- %g", what,
          over, a->count, worst, a->visibility[worst], a->bound[worst], b->visibility[worst],
          b->bound[worst]);
}
