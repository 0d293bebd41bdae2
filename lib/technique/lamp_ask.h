/* See lamp_glsl.h for what the text finds. */
#ifndef SS_TECHNIQUE_LAMP_ASK_H
#define SS_TECHNIQUE_LAMP_ASK_H

#include "technique/lamp.h"
#include "technique/lamp_glsl.h"
#include "technique/light_maps.h"

/* The states of techniques that search the depth map for what stands before a lamp begin with
 * it. */
typedef struct ss_lamp_maps {
    ss_light_maps maps;
    ss_lamp lamp[SS_MAP_FACES];
    ss_pyramid pyramid[SS_MAP_FACES]; /* over maps.depth */
    uint32_t max_samples;
} ss_lamp_maps;

/* ss_light_maps_build(), then lamps and pyramids; a point light needs neither. */
softshadow_status ss_lamp_maps_build(const ss_stage *stage, const ss_light_maps_wish *wish,
                                     void **state);
void ss_lamp_maps_destroy(void *state);
size_t ss_lamp_maps_bytes(const void *state);
/* The hard shadow at look i: for points that see no lamp but a line. */
float ss_lamp_maps_hard(const ss_lamp_maps *lamps, const ss_looks *looks, size_t i);
/* ss_light_maps_ask() in parts, with lamps and pyramids; a point light's is the hard shadow's. */
softshadow_status ss_lamp_maps_ask(ss_lamp_maps *lamps, const char *glsl,
                                   ss_raster_question *question);

#endif
