/* Points that certainly see all of a light, or nothing of it, told by one look at a map.
 *
 * Put the light into a ball around its centre. A point is lit if no caster meets the hull of point
 * and ball, and then so is every point between it and the ball's centre: its hull is a part of
 * that. So along each ray from the centre there is a nearness to the light beyond which points are
 * lit, and the map holds numbers that are nowhere below it. sky.c says why. Likewise a map of what
 * is inside solids tells which points are dark: umbra.c. All that is ever told is "lit" or "dark",
 * where drawing would give the same: answers do not show whether there was a map. */
#ifndef SS_COVERAGE_SKY_H
#define SS_COVERAGE_SKY_H

#include "base/status.h"
#include "scene/light.h"
#include "scene/point.h"
#include "trace/bvh.h"

/* Local units by which casters, light and points may all be off: beyond floats. */
#define SS_SKY_ROOM 0x1p-13

/* Where points are in the map. With d = p - origin in the frame's axes (x, y, z), z away from the
 * light: sun: at (x, y), of nearness -z. Else the origin is the light's centre, r the length of d,
 * and the point is at (x, y) 2 D / (z + r), a stereographic projection, of nearness D (D - r) / r:
 * as under a sun for casters that are small beside D. */
typedef struct ss_sky_frame {
    bool sun;
    double origin[3], axis[3][3]; /* x, y, z */
    double distance;              /* D: of the casters' middle */
    double least;                 /* sun: no caster has a smaller z; else, a smaller r */
    double low[2], texel;
    uint32_t width, height;
} ss_sky_frame;

#define SS_SKY_BINS 32

typedef struct ss_sky {
    ss_sky_frame frame;
    double inside;    /* the map holds for points within this radius of its middle */
    double most;      /* nearness of all casters, ... */
    double around;    /* ... which are in this radius */
    double outside;   /* points beyond this one are lit */
    double slope;     /* between the two: what nearness may be less for each unit farther out */
    float *all;       /* points of larger nearness are lit: [row][column] */
    /* The largest face, if it is large: what points over it, or touching it, may exceed instead. */
    float *over; /* or NULL */
    double normal[3], offset; /* its plane; the light is all on the positive side */
    /* In which bins of nearness points see nothing, a bit each; or NULL. Below the first bin those
     * of nearness above `below` do not. */
    uint32_t *dark;
    float *below;
    double bin_low, bins;     /* where the first bin begins, and how many there are to a unit */
    double size;              /* largest coordinate of the casters as the host gave them */
    double centre[3], lowest; /* the light's height over it at least, ... */
    double finite, reach;     /* ... against the way there: |p - centre| finite + reach */
} ss_sky;

struct ss_topology;
/* *out becomes NULL where there can be no map: nothing casts, or it is among the casters, or the
 * light is a point. topology: of the bvh's world; NULL: dark points are not told. */
softshadow_status ss_sky_create(ss_sky **out, const ss_bvh *bvh,
                                const struct ss_topology *topology, const ss_light *light);
void ss_sky_destroy(ss_sky *sky);
size_t ss_sky_bytes(const ss_sky *sky);

/* Points of such an ulp (see ss_point) are put onto faces that they touch, up to 8 ulps of the
 * largest coordinate away: does the map leave room for that? At r from the light's centre such a
 * way is D^2 / r^2 times as long in nearness, and 2 D / r times on the plane, as far out as points
 * are looked up. Nearer than all casters r does not matter: points there are lit wherever they are
 * put. */
static inline bool ss_sky_holds(const ss_sky *sky, double ulp) {
    const double near = sky->frame.sun ? 1 : sky->frame.distance / sky->frame.least;
    const double longest = near * near > 2 * near ? near * near : 2 * near;
    return 8 * ulp * (sky->size + 1) * longest <= SS_SKY_ROOM;
}
/* A bit for each of n points, at most 64: it is lit for sure, it is dark for sure. */
typedef void ss_sky_ask(const ss_sky *sky, const ss_places *places, size_t n, double ulp,
                        uint64_t *lit, uint64_t *dark);
ss_sky_ask ss_sky_ask_scalar, ss_sky_ask_avx2, ss_sky_ask_avx512;

#endif
