/* softshadow bench: run time against error of everything there is, on the same points. Errors are
 * those at the truth's points; where a way errs as little as auto may, it is timed in turns with
 * all others of that kind, so that the front between them is no matter of luck. */
#include "matrix.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "stretches.h"

enum { MOST_HANDLES = 64 };

/* Seconds: of one timing, for what may be asked at some of the points only. A method that takes
 * ten times that is asked for no larger setting. */
#define PATIENCE 0.15

/* Seconds: what one way's timings need not last longer than together; where its place among others
 * matters and where not. */
#define ENOUGH 2.0
#define ENOUGH_APART (PATIENCE / 2)

/* Nobody builds for one batch: what is made once for the meshes is made, and told apart. */
#define POINTS_AHEAD ((uint64_t)1 << 24)

typedef struct job {
    softshadow *handle; /* NULL: the peer's, or given back */
    softshadow_build build;
    peer_style style;
    bool whole; /* neighbours share work: all points are asked at once */
    bool wall;
    double times[BENCH_REPEATS];
    uint32_t timed;
} job;

typedef struct matrix {
    matrix_cell *out;
    const bench_cell *cell;
    const bench_options *options;
    const matrix_request *wanted;
    bench_truth truth;
    bench_stretches stretches;
    peer *peer;
    peer_style style;
    double bounds[6];
    float *of_truth;
    job jobs[MATRIX_WAYS];
    softshadow *handles[MOST_HANDLES];
    uint32_t handle_count;
    pictures *pictures;
    cli_error *error;
} matrix;

/* ---- Which settings -------------------------------------------------------------------------*/

typedef struct settings {
    const char *unit;
    uint32_t values[9]; /* ends with 0 */
    uint32_t usual, most, quick_most;
} settings;

/* What maps of 4096 texels gain, the sweep over resolutions shows: they take as long as all
 * others. */
static const settings texels = {"texels", {256, 512, 1024, 2048, 4096}, 1024, 2048, 1024};
static const settings of_exact = {"samples", {256, 512, 1024, 2048, 4096}, 512, 4096, 4096};
static const settings of_rays = {"rays", {16, 64, 256, 1024, 4096}, 256, 4096, 1024};
static const settings of_peer = {"rays", {16, 32, 64, 128, 256, 512, 1024, 4096}, 256, 4096, 1024};

static bool is_asked(const matrix *m, const settings *s, uint32_t i) {
    const uint32_t usual = s == &texels && m->wanted->texels ? m->wanted->texels : s->usual;
    if (m->wanted->one_setting) return s->values[i] == usual;
    if (m->options->quick) return i % 2 == 0 && s->values[i] <= s->quick_most;
    return s->values[i] <= s->most;
}

bool matrix_choose(matrix_request *wanted, const char *name, size_t length, cli_error *error) {
    softshadow_method method = SOFTSHADOW_METHOD_INIT;
    cli_shown shown;
    if (length == 4 && memcmp(name, "peer", 4) == 0) return wanted->peer = true;
    for (uint32_t i = 0; softshadow_method_info(i, &method) == SOFTSHADOW_OK; i++) {
        if (strlen(method.name) != length || memcmp(method.name, name, length) != 0) continue;
        wanted->methods |= (uint64_t)1 << i;
        return true;
    }
    return cli_fail(error, CLI_USAGE,
                    "--methods %s: is none; peer and what 'softshadow methods' lists are allowed",
                    cli_show(&shown, name, length));
}

/* ---- Rows -----------------------------------------------------------------------------------*/

static job *job_of(matrix *m, const matrix_way *w) { return &m->jobs[w - m->out->ways]; }

static matrix_way *add_row(matrix *m, const char *method, const char *unit, const char *backend) {
    if (m->out->count == MATRIX_WAYS) return NULL;
    matrix_way *w = &m->out->ways[m->out->count++];
    *w = (matrix_way){.unit = unit, .backend = backend};
    m->jobs[m->out->count - 1] = (job){0};
    snprintf(w->method, sizeof w->method, "%s", method);
    return w;
}

static bool no_memory(matrix *m) { return cli_fail(m->error, CLI_FAILED, "memory ran out"); }

/* Whether its place among others matters to a percent. */
static bool matters(const matrix_way *w) { return w->way.penumbra_rms <= FRONT_ERROR; }

/* ---- The library ----------------------------------------------------------------------------*/

static bool fails(matrix *m, const matrix_way *w) {
    return cli_fail(m->error, CLI_FAILED, "%s: %s %s: %s", m->cell->scene->name, w->method,
                    w->setting, softshadow_last_message(job_of(m, w)->handle));
}

static double now(const job *j) { return j->wall ? bench_wall() : bench_clock(); }

/* The light is put anew, so that all that depends on it is made. */
static softshadow_status build(matrix *m, const job *j, double *seconds) {
    const softshadow_status status = softshadow_set_light(j->handle, &m->cell->light);
    const double start = now(j);
    const softshadow_status built =
        status == SOFTSHADOW_OK ? softshadow_build_maps(j->handle, &j->build) : status;
    *seconds = now(j) - start;
    return built;
}

static bool ask(matrix *m, const matrix_way *w, const float (*at)[3], size_t count, float *answer,
                double *seconds) {
    const job *j = job_of(m, w);
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    points.positions = at, points.count = count;
    const double start = now(j);
    const softshadow_status status = softshadow_query_visibility(j->handle, &points, answer);
    *seconds = (now(j) - start) / (double)count;
    return status == SOFTSHADOW_OK || fails(m, w);
}

/* The first batch of a size compiles and reserves what a GPU needs for it. */
static bool ask_warm(matrix *m, const matrix_way *w, const float (*at)[3], size_t count,
                     float *answer, double *seconds) {
    return (strcmp(w->backend, "egl") != 0 || ask(m, w, at, count, answer, seconds)) &&
           ask(m, w, at, count, answer, seconds);
}

/* Whether it was timed for long enough, each time at so many points. */
static bool is_enough(const matrix *m, const matrix_way *w, const job *j) {
    const double at = (double)(j->whole ? m->stretches.count : m->stretches.taken);
    double sum = 0;
    for (uint32_t i = 0; i < j->timed; i++) sum += j->times[i] * at;
    return sum >= (matters(w) ? ENOUGH : ENOUGH_APART);
}

/* All points, or as many stretches as patience lasts for, as the errors' points took so long. */
static bool time_ours(matrix *m, matrix_way *w) {
    job *j = job_of(m, w);
    bench_stretches *s = &m->stretches;
    double *seconds = &j->times[j->timed++];
    if (j->whole)
        return ask(m, w, (const float(*)[3])m->cell->points.at, s->count, s->visibility, seconds);
    bench_stretches_take(s, PATIENCE / w->way.seconds);
    return ask_warm(m, w, (const float(*)[3])s->some, s->taken, s->visibility, seconds);
}

/* Errors at the truth's points; the time that they take is a first guess, and a first timing where
 * all points were asked. */
static bool judge_ours(matrix *m, matrix_way *w) {
    job *j = job_of(m, w);
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    if (j->whole) {
        const size_t all = m->stretches.count;
        if (!ask(m, w, (const float(*)[3])m->cell->points.at, all, m->stretches.visibility,
                 &w->way.seconds))
            return false;
        j->times[j->timed++] = w->way.seconds;
        for (size_t i = 0; i < m->truth.count; i++)
            m->of_truth[i] = m->stretches.visibility[m->truth.index[i]];
    } else if (!ask_warm(m, w, (const float(*)[3])m->truth.at, m->truth.count, m->of_truth,
                         &w->way.seconds)) {
        return false;
    }
    if (softshadow_get_stats(j->handle, &stats) != SOFTSHADOW_OK) return fails(m, w);
    w->bytes = stats.map_bytes;
    bench_truth_judge(&m->truth, m->of_truth, &w->way);
    return !m->pictures || pictures_add(m->pictures, w, m->of_truth, m->error);
}

/* A method at one setting. *first: the seconds its first build took, 0 before it, whereof that of
 * the meshes becomes prepare. *go_on: a larger setting makes sense. */
static bool one_setting(matrix *m, matrix_way *w, double *prepare, bool *go_on) {
    job *j = job_of(m, w);
    double first = 0;
    *go_on = false;
    softshadow_status status = SOFTSHADOW_OK;
    if (*prepare < 0) status = build(m, j, &first);
    if (status == SOFTSHADOW_OK) status = build(m, j, &w->build);
    if (status == SOFTSHADOW_E_UNSUPPORTED) {
        m->out->count--;
        return true;
    }
    if (status != SOFTSHADOW_OK) return fails(m, w);
    if (*prepare < 0) *prepare = fmax(0, first - w->build);
    w->prepare = *prepare;
    if (!judge_ours(m, w)) return false;
    *go_on = j->whole || w->way.seconds * (double)m->truth.count < 10 * PATIENCE;
    const bool once = matters(w) || (m->options->quick && !m->wanted->wall);
    const uint32_t at_once = once ? 1 : m->options->repeat;
    while (j->timed < at_once && !is_enough(m, w, j))
        if (!time_ours(m, w)) return false;
    return true;
}

typedef struct family {
    softshadow_method method;
    bool egl, propagate, exact, automatic, rays;
    softshadow *handle;
    double prepare; /* < 0: not known */
} family;

static matrix_way *add_ours(matrix *m, family *f, const char *unit) {
    char name[40];
    snprintf(name, sizeof name, "%s%s", f->method.name, f->propagate ? " (propagated)" : "");
    matrix_way *w = add_row(m, name, unit, f->egl ? "egl" : "cpu");
    if (!w) return NULL;
    job *j = job_of(m, w);
    const softshadow_build init = SOFTSHADOW_BUILD_INIT;
    w->ours = true;
    j->handle = f->handle, j->whole = f->exact || f->automatic;
    j->wall = f->egl || m->wanted->wall || m->options->threads != 1;
    j->build = init;
    j->build.method = f->method.name, j->build.bounds = m->bounds;
    j->build.backend = f->egl ? SOFTSHADOW_EGL : SOFTSHADOW_CPU;
    j->build.points_ahead = POINTS_AHEAD, j->build.propagate = f->propagate;
    return w;
}

static bool by_tolerance(matrix *m, family *f) {
    const bench_options *o = m->options;
    for (uint32_t i = 0; i < o->tolerance_count; i++) {
        bool go_on;
        if (m->wanted->one_setting && i != o->tolerance_count / 2) continue;
        matrix_way *w = add_ours(m, f, "tolerance");
        if (!w) return no_memory(m);
        snprintf(w->setting, sizeof w->setting, "1/%.0f", 1 / o->tolerances[i]);
        job_of(m, w)->build.tolerance = o->tolerances[i];
        if (!one_setting(m, w, &f->prepare, &go_on)) return false;
    }
    return true;
}

static bool by_count(matrix *m, family *f) {
    const settings *s = f->exact ? &of_exact : f->rays ? &of_rays : &texels;
    bool go_on = true;
    for (uint32_t i = 0; go_on && s->values[i]; i++) {
        if (!is_asked(m, s, i)) continue;
        matrix_way *w = add_ours(m, f, s->unit);
        if (!w) return no_memory(m);
        snprintf(w->setting, sizeof w->setting, "%u", s->values[i]);
        job *j = job_of(m, w);
        *(s == &texels ? &j->build.resolution : &j->build.samples) = s->values[i];
        if (!one_setting(m, w, &f->prepare, &go_on)) return false;
    }
    return true;
}

/* Its handle is kept for further turns if any of its rows matters. */
static bool one_family(matrix *m, family *f) {
    const uint32_t from = m->out->count;
    bool keep = false;
    bool fine = bench_open(m->cell, m->options->threads, &f->handle, m->error);
    f->prepare = -1;
    fine = fine && (f->automatic ? by_tolerance(m, f) : by_count(m, f));
    for (uint32_t i = from; i < m->out->count; i++) keep |= matters(&m->out->ways[i]);
    if (fine && keep && m->handle_count < MOST_HANDLES) {
        m->handles[m->handle_count++] = f->handle;
        return true;
    }
    for (uint32_t i = from; i < m->out->count; i++) m->jobs[i].handle = NULL;
    softshadow_destroy(f->handle);
    return fine;
}

static bool has_egl(void) {
    softshadow_backend info = SOFTSHADOW_BACKEND_INIT;
    return softshadow_backend_info(SOFTSHADOW_EGL, &info) == SOFTSHADOW_OK &&
           info.status == SOFTSHADOW_OK;
}

static bool all_ours(matrix *m) {
    const bool gpu = m->wanted->egl && has_egl();
    family f = {.method = SOFTSHADOW_METHOD_INIT};
    for (uint32_t i = 0; softshadow_method_info(i, &f.method) == SOFTSHADOW_OK; i++) {
        if (!(m->wanted->methods >> i & 1)) continue;
        f.exact = strcmp(f.method.name, "exact") == 0;
        f.automatic = strcmp(f.method.name, "auto") == 0;
        f.rays = f.method.bound_kind == SOFTSHADOW_BOUND_STATISTICAL;
        const int variants = strcmp(f.method.name, "penumbra-limit") == 0 ? 2 : 1;
        for (int k = 0; k < 2 * variants; k++) {
            f.egl = k >= variants, f.propagate = k % variants;
            if (f.egl && !(gpu && f.method.backends & 1u << SOFTSHADOW_EGL)) continue;
            if (!one_family(m, &f)) return false;
        }
    }
    return true;
}

/* ---- The peer -------------------------------------------------------------------------------*/

static bool time_peer(matrix *m, const matrix_way *w) {
    job *j = job_of(m, w);
    return bench_peer_time(m->peer, &m->cell->light, &j->style, 4 * j->style.samples, &m->stretches,
                           &j->times[j->timed++]) ||
           no_memory(m);
}

static bool judge_peer(matrix *m, matrix_way *w) {
    peer_samples *samples = peer_samples_create(&m->cell->light, &job_of(m, w)->style);
    if (!samples) return no_memory(m);
    peer_query(m->peer, &m->cell->light, samples, (const float(*)[3])m->truth.at, m->truth.count,
               m->of_truth);
    peer_samples_free(samples);
    bench_truth_judge(&m->truth, m->of_truth, &w->way);
    return !m->pictures || pictures_add(m->pictures, w, m->of_truth, m->error);
}

static bool all_peers(matrix *m) {
    if (!peer_create(&m->peer, &m->cell->scene->mesh, false, m->error)) return false;
    if (!bench_peer_choose(m->peer, &m->cell->light, &m->stretches, &m->style)) return no_memory(m);
    for (int rim = 0; rim < 2; rim++) {
        for (uint32_t i = 0; of_peer.values[i]; i++) {
            if (!is_asked(m, &of_peer, i)) continue;
            matrix_way *w = add_row(m, rim ? "peer adaptive" : "peer", of_peer.unit, "embree");
            if (!w) return no_memory(m);
            snprintf(w->setting, sizeof w->setting, "%u", of_peer.values[i]);
            w->prepare = peer_build_seconds(m->peer), w->bytes = peer_bytes(m->peer);
            job *j = job_of(m, w);
            j->style = m->style, j->style.samples = of_peer.values[i], j->style.rim = rim;
            if (!judge_peer(m, w) || !time_peer(m, w)) return false;
        }
    }
    return true;
}

/* ---- All of it ------------------------------------------------------------------------------*/

static bool further_turns(matrix *m) {
    for (uint32_t turn = 1; turn < m->options->repeat; turn++) {
        for (uint32_t i = 0; i < m->out->count; i++) {
            matrix_way *w = &m->out->ways[i];
            const job *j = &m->jobs[i];
            double seconds;
            if (j->timed > turn || !matters(w)) continue;
            if (j->whole && is_enough(m, w, j)) continue;
            if (!w->ours) {
                if (!time_peer(m, w)) return false;
                continue;
            }
            if (build(m, j, &seconds) != SOFTSHADOW_OK) return fails(m, w);
            w->build = fmin(w->build, seconds);
            if (!time_ours(m, w)) return false;
        }
    }
    return true;
}

static bool prepare(matrix *m) {
    const bench_points *points = &m->cell->points;
    bench_points_box(points, m->bounds);
    if (!bench_truth_find(&m->truth, m->cell, m->options, m->error)) return false;
    m->of_truth = malloc(m->truth.count * sizeof *m->of_truth);
    if (!m->of_truth || !bench_stretches_make(&m->stretches, points)) return no_memory(m);
    return !m->wanted->pictures ||
           pictures_open(&m->pictures, m->wanted->pictures, m->cell, &m->truth, m->error);
}

static void conclude(matrix *m) {
    matrix_cell *out = m->out;
    out->penumbra = (double)m->truth.penumbrae / (double)m->truth.count;
    out->truth_error = m->truth.error, out->brute = m->truth.brute;
    out->threads = m->options->threads, out->wall = m->wanted->wall || out->threads != 1;
    for (uint32_t i = 0; i < out->count; i++) {
        const double median = bench_median(m->jobs[i].times, m->jobs[i].timed);
        /* Of wall times the least, which other work on the machine adds nothing to; now sorted. */
        out->ways[i].way.seconds = out->wall ? m->jobs[i].times[0] : median;
    }
    front_mark(out);
}

bool matrix_measure(matrix_cell *out, const bench_cell *cell, const bench_options *options,
                    const matrix_request *wanted, cli_error *error) {
    matrix *m = malloc(sizeof *m);
    if (!m) return cli_fail(error, CLI_FAILED, "memory ran out");
    *m = (matrix){.out = out, .cell = cell, .options = options, .wanted = wanted, .error = error};
    out->cell = cell, out->count = 0;
    /* The peer has no threads of its own here, and processor time. */
    const bool with_peer = wanted->peer && options->threads == 1 && !wanted->wall;
    const bool fine = prepare(m) && all_ours(m) && (!with_peer || all_peers(m)) && further_turns(m);
    if (fine) conclude(m);
    pictures_close(m->pictures);
    for (uint32_t i = 0; i < m->handle_count; i++) softshadow_destroy(m->handles[i]);
    bench_truth_free(&m->truth);
    bench_stretches_free(&m->stretches);
    peer_destroy(m->peer);
    free(m->of_truth);
    free(m);
    return fine;
}
