/* A light behind a map: what share of it a rectangle of the map hides, seen from one point.
 *
 * From a point at map coordinates (x, y) and depth h_p, whatever is at (x + dx, y + dy) and depth
 * h_v stands before the place of the light with the coordinates (s, t) = to_light (dx, dy) / (h_p -
 * h_v) where the light is the unit disk, or the square [-1, 1]^2. That is equation 1 of [BCS06]
 * (similar triangles, B = (du, dv) w_s z / (z - z_s) / l) in the depths of map/frame.h: z z_s / (z
 * - z_s) is D^2 / (h_p - h_v). */
#ifndef SS_TECHNIQUE_LAMP_H
#define SS_TECHNIQUE_LAMP_H

#include "map/frame.h"
#include "map/pyramid.h"
#include "scene/light.h"

#define SS_LAMP_RINGS 8

/* One light in one frame. */
typedef struct ss_lamp {
    double u[3], v[3];     /* half axes along the frame's, in texels for a unit of h */
    double radius, square; /* sphere: in texels for a unit of h; its radius squared */
    bool sphere, disk;
    double distance, inverse; /* of the reference plane from the light; its inverse, 0: a sun */
    double low[2], texel;     /* of the frame */
    /* A light with a radial profile is a sum of uniform disks. */
    uint32_t rings;
    double ring[SS_LAMP_RINGS],
        weight[SS_LAMP_RINGS]; /* radius; of all the light's, for its area */
} ss_lamp;

/* The same from one point. */
typedef struct ss_lamp_view {
    const ss_lamp *lamp;
    double to_light[2][2];
    double reach[2]; /* half the light's box, in texels for a unit of h */
    double texel;    /* half a texel's diagonal on the light for a unit of h, at most */
    double area;     /* of a texel on the light for a unit of h */
    double least;    /* h_p - h_v counts as at least this: half a penumbra of 2^-20 texels */
    bool square;     /* texels stand straight before a rect */
} ss_lamp_view;

void ss_lamp_make(ss_lamp *out, const ss_light *light, const ss_frame *frame);
/* false: the point sees a line, or stands in the lamp. */
bool ss_lamp_see(const ss_lamp *lamp, double x, double y, double h, ss_lamp_view *out);
/* The share of the light behind the rectangle low .. high relative to the point, for a unit of h.
 */
double ss_lamp_hidden(const ss_lamp_view *view, const double low[2], const double high[2]);
/* Can something there, `size` texels large, stand before the light, or does it miss it? */
static inline bool ss_lamp_misses(const ss_lamp_view *view, double dx, double dy, double gap,
                                  double size) {
    const double s = view->to_light[0][0] * dx + view->to_light[0][1] * dy;
    const double t = view->to_light[1][0] * dx + view->to_light[1][1] * dy;
    const double most = gap + size * view->texel;
    if (view->lamp->disk) return s * s + t * t >= most * most;
    return s >= most || -s >= most || t >= most || -t >= most;
}

/* The texels that can matter to the point: as many as the nearest occluder among them says, which
 * the pyramid finds by going round until nothing changes ([GBP06] instead of the near plane).
 * false: none. */
typedef struct ss_lamp_kernel {
    int32_t low[2], high[2];
    int32_t step; /* with a limit: every step-th along both axes stands for step x step */
    int32_t count[2];
} ss_lamp_kernel;
bool ss_lamp_search(const ss_lamp_view *view, const ss_pyramid *pyramid, double x, double y,
                    float h, ss_lamp_kernel *out);
/* The texels before the light for an occluder at a gap of its own. false: outside of the map. */
bool ss_lamp_footprint(const ss_lamp_view *view, uint32_t side, double x, double y, double gap,
                       ss_lamp_kernel *out);
/* The lamp as a face's words, for lamp_glsl.h; 32 of them. */
void ss_lamp_words(const ss_lamp *lamp, float *words);

/* At most `limit` of them; 0: all. */
void ss_lamp_thin(ss_lamp_kernel *kernel, uint32_t limit);

#endif
