/* Filling a group: each lane's view of the light, and what holds for all lanes. */
#ifndef SS_COVERAGE_VIEW_H
#define SS_COVERAGE_VIEW_H

#include "coverage/group.h"

/* The lane's view as ss_light_view() would have it; view's axes are in summing order. */
void ss_group_view_of(const ss_group *group, const ss_group_views *views, unsigned lane,
                      const ss_light *light, ss_view *view);

/* Shaft, boxes around points (world's axes) and light: for all of a box in the frame, or for
 * SS_LANES points in it. */
void ss_group_enclose(ss_group *group, const ss_light *light, const ss_shaft_frame *frame,
                      const double low[3], const double high[3], const ss_group_views *views);

/* Makes room for points that have moved by up to `by` since. */
void ss_group_widen(ss_group *group, double by);

#endif
