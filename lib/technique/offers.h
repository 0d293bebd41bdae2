/* What the map techniques keep of their penumbrae, tile by tile, as compiled for each rung: the
 * bits of their own shade(). */
#ifndef SS_TECHNIQUE_OFFERS_H
#define SS_TECHNIQUE_OFFERS_H

#include "base/cpu.h"
#include "raster/raster.h"

/* A face while silhouettes are drawn; the names are those of the techniques, which see. */
typedef struct ss_offer_face {
    const float *depth;
    float *texels;
    float *above, *lit; /* of penumbra-limit: where its lower limit is looked for from; ss_light_maps' */
    /* Of penumbra-volume: what cuts the light, of each edge as a texel has it, the first two left
     * open; and around a corner, at a texel, by the tag that it has. */
    const float (*ends)[8];
    void (*around)(const void *of, uint32_t tag, uint32_t x, uint32_t y, float ends[6]);
    const void *of;
    const float *rows;  /* the rim's */
    uint32_t side;      /* at most SS_OFFER_SIDE */
    float per_texel, texels_per /* its inverse */, climb, near, steep, far;
    bool paper;
} ss_offer_face;
#define SS_OFFER_SIDE 32768 /* texels are counted in 31 bits */

#define SS_OFFERS(name) extern const ss_raster_tiler name##_scalar, name##_avx2, name##_avx512
SS_OFFERS(ss_offers_outer);  /* of an ss_outer_sheet: outer.h */
SS_OFFERS(ss_offers_limit);  /* all but the lower limits, for which it says where to look */
SS_OFFERS(ss_offers_volume); /* all channels */
SS_OFFERS(ss_offers_mask);   /* the last two channels: begin and edge */

/* The one of a rung. */
#ifdef SS_HAVE_X86
#define SS_OFFERS_OF(name, rung)                                                                   \
    ((rung) == SS_AVX512 ? &name##_avx512 : (rung) == SS_AVX2 ? &name##_avx2 : &name##_scalar)
#else
#define SS_OFFERS_OF(name, rung) ((void)(rung), &name##_scalar)
#endif

/* A tag in two numbers that floats hold: tag / SS_OFFER_TAG, tag % SS_OFFER_TAG. */
#define SS_OFFER_TAG 4096

#endif
