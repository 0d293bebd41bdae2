/* See lamp_glsl.h for what the text finds. */
#ifndef SS_TECHNIQUE_LAMP_ASK_H
#define SS_TECHNIQUE_LAMP_ASK_H

#include "technique/lamp.h"
#include "technique/lamp_glsl.h"
#include "technique/light_maps.h"

/* ss_light_maps_ask() in parts, with one lamp and one pyramid a face. */
softshadow_status ss_lamp_ask(ss_light_maps *maps, const ss_lamp *lamp, const ss_pyramid *pyramid,
                              const char *glsl, ss_raster_question *question);

#endif
