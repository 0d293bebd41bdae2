/* Points that a GPU answers: up in chunks, visibility down, while others are on their way. */
#ifndef SS_ENGINE_DEVICE_H
#define SS_ENGINE_DEVICE_H

#include "engine/engine.h"

#define SS_DEVICE_RANGE 65536 /* points handed to a worker at once */

/* As the technique's query. Where the GPU fails and the request said ANY the query itself answers;
 * counts->spared says so, and this thread's message why. */
softshadow_status ss_device_answer(const ss_asked *asked, const ss_point *points, size_t n,
                                   float *visibility, float *bound, ss_arena *scratch,
                                   ss_progress *progress, ss_counts *counts);

#endif
