#include "scene/light_parts.h"

#include <math.h>
#include <string.h>

#include "base/vec.h"

/* The middle of cell i of side x side in [-1, 1]^2. */
static void middle_of(uint32_t side, uint32_t i, double st[2]) {
    st[0] = (2.0 * (i % side) + 1) / side - 1, st[1] = (2.0 * (i / side) + 1) / side - 1;
}

/* Within an eighth of a turn: the series, good to 1e-15. */
static void turn_of(double angle, double *sine, double *cosine) {
    const double q = angle * angle, p = q * q, r = p * p;
    const double low_s = (1 - q * (1.0 / 6)) + p * (1.0 / 120 - q * (1.0 / 5040));
    const double high_s = (1.0 / 362880 - q * (1.0 / 39916800)) +
                          p * (1.0 / 6227020800 - q * (1.0 / 1307674368000));
    const double low_c = (1 - q * (1.0 / 2)) + p * (1.0 / 24 - q * (1.0 / 720));
    const double high_c = (1.0 / 40320 - q * (1.0 / 3628800)) +
                          p * (1.0 / 479001600 - q * (1.0 / 87178291200));
    *sine = angle * (low_s + r * high_s), *cosine = low_c + r * high_c;
}

/* Whatever a processor guesses of a place at random is wrong half of the time: no branch. */
static inline void swap_if(bool swap, double *a, double *b) {
    uint64_t x, y;
    memcpy(&x, a, sizeof x), memcpy(&y, b, sizeof y);
    const uint64_t other = (x ^ y) & (0 - (uint64_t)swap);
    x ^= other, y ^= other;
    memcpy(a, &x, sizeof x), memcpy(b, &y, sizeof y);
}

double ss_square_to_disk(double st[2]) {
    double across = st[0], radius = st[1], sine, cosine;
    if (across == 0 && radius == 0) return 0;
    const bool wide = fabs(across) > fabs(radius);
    swap_if(wide, &across, &radius);
    turn_of(M_PI / 4 * (across / radius), &sine, &cosine); /* from the nearer axis */
    swap_if(wide, &sine, &cosine);
    st[0] = radius * sine, st[1] = radius * cosine;
    return fabs(radius);
}

/* Places of parts of radius 1 / side in the unit disk. Mean squares add up: of the places and of a
 * part's own disk, which together are to be the unit disk's 1/2. */
static void place_round(uint32_t side, uint32_t i, double st[2]) {
    double sum = 0;
    for (uint32_t k = 0; k < side * side; k++) {
        double at[2];
        middle_of(side, k, at), ss_square_to_disk(at);
        sum += at[0] * at[0] + at[1] * at[1];
    }
    const double own = 1.0 / ((double)side * side), mean = sum * own;
    const double spread = mean > 0 ? sqrt((1 - own) / 2 / mean) : 0;
    middle_of(side, i, st), ss_square_to_disk(st);
    st[0] *= spread, st[1] *= spread;
}

uint32_t ss_light_part_count(const ss_light *light, uint32_t side) {
    return light->point ? 1 : side * side;
}

/* The half axes of the disk that stands for the sphere, as `toward` sees it. */
static void sphere_axes(const ss_light *light, const double toward[3], double u[3], double v[3]) {
    double axis[3];
    ss_sub(toward, light->centre, axis);
    const double distance = ss_length(axis), sine = light->radius / distance;
    if (!ss_normalize(axis)) axis[0] = axis[1] = 0, axis[2] = 1;
    ss_basis(axis, u, v);
    const double reach = sine < 1 ? light->radius / sqrt((1 - sine) * (1 + sine)) : light->radius;
    for (int k = 0; k < 3; k++) u[k] *= reach, v[k] *= reach;
}

/* A sun's part: its disk, at distance 1 of the sun's centre, is smaller and tilted from its own. */
static void turn_sun(ss_light *sun, const double away[3]) {
    for (int k = 0; k < 3; k++) sun->normal[k] += away[k];
    const double cosine = 1 / ss_length(sun->normal);
    ss_normalize(sun->normal);
    sun->radius *= cosine * sqrt(cosine);
    ss_basis(sun->normal, sun->u, sun->v);
    for (int k = 0; k < 3; k++) sun->u[k] *= sun->radius, sun->v[k] *= sun->radius;
}

void ss_light_part(const ss_light *light, const double toward[3], uint32_t side, uint32_t i,
                   ss_light *out, double *weight) {
    *out = *light, *weight = 1;
    if (light->point || side < 2) return;
    double st[2], u[3], v[3], away[3];
    memcpy(u, light->u, sizeof u), memcpy(v, light->v, sizeof v);
    if (light->type == SOFTSHADOW_SPHERE) sphere_axes(light, toward, u, v);
    if (light->type == SOFTSHADOW_RECT) middle_of(side, i, st);
    else place_round(side, i, st);
    *weight = light->type == SOFTSHADOW_RECT ? 1 : ss_light_profile(light, hypot(st[0], st[1]));
    for (int k = 0; k < 3; k++) {
        away[k] = st[0] * u[k] + st[1] * v[k];
        out->u[k] /= side, out->v[k] /= side;
    }
    out->radius /= side, out->profile_count = 0, out->profile = NULL, out->profile_mean = 1;
    if (light->type == SOFTSHADOW_SUN) turn_sun(out, away);
    else ss_add_scaled(out->centre, 1, away, out->centre);
}
