/* The life of a handle: order of calls, staleness, refusals, cancelling, messages, threads that
 * query and threads that change. Runs with every method. */
#include <pthread.h>
#include <semaphore.h>

#include "ask.h"

enum { N = 4096, SAMPLES = 256 };

static scene_mesh thing(void) {
    scene_mesh mesh = {0};
    scene_garbage(&mesh, 3);
    scene_icosphere(&mesh, (const double[3]){0, 0, 2}, 0.7, 2, 0.1);
    return mesh;
}

static ask question(const char *method, const scene_mesh *mesh) {
    static double points[N][3];
    scene_grid(points, 64, -2, 2, -2, 2, 0);
    ask q = ask_new(method, mesh, scene_sphere_light(0.2, 0.1, 6, 1), (const double(*)[3])points, N,
                    SAMPLES);
    q.build.resolution = 128; /* what is asked here is not how fine the answer is */
    return q;
}

static softshadow_status try_query(softshadow *handle, const ask *q, float *v) {
    const softshadow_points points = ask_points(q->points, q->count);
    return softshadow_query_visibility(handle, &points, v);
}

static void expect_state(softshadow *handle, const ask *q, const char *when) {
    float *v = calloc(q->count, sizeof *v);
    const softshadow_status status = try_query(handle, q, v);
    CHECK(status == SOFTSHADOW_E_STATE, "%s: %s", when, softshadow_status_name(status));
    CHECK(*softshadow_last_message(handle), "%s: no message", when);
    for (size_t i = 0; i < q->count; i++) CHECK(isnan(v[i]), "%s: a failed batch is all NaN", when);
    free(v);
}

/* ---- Order ------------------------------------------------------------------------------------*/

static void order_of_calls(void **state) {
    scene_mesh mesh = thing();
    ask q = question(*state, &mesh);
    softshadow *handle = NULL;
    OK(NULL, softshadow_create(&handle, NULL));
    softshadow_build build = q.build;
    build.method = *state;
    expect_state(handle, &q, "a fresh handle");
    softshadow_status status = softshadow_build_maps(handle, &build);
    CHECK(status == SOFTSHADOW_E_STATE, "no light: %s", softshadow_status_name(status));
    OK(handle, softshadow_set_light(handle, &q.light));
    expect_state(handle, &q, "not built");
    OK(handle, softshadow_build_maps(handle, &build));
    ask_query(handle, &q); /* no casters */
    const softshadow_mesh given = ask_mesh(&mesh);
    uint32_t id = 7;
    OK(handle, softshadow_add_mesh(handle, &given, &id));
    CHECK(id == 0, "the first mesh is %u", id);
    expect_state(handle, &q, "a mesh was added");
    OK(handle, softshadow_build_maps(handle, &build));
    ask_query(handle, &q);
    OK(handle, softshadow_update_mesh(handle, id, &given));
    expect_state(handle, &q, "a mesh was updated");
    OK(handle, softshadow_build_maps(handle, &build));
    OK(handle, softshadow_add_light(handle, &q.light, NULL));
    expect_state(handle, &q, "a light was added");
    OK(handle, softshadow_build_maps(handle, &build));
    OK(handle, softshadow_remove_mesh(handle, id));
    expect_state(handle, &q, "a mesh was removed");
    status = softshadow_update_mesh(handle, id, &given);
    CHECK(status == SOFTSHADOW_E_ARGUMENT, "a removed mesh: %s", softshadow_status_name(status));
    OK(handle, softshadow_add_mesh(handle, &given, &id));
    CHECK(id == 1, "ids are never used again: %u", id);
    build.method = "no-such-method";
    CHECK(softshadow_build_maps(handle, &build) == SOFTSHADOW_E_UNSUPPORTED, "a failed build");
    expect_state(handle, &q, "after a failed build");
    softshadow_destroy(handle);
    ask_free(&q);
    scene_free(&mesh);
}

/* A mesh that changes is what a fresh handle says; one that comes back gives the old bits. */
static void rebuilding(void **state) {
    scene_mesh mesh = thing(), other = {0};
    scene_icosphere(&other, (const double[3]){0.5, 0, 3}, 1.1, 3, 0);
    ask q = question(*state, &mesh), before = q, fresh = question(*state, &other);
    softshadow *handle = ask_handle(&q);
    ask_query(handle, &before);
    ask_do(&fresh);
    softshadow_build build = q.build;
    build.method = *state;
    softshadow_mesh given = ask_mesh(&other);
    OK(handle, softshadow_update_mesh(handle, 0, &given));
    OK(handle, softshadow_build_maps(handle, &build));
    ask_query(handle, &q);
    if (!ask_auto(*state)) ask_same_bits(fresh.visibility, q.visibility, N, "another mesh");
    given = ask_mesh(&mesh);
    OK(handle, softshadow_update_mesh(handle, 0, &given));
    const softshadow_light far = scene_sphere_light(3, 1, 9, 0.5);
    OK(handle, softshadow_set_light(handle, &far));
    OK(handle, softshadow_build_maps(handle, &build));
    OK(handle, softshadow_set_light(handle, &q.light));
    OK(handle, softshadow_build_maps(handle, &build));
    ask_query(handle, &q);
    ask_same_bits(before.visibility, q.visibility, N, "back again");
    softshadow_destroy(handle);
    ask_free(&q), ask_free(&before), ask_free(&fresh);
    scene_free(&mesh), scene_free(&other);
}

static void refused_updates_change_nothing(void **state) {
    scene_mesh mesh = thing();
    ask q = question(*state, &mesh), after = q;
    softshadow *handle = ask_handle(&q);
    ask_query(handle, &q);
    scene_mesh bad = scene_copy(&mesh);
    bad.xyz[5] = NAN;
    softshadow_mesh given = ask_mesh(&bad);
    CHECK(softshadow_update_mesh(handle, 0, &given) == SOFTSHADOW_E_MESH, "NaN");
    bad.indices[3] = 1u << 30;
    bad.xyz[5] = 0;
    CHECK(softshadow_update_mesh(handle, 0, &given) == SOFTSHADOW_E_MESH, "an index");
    CHECK(softshadow_add_mesh(handle, &given, NULL) == SOFTSHADOW_E_MESH, "an index");
    CHECK(softshadow_remove_mesh(handle, 5) == SOFTSHADOW_E_ARGUMENT, "no such mesh");
    softshadow_light light = q.light;
    light.radius = -1;
    CHECK(softshadow_set_light(handle, &light) == SOFTSHADOW_E_LIGHT, "a radius");
    ask_query(handle, &after); /* still built */
    ask_same_bits(q.visibility, after.visibility, N, "after refusals");
    softshadow_destroy(handle);
    ask_free(&q), ask_free(&after);
    scene_free(&mesh), scene_free(&bad);
}

/* ---- Cancelling -------------------------------------------------------------------------------*/

typedef struct watch {
    int calls, stop_at, inside;
    double last;
    bool wrong, over;
} watch;

static int on_progress(void *user, double done) {
    watch *w = user;
    if (__atomic_add_fetch(&w->inside, 1, __ATOMIC_SEQ_CST) != 1) w->wrong = true;
    if (!(done >= 0 && done <= 1) || w->over) w->wrong = true;
    w->last = done;
    const int call = ++w->calls;
    __atomic_sub_fetch(&w->inside, 1, __ATOMIC_SEQ_CST);
    return call == w->stop_at;
}

static void cancelling_at_every_call(void **state) {
    scene_mesh mesh = thing();
    ask q = question(*state, &mesh), plain = q;
    ask_do(&plain);
    watch w = {0};
    q.options.user = &w, q.options.progress = on_progress;
    softshadow *handle = ask_handle(&q);
    const int in_build = w.calls;
    ask_query(handle, &q);
    const int in_all = w.calls;
    CHECK(in_all > in_build, "a query of %d points never said how far it is", N);
    ask_same_bits(plain.visibility, q.visibility, N, "with progress");
    softshadow_build build = q.build;
    build.method = *state;
    float *v = calloc(N, sizeof *v);
    const softshadow_mesh given = ask_mesh(&mesh);
    for (int k = 1; k <= in_all && k < 40; k++) {
        OK(handle, softshadow_update_mesh(handle, 0, &given));
        w = (watch){.stop_at = k};
        softshadow_status status = softshadow_build_maps(handle, &build);
        if (status == SOFTSHADOW_OK) status = try_query(handle, &q, v);
        w.over = true;
        CHECK(!w.wrong, "call %d: progress ran twice at once, out of range, or after the call", k);
        if (w.calls < k) continue; /* another schedule, fewer calls */
        CHECK(status == SOFTSHADOW_E_CANCELLED, "stopped at call %d: %s", k,
              softshadow_status_name(status));
        w = (watch){0};
        OK(handle, softshadow_build_maps(handle, &build));
        OK(handle, try_query(handle, &q, v));
        ask_same_bits(plain.visibility, v, N, "after cancelling");
    }
    w = (watch){.stop_at = 1};
    const softshadow_status status = try_query(handle, &q, v);
    CHECK(status == SOFTSHADOW_E_CANCELLED, "%s", softshadow_status_name(status));
    for (int i = 0; i < N; i++) CHECK(isnan(v[i]), "a cancelled batch is all NaN");
    free(v);
    softshadow_destroy(handle);
    ask_free(&q), ask_free(&plain);
    scene_free(&mesh);
}

/* ---- Threads
 * ------------------------------------------------------------------------------------*/

typedef struct reader {
    softshadow *handle;
    const ask *q;
    pthread_t thread;
    int wrong;
} reader;

static void *read_often(void *argument) {
    reader *r = argument;
    float *v = calloc(N, sizeof *v);
    for (int i = 0; i < 5; i++) {
        if (try_query(r->handle, r->q, v) != SOFTSHADOW_OK)
            r->wrong++;
        else if (memcmp(v, r->q->visibility, N * sizeof *v) != 0)
            r->wrong++;
        softshadow_stats stats = SOFTSHADOW_STATS_INIT;
        if (softshadow_get_stats(r->handle, &stats) != SOFTSHADOW_OK) r->wrong++;
    }
    free(v);
    return NULL;
}

static void eight_threads_query_one_handle(void **state) {
    scene_mesh mesh = thing();
    ask q = question(*state, &mesh);
    softshadow *handle = ask_handle(&q);
    ask_query(handle, &q);
    reader r[8];
    for (int i = 0; i < 8; i++) {
        r[i] = (reader){.handle = handle, .q = &q};
        CHECK(pthread_create(&r[i].thread, NULL, read_often, &r[i]) == 0, "pthread_create");
    }
    int wrong = 0;
    for (int i = 0; i < 8; i++) pthread_join(r[i].thread, NULL), wrong += r[i].wrong;
    CHECK(wrong == 0, "%d answers of 40 differ", wrong);
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    OK(handle, softshadow_get_stats(handle, &stats));
    CHECK(stats.points == 41ull * N, "points %llu", (unsigned long long)stats.points);
    softshadow_destroy(handle);
    ask_free(&q);
    scene_free(&mesh);
}

/* Handles that build and ask at the same time never disturb each other. */
static void *own_handle(void *argument) {
    reader *r = argument;
    for (int i = 0; i < 3; i++) {
        softshadow *handle = NULL;
        const softshadow_mesh mesh = ask_mesh(r->q->mesh);
        softshadow_build build = r->q->build;
        build.method = r->q->method;
        float *v = calloc(N, sizeof *v);
        if (softshadow_create(&handle, NULL) || softshadow_add_mesh(handle, &mesh, NULL) ||
            softshadow_set_light(handle, &r->q->light) || softshadow_build_maps(handle, &build) ||
            try_query(handle, r->q, v) || memcmp(v, r->q->visibility, N * sizeof *v)) {
            r->wrong++;
        }
        softshadow_destroy(handle);
        free(v);
    }
    return NULL;
}

static void four_handles_at_once(void **state) {
    scene_mesh mesh = thing();
    ask q = question(*state, &mesh);
    ask_do(&q);
    reader r[4];
    for (int i = 0; i < 4; i++) {
        r[i] = (reader){.q = &q};
        CHECK(pthread_create(&r[i].thread, NULL, own_handle, &r[i]) == 0, "pthread_create");
    }
    for (int i = 0; i < 4; i++) pthread_join(r[i].thread, NULL);
    for (int i = 0; i < 4; i++) CHECK(r[i].wrong == 0, "handle %d: %d wrong", i, r[i].wrong);
    ask_free(&q);
    scene_free(&mesh);
}

/* The first progress call of a query waits until another thread has tried to change the handle. */
typedef struct gate {
    sem_t entered, leave;
    bool closed;
} gate;

static int hold(void *user, double done) {
    (void)done;
    gate *g = user;
    if (g->closed) {
        g->closed = false;
        sem_post(&g->entered);
        sem_wait(&g->leave);
    }
    return 0;
}

static void *one_query(void *argument) {
    reader *r = argument;
    r->wrong = try_query(r->handle, r->q, r->q->visibility);
    return NULL;
}

static void changing_during_a_query(void **state) {
    scene_mesh mesh = thing();
    ask q = question(*state, &mesh), plain = q;
    ask_do(&plain);
    gate g = {.closed = false};
    sem_init(&g.entered, 0, 0), sem_init(&g.leave, 0, 0);
    q.options.user = &g, q.options.progress = hold;
    q.visibility = calloc(N, sizeof(float));
    softshadow *handle = ask_handle(&q);
    g.closed = true;
    reader r = {.handle = handle, .q = &q};
    CHECK(pthread_create(&r.thread, NULL, one_query, &r) == 0, "pthread_create");
    sem_wait(&g.entered);
    const softshadow_mesh given = ask_mesh(&mesh);
    softshadow_build build = q.build;
    build.method = *state;
    const softshadow_status answer[] = {softshadow_add_mesh(handle, &given, NULL),
                                        softshadow_update_mesh(handle, 0, &given),
                                        softshadow_remove_mesh(handle, 0),
                                        softshadow_set_light(handle, &q.light),
                                        softshadow_add_light(handle, &q.light, NULL),
                                        softshadow_build_maps(handle, &build)};
    const bool told = *softshadow_last_message(handle) != '\0';
    sem_post(&g.leave);
    pthread_join(r.thread, NULL);
    for (int i = 0; i < 6; i++) {
        CHECK(answer[i] == SOFTSHADOW_E_STATE, "change %d during a query: %s", i,
              softshadow_status_name(answer[i]));
    }
    CHECK(told, "a message says why");
    CHECK(r.wrong == SOFTSHADOW_OK, "the query: %s", softshadow_status_name(r.wrong));
    ask_same_bits(plain.visibility, q.visibility, N, "a query that others tried to disturb");
    OK(handle, try_query(handle, &q, q.visibility)); /* nothing is stale */
    softshadow_destroy(handle);
    ask_free(&q), ask_free(&plain);
    scene_free(&mesh);
    sem_destroy(&g.entered), sem_destroy(&g.leave);
}

/* ---- Messages
 * -----------------------------------------------------------------------------------*/

static void *another_message(void *argument) {
    softshadow *handle = argument;
    if (*softshadow_last_message(handle))
        return (void *)"another thread sees this thread's message";
    if (softshadow_remove_mesh(handle, 4711) != SOFTSHADOW_E_ARGUMENT) return (void *)"status";
    if (!strstr(softshadow_last_message(handle), "4711")) return (void *)"its own message";
    return NULL;
}

static int logged;

static void count_log(void *user, int level, const char *text) {
    CHECK(user == &logged && level >= 0 && level <= 2 && text && *text && !strchr(text, '\n'),
          "log");
    logged++;
}

static void messages_belong_to_threads(void **state) {
    (void)state;
    softshadow_options options = SOFTSHADOW_OPTIONS_INIT;
    options.log = count_log, options.user = &logged;
    softshadow *handle = NULL, *second = NULL;
    OK(NULL, softshadow_create(&handle, &options));
    OK(NULL, softshadow_create(&second, NULL));
    logged = 0;
    CHECK(softshadow_remove_mesh(handle, 123) == SOFTSHADOW_E_ARGUMENT, "no such mesh");
    CHECK(logged > 0, "the log was told nothing");
    pthread_t thread;
    void *wrong = NULL;
    CHECK(pthread_create(&thread, NULL, another_message, handle) == 0, "pthread_create");
    pthread_join(thread, &wrong);
    CHECK(!wrong, "%s", (const char *)wrong);
    CHECK(strstr(softshadow_last_message(handle), "123"), "\"%s\"",
          softshadow_last_message(handle));
    CHECK(*softshadow_last_message(second) == '\0', "another handle's message");
    const softshadow_light light = scene_sphere_light(0, 0, 1, 0.1);
    OK(handle, softshadow_set_light(handle, &light));
    CHECK(*softshadow_last_message(handle) == '\0', "a call that succeeds leaves no message");
    softshadow_destroy(handle), softshadow_destroy(second);
}

int main(void) {
    const ask_test tests[] = {
        {"order of calls", order_of_calls, NULL},
        {"rebuilding", rebuilding, NULL},
        {"refused updates change nothing", refused_updates_change_nothing, NULL},
        {"cancelling at every call", cancelling_at_every_call, NULL},
        {"eight threads query one handle", eight_threads_query_one_handle, NULL},
        {"four handles at once", four_handles_at_once, NULL},
        {"changing during a query", changing_during_a_query, NULL},
        {"messages belong to threads", messages_belong_to_threads, NULL},
    };
    return ask_run("handles", tests, sizeof tests / sizeof *tests);
}
