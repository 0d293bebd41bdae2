/* Triangles that leave the range of the scan converter. */
#ifndef SS_RASTER_CLIP_H
#define SS_RASTER_CLIP_H

#include "raster/setup.h"

#define SS_CLIP_MOST 9 /* corners of a triangle cut by five planes, and one to spare */

/* What a corner of a caster carries: its depth h, and its weights of the triangle's second and
 * third vertex over the distance, which are linear in the map as h is. */
#define SS_CASTER_ATTRIBUTES 3

/* Cuts the triangle (local corners) at the frame's near plane and at the guard band; gives the
 * corners of what is left, in order. An edge is cut at the same place whichever way it runs, so
 * neighbours still share their edges. */
int ss_clip_caster(const ss_frame *frame, const double corner[3][3],
                   ss_scan_corner out[SS_CLIP_MOST]);
/* The guard band only. `corner` holds count corners and receives the result; returns how many. */
int ss_clip_guard(ss_scan_corner corner[SS_CLIP_MOST], int count, uint32_t used);

#endif
