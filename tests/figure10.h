/* Lawlor's figure 10, for the test and the bench: RMS error, in 0..255, of one skewed triangle's
 * shadow under a sun straight above, against exact areas; the paper's numbers beside ours. */
#ifndef TESTS_FIGURE10_H
#define TESTS_FIGURE10_H

#include <stdbool.h>

#include "scenes.h"

enum { FIGURE10_SIDE = 128, FIGURE10_SIDES = 4, FIGURE10_ROWS = 32 };

/* What of the shadow a row is scored against, as in the paper. */
typedef enum figure10_part {
    FIGURE10_ALL,
    FIGURE10_OUTER, /* nothing before the light's centre is seen, all at the penumbra's end */
    FIGURE10_INNER  /* everything as soon as the centre is seen */
} figure10_part;

typedef struct figure10_row {
    const char *method;
    figure10_part part;
    bool printed;                 /* is it in the paper? */
    double paper[FIGURE10_SIDES]; /* maps of 16, 32, 64, 128 texels a side */
    double ours[FIGURE10_SIDES];
} figure10_row;

/* The paper's rows in its order, then whatever further map methods the library has. */
enum { FIGURE10_LIMIT, FIGURE10_SMOOTHIE, FIGURE10_SINGLE, FIGURE10_PCF, FIGURE10_HARD,
       FIGURE10_PRINTED };

typedef struct figure10 {
    figure10_row rows[FIGURE10_ROWS];
    uint32_t row_count;
    double hard_exact; /* the hard shadow without a map; the paper's "shadow volumes": 33.5 */
    double sixteen;    /* expected of 16 random samples; the paper's: 12.0 */
} figure10;

/* Called for every shadow: FIGURE10_SIDE^2 visibilities, rows from low y on, and what they are
 * scored against. resolution 0: the exact ones, row NULL. */
typedef bool figure10_show(void *ctx, const figure10_row *row, uint32_t resolution,
                           const float *visibility, const float *truth);

/* Measures all of it. NULL, or why it could not; show may be NULL, and stops it by false. */
const char *figure10_measure(figure10 *out, figure10_show *show, void *ctx);

#endif
