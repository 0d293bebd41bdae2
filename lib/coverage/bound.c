#include "coverage/bound.h"

#include <math.h>

#include "base/vec.h"

static bool in_mask(const uint32_t *mask, uint32_t place) {
    return mask[place / 32] >> (place % 32) & 1;
}

/* In grid coordinates the height above the horizon is  base + along x + across y. */
void ss_bound_hide_below(const ss_lattice *lattice, const ss_view *view, const double normal[3],
                         uint32_t *mask) {
    const double height = ss_dot(normal, view->centre);
    const double a = ss_dot(normal, view->a), b = ss_dot(normal, view->b);
    if (height > fabs(a) + fabs(b)) return;
    const double(*g)[3] = lattice->grid;
    const double det = g[0][0] * g[1][1] - g[0][1] * g[1][0];
    const double along = (a * g[1][1] - b * g[1][0]) / det;
    const double across = (b * g[0][0] - a * g[0][1]) / det;
    const double base = height - along * g[0][2] - across * g[1][2];
    for (uint32_t block = 0; block < lattice->blocks; block++) {
        const double first = 32.0 * (block % lattice->words) + 1;
        for (uint32_t i = 0; i < SS_BLOCK; i++) {
            const double y = block / lattice->words * SS_BLOCK + i + 1;
            const double left = base + across * y + along * first; /* height at column 0 */
            /* Columns below: left + along c <= 0. */
            const double edge = -left / along;
            uint32_t below = left <= 0 ? ~0u : 0;
            if (along > 0) below = edge < 0 ? 0 : edge >= 31 ? ~0u : ~(~0u << ((uint32_t)edge + 1));
            if (along < 0) below = edge <= 0 ? ~0u : edge > 31 ? 0 : ~0u << (uint32_t)ceil(edge);
            mask[block * SS_BLOCK + i] |= below;
        }
    }
}

void ss_bound_mark_horizon(const ss_lattice *lattice, const ss_view *view, const double normal[3],
                           uint32_t *tight, uint32_t *wide) {
    const double(*g)[3] = lattice->grid;
    const double a = ss_dot(normal, view->a), b = ss_dot(normal, view->b);
    const double det = fabs(g[0][0] * g[1][1] - g[0][1] * g[1][0]);
    const double cell = (fabs(a * g[1][1] - b * g[1][0]) + fabs(b * g[0][0] - a * g[0][1])) / det;
    for (uint32_t i = 0; i < lattice->blocks * SS_BLOCK * 32; i++) {
        double d[3];
        for (int k = 0; k < 3; k++) {
            d[k] = view->centre[k] + lattice->s[i] * view->a[k] + lattice->t[i] * view->b[k];
        }
        const double height = fabs(ss_dot(normal, d));
        tight[i / 32] |= (uint32_t)(height <= 0.51 * cell) << (i % 32);
        wide[i / 32] |= (uint32_t)(height <= 1.01 * SS_LATTICE_REACH * cell) << (i % 32);
    }
}

/* What a sample counts, and into *change by how much that can be wrong for its cell. The middle of
 * a cell is right for weights that change evenly, so inside it is a part of the second difference;
 * at the rim the sample is not in the middle, and it is the first. */
static double weight_of(const ss_lattice *lattice, const ss_light *light, const ss_view *view,
                        uint32_t weighting, const double *normal, uint32_t place, double *change) {
    *change = 0;
    if (weighting == SOFTSHADOW_UNIFORM) return lattice->weight[place];
    const double x = lattice->s[place], y = lattice->t[place];
    const double here = ss_light_weight(light, view, weighting, normal, x, y);
    const double(*g)[3] = lattice->grid;
    const double det = g[0][0] * g[1][1] - g[0][1] * g[1][0];
    for (int i = 0; i < 2; i++) {
        const double ds = (i ? -g[0][1] : g[1][1]) / det, dt = (i ? g[0][0] : -g[1][0]) / det;
        const double next = ss_light_weight(light, view, weighting, normal, x + ds, y + dt);
        const double last = ss_light_weight(light, view, weighting, normal, x - ds, y - dt);
        if (in_mask(lattice->rim, place))
            *change += fmax(fabs(next - here), fabs(last - here));
        else
            *change += fabs(next + last - 2 * here) / 4;
    }
    *change *= lattice->weight[place];
    return here * lattice->weight[place];
}

/* Where every sample counts what it weighs. */
static uint64_t weight_marked(const ss_lattice *lattice, const uint32_t *tight,
                              const uint32_t *wide) {
    const size_t words = (size_t)lattice->blocks * SS_BLOCK;
    uint64_t sum = 0;
    for (uint32_t p = 0; p < lattice->planes; p++) {
        const uint32_t *plane = lattice->plane + p * words;
        uint64_t bits = 0;
        for (size_t i = 0; i < words; i++) {
            bits +=
                (uint64_t)__builtin_popcount(plane[i] & (tight[i] | (lattice->rim[i] & wide[i])));
        }
        sum += bits << p;
    }
    return sum;
}

static float as_bound(const ss_lattice *lattice, double wrong, double total) {
    return (float)fmin(1, wrong / total + lattice->weight_error + 0x1p-20);
}

float ss_bound_sum(const ss_lattice *lattice, const ss_light *light, const ss_view *view,
                   uint32_t weighting, const double *normal, const uint32_t *tight,
                   const uint32_t *wide) {
    double marked = 0, total = 0, changes = 0;
    if (weighting == SOFTSHADOW_UNIFORM && lattice->total) {
        marked = (double)weight_marked(lattice, tight, wide);
        return as_bound(lattice, marked, (double)lattice->total);
    }
    for (uint32_t i = 0; i < lattice->blocks * SS_BLOCK * 32; i++) {
        if (in_mask(lattice->outside, i)) continue;
        double change;
        const double weight = weight_of(lattice, light, view, weighting, normal, i, &change);
        total += weight, changes += change;
        if (in_mask(tight, i) || (in_mask(lattice->rim, i) && in_mask(wide, i)))
            marked += weight + change;
    }
    if (!(total > 0)) return changes > 0 ? 1 : 0; /* nothing of the light counts: 0 by definition */
    return as_bound(lattice, marked + changes, total);
}
