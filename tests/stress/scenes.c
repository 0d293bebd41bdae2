/* stress scenes [FIRST [COUNT]]: small random scenes, each made from its number, against the exact
 * area of the union of their triangles. A scene that breaks a bound is made smaller while it still
 * does: one point, no triangle that can go, numbers of few digits; and printed whole. `scenes
 * NUMBER` runs it again.
 *
 * "exact" must hold its bound at every point, "auto" its bound and 0.1, "raytrace" its bound at all
 * but one point in a thousand. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "stress/stress.h"

enum { POINTS = 8, METHODS = 3 };
static const char *const methods[METHODS] = {"exact", "auto", "raytrace"};

/* What a truth may be off by, beside the rounding of answers to floats. */
#define SLACK 2e-5

static softshadow_light random_light(uint64_t *s) {
    const double x = scene_uniform(s, -1, 1), y = scene_uniform(s, -1, 1),
                 z = scene_uniform(s, 2, 9), size = pow(10, scene_uniform(s, -3, .5));
    double d[3];
    scene_direction(s, d);
    switch (scene_random(s) % 4) {
    case 0: return scene_sphere_light(x, y, z, size);
    case 1: return scene_disk_light(x, y, z, d[0], d[1], d[2], size);
    case 2: return scene_rect_light(x, y, z, size, size * scene_uniform(s, .1, 1));
    default: return scene_sun_light(d[0], d[1], -fabs(d[2]) - .2, fmin(size, 1));
    }
}

/* Besides garbage: solids, leaves, slivers, and all of it together. */
static void random_mesh(scene_mesh *mesh, uint64_t *s) {
    const uint64_t kind = scene_random(s) % 8;
    if (kind < 4) scene_garbage(mesh, scene_random(s));
    if (kind == 3 || kind == 4) {
        const double low[3] = {scene_uniform(s, -1, 0), scene_uniform(s, -1, 0), 1},
                     high[3] = {scene_uniform(s, .1, 1), scene_uniform(s, .1, 1),
                                scene_uniform(s, 1.1, 3)};
        scene_box(mesh, low, high);
    }
    if (kind == 5) scene_leaves(mesh, 1 + (unsigned)(scene_random(s) % 20), scene_random(s));
    for (uint64_t i = 0; kind > 5 && i < 1 + scene_random(s) % 8; i++) {
        const double x = scene_uniform(s, -1, 1), y = scene_uniform(s, -1, 1),
                     z = scene_uniform(s, .5, 3), w = pow(10, scene_uniform(s, -7, 0));
        const uint32_t a = scene_vertex(mesh, x, y, z),
                       b = scene_vertex(mesh, x + scene_uniform(s, -1, 1), y + 1, z);
        scene_triangle(mesh, a, b, scene_vertex(mesh, x + w, y + w, z + w));
    }
    if (scene_random(s) % 4 == 0) { /* anywhere, any way up, any size */
        double r[9];
        const double k = pow(2, scene_uniform(s, -3, 3));
        scene_rotation(s, r);
        const double m[12] = {k * r[0], k * r[1], k * r[2], 0, k * r[3], k * r[4], k * r[5], 0,
                              k * r[6], k * r[7], k * r[8], 1};
        scene_transform(mesh, m);
    }
}

static stress_case random_case(uint64_t seed) {
    stress_case one = {.count = POINTS};
    uint64_t s = seed * 2654435761u + 1;
    snprintf(one.sweep, sizeof one.sweep, "scene");
    snprintf(one.cell, sizeof one.cell, "%llu", (unsigned long long)seed);
    one.points = calloc(POINTS, sizeof *one.points);
    one.truth = calloc(POINTS, sizeof *one.truth);
    if (!one.points || !one.truth) abort();
    random_mesh(&one.mesh, &s);
    one.light = random_light(&s);
    for (int i = 0; i < POINTS; i++) {
        for (int k = 0; k < 3; k++) one.points[i][k] = scene_uniform(&s, -2, 2);
        if (i % 2) one.points[i][2] = 0;
    }
    return one;
}

static void find_truth(stress_case *one) {
    for (size_t i = 0; i < one->count; i++)
        one->truth[i] = oracle_union(&one->mesh, &one->light, one->points[i], NULL);
}

static bool refused; /* by find_outside(): the scene as a whole */
static bool shrinks_refused; /* what is being made smaller was: a smaller one must be, too */

/* The first point whose truth is outside the method's bound; the case's count: none is. */
static size_t find_outside(const stress_case *one, const char *method, float *visibility,
                        float *bound) {
    refused = stress_ask(method, one, visibility, bound, STRESS_USUAL) != SOFTSHADOW_OK;
    if (refused) return 0;
    const bool automatic = strcmp(method, "auto") == 0;
    for (size_t i = 0; i < one->count; i++) {
        const double off = fabs(visibility[i] - one->truth[i]);
        if (!(off <= bound[i] + SLACK) || (automatic && off > .1)) return i;
    }
    return one->count;
}

static bool fails(stress_case *one, const char *method) {
    float visibility[POINTS], bound[POINTS];
    find_truth(one);
    return find_outside(one, method, visibility, bound) < one->count && refused == shrinks_refused;
}

static void drop_triangle(scene_mesh *mesh, size_t t) {
    memmove(mesh->indices + 3 * t, mesh->indices + 3 * t + 3,
            (mesh->triangles - t - 1) * 3 * sizeof *mesh->indices);
    mesh->triangles--;
}

/* Only the point that fails: alone it may not, where a batch is answered as a whole. */
static void keep_one_point(stress_case *one, const char *method) {
    float visibility[POINTS], bound[POINTS];
    double points[POINTS][3];
    const size_t i = find_outside(one, method, visibility, bound), count = one->count;
    if (i == count) return;
    memcpy(points, one->points, sizeof points);
    memcpy(one->points[0], points[i], sizeof points[i]);
    one->count = 1;
    if (fails(one, method)) return;
    memcpy(one->points, points, sizeof points);
    one->count = count;
}

/* Takes triangles away as long as what is left fails, too. Returns whether any went. */
static bool drop_triangles(stress_case *one, const char *method) {
    const size_t before = one->mesh.triangles;
    for (size_t t = 0; t < one->mesh.triangles;) {
        scene_mesh whole = scene_copy(&one->mesh);
        drop_triangle(&one->mesh, t);
        if (fails(one, method)) {
            scene_free(&whole);
        } else {
            scene_free(&one->mesh);
            one->mesh = whole;
            t++;
        }
    }
    return one->mesh.triangles < before;
}

/* The fewest decimals with which it still fails. */
static void round_number(stress_case *one, const char *method, double *number) {
    const double kept = *number;
    for (int decimals = 0; decimals < 5; decimals++) {
        const double unit = pow(10, decimals);
        *number = rint(kept * unit) / unit + 0.0; /* no -0 */
        if (*number == kept || fails(one, method)) return;
    }
    *number = kept;
}

static void round_numbers(stress_case *one, const char *method) {
    softshadow_light *l = &one->light;
    double *const of_light[] = {l->position, l->direction, l->u, l->v};
    for (size_t i = 0; i < 3 * one->mesh.triangles; i++) {
        for (int k = 0; k < 3; k++)
            round_number(one, method, &one->mesh.xyz[3 * one->mesh.indices[i] + k]);
    }
    for (int k = 0; k < 3 && one->count == 1; k++) round_number(one, method, &one->points[0][k]);
    for (int k = 0; k < 12; k++) round_number(one, method, &of_light[k / 3][k % 3]);
    round_number(one, method, &l->radius);
}

/* Numbers of few digits may let further triangles go. */
static void shrink(stress_case *one, const char *method) {
    shrinks_refused = refused;
    keep_one_point(one, method);
    do {
        while (drop_triangles(one, method)) {}
        round_numbers(one, method);
    } while (drop_triangles(one, method));
}

static void print_case(stress_case *one, const char *method) {
    float visibility[POINTS], bound[POINTS];
    find_truth(one);
    const size_t i = find_outside(one, method, visibility, bound) % one->count;
    const softshadow_light *l = &one->light;
    printf("scene %s, %s, smallest: V %.9g, truth %.9g, bound %.9g\n", one->cell, method,
           visibility[i], one->truth[i], bound[i]);
    printf("  point %.17g %.17g %.17g\n", one->points[i][0], one->points[i][1], one->points[i][2]);
    printf("  light type %u at %.17g %.17g %.17g direction %.17g %.17g %.17g radius %.17g\n",
           l->type, l->position[0], l->position[1], l->position[2], l->direction[0],
           l->direction[1], l->direction[2], l->radius);
    printf("  u %.17g %.17g %.17g v %.17g %.17g %.17g\n", l->u[0], l->u[1], l->u[2], l->v[0],
           l->v[1], l->v[2]);
    for (size_t t = 0; t < one->mesh.triangles; t++) {
        printf("  triangle");
        for (int v = 0; v < 3; v++) {
            const double *x = one->mesh.xyz + 3 * one->mesh.indices[3 * t + v];
            printf("  %.17g %.17g %.17g", x[0], x[1], x[2]);
        }
        printf("\n");
    }
    fflush(stdout);
}

int main(int argc, char **argv) {
    const uint64_t first = argc > 1 ? strtoull(argv[1], NULL, 10) : 0,
                   count = argc > 2 ? strtoull(argv[2], NULL, 10) : argc > 1 ? 1 : 10000;
    size_t outside[METHODS] = {0};
    double worst[METHODS] = {0}, squares[METHODS] = {0};
    for (uint64_t seed = first; seed < first + count; seed++) {
        stress_case one = random_case(seed);
        float visibility[POINTS], bound[POINTS];
        find_truth(&one);
        for (int m = 0; m < METHODS; m++) {
            const bool bad = find_outside(&one, methods[m], visibility, bound) < one.count;
            for (int i = 0; i < POINTS; i++) {
                const double off = fabs(visibility[i] - one.truth[i]);
                worst[m] = fmax(worst[m], off), squares[m] += off * off;
            }
            outside[m] += bad;
            if (!bad || (strcmp(methods[m], "raytrace") == 0 && count > 1)) continue;
            shrink(&one, methods[m]);
            print_case(&one, methods[m]);
            scene_free(&one.mesh), free(one.points), free(one.truth);
            one = random_case(seed);
            find_truth(&one);
        }
        scene_free(&one.mesh), free(one.points), free(one.truth);
    }
    const double points = (double)(count * POINTS), mean = points / 1000;
    for (int m = 0; m < METHODS; m++)
        printf("%-9s %zu of %llu scenes outside the bound, RMS %.5f, worst %.5f\n", methods[m],
               outside[m], (unsigned long long)count, sqrt(squares[m] / points), worst[m]);
    return outside[0] || outside[1] || (double)outside[2] > mean + 5 * sqrt(mean) + 3;
}
