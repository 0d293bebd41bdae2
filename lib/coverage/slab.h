/* Coarser scenes for a group: from which depth on each may stand for the casters. */
#ifndef SS_COVERAGE_SLAB_H
#define SS_COVERAGE_SLAB_H

#include "coverage/group.h"
#include "trace/lod.h"

/* Sets the group's slabs: one of the casters, and those in which a level of lod, if there is one,
 * is seen at most `stray` half-widths of the light beside them, going by its deviation. Depths are
 * enclosed already. blur becomes how far beside a level is seen at most, by its largest deviation.
 * Returns that deviation, of all levels used, in local units; 0: none is. */
double ss_group_set_slabs(ss_group *group, const ss_lod_light *lod, double stray);

#endif
