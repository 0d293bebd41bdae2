/* The vtable's passes. */
#ifndef SS_RASTER_EGL_PASSES_H
#define SS_RASTER_EGL_PASSES_H

#include "raster/raster.h"

softshadow_status ss_egl_depth(const ss_raster_casters *casters, float *const layer[],
                               uint32_t layers, ss_pool *pool);
softshadow_status ss_egl_peel(const ss_raster_casters *casters, const float *above, float *plane,
                              ss_pool *pool);
softshadow_status ss_egl_keep(const ss_raster_polygon *polygons, size_t count,
                              uint32_t resolution, const ss_raster_ink *ink, ss_pool *pool);
softshadow_status ss_egl_work(const ss_raster_image *image);

#endif
