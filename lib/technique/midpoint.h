/* Against acne: a layer shadows what is below the midpoint between it and the next one, [Woo92],
 * [BCS06] 4.2. No nearer than the surface's own slope over SS_MIDPOINT_CAP texels, which is also
 * all there is where no layer follows; no farther than that or 45 degrees, as points are asked
 * anywhere, also between two layers that are far apart ([BCS06] figure 5b asks for a limit). */
#ifndef SS_TECHNIQUE_MIDPOINT_H
#define SS_TECHNIQUE_MIDPOINT_H

#include "map/frame.h"
#include "technique/technique.h"

/* Texels: half of one, half of the next one, and half as much again as surfaces are curved. */
#define SS_MIDPOINT_CAP 1.5f

typedef struct ss_midpoints {
    const ss_frame *frame;
    uint32_t side;
    int rung;
    float given;        /* the host's bias, a length, instead; 0: none */
    const float *layer; /* side x side, without any bias */
    const float *next;  /* what lies below it; NULL: nothing */
} ss_midpoints;

/* As the build asks for, of no layer yet. */
ss_midpoints ss_midpoints_of(const ss_stage *stage, const ss_frame *frame, uint32_t side);

/* Of a row, the depths that points must be below to be shadowed: SS_MAP_FAR where the layer is. */
void ss_midpoints_row(const ss_midpoints *of, uint32_t row, float *out);

/* By slopes, as compiled for each rung. */
typedef void ss_midpoints_sloped(const ss_midpoints *of, uint32_t row, float *out);
ss_midpoints_sloped ss_midpoints_sloped_scalar, ss_midpoints_sloped_avx2,
    ss_midpoints_sloped_avx512;

#endif
