/* The rows of the techniques that work from maps. */
#ifndef SS_TECHNIQUE_MAP_TECHNIQUES_H
#define SS_TECHNIQUE_MAP_TECHNIQUES_H

#include "technique/technique.h"

extern const ss_technique ss_hard;
extern const ss_technique ss_pcf;
extern const ss_technique ss_pcss;
extern const ss_technique ss_single_sample;
extern const ss_technique ss_penumbra_map;
extern const ss_technique ss_smoothie;
extern const ss_technique ss_penumbra_volume;
extern const ss_technique ss_penumbra_mask;
extern const ss_technique ss_backprojection;
extern const ss_technique ss_penumbra_limit;

#endif
