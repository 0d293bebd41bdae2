#include "technique/outer.h"

#include "base/memory.h"

softshadow_status ss_outer_paint(const ss_stage *stage, const ss_light_maps *maps,
                                 const ss_silhouette *found, uint32_t face,
                                 const ss_rim_style *style, ss_raster_shade *shade, void *ctx) {
    const ss_frame *frame = &maps->frames.face[face];
    const uint32_t resolution = maps->frames.resolution;
    ss_rim rim;
    ss_raster_triangle *triangles = NULL;
    size_t count = 0;
    softshadow_status status = ss_rim_build(&rim, stage, found, frame, resolution);
    if (!status) status = ss_rim_draw(&rim, style, &triangles, &count);
    if (!status) {
        status = ss_raster_cpu.draw(triangles, count, 4, resolution, shade, ctx, stage->pool);
    }
    ss_free(triangles);
    ss_rim_free(&rim);
    return status;
}

static softshadow_status draw_all(const ss_stage *stage, ss_light_maps *maps, const char *plane,
                                  ss_outer_draw *draw) {
    ss_silhouette found;
    softshadow_status status = ss_rim_find(stage, &found);
    if (status) return status;
    maps->silhouette_edges = found.count;
    if (found.count) status = ss_outer_clear(maps, plane);
    for (uint32_t face = 0; face < maps->frames.count && found.count && !status; face++) {
        status = draw(stage, maps, &found, face);
    }
    ss_silhouette_free(&found);
    return status;
}

softshadow_status ss_outer_build(const ss_stage *stage, const char *plane, ss_falloff_paper paper,
                                 ss_outer_draw *draw, void **state) {
    const ss_light_maps_wish wish = {.state_size = sizeof(ss_light_maps), .slope_texels = 1.5,
                                     .paper = paper};
    softshadow_status status = ss_light_maps_build(stage, &wish, state);
    if (status || stage->light->point) return status;
    ss_light_maps *maps = *state;
    if (maps->frames.count) status = draw_all(stage, maps, plane, draw);
    if (status) ss_light_maps_destroy(maps), *state = NULL;
    return status;
}

softshadow_status ss_outer_query(const ss_stage *stage, const void *state, const ss_point *points,
                                 size_t n, float *visibility, float *bound, ss_arena *scratch,
                                 ss_counts *counts) {
    (void)stage, (void)scratch;
    const ss_light_maps *maps = state;
    return ss_light_maps_query(maps, maps->plane ? ss_outer_answer : ss_light_maps_hard, points, n,
                               visibility, bound, counts);
}
