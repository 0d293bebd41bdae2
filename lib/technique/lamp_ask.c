#include "technique/lamp_ask.h"

#include <string.h>

#include "base/memory.h"
#include "base/status.h"

softshadow_status ss_lamp_maps_build(const ss_stage *stage, const ss_light_maps_wish *wish,
                                     void **state) {
    softshadow_status status = ss_light_maps_build(stage, wish, state);
    if (status || stage->light->point) return status;
    ss_lamp_maps *lamps = *state;
    const ss_frames *frames = &lamps->maps.frames;
    const uint32_t side = frames->resolution;
    lamps->max_samples = stage->params->max_samples;
    for (uint32_t face = 0; face < frames->count && !status; face++) {
        const float *depth = lamps->maps.depth + (size_t)face * side * side;
        ss_lamp_make(&lamps->lamp[face], stage->light, &frames->face[face]);
        status = ss_pyramid_build(&lamps->pyramid[face], depth, side, stage->pool);
    }
    if (status) ss_lamp_maps_destroy(lamps), *state = NULL;
    return status;
}

void ss_lamp_maps_destroy(void *state) {
    ss_lamp_maps *lamps = state;
    if (!lamps) return;
    for (int i = 0; i < SS_MAP_FACES; i++) ss_pyramid_free(&lamps->pyramid[i]);
    ss_light_maps_destroy(lamps);
}

size_t ss_lamp_maps_bytes(const void *state) {
    const ss_lamp_maps *lamps = state;
    size_t sum = ss_light_maps_bytes(state);
    for (int i = 0; i < SS_MAP_FACES; i++) sum += lamps->pyramid[i].count * sizeof(float);
    return sum;
}

float ss_lamp_maps_hard(const ss_lamp_maps *lamps, const ss_looks *looks, size_t i) {
    const ss_looks one = {.x = {looks->x[i]}, .y = {looks->y[i]}, .h = {looks->h[i]},
                          .base = {looks->base[i]}};
    float hard;
    ss_light_maps_hard(&lamps->maps, &one, 1, &hard);
    return hard;
}

/* All faces' pyramids one after the other, without their level 0. */
static softshadow_status pack(ss_light_maps *maps, const ss_pyramid *pyramid) {
    size_t at = 0;
    for (uint32_t i = 0; i < maps->frames.count; i++) at += pyramid[i].count;
    ss_free(maps->packed);
    maps->packed = ss_alloc(at, sizeof *maps->packed);
    if (!maps->packed) return ss_fail(SOFTSHADOW_E_MEMORY, "build.resolution: out of memory");
    at = 0;
    for (uint32_t i = 0; i < maps->frames.count; i++) {
        memcpy(maps->packed + at, pyramid[i].own, pyramid[i].count * sizeof *maps->packed);
        at += pyramid[i].count;
    }
    return SOFTSHADOW_OK;
}

softshadow_status ss_lamp_maps_ask(ss_lamp_maps *lamps, const char *glsl,
                                   ss_raster_question *question) {
    ss_light_maps *maps = &lamps->maps;
    if (maps->light.point) return ss_light_maps_tables_hard(lamps, question);
    softshadow_status status = ss_light_maps_ask(maps, glsl, question);
    if (status || !question->glsl) return status;
    for (uint32_t i = 0; i < maps->frames.count; i++) {
        ss_lamp_words(&lamps->lamp[i], ss_light_maps_words(maps, i));
    }
    status = pack(maps, lamps->pyramid);
    if (status) return status;
    size_t count = 0;
    for (uint32_t i = 0; i < maps->frames.count; i++) count += lamps->pyramid[i].count;
    question->parts = true;
    question->table[question->tables++] =
        (ss_raster_table){maps->packed, count * sizeof *maps->packed};
    return SOFTSHADOW_OK;
}
