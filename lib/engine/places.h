/* Points as blocks of places, for techniques that ask for no more. */
#ifndef SS_ENGINE_PLACES_H
#define SS_ENGINE_PLACES_H

#include "scene/point.h"
#include "technique/technique.h"

/* Points first .. first + n - 1, n <= SS_PLACES, in local coordinates. false: one of them at least
 * must be answered NaN. */
bool ss_places_read(const ss_stage *stage, const softshadow_points *points, size_t first, size_t n,
                    ss_places *out);

/* The same, as compiled for each rung: *good is what the other gives. */
typedef void ss_places_reader(const ss_stage *stage, const softshadow_points *points, size_t first,
                              size_t n, ss_places *out, bool *good);
ss_places_reader ss_places_read_scalar, ss_places_read_avx2, ss_places_read_avx512;

#endif
