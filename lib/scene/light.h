/* Lights, their measure, and a light as one point sees it.
 *
 * Whatever its type, a light seen from p is a flat shape: a centre c - p and two half axes a, b, so
 * that its points are  c + s a + t b  with (s, t) in the square [-1,1]^2 (rect) or the unit disk
 * (disk, sphere, sun). Every engine samples that shape and nothing else (design: techniques.md). */
#ifndef SS_SCENE_LIGHT_H
#define SS_SCENE_LIGHT_H

#include <stdbool.h>
#include <stdint.h>

#include "softshadow.h"

/* A checked light in LOCAL coordinates (see scene.h), in double. */
typedef struct ss_light {
    uint32_t type;
    double centre[3];    /* sun: unused */
    double normal[3];    /* unit; sun: TOWARDS the sun; sphere: unused */
    double u[3], v[3];   /* half axes: rect, disk; sun: of the disk at distance 1 */
    double radius;       /* sphere: radius; disk: radius, the longer half axis; sun: tan(angle); rect: half diagonal */
    bool point;          /* radius 0: the hard shadow */
    bool ellipse;        /* a disk whose half axes differ */
    uint32_t profile_count; /* 0: uniform */
    float *profile;         /* owned by the scene */
    double profile_mean;    /* mean of the profile over the disk's area */
} ss_light;

#define SS_LIGHT_INSIDE  (1 + 0x1p-10) /* a point this near a sphere light, in radii, sees all of it */
#define SS_LIGHT_EDGE_ON 0x1p-46 /* sine under which a flat light is seen as a line: rounding of doubles */

/* What one point sees of a light. */
typedef struct ss_view {
    double centre[3]; /* from the point to the light's centre; sun: the unit direction */
    double a[3], b[3]; /* half axes */
    double normal[3]; /* unit normal of the shape, on the light's emitting side (sphere, sun: towards the point) */
    double t_end;     /* occluders count for 0 < t < t_end on  p + t (c + s a + t b); sun: INFINITY */
    bool disk;        /* the shape: unit disk, or square */
    bool inside;      /* inside a sphere light: sees all of it */
    bool edge_on;     /* the point lies in a flat light's plane: sees it as a line; see ss_light_view */
} ss_view;

/* The light as p (local) sees it. Points in the plane of a flat light: edge_on, and the fraction is
 * still that of the segments to the light's points (uniform); its weight under solid_angle and
 * irradiance is zero, so V = 0 there (0/0 = 0). */
void ss_light_view(const ss_light *light, const double p[3], ss_view *view);

/* How much the part at (s, t) of the shape counts, up to a constant factor: profile, solid angle,
 * cosine at the receiver (normal unit or NULL), emission side. 0 for a part below the horizon of a
 * given normal ONLY under IRRADIANCE; under the other weightings such parts count but are hidden:
 * see ss_light_below. */
double ss_light_weight(const ss_light *light, const ss_view *view, uint32_t weighting,
                       const double *normal, double s, double t);
/* Is that part of the light below the horizon of the normal (on it counts as below)? */
static inline bool ss_light_below(const ss_view *view, const double *normal, double s, double t) {
    double height = 0;
    for (int k = 0; k < 3; k++) {
        height += normal[k] * (view->centre[k] + s * view->a[k] + t * view->b[k]);
    }
    return height <= 0;
}
/* Does the whole light stand above the horizon of p and its unit normal? A certain yes; "no" may be
 * undue by rounding. */
bool ss_light_above(const ss_light *light, const double p[3], const float normal[3]);
/* A box that holds the light. A sphere is seen as a disk that sticks out of it, but segments are
 * only followed to where they would enter the sphere. The sun's is infinite, and beside every
 * scene. */
void ss_light_box(const ss_light *light, double low[3], double high[3]);
/* The radial profile at rho in 0..1, linearly interpolated. 1 for a uniform light. */
double ss_light_profile(const ss_light *light, double rho);

/* Is a disk given by its half axes, as an ellipse? */
static inline bool ss_light_is_ellipse(const softshadow_light *light) {
    const double *u = light->u, *v = light->v;
    return light->type == SOFTSHADOW_DISK && light->radius == 0 &&
           (u[0] != 0 || u[1] != 0 || u[2] != 0 || v[0] != 0 || v[1] != 0 || v[2] != 0);
}

/* Two unit vectors that complete the unit vector n to an orthogonal frame; permuting the axes of n
 * permutes them (no cross product, so no handedness), which keeps promise 3 of the ABI. */
void ss_basis(const double n[3], double a[3], double b[3]);

#endif
