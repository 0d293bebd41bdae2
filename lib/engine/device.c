#include "engine/device.h"

#include "base/status.h"

#define CHUNK ((size_t)16384)
#define AHEAD 3 /* chunks on their way at most: what a host that cancels waits for */

static softshadow_status submit(const ss_asked *asked, const ss_point *points, size_t n,
                                ss_raster_look *looks, float *visibility,
                                ss_raster_ticket **ticket) {
    asked->technique->look(asked->state, points, n, looks);
    return asked->stage->raster->submit(asked->program, looks, n, visibility, ticket);
}

/* Every ticket is waited for, also after a failure: the device writes to what it was given. */
static softshadow_status answer(const ss_asked *asked, const ss_point *points, size_t n,
                                ss_raster_look *looks, float *visibility, ss_progress *progress) {
    const size_t chunks = (n + CHUNK - 1) / CHUNK;
    ss_raster_ticket *ticket[AHEAD] = {NULL};
    softshadow_status status = SOFTSHADOW_OK;
    for (size_t sent = 0, done = 0; done < sent || (!status && sent < chunks);) {
        if (!status && sent < chunks && sent - done < AHEAD) {
            const size_t at = sent * CHUNK, m = n - at < CHUNK ? n - at : CHUNK;
            status = submit(asked, points + at, m, looks + at, visibility + at,
                            &ticket[sent % AHEAD]);
            if (!status) sent++;
            continue;
        }
        const softshadow_status waited = asked->stage->raster->wait(ticket[done++ % AHEAD]);
        if (!status) status = waited;
        if (!status) status = ss_progress_add(progress, 0);
    }
    return status;
}

softshadow_status ss_device_answer(const ss_asked *asked, const ss_point *points, size_t n,
                                   float *visibility, float *bound, ss_arena *scratch,
                                   ss_progress *progress, ss_counts *counts) {
    const ss_technique *technique = asked->technique;
    ss_raster_look *looks = ss_arena_alloc(scratch, n, sizeof *looks);
    if (!looks) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu points", n);
    const softshadow_status status = answer(asked, points, n, looks, visibility, progress);
    const ss_raster_spent spent = asked->stage->raster->spent();
    counts->up += spent.up, counts->down += spent.down;
    if (status == SOFTSHADOW_E_BACKEND && asked->any) {
        counts->spared += n;
        return technique->query(asked->stage, asked->state, points, n, visibility, bound, scratch,
                                counts);
    }
    if (!status) {
        technique->horizon(asked->stage, asked->state, points, n, visibility, bound, counts);
    }
    return status;
}
