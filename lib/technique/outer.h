/* What penumbra-map and smoothie do alike: find the silhouettes, draw each into every face that it
 * matters to, ask the plane. They differ in what they draw. */
#ifndef SS_TECHNIQUE_OUTER_H
#define SS_TECHNIQUE_OUTER_H

#include "technique/light_maps.h"
#include "technique/rim.h"

/* Draws what the silhouettes leave in one face, by ss_outer_paint() with a style of its own. */
typedef softshadow_status ss_outer_draw(const ss_stage *stage, const ss_light_maps *maps,
                                        const ss_silhouette *found, uint32_t face);
softshadow_status ss_outer_paint(const ss_stage *stage, const ss_light_maps *maps,
                                 const ss_silhouette *found, uint32_t face,
                                 const ss_rim_style *style, ss_raster_shade *shade, void *ctx);

/* The technique vtable's build, with the name of the plane and the paper's falloff. */
softshadow_status ss_outer_build(const ss_stage *stage, const char *plane, ss_falloff_paper paper,
                                 ss_outer_draw *draw, void **state);
/* The vtable's query. */
softshadow_status ss_outer_query(const ss_stage *stage, const void *state, const ss_point *points,
                                 size_t n, float *visibility, float *bound, ss_arena *scratch,
                                 ss_counts *counts);

#endif
