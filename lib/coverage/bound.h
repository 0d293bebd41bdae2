/* How wrong an answer can be, and what a point's horizon hides. Where no edge of what was drawn
 * passes through a sample's cell, the sample speaks for all of the cell: an answer is off by at
 * most the weight of the other cells. */
#ifndef SS_COVERAGE_BOUND_H
#define SS_COVERAGE_BOUND_H

#include "coverage/lattice.h"

/* Hides what is below the horizon of a given normal: part of the light, all or none of it. */
void ss_bound_hide_below(const ss_lattice *lattice, const ss_view *view, const double normal[3],
                         uint32_t *mask);
/* Marks the cells that this horizon passes: through them, and within SS_LATTICE_REACH of them. */
void ss_bound_mark_horizon(const ss_lattice *lattice, const ss_view *view, const double normal[3],
                           uint32_t *tight, uint32_t *wide);
/* The bound, from the masks of marked cells; `wide` counts for samples at the rim. */
float ss_bound_sum(const ss_lattice *lattice, const ss_light *light, const ss_view *view,
                   uint32_t weighting, const double *normal, const uint32_t *tight,
                   const uint32_t *wide);

#endif
