/* What the tests of the map techniques share: scenes, places to ask from, and comparisons. */
#ifndef TESTS_PROPERTY_MAPS_H
#define TESTS_PROPERTY_MAPS_H

#include "ask.h"
#include "oracle/oracle.h"

/* ---- Scenes ---------------------------------------------------------------------------------*/

/* A lumpy ball over the ground. */
static inline scene_mesh maps_body(void) {
    scene_mesh mesh = {0};
    const double centre[3] = {0, 0, 1};
    scene_icosphere(&mesh, centre, .6, 3, .3);
    return mesh;
}

/* A half plane at z = 1 that ends at x = 0. */
static inline scene_mesh maps_half_plane(void) {
    scene_mesh mesh = {0};
    scene_rect(&mesh, -3, 0, -3, 3, 1);
    return mesh;
}

static inline void maps_move(scene_mesh *mesh, double x, double y, double z) {
    const double matrix[12] = {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z};
    scene_transform(mesh, matrix);
}

/* ---- Places to ask from ---------------------------------------------------------------------*/

/* side x side points of the ground, |x|, |y| <= half, which are the bounds, too. The points are the
 * same ones for all questions of a program. */
static inline ask maps_over_ground(const char *method, const scene_mesh *mesh,
                                   softshadow_light light, size_t side, double half,
                                   uint32_t resolution) {
    enum { MOST = 128 };
    static double points[MOST * MOST][3], bounds[6];
    CHECK(side <= MOST && (bounds[3] == 0 || bounds[3] == half), "one ground a program");
    scene_grid(points, side, -half, half, -half, half, 0);
    memcpy(bounds, (double[6]){-half, -half, 0, half, half, 0}, sizeof bounds);
    ask q = ask_new(method, mesh, light, (const double(*)[3])points, side * side, 0);
    q.build.resolution = resolution, q.build.bounds = bounds;
    return q;
}

/* Where the i-th of count points on a line across an edge lies, in half widths of its penumbra. */
static inline double maps_t(size_t i, size_t count) {
    return -1.5 + 3 * (double)i / (double)(count - 1);
}

/* Points at z = 0 across the edge of the half plane, y half widths along it. */
static inline ask maps_across(const char *method, const scene_mesh *mesh, softshadow_light light,
                              double half, double y, size_t count) {
    enum { MOST = 2001 };
    static double line[MOST][3], bounds[6];
    CHECK(count <= MOST, "%zu points", count);
    for (size_t i = 0; i < count; i++)
        line[i][0] = maps_t(i, count) * half, line[i][1] = y * half, line[i][2] = 0;
    memcpy(bounds, (double[6]){-1.5 * half, -half, 0, 1.5 * half, half, 0}, sizeof bounds);
    ask q = ask_new(method, mesh, light, (const double(*)[3])line, count, 0);
    q.build.resolution = 1024, q.build.bounds = bounds;
    return q;
}

/* A random point of a random triangle, and that triangle's normal (any length; may be NULL). */
static inline void maps_on_surface(const scene_mesh *mesh, uint64_t *seed, double point[3],
                                   float *normal) {
    const uint32_t *c = &mesh->indices[3 * (scene_random(seed) % mesh->triangles)];
    double u = scene_uniform(seed, 0, 1), v = scene_uniform(seed, 0, 1), e[2][3];
    if (u + v > 1) u = 1 - u, v = 1 - v;
    for (int k = 0; k < 3; k++) {
        const double *xyz = mesh->xyz + k;
        e[0][k] = xyz[3 * c[1]] - xyz[3 * c[0]], e[1][k] = xyz[3 * c[2]] - xyz[3 * c[0]];
        point[k] = xyz[3 * c[0]] + u * e[0][k] + v * e[1][k];
    }
    for (int k = 0; normal && k < 3; k++) {
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        normal[k] = (float)(e[0][a] * e[1][b] - e[0][b] * e[1][a]);
    }
}

/* A ball, points on it, and the cosines of the angles under which they see `to`: acne shows on the
 * side that is lit, leaks on the other. */
enum { MAPS_BALL = 4000 };
typedef struct maps_ball {
    scene_mesh mesh;
    double points[MAPS_BALL][3], cosine[MAPS_BALL];
    float normals[MAPS_BALL][3];
} maps_ball;

static inline void maps_ball_make(maps_ball *ball, const double to[3]) {
    const double centre[3] = {0, 0, 1};
    uint64_t seed = 3;
    ball->mesh = (scene_mesh){0};
    scene_icosphere(&ball->mesh, centre, .6, 4, 0);
    for (int i = 0; i < MAPS_BALL; i++) {
        const float *n = ball->normals[i];
        double dot = 0, nn = 0, ll = 0;
        maps_on_surface(&ball->mesh, &seed, ball->points[i], ball->normals[i]);
        for (int k = 0; k < 3; k++) {
            const double l = to[k] - ball->points[i][k];
            dot += l * n[k], nn += n[k] * n[k], ll += l * l;
        }
        ball->cosine[i] = dot / sqrt(nn * ll);
    }
}

/* ---- Comparisons ----------------------------------------------------------------------------*/

static inline double maps_rms(const ask *a, const ask *b) {
    double sum = 0;
    for (size_t i = 0; i < a->count; i++) {
        const double d = a->visibility[i] - b->visibility[i];
        sum += d * d;
    }
    return sqrt(sum / (double)a->count);
}

static inline void maps_in_range(const ask *q) {
    for (size_t i = 0; i < q->count; i++)
        CHECK(q->visibility[i] >= 0 && q->visibility[i] <= 1, "%s: point %zu: %g", q->method, i,
              (double)q->visibility[i]);
}

/* How many points see less than `most` of the light, or nothing. */
static inline size_t maps_dark(const ask *q, double most) {
    size_t n = 0;
    for (size_t i = 0; i < q->count; i++) n += q->visibility[i] <= most;
    return n;
}

#endif
