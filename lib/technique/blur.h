/* The blur that takes the noise of jittered samples out of an image of visibilities. */
#ifndef SS_TECHNIQUE_BLUR_H
#define SS_TECHNIQUE_BLUR_H

#include "technique/technique.h"

#define SS_MOST_BLUR 64 /* pixels across */

/* Along the rows, then along the columns: every pixel whose answer has the sign bit set becomes the
 * mean of itself and up to `across` / 2 pixels to either side, of its own object only ([Cou05]
 * 5.3). The sign bits are gone afterwards, NaN stays and counts for nobody; `counts` follows. Where
 * the raster works over images it does so, to the rounding of its sums; else the image alone
 * decides the result, to the bit. Nothing is changed on failure. */
softshadow_status ss_blur(const ss_image *image, uint32_t across, const struct ss_raster *raster,
                          ss_pool *pool, ss_counts *counts);

#endif
