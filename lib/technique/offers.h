/* What the map techniques keep of their penumbrae, tile by tile, as compiled for each rung. */
#ifndef SS_TECHNIQUE_OFFERS_H
#define SS_TECHNIQUE_OFFERS_H

#include "raster/raster.h"

/* ss_outer_sheet: outer.h */
extern const ss_raster_tiler ss_offers_outer_scalar, ss_offers_outer_avx2, ss_offers_outer_avx512;

#endif
