#include "raster/egl/thread.h"

#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/fpu.h"
#include "base/process.h"

#define STACK ((size_t)8 << 20) /* drivers compile shaders on it */

static struct {
    pthread_mutex_t lock;
    pthread_cond_t arrived, done;
    _Atomic bool running;
    _Atomic unsigned process;  /* the process generation that made the thread */
    ss_egl_job *first, **last; /* not begun */
    /* the thread's own */
    ss_egl_context context;
    bool open;
    unsigned generation; /* of contexts */
} egl = {.lock = PTHREAD_MUTEX_INITIALIZER,
         .arrived = PTHREAD_COND_INITIALIZER,
         .done = PTHREAD_COND_INITIALIZER,
         .last = &egl.first};

static _Thread_local ss_raster_spent spent_here;

/* ---- the thread ------------------------------------------------------------------------------ */

static void finish(ss_egl_job *job, softshadow_status status) {
    pthread_mutex_lock(&egl.lock);
    job->status = status;
    if (status) memcpy(job->message, ss_message(), sizeof job->message);
    job->done = true;
    pthread_cond_broadcast(&egl.done);
    pthread_mutex_unlock(&egl.lock);
}

static softshadow_status gone(void) {
    return ss_fail(SOFTSHADOW_E_BACKEND,
                   "EGL: %s: the context was lost, the device was reset; build again",
                   egl.context.device.name);
}

/* A context that was lost takes all with it; the next who opens makes another. */
static softshadow_status call(softshadow_status (*step)(ss_egl_job *, ss_egl_context *),
                              ss_egl_job *job) {
    ss_message_clear();
    if (!job->opens && (!egl.open || job->generation != egl.generation)) return gone();
    const softshadow_status status = step(job, &egl.context);
    if (!egl.open || !ss_egl_lost(&egl.context)) return status;
    ss_egl_context_close(&egl.context);
    egl.open = false;
    return gone();
}

static ss_egl_job *take(bool wait) {
    pthread_mutex_lock(&egl.lock);
    while (wait && !egl.first) pthread_cond_wait(&egl.arrived, &egl.lock);
    ss_egl_job *job = egl.first;
    if (job) egl.first = job->next;
    if (!egl.first) egl.last = &egl.first;
    pthread_mutex_unlock(&egl.lock);
    return job;
}

static void *thread_main(void *nothing) {
    ss_egl_job *flying[SS_EGL_IN_FLIGHT];
    unsigned count = 0;
    ss_fpu host;
    (void)nothing;
    ss_fpu_enter(&host);
    for (;;) {
        ss_egl_job *job = count < SS_EGL_IN_FLIGHT ? take(count == 0) : NULL;
        if (job) {
            job->generation = job->generation ? job->generation : egl.generation;
            const softshadow_status status = call(job->begin, job);
            if (status || !job->end)
                finish(job, status);
            else
                flying[count++] = job;
            continue;
        }
        finish(flying[0], call(flying[0]->end, flying[0]));
        count--;
        memmove(flying, flying + 1, count * sizeof *flying);
    }
    return NULL;
}

/* No signal of the host's is ever handled there, nor on the threads that the driver makes. */
static softshadow_status start(void) {
    pthread_attr_t attributes;
    pthread_t thread;
    sigset_t all, before;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, STACK);
    pthread_attr_setdetachstate(&attributes, PTHREAD_CREATE_DETACHED);
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    const int failure = pthread_create(&thread, &attributes, thread_main, NULL);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    pthread_attr_destroy(&attributes);
    if (failure)
        return ss_fail(SOFTSHADOW_E_BACKEND, "EGL: no thread for it: %s", strerror(failure));
    egl.process = ss_process_generation();
    egl.running = true;
    return SOFTSHADOW_OK;
}

/* ---- handing jobs to it ---------------------------------------------------------------------- */

void ss_egl_begin(ss_egl_job *job) {
    job->done = false, job->next = NULL;
    pthread_mutex_lock(&egl.lock);
    *egl.last = job;
    egl.last = &job->next;
    pthread_cond_signal(&egl.arrived);
    pthread_mutex_unlock(&egl.lock);
}

void ss_egl_join(ss_egl_job *job) {
    pthread_mutex_lock(&egl.lock);
    while (!job->done) pthread_cond_wait(&egl.done, &egl.lock);
    pthread_mutex_unlock(&egl.lock);
    spent_here.up += job->spent.up, spent_here.down += job->spent.down;
}

softshadow_status ss_egl_end(ss_egl_job *job) {
    ss_egl_join(job);
    return job->status ? ss_fail(job->status, "%s", job->message) : SOFTSHADOW_OK;
}

softshadow_status ss_egl_run(ss_egl_job *job) {
    ss_egl_begin(job);
    return ss_egl_end(job);
}

ss_raster_spent ss_egl_spent(void) {
    const ss_raster_spent spent = spent_here;
    spent_here = (ss_raster_spent){0};
    return spent;
}

bool ss_egl_here(void) { return !egl.running || egl.process == ss_process_generation(); }

/* ---- opening --------------------------------------------------------------------------------- */

typedef struct opening {
    ss_egl_job job;
    const char *wish;
    ss_raster_device *device;
} opening;

static softshadow_status open_context(ss_egl_job *job, ss_egl_context *c) {
    opening *o = (opening *)job;
    softshadow_status status = SOFTSHADOW_OK;
    if (!egl.open) status = ss_egl_context_open(c, o->wish);
    if (status) return status;
    if (!egl.open) egl.generation++;
    egl.open = true;
    *o->device = c->device;
    return SOFTSHADOW_OK;
}

softshadow_status ss_egl_open(ss_raster_device *device) {
    const char *wish = getenv("SOFTSHADOW_EGL_DEVICE");
    opening o = {.job = {.begin = open_context, .opens = true},
                 .wish = wish && *wish ? wish : NULL,
                 .device = device};
    softshadow_status status = SOFTSHADOW_OK;
    if (!ss_egl_here()) { /* not even its lock can be trusted */
        return ss_fail(SOFTSHADOW_E_BACKEND,
                       "EGL: not after fork(), the parent had begun to use it");
    }
    pthread_mutex_lock(&egl.lock);
    if (!egl.running) status = start();
    pthread_mutex_unlock(&egl.lock);
    return status ? status : ss_egl_run(&o.job);
}
