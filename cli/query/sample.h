/* A sample of a stream: every point of it is as likely to be kept, however many come (reservoir
 * sampling, Vitter's algorithm R). The same stream gives the same sample. */
#ifndef CLI_QUERY_SAMPLE_H
#define CLI_QUERY_SAMPLE_H

#include "../points/points.h"

typedef struct query_sample {
    size_t room, count;
    uint64_t seen, state;
    uint32_t type;
    char *positions;
    float *normals;
} query_sample;

bool query_sample_init(query_sample *sample, size_t room, const points_source *source,
                       cli_error *error);
/* Points that were answered NaN are passed over. */
void query_sample_add(query_sample *sample, const points_block *block, const float *visibility);
void query_sample_free(query_sample *sample);

#endif
