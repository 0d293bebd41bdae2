/* What both sides are measured against: many samples of a sequence of its own (the lattice of the
 * plastic number [Rob18], turned at random for each point) through Embree's robust tests, or
 * without Embree in double where the triangles are few. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "brute.h"

static bool reserve(bench_truth *truth, size_t count) {
    *truth = (bench_truth){malloc(count * sizeof *truth->index),
                           malloc(count * sizeof *truth->at),
                           malloc(count * sizeof *truth->value),
                           malloc(count * sizeof *truth->apart),
                           count,
                           0,
                           0,
                           false};
    if (truth->index && truth->at && truth->value && truth->apart) return true;
    bench_truth_free(truth);
    return false;
}

void bench_truth_free(bench_truth *truth) {
    free(truth->index);
    free(truth->at);
    free(truth->value);
    free(truth->apart);
    *truth = (bench_truth){0};
}

static int by_number(const void *a, const void *b) {
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* One of each stretch of the Morton order, at random. */
static bool choose(bench_truth *truth, const bench_cell *cell) {
    const size_t n = cell->points.count;
    uint32_t *order = bench_morton((const float(*)[3])cell->points.at, n);
    uint64_t state = 99;
    if (!order) return false;
    for (size_t i = 0; i < truth->count; i++) {
        const size_t from = i * n / truth->count, to = (i + 1) * n / truth->count;
        truth->index[i] = order[from + scene_random(&state) % (to - from)];
    }
    free(order);
    qsort(truth->index, truth->count, sizeof *truth->index, by_number);
    for (size_t i = 0; i < truth->count; i++)
        memcpy(truth->at[i], cell->points.at[truth->index[i]], sizeof truth->at[i]);
    return true;
}

/* Two independent answers for every point: their mean is the truth, their difference its error. */
static bool by_rays(bench_truth *truth, const bench_cell *cell, uint32_t samples, float *other,
                    cli_error *error) {
    const peer_style style = {.samples = samples, .clustered = true, .truth = true};
    peer_samples *table = peer_samples_create(&cell->light, &style);
    peer *judge = NULL;
    bool fine = table || cli_fail(error, CLI_FAILED, "memory ran out");
    fine = fine && peer_create(&judge, &cell->scene->mesh, true, error);
    if (fine) {
        const float(*at)[3] = (const float(*)[3])truth->at;
        peer_query(judge, &cell->light, table, at, truth->count, other);
        peer_samples_turn(table);
        peer_query(judge, &cell->light, table, at, truth->count, truth->value);
    }
    peer_destroy(judge);
    peer_samples_free(table);
    return fine;
}

static bool by_force(bench_truth *truth, const bench_cell *cell, uint32_t samples, float *other,
                     cli_error *error) {
    brute *force = brute_create(&cell->scene->mesh, &cell->light, samples);
    if (!force) return cli_fail(error, CLI_FAILED, "memory ran out");
    uint64_t state = 7;
    for (size_t i = 0; i < truth->count; i++) {
        other[i] = (float)brute_visible(force, truth->at[i], scene_uniform(&state, 0, 1));
        truth->value[i] = (float)brute_visible(force, truth->at[i], scene_uniform(&state, 0, 1));
    }
    brute_destroy(force);
    return true;
}

bool bench_truth_find(bench_truth *truth, const bench_cell *cell, const bench_options *options,
                      cli_error *error) {
    const size_t n = cell->points.count;
    const size_t count = n < options->truth_points ? n : options->truth_points;
    float *other = malloc((count + 1) * sizeof *other);
    if (!reserve(truth, count) || !other || !choose(truth, cell)) {
        free(other);
        bench_truth_free(truth);
        return cli_fail(error, CLI_FAILED, "memory ran out");
    }
    const uint32_t half = options->truth_samples / 2;
    truth->brute = cell->scene->mesh.triangle_count <= BRUTE_MOST;
    const bool fine = (truth->brute ? by_force : by_rays)(truth, cell, half, other, error);
    double square = 0;
    for (size_t i = 0; fine && i < count; i++) {
        const double apart = (double)other[i] - (double)truth->value[i];
        truth->value[i] = (other[i] + truth->value[i]) / 2;
        if (!(truth->value[i] > 0 && truth->value[i] < 1)) continue;
        truth->penumbrae++;
        square += apart * apart / 4;
    }
    if (truth->penumbrae) truth->error = sqrt(square / (double)truth->penumbrae);
    free(other);
    if (!fine) bench_truth_free(truth);
    return fine;
}

static int by_size(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void bench_truth_judge(const bench_truth *truth, const float *value, bench_way *way) {
    const double count = (double)truth->count;
    double all = 0, penumbra = 0, sum = 0;
    size_t same = 0;
    for (size_t i = 0; i < truth->count; i++) {
        const double by = (double)value[i] - (double)truth->value[i];
        all += by * by, sum += by;
        if (truth->value[i] > 0 && truth->value[i] < 1) penumbra += by * by;
        truth->apart[i] = fabs(by);
        same += fabs(by) <= 1.0 / 512;
    }
    qsort(truth->apart, truth->count, sizeof *truth->apart, by_size);
    way->rms = sqrt(all / count), way->bias = sum / count;
    way->penumbra_rms = truth->penumbrae ? sqrt(penumbra / (double)truth->penumbrae) : 0;
    way->max = truth->apart[truth->count - 1];
    way->p99 = truth->apart[(truth->count - 1) * 99 / 100];
    way->same = (double)same / count;
}
