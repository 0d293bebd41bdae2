/* Points along a Morton curve, of which a timing takes as many stretches as it has time for: rays
 * and maps cost a point the same however many are asked. */
#ifndef CLI_BENCH_STRETCHES_H
#define CLI_BENCH_STRETCHES_H

#include "peer.h"
#include "scenes.h"

typedef struct bench_stretches {
    float (*at)[3], (*some)[3]; /* all along the curve; those that were taken */
    float *visibility;          /* room for answers to all */
    size_t count, taken;
} bench_stretches;

bool bench_stretches_make(bench_stretches *stretches, const bench_points *points);
void bench_stretches_free(bench_stretches *stretches);
/* Takes about so many points, evenly: every so-and-so-many-th stretch. */
void bench_stretches_take(bench_stretches *stretches, double wanted);

/* Seconds that the peer takes a point, of as many as make a timing of a few tenths of a second when
 * each gets so many rays. */
bool bench_peer_time(const peer *with, const softshadow_light *light, const peer_style *style,
                     uint32_t rays, bench_stretches *stretches, double *seconds);
/* The flag and the order of the samples that are faster here. */
bool bench_peer_choose(const peer *with, const softshadow_light *light, bench_stretches *stretches,
                       peer_style *style);

#endif
