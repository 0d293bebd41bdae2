/* Contact: which faces touch a point, so that a surface never shadows itself and a contact shadow
 * never detaches, at any scale and without an epsilon the user would have to tune.
 *
 * Faces NEAR a point (within the rounding of float coordinates and some) are never left to float
 * arithmetic: they are listed here and tested in double against the positions as the host gave them.
 * Of those, faces that TOUCH the point do not occlude at all. */
#ifndef SS_TRACE_CONTACT_H
#define SS_TRACE_CONTACT_H

#include "scene/point.h"
#include "scene/scene.h"
#include "trace/bvh.h"

#define SS_NEAR_MOST 64 /* more near faces than this: the rest is left to float arithmetic */

typedef struct ss_contact {
    double p[3];                     /* the point, put onto the nearest face it touches */
    uint32_t near_count;             /* faces that engines must skip ... */
    uint32_t near[SS_NEAR_MOST];
    uint32_t tested_count;           /* ... and the corners of those among them that can occlude, */
    double tested[SS_NEAR_MOST][3][3]; /* relative to p: test these in double */
    uint32_t tested_triangle[SS_NEAR_MOST];
} ss_contact;

void ss_contact_find(const ss_bvh *bvh, const ss_world *world, const ss_point *point,
                     ss_contact *contact);
/* Does one of the tested faces block the segment from p along d, 0 < t < t_end (double, watertight
 * between faces that share an edge)? */
bool ss_contact_blocked(const ss_contact *contact, const ss_world *world, const double d[3],
                        double t_end);

#endif
