/* The techniques' own polygons, near ones first. */
#ifndef SS_RASTER_CPU_KEEP_H
#define SS_RASTER_CPU_KEEP_H

#include "raster/raster.h"

/* The vtable's keep. */
softshadow_status ss_cpu_keep(const ss_raster_polygon *polygons, size_t count,
                              uint32_t resolution, const ss_raster_ink *ink, ss_pool *pool);

#endif
