/* hard: the shadow map, without any penumbra.
 *
 * based on: [Williams78]. Differs: the frame is fitted to the casters and the points asked, depth
 * in perspective is the reciprocal of distance (map/frame.h), and the map keeps the deepest that a
 * surface reaches inside its texel instead of a bias added to all depths. */
#include "technique/light_maps.h"
#include "technique/map_techniques.h"

static softshadow_status build(const ss_stage *stage, void **state) {
    const ss_light_maps_wish wish = {.state_size = sizeof(ss_light_maps), .slope_texels = 1};
    return ss_light_maps_build(stage, &wish, state);
}

const ss_technique ss_hard = {
    .name = "hard",
    .title = "shadow map: the hard shadow of the light's centre",
    .cite = "Williams78",
    .notes =
        "No penumbra, whatever the light's size. A surface may shadow itself where it is steeper "
        "than 86 degrees to the light; a contact shadow may start up to half a texel's depth late.",
    .bound_kind = SOFTSHADOW_BOUND_NONE,
    .lights_native = SS_LIGHTS_ALL,
    .weightings = 1u << SOFTSHADOW_UNIFORM,
    .build = build,
    .query_glsl = ss_light_maps_hard_glsl,
    .tables = ss_light_maps_tables_hard,
    .destroy = ss_light_maps_destroy,
    .bytes = ss_light_maps_bytes,
    SS_LIGHT_MAPS_ROWS,
};
