/* What the engine needs of ray tracing beyond the technique's row: the truth that others are measured
 * against, by another sequence. */
#ifndef SS_TECHNIQUE_RAYTRACE_H
#define SS_TECHNIQUE_RAYTRACE_H

#include "technique/technique.h"
#include "trace/contact.h"
#include "trace/samples.h"

/* A state for ss_raytrace.query and .destroy with this many samples (0: what the tolerance needs) of
 * this sequence. stage->params->seed turns it: two seeds give two independent estimates. */
softshadow_status ss_raytrace_prepare(const ss_stage *stage, uint32_t samples,
                                      ss_sequence sequence, void **state);

/* A state for auto: as many samples as surfaces need, and as many as foliage needs for points where
 * those show that the light is much divided. */
softshadow_status ss_raytrace_prepare_auto(const ss_stage *stage, void **state);
/* How many rays that is for most points. */
uint32_t ss_raytrace_first(const void *state);

/* Is the light, seen from behind the casters, so narrow that a packet of rays misses little of what
 * triangles of their size may hide? */
bool ss_raytrace_is_narrow(const ss_stage *stage, const void *state);
/* Of the points with a bit in `asked` those from which the rays of one packet all reach such a light, or
 * none does. contacts: theirs. */
void ss_raytrace_probe(const ss_stage *stage, const void *state, const ss_point *points,
                       const ss_contact *contacts, uint32_t asked, uint32_t *lit, uint32_t *dark,
                       ss_counts *counts);

/* How many samples of SS_SPIRAL keep the RMS error of penumbra points below the tolerance. */
uint32_t ss_raytrace_samples(double tolerance);

extern const ss_technique ss_raytrace;

#endif
