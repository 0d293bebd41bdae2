/* What sky.c's two kinds of map share. Inside coverage/ only. */
#ifndef SS_COVERAGE_SKY_PARTS_H
#define SS_COVERAGE_SKY_PARTS_H

#include <math.h>

#include "base/vec.h"
#include "coverage/sky.h"

/* A triangle in the frame: lines that bound it and its nearness, as functions of what a texel's
 * middle stands for: under a sun of (x, y, 1), else of the unit vector there. */
typedef struct ss_sky_shape {
    double edge[3][3], nearness[3], constant;
    double rect[4], most;
} ss_sky_shape;

typedef struct ss_sky_span {
    uint32_t x0, x1, y0, y1; /* texels, all included */
} ss_sky_span;

static inline void ss_sky_to_frame(const ss_sky_frame *f, const double p[3], double out[3]) {
    double d[3];
    ss_sub(p, f->origin, d);
    for (int k = 0; k < 3; k++) out[k] = ss_dot(f->axis[k], d);
}

/* On the plane, from the frame. */
static inline void ss_sky_project(const ss_sky_frame *f, const double at[3], double out[2]) {
    const double s = f->sun ? 1 : 2 * f->distance / (at[2] + ss_length(at));
    out[0] = at[0] * s, out[1] = at[1] * s;
}

static inline double ss_sky_nearness_at(const ss_sky_frame *f, double r) {
    return f->distance * (f->distance - r) / r;
}

/* Lines are seen as arcs, which bulge out of the rectangle of their ends by less than a twelfth of
 * its diagonal squared. Gives by how much it grew. */
static inline double ss_sky_widen(const ss_sky_frame *f, double rect[4]) {
    const double longest = hypot(rect[2] - rect[0], rect[3] - rect[1]);
    const double bulge = (f->sun ? 0 : longest * longest / f->distance / 12) + SS_SKY_ROOM;
    for (int k = 0; k < 2; k++) rect[k] -= bulge, rect[2 + k] += bulge;
    return bulge;
}

static inline uint32_t ss_sky_texel_of(double at, double low, double texel, uint32_t count) {
    const double i = floor((at - low) / texel);
    return i < 0 ? 0 : i > count - 1 ? count - 1 : (uint32_t)i;
}

static inline ss_sky_span ss_sky_span_of(const ss_sky_frame *f, const double rect[4]) {
    return (ss_sky_span){ss_sky_texel_of(rect[0], f->low[0], f->texel, f->width),
                         ss_sky_texel_of(rect[2], f->low[0], f->texel, f->width),
                         ss_sky_texel_of(rect[1], f->low[1], f->texel, f->height),
                         ss_sky_texel_of(rect[3], f->low[1], f->texel, f->height)};
}

static inline bool ss_sky_is_small(const ss_sky_span *s, uint32_t most) {
    return s->x1 - s->x0 < most && s->y1 - s->y0 < most;
}

/* What a texel's middle stands for; unit: 1 under a sun, else the frame's distance. */
static inline void ss_sky_middle(const ss_sky_frame *f, double unit, uint32_t x, uint32_t y,
                                 double at[3]) {
    const double u = (f->low[0] + (x + 0.5) * f->texel) / unit,
                 v = (f->low[1] + (y + 0.5) * f->texel) / unit, square = u * u + v * v,
                 by = f->sun ? 1 : 4 / (4 + square);
    at[0] = u * by, at[1] = v * by, at[2] = f->sun ? 1 : by * (1 - square / 4);
}

/* Its rectangle is widened. */
void ss_sky_shape_make(const ss_sky_frame *f, const double world[3][3], ss_sky_shape *out);
/* Adds the maps of points that see nothing, if there are any such: umbra.c. */
softshadow_status ss_sky_add_umbra(ss_sky *sky, const ss_world *world,
                                   const struct ss_topology *topology, double width);

#endif
