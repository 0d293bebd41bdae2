/* Visibility by brute force in double: every triangle against every sample, without a tree. */
#ifndef CLI_BENCH_BRUTE_H
#define CLI_BENCH_BRUTE_H

#include "peer.h"

enum { BRUTE_MOST = 2000 }; /* triangles: what takes seconds */

typedef struct brute brute;
/* samples: a multiple of 64. NULL without memory. */
brute *brute_create(const peer_mesh *mesh, const softshadow_light *light, uint32_t samples);
void brute_destroy(brute *brute);
/* The seen fraction for one point; turn: how its samples are turned (a disk) or shifted, 0..1. */
double brute_visible(brute *brute, const float point[3], double turn);

#endif
