/* The peer: what an expert would write today with Embree 3, tuned as well as we could: sixteen
 * light samples of one point a packet (rtcOccluded16), points in Morton order, build quality HIGH,
 * not robust, denormals flushed; samples are a spiral turned for every point [Vog79], on a
 * rectangle a shifted lattice. Embree is loaded when the first peer is made, never linked. */
#ifndef CLI_BENCH_PEER_H
#define CLI_BENCH_PEER_H

#include <softshadow.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "../error.h"

typedef struct peer peer;

/* Triangles in single precision, as both sides get them. */
typedef struct peer_mesh {
    const float *positions; /* packed; one more float must be readable behind the last vertex */
    const uint32_t *indices;
    size_t vertex_count, triangle_count;
} peer_mesh;

/* How the peer spends its rays. */
typedef struct peer_style {
    uint32_t samples;
    bool coherent;  /* the flag that Embree is told */
    bool clustered; /* a packet's samples lie together; else it is a ring of the spiral */
    bool rim;       /* 16 rays to the light's rim first; if all agree, that is the answer */
    bool truth;     /* another sequence, for references */
} peer_style;

/* The mesh's arrays are shared and must outlive the peer. robust: Embree's watertight tests, for
 * references. On an error *out is NULL. */
bool peer_create(peer **out, const peer_mesh *mesh, bool robust, cli_error *error);
void peer_destroy(peer *peer); /* NULL is fine */
/* Seconds of processor time that building took: device and loading apart. */
double peer_build_seconds(const peer *peer);
/* What its tree holds. */
uint64_t peer_bytes(const peer *peer);

/* The nearest triangle that the ray meets, or UINT32_MAX; its distance in units of the direction.
 */
uint32_t peer_first_hit(const peer *peer, const double origin[3], const double direction[3],
                        double *distance);

/* A picture of side x side rays from one place: through texel (x, y), in -1..1, goes middle + x *
 * x[] + y * y[]. */
typedef struct peer_rays {
    double origin[3], middle[3], x[3], y[3];
    uint32_t side; /* a multiple of 4 */
} peer_rays;
/* How far along its ray each texel's nearest hit is, row after row, the lowest y first; infinite:
 * none. Coherent packets of 4 x 4 rays. */
void peer_depth(const peer *peer, const peer_rays *rays, float *out);

/* Sample tables for a light and a count; reused for all batches. */
typedef struct peer_samples peer_samples;
peer_samples *peer_samples_create(const softshadow_light *light, const peer_style *style);
/* The same set, turned and shifted otherwise for every point: an independent second answer. */
void peer_samples_turn(peer_samples *samples);
void peer_samples_free(peer_samples *samples);

/* The seen fraction for count points, in the order given. */
void peer_query(const peer *peer, const softshadow_light *light, const peer_samples *samples,
                const float (*points)[3], size_t count, float *visibility);

#endif
