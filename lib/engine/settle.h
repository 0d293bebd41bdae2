/* Answers that need no technique: groups of points with nothing between them and the light. */
#ifndef SS_ENGINE_SETTLE_H
#define SS_ENGINE_SETTLE_H

#include "technique/technique.h"

/* Where answers go, by a point's place. */
typedef struct ss_answers {
    float *visibility;
    float *bound; /* or NULL */
} ss_answers;

/* Answers 1 for those of the points for which that is certain; the others move to the front.
 * Returns how many of these there are. Neighbours should follow each other; weighting must be
 * uniform. */
size_t ss_settle(const ss_stage *stage, ss_point *points, size_t n, const ss_answers *answers);

#endif
