#include "technique/midpoint.h"

#include "base/cpu.h"

static ss_midpoints_sloped *const sloped[] = SS_RUNGS(ss_midpoints_sloped);

ss_midpoints ss_midpoints_of(const ss_stage *stage, const ss_frame *frame, uint32_t side) {
    return (ss_midpoints){.frame = frame, .side = side, .rung = stage->rung,
                          .given = (float)(stage->params->depth_bias * stage->world->scale)};
}

void ss_midpoints_row(const ss_midpoints *m, uint32_t row, float *out) {
    const float *here = m->layer + (size_t)row * m->side;
    if (!(m->given > 0)) {
        sloped[m->rung](m, row, out);
        return;
    }
    for (uint32_t x = 0; x < m->side; x++) {
        const float h = here[x], step = (float)ss_frame_step(m->frame, h, m->given);
        out[x] = h < SS_MAP_FAR ? h + step : SS_MAP_FAR;
    }
}
