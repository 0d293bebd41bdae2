/* One cell of the table: both sides on the same points, in turns. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "clock.h"
#include "stretches.h"

static const uint32_t our_counts[] = {256, 512, 1024, 2048, 4096};
static const uint32_t peer_counts[] = {16, 32, 64, 128, 256, 512, 1024, 2048, 4096};
enum {
    OURS = sizeof our_counts / sizeof *our_counts,
    PEERS = sizeof peer_counts / sizeof *peer_counts
};

typedef struct contest {
    const bench_cell *cell;
    const bench_options *options;
    bench_result *result;
    bench_truth truth;
    softshadow *handle;
    peer *peer;
    bench_stretches stretches; /* for the peer */
    float *visibility, *of_truth;
    cli_error *error;
} contest;

double bench_median(double *values, uint32_t count) {
    for (uint32_t i = 1; i < count; i++) {
        const double v = values[i];
        uint32_t j = i;
        for (; j > 0 && values[j - 1] > v; j--) values[j] = values[j - 1];
        values[j] = v;
    }
    return count % 2 ? values[count / 2] : (values[count / 2 - 1] + values[count / 2]) / 2;
}

static double now(const contest *c) {
    return c->options->threads == 1 ? bench_clock() : bench_wall();
}

/* ---- The library ----------------------------------------------------------------------------*/

static bool library_fails(contest *c, const char *what) {
    return cli_fail(c->error, CLI_FAILED, "%s: %s: %s", c->cell->scene->name, what,
                    softshadow_last_message(c->handle));
}

bool bench_open(const bench_cell *cell, uint32_t threads, softshadow **handle, cli_error *error) {
    const peer_mesh *mesh = &cell->scene->mesh;
    softshadow_options options = SOFTSHADOW_OPTIONS_INIT;
    options.threads = threads;
    if (softshadow_create(handle, &options) != SOFTSHADOW_OK)
        return cli_fail(error, CLI_FAILED, "%s", softshadow_last_message(NULL));
    softshadow_mesh given = SOFTSHADOW_MESH_INIT;
    given.flags = SOFTSHADOW_BORROW;
    given.positions = mesh->positions, given.vertex_count = mesh->vertex_count;
    given.indices = mesh->indices, given.triangle_count = mesh->triangle_count;
    return (softshadow_add_mesh(*handle, &given, NULL) == SOFTSHADOW_OK &&
            softshadow_set_light(*handle, &cell->light) == SOFTSHADOW_OK) ||
           cli_fail(error, CLI_FAILED, "%s: %s", cell->scene->name,
                    softshadow_last_message(*handle));
}

static bool open_library(contest *c, uint32_t threads) {
    return bench_open(c->cell, threads, &c->handle, c->error);
}

/* Nobody builds for one batch: what is made once for the meshes is made, and told apart. */
#define POINTS_AHEAD ((uint64_t)1 << 24)

static bool build(contest *c, const char *method, uint32_t samples, double tolerance) {
    softshadow_build wanted = SOFTSHADOW_BUILD_INIT;
    wanted.method = method, wanted.samples = samples, wanted.tolerance = tolerance;
    wanted.points_ahead = POINTS_AHEAD;
    return softshadow_build_maps(c->handle, &wanted) == SOFTSHADOW_OK || library_fails(c, "build");
}

static softshadow_points given_points(const contest *c) {
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    const bool on = c->options->primitives;
    points.positions = on ? c->cell->points.surface : c->cell->points.at;
    points.primitives = on ? c->cell->points.primitives : NULL;
    points.count = c->cell->points.count;
    return points;
}

static bool ask(contest *c, const softshadow_points *points, double *seconds) {
    const double start = now(c);
    const softshadow_status status = softshadow_query_visibility(c->handle, points, c->visibility);
    *seconds = (now(c) - start) / (double)points->count;
    return status == SOFTSHADOW_OK || library_fails(c, "query");
}

static void judge_ours(contest *c, bench_way *way) {
    for (size_t i = 0; i < c->truth.count; i++) c->of_truth[i] = c->visibility[c->truth.index[i]];
    bench_truth_judge(&c->truth, c->of_truth, way);
}

/* ---- The peer -------------------------------------------------------------------------------*/

static bool time_peer(contest *c, const peer_style *style, double *seconds) {
    return bench_peer_time(c->peer, &c->cell->light, style, style->samples, &c->stretches,
                           seconds) ||
           cli_fail(c->error, CLI_FAILED, "memory ran out");
}

static bool judge_peer(contest *c, const peer_style *style, bench_way *way) {
    peer_samples *samples = peer_samples_create(&c->cell->light, style);
    if (!samples) return cli_fail(c->error, CLI_FAILED, "memory ran out");
    peer_query(c->peer, &c->cell->light, samples, (const float(*)[3])c->truth.at, c->truth.count,
               c->of_truth);
    bench_truth_judge(&c->truth, c->of_truth, way);
    peer_samples_free(samples);
    return true;
}

/* ---- In turns -------------------------------------------------------------------------------*/

typedef struct timings {
    double of[BENCH_REPEATS];
    uint32_t count;
} timings;

static double least_tolerance(const bench_options *o) {
    double least = 1;
    for (uint32_t i = 0; i < o->tolerance_count; i++) least = fmin(least, o->tolerances[i]);
    return least;
}

/* Whether a further count is of use: errors are not yet small enough, and more rays still help. */
static bool goes_on(const contest *c, const bench_way *ways, uint32_t count) {
    if (count == 0) return true;
    const double error = ways[count - 1].penumbra_rms;
    if (error <= least_tolerance(c->options)) return false;
    return count == 1 || error < 0.95 * ways[count - 2].penumbra_rms;
}

static bool peer_turn(contest *c, uint32_t i, bool rim, timings *times) {
    bench_result *r = c->result;
    peer_style style = r->style;
    style.samples = peer_counts[i], style.rim = rim;
    bench_way *ways = rim ? r->rim : r->fixed;
    uint32_t *count = rim ? &r->rim_count : &r->fixed_count;
    if (i == *count && times->count == 0 && goes_on(c, ways, *count)) {
        snprintf(ways[i].name, sizeof ways[i].name, "%s %u", rim ? "rim" : "fixed", style.samples);
        if (!judge_peer(c, &style, &ways[(*count)++])) return false;
    }
    return i >= *count || time_peer(c, &style, &times->of[times->count++]);
}

static bool our_turn(contest *c, const char *method, uint32_t samples, double tolerance,
                     bench_way *way, timings *times) {
    const softshadow_points points = given_points(c);
    if (!build(c, method, samples, tolerance)) return false;
    if (!ask(c, &points, &times->of[times->count++])) return false;
    if (times->count == 1) judge_ours(c, way);
    return true;
}

static bool exact_turn(contest *c, uint32_t i, timings *times) {
    bench_result *r = c->result;
    if (i == r->ours_count && times->count == 0 && goes_on(c, r->ours, i)) {
        snprintf(r->ours[i].name, sizeof r->ours[i].name, "exact %u", our_counts[i]);
        r->ours_count++;
    }
    return i >= r->ours_count || our_turn(c, "exact", our_counts[i], 0, &r->ours[i], times);
}

static bool all_turns(contest *c) {
    static timings ours[OURS], fixed[PEERS], rim[PEERS], automatic[BENCH_TOLERANCES];
    bench_result *r = c->result;
    const bench_options *o = c->options;
    memset(ours, 0, sizeof ours), memset(fixed, 0, sizeof fixed), memset(rim, 0, sizeof rim);
    memset(automatic, 0, sizeof automatic);
    for (uint32_t turn = 0; turn < o->repeat; turn++) {
        for (uint32_t i = 0; i < PEERS; i++) {
            if (i < OURS && !exact_turn(c, i, &ours[i])) return false;
            if (o->automatic && i < o->tolerance_count) {
                bench_way *way = &r->at[i].automatic_way;
                snprintf(way->name, sizeof way->name, "auto");
                if (!our_turn(c, "auto", 0, o->tolerances[i], way, &automatic[i])) return false;
            }
            if (!peer_turn(c, i, false, &fixed[i]) || !peer_turn(c, i, true, &rim[i]))
                return false;
        }
    }
    for (uint32_t i = 0; i < r->ours_count; i++)
        r->ours[i].seconds = bench_median(ours[i].of, o->repeat);
    for (uint32_t i = 0; i < r->fixed_count; i++)
        r->fixed[i].seconds = bench_median(fixed[i].of, o->repeat);
    for (uint32_t i = 0; i < r->rim_count; i++)
        r->rim[i].seconds = bench_median(rim[i].of, o->repeat);
    for (uint32_t i = 0; o->automatic && i < o->tolerance_count; i++)
        r->at[i].automatic = r->at[i].automatic_way.seconds =
            bench_median(automatic[i].of, o->repeat);
    return true;
}

/* ---- What follows from it -------------------------------------------------------------------*/

/* Where the line through two ways has that error. */
static double along(const bench_way *a, const bench_way *b, double tolerance) {
    const double part =
        log(a->penumbra_rms / tolerance) / log(a->penumbra_rms / fmax(b->penumbra_rms, 1e-9));
    return a->seconds * pow(b->seconds / a->seconds, part);
}

double bench_reach(const bench_way *ways, uint32_t count, double tolerance, bench_reached *how) {
    *how = BENCH_NOT;
    if (count == 0) return NAN;
    if (ways[0].penumbra_rms <= tolerance) {
        *how = BENCH_LEAST;
        return ways[0].seconds;
    }
    for (uint32_t i = 1; i < count; i++) {
        if (ways[i].penumbra_rms > tolerance) continue;
        *how = BENCH_BETWEEN;
        return along(&ways[i - 1], &ways[i], tolerance);
    }
    /* Where an error hardly falls any more the line goes nowhere. */
    const bench_way *last = &ways[count - 1];
    if (count < 2 || last->penumbra_rms > 2 * tolerance ||
        last->penumbra_rms > 0.8 * ways[count - 2].penumbra_rms)
        return NAN;
    *how = BENCH_BEYOND;
    return along(&ways[count - 2], last, tolerance);
}

static void conclude(contest *c) {
    bench_result *r = c->result;
    for (uint32_t i = 0; i < c->options->tolerance_count; i++) {
        bench_at *at = &r->at[i];
        const double e = c->options->tolerances[i];
        bench_reached fixed_is, rim_is;
        at->ours = bench_reach(r->ours, r->ours_count, e, &at->ours_is);
        const double fixed = bench_reach(r->fixed, r->fixed_count, e, &fixed_is);
        const double rim = bench_reach(r->rim, r->rim_count, e, &rim_is);
        at->peer = fmin(fixed, rim); /* of a number and a NAN the number */
        at->peer_is = at->peer == rim ? rim_is : fixed_is;
    }
    size_t lit = 0;
    for (size_t i = 0; i < c->truth.count; i++) lit += c->truth.value[i] >= 1;
    r->lit = (double)lit / (double)c->truth.count;
    r->penumbra = (double)c->truth.penumbrae / (double)c->truth.count;
    r->truth_error = c->truth.error, r->brute = c->truth.brute;
}

/* What the library takes for each of them, in the method it was built for. */
static bool time_lit(contest *c, const float (*lit)[3], size_t count, double *of) {
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    points.positions = lit, points.count = count;
    return ask(c, &points, of);
}

static bool lit_turns(contest *c, const float (*lit)[3], size_t count, const uint32_t *order) {
    const uint32_t repeat = c->options->repeat;
    double exact[BENCH_REPEATS], automatic[BENCH_REPEATS], theirs[BENCH_REPEATS];
    peer_style style = c->result->style;
    style.samples = 256, style.rim = true;
    peer_samples *samples = peer_samples_create(&c->cell->light, &style);
    float(*sorted)[3] = malloc((count + 1) * sizeof *sorted);
    bool fine = (samples && sorted) || cli_fail(c->error, CLI_FAILED, "memory ran out");
    for (size_t i = 0; fine && i < count; i++) memcpy(sorted[i], lit[order[i]], sizeof *lit);
    for (uint32_t turn = 0; fine && turn < repeat; turn++) {
        fine = build(c, "exact", 512, 0) && time_lit(c, lit, count, &exact[turn]);
        if (c->options->automatic && fine)
            fine = build(c, "auto", 0, 0) && time_lit(c, lit, count, &automatic[turn]);
        const double start = bench_clock();
        peer_query(c->peer, &c->cell->light, samples, (const float(*)[3])sorted, count,
                   c->visibility);
        theirs[turn] = (bench_clock() - start) / (double)count;
    }
    if (fine) {
        c->result->ours_lit = bench_median(exact, repeat);
        c->result->peer_lit = bench_median(theirs, repeat);
        if (c->options->automatic) c->result->automatic_lit = bench_median(automatic, repeat);
    }
    peer_samples_free(samples);
    free(sorted);
    return fine;
}

/* All sides on nothing but wholly lit points: what a picture is mostly made of. */
static bool measure_lit(contest *c) {
    const size_t n = c->cell->points.count;
    const softshadow_points points = given_points(c);
    double seconds;
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    if (!build(c, "exact", 512, 0) || !ask(c, &points, &seconds)) return false;
    if (softshadow_get_stats(c->handle, &stats) != SOFTSHADOW_OK) return library_fails(c, "stats");
    c->result->settled = (double)stats.points_settled / (double)fmax(1, (double)stats.points);
    float(*lit)[3] = malloc(n * sizeof *lit);
    if (!lit) return cli_fail(c->error, CLI_FAILED, "memory ran out");
    size_t count = 0;
    for (size_t i = 0; i < n; i++)
        if (c->visibility[i] >= 1) memcpy(lit[count++], c->cell->points.at[i], sizeof *lit);
    uint32_t *order = count ? bench_morton((const float(*)[3])lit, count) : NULL;
    const bool fine = !count || (order ? lit_turns(c, (const float(*)[3])lit, count, order)
                                       : cli_fail(c->error, CLI_FAILED, "memory ran out"));
    free(order);
    free(lit);
    return fine;
}

/* One thread and all of them in turns: the best of each, as the machine has other work, too. */
static bool measure_scaling(contest *c) {
    double best[2] = {INFINITY, INFINITY}, seconds;
    softshadow *all = c->handle, *one = NULL;
    const softshadow_points points = given_points(c);
    bool fine = build(c, "exact", 512, 0) && open_library(c, 1);
    if (fine) fine = build(c, "exact", 512, 0), one = c->handle;
    for (uint32_t turn = 0; fine && turn < 2 * c->options->repeat + 2; turn++) {
        c->handle = turn % 2 ? one : all;
        fine = ask(c, &points, &seconds);
        best[turn % 2] = fmin(best[turn % 2], seconds);
    }
    if (c->handle != all && c->handle != one) softshadow_destroy(c->handle);
    softshadow_destroy(one);
    c->handle = all;
    c->result->scaling = best[1] / best[0];
    return fine;
}

static bool prepare(contest *c) {
    const bench_points *points = &c->cell->points;
    c->visibility = malloc(points->count * sizeof *c->visibility);
    c->of_truth = malloc(points->count * sizeof *c->of_truth);
    return (bench_stretches_make(&c->stretches, points) && c->visibility && c->of_truth) ||
           cli_fail(c->error, CLI_FAILED, "memory ran out");
}

static bool first_build(contest *c) {
    if (!open_library(c, c->options->threads)) return false;
    const double start = now(c);
    if (!build(c, c->options->automatic ? "auto" : "exact", 0, 0)) return false;
    c->result->ours_build = now(c) - start;
    if (!peer_create(&c->peer, &c->cell->scene->mesh, false, c->error)) return false;
    c->result->peer_build = peer_build_seconds(c->peer);
    return bench_peer_choose(c->peer, &c->cell->light, &c->stretches, &c->result->style) ||
           cli_fail(c->error, CLI_FAILED, "memory ran out");
}

bool bench_measure(const bench_cell *cell, const bench_options *options, bench_result *result,
                   cli_error *error) {
    contest c = {.cell = cell, .options = options, .result = result, .error = error};
    *result = (bench_result){0};
    const bool fine = prepare(&c) && bench_truth_find(&c.truth, cell, options, error) &&
                      first_build(&c) && all_turns(&c) && measure_lit(&c) &&
                              (options->threads == 1 || measure_scaling(&c));
    if (fine) conclude(&c);
    bench_truth_free(&c.truth);
    softshadow_destroy(c.handle);
    peer_destroy(c.peer);
    bench_stretches_free(&c.stretches);
    free(c.visibility);
    free(c.of_truth);
    return fine;
}

/* The share of penumbrae grows with the light while there is lit ground left: bisection. */
bool bench_calibrate(const bench_cell *cell, const bench_options *options, double *radius,
                     double *share, cli_error *error) {
    bench_cell trial = *cell;
    double low = 0.02 * cell->scene->entry.radius, high = cell->scene->entry.radius;
    for (int step = 0; step < 10; step++) {
        bench_truth truth;
        trial.light.radius = *radius = (low + high) / 2;
        if (!bench_truth_find(&truth, &trial, options, error)) return false;
        *share = (double)truth.penumbrae / (double)truth.count;
        bench_truth_free(&truth);
        if (fabs(*share - 0.25) < 0.002) break;
        if (*share < 0.25)
            low = *radius;
        else
            high = *radius;
    }
    return true;
}
