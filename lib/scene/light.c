/* Lights as a point sees them. Measures and shapes: design of the public header,
 * softshadow_light. */
#include "scene/light.h"

#include "base/vec.h"

void ss_basis(const double n[3], double a[3], double b[3]) {
    /* The axes along which n is smallest and second smallest are the best conditioned. */
    int least = 0, most = 0;
    for (int k = 1; k < 3; k++) {
        if (fabs(n[k]) < fabs(n[least])) least = k;
        if (fabs(n[k]) >= fabs(n[most])) most = k;
    }
    const int middle = 3 - least - most;
    for (int k = 0; k < 3; k++) a[k] = (k == least) - n[least] * n[k];
    ss_normalize(a);
    for (int k = 0; k < 3; k++) b[k] = (k == middle) - n[middle] * n[k] - a[middle] * a[k];
    ss_normalize(b);
}

static void scale(double vector[3], double factor) {
    for (int k = 0; k < 3; k++) vector[k] *= factor;
}

/* The circle where the tangent cone touches the lamp is seen as a disk through its centre. */
static void view_sphere(const ss_light *light, ss_view *view) {
    double axis[3] = {view->centre[0], view->centre[1], view->centre[2]};
    const double distance = ss_length(axis);
    view->inside = !light->point && distance <= light->radius * SS_LIGHT_INSIDE;
    if (view->inside || !ss_normalize(axis)) {
        view->inside = true;
        return;
    }
    const double sine = light->radius / distance;
    ss_basis(axis, view->a, view->b);
    scale(view->a, light->radius / sqrt((1 - sine) * (1 + sine)));
    scale(view->b, light->radius / sqrt((1 - sine) * (1 + sine)));
    for (int k = 0; k < 3; k++) view->normal[k] = -axis[k];
    view->t_end = (1 - sine) * (1 + sine);
}

void ss_light_view(const ss_light *light, const double p[3], ss_view *view) {
    *view = (ss_view){.t_end = 1, .disk = light->type != SOFTSHADOW_RECT};
    for (int k = 0; k < 3; k++) {
        const bool sun = light->type == SOFTSHADOW_SUN;
        view->centre[k] = sun ? light->normal[k] : light->centre[k] - p[k];
        view->normal[k] = sun ? -light->normal[k] : light->normal[k];
        view->a[k] = light->u[k], view->b[k] = light->v[k];
    }
    if (light->type == SOFTSHADOW_SUN) {
        view->t_end = INFINITY;
    } else if (light->type == SOFTSHADOW_SPHERE) {
        view_sphere(light, view);
    } else {
        const double height = ss_dot(view->normal, view->centre);
        view->edge_on =
            !light->point &&
            fabs(height) <= SS_LIGHT_EDGE_ON * (ss_length(view->centre) + light->radius);
    }
}

bool ss_light_above(const ss_light *light, const double p[3], const float normal[3]) {
    double height = 0, square = 0, reach = light->radius;
    const bool sun = light->type == SOFTSHADOW_SUN;
    for (int k = 0; k < 3; k++) {
        const double to = sun ? light->normal[k] : light->centre[k] - p[k];
        height += normal[k] * to, square += to * to;
    }
    const double size = sqrt(square);
    /* A sphere's tangent cone is above the horizon when the sphere is; a sun's disk reaches
     * tan(angle) sin(theta) along the normal. Floats of a unit normal are unit to 2^-22. */
    if (sun) reach *= sqrt(fmax(0, 1 - height * height));
    return height > reach * (1 + 0x1p-20) + size * 0x1p-20;
}

double ss_light_profile(const ss_light *light, double rho) {
    if (light->profile_count == 0) return 1;
    if (light->profile_count == 1) return light->profile[0];
    const double at = fmin(fmax(rho, 0), 1) * (light->profile_count - 1);
    uint32_t i = (uint32_t)at;
    if (i > light->profile_count - 2) i = light->profile_count - 2;
    const double share = at - i;
    return (1 - share) * light->profile[i] + share * light->profile[i + 1];
}

double ss_light_weight(const ss_light *light, const ss_view *view, uint32_t weighting,
                       const double *normal, double s, double t) {
    const double profile = view->disk ? ss_light_profile(light, sqrt(s * s + t * t)) : 1;
    if (weighting == SOFTSHADOW_UNIFORM) return profile;
    double to[3];
    for (int k = 0; k < 3; k++) to[k] = view->centre[k] + s * view->a[k] + t * view->b[k];
    const double length = ss_length(to);
    if (!ss_normalize(to)) return 0;
    const double facing = -ss_dot(view->normal, to); /* > 0: on the emitting side */
    const bool directionless = light->point && ss_dot(view->normal, view->normal) == 0;
    const double tilt = directionless ? 1 : facing;
    /* d(omega) = cos(theta at the light) dA / r^2; lengths in units of the centre's distance, so
     * that nothing overflows: only ratios of weights count. */
    const double unit = ss_length(view->centre);
    const double reach = unit > 0 ? length / unit : length;
    if (!(reach > 0)) return 0;
    const double solid = fabs(tilt) / (reach * reach);
    if (weighting == SOFTSHADOW_SOLID_ANGLE) return profile * solid;
    const double above = normal ? ss_dot(normal, to) : 1;
    return tilt > 0 && above > 0 ? profile * solid * above : 0;
}

void ss_light_box(const ss_light *light, double low[3], double high[3]) {
    for (int k = 0; k < 3; k++) {
        double reach = fabs(light->u[k]) + fabs(light->v[k]);
        if (light->type == SOFTSHADOW_SPHERE) reach = light->radius;
        if (light->type == SOFTSHADOW_SUN) reach = INFINITY;
        const double centre = light->type == SOFTSHADOW_SUN ? 0 : light->centre[k];
        low[k] = centre - reach, high[k] = centre + reach;
    }
    /* The sun is infinitely far along every axis; along one it is never inside a scene. */
    if (light->type == SOFTSHADOW_SUN) low[0] = high[0] = INFINITY;
}
