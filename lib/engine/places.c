#include "engine/places.h"

#include "base/cpu.h"

static ss_places_reader *const read_places[] = SS_RUNGS(ss_places_read);

bool ss_places_read(const ss_stage *stage, const softshadow_points *points, size_t first, size_t n,
                    ss_places *out) {
    bool good;
    read_places[stage->rung](stage, points, first, n, out, &good);
    return good;
}
