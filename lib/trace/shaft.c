/* Planes that have a box of points and a light on one side.
 *
 * based on: shaft culling [HW91], with planes found through support functions: for a
 * normal n the plane n . x = max over both bodies is right whatever n is; n is only chosen well. */
#include "trace/shaft.h"

#include "base/vec.h"

/* Float rounding of a sum of three products, each with a rounded coordinate, and some more. */
#define ROUNDING 0x1p-21

/* The two bodies a shaft joins. */
typedef struct bodies {
    const ss_light *light;
    double
        disk; /* radius of the widest facing disk of a sphere, INFINITY if points may be inside */
    double low[3], high[3];
    const double (*points)[3]; /* NULL: all of the box */
    size_t count;
    double extent;
} bodies;

static double point_support(const bodies *b, const double n[3]) {
    double sum = 0, most = -INFINITY;
    if (b->points) {
        for (size_t i = 0; i < b->count; i++) {
            const double height = ss_dot(n, b->points[i]);
            most = height > most ? height : most;
        }
        return most;
    }
    for (int k = 0; k < 3; k++) sum += n[k] * (n[k] > 0 ? b->high[k] : b->low[k]);
    return sum;
}

/* The facing disk of a sphere grows as its point comes nearer. */
static double facing_disk(const ss_light *light, const double low[3], const double high[3]) {
    double gap[3];
    for (int k = 0; k < 3; k++) {
        const double to = light->centre[k];
        gap[k] = to < low[k] ? low[k] - to : to > high[k] ? to - high[k] : 0;
    }
    const double d = ss_length(gap), r = light->radius;
    if (d <= r * (1 + 0x1p-8)) return INFINITY;
    const double sine = r / d;
    return r / sqrt((1 - sine) * (1 + sine));
}

static double support_of(const ss_light *light, double disk, const double n[3]) {
    const double along_u = ss_dot(n, light->u), along_v = ss_dot(n, light->v);
    switch (light->type) {
    case SOFTSHADOW_RECT:
        return ss_dot(n, light->centre) + fabs(along_u) + fabs(along_v);
    case SOFTSHADOW_DISK:
        return ss_dot(n, light->centre) + sqrt(along_u * along_u + along_v * along_v);
    case SOFTSHADOW_SPHERE:
        return ss_dot(n, light->centre) + sqrt(ss_dot(n, n)) * disk;
    default: {
        const double height =
            ss_dot(n, light->normal) + sqrt(along_u * along_u + along_v * along_v);
        return height > 0 ? INFINITY : -INFINITY;
    }
    }
}

double ss_light_support(const ss_light *light, const double low[3], const double high[3],
                        const double n[3]) {
    const double disk = light->type == SOFTSHADOW_SPHERE ? facing_disk(light, low, high) : 0;
    return support_of(light, disk, n);
}

static double light_support(const bodies *b, const double n[3]) {
    return support_of(b->light, b->disk, n);
}

/* Moves n along -axis until the light and the points reach equally far: then the plane touches
 * both. */
static void lean(const bodies *b, const double side[3], const double axis[3], double depth,
                 double n[3]) {
    double s = 0;
    for (int round = 0; round < 3; round++) {
        for (int k = 0; k < 3; k++) n[k] = side[k] - s * axis[k];
        const double gap = light_support(b, n) - point_support(b, n);
        if (!isfinite(gap)) return;
        s += gap / depth;
    }
    for (int k = 0; k < 3; k++) n[k] = side[k] - s * axis[k];
}

static void add_plane(ss_shaft *shaft, const bodies *b, double n[3]) {
    double rounded[3], reach = 0;
    if (!ss_normalize(n)) return;
    for (int k = 0; k < 3; k++) {
        rounded[k] = (float)n[k];
        reach += fabs(rounded[k]) * ss_max(b->extent, ss_max(fabs(b->low[k]), fabs(b->high[k])));
    }
    const double limit = ss_max(point_support(b, rounded), light_support(b, rounded));
    if (!isfinite(limit)) return;
    for (int k = 0; k < 3; k++) shaft->normal[shaft->planes][k] = (float)rounded[k];
    shaft->limit[shaft->planes++] = (float)(limit + ROUNDING * (reach + fabs(limit)));
}

/* ROUNDING is more than a float's, so the conversion stays outside. */
static void add_box(ss_shaft *shaft, const bodies *b) {
    for (int k = 0; k < 3; k++) {
        double n[3] = {0, 0, 0};
        n[k] = 1;
        const double up = ss_max(b->high[k], light_support(b, n));
        n[k] = -1;
        const double down = ss_max(-b->low[k], light_support(b, n));
        shaft->high[k] = (float)(up + ROUNDING * (fabs(up) + 0x1p-100));
        shaft->low[k] = (float)-(down + ROUNDING * (fabs(down) + 0x1p-100));
    }
}

/* The sun's planes need no search: the cone's own sides, opened by more than rounding can close. */
static void lean_sun(const ss_light *light, const double side[3], double n[3]) {
    const double tangent = light->radius * (1 + 0x1p-18) + 0x1p-18;
    for (int k = 0; k < 3; k++) n[k] = side[k] - tangent * light->normal[k];
}

/* Across a rect's edges, so that planes hold them; false if the rect is seen along an edge. */
static bool across_edge(const double axis[3], const double edge[3], double side[3]) {
    double across[3];
    ss_cross(axis, edge, across);
    if (!(ss_length(across) > 0x1p-10 * ss_length(edge)) || !ss_normalize(across)) return false;
    for (int k = 0; k < 3; k++) side[k] = across[k];
    return true;
}

static void make(ss_shaft *shaft, bodies *b) {
    const ss_light *light = b->light;
    const bool sun = light->type == SOFTSHADOW_SUN;
    double axis[3], side[2][3];
    shaft->planes = 0;
    b->disk = light->type == SOFTSHADOW_SPHERE ? facing_disk(light, b->low, b->high) : 0;
    add_box(shaft, b);
    for (int k = 0; k < 3; k++) {
        const double middle = b->low[k] + (b->high[k] - b->low[k]) / 2;
        axis[k] = sun ? light->normal[k] : light->centre[k] - middle;
    }
    const double depth = ss_length(axis);
    if (!ss_normalize(axis)) return;
    ss_basis(axis, side[0], side[1]);
    if (light->type == SOFTSHADOW_RECT && !light->point) {
        across_edge(axis, light->v, side[0]);
        across_edge(axis, light->u, side[1]);
    }
    for (int i = 0; i < 4; i++) {
        double n[3], toward[3];
        for (int k = 0; k < 3; k++) toward[k] = i & 1 ? -side[i / 2][k] : side[i / 2][k];
        if (sun)
            lean_sun(light, toward, n);
        else
            lean(b, toward, axis, depth, n);
        add_plane(shaft, b, n);
    }
    const bool round = sun || light->type == SOFTSHADOW_SPHERE || light->point;
    const double *across = round ? axis : light->normal;
    for (int end = 0; end < 2; end++) {
        double n[3];
        const double sign = (ss_dot(across, axis) > 0) == (end == 0) ? -1 : 1;
        for (int k = 0; k < 3; k++) n[k] = sign * across[k];
        add_plane(shaft, b, n);
    }
}

void ss_shaft_make(ss_shaft *shaft, const ss_light *light, double extent, const double low[3],
                   const double high[3]) {
    bodies b = {.light = light, .extent = extent};
    for (int k = 0; k < 3; k++) b.low[k] = low[k], b.high[k] = high[k];
    make(shaft, &b);
}

void ss_shaft_around(ss_shaft *shaft, const ss_light *light, double extent,
                     const double (*points)[3], size_t count, double low[3], double high[3]) {
    bodies b = {.light = light, .extent = extent, .points = points, .count = count};
    for (int k = 0; k < 3; k++) b.low[k] = INFINITY, b.high[k] = -INFINITY;
    for (size_t i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++) {
            b.low[k] = ss_min(b.low[k], points[i][k]), b.high[k] = ss_max(b.high[k], points[i][k]);
        }
    }
    make(shaft, &b);
    for (int k = 0; k < 3; k++) low[k] = b.low[k], high[k] = b.high[k];
}
