/* What a penumbra limit map holds, and its two builders. */
#ifndef SS_TECHNIQUE_LIMIT_H
#define SS_TECHNIQUE_LIMIT_H

#include <math.h>

#include "technique/light_maps.h"
#include "technique/offers.h"
#include "technique/rim.h"

/* A texel: the occluder's depth (SS_MAP_FAR: no penumbra here), the upper limit (above it is lit),
 * the lower limit (below it is dark), and the signed limit, q > 0 outside. While it is built
 * LIMIT_B is how far down the light gets past the silhouette. */
enum { LIMIT_C, LIMIT_G, LIMIT_B, LIMIT_Q, LIMIT_CHANNELS };

/* The technique's state. */
typedef struct ss_limit_state {
    ss_light_maps maps;
    float same[SS_MAP_FACES]; /* c of two texels further apart than this: two occluders */
    bool paper;               /* its own way where occluders overlap: highest limit, figure 7 */
} ss_limit_state;

/* Texels that ribbons are wider than the penumbra, so that what is interpolated at their rim is
 * saturated on both sides ([Lawlor06] 3.1: "a few extra pixels"). */
#define SS_LIMIT_RAISE 3

/* One face while it is built. */
typedef struct ss_limit_face {
    const ss_frame *frame;
    const float *depth; /* of this face: the hard shadow's */
    float *texels;      /* of this face */
    float *key;         /* a texel: how good what it holds is, less is better */
    float *lit;         /* of this face: ss_light_maps' */
    uint32_t side;
    float per_texel; /* of distance, in h: the light's cone */
    float near;      /* depths that differ by less may be one surface, seen a texel apart */
    bool highest;    /* limit wins, as in the paper */
} ss_limit_face;

/* Outside of the silhouette a texel counts only where its own surface lies below c (else that
 * surface hides the light), and only down to where the penumbra has not begun on it ([WH03] line
 * 4), raised as ribbons are. Within a texel of the edge snapping decides what covers the centre:
 * those count. */
static inline bool ss_limit_outside(const ss_limit_face *f, float depth, float c, float q) {
    if (q <= f->per_texel) return depth > c - f->near;
    return depth > c && c + q < depth + SS_LIMIT_RAISE * f->per_texel;
}

/* Whom a ribbon is for: outside, the surface in the map; inside, what is far below the occluder. */
static inline float ss_limit_receiver(const ss_limit_face *f, float depth, float c, float q) {
    const float far = (float)f->frame->far_h, most = depth < far && q > 0 ? depth : far;
    return most > c + f->near ? most : c + f->near;
}

/* The distance from the hard shadow in light radii, as that receiver sees it. Where light that
 * passes the silhouette meets another surface before it, only what passes between the two is left:
 * so little that an outline further away tells more. */
static inline float ss_limit_away(const ss_limit_face *f, float depth, float c, float q,
                                  float open) {
    const float receiver = ss_limit_receiver(f, depth, c, q), away = fabsf(q) / (receiver - c);
    if (q > 0 || !(open + f->near < receiver) || !(away < 1)) return away;
    const float behind = fabsf(q) / (receiver - (open > c ? open : c));
    return 1 - ((behind < 1 ? behind : 1) - away);
}

/* Whether a silhouette at depth c and limit q has anything to say to a texel, and how good it is;
 * INFINITY: nothing. open: how far down the light gets past it. */
static inline float ss_limit_key(const ss_limit_face *f, size_t texel, float c, float q,
                                 float open) {
    const float depth = f->depth[texel];
    if (open < c - f->near || (q > 0 && !ss_limit_outside(f, depth, c, q))) return INFINITY;
    return f->highest ? c + fabsf(q) : ss_limit_away(f, depth, c, q, open);
}

/* Step 2 of [Lawlor06] 3.1: c, q, open and key of every texel that a penumbra reaches. Where it
 * draws by tiles, as ss_limit_tiled() says, every texel is written with the limits above and below,
 * and the key is where the lower limit is to be looked for from. */
softshadow_status ss_limit_ribbons(const ss_stage *stage, ss_limit_face *face,
                                   const ss_silhouette *found);
static inline bool ss_limit_tiled(const ss_stage *stage, uint32_t side) {
    return stage->raster->tiles && side <= SS_OFFER_SIDE;
}
/* The same from nothing but a depth image. */
softshadow_status ss_limit_propagate(const ss_stage *stage, ss_limit_face *face);

#endif
