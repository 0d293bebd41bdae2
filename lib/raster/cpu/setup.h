/* Which bands of rows casters touch, as many at a time as a register holds; compiled for each
 * rung. */
#ifndef SS_RASTER_CPU_SETUP_H
#define SS_RASTER_CPU_SETUP_H

#include "raster/casters.h"
#include "raster/cpu/bins.h"

/* The second number of a span: this one has to be looked at alone. */
#define SS_SETUP_ALONE 0xffffu

/* For triangles begin .. end - 1, and marks them as held, as ss_casters_want() does; small ones
 * that turn their back to the light are marked. */
typedef void ss_setup_bands(const ss_casters *casters, size_t begin, size_t end, ss_bin_span *span);
ss_setup_bands ss_setup_bands_scalar, ss_setup_bands_avx2, ss_setup_bands_avx512;

#endif
