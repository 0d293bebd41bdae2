/* What the engine needs of ray tracing beyond the technique's row: the truth that others are
 * measured against, by another sequence. */
#ifndef SS_TECHNIQUE_RAYTRACE_H
#define SS_TECHNIQUE_RAYTRACE_H

#include "technique/technique.h"
#include "trace/samples.h"

/* A state for ss_raytrace.query and .destroy with this many samples (0: what the tolerance needs)
 * of this sequence. stage->params->seed turns it: two seeds give two independent estimates. */
softshadow_status ss_raytrace_prepare(const ss_stage *stage, uint32_t samples,
                                      ss_sequence sequence, void **state);

/* A state for auto: as many samples as surfaces need, and as many as foliage needs for points where
 * those show that the light is much divided. */
softshadow_status ss_raytrace_prepare_auto(const ss_stage *stage, void **state);
/* How many rays that is for most points. */
uint32_t ss_raytrace_first(const void *state);

/* How many samples of SS_SPIRAL keep the RMS error of penumbra points below the tolerance. */
uint32_t ss_raytrace_samples(double tolerance);

extern const ss_technique ss_raytrace;

#endif
