/* Low-discrepancy sets on a disk and on a square. based on: [Vog79], the sunflower spiral: radius
 * sqrt((i + x)/N), angle i times the golden angle, with x and the first angle random for each
 * point; its square cousin, the lattice (i/N, i/phi) mod 1 with a random shift [CP76]; and for the
 * judge the (0,2)-sequence of [Sob67] under the hashed nested scrambling of [LK11], as [Bur20]
 * writes it. */
#include "trace/samples.h"

#include <math.h>

#include "base/memory.h"
#include "base/status.h"

#define GOLDEN 0.61803398874989484820 /* 1/phi: the golden angle is 2 pi (1 - 1/phi) */
#define TAU 6.28318530717958647693

struct ss_samples {
    uint32_t count, padded;
    bool disk;
    ss_sequence sequence;
    float *x, *y;         /* spiral on a disk: cosine, sine; lattice: both coordinates */
    float *rank;          /* spiral: number along it */
    uint32_t *bits_x, *bits_y; /* Sobol', before scrambling */
};

uint64_t ss_hash(uint64_t x) {
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

static uint32_t reversed(uint32_t x) {
    x = x >> 16 | x << 16;
    x = (x & 0xff00ff00u) >> 8 | (x & 0x00ff00ffu) << 8;
    x = (x & 0xf0f0f0f0u) >> 4 | (x & 0x0f0f0f0fu) << 4;
    x = (x & 0xccccccccu) >> 2 | (x & 0x33333333u) << 2;
    return (x & 0xaaaaaaaau) >> 1 | (x & 0x55555555u) << 1;
}

/* The second coordinate of the (0,2)-sequence: direction numbers are rows of Pascal's triangle mod
 * 2. */
static uint32_t sobol_second(uint32_t i) {
    uint32_t bits = 0;
    for (uint32_t v = 1u << 31; i; i >>= 1, v ^= v >> 1) {
        if (i & 1) bits ^= v;
    }
    return bits;
}

/* ---- Packets: the sets are cut like a k-d tree, so that sixteen samples lie close together. Turning,
 * shifting and scrambling keep most of that. ---- */

typedef struct sample {
    float at[2];
    uint32_t rank;
} sample;

static void swap(sample *a, sample *b) {
    const sample kept = *a;
    *a = *b, *b = kept;
}

/* Moves the `wanted` samples that are lowest along the axis to the front. */
static void select_lowest(sample *all, uint32_t count, uint32_t wanted, int axis) {
    uint32_t low = 0, high = count;
    while (high - low > 1) {
        const float pivot = all[low + (high - low) / 2].at[axis];
        uint32_t below = low, i = low, above = high;
        while (i < above) {
            if (all[i].at[axis] < pivot) swap(&all[i++], &all[below++]);
            else if (all[i].at[axis] > pivot) swap(&all[i], &all[--above]);
            else i++;
        }
        if (wanted < below) high = below;
        else if (wanted > above) low = above;
        else return;
    }
}

static int longer_axis(const sample *all, uint32_t count) {
    float low[2] = {all->at[0], all->at[1]}, high[2] = {all->at[0], all->at[1]};
    for (uint32_t i = 1; i < count; i++) {
        for (int k = 0; k < 2; k++) {
            low[k] = fminf(low[k], all[i].at[k]), high[k] = fmaxf(high[k], all[i].at[k]);
        }
    }
    return high[1] - low[1] > high[0] - low[0];
}

/* All packets but the last are full. */
static void pack(sample *all, uint32_t count) {
    while (count > 16) {
        const uint32_t lower = (count + 15) / 16 / 2 * 16;
        select_lowest(all, count, lower, longer_axis(all, count));
        pack(all, lower);
        all += lower, count -= lower;
    }
}

/* Where sample i of the set lies before it is turned, shifted or scrambled. */
static sample place(const ss_samples *samples, uint32_t i) {
    const double turns = i * GOLDEN - floor(i * GOLDEN);
    const double radius = sqrt((i + 0.5) / samples->count);
    if (samples->sequence == SS_SOBOL) {
        return (sample){{(float)reversed(i), (float)sobol_second(i)}, i};
    }
    if (!samples->disk) return (sample){{(float)((double)i / samples->count), (float)turns}, i};
    return (sample){{(float)(radius * cos(TAU * turns)), (float)(radius * sin(TAU * turns))}, i};
}

static void fill(ss_samples *samples, sample *order) {
    for (uint32_t i = 0; i < samples->count; i++) order[i] = place(samples, i);
    pack(order, samples->count);
    for (uint32_t k = 0; k < samples->padded; k++) {
        const uint32_t i = order[k < samples->count ? k : samples->count - 1].rank;
        if (samples->sequence == SS_SOBOL) {
            samples->bits_x[k] = reversed(i), samples->bits_y[k] = sobol_second(i);
            continue;
        }
        const double turns = i * GOLDEN - floor(i * GOLDEN);
        samples->x[k] = (float)(samples->disk ? cos(TAU * turns) : (double)i / samples->count);
        samples->y[k] = (float)(samples->disk ? sin(TAU * turns) : turns);
        if (samples->rank) samples->rank[k] = (float)i;
    }
}

static bool reserve(ss_samples *samples) {
    const size_t n = samples->padded;
    if (samples->sequence == SS_SOBOL) {
        samples->bits_x = ss_alloc(n, sizeof(uint32_t)),
        samples->bits_y = ss_alloc(n, sizeof(uint32_t));
        return samples->bits_x && samples->bits_y;
    }
    samples->x = ss_alloc(n, sizeof(float)), samples->y = ss_alloc(n, sizeof(float));
    if (samples->disk) samples->rank = ss_alloc(n, sizeof(float));
    return samples->x && samples->y && (samples->rank || !samples->disk);
}

softshadow_status ss_samples_create(ss_samples **out, uint32_t count, bool disk,
                                    ss_sequence sequence) {
    *out = NULL;
    ss_samples *samples = ss_alloc(1, sizeof *samples);
    sample *order = ss_alloc(count, sizeof *order);
    if (samples && order) {
        const size_t padded = ((size_t)count + 15) / 16 * 16;
        *samples = (ss_samples){.count = count, .padded = (uint32_t)padded, .disk = disk,
                                .sequence = sequence};
        if (reserve(samples)) {
            fill(samples, order);
            *out = samples;
        }
    }
    ss_free(order);
    if (*out) return SOFTSHADOW_OK;
    ss_samples_destroy(samples);
    return ss_fail(SOFTSHADOW_E_MEMORY, "samples: out of memory for %u of them", count);
}

void ss_samples_destroy(ss_samples *samples) {
    if (!samples) return;
    ss_free(samples->x), ss_free(samples->y), ss_free(samples->rank);
    ss_free(samples->bits_x), ss_free(samples->bits_y);
    ss_free(samples);
}

uint32_t ss_samples_count(const ss_samples *samples) { return samples->count; }

size_t ss_samples_bytes(const ss_samples *samples) {
    return sizeof *samples + (size_t)samples->padded * (samples->rank ? 3 : 2) * sizeof(float);
}

static float fraction(uint32_t bits) { return (float)(bits >> 8) * 0x1p-24f; }

ss_turn ss_samples_turn(uint64_t hash) {
    const uint64_t more = ss_hash(hash ^ 0x5851f42d4c957f2du);
    const double angle = TAU * (double)(uint32_t)hash * 0x1p-32;
    return (ss_turn){.cosine = (float)cos(angle), .sine = (float)sin(angle),
                     .x = fraction((uint32_t)(hash >> 32)), .y = fraction((uint32_t)hash),
                     .scramble = {(uint32_t)more, (uint32_t)(more >> 32)}};
}

static void spiral(const ss_samples *samples, const ss_turn *turn, uint32_t first,
                   float s[restrict 16], float t[restrict 16]) {
    const float *restrict x = samples->x + first, *restrict y = samples->y + first;
    const float *restrict rank = samples->rank + first;
    const float share = 1 / (float)samples->count;
    const float cosine = turn->cosine, sine = turn->sine, shift = turn->x;
    for (int i = 0; i < 16; i++) {
        const float area = (rank[i] + shift) * share;
        const float radius = sqrtf(area < 1 ? area : 1); /* rounding may pass the rim */
        s[i] = radius * (cosine * x[i] - sine * y[i]);
        t[i] = radius * (sine * x[i] + cosine * y[i]);
    }
}

static void lattice(const ss_samples *samples, const ss_turn *turn, uint32_t first,
                    float s[restrict 16], float t[restrict 16]) {
    const float *restrict x = samples->x + first, *restrict y = samples->y + first;
    const float shift_x = turn->x, shift_y = turn->y;
    for (int i = 0; i < 16; i++) {
        const float u = x[i] + shift_x, v = y[i] + shift_y; /* below 2 */
        s[i] = 2 * (u - (float)(int)u) - 1;
        t[i] = 2 * (v - (float)(int)v) - 1;
    }
}

/* Flips every bit by a hash of the bits above it. */
static uint32_t scrambled(uint32_t x, uint32_t seed) {
    x = reversed(x);
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return reversed(x);
}

static void sobol(const ss_samples *samples, const ss_turn *turn, uint32_t first, float s[16],
                  float t[16]) {
    for (int i = 0; i < 16; i++) {
        const float u =
            fraction(scrambled(samples->bits_x[first + (uint32_t)i], turn->scramble[0]));
        const float v =
            fraction(scrambled(samples->bits_y[first + (uint32_t)i], turn->scramble[1]));
        s[i] = samples->disk ? sqrtf(u) * cosf((float)TAU * v) : 2 * u - 1;
        t[i] = samples->disk ? sqrtf(u) * sinf((float)TAU * v) : 2 * v - 1;
    }
}

void ss_samples_get(const ss_samples *samples, const ss_turn *turn, uint32_t first,
                    float s[restrict 16], float t[restrict 16]) {
    if (samples->sequence == SS_SOBOL) sobol(samples, turn, first, s, t);
    else if (samples->disk) spiral(samples, turn, first, s, t);
    else lattice(samples, turn, first, s, t);
}
