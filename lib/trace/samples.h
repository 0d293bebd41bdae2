/* Sample sets on a light: low-discrepancy, turned for each point by a hash, any count.
 * SPIRAL is what methods use; SOBOL shares no number with it and judges them. */
#ifndef SS_TRACE_SAMPLES_H
#define SS_TRACE_SAMPLES_H

#include <stdbool.h>
#include <stdint.h>

#include "softshadow.h"

typedef enum ss_sequence {
    SS_SPIRAL, /* disk: Vogel's spiral; square: a lattice of rank 1; both by the golden ratio */
    SS_SOBOL   /* Sobol' (0,2)-sequence, Owen-scrambled anew for each point */
} ss_sequence;

typedef struct ss_samples ss_samples;

/* count >= 1 samples on the unit disk, or on the square [-1,1]^2. */
softshadow_status ss_samples_create(ss_samples **out, uint32_t count, bool disk,
                                    ss_sequence sequence);
void ss_samples_destroy(ss_samples *samples);
uint32_t ss_samples_count(const ss_samples *samples);
size_t ss_samples_bytes(const ss_samples *samples);

/* How one point turns the set. Over all hashes each sample is uniform on the light, so that the
 * mean is right without bias. */
typedef struct ss_turn {
    float cosine, sine, x, y;
    uint32_t scramble[2];
} ss_turn;
ss_turn ss_samples_turn(uint64_t hash);

/* Samples first .. first + 15 (first a multiple of 16), which lie close together on the light;
 * those from count on are copies of the last: mask them. */
void ss_samples_get(const ss_samples *samples, const ss_turn *turn, uint32_t first, float s[16],
                    float t[16]);

/* A well mixed 64-bit number from another. */
uint64_t ss_hash(uint64_t x);

#endif
