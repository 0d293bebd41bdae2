/* What penumbra-map and smoothie do alike: find the silhouettes, draw each into every face that it
 * matters to, ask the plane. They differ in what they draw. */
#ifndef SS_TECHNIQUE_OUTER_H
#define SS_TECHNIQUE_OUTER_H

#include "technique/light_maps.h"
#include "technique/rim.h"

/* How a technique makes rise of ss_outer_offer() from the distance to the rim: `shade` does all of
 * it, and the text once more as
 *   float rise_of(float away, float blocker)
 * with its own numbers in words[0] to words[2]. It begins with SS_OUTER_GLSL. */
typedef struct ss_outer_pen {
    ss_raster_shade *shade;
    float (*rise)(const void *ctx, float away, float blocker); /* falls with blocker */
    void *ctx;
    const char *glsl;
    float words[4]; /* the last is far_h, filled in */
    bool plain; /* is rise away * words[0]? */
} ss_outer_pen;

/* A face while it is drawn. */
typedef struct ss_outer_sheet {
    float *texels;      /* of the face */
    const float *depth; /* likewise */
    float *lit;         /* likewise, of ss_light_maps */
    uint32_t side;
    float far, per_texel, texels_per; /* the last: its inverse */
    const ss_outer_pen *pen;
} ss_outer_sheet;

#define SS_OUTER_GLSL \
    "layout(std430, binding = 4) readonly buffer Depths { float depths[]; };\n" \
    "layout(std430, binding = 5) readonly buffer Words { float words[]; };\n" \
    "float rise_of(float away, float blocker);\n" \
    SS_RIM_AWAY_GLSL \
    "bool offer(uint tag, ivec2 texel, vec4 varied, precise out float key, out vec4 value) {\n" \
    "    float vertex = varied.y;\n" \
    "    precise float rise = rise_of(rim_away(tag, varied), vertex);\n" \
    "    float depth = depths[uint(texel.y) * resolution + uint(texel.x)];\n" \
    "    float receiver = depth < words[3] ? depth : words[3];\n" \
    "    key = rise / (receiver - vertex);\n" \
    "    value = vec4(vertex, rise, 0.0, 0.0);\n" \
    "    return vertex + rise < receiver;\n" \
    "}\n"

/* Draws what the silhouettes leave in one face, by ss_outer_paint() with a style and a pen of its
 * own. */
typedef softshadow_status ss_outer_draw(const ss_stage *stage, const ss_light_maps *maps,
                                        const ss_silhouette *found, uint32_t face);
softshadow_status ss_outer_paint(const ss_stage *stage, const ss_light_maps *maps,
                                 const ss_silhouette *found, uint32_t face,
                                 const ss_rim_style *style, const ss_outer_pen *pen);

/* The technique vtable's build, with the name of the plane and the paper's falloff. */
softshadow_status ss_outer_build(const ss_stage *stage, const char *plane, ss_falloff_paper paper,
                                 ss_outer_draw *draw, void **state);

#endif
