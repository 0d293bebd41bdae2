/* What a renderer hands over: its own scheduler, a log, and a way to stop. */
#include <pthread.h>
#include <softshadow.h>
#include <stdio.h>
#include <stdlib.h>

enum { THREADS = 3, SIDE = 200 };

typedef void (*range_body)(void *ctx, uint64_t begin, uint64_t end);
typedef struct job {
    range_body body;
    void *ctx;
    uint64_t begin, end;
} job;

static void *work(void *argument) {
    const job *j = argument;
    if (j->begin < j->end) j->body(j->ctx, j->begin, j->end);
    return NULL;
}

/* A scheduler may cut the range as it likes: the results are the same, bit for bit. */
static void schedule(void *user, uint64_t n, range_body body, void *ctx) {
    pthread_t threads[THREADS];
    job jobs[THREADS];
    int started[THREADS];
    (void)user;
    for (uint64_t i = 0; i < THREADS; i++) {
        jobs[i] = (job){body, ctx, n * i / THREADS, n * (i + 1) / THREADS};
        started[i] = pthread_create(&threads[i], NULL, work, &jobs[i]) == 0;
        if (!started[i]) work(&jobs[i]);
    }
    for (int i = 0; i < THREADS; i++)
        if (started[i]) pthread_join(threads[i], NULL);
}

static void tell(void *user, int level, const char *text) {
    (void)user;
    fprintf(stderr, "softshadow says (%d): %s\n", level, text);
}

static int stop(void *user, double done) {
    (void)done;
    return *(int *)user; /* non-zero cancels the call */
}

static float *floor_points(void) {
    float *positions = malloc(sizeof(float) * 3 * SIDE * SIDE);
    for (int i = 0; positions && i < SIDE * SIDE; i++) {
        positions[3 * i] = (float)(i % SIDE) * 4 / SIDE - 2;
        positions[3 * i + 1] = 0;
        positions[3 * i + 2] = (float)(i / SIDE) * 4 / SIDE - 2;
    }
    return positions;
}

int main(void) {
    const float triangle[] = {-1, 1, -1, 1, 1, -1, 0, 1, 1};
    const uint32_t indices[] = {0, 1, 2};
    int cancel = 0;
    softshadow_options options = SOFTSHADOW_OPTIONS_INIT;
    options.user = &cancel;
    options.log = tell;
    options.progress = stop;
    options.parallel = schedule;
    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    mesh.positions = triangle;
    mesh.vertex_count = 3;
    mesh.indices = indices;
    mesh.triangle_count = 1;
    softshadow_light lamp = SOFTSHADOW_LIGHT_INIT;
    lamp.position[1] = 4;
    lamp.radius = 0.5;
    float *positions = floor_points(), *visibility = malloc(sizeof(float) * SIDE * SIDE);
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    points.positions = positions;
    points.count = SIDE * SIDE;

    softshadow *s = NULL;
    int result = 1;
    if (!positions || !visibility || softshadow_create(&s, &options) ||
        softshadow_add_mesh(s, &mesh, NULL) || softshadow_set_light(s, &lamp) ||
        softshadow_build_maps(s, NULL) || softshadow_query_visibility(s, &points, visibility)) {
        fprintf(stderr, "%s\n", softshadow_last_message(s));
        goto done;
    }
    double sum = 0;
    for (int i = 0; i < SIDE * SIDE; i++) sum += visibility[i];
    printf("on average %.4f of the lamp is seen\n", sum / (SIDE * SIDE));

    cancel = 1;
    const softshadow_status status = softshadow_query_visibility(s, &points, visibility);
    printf("asked to stop: %s\n", softshadow_status_name(status));
    result = status == SOFTSHADOW_E_CANCELLED || status == SOFTSHADOW_OK ? 0 : 1;
done:
    softshadow_destroy(s);
    free(positions);
    free(visibility);
    return result;
}
