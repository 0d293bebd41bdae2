/* Planes that have a box of points and a light on one side.
 *
 * based on: shaft culling [HW91], with planes found through support functions: for a
 * normal n the plane n . x = max over both bodies is right whatever n is; n is only chosen well. */
#include "trace/shaft.h"

#include "base/vec.h"

/* Float rounding of a sum of three products, each with a rounded coordinate, and some more. */
#define ROUNDING 0x1p-21

static double box_support(const double low[3], const double high[3], const double n[3]) {
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += n[k] * (n[k] > 0 ? high[k] : low[k]);
    return sum;
}

static double nearest(const double low[3], const double high[3], const double to[3]) {
    double gap[3];
    for (int k = 0; k < 3; k++) {
        gap[k] = to[k] < low[k] ? low[k] - to[k] : to[k] > high[k] ? to[k] - high[k] : 0;
    }
    return ss_length(gap);
}

double ss_light_support(const ss_light *light, const double low[3], const double high[3],
                        const double n[3]) {
    const double along_u = ss_dot(n, light->u), along_v = ss_dot(n, light->v);
    switch (light->type) {
    case SOFTSHADOW_RECT: return ss_dot(n, light->centre) + fabs(along_u) + fabs(along_v);
    case SOFTSHADOW_DISK: return ss_dot(n, light->centre) + hypot(along_u, along_v);
    case SOFTSHADOW_SPHERE: {
        /* The facing disk grows as its point comes nearer. */
        const double d = nearest(low, high, light->centre), r = light->radius;
        if (d <= r * (1 + 0x1p-8)) return INFINITY;
        const double sine = r / d;
        return ss_dot(n, light->centre) + ss_length(n) * r / sqrt((1 - sine) * (1 + sine));
    }
    default: {
        const double height = ss_dot(n, light->normal) + hypot(along_u, along_v);
        return height > 0 ? INFINITY : -INFINITY;
    }
    }
}

/* Moves n along -axis until the light and the points reach equally far: then the plane touches both. */
static void lean(const ss_light *light, const double low[3], const double high[3],
                 const double side[3], const double axis[3], double depth, double n[3]) {
    double s = 0;
    for (int round = 0; round < 4; round++) {
        for (int k = 0; k < 3; k++) n[k] = side[k] - s * axis[k];
        const double gap = ss_light_support(light, low, high, n) - box_support(low, high, n);
        if (!isfinite(gap)) return;
        s += gap / depth;
    }
    for (int k = 0; k < 3; k++) n[k] = side[k] - s * axis[k];
}

static void add_plane(ss_shaft *shaft, const ss_light *light, double extent, const double low[3],
                      const double high[3], double n[3]) {
    double rounded[3], reach = 0;
    if (!ss_normalize(n)) return;
    for (int k = 0; k < 3; k++) {
        rounded[k] = (float)n[k];
        reach += fabs(rounded[k]) * fmax(extent, fmax(fabs(low[k]), fabs(high[k])));
    }
    const double limit = fmax(box_support(low, high, rounded),
                              ss_light_support(light, low, high, rounded));
    if (!isfinite(limit)) return;
    for (int k = 0; k < 3; k++) shaft->normal[shaft->planes][k] = (float)rounded[k];
    shaft->limit[shaft->planes++] = (float)(limit + ROUNDING * (reach + fabs(limit)));
}

static void add_box(ss_shaft *shaft, const ss_light *light, const double low[3],
                    const double high[3]) {
    for (int k = 0; k < 3; k++) {
        double n[3] = {0, 0, 0};
        n[k] = 1;
        const double up = fmax(high[k], ss_light_support(light, low, high, n));
        n[k] = -1;
        const double down = fmax(-low[k], ss_light_support(light, low, high, n));
        shaft->high[k] = nextafterf((float)(up + ROUNDING * fabs(up)), INFINITY);
        shaft->low[k] = nextafterf((float)-(down + ROUNDING * fabs(down)), -INFINITY);
    }
}

/* The sun's planes need no search: the cone's own sides, opened by more than rounding can close. */
static void lean_sun(const ss_light *light, const double side[3], double n[3]) {
    const double tangent = light->radius * (1 + 0x1p-18) + 0x1p-18;
    for (int k = 0; k < 3; k++) n[k] = side[k] - tangent * light->normal[k];
}

void ss_shaft_make(ss_shaft *shaft, const ss_light *light, double extent, const double low[3],
                   const double high[3]) {
    const bool sun = light->type == SOFTSHADOW_SUN;
    double middle[3], axis[3], side[2][3];
    shaft->planes = 0;
    add_box(shaft, light, low, high);
    for (int k = 0; k < 3; k++) middle[k] = low[k] + (high[k] - low[k]) / 2;
    for (int k = 0; k < 3; k++) axis[k] = sun ? light->normal[k] : light->centre[k] - middle[k];
    const double depth = ss_length(axis);
    if (!ss_normalize(axis)) return;
    ss_basis(axis, side[0], side[1]);
    if (light->type == SOFTSHADOW_RECT && !light->point) {
        /* Perpendicular to one edge of the light, so that the plane holds that edge. */
        for (int i = 0; i < 2; i++) {
            const double *edge = i ? light->u : light->v;
            double across[3];
            ss_cross(axis, edge, across);
            if (ss_length(across) > 0x1p-10 * ss_length(edge)) {
                ss_normalize(across);
                for (int k = 0; k < 3; k++) side[i][k] = across[k];
            }
        }
    }
    for (int i = 0; i < 4; i++) {
        double n[3], toward[3];
        for (int k = 0; k < 3; k++) toward[k] = i & 1 ? -side[i / 2][k] : side[i / 2][k];
        if (sun) lean_sun(light, toward, n);
        else lean(light, low, high, toward, axis, depth, n);
        add_plane(shaft, light, extent, low, high, n);
    }
    for (int end = 0; end < 2; end++) {
        double n[3];
        const double *across = sun || light->type == SOFTSHADOW_SPHERE || light->point ? axis : light->normal;
        const double sign = (ss_dot(across, axis) > 0) == (end == 0) ? -1 : 1;
        for (int k = 0; k < 3; k++) n[k] = sign * across[k];
        add_plane(shaft, light, extent, low, high, n);
    }
}
