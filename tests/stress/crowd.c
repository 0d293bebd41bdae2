/* Sixteen threads ask one handle for a million points each while four others make, build, ask and
 * let go handles of their own: every answer has the bits that one thread alone got.
 *
 * crowd [POINTS]: for each of the sixteen; 10,000 if not said. */
#include <pthread.h>

#include "ask.h"

enum { READERS = 16, BUILDERS = 4, BATCH = 10000, SIDE = 100 };

static size_t points_wanted = BATCH;

typedef struct crowd {
    const ask *q;
    softshadow *handle;
    int asking; /* readers that are not done */
} crowd;

typedef struct worker {
    crowd *crowd;
    pthread_t thread;
    uint64_t points, wrong;
} worker;

static uint64_t others(softshadow *handle, const ask *q, float *v) {
    const softshadow_points points = ask_points(q->points, q->count);
    if (softshadow_query_visibility(handle, &points, v) != SOFTSHADOW_OK) return q->count;
    return memcmp(v, q->visibility, q->count * sizeof *v) != 0;
}

static void *read_all(void *argument) {
    worker *w = argument;
    float *v = malloc(BATCH * sizeof *v);
    for (; v && w->points < points_wanted; w->points += BATCH) {
        w->wrong += others(w->crowd->handle, w->crowd->q, v);
    }
    free(v);
    __atomic_sub_fetch(&w->crowd->asking, 1, __ATOMIC_SEQ_CST);
    return NULL;
}

/* Once at least, and for as long as anybody asks. */
static void *build_often(void *argument) {
    worker *w = argument;
    const ask *q = w->crowd->q;
    float *v = malloc(BATCH * sizeof *v);
    do {
        softshadow *own = NULL;
        softshadow_build build = q->build;
        const softshadow_mesh mesh = ask_mesh(q->mesh);
        build.method = q->method;
        if (!v || softshadow_create(&own, NULL) || softshadow_add_mesh(own, &mesh, NULL) ||
            softshadow_set_light(own, &q->light) || softshadow_build_maps(own, &build))
            w->wrong++;
        else
            w->wrong += others(own, q, v);
        softshadow_destroy(own);
        w->points += BATCH;
    } while (__atomic_load_n(&w->crowd->asking, __ATOMIC_SEQ_CST) > 0);
    free(v);
    return NULL;
}

static void many_ask_while_others_build(void **state) {
    static double points[BATCH][3];
    scene_mesh mesh = {0};
    scene_garbage(&mesh, 3);
    scene_icosphere(&mesh, (const double[3]){0, 0, 2}, .7, 2, .1);
    scene_grid(points, SIDE, -2, 2, -2, 2, 0);
    ask q = ask_new(*state, &mesh, scene_sphere_light(.2, .1, 6, 1), (const double(*)[3])points,
                    BATCH, 16);
    q.build.resolution = 128, q.unbounded = true;
    softshadow *handle = ask_handle(&q);
    ask_query(handle, &q);
    crowd c = {&q, handle, READERS};
    worker w[READERS + BUILDERS] = {{0}};
    for (int i = 0; i < READERS + BUILDERS; i++) {
        w[i].crowd = &c;
        CHECK(pthread_create(&w[i].thread, NULL, i < READERS ? read_all : build_often, &w[i]) == 0,
              "pthread_create");
    }
    uint64_t wrong = 0, asked = 0, built = 0;
    for (int i = 0; i < READERS + BUILDERS; i++) {
        pthread_join(w[i].thread, NULL);
        wrong += w[i].wrong;
        *(i < READERS ? &asked : &built) += w[i].points;
    }
    print_message("           %llu points asked, %llu handles built\n", (unsigned long long)asked,
                  (unsigned long long)(built / BATCH));
    CHECK(wrong == 0 && asked >= READERS * points_wanted, "%llu answers were others",
          (unsigned long long)wrong);
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    OK(handle, softshadow_get_stats(handle, &stats));
    CHECK(stats.points == asked + BATCH, "points %llu", (unsigned long long)stats.points);
    softshadow_destroy(handle);
    ask_free(&q);
    scene_free(&mesh);
}

int main(int argc, char **argv) {
    if (argc > 1) points_wanted = strtoull(argv[1], NULL, 10);
    const ask_test tests[] = {{"many ask while others build", many_ask_while_others_build, NULL}};
    return ask_run("crowd", tests, COUNT(tests));
}
