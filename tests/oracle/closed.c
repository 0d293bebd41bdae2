/* How a point sees a light, and the closed forms; based on design/techniques.md and accuracy.md. */
#include <math.h>
#include <string.h>

#include "oracle/oracle.h"

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(double out[3], const double a[3], const double b[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Two half axes of length r, perpendicular to the unit vector n. */
static void axes(oracle_view *view, const double n[3], double r) {
    const double other[3] = {fabs(n[0]) < 0.6, fabs(n[0]) >= 0.6, 0};
    double a[3], b[3];
    cross(a, n, other);
    const double length = sqrt(dot(a, a));
    for (int k = 0; k < 3; k++) a[k] /= length;
    cross(b, n, a);
    for (int k = 0; k < 3; k++) view->a[k] = r * a[k], view->b[k] = r * b[k];
}

static void see_sphere(oracle_view *view, const softshadow_light *light) {
    const double d2 = dot(view->c, view->c), r = light->radius, d = sqrt(d2);
    view->inside = d <= r * (1 + 0x1p-10);
    if (view->inside) return;
    for (int k = 0; k < 3; k++) view->normal[k] = -view->c[k] / d;
    axes(view, view->normal, r * d / sqrt(d2 - r * r));
    view->t_end = 1 - r * r / d2;
}

static void see_sun(oracle_view *view, const softshadow_light *light) {
    const double length = sqrt(dot(light->direction, light->direction));
    for (int k = 0; k < 3; k++) {
        view->normal[k] = light->direction[k] / length;
        view->c[k] = -view->normal[k];
    }
    axes(view, view->normal, tan(light->radius));
    view->t_end = INFINITY;
}

static void see_axes(oracle_view *view, const softshadow_light *light) {
    cross(view->normal, light->u, light->v);
    const double length = sqrt(dot(view->normal, view->normal));
    for (int k = 0; k < 3; k++) view->normal[k] /= length;
    memcpy(view->a, light->u, sizeof view->a);
    memcpy(view->b, light->v, sizeof view->b);
}

oracle_view oracle_see(const softshadow_light *light, const double p[3]) {
    oracle_view view = {.t_end = 1, .disk = light->type != SOFTSHADOW_RECT};
    for (int k = 0; k < 3; k++) view.c[k] = light->position[k] - p[k];
    switch (light->type) {
    case SOFTSHADOW_SPHERE:
        see_sphere(&view, light);
        break;
    case SOFTSHADOW_SUN:
        see_sun(&view, light);
        break;
    case SOFTSHADOW_DISK: {
        if (light->radius == 0) { /* an ellipse */
            see_axes(&view, light);
            break;
        }
        const double length = sqrt(dot(light->direction, light->direction));
        for (int k = 0; k < 3; k++) view.normal[k] = light->direction[k] / length;
        axes(&view, view.normal, light->radius);
        break;
    }
    default:
        see_axes(&view, light);
    }
    return view;
}

double oracle_edge(double t) {
    if (t <= -1) return 0;
    if (t >= 1) return 1;
    return 0.5 + (t * sqrt(1 - t * t) + asin(t)) / SCENE_PI;
}

double oracle_limb(double rho, double u1, double u2) {
    const double mu = sqrt(fmax(0, 1 - rho * rho));
    return 1 - u1 * (1 - mu) - u2 * (1 - mu) * (1 - mu);
}

double oracle_limb_edge(double t, double u1, double u2) {
    double F[2];
    const double x[2] = {fmin(1, fmax(-1, t)), -1};
    for (int i = 0; i < 2; i++) {
        const double h = sqrt(1 - x[i] * x[i]), x2 = x[i] * x[i];
        F[i] = (1 - u1 - u2) * (x[i] * h + asin(x[i])) +
               (u1 + 2 * u2) * (SCENE_PI / 2) * (x[i] - x[i] * x2 / 3) -
               4.0 / 3 * u2 * (x[i] * h * (5 - 2 * x2) / 8 + 3.0 / 8 * asin(x[i]));
    }
    return (F[0] - F[1]) / (SCENE_PI * (1 - u1 / 3 - u2 / 6));
}

double oracle_disks(double a, double b, double c) {
    if (c >= a + b) return 1;
    if (c <= b - a) return 0;
    if (c <= a - b) return 1 - b * b / (a * a);
    const double x = (c * c + a * a - b * b) / (2 * c), y = sqrt(fmax(0, a * a - x * x));
    const double A = a * a * acos(x / a) + b * b * acos((c - x) / b) - c * y;
    return 1 - A / (SCENE_PI * a * a);
}

double oracle_caps(double alpha, double beta, double theta) {
    if (theta >= alpha + beta) return 1;
    const double sa = sin(alpha / 2), sb = sin(beta / 2);
    if (theta <= beta - alpha) return 0;
    if (theta <= alpha - beta) return 1 - sb * sb / (sa * sa);
    const double s = (alpha + beta + theta) / 2;
    const double corner = sin(s - theta) / sin(theta);
    const double phi1 = 2 * asin(sqrt(fmin(1, sin(s - alpha) * corner / sin(alpha))));
    const double phi2 = 2 * asin(sqrt(fmin(1, sin(s - beta) * corner / sin(beta))));
    const double E =
        4 *
        atan(sqrt(tan(s / 2) * tan((s - alpha) / 2) * tan((s - beta) / 2) * tan((s - theta) / 2)));
    const double A = 4 * phi1 * sa * sa + 4 * phi2 * sb * sb - 2 * E;
    return 1 - A / (4 * SCENE_PI * sa * sa);
}

double oracle_overlap(double a0, double a1) { return fmax(0, fmin(1, a1) - fmax(-1, a0)) / 2; }

/* Where the segment from p through q meets the light's plane, in (s, t). */
static void project(const oracle_view *view, const double p[3], const double q[3], double st[2]) {
    const double d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
    double n[3], rest[3];
    cross(n, view->a, view->b);
    const double w = dot(n, view->c) / dot(n, d);
    for (int k = 0; k < 3; k++) rest[k] = w * d[k] - view->c[k];
    st[0] = dot(rest, view->a) / dot(view->a, view->a);
    st[1] = dot(rest, view->b) / dot(view->b, view->b);
}

double oracle_edge_before(const oracle_view *view, const double p[3], const double q0[3],
                          const double q1[3], const double seen[3]) {
    double a[2], b[2], c[2];
    project(view, p, q0, a);
    project(view, p, q1, b);
    project(view, p, seen, c);
    const double n[2] = {b[1] - a[1], a[0] - b[0]};
    const double length = sqrt(n[0] * n[0] + n[1] * n[1]);
    const double centre = -(n[0] * a[0] + n[1] * a[1]) / length;
    const double side = n[0] * (c[0] - a[0]) + n[1] * (c[1] - a[1]);
    return oracle_edge(side > 0 ? centre : -centre);
}

double oracle_polygon_irradiance(const double (*v)[3], size_t n, const double normal[3]) {
    double sum = 0;
    for (size_t i = 0; i < n; i++) {
        double gamma[3];
        const double *a = v[i], *b = v[(i + 1) % n];
        cross(gamma, a, b);
        const double length = sqrt(dot(gamma, gamma));
        if (length == 0) continue;
        sum += atan2(length, dot(a, b)) * dot(normal, gamma) / length;
    }
    return fabs(sum) / (2 * SCENE_PI);
}
