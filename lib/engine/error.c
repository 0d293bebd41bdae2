/* How far what was built is from ray-traced truth, measured on some of the points. */
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"
#include "base/vec.h"
#include "engine/engine.h"
#include "technique/raytrace.h"
#include "trace/bvh.h"
#include "trace/rays.h"

#define DEFAULT_SAMPLES 4096

/* A copy of n evenly chosen points: only what a query reads. */
typedef struct chosen {
    softshadow_points points;
    char *positions;
    float *normals;
    uint32_t *ids;
    uint64_t *primitives;
    float *answer, *half[2];
} chosen;

static void free_chosen(chosen *c) {
    ss_free(c->positions);
    ss_free(c->normals);
    ss_free(c->ids);
    ss_free(c->primitives);
    ss_free(c->answer);
    ss_free(c->half[0]);
    ss_free(c->half[1]);
}

static size_t place_of(size_t j, size_t n, size_t count) {
    return j * (count / n) + j * (count % n) / n; /* n is below 2^32 by far */
}

static bool choose(chosen *c, const softshadow_points *from, size_t n) {
    const size_t size = from->position_type == SOFTSHADOW_F64 ? 24 : 12;
    *c = (chosen){.points = *from};
    c->positions = ss_alloc(n, size);
    c->normals = ss_alloc(n, 12);
    c->ids = ss_alloc(n, 4);
    c->primitives = ss_alloc(n, 8);
    c->answer = ss_alloc(n, 4);
    c->half[0] = ss_alloc(n, 4), c->half[1] = ss_alloc(n, 4);
    if (!c->positions || !c->normals || !c->ids || !c->primitives || !c->answer || !c->half[0] ||
        !c->half[1]) {
        return false;
    }
    for (size_t j = 0; j < n; j++) {
        const size_t i = place_of(j, n, from->count);
        memcpy(c->positions + j * size,
               (const char *)from->positions + i * from->position_stride, size);
        if (from->normals) {
            memcpy(c->normals + 3 * j, (const char *)from->normals + i * from->normal_stride, 12);
        }
        if (from->ids) c->ids[j] = from->ids[i];
        if (from->primitives) c->primitives[j] = from->primitives[i];
    }
    c->points.positions = c->positions, c->points.position_stride = size, c->points.count = n;
    c->points.normals = from->normals ? c->normals : NULL, c->points.normal_stride = 12;
    c->points.ids = from->ids ? c->ids : NULL;
    c->points.primitives = from->primitives ? c->primitives : NULL;
    c->points.width = 0, c->points.error_bound = NULL;
    return true;
}

/* What tracing needs and the build did without, made for one call. */
typedef struct loan {
    ss_bvh *bvh;
    ss_rays *rays;
} loan;

static softshadow_status borrow(loan *made, ss_stage *stage, ss_pool *pool) {
    const ss_world *world = stage->world;
    softshadow_status status = SOFTSHADOW_OK;
    *made = (loan){0};
    if (!stage->bvh) status = ss_bvh_build(&made->bvh, world, pool, NULL);
    if (!status && !stage->rays && world->triangle_count) {
        status = ss_rays_create(&made->rays, world, pool);
    }
    if (made->bvh) stage->bvh = made->bvh;
    if (made->rays) stage->rays = made->rays;
    return status;
}

/* Truth: two halves of rays that share no number with each other or with any method. */
static softshadow_status trace_truth(softshadow *handle, chosen *c, uint32_t samples) {
    ss_stage stage = handle->built.stages[c->points.light];
    ss_params params = *stage.params;
    loan made;
    softshadow_status status = borrow(&made, &stage, handle->pool);
    stage.params = &params;
    for (uint32_t h = 0; h < 2 && !status; h++) {
        ss_totals totals = {0};
        void *state = NULL;
        params.seed = handle->built.plan.params.seed + 1 + h;
        status = ss_raytrace_prepare(&stage, samples / 2 + samples % 2, SS_SOBOL, &state);
        const ss_asked asked = {.technique = &ss_raytrace, .stage = &stage, .state = state};
        if (!status) status = ss_engine_ask(handle, &asked, &c->points, c->half[h], &totals);
        if (state) ss_raytrace.destroy(state);
    }
    ss_rays_destroy(made.rays);
    ss_bvh_destroy(made.bvh);
    return status;
}

static int by_size(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static softshadow_status summarize(const chosen *c, size_t n, softshadow_error *error) {
    double *size = ss_alloc(n, sizeof *size), squares = 0, sum = 0, halves = 0;
    if (!size) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu points", n);
    size_t count = 0;
    for (size_t i = 0; i < n; i++) {
        const double truth = 0.5 * ((double)c->half[0][i] + c->half[1][i]);
        const double miss = c->answer[i] - truth, half = (double)c->half[0][i] - c->half[1][i];
        if (isnan(miss)) continue;
        size[count++] = fabs(miss);
        squares += miss * miss, sum += miss, halves += half * half / 4;
    }
    qsort(size, count, sizeof *size, by_size);
    error->points = count;
    error->rms = count ? sqrt(squares / (double)count) : NAN;
    error->mean = count ? sum / (double)count : NAN;
    error->reference_error = count ? sqrt(halves / (double)count) : NAN;
    error->max = count ? size[count - 1] : NAN;
    error->p99 = count ? size[(size_t)ceil(0.99 * (double)(count - 1))] : NAN;
    ss_free(size);
    return SOFTSHADOW_OK;
}

/* What was built answers the chosen points, or all of an image where that makes a difference. */
static softshadow_status answer(softshadow *handle, const softshadow_points *points, size_t n,
                                chosen *c) {
    const ss_built *built = &handle->built;
    ss_stage stage = built->stages[points->light];
    const ss_asked asked = ss_engine_asked(handle, &stage, points->light);
    ss_totals totals = {0};
    /* As the whole batch would be answered, not the chosen few. */
    softshadow_status status =
        ss_engine_lend(handle, points->light, points->count, NULL, &stage);
    if (status) return status;
    stage.rows = points->width > 0 && asked.technique->finish;
    if (!stage.rows) return ss_engine_ask(handle, &asked, &c->points, c->answer, &totals);
    softshadow_points all = *points;
    float *whole = ss_alloc(points->count, sizeof *whole);
    if (!whole) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu points", points->count);
    all.error_bound = NULL;
    status = ss_engine_ask(handle, &asked, &all, whole, &totals);
    for (size_t j = 0; j < n && !status; j++) c->answer[j] = whole[place_of(j, n, points->count)];
    ss_free(whole);
    return status;
}

softshadow_status ss_engine_measure(softshadow *handle, const softshadow_points *points,
                                    softshadow_error *error) {
    if (error->samples > SS_MOST_SAMPLES) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT, "error.samples: %u, must be 0..%u", error->samples,
                       SS_MOST_SAMPLES);
    }
    size_t n = points->count;
    if (error->max_points && error->max_points < n) n = (size_t)error->max_points;
    chosen c;
    softshadow_status status = SOFTSHADOW_OK;
    if (!choose(&c, points, n)) {
        status = ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu points", n);
    }
    if (!status) status = answer(handle, points, n, &c);
    if (!status) {
        status = trace_truth(handle, &c, error->samples ? error->samples : DEFAULT_SAMPLES);
    }
    if (!status) status = summarize(&c, n, error);
    free_chosen(&c);
    return status;
}
