/* What a shadow-width map holds. */
#ifndef SS_TECHNIQUE_SINGLE_SAMPLE_H
#define SS_TECHNIQUE_SINGLE_SAMPLE_H

#include "technique/light_maps.h"

/* A texel: the hard shadow's depth; how far inside of the shadow it is, in texels. */
enum { SINGLE_DEPTH, SINGLE_INSIDE, SINGLE_CHANNELS };

typedef struct ss_single_state {
    ss_light_maps maps;
    float rate[SS_MAP_FACES]; /* texels for a unit of h */
} ss_single_state;

#endif
