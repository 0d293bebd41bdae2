/* Contact: which faces touch a point, so that a surface never shadows itself and a contact shadow
 * never detaches, at any scale and without an epsilon the user would have to tune.
 *
 * Faces NEAR a point (within the rounding of float coordinates and some) are never left to float
 * arithmetic: they are listed here and tested in double against the positions as the host gave
 * them. Of those, faces that TOUCH the point do not occlude at all. */
#ifndef SS_TRACE_CONTACT_H
#define SS_TRACE_CONTACT_H

#include "scene/point.h"
#include "scene/scene.h"
#include "trace/bvh.h"

/* How near is near, in local units (casters fill [-1, 1]). Rounding a vertex and the origin to
 * float moves each by 2^-25 along an axis, the robust triangle test adds a few 2^-24 of the
 * distances it subtracts: together below 2^-20, so that floats decide rightly on which side of a
 * face that is not near a point lies. Eight times that: segments may then begin so far out that
 * most never meet the face they start on, and need nobody to take that hit back. */
#define SS_NEAR 0x1p-17
/* Two positions this near are one: rounding of the doubles in which contact is computed. */
#define SS_TOUCH 0x1p-49

#define SS_NEAR_MOST 64 /* the nearest are kept; see `clear` for the rest */

typedef struct ss_contact {
    double p[3];                     /* the point, put onto the nearest face it touches */
    /* Faces nearer than this are all in `near`: a segment in float arithmetic may begin so far from
     * p. Where more than SS_NEAR_MOST faces are near (a tangle below the input's own precision),
     * the farthest of them are listed nowhere, and what they hide within this distance is lost. */
    double clear;
    uint32_t near_count;             /* faces that engines must skip: */
    uint32_t near[SS_NEAR_MOST];     /* first those that cannot occlude, then those ... */
    uint32_t tested_count;           /* ... to be tested in double: */
    double tested[SS_NEAR_MOST][3][3]; /* their corners, relative to p */
} ss_contact;

static inline uint32_t ss_contact_touched(const ss_contact *contact) {
    return contact->near_count - contact->tested_count;
}

static inline bool ss_contact_lists(const ss_contact *contact, uint32_t triangle) {
    for (uint32_t i = 0; i < contact->near_count; i++) {
        if (contact->near[i] == triangle) return true;
    }
    return false;
}

/* Faces read for one point serve its neighbours: SS_CONTACT_CACHE of them, zeroed by the caller, or
 * NULL. A cache changes no answer. */
#define SS_CONTACT_CACHE 256
typedef struct ss_contact_face {
    double corner[3][3], normal[3];
    float low[3], high[3]; /* of its corners in floats */
    uint32_t triangle;
    bool filled, sound;
} ss_contact_face;

void ss_contact_find(const ss_bvh *bvh, const ss_world *world, const ss_point *point,
                     ss_contact_face *cache, ss_contact *contact);

/* From p to a face. */
double ss_contact_distance(const ss_world *world, uint32_t triangle, const double p[3],
                           ss_contact_face *cache);

/* Points close together, by coordinates: looked at once for all of them, which no answer shows. */
#define SS_CROWD      16
#define SS_CROWD_MOST 64 /* faces; beyond, each point looks for itself as fast */
typedef struct ss_contact_crowd {
    const double *at[3]; /* SS_CROWD of each */
    double low[3], high[3];
    double ulp; /* the largest of theirs; none of them may lie on a known triangle */
    /* Out: faces that may be near one of them, in ascending order, and which of them: bits. */
    uint32_t face_count, face[SS_CROWD_MOST];
    uint16_t of[SS_CROWD_MOST];
} ss_contact_crowd;
/* False: there are too many faces. */
bool ss_contact_gather(const ss_bvh *bvh, const ss_world *world, ss_contact_crowd *crowd,
                       ss_contact_face *cache);
/* ss_contact_find() for point number i of the crowd. */
void ss_contact_find_in(const ss_contact_crowd *crowd, unsigned i, const ss_world *world,
                        const ss_point *point, ss_contact_face *cache, ss_contact *contact);
/* Does one of the tested faces block the segment from p along d, 0 < t < t_end (double; nothing
 * passes between faces that share an edge or a corner)? */
bool ss_contact_blocked(const ss_contact *contact, const ss_world *world, const double d[3],
                        double t_end);

#endif
