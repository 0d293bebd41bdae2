#include "technique/parts.h"

#include <math.h>

#include "base/memory.h"
#include "base/status.h"
#include "scene/light_parts.h"
#include "technique/light_maps.h"

typedef struct parts {
    const ss_technique *technique;
    uint32_t count;
    ss_light whole;
    struct part {
        ss_light light;
        double weight; /* all together 1 */
        void *state;
    } part[];
} parts;

/* ---- building ------------------------------------------------------------------------------- */

/* The middle of what is asked, or of what casts. */
static void middle_of(const ss_stage *stage, double middle[3]) {
    const double *b = stage->params->bounds;
    for (int k = 0; k < 3; k++) {
        middle[k] = stage->params->bounded ? (b[k] + b[3 + k]) / 2 : 0; /* of the local coordinates */
    }
}

static void divide(const ss_stage *stage, parts *p) {
    double middle[3], sum = 0;
    middle_of(stage, middle);
    for (uint32_t i = 0; i < p->count; i++) {
        ss_light_part(stage->light, middle, stage->params->sub_lights, i, &p->part[i].light,
                      &p->part[i].weight);
        sum += p->part[i].weight;
    }
    for (uint32_t i = 0; i < p->count; i++) {
        p->part[i].weight = sum > 0 ? p->part[i].weight / sum : 1.0 / p->count;
    }
}

softshadow_status ss_parts_build(const ss_stage *stage, const ss_technique *part, void **state) {
    const uint32_t count = ss_light_part_count(stage->light, stage->params->sub_lights);
    parts *p = ss_alloc(1, sizeof *p + count * sizeof *p->part);
    *state = NULL;
    if (!p) return ss_fail(SOFTSHADOW_E_MEMORY, "build.sub_lights: out of memory for %u", count);
    p->technique = part, p->count = count, p->whole = *stage->light;
    divide(stage, p);
    softshadow_status status = SOFTSHADOW_OK;
    for (uint32_t i = 0; i < count && !status; i++) {
        ss_stage own = *stage;
        own.light = &p->part[i].light;
        status = part->build(&own, &p->part[i].state);
        if (!status) status = ss_progress_add(stage->progress, 0);
    }
    if (status) ss_parts_destroy(p);
    else *state = p;
    return status;
}

void ss_parts_destroy(void *state) {
    parts *p = state;
    for (uint32_t i = 0; p && i < p->count; i++) {
        if (p->part[i].state) p->technique->destroy(p->part[i].state);
    }
    ss_free(p);
}

/* ---- asking --------------------------------------------------------------------------------- */

/* Points inside a sphere see all of it, also where its parts do not reach. */
static void see_from_inside(const parts *p, const double at[3], double *seen) {
    const double reach = p->whole.radius * SS_LIGHT_INSIDE;
    double square = 0;
    for (int k = 0; k < 3; k++) {
        const double d = at[k] - p->whole.centre[k];
        square += d * d;
    }
    if (p->whole.type == SOFTSHADOW_SPHERE && square <= reach * reach) *seen = 1;
}

/* Each point once. Which points took taps only the parts know: those of the one that has most. */
static void count(const float *visibility, size_t n, uint64_t traced, ss_counts *counts) {
    for (size_t i = 0; i < n; i++) {
        const float seen = visibility[i];
        counts->lit += seen == 1, counts->umbra += seen == 0;
        counts->penumbra += seen > 0 && seen < 1;
    }
    counts->traced += traced;
}

softshadow_status ss_parts_query(const ss_stage *stage, const void *state, const ss_point *points,
                                 size_t n, float *visibility, float *bound, ss_arena *scratch,
                                 ss_counts *counts) {
    const parts *p = state;
    const ss_technique *part = p->technique;
    if (p->count == 1) {
        return part->query(stage, p->part[0].state, points, n, visibility, bound, scratch, counts);
    }
    float *seen = ss_arena_alloc(scratch, n, sizeof *seen);
    double *sum = ss_arena_alloc(scratch, n, sizeof *sum);
    bool *marked = ss_arena_alloc(scratch, n, sizeof *marked);
    if (!seen || !sum || !marked)
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu points", n);
    for (size_t i = 0; i < n; i++) sum[i] = 0, marked[i] = false;
    uint64_t traced = 0;
    for (uint32_t k = 0; k < p->count; k++) {
        ss_counts own = {0};
        const softshadow_status status = part->query(stage, p->part[k].state, points, n, seen,
                                                     bound, scratch, &own);
        if (status) return status;
        for (size_t i = 0; i < n; i++) {
            sum[i] += p->part[k].weight * (double)fabsf(seen[i]);
            marked[i] |= signbit(seen[i]) != 0;
        }
        traced = own.traced > traced ? own.traced : traced;
    }
    for (size_t i = 0; i < n; i++) {
        see_from_inside(p, points[i].p, &sum[i]);
        visibility[i] = (float)(sum[i] < 1 ? sum[i] : 1);
    }
    count(visibility, n, traced, counts);
    for (size_t i = 0; i < n; i++) visibility[i] = marked[i] ? -visibility[i] : visibility[i];
    return SOFTSHADOW_OK;
}

void ss_parts_query_places(const void *state, const ss_places *places, size_t n, float *visibility,
                           ss_counts *counts) {
    const parts *p = state;
    if (p->count == 1) {
        p->technique->query_places(p->part[0].state, places, n, visibility, counts);
        return;
    }
    double sum[SS_PLACES] = {0};
    for (uint32_t k = 0; k < p->count; k++) {
        float seen[SS_PLACES];
        ss_counts own = {0};
        p->technique->query_places(p->part[k].state, places, n, seen, &own);
        for (size_t i = 0; i < n; i++) sum[i] += p->part[k].weight * (double)seen[i];
    }
    for (size_t i = 0; i < n; i++) {
        const double at[3] = {places->at[0][i], places->at[1][i], places->at[2][i]};
        see_from_inside(p, at, &sum[i]);
        visibility[i] = (float)(sum[i] < 1 ? sum[i] : 1);
    }
    count(visibility, n, 0, counts);
}

/* By a part that has something to blur, which is what marks points. */
softshadow_status ss_parts_finish(const ss_stage *stage, const void *state, const ss_image *image,
                                  ss_pool *pool, ss_counts *counts) {
    const parts *p = state;
    uint32_t k = 0;
    while (k + 1 < p->count && !((const ss_light_maps *)p->part[k].state)->plane) k++;
    return p->technique->finish(stage, p->part[k].state, image, pool, counts);
}

/* ---- the same on a GPU ---------------------------------------------------------------------- */

softshadow_status ss_parts_tables(void *state, struct ss_raster_question *question) {
    parts *p = state;
    question->glsl = NULL;
    return p->count == 1 ? p->technique->tables(p->part[0].state, question) : SOFTSHADOW_OK;
}

void ss_parts_look(const void *state, const ss_point *points, size_t n, float (*looks)[4]) {
    const parts *p = state;
    p->technique->look(p->part[0].state, points, n, looks);
}

void ss_parts_horizon(const ss_stage *stage, const void *state, const ss_point *points, size_t n,
                      float *visibility, float *bound, ss_counts *counts) {
    const parts *p = state;
    p->technique->horizon(stage, p->part[0].state, points, n, visibility, bound, counts);
}

/* ---- showing -------------------------------------------------------------------------------- */

size_t ss_parts_bytes(const void *state) {
    const parts *p = state;
    size_t sum = sizeof *p + p->count * sizeof *p->part;
    for (uint32_t i = 0; i < p->count; i++) sum += p->technique->bytes(p->part[i].state);
    return sum;
}

uint32_t ss_parts_map_count(const void *state) {
    const parts *p = state;
    uint32_t sum = 0;
    for (uint32_t i = 0; i < p->count; i++) sum += p->technique->map_count(p->part[i].state);
    return sum;
}

void ss_parts_get_map(const void *state, uint32_t index, softshadow_map *map) {
    const parts *p = state;
    uint32_t i = 0;
    for (uint32_t own; index >= (own = p->technique->map_count(p->part[i].state)); i++)
        index -= own;
    p->technique->get_map(p->part[i].state, index, map);
}

uint64_t ss_parts_silhouettes(const void *state) {
    const parts *p = state;
    uint64_t sum = 0;
    for (uint32_t i = 0; i < p->count; i++)
        sum += p->technique->silhouette_edges(p->part[i].state);
    return sum;
}

/* Those that are in no part's maps are no more than the least. */
uint64_t ss_parts_culled(const void *state) {
    const parts *p = state;
    uint64_t least = UINT64_MAX;
    for (uint32_t i = 0; i < p->count; i++) {
        const uint64_t own = p->technique->casters_culled(p->part[i].state);
        least = own < least ? own : least;
    }
    return least;
}
