#include "technique/lamp.h"

#include <math.h>

#include "base/vec.h"

#define ROUNDS 16      /* the search of the kernel ends here at the latest: still conservative */
#define NARROW 0x1p-20 /* half a penumbra, in texels, below which there is only the hard shadow */
#define FLAT   1e-6    /* a light this much thinner than wide is seen as a line */

/* ---- the light in the frame ------------------------------------------------------------------ */

/* Uniform disks whose sum steps like the profile, each weighted by its share of all the light. */
static void make_rings(ss_lamp *lamp, const ss_light *light) {
    lamp->rings = light->profile_count && lamp->disk ? SS_LAMP_RINGS : 1;
    double sum = 0;
    for (uint32_t i = 0; i < lamp->rings; i++) {
        const double from = (double)i / lamp->rings, to = (i + 1.0) / lamp->rings;
        const bool last = i + 1 == lamp->rings;
        lamp->ring[i] = last ? 1 : to;
        const double here = ss_light_profile(light, (from + to) / 2);
        const double next = last ? 0 : ss_light_profile(light, to + (to - from) / 2);
        lamp->weight[i] = lamp->rings == 1 ? 1 : (here - next) * lamp->ring[i] * lamp->ring[i];
        sum += lamp->weight[i];
    }
    for (uint32_t i = 0; i < lamp->rings; i++)
        lamp->weight[i] = sum > 0 ? lamp->weight[i] / sum : 0;
    if (!(sum > 0)) lamp->rings = 1, lamp->ring[0] = lamp->weight[0] = 1;
}

void ss_lamp_make(ss_lamp *out, const ss_light *light, const ss_frame *frame) {
    const double per = (frame->inverse > 0 ? frame->inverse : 1) / frame->texel;
    *out = (ss_lamp){.sphere = light->type == SOFTSHADOW_SPHERE,
                     .disk = light->type != SOFTSHADOW_RECT,
                     .radius = light->radius * per,
                     .square = light->radius * light->radius,
                     .distance = frame->inverse > 0 ? 1 / frame->inverse : INFINITY,
                     .inverse = frame->inverse,
                     .low = {frame->low[0], frame->low[1]},
                     .texel = frame->texel};
    const double *axis[3] = {frame->x, frame->y, frame->z};
    for (int k = 0; k < 3 && !out->sphere; k++) {
        out->u[k] = ss_dot(light->u, axis[k]) * per;
        out->v[k] = ss_dot(light->v, axis[k]) * per;
    }
    make_rings(out, light);
}

/* ---- the light from a point ------------------------------------------------------------------ */

/* A sphere's outline: a disk across the line of sight, seen in the frame's plane, where it is
 * longer along the tangent: axes[i] are its half axes. */
static bool sphere_axes(const ss_lamp *lamp, const double tangent[2], double h, double axes[2][2]) {
    const double tilt = tangent[0] * tangent[0] + tangent[1] * tangent[1];
    const double along = lamp->distance / (1 - h * lamp->inverse);
    const double square = along * along * (1 + tilt); /* of the distance to its centre */
    if (!(square > lamp->square)) return false;
    const double radius = lamp->radius * sqrt(square / (square - lamp->square));
    const double longer = tilt > 0 ? (sqrt(1 + tilt) - 1) / tilt : 0;
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < 2; k++)
            axes[i][k] = radius * ((i == k) + longer * tangent[i] * tangent[k]);
    }
    return true;
}

/* A flat light's half axes, moved along the line of sight into the frame's plane. */
static void flat_axes(const ss_lamp *lamp, const double tangent[2], double axes[2][2]) {
    for (int k = 0; k < 2; k++) {
        axes[0][k] = lamp->u[k] - lamp->u[2] * tangent[k];
        axes[1][k] = lamp->v[k] - lamp->v[2] * tangent[k];
    }
}

bool ss_lamp_see(const ss_lamp *lamp, double x, double y, double h, ss_lamp_view *out) {
    const double tangent[2] = {(lamp->low[0] + lamp->texel * x) * lamp->inverse,
                               (lamp->low[1] + lamp->texel * y) * lamp->inverse};
    double a[2][2], size = 0;
    if (!lamp->sphere)
        flat_axes(lamp, tangent, a);
    else if (!sphere_axes(lamp, tangent, h, a))
        return false;
    for (int i = 0; i < 4; i++) size += a[i / 2][i % 2] * a[i / 2][i % 2];
    const double det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    if (!(fabs(det) > FLAT * size)) return false;
    double(*m)[2] = out->to_light;
    m[0][0] = a[1][1] / det, m[0][1] = -a[1][0] / det;
    m[1][0] = -a[0][1] / det, m[1][1] = a[0][0] / det;
    const double skew = fabs(m[0][1]) + fabs(m[1][0]), straight = fabs(m[0][0]) + fabs(m[1][1]);
    out->lamp = lamp;
    out->square = !lamp->disk && skew < 1e-9 * straight;
    out->area = 1 / fabs(det) / (lamp->disk ? M_PI : 4);
    out->texel = fmax(hypot(m[0][0] + m[0][1], m[1][0] + m[1][1]),
                      hypot(m[0][0] - m[0][1], m[1][0] - m[1][1])) /
                 2;
    for (int k = 0; k < 2; k++) {
        out->reach[k] = lamp->disk ? hypot(a[0][k], a[1][k]) : fabs(a[0][k]) + fabs(a[1][k]);
    }
    out->least = NARROW / fmax(out->reach[0], out->reach[1]);
    return true;
}

/* ---- areas ----------------------------------------------------------------------------------- */

static double cross2(const double a[2], const double b[2]) { return a[0] * b[1] - a[1] * b[0]; }
/* atan2(cross, dot); by its series where that is as good, which is where sides are short. */
static double angle(double cross, double dot) {
    const double t = cross / dot, s = t * t;
    if (!(fabs(cross) < 0.125 * dot)) return atan2(cross, dot);
    const double high = 1.0 / 11 - s * (1.0 / 13 - s * (1.0 / 15 - s * (1.0 / 17)));
    const double middle = 1.0 / 5 - s * (1.0 / 7 - s * (1.0 / 9 - s * high));
    return t - t * s * (1.0 / 3 - s * middle);
}
static double sector(const double a[2], const double b[2]) {
    return angle(cross2(a, b), a[0] * b[0] + a[1] * b[1]) / 2;
}

/* The signed area that the unit disk shares with the triangle from its centre to a and b. */
static double slice(const double a[2], const double b[2]) {
    const double d[2] = {b[0] - a[0], b[1] - a[1]};
    const double square = d[0] * d[0] + d[1] * d[1], dot = a[0] * d[0] + a[1] * d[1];
    const double c = cross2(a, d), room = square - c * c; /* c^2 / square: distance to the line */
    if (!(room > 0)) return sector(a, b);
    const double root = sqrt(room), enter = (-dot - root) / square, leave = (-dot + root) / square;
    if (leave <= 0 || enter >= 1) return sector(a, b);
    const double p[2] = {a[0] + enter * d[0], a[1] + enter * d[1]};
    const double q[2] = {a[0] + leave * d[0], a[1] + leave * d[1]};
    const double *from = enter > 0 ? p : a, *to = leave < 1 ? q : b;
    return (enter > 0 ? sector(a, p) : 0) + cross2(from, to) / 2 + (leave < 1 ? sector(q, b) : 0);
}

static double in_disk(double corner[4][2], double radius) {
    double sum = 0, at[4][2];
    for (int i = 0; i < 4; i++) at[i][0] = corner[i][0] / radius, at[i][1] = corner[i][1] / radius;
    for (int i = 0; i < 4; i++) sum += slice(at[i], at[(i + 1) % 4]);
    return fabs(sum) / M_PI;
}

static double polygon_area(double (*p)[2], int n) {
    double sum = 0;
    for (int i = 1; i + 1 < n; i++) {
        const double a[2] = {p[i][0] - p[0][0], p[i][1] - p[0][1]};
        const double b[2] = {p[i + 1][0] - p[0][0], p[i + 1][1] - p[0][1]};
        sum += cross2(a, b);
    }
    return fabs(sum) / 2;
}

/* Keeps what is below 1 along axis k, times sign. Adds a corner at most. */
static int clip(double (*from)[2], int n, int k, double sign, double (*to)[2]) {
    int m = 0;
    for (int i = 0; i < n; i++) {
        const double *a = from[i], *b = from[(i + 1) % n];
        const double da = 1 - sign * a[k], db = 1 - sign * b[k];
        if (da >= 0) to[m][0] = a[0], to[m][1] = a[1], m++;
        if ((da < 0) == (db < 0)) continue;
        const double t = da / (da - db);
        to[m][0] = a[0] + t * (b[0] - a[0]), to[m][1] = a[1] + t * (b[1] - a[1]), m++;
    }
    return m;
}

static double in_square(double corner[4][2]) {
    double a[8][2], b[8][2];
    for (int i = 0; i < 4; i++) a[i][0] = corner[i][0], a[i][1] = corner[i][1];
    int n = clip(a, 4, 0, 1, b);
    n = clip(b, n, 0, -1, a);
    n = clip(a, n, 1, 1, b);
    n = clip(b, n, 1, -1, a);
    return polygon_area(a, n) / 4;
}

static double clamped(double x) { return x < -1 ? -1 : x > 1 ? 1 : x; }

/* Bounds clamped, sides multiplied: [BCS06] after equation 1, the light being -1 .. 1 here. */
static double straight(const ss_lamp_view *view, const double low[2], const double high[2]) {
    double side[2];
    for (int k = 0; k < 2; k++) {
        const double to = view->to_light[k][k];
        side[k] = fabs(clamped(to * high[k]) - clamped(to * low[k]));
    }
    return side[0] * side[1] / 4;
}

double ss_lamp_hidden(const ss_lamp_view *view, const double low[2], const double high[2]) {
    if (view->square) return straight(view, low, high);
    const ss_lamp *lamp = view->lamp;
    double corner[4][2], farthest = 0, hidden = 0;
    for (int i = 0; i < 4; i++) {
        const double x = i == 1 || i == 2 ? high[0] : low[0], y = i >= 2 ? high[1] : low[1];
        for (int k = 0; k < 2; k++)
            corner[i][k] = view->to_light[k][0] * x + view->to_light[k][1] * y;
        const double square = corner[i][0] * corner[i][0] + corner[i][1] * corner[i][1];
        farthest = square > farthest ? square : farthest;
    }
    if (!lamp->disk) return in_square(corner);
    const double all = (high[0] - low[0]) * (high[1] - low[1]) * view->area;
    for (uint32_t i = 0; i < lamp->rings; i++) {
        const double square = lamp->ring[i] * lamp->ring[i];
        const bool within = farthest <= square;
        hidden += lamp->weight[i] * (within ? all / square : in_disk(corner, lamp->ring[i]));
    }
    return hidden;
}

/* ---- kernels --------------------------------------------------------------------------------- */

static int32_t place_of(double at, int32_t side) {
    return at < 0 ? -1 : at >= side ? side : (int32_t)at;
}

bool ss_lamp_footprint(const ss_lamp_view *view, uint32_t side, double x, double y, double gap,
                       ss_lamp_kernel *out) {
    const double at[2] = {x, y};
    const int32_t n = (int32_t)side;
    for (int k = 0; k < 2; k++) {
        out->low[k] = place_of(at[k] - view->reach[k] * gap, n);
        out->high[k] = place_of(at[k] + view->reach[k] * gap, n);
        if (out->low[k] >= n || out->high[k] < 0) return false;
        if (out->low[k] < 0) out->low[k] = 0;
        if (out->high[k] >= n) out->high[k] = n - 1;
        out->count[k] = out->high[k] - out->low[k] + 1;
    }
    out->step = 1;
    return true;
}

bool ss_lamp_search(const ss_lamp_view *view, const ss_pyramid *pyramid, double x, double y,
                    float h, ss_lamp_kernel *out) {
    float least = *pyramid->level[pyramid->levels - 1];
    for (int round = 0; round < ROUNDS; round++) {
        if (!(least < h)) return false;
        if (!ss_lamp_footprint(view, pyramid->side[0], x, y, (double)h - least, out)) return false;
        const float found = ss_pyramid_least(pyramid, out->low, out->high);
        if (found == least) break;
        least = found;
    }
    return least < h;
}

void ss_lamp_thin(ss_lamp_kernel *kernel, uint32_t limit) {
    const int32_t wide = kernel->count[0], tall = kernel->count[1];
    const double all = (double)wide * tall;
    kernel->step = limit && all > limit ? (int32_t)sqrt(all / limit) : 1;
    for (;; kernel->step++) {
        for (int k = 0; k < 2; k++) {
            kernel->count[k] = (kernel->high[k] - kernel->low[k]) / kernel->step + 1;
        }
        if (!limit || (double)kernel->count[0] * kernel->count[1] <= limit) return;
    }
}

/* ---- for the shader -------------------------------------------------------------------------- */

void ss_lamp_words(const ss_lamp *lamp, float *words) {
    for (int k = 0; k < 3; k++) words[k] = (float)lamp->u[k], words[3 + k] = (float)lamp->v[k];
    words[6] = (float)lamp->radius, words[7] = (float)lamp->square;
    words[8] = lamp->sphere, words[9] = lamp->disk;
    words[10] = (float)lamp->distance, words[11] = (float)lamp->inverse;
    words[12] = (float)lamp->low[0], words[13] = (float)lamp->low[1];
    words[14] = (float)lamp->texel, words[15] = (float)lamp->rings;
    for (int i = 0; i < SS_LAMP_RINGS; i++) {
        words[16 + i] = (float)lamp->ring[i], words[24 + i] = (float)lamp->weight[i];
    }
}
