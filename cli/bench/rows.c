/* The matrix as a table on the screen, as CSV and as JSON: the same fields in all of them. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "matrix.h"
#include "report.h"

enum { FIELDS = 40 };

typedef struct field {
    const char *name;
    char text[64];
    bool number;
} field;

typedef struct record {
    field fields[FIELDS];
    uint32_t count;
} record;

static void put(record *r, const char *name, bool number, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

static void put(record *r, const char *name, bool number, const char *format, ...) {
    field *f = &r->fields[r->count++];
    va_list values;
    f->name = name, f->number = number;
    va_start(values, format);
    vsnprintf(f->text, sizeof f->text, format, values);
    va_end(values);
}

static void number(record *r, const char *name, double value) { put(r, name, true, "%.6g", value); }

static void describe_cell(record *r, const matrix_cell *m) {
    const bench_cell *cell = m->cell;
    const char *cap = getenv("SOFTSHADOW_CPU");
    put(r, "sweep", false, "%s", m->sweep);
    if (*m->sweep)
        put(r, "value", true, "%.10g", m->value);
    else
        put(r, "value", false, "%s", "");
    put(r, "scene", false, "%s", cell->scene->name);
    put(r, "triangles", true, "%zu", cell->scene->mesh.triangle_count);
    put(r, "light", false, "%s", cell->light_name);
    number(r, "light_radius", cell->light.radius / cell->scene->entry.radius);
    put(r, "points", false, "%s", cell->points_name);
    put(r, "count", true, "%zu", cell->points.count);
    number(r, "penumbra", m->penumbra);
    put(r, "truth", false, "%s", m->brute ? "brute force" : "embree");
    number(r, "truth_error", m->truth_error);
    put(r, "cpu", false, "%s", cap && *cap ? cap : "best");
    put(r, "threads", true, "%u", m->threads);
}

static void describe_way(record *r, const matrix_way *w) {
    put(r, "method", false, "%s", w->method);
    put(r, "unit", false, "%s", w->unit);
    put(r, "setting", false, "%s", w->setting);
    put(r, "backend", false, "%s", w->backend);
    number(r, "prepare_ms", 1e3 * w->prepare);
    number(r, "build_ms", 1e3 * w->build);
    number(r, "ns_a_point", 1e9 * w->way.seconds);
    number(r, "penumbra_rms", w->way.penumbra_rms);
    number(r, "rms", w->way.rms);
    number(r, "max", w->way.max);
    number(r, "p99", w->way.p99);
    number(r, "bias", w->way.bias);
    number(r, "exact_percent", 100 * w->way.same);
    put(r, "bytes", true, "%llu", (unsigned long long)w->bytes);
    put(r, "front", true, "%d", w->behind <= 1);
    number(r, "behind", w->behind);
    number(r, "behind_ours", w->behind_ours);
}

static void to_csv(cli_text *csv, const record *r) {
    const bool first = csv->length == 0;
    for (uint32_t i = 0; first && i < r->count; i++)
        cli_text_printf(csv, "%s%c", r->fields[i].name, i + 1 < r->count ? ',' : '\n');
    for (uint32_t i = 0; i < r->count; i++)
        cli_text_printf(csv, "%s%c", r->fields[i].text, i + 1 < r->count ? ',' : '\n');
}

static void to_json(cli_text *json, const record *r) {
    cli_text_printf(json, json->length ? ",\n  {" : "[\n  {");
    for (uint32_t i = 0; i < r->count; i++) {
        const field *f = &r->fields[i];
        cli_text_printf(json, "%s\"%s\": ", i ? ", " : "", f->name);
        if (f->number)
            cli_text_printf(json, "%s", f->text);
        else
            cli_text_json(json, f->text);
    }
    cli_text_printf(json, "}");
}

/* ---- On the screen --------------------------------------------------------------------------*/

static void print_cell(const matrix_cell *m) {
    const bench_cell *cell = m->cell;
    if (*m->sweep) printf("%s %g: ", m->sweep, m->value);
    printf("%s: %zu triangles, %s light R = %.4f, %zu %s points: %.1f %% penumbra; truth %s, "
           "+-%.5f%s\n",
           cell->scene->name, cell->scene->mesh.triangle_count, cell->light_name,
           cell->light.radius, cell->points.count, cell->points_name, 100 * m->penumbra,
           m->brute ? "by brute force in double" : "by rays", m->truth_error,
           m->wall ? "; wall time" : "");
    printf("  %-27s %16s %-6s %11s  %-7s %-7s %-6s %-6s %-8s %6s %9s %9s %8s\n", "method",
           "setting", "on", "ns a point", "penumb.", "all", "p99", "max", "bias", "exact",
           "build ms", "meshes ms", "MB");
    for (uint32_t i = 0; i < m->count; i++) {
        const matrix_way *w = &m->ways[i];
        printf(
            "%c %-27s %6s %-9s %-6s %11.1f  %.5f %.5f %.4f %.4f %+.5f %5.1f%% %9.2f %9.1f %8.2f\n",
            w->behind <= 1 ? '*' : ' ', w->method, w->setting, w->unit, w->backend,
            1e9 * w->way.seconds, w->way.penumbra_rms, w->way.rms, w->way.p99, w->way.max,
            w->way.bias, 100 * w->way.same, 1e3 * w->build, 1e3 * w->prepare,
            1e-6 * (double)w->bytes);
    }
}

/* How auto stands in one cell; what is behind is kept for the end. */
static void judge(rows *r, const matrix_cell *m) {
    for (uint32_t i = 0; i < m->count; i++) {
        const matrix_way *w = &m->ways[i];
        if (!front_must(w)) continue;
        const bool beyond = w->behind > FRONT_NOISE, beyond_ours = w->behind_ours > FRONT_NOISE;
        r->must++, r->beyond += beyond, r->beyond_ours += beyond_ours;
        if (!beyond) {
            printf("  auto %s is on the front\n", w->setting);
            continue;
        }
        const matrix_way *by = &m->ways[w->ahead];
        char text[256];
        snprintf(text, sizeof text,
                 "auto %s (rms %.5f) takes %.2f times as long as %s %s (rms %.5f); %.2f of the "
                 "library's best",
                 w->setting, w->way.penumbra_rms, w->behind, by->method, by->setting,
                 by->way.penumbra_rms, w->behind_ours > 0 ? w->behind_ours : 1);
        printf("  %s\n", text);
        cli_text_printf(&r->behind, "  %s, %s light: %s\n", m->cell->scene->name,
                        m->cell->light_name, text);
    }
}

bool rows_add(rows *r, const matrix_cell *m, cli_error *error) {
    if (!r->cells++)
        printf(
            "Times are ns a point, processor time (on a GPU wall time); errors are root mean "
            "squares over points\nin penumbra and over all; exact: share of points within 1/512. "
            "*: on the front of time and error.\n\n");
    for (uint32_t i = 0; i < m->count; i++) {
        record row = {.count = 0};
        describe_cell(&row, m);
        describe_way(&row, &m->ways[i]);
        to_csv(&r->csv, &row);
        to_json(&r->json, &row);
    }
    print_cell(m);
    if (!*m->sweep) judge(r, m);
    printf("\n");
    fflush(stdout);
    if (r->csv.failed || r->json.failed) return cli_fail(error, CLI_FAILED, "memory ran out");
    /* Whole files after each cell: a run of many minutes may be stopped. */
    if (r->csv_path && !report_save(&r->csv, r->csv_path, error)) return false;
    if (!r->json_path) return true;
    const size_t length = r->json.length;
    cli_text_printf(&r->json, "\n]\n");
    const bool fine = report_save(&r->json, r->json_path, error);
    r->json.length = length;
    return fine;
}

void rows_conclude(const rows *r) {
    if (!r->must) return;
    printf(
        "auto with an RMS error of at most 1/64: %u of %u on or below the front of all methods and "
        "the peer\n(to %.0f %%); %u of %u on or below that of the library's methods\n",
        r->must - r->beyond, r->must, 100 * (FRONT_NOISE - 1), r->must - r->beyond_ours, r->must);
    fwrite(r->behind.begin, 1, r->behind.length, stdout);
}

void rows_free(rows *r) {
    cli_text_free(&r->csv);
    cli_text_free(&r->json);
    cli_text_free(&r->behind);
}
