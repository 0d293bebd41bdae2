/* The one thread that owns the context: the host's threads never have it current, so that a context
 * of the host's own stays as it was. Made by the first who asks, it lives as long as the process.
 */
#ifndef SS_RASTER_EGL_THREAD_H
#define SS_RASTER_EGL_THREAD_H

#include "base/status.h"
#include "raster/egl/context.h"

/* Something to do on it. `begin` hands work to the device; `end`, where there is one, collects it
 * after others may have begun, so that copies and work overlap. Jobs end in the order in which they
 * began. */
typedef struct ss_egl_job {
    softshadow_status (*begin)(struct ss_egl_job *job, ss_egl_context *c);
    softshadow_status (*end)(struct ss_egl_job *job, ss_egl_context *c);
    ss_raster_spent spent;
    /* the thread's own */
    softshadow_status status;
    bool done, opens;    /* opens: needs no context */
    unsigned generation; /* in: of the context that holds what it needs; 0: nothing, any will do */
    char message[SS_MESSAGE_SIZE];
    struct ss_egl_job *next;
} ss_egl_job;

/* Jobs that may have begun and not ended. */
#define SS_EGL_IN_FLIGHT 3

/* Makes the thread and the context unless they are there. */
softshadow_status ss_egl_open(ss_raster_device *device);
/* Is this process the one that has the thread? Not in a child of fork(). */
bool ss_egl_here(void);

void ss_egl_begin(ss_egl_job *job);            /* returns at once */
void ss_egl_join(ss_egl_job *job);             /* waits */
softshadow_status ss_egl_end(ss_egl_job *job); /* waits; failures are this thread's message */
softshadow_status ss_egl_run(ss_egl_job *job); /* both */

/* What this thread waited for copies. */
ss_raster_spent ss_egl_spent(void);

#endif
