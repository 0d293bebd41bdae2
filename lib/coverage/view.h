/* Filling a group: each lane's view of the light, and what holds for all lanes. */
#ifndef SS_COVERAGE_VIEW_H
#define SS_COVERAGE_VIEW_H

#include "coverage/group.h"

/* Floats reach this near a point's own plane, and the light's, in local units: above the rounding
 * of t for vertices in [-1, 1], below SS_NEAR, so that faces at the point are contact's business.
 */
#define SS_FLOAT_REACH 0x1p-20

/* Writes the lane's projective map. view and p have their axes in the group's summing order. False
 * where floats will not do: the light is seen too nearly as a line, or is too near. */
bool ss_group_set_lane(ss_group *group, unsigned lane, const ss_view *view, const double p[3]);

/* Shaft, boxes around points (world's axes) and light: for a few points, whose box is given back,
 * or for all in a box. */
void ss_group_enclose(ss_group *group, const ss_light *light, const double (*points)[3],
                      size_t count, double low[3], double high[3]);
void ss_group_enclose_box(ss_group *group, const ss_light *light, const double low[3],
                          const double high[3]);

/* Makes room for points that have moved by up to `by` since. */
void ss_group_widen(ss_group *group, double by);

/* The range of t over group->lanes. reach: how far from its point a face to be skipped can be. */
void ss_group_enclose_depths(ss_group *group, double reach);

#endif
