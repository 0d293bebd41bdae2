/* A light divided in smaller ones, whose sum it is or, if it is round, nearly is. */
#ifndef SS_SCENE_LIGHT_PARTS_H
#define SS_SCENE_LIGHT_PARTS_H

#include "scene/light.h"

/* Into how many parts `side` along a side divide it: a point light into itself. */
uint32_t ss_light_part_count(const ss_light *light, uint32_t side);
/* Part i, and how much it counts, up to a constant factor. A rect is cut into rects. Of round
 * lights the parts are round and of an equal share of its area, spread so that the second moments
 * of their sum are the light's: seen past an edge it has the light's penumbra nearly. A sphere's
 * lie in the disk that `toward`, a place off the sphere, sees. They are uniform, and count as the
 * light's profile says. */
void ss_light_part(const ss_light *light, const double toward[3], uint32_t side, uint32_t i,
                   ss_light *out, double *weight);

/* [-1, 1]^2 to the unit disk, areas kept: squares around the centre become circles [SC97]. */
double ss_square_to_disk(double st[2]);

#endif
