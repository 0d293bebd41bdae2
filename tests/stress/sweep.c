/* stress sweep: every case of cases.c with every method, as a table of the worst deviation from the
 * truth; then acne and peter-panning as numbers. What a method promises is held against it:
 *   certified, statistical  the truth is within its bound (statistical: at all but 1 in 1000, which
 *                           a hundred points show as 3 at most)
 *   all                     0 <= V <= 1, no NaN that was not put in, a refusal says E_UNSUPPORTED;
 *                           the same bits in whatever floating-point mode the host is
 *   exact, raytrace, auto   no acne, contact shadows from the first point on
 * Exit status 1 if a promise broke; the table marks such a cell with !. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "stress/stress.h"

enum { METHODS = 24, POINTS_MOST = 4096, CHANCE = 3 };

static unsigned broken;
static FILE *csv;
static const char *only; /* a sweep's name, or NULL */

static bool wanted(const char *name) { return !only || strcmp(only, name) == 0; }

/* What a bound may leave out: truths lose some digits, answers are floats. */
#define SLACK 2e-5

static bool is_truthful(const softshadow_method *m) {
    return m->bound_kind != SOFTSHADOW_BOUND_NONE || strcmp(m->name, "auto") == 0;
}

/* ---- One cell ------------------------------------------------------------------------------------ */

typedef struct verdict {
    double worst;
    size_t invalid, outside; /* no fraction at all; truth outside the bound */
    bool refused, failed;
} verdict;

static verdict judge(const stress_case *one, softshadow_status status, const float *visibility,
                     const float *bound) {
    verdict v = {.refused = status == SOFTSHADOW_E_UNSUPPORTED,
                 .failed = status && status != SOFTSHADOW_E_UNSUPPORTED};
    for (size_t i = 0; i < one->count && !status; i++) {
        if (!(visibility[i] >= 0 && visibility[i] <= 1)) {
            v.invalid++;
            continue;
        }
        const double off = fabs(visibility[i] - one->truth[i]);
        if (off > v.worst) v.worst = off;
        if (off > bound[i] + SLACK) v.outside++; /* never, where bound is NaN */
    }
    return v;
}

static bool breaks(const stress_case *one, const softshadow_method *m, const verdict *v) {
    if (v->failed || v->invalid) return true;
    if (m->bound_kind == SOFTSHADOW_BOUND_NONE && !is_truthful(m)) return false;
    if (v->refused) return !one->no_rays || m->bound_kind != SOFTSHADOW_BOUND_STATISTICAL;
    return v->outside > (m->bound_kind == SOFTSHADOW_BOUND_STATISTICAL ? CHANCE : 0);
}

static void print_cell(const stress_case *one, const softshadow_method *m, const verdict *v) {
    const bool bad = breaks(one, m, v);
    broken += bad;
    if (v->refused)
        printf(" %9s", "-");
    else if (v->failed)
        printf(" %9s", "failed");
    else
        printf(" %8.5f%c", v->worst, bad ? '!' : one->maps_too || is_truthful(m) ? ' ' : '~');
    if (csv)
        fprintf(csv, "\"%s\",\"%s\",%s,%s,%.6f,%zu,%zu\n", one->sweep, one->cell, m->name,
                v->refused ? "refused" : v->failed ? "failed" : bad ? "broken" : "held", v->worst,
                v->invalid, v->outside);
}

static void run_case(const stress_case *one, void *user) {
    static float visibility[POINTS_MOST], bound[POINTS_MOST];
    (void)user;
    if (!wanted(one->sweep)) return;
    printf("%-16.16s %-22.22s", one->sweep, one->cell);
    for (uint32_t i = 0; i < stress_method_count(); i++) {
        const softshadow_method m = stress_method(i);
        if (one->no_maps && !is_truthful(&m)) continue;
        const softshadow_status status = stress_ask(m.name, one, visibility, bound, STRESS_USUAL);
        const verdict v = judge(one, status, visibility, bound);
        print_cell(one, &m, &v);
        fflush(stdout);
    }
    printf("\n");
}

static void print_head(const char *first, const char *second) {
    printf("\n%-16s %-22s", first, second);
    for (uint32_t i = 0; i < stress_method_count(); i++) printf(" %-9.9s", stress_method(i).name);
    printf("\n");
}

/* ---- Bad points ------------------------------------------------------------------------------------ */

/* Half of the batch is no point: NaN, infinities, beyond 1e15; then all of it is. */
static void bad_points(const stress_case *one, void *user) {
    static float visibility[POINTS_MOST], bound[POINTS_MOST];
    static const double bad[] = {NAN, INFINITY, -INFINITY, 1e16, -1e300};
    bool *done = user;
    if (*done) return;
    *done = true;
    for (int all = 0; all < 2; all++) {
        stress_case worse = *one;
        worse.points = malloc(one->count * sizeof *worse.points);
        if (!worse.points) abort();
        memcpy(worse.points, one->points, one->count * sizeof *worse.points);
        for (size_t i = 0; i < one->count; i++) {
            if (all || i % 2) worse.points[i][i % 3] = bad[i % 5];
        }
        printf("%-16s %-22s", "bad points", all ? "all" : "every other");
        for (uint32_t k = 0; k < stress_method_count(); k++) {
            const softshadow_method m = stress_method(k);
            const softshadow_status status =
                stress_ask(m.name, &worse, visibility, bound, STRESS_USUAL);
            size_t wrong = status != SOFTSHADOW_OK;
            for (size_t i = 0; i < one->count && !status; i++) {
                wrong += (all || i % 2) != (isnan(visibility[i]) != 0);
            }
            broken += wrong > 0;
            printf(" %8zu%c", wrong, wrong ? '!' : ' ');
        }
        printf("\n");
        free(worse.points);
    }
}

/* ---- The host's floating-point modes --------------------------------------------------------------- */

/* Points that are answered otherwise than in the usual mode: none may be. */
static size_t count_others(const stress_case *one, const char *method, stress_mode mode) {
    static float want[POINTS_MOST], got[POINTS_MOST], bounds[2][POINTS_MOST];
    const softshadow_status usual = stress_ask(method, one, want, bounds[0], STRESS_USUAL),
                            status = stress_ask(method, one, got, bounds[1], mode);
    if (usual || status) return usual == status ? 0 : one->count;
    size_t others = 0;
    for (size_t i = 0; i < one->count; i++) {
        others += memcmp(&want[i], &got[i], sizeof want[i]) != 0 ||
                  memcmp(&bounds[0][i], &bounds[1][i], sizeof bounds[0][i]) != 0;
    }
    return others;
}

static void host_modes(const stress_case *one, void *user) {
    static const char *const names[] = {"upward", "downward", "to zero", "flushed"};
    (void)user;
    if (!one->in_modes) return;
    for (stress_mode mode = 0; mode < STRESS_USUAL; mode++) {
        printf("%-16.16s %-12.12s %-9s", "host's modes", one->sweep, names[mode]);
        for (uint32_t k = 0; k < stress_method_count(); k++) {
            const softshadow_method m = stress_method(k);
            const size_t others = count_others(one, m.name, mode);
            broken += others > 0;
            printf(" %8zu%c", others, others ? '!' : ' ');
            if (csv)
                fprintf(csv, "\"host's modes\",\"%s %s\",%s,%s,%zu,0,0\n", one->sweep, names[mode],
                        m.name, others ? "broken" : "held", others);
        }
        printf("\n");
    }
}

/* ---- Acne ------------------------------------------------------------------------------------------- */

/* Points within the faces of a ball that the whole lamp stands above: all of them are lit. */
static stress_case make_ball(bool primitives, bool single, double offset) {
    stress_case one = {.single = single};
    const double centre[3] = {offset, -offset, offset + 1};
    uint64_t random = 11;
    scene_icosphere(&one.mesh, centre, .5, 3, 0);
    for (size_t i = 0; single && i < 3 * one.mesh.vertices; i++) {
        one.mesh.xyz[i] = (float)one.mesh.xyz[i];
    }
    one.light = scene_sphere_light(offset + .2, -offset, offset + 5, .3);
    one.points = calloc(POINTS_MOST, sizeof *one.points);
    one.primitives = calloc(POINTS_MOST, sizeof *one.primitives);
    one.truth = calloc(POINTS_MOST, sizeof *one.truth);
    if (!one.points || !one.primitives || !one.truth) abort();
    for (uint64_t t = 0; one.count < POINTS_MOST; t = (t + 1) % one.mesh.triangles) {
        const uint32_t *index = one.mesh.indices + 3 * t;
        const double *a = one.mesh.xyz + 3 * index[0], *b = one.mesh.xyz + 3 * index[1],
                     *c = one.mesh.xyz + 3 * index[2];
        const double u = scene_uniform(&random, .05, .45), v = scene_uniform(&random, .05, .45);
        double e[3], f[3], n[3], *p = one.points[one.count];
        for (int k = 0; k < 3; k++) {
            e[k] = b[k] - a[k], f[k] = c[k] - a[k];
            p[k] = a[k] + u * e[k] + v * f[k];
            if (single) p[k] = (float)p[k];
        }
        double side = 0, length = 0;
        for (int k = 0; k < 3; k++) {
            n[k] = e[(k + 1) % 3] * f[(k + 2) % 3] - e[(k + 2) % 3] * f[(k + 1) % 3];
            side += n[k] * (one.light.position[k] - p[k]), length += n[k] * n[k];
        }
        if (side / sqrt(length) < one.light.radius * 1.05) continue; /* not wholly above */
        one.primitives[one.count] = t;
        one.truth[one.count++] = 1;
    }
    if (!primitives) {
        free(one.primitives);
        one.primitives = NULL;
    }
    return one;
}

static void free_case(stress_case *one) {
    scene_free(&one->mesh);
    free(one->points), free(one->primitives), free(one->truth);
}

static void acne(const char *cell, bool primitives, bool single, double offset) {
    static float visibility[POINTS_MOST], bound[POINTS_MOST];
    stress_case one = make_ball(primitives, single, offset);
    snprintf(one.sweep, sizeof one.sweep, "acne");
    snprintf(one.cell, sizeof one.cell, "%s", cell);
    printf("%-16s %-22s", "acne, % dark", cell);
    for (uint32_t k = 0; k < stress_method_count(); k++) {
        const softshadow_method m = stress_method(k);
        const softshadow_status status = stress_ask(m.name, &one, visibility, bound, STRESS_USUAL);
        size_t dark = 0;
        for (size_t i = 0; i < one.count && !status; i++) dark += visibility[i] < 1;
        const double percent = 100.0 * (double)dark / (double)one.count;
        const bool bad = (status && status != SOFTSHADOW_E_UNSUPPORTED) ||
                         (dark && is_truthful(&m));
        broken += bad;
        printf(" %8.3f%c", percent, bad ? '!' : ' ');
        if (csv)
            fprintf(csv, "acne,\"%s\",%s,%s,%.6f,0,0\n", cell, m.name, bad ? "broken" : "held",
                    percent);
    }
    printf("\n");
    free_case(&one);
}

/* ---- Peter-panning ---------------------------------------------------------------------------------- */

enum { STEPS = 60 };

/* Points at 10^-6 to 10^0 behind a wall of height 1 that stands on the ground, the lamp before it:
 * all of them are in umbra. Where the shadow starts is the nearest point from which on it is
 * dark. */
static void peter_panning(void) {
    static float visibility[STEPS], bound[STEPS];
    stress_case one = {.count = STEPS};
    scene_wall(&one.mesh, 10, 1);
    one.light = scene_sphere_light(-3, 0, 2, .1);
    one.points = calloc(STEPS, sizeof *one.points);
    if (!one.points) abort();
    for (int i = 0; i < STEPS; i++) one.points[i][0] = pow(10, -6 + 6.0 * i / (STEPS - 1) - .1);
    snprintf(one.sweep, sizeof one.sweep, "peter-panning");
    printf("%-16s %-22s", "peter-panning", "shadow starts at");
    for (uint32_t k = 0; k < stress_method_count(); k++) {
        const softshadow_method m = stress_method(k);
        const softshadow_status status = stress_ask(m.name, &one, visibility, bound, STRESS_USUAL);
        int from = STEPS;
        while (!status && from > 0 && visibility[from - 1] < .5) from--;
        const double start = from == 0 ? 0 : from < STEPS ? one.points[from][0] : INFINITY;
        const bool bad = (status && status != SOFTSHADOW_E_UNSUPPORTED) ||
                         (start > 0 && is_truthful(&m));
        broken += bad;
        printf(" %8.2g%c", start, bad ? '!' : ' ');
        if (csv)
            fprintf(csv, "peter-panning,wall,%s,%s,%.6g,0,0\n", m.name, bad ? "broken" : "held",
                    start);
    }
    printf("\n");
    free_case(&one);
}

int main(int argc, char **argv) {
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--csv") == 0 && i + 1 < argc) {
            csv = fopen(argv[++i], "w");
            if (!csv) return perror(argv[i]), 1;
            fprintf(csv, "sweep,cell,method,promise,value,invalid,outside\n");
        } else {
            only = argv[i];
        }
    }
    bool done = !wanted("bad points");
    print_head("sweep", "worst |V - truth|");
    stress_cases(run_case, NULL);
    stress_cases(bad_points, &done);
    print_head("", "points that differ");
    if (wanted("host's modes")) stress_cases(host_modes, NULL);
    print_head("", "");
    for (int i = 0; i < 4 && wanted("acne"); i++) {
        acne(i & 1 ? i & 2 ? "primitives, float" : "primitives, double"
                   : i & 2 ? "positions, float" : "positions, double", i & 1, i & 2, 0);
    }
    if (wanted("acne")) acne("positions at 1e7", false, false, 1e7);
    if (wanted("acne")) acne("primitives at 1e7", true, false, 1e7);
    if (wanted("peter-panning")) peter_panning();
    if (csv && fclose(csv) != 0) return perror("csv"), 1;
    printf("\n%u promises broken\n", broken);
    return broken > 0;
}
