/* Reservoir sampling of points. */
#include "sample.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static size_t position_size(uint32_t type) { return 3 * (type == SOFTSHADOW_F64 ? 8 : 4); }

bool query_sample_init(query_sample *sample, size_t room, const points_source *source,
                       cli_error *error) {
    *sample = (query_sample){.room = room, .type = source->type};
    sample->positions = calloc(room, position_size(source->type));
    if (source->normals) sample->normals = calloc(room, 3 * sizeof(float));
    if (sample->positions && (sample->normals || !source->normals)) return true;
    query_sample_free(sample);
    return cli_fail(error, CLI_FAILED, "--verify: memory for %zu points ran out", room);
}

/* splitmix64: a counter, well mixed. */
static uint64_t next(uint64_t *state) {
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

void query_sample_add(query_sample *sample, const points_block *block, const float *visibility) {
    size_t size = position_size(sample->type);
    for (size_t i = 0; i < block->count; i++) {
        if (isnan(visibility[i])) continue;
        uint64_t place = sample->seen++;
        if (place >= sample->room) place = next(&sample->state) % sample->seen;
        if (place >= sample->room) continue;
        memcpy(sample->positions + place * size, (const char *)block->positions + i * size, size);
        if (sample->normals)
            memcpy(sample->normals + 3 * place, block->normals + 3 * i, 3 * sizeof(float));
        if (sample->count <= place) sample->count = (size_t)place + 1;
    }
}

void query_sample_free(query_sample *sample) {
    free(sample->positions);
    free(sample->normals);
    *sample = (query_sample){0};
}
