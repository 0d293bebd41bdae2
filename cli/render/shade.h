/* shade.h - how bright a diffuse surface is under a light of which it sees a fraction. For
 * previews: a light's size enters through visibility and through the horizon, else it shines from
 * its centre. */
#ifndef CLI_RENDER_SHADE_H
#define CLI_RENDER_SHADE_H

#include <softshadow.h>

#include "vector.h"

/* Irradiance of the part of the light that is seen, so scaled that the whole light gives 1 at the
 * place `reference` to a surface that faces it.
 *   weighting   in which measure the fraction was taken, SOFTSHADOW_UNIFORM ...
 *   visibility  that fraction at `point` */
double shade_irradiance(const softshadow_light *light, uint32_t weighting, vector reference,
                        vector point, vector normal, double visibility);

/* A linear value 0..1 as a screen wants it (IEC 61966-2-1). */
float shade_srgb(float linear);

#endif
