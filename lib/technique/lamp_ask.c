/* Questions of the techniques that look at all of the lamp. */
#include "technique/lamp_ask.h"

#include <string.h>

#include "base/status.h"

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

softshadow_status ss_lamp_ask(ss_light_maps *maps, const ss_lamp *lamp, const ss_pyramid *pyramid,
                              const char *glsl, ss_raster_question *question) {
    softshadow_status status = ss_light_maps_ask(maps, glsl, question);
    if (status || !question->glsl) return status;
    for (uint32_t i = 0; i < maps->frames.count; i++) {
        ss_lamp_words(&lamp[i], ss_light_maps_words(maps, i));
    }
    status = pack(maps, pyramid);
    if (status) return status;
    size_t count = 0;
    for (uint32_t i = 0; i < maps->frames.count; i++) count += pyramid[i].count;
    question->parts = true;
    question->table[question->tables++] =
        (ss_raster_table){maps->packed, count * sizeof *maps->packed};
    return SOFTSHADOW_OK;
}
