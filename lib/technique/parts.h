/* Techniques that take one light for its centre's view, asked for each part of a divided light:
 * what they see is the parts' weighted mean ([Cou05] 4.3, the remedy for the single-silhouette
 * artefact). */
#ifndef SS_TECHNIQUE_PARTS_H
#define SS_TECHNIQUE_PARTS_H

#include "technique/technique.h"

/* Builds `part` for each of what params->sub_lights makes of the light; its states begin with an
 * ss_light_maps. Where the light is one part all of the rows are the part's own. */
softshadow_status ss_parts_build(const ss_stage *stage, const ss_technique *part, void **state);

softshadow_status ss_parts_query(const ss_stage *stage, const void *state, const ss_point *points,
                                 size_t n, float *visibility, float *bound, ss_arena *scratch,
                                 ss_counts *counts);
void ss_parts_query_places(const void *state, const ss_places *places, size_t n, float *visibility,
                           ss_counts *counts);
softshadow_status ss_parts_finish(const ss_stage *stage, const void *state, const ss_image *image,
                                  ss_pool *pool, ss_counts *counts);
/* Maps of several parts may be drawn by a GPU, and are asked in C. */
softshadow_status ss_parts_tables(void *state, struct ss_raster_question *question);
void ss_parts_look(const void *state, const ss_point *points, size_t n, float (*looks)[4]);
void ss_parts_horizon(const ss_stage *stage, const void *state, const ss_point *points, size_t n,
                      float *visibility, float *bound, ss_counts *counts);
void ss_parts_destroy(void *state);
size_t ss_parts_bytes(const void *state);
uint32_t ss_parts_map_count(const void *state);
void ss_parts_get_map(const void *state, uint32_t index, softshadow_map *map);
uint64_t ss_parts_silhouettes(const void *state);
uint64_t ss_parts_culled(const void *state);

/* The rows of a technique's table. */
#define SS_PARTS_ROWS                                                                              \
    .query = ss_parts_query, .tables = ss_parts_tables, .look = ss_parts_look,                     \
    .horizon = ss_parts_horizon, .destroy = ss_parts_destroy, .bytes = ss_parts_bytes,             \
    .map_count = ss_parts_map_count, .get_map = ss_parts_get_map,                                  \
    .silhouette_edges = ss_parts_silhouettes, .casters_culled = ss_parts_culled

#endif
