/* Tables of a bench. What is committed to a repository has ratios and errors only: a time is true
 * on one machine. */
#include "report.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const char *rung(void) {
    const char *cap = getenv("SOFTSHADOW_CPU");
    return cap && *cap ? cap : "best";
}

bool report_open(report *r, const bench_options *options, const char *ratios, const char *times,
                 cli_error *error) {
    *r = (report){.ratios_path = ratios, .times_path = times};
    cli_text_printf(&r->ratios,
                    "scene,triangles,light,points,cpu,penumbra,method,tolerance,ratio,"
                    "ratio_is,penumbra_rms,rms,max,settled,lit_ratio,build_ratio,thread_ratio\n");
    cli_text_printf(&r->times, "scene,light,points,cpu,way,ns_a_point,penumbra_rms,rms,max\n");
    (void)options;
    return !(r->ratios.failed || r->times.failed) || cli_fail(error, CLI_FAILED, "memory ran out");
}

/* The first way of a list that is as good as asked, or the last. */
static const bench_way *way_for(const bench_way *ways, uint32_t count, double tolerance) {
    uint32_t i = 0;
    while (i + 1 < count && ways[i].penumbra_rms > tolerance) i++;
    return &ways[i];
}

static const char *kind_of(const bench_at *at, double ours) {
    if (isnan(ours)) return "ours-not-reached";
    if (isnan(at->peer)) return "peer-not-reached";
    if (at->ours_is == BENCH_BEYOND || at->peer_is == BENCH_BEYOND) return "extrapolated";
    return at->peer_is == BENCH_LEAST ? "peer-cheapest" : "interpolated";
}

/* In front of a ratio. */
static char mark_of(const bench_at *at) {
    if (at->ours_is == BENCH_BEYOND || at->peer_is == BENCH_BEYOND) return '~';
    return at->peer_is == BENCH_LEAST ? '<' : ' ';
}

static void ratio_row(report *r, const bench_cell *cell, const bench_result *result,
                      const bench_at *at, double tolerance, const char *method, double ours,
                      double ours_lit, const bench_way *way) {
    const double ratio = isnan(ours) || isnan(at->peer) ? NAN : at->peer / ours;
    cli_text_printf(&r->ratios,
                    "%s,%zu,%s,%s,%s,%.3f,%s,1/%.0f,%.2f,%s,%.5f,%.5f,%.4f,%.3f,%.1f,%.2f,%.2f\n",
                    cell->scene->name, cell->scene->mesh.triangle_count, cell->light_name,
                    cell->points_name, rung(), result->penumbra, method, 1 / tolerance, ratio,
                    kind_of(at, ours), way->penumbra_rms, way->rms, way->max, result->settled,
                    ours_lit > 0 ? result->peer_lit / ours_lit : NAN,
                    result->peer_build > 0 ? result->ours_build / result->peer_build : NAN,
                    result->scaling > 0 ? result->scaling : NAN);
}

static void time_rows(report *r, const bench_cell *cell, const bench_way *ways, uint32_t count) {
    for (uint32_t i = 0; i < count; i++)
        cli_text_printf(&r->times, "%s,%s,%s,%s,%s,%.2f,%.6f,%.6f,%.5f\n", cell->scene->name,
                        cell->light_name, cell->points_name, rung(), ways[i].name,
                        1e9 * ways[i].seconds, ways[i].penumbra_rms, ways[i].rms, ways[i].max);
}

static void print_head(report *r, const bench_options *o) {
    if (r->headed) return;
    r->headed = true;
    printf("Times are ns a point%s; errors over points in penumbra, against %u rays; points %s.\n"
           "ratio = peer / ours at equal error; <: the peer's cheapest way is better than asked; "
           "~: one of\n"
           "them needs more than its largest count, by the line of its last two.\n\n",
           o->threads == 1 ? " (processor time, one thread)" : " (wall time)", o->truth_samples,
           o->primitives ? "on the surface, primitives told" : "just off the surface");
}

static void print_at(const bench_options *o, const bench_result *result, uint32_t i) {
    const bench_at *at = &result->at[i];
    const double e = o->tolerances[i];
    const bench_way *ours = way_for(result->ours, result->ours_count, e);
    printf("  1/%-5.0f exact %9.1f  peer %9.1f  ratio %c%7.2f  by %-10s rms %.5f max %.4f\n", 1 / e,
           1e9 * at->ours, 1e9 * at->peer, mark_of(at), at->peer / at->ours, ours->name,
           ours->penumbra_rms, ours->max);
    if (!o->automatic) return;
    printf("          auto  %9.1f                  ratio %c%7.2f  %-13s rms %.5f max %.4f%s\n",
           1e9 * at->automatic, mark_of(at), at->peer / at->automatic, "",
           at->automatic_way.penumbra_rms, at->automatic_way.max,
           at->automatic_way.penumbra_rms > e ? "  MISSED" : "");
}

static void print_ways(const char *name, const bench_way *ways, uint32_t count) {
    if (!count) return;
    printf("  %-6s", name);
    for (uint32_t i = 0; i < count; i++)
        printf(" %s:%.0f/%.5f", ways[i].name, 1e9 * ways[i].seconds, ways[i].penumbra_rms);
    printf("\n");
}

bool report_save(const cli_text *text, const char *path, cli_error *error) {
    cli_output output = {.fd = -1};
    if (text->failed) return cli_fail(error, CLI_FAILED, "memory ran out");
    const bool fine = cli_output_open(&output, path, error) &&
                      cli_output_write(&output, text->begin, text->length, error) &&
                      cli_output_commit(&output, error);
    cli_output_abandon(&output);
    return fine;
}

static double on_mesh(const bench_cell *cell) {
    size_t on = 0;
    for (size_t i = 0; i < cell->points.count; i++)
        on += cell->points.primitives[i] != SOFTSHADOW_NO_PRIMITIVE;
    return (double)on / (double)cell->points.count;
}

bool report_cell(report *r, const bench_cell *cell, const bench_options *o,
                 const bench_result *result, cli_error *error) {
    print_head(r, o);
    printf("%s: %zu triangles, %s light R = %.4f, %zu %s points (%.0f %% on it): "
           "%.1f %% penumbra, %.1f %% lit; truth +-%.5f%s\n",
           cell->scene->name, cell->scene->mesh.triangle_count, cell->light_name,
           cell->light.radius, cell->points.count, cell->points_name, 100 * on_mesh(cell),
           100 * result->penumbra, 100 * result->lit, result->truth_error,
           result->brute ? " by brute force" : "");
    for (uint32_t i = 0; i < o->tolerance_count; i++) {
        const bench_at *at = &result->at[i];
        print_at(o, result, i);
        ratio_row(r, cell, result, at, o->tolerances[i], "exact", at->ours, result->ours_lit,
                  way_for(result->ours, result->ours_count, o->tolerances[i]));
        if (o->automatic)
            ratio_row(r, cell, result, at, o->tolerances[i], "auto",
                      at->automatic_way.penumbra_rms <= o->tolerances[i] ? at->automatic : NAN,
                      result->automatic_lit, &at->automatic_way);
    }
    if (result->scaling > 0)
        printf("  %u threads are %.2f times as fast as one\n", o->threads, result->scaling);
    printf("  %.1f %% settled; lit point: exact %.2f ns", 100 * result->settled,
           1e9 * result->ours_lit);
    if (o->automatic) printf(", auto %.2f ns", 1e9 * result->automatic_lit);
    printf(", rim-adaptive peer %.1f ns, ratio %.1f", 1e9 * result->peer_lit,
           result->peer_lit / result->ours_lit);
    if (o->automatic) printf(" and %.1f", result->peer_lit / result->automatic_lit);
    printf("; first build %.1f ms, Embree %.1f ms; peer is %s, %s\n", 1e3 * result->ours_build,
           1e3 * result->peer_build, result->style.coherent ? "coherent" : "incoherent",
           result->style.clustered ? "clusters" : "rings");
    print_ways("exact", result->ours, result->ours_count);
    print_ways("peer", result->fixed, result->fixed_count);
    print_ways("rim", result->rim, result->rim_count);
    printf("\n");
    fflush(stdout);
    time_rows(r, cell, result->ours, result->ours_count);
    time_rows(r, cell, result->fixed, result->fixed_count);
    time_rows(r, cell, result->rim, result->rim_count);
    if (r->ratios.failed || r->times.failed) return cli_fail(error, CLI_FAILED, "memory ran out");
    /* Whole files after each cell: a run of many minutes may be stopped. */
    return (!r->ratios_path || report_save(&r->ratios, r->ratios_path, error)) &&
           (!r->times_path || report_save(&r->times, r->times_path, error));
}

void report_close(report *r) {
    cli_text_free(&r->ratios);
    cli_text_free(&r->times);
}
