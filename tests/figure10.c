/* The paper shows its scene and gives no numbers: one corner touches the ground, one is slightly
 * raised, one far. Corners and sun were fixed by what needs no soft method: hard exact 33.5, 16
 * random samples 12.0, and the hard map's own column 45.5, 39.3, 35.1, 34.2. depth_bias is set: the
 * ground casts nothing, so nothing shadows itself, and a corner that touches it should not come
 * loose. */
#include "figure10.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { N = FIGURE10_SIDE * FIGURE10_SIDE, WHY = 512 };

static const double corners[3][3] = {{.925, .8125, 0}, {.0375, .8, .1}, {.675, .25, .475}};
static const double sun_angle = .28849;

static const figure10_row printed[FIGURE10_PRINTED] = {
    {"penumbra-limit", FIGURE10_ALL, true, {11.3, 9.0, 9.2, 8.8}, {0}},
    {"smoothie", FIGURE10_OUTER, true, {24.7, 17.8, 16.4, 15.3}, {0}},
    {"single-sample", FIGURE10_INNER, true, {37.2, 23.0, 15.6, 10.9}, {0}},
    {"pcf", FIGURE10_ALL, true, {25.7, 26.8, 28.5, 30.3}, {0}},
    {"hard", FIGURE10_ALL, true, {45.5, 39.3, 35.1, 34.2}, {0}}};

typedef struct scene {
    softshadow *handle;
    double (*points)[3];
    float *truth, *part, *answer; /* N each */
} scene;

static char why[WHY];

/* Asks one method; side 0: without a map, as exactly as can be. */
static bool answer(scene *s, const char *method, double angle, uint32_t side, float *out) {
    static const double bounds[6] = {0, 0, 0, 1, 1, 0};
    const softshadow_light sun = scene_sun_light(0, 0, -1, angle);
    softshadow_build build = SOFTSHADOW_BUILD_INIT;
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    build.method = method;
    build.samples = side ? 0 : 2048;
    build.resolution = side;
    if (side) build.bounds = bounds, build.depth_bias = 1e-6;
    points.position_type = SOFTSHADOW_F64;
    points.positions = s->points, points.count = N;
    if (softshadow_set_light(s->handle, &sun) == SOFTSHADOW_OK &&
        softshadow_build_maps(s->handle, &build) == SOFTSHADOW_OK &&
        softshadow_query_visibility(s->handle, &points, out) == SOFTSHADOW_OK)
        return true;
    snprintf(why, sizeof why, "%s: %s", method, softshadow_last_message(s->handle));
    return false;
}

static float part_of(float v, figure10_part part) {
    if (part == FIGURE10_OUTER) return v > .5f ? 2 * v - 1 : 0;
    if (part == FIGURE10_INNER) return v < .5f ? 2 * v : 1;
    return v;
}

static double rms(const float *a, const float *truth) {
    double sum = 0;
    for (int i = 0; i < N; i++) sum += ((double)a[i] - truth[i]) * ((double)a[i] - truth[i]);
    return 255 * sqrt(sum / N);
}

/* What so many independent samples a point are expected to be off by. */
static double random_samples(const float *truth, int samples) {
    double sum = 0;
    for (int i = 0; i < N; i++) sum += (double)truth[i] * (1 - (double)truth[i]) / samples;
    return 255 * sqrt(sum / N);
}

static bool measure_row(scene *s, figure10_row *row, figure10_show *show, void *ctx) {
    for (int i = 0; i < N; i++) s->part[i] = part_of(s->truth[i], row->part);
    for (int i = 0; i < FIGURE10_SIDES; i++) {
        if (!answer(s, row->method, sun_angle, 16u << i, s->answer)) return false;
        row->ours[i] = rms(s->answer, s->part);
        if (show && !show(ctx, row, 16u << i, s->answer, s->part)) return false;
    }
    return true;
}

/* Every method without an error bound works from a map. Outer penumbrae are told by their notes. */
static void list_rows(figure10 *out) {
    uint32_t count = 0;
    memcpy(out->rows, printed, sizeof printed);
    out->row_count = FIGURE10_PRINTED;
    softshadow_method_count(&count);
    for (uint32_t i = 0; i < count && out->row_count < FIGURE10_ROWS; i++) {
        softshadow_method method = SOFTSHADOW_METHOD_INIT;
        bool known = false;
        if (softshadow_method_info(i, &method) != SOFTSHADOW_OK) continue;
        for (size_t k = 0; k < FIGURE10_PRINTED; k++)
            known |= strcmp(printed[k].method, method.name) == 0;
        if (known || method.bound_kind != SOFTSHADOW_BOUND_NONE) continue;
        const bool outer = strstr(method.notes, "Outer penumbra only") != NULL;
        out->rows[out->row_count++] =
            (figure10_row){.method = method.name, .part = outer ? FIGURE10_OUTER : FIGURE10_ALL};
    }
}

static bool measure(scene *s, figure10 *out, figure10_show *show, void *ctx) {
    const uint32_t indices[3] = {0, 1, 2};
    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    mesh.position_type = SOFTSHADOW_F64;
    mesh.positions = corners, mesh.vertex_count = 3;
    mesh.indices = indices, mesh.triangle_count = 1;
    if (softshadow_add_mesh(s->handle, &mesh, NULL) != SOFTSHADOW_OK) return false;
    if (!answer(s, "exact", 0, 0, s->answer) || !answer(s, "exact", sun_angle, 0, s->truth))
        return false;
    out->hard_exact = rms(s->answer, s->truth), out->sixteen = random_samples(s->truth, 16);
    if (show && !show(ctx, NULL, 0, s->truth, s->truth)) return false;
    list_rows(out);
    for (uint32_t r = 0; r < out->row_count; r++)
        if (!measure_row(s, &out->rows[r], show, ctx)) return false;
    return true;
}

const char *figure10_measure(figure10 *out, figure10_show *show, void *ctx) {
    scene s = {.points = malloc(N * sizeof *s.points),
               .truth = malloc(3 * N * sizeof(float))};
    bool fine = false;
    *out = (figure10){0};
    snprintf(why, sizeof why, "memory ran out");
    if (s.points && s.truth && softshadow_create(&s.handle, NULL) == SOFTSHADOW_OK) {
        s.part = s.truth + N, s.answer = s.part + N;
        scene_grid(s.points, FIGURE10_SIDE, 0, 1, 0, 1, 0);
        fine = measure(&s, out, show, ctx);
    }
    softshadow_destroy(s.handle);
    free(s.points);
    free(s.truth);
    return fine ? NULL : why;
}
