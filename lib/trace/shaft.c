/* Planes that have a box of points and a light on one side.
 *
 * based on: shaft culling [HW91], with planes found through support functions: for a
 * normal n the plane n . x = max over both bodies is right whatever n is; n is only chosen well. */
#include "trace/shaft.h"

#include "base/vec.h"

/* Float rounding of a sum of three products, each with a rounded coordinate, and some more. */
#define ROUNDING 0x1p-21

/* The two bodies a shaft joins, and how large coordinates can be along each axis. */
typedef struct bodies {
    const ss_light *light;
    double disk; /* INFINITY if points may be inside the sphere */
    const double *low, *high;
    const double *const *at; /* NULL: all of the box */
    size_t count;
    double size[3];
} bodies;

/* Plain sums: what a shaft lets through never shows in an answer. */
static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double box_support(const bodies *b, const double n[3]) {
    double sum = 0;
    for (int k = 0; k < 3; k++) sum += n[k] * (n[k] > 0 ? b->high[k] : b->low[k]);
    return sum;
}

static double point_support(const bodies *b, const double n[3]) {
    if (!b->at) return box_support(b, n);
    const double *x = b->at[0], *y = b->at[1], *z = b->at[2];
    double most[4] = {-INFINITY, -INFINITY, -INFINITY, -INFINITY};
    size_t i = 0;
    for (; i + 4 <= b->count; i += 4) {
        for (size_t j = 0; j < 4; j++) {
            const double height = n[0] * x[i + j] + n[1] * y[i + j] + n[2] * z[i + j];
            most[j] = height > most[j] ? height : most[j];
        }
    }
    for (; i < b->count; i++) {
        const double height = n[0] * x[i] + n[1] * y[i] + n[2] * z[i];
        most[0] = height > most[0] ? height : most[0];
    }
    return ss_max(ss_max(most[0], most[1]), ss_max(most[2], most[3]));
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
    if (light->type == SOFTSHADOW_SPHERE) return dot(n, light->centre) + sqrt(dot(n, n)) * disk;
    const double along_u = dot(n, light->u), along_v = dot(n, light->v);
    switch (light->type) {
    case SOFTSHADOW_RECT:
        return dot(n, light->centre) + fabs(along_u) + fabs(along_v);
    case SOFTSHADOW_DISK:
        return dot(n, light->centre) + sqrt(along_u * along_u + along_v * along_v);
    default: {
        const double height = dot(n, light->normal) + sqrt(along_u * along_u + along_v * along_v);
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

/* Moves n along -axis until the light and the box reach nearly equally far: then the plane nearly
 * touches both. */
static void lean(const bodies *b, const ss_shaft_frame *f, const double side[3], double n[3]) {
    double s = 0;
    for (int round = 0; round < 2; round++) {
        for (int k = 0; k < 3; k++) n[k] = side[k] - s * f->axis[k];
        const double gap = light_support(b, n) - box_support(b, n);
        if (!isfinite(gap)) return;
        s += gap / f->depth;
    }
    for (int k = 0; k < 3; k++) n[k] = side[k] - s * f->axis[k];
}

static void add_plane(ss_shaft *shaft, const bodies *b, const double n[3]) {
    double rounded[3], reach = 0;
    for (int k = 0; k < 3; k++) {
        rounded[k] = (float)n[k];
        reach += fabs(rounded[k]) * b->size[k];
    }
    const double limit = ss_max(point_support(b, rounded), light_support(b, rounded));
    if (!isfinite(limit) || !isfinite(reach)) return;
    for (int k = 0; k < 3; k++) shaft->normal[shaft->planes][k] = (float)rounded[k];
    shaft->limit[shaft->planes++] = (float)(limit + ROUNDING * (reach + fabs(limit)));
}

/* ROUNDING is more than a float's, so the conversion stays outside. */
static void add_box(ss_shaft *shaft, const bodies *b, const ss_shaft_frame *f) {
    for (int k = 0; k < 3; k++) {
        const double up = ss_max(b->high[k], f->light_high[k]);
        const double down = ss_max(-b->low[k], -f->light_low[k]);
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

void ss_shaft_frame_make(ss_shaft_frame *f, const ss_light *light, const double low[3],
                         const double high[3]) {
    const bool sun = light->type == SOFTSHADOW_SUN;
    f->disk = light->type == SOFTSHADOW_SPHERE ? facing_disk(light, low, high) : 0;
    for (int k = 0; k < 3; k++) {
        double n[3] = {0, 0, 0};
        n[k] = 1;
        f->light_high[k] = support_of(light, f->disk, n);
        n[k] = -1;
        f->light_low[k] = -support_of(light, f->disk, n);
        f->low[k] = low[k], f->high[k] = high[k];
        const double middle = low[k] + (high[k] - low[k]) / 2;
        f->axis[k] = sun ? light->normal[k] : light->centre[k] - middle;
    }
    f->depth = ss_length(f->axis);
    if (!ss_normalize(f->axis)) {
        for (int k = 0; k < 3; k++) f->axis[k] = 0;
        return;
    }
    ss_basis(f->axis, f->side[0], f->side[1]);
    if (light->type == SOFTSHADOW_RECT && !light->point) {
        across_edge(f->axis, light->v, f->side[0]);
        across_edge(f->axis, light->u, f->side[1]);
    }
}

static void add_sides(ss_shaft *shaft, const bodies *b, const ss_shaft_frame *f) {
    for (int i = 0; i < 4; i++) {
        double n[3], toward[3];
        for (int k = 0; k < 3; k++) toward[k] = i & 1 ? -f->side[i / 2][k] : f->side[i / 2][k];
        if (b->light->type == SOFTSHADOW_SUN)
            lean_sun(b->light, toward, n);
        else
            lean(b, f, toward, n);
        add_plane(shaft, b, n);
    }
}

static void add_ends(ss_shaft *shaft, const bodies *b, const ss_shaft_frame *f) {
    const ss_light *light = b->light;
    const bool round = light->type == SOFTSHADOW_SUN || light->type == SOFTSHADOW_SPHERE ||
                       light->point;
    const double *across = round ? f->axis : light->normal;
    for (int end = 0; end < 2; end++) {
        double n[3];
        const double sign = (dot(across, f->axis) > 0) == (end == 0) ? -1 : 1;
        for (int k = 0; k < 3; k++) n[k] = sign * across[k];
        add_plane(shaft, b, n);
    }
}

void ss_shaft_in_frame(ss_shaft *shaft, const ss_shaft_frame *frame, const ss_light *light,
                       double extent, const double low[3], const double high[3],
                       const double *const at[3], size_t count) {
    bodies b = {light, frame->disk, low, high, at, count, {0, 0, 0}};
    for (int k = 0; k < 3; k++) b.size[k] = ss_max(extent, ss_max(fabs(low[k]), fabs(high[k])));
    shaft->planes = 0;
    add_box(shaft, &b, frame);
    if (frame->axis[0] == 0 && frame->axis[1] == 0 && frame->axis[2] == 0) return;
    add_sides(shaft, &b, frame);
    add_ends(shaft, &b, frame);
}

void ss_shaft_make(ss_shaft *shaft, const ss_light *light, double extent, const double low[3],
                   const double high[3]) {
    ss_shaft_frame frame;
    ss_shaft_frame_make(&frame, light, low, high);
    ss_shaft_in_frame(shaft, &frame, light, extent, low, high, NULL, 0);
}
