/* The light-space frame: how a map sees the scene from the light's centre.
 *
 * One projective map serves every light. With z the distance along the axis, measured from a
 * reference plane D in front of the light (D infinite under a sun), and s = 1 / (1 + z / D):
 *     X = x s,  Y = y s,  h = z s.
 * Orthographic frames (1/D = 0) keep h = z, linear depth; in perspective h = D - D^2 / (distance
 * from the light): the reciprocal of depth, shifted and scaled so that floats hold it however far
 * the light is. Lines stay lines and planes stay planes, also in h: so depth interpolates, and the
 * papers' similar triangles are exact everywhere: a light of radius R seen past an occluder at h_v
 * makes, at a receiver at h_p, a penumbra of half width
 *     rate (h_p - h_v) in X and Y,  rate = R / D  (sun: tan alpha).
 * Map coordinates are X and Y in texels: texel (i, j) has its centre at (i + 1/2, j + 1/2). */
#ifndef SS_MAP_FRAME_H
#define SS_MAP_FRAME_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/parallel.h"
#include "scene/point.h"
#include "scene/scene.h"

#define SS_MAP_FAR 1e30f /* the depth of a texel that holds nothing */
/* Relative: depths within eight units in the last place are one surface. */
#define SS_MAP_ALIKE 0x1p-21f
/* Of a layer, where the next begins. */
static inline float ss_map_below(float h) { return h + SS_MAP_ALIKE * fabsf(h); }
#define SS_MAP_FACES 6

typedef struct ss_frame {
    double origin[3];              /* local: where the axis meets the reference plane */
    double x[3], y[3], z[3];       /* unit axes; z points away from the light */
    double inverse;                /* 1 / D */
    double nearest;                /* z of the near plane: nothing before it is seen */
    double rate;                   /* see above */
    double low[2], texel;          /* X = low + texel * map coordinate */
    double far_h;                  /* h of the farthest receiver that is expected */
    double near_h;                 /* h of the nearest caster */
} ss_frame;

/* All frames of one light: one, or the faces of a cube around it. */
typedef struct ss_frames {
    uint32_t count;      /* 0: nothing can cast here */
    uint32_t resolution; /* every face is resolution x resolution texels */
    bool cube;           /* the points choose their face by direction */
    ss_frame face[SS_MAP_FACES];
    int8_t face_of[SS_MAP_FACES]; /* cube: the frame of direction 2 axis + (negative), -1: none */
    double axes[3][3], centre[3]; /* cube: its axes, and the light */
    double radius;                /* the light's, in the measure of rate */
    int rung;                     /* base/cpu.h: how points are looked up */
} ss_frames;

/* What the fit goes by. Both boxes local. With `margin` the map reaches a penumbra's width beyond
 * where points are asked, for those who look at all that is before the light. */
typedef struct ss_fit {
    const ss_world *world;
    const ss_light *light;
    uint32_t resolution;
    bool bounded;
    double bounds[6];
    bool margin;
} ss_fit;

/* Fits frames around what can matter: casters between the light and the bounds. A cube only where
 * one frame cannot see it all; faces without casters or without points are left out. */
softshadow_status ss_frames_fit(ss_frames *out, const ss_fit *fit, ss_pool *pool);

/* Local to map coordinates: out = (column, row, h). false: before the near plane. */
static inline bool ss_frame_project(const ss_frame *frame, const double p[3], double out[3]) {
    double d[3], c[3];
    for (int k = 0; k < 3; k++) d[k] = p[k] - frame->origin[k];
    c[0] = d[0] * frame->x[0] + d[1] * frame->x[1] + d[2] * frame->x[2];
    c[1] = d[0] * frame->y[0] + d[1] * frame->y[1] + d[2] * frame->y[2];
    c[2] = d[0] * frame->z[0] + d[1] * frame->z[1] + d[2] * frame->z[2];
    if (!(c[2] > frame->nearest)) return false;
    const double s = 1 / (1 + c[2] * frame->inverse);
    out[0] = (c[0] * s - frame->low[0]) / frame->texel;
    out[1] = (c[1] * s - frame->low[1]) / frame->texel;
    out[2] = c[2] * s;
    return true;
}

/* Does the light, looking along z, see X to the left of where Y has it? */
bool ss_frame_mirrored(const ss_frame *frame);

/* Half a penumbra's width in texels per unit of h. */
static inline double ss_frame_rate(const ss_frame *frame) { return frame->rate / frame->texel; }

/* A length along the axis at depth h, as a difference of h. */
static inline double ss_frame_step(const ss_frame *frame, double h, double length) {
    const double s = 1 - h * frame->inverse;
    return length * s * s;
}

/* Row-major: host coordinates to clip space, x and y in -1..1 across the map, z/w linear in h, from
 * near_h (-1) to far_h (1): h = depth[0] + depth[1] z/w. */
void ss_frame_depth(const ss_frame *frame, double depth[2]);
void ss_frame_matrix(const ss_frame *frame, const ss_world *world, uint32_t resolution,
                     double matrix[16]);

/* Points in map coordinates, a block at a time, up to whole eights. A point that no map can shadow
 * looks at the corner texel, which holds nothing, at h = -SS_MAP_FAR. */
#define SS_LOOKS SS_PLACES
typedef struct ss_looks {
    float x[SS_LOOKS], y[SS_LOOKS], h[SS_LOOKS];
    uint32_t base[SS_LOOKS]; /* texels before the point's face */
    uint8_t face[SS_LOOKS];
    const ss_places *places; /* the same as they were given */
    double nearest; /* the least squared distance of any of them to the light; INFINITY: a sun */
} ss_looks;
void ss_frames_look(const ss_frames *frames, const ss_places *places, size_t n, ss_looks *out);

#endif
