/* Every triangle against every sample of the light, in double. Slow, and nothing to get wrong. */
#include <math.h>
#include <stdlib.h>

#include "oracle/oracle.h"

typedef struct segment {
    double d[3], weight;
} segment;

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double det(const double a[3], const double b[3], const double c[3]) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/* Signed volumes: the segment passes the triangle where all three have one sign. */
static bool hits(double v[3][3], const double d[3], double t_end) {
    const double a = det(d, v[0], v[1]), b = det(d, v[1], v[2]), c = det(d, v[2], v[0]);
    if (!((a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0))) return false;
    const double sum = a + b + c;
    if (sum == 0) return false;
    const double t = det(v[0], v[1], v[2]) / sum; /* d t = barycentric sum of the corners */
    return t > 0 && t < t_end;
}

static double profile_at(const softshadow_light *light, double rho) {
    if (!light->profile) return 1;
    const double x = fmin(1, rho) * (light->profile_count - 1);
    const uint32_t i = (uint32_t)fmin(floor(x), light->profile_count - 2.0);
    return light->profile[i] + (x - i) * (light->profile[i + 1] - light->profile[i]);
}

static double weight_of(const softshadow_light *light, const oracle_view *view, const double d[3],
                        const double normal[3], uint32_t weighting, double rho) {
    const double weight = profile_at(light, rho);
    if (weighting == SOFTSHADOW_UNIFORM) return weight;
    const double length = sqrt(dot(d, d)), towards = -dot(view->normal, d) / length;
    const double at_light = light->type == SOFTSHADOW_RECT || light->type == SOFTSHADOW_DISK
                                ? (weighting == SOFTSHADOW_IRRADIANCE ? towards : fabs(towards))
                                : towards;
    if (at_light <= 0) return 0;
    const double omega = weight * at_light / (length * length);
    if (weighting == SOFTSHADOW_SOLID_ANGLE) return omega;
    const double cosine = dot(normal, d) / (length * sqrt(dot(normal, normal)));
    return cosine > 0 ? omega * cosine : 0;
}

/* A grid on the square, or rings of equal area with about as many cells on the disk. */
static size_t make_segments(segment *out, const softshadow_light *light, const oracle_view *view,
                            const double normal[3], uint32_t weighting, unsigned side) {
    for (size_t i = 0; i < (size_t)side * side; i++) {
        const double x = ((double)(i % side) + 0.5) / side, y = ((double)(i / side) + 0.5) / side;
        double s = 2 * x - 1, t = 2 * y - 1;
        if (view->disk) {
            /* Every ring is turned by the golden angle: no direction is preferred. */
            const double turn = 2 * SCENE_PI * (x + 0.6180339887498949 * (double)(i / side));
            s = sqrt(y) * cos(turn), t = sqrt(y) * sin(turn);
        }
        for (int k = 0; k < 3; k++) out[i].d[k] = view->c[k] + s * view->a[k] + t * view->b[k];
        out[i].weight = weight_of(light, view, out[i].d, normal, weighting, sqrt(s * s + t * t));
    }
    return (size_t)side * side;
}

double oracle_brute(const scene_mesh *mesh, const softshadow_light *light, const double p[3],
                    const double normal[3], uint32_t weighting, unsigned samples) {
    const oracle_view view = oracle_see(light, p);
    if (view.inside) return 1;
    const unsigned side = (unsigned)ceil(sqrt(samples));
    segment *segments = malloc((size_t)side * side * sizeof *segments);
    double(*corners)[3][3] = malloc((mesh->triangles + 1) * sizeof *corners);
    if (!segments || !corners) abort();
    const size_t n = make_segments(segments, light, &view, normal, weighting, side);
    for (size_t i = 0; i < 9 * mesh->triangles; i++) {
        corners[i / 9][i / 3 % 3][i % 3] =
            mesh->xyz[3 * (size_t)mesh->indices[i / 3] + i % 3] - p[i % 3];
    }
    double seen = 0, whole = 0;
    for (size_t i = 0; i < n; i++) {
        bool hidden = normal && dot(normal, segments[i].d) <= 0;
        for (size_t k = 0; k < mesh->triangles && !hidden; k++) {
            hidden = hits(corners[k], segments[i].d, view.t_end);
        }
        whole += segments[i].weight;
        if (!hidden) seen += segments[i].weight;
    }
    free(segments);
    free(corners);
    return whole > 0 ? seen / whole : 0;
}
