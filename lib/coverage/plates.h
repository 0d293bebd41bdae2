/* Casters that are a few flat pieces, told whole: where no more than one of them is between a point
 * and the light, what it hides is the area of a polygon on a disk or a square, which has a closed
 * form. No samples, no order of points, no search.
 *
 * A PLATE is a convex polygon: a triangle, or two that share an edge in one plane. */
#ifndef SS_COVERAGE_PLATES_H
#define SS_COVERAGE_PLATES_H

#include "base/status.h"
#include "scene/light.h"
#include "scene/point.h"
#include "scene/scene.h"

#define SS_PLATES_MOST  8
#define SS_PLATE_CORNERS 4

typedef struct ss_plate {
    double normal[3], offset;
    bool beneath;  /* all of the light is on the positive side, ... */
    float lowest;  /* ... at least so high over the plane */
    uint32_t corners;
    double corner[SS_PLATE_CORNERS][3];
    float middle[3], radius; /* of a ball around it */
} ss_plate;

/* Vectors have their axes in summing order. */
typedef struct ss_plates {
    ss_plate plate[SS_PLATES_MOST];
    uint32_t count;
    uint8_t axis[3];
    bool sphere, sun, square;
    float centre[3], normal[3]; /* of the light; under a sun towards it */
    float a[3], b[3];           /* half axes over their squares; of a sphere each point has its own */
    float ball;                 /* radius of a ball around the light; sun: the disk's sine */
    float radius;               /* of a sphere */
    float steep;                /* the longer of a and b */
    float far;                  /* |centre|, a norm */
    float size;                 /* largest coordinate of the casters as the host gave them */
    float finite, reach;        /* of segments: |p - centre| finite + reach is no less */
} ss_plates;

/* *out becomes NULL where the casters are none, too many, too thin or not opaque, or the light is a
 * point or not uniform. axis: the order in which coordinates are summed. light: with its axes
 * so. */
softshadow_status ss_plates_create(ss_plates **out, const ss_world *world, const ss_light *light,
                                   const uint8_t axis[3]);

/* A bit for each of n points, at most 64: those that are told, and of these those that see all of
 * the light or none. */
typedef struct ss_plates_told {
    uint64_t all, lit, dark;
} ss_plates_told;

/* visibility[i] is the answer of a point that is told, and bound[i], if bound is not NULL, how
 * wrong that can be; others may be written to. most: how large bounds may be; 0: only points that
 * are lit are told, and with room to spare, so that drawing would give the same. */
typedef void ss_plates_tell(const ss_plates *plates, const ss_places *places, size_t n, double ulp,
                            float most, float *visibility, float *bound, ss_plates_told *told);
ss_plates_tell ss_plates_tell_scalar, ss_plates_tell_avx2, ss_plates_tell_avx512;

#endif
