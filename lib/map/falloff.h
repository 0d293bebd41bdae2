/* From the linear penumbra coordinate to a fraction of the light.
 *
 * l in 0..1 is how much of the light's diameter an occluder's straight edge leaves visible. What
 * share of the light that is depends on its shape: Lawlor's visibility-to-illumination table
 * ([Lawlor06], appendix A), made here for whatever light there is. */
#ifndef SS_MAP_FALLOFF_H
#define SS_MAP_FALLOFF_H

#include "scene/light.h"

#define SS_FALLOFF_STEPS 1024

typedef struct ss_falloff {
    float value[SS_FALLOFF_STEPS + 2]; /* at l = i / STEPS; one more for interpolation */
} ss_falloff;

/* What a paper printed instead of the exact share, for SOFTSHADOW_FALLOFF_PAPER. */
typedef enum ss_falloff_paper {
    SS_FALLOFF_BERNSTEIN, /* 3 l^2 - 2 l^3 */
    SS_FALLOFF_SINUSOID,  /* (1 - cos(pi l)) / 2 */
    SS_FALLOFF_TABLE      /* the light's own, as the default */
} ss_falloff_paper;

/* kind: SOFTSHADOW_FALLOFF_. A light with a radial profile has that profile under DISK as well: the
 * disk that DISK means is the light's. */
void ss_falloff_make(ss_falloff *out, uint32_t kind, ss_falloff_paper paper, const ss_light *light);

/* The share of a unit disk on the near side of a line at signed distance t from its centre:
 * accuracy, closed form 1. */
double ss_falloff_disk(double t);

static inline float ss_falloff_at(const ss_falloff *falloff, float l) {
    const float x = (l > 0 ? l < 1 ? l : 1 : 0) * SS_FALLOFF_STEPS;
    const int i = (int)x;
    return falloff->value[i] + (x - (float)i) * (falloff->value[i + 1] - falloff->value[i]);
}

#endif
