/* "raytrace" against the peer, ray by ray: both shoot as many, in turns, from the same points. The
 * peer's tree is built twice, without ROBUST, as an expert would take it, and with it, as the
 * library must. Errors are not compared here: at equal rays they are equal. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "clock.h"

#define RAYS_A_TIMING 12e6

enum { PLAIN, ROBUST, TREES, CHUNK = 128 };

typedef struct duel {
    const bench_cell *cell;
    const bench_options *options;
    softshadow *handle;
    peer *peer[TREES];
    peer_samples *samples[TREES];
    peer_style style[TREES];
    float (*points)[3], *visibility;
    size_t count;
    cli_error *error;
} duel;

static double time_peer(const duel *d, const peer *with, const peer_samples *samples) {
    const double start = bench_clock();
    peer_query(with, &d->cell->light, samples, (const float(*)[3])d->points, d->count,
               d->visibility);
    return (bench_clock() - start) / (double)d->count;
}

static bool time_ours(const duel *d, double *seconds, uint64_t *rays) {
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    softshadow_stats before = SOFTSHADOW_STATS_INIT, after = SOFTSHADOW_STATS_INIT;
    points.positions = d->points, points.count = d->count;
    const bool asked = softshadow_get_stats(d->handle, &before) == SOFTSHADOW_OK;
    const double start = bench_clock();
    if (!asked || softshadow_query_visibility(d->handle, &points, d->visibility) != SOFTSHADOW_OK ||
        softshadow_get_stats(d->handle, &after) != SOFTSHADOW_OK)
        return cli_fail(d->error, CLI_FAILED, "raytrace: %s", softshadow_last_message(d->handle));
    *seconds = (bench_clock() - start) / (double)d->count;
    *rays = after.rays - before.rays;
    return true;
}

/* For each tree the flag and the order of samples that are faster there. */
static bool choose_samples(duel *d, int tree) {
    double best = INFINITY, seconds[3];
    for (int i = 0; i < 4; i++) {
        const peer_style style = {
            .samples = d->options->rays, .coherent = i & 1, .clustered = i >> 1};
        peer_samples *trial = peer_samples_create(&d->cell->light, &style);
        if (!trial) return cli_fail(d->error, CLI_FAILED, "memory ran out");
        for (int k = 0; k < 3; k++) seconds[k] = time_peer(d, d->peer[tree], trial);
        const double middle = bench_median(seconds, 3);
        peer_samples *loser = trial;
        if (middle < best) {
            best = middle, d->style[tree] = style;
            loser = d->samples[tree], d->samples[tree] = trial;
        }
        peer_samples_free(loser);
    }
    return true;
}

/* In turns; a ratio is the median of the turns' ratios. */
static bool contest(duel *d, const char *which) {
    const uint32_t repeat = d->options->repeat;
    double ours[BENCH_REPEATS], theirs[TREES][BENCH_REPEATS], ratio[TREES][BENCH_REPEATS];
    uint64_t rays = 0;
    for (uint32_t turn = 0; turn < repeat; turn++) {
        if (!time_ours(d, &ours[turn], &rays)) return false;
        for (int tree = 0; tree < TREES; tree++) {
            theirs[tree][turn] = time_peer(d, d->peer[tree], d->samples[tree]);
            ratio[tree][turn] = ours[turn] / theirs[tree][turn];
        }
    }
    printf("  %-10s %7zu points, %6.1f rays each: raytrace %9.1f  robust peer %9.1f  ratio %5.2f"
           "  plain peer %9.1f  ratio %5.2f\n",
           which, d->count, (double)rays / (double)d->count, 1e9 * bench_median(ours, repeat),
           1e9 * bench_median(theirs[ROBUST], repeat), bench_median(ratio[ROBUST], repeat),
           1e9 * bench_median(theirs[PLAIN], repeat), bench_median(ratio[PLAIN], repeat));
    fflush(stdout);
    return true;
}

/* Of the points along the curve every so-and-so-many-th stretch. */
static bool take_points(duel *d) {
    const bench_points *all = &d->cell->points;
    const double share = RAYS_A_TIMING / ((double)all->count * d->options->rays);
    const size_t step = share >= 1 ? 1 : (size_t)(1 / share);
    uint32_t *order = bench_morton((const float(*)[3])all->at, all->count);
    d->points = malloc(all->count * sizeof *d->points);
    d->visibility = malloc(all->count * sizeof *d->visibility);
    const bool fine = order && d->points && d->visibility;
    for (size_t i = 0; fine && i < all->count; i++)
        if (i / CHUNK % step == 0)
            memcpy(d->points[d->count++], all->at[order[i]], sizeof *d->points);
    free(order);
    return fine || cli_fail(d->error, CLI_FAILED, "memory ran out");
}

static bool prepare(duel *d) {
    softshadow_build wanted = SOFTSHADOW_BUILD_INIT;
    wanted.method = "raytrace", wanted.samples = d->options->rays;
    if (!take_points(d) || !bench_open(d->cell, d->options->threads, &d->handle, d->error))
        return false;
    if (softshadow_build_maps(d->handle, &wanted) != SOFTSHADOW_OK)
        return cli_fail(d->error, CLI_FAILED, "raytrace: %s", softshadow_last_message(d->handle));
    for (int tree = 0; tree < TREES; tree++)
        if (!peer_create(&d->peer[tree], &d->cell->scene->mesh, tree == ROBUST, d->error) ||
            !choose_samples(d, tree))
            return false;
    return true;
}

/* Where something hides a part of the light: there raytrace shoots every ray, as the peer does
 * everywhere. */
static bool keep_hidden(duel *d) {
    double seconds;
    uint64_t rays;
    size_t kept = 0;
    if (!time_ours(d, &seconds, &rays)) return false;
    for (size_t i = 0; i < d->count; i++)
        if (d->visibility[i] < 1) memcpy(d->points[kept++], d->points[i], sizeof *d->points);
    d->count = kept;
    return true;
}

bool bench_rays(const bench_cell *cell, const bench_options *options, cli_error *error) {
    duel d = {.cell = cell, .options = options, .error = error};
    printf("%s: %zu triangles, %s light R = %.4f, raytrace of %u samples; ns a point, ratio = "
           "raytrace / peer\n",
           cell->scene->name, cell->scene->mesh.triangle_count, cell->light_name,
           cell->light.radius, options->rays);
    bool fine = prepare(&d);
    for (int tree = 0; fine && tree < TREES; tree++)
        printf("  %s peer is %s, %s\n", tree == ROBUST ? "robust" : "plain",
               d.style[tree].coherent ? "coherent" : "incoherent",
               d.style[tree].clustered ? "clusters" : "rings");
    fine =
        fine && contest(&d, "all") && keep_hidden(&d) && (d.count == 0 || contest(&d, "not lit"));
    for (int tree = 0; tree < TREES; tree++) {
        peer_samples_free(d.samples[tree]);
        peer_destroy(d.peer[tree]);
    }
    softshadow_destroy(d.handle);
    free(d.points);
    free(d.visibility);
    return fine;
}
