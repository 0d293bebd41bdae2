/* based on: [Lawlor06] appendix A. Its table came from a picture of the sun; ours from the light's
 * profile, ring by ring: of a ring of radius rho the share acos(-t / rho) / pi lies below t. */
#include "map/falloff.h"

#include <math.h>

#define RINGS 512 /* the integrand has square-root ends: error about RINGS^-1.5, 1e-4 */
#define COARSE 256 /* steps at which a profile is integrated; linear between, error below 1e-4 */

double ss_falloff_disk(double t) {
    if (t <= -1) return 0;
    if (t >= 1) return 1;
    return 0.5 + (t * sqrt((1 - t) * (1 + t)) + asin(t)) / M_PI;
}

static double share_of_ring(double t, double rho) {
    if (t >= rho) return 1;
    if (t <= -rho) return 0;
    return acos(-t / rho) / M_PI;
}

static double profiled(const ss_light *light, double t) {
    double sum = 0, all = 0;
    for (int i = 0; i < RINGS; i++) {
        const double rho = (i + 0.5) / RINGS, weight = rho * ss_light_profile(light, rho);
        sum += weight * share_of_ring(t, rho), all += weight;
    }
    return all > 0 ? sum / all : ss_falloff_disk(t);
}

static void make_profiled(ss_falloff *out, const ss_light *light) {
    const int step = SS_FALLOFF_STEPS / COARSE;
    double before = 0;
    for (int i = 1; i <= COARSE; i++) {
        const double value = i < COARSE ? profiled(light, 2.0 * i / COARSE - 1) : 1;
        for (int k = 0; k < step; k++) {
            out->value[(i - 1) * step + k] = (float)(before + (value - before) * k / step);
        }
        before = value;
    }
    out->value[SS_FALLOFF_STEPS] = 1;
}

static double paper_at(ss_falloff_paper paper, double l) {
    if (paper == SS_FALLOFF_BERNSTEIN) return l * l * (3 - 2 * l);
    return (1 - cos(M_PI * l)) / 2;
}

void ss_falloff_make(ss_falloff *out, uint32_t kind, ss_falloff_paper paper,
                     const ss_light *light) {
    const bool own = kind == SOFTSHADOW_FALLOFF_DISK || kind == SOFTSHADOW_FALLOFF_PROFILE ||
                     (kind == SOFTSHADOW_FALLOFF_PAPER && paper == SS_FALLOFF_TABLE);
    if (own && light->profile_count > 1) {
        make_profiled(out, light);
    } else {
        for (int i = 0; i <= SS_FALLOFF_STEPS; i++) {
            const double l = (double)i / SS_FALLOFF_STEPS;
            out->value[i] = (float)(own ? ss_falloff_disk(2 * l - 1)
                                    : kind == SOFTSHADOW_FALLOFF_LINEAR ? l : paper_at(paper, l));
        }
    }
    out->value[SS_FALLOFF_STEPS + 1] = out->value[SS_FALLOFF_STEPS];
}
