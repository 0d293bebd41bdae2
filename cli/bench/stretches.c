/* What timings of the peer share. */
#include "stretches.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "clock.h"

/* A stretch is long enough that neighbours share what caches hold, and there are so many that they
 * are a fair sample: costs a point differ by a thousand between the ground and a penumbra. */
enum { CHUNK = 128, STRETCHES = 32 };

/* What the peer shoots in one timing: enough that a timing takes a few tenths of a second. */
#define RAYS_A_TIMING 12e6

bool bench_stretches_make(bench_stretches *s, const bench_points *points) {
    const size_t n = points->count;
    uint32_t *order = bench_morton((const float(*)[3])points->at, n);
    *s = (bench_stretches){malloc(n * sizeof *s->at), malloc(n * sizeof *s->some),
                           malloc(n * sizeof *s->visibility), n, 0};
    const bool fine = order && s->at && s->some && s->visibility;
    for (size_t i = 0; fine && i < n; i++) memcpy(s->at[i], points->at[order[i]], sizeof *s->at);
    free(order);
    return fine;
}

void bench_stretches_free(bench_stretches *s) {
    free(s->at);
    free(s->some);
    free(s->visibility);
    *s = (bench_stretches){0};
}

void bench_stretches_take(bench_stretches *s, double wanted) {
    const double share = wanted / (double)s->count;
    const size_t step = share >= 1 ? 1 : (size_t)(1 / share);
    const size_t chunk = (size_t)fmin(CHUNK, fmax(1, wanted / STRETCHES));
    s->taken = 0;
    for (size_t from = 0; from < s->count; from += chunk) {
        const size_t to = from + chunk < s->count ? from + chunk : s->count;
        if (from / chunk % step) continue;
        memcpy(s->some + s->taken, s->at + from, (to - from) * sizeof *s->some);
        s->taken += to - from;
    }
}

bool bench_peer_time(const peer *with, const softshadow_light *light, const peer_style *style,
                     uint32_t rays, bench_stretches *s, double *seconds) {
    peer_samples *samples = peer_samples_create(light, style);
    if (!samples) return false;
    bench_stretches_take(s, RAYS_A_TIMING / rays);
    const double start = bench_clock();
    peer_query(with, light, samples, (const float(*)[3])s->some, s->taken, s->visibility);
    *seconds = (bench_clock() - start) / (double)s->taken;
    peer_samples_free(samples);
    return true;
}

bool bench_peer_choose(const peer *with, const softshadow_light *light, bench_stretches *s,
                       peer_style *best) {
    double least = INFINITY, seconds[3];
    for (int i = 0; i < 4; i++) {
        const peer_style style = {.samples = 256, .coherent = i & 1, .clustered = i >> 1};
        for (int k = 0; k < 3; k++)
            if (!bench_peer_time(with, light, &style, 1024, s, &seconds[k])) return false;
        const double middle = bench_median(seconds, 3);
        if (middle < least) least = middle, *best = style;
    }
    return true;
}
