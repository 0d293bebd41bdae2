#include "base/parallel.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <string.h>
#include <unistd.h>

#include "base/fpu.h"
#include "base/memory.h"
#include "base/status.h"

#define MOST_THREADS 256

/* One running loop. It lives on the stack of the thread that runs it. */
typedef struct ss_job {
    ss_body *body;
    void *ctx;
    uint64_t n, grain, chunks;
    _Atomic uint64_t next;   /* chunk to hand out */
    _Atomic uint64_t failed; /* lowest chunk that failed so far */
    pthread_mutex_t lock;    /* guards status and message */
    softshadow_status status;
    char message[SS_MESSAGE_SIZE];
    unsigned helpers; /* pool threads inside; guarded by the pool's lock */
    struct ss_job *older;
} ss_job;

struct ss_pool {
    softshadow_options host;
    unsigned threads, started;
    pthread_t worker[MOST_THREADS];
    pthread_mutex_t lock;
    pthread_cond_t work, left; /* a job arrived or stop; a helper left a job */
    ss_job *jobs;
    bool stop;
};

static _Thread_local bool inside_loop;

static void remember(ss_job *job, uint64_t chunk, softshadow_status status) {
    pthread_mutex_lock(&job->lock);
    if (chunk < atomic_load(&job->failed)) {
        atomic_store(&job->failed, chunk);
        job->status = status;
        strcpy(job->message, ss_message());
    }
    pthread_mutex_unlock(&job->lock);
}

/* Chunks after a failed one are not run; chunks before it are, so that the lowest failure wins. */
static void run_chunk(ss_job *job, uint64_t chunk) {
    if (chunk > atomic_load_explicit(&job->failed, memory_order_relaxed)) return;
    const uint64_t begin = chunk * job->grain;
    const uint64_t end = job->n - begin < job->grain ? job->n : begin + job->grain;
    const softshadow_status status = job->body(job->ctx, begin, end);
    if (status != SOFTSHADOW_OK) remember(job, chunk, status);
}

static void run_job(ss_job *job) {
    const bool outer = inside_loop;
    inside_loop = true;
    for (uint64_t chunk; (chunk = atomic_fetch_add(&job->next, 1)) < job->chunks;) {
        run_chunk(job, chunk);
    }
    inside_loop = outer;
}

static ss_job *open_job(ss_pool *pool) {
    for (ss_job *job = pool->jobs; job; job = job->older) {
        if (atomic_load(&job->next) < job->chunks) return job;
    }
    return NULL;
}

static void *worker_main(void *argument) {
    ss_pool *pool = argument;
    ss_fpu host;
    ss_fpu_enter(&host);
    pthread_mutex_lock(&pool->lock);
    while (!pool->stop) {
        ss_job *job = open_job(pool);
        if (!job) {
            pthread_cond_wait(&pool->work, &pool->lock);
            continue;
        }
        job->helpers++;
        pthread_mutex_unlock(&pool->lock);
        run_job(job);
        pthread_mutex_lock(&pool->lock);
        job->helpers--;
        pthread_cond_broadcast(&pool->left);
    }
    pthread_mutex_unlock(&pool->lock);
    return NULL;
}

/* A thread that cannot be started is done without. */
static void start_workers(ss_pool *pool) {
    while (pool->started + 1 < pool->threads) {
        if (pthread_create(&pool->worker[pool->started], NULL, worker_main, pool) != 0) {
            pool->threads = pool->started + 1;
            return;
        }
        pool->started++;
    }
}

softshadow_status ss_pool_create(ss_pool **out, const softshadow_options *options) {
    *out = NULL;
    ss_pool *pool = ss_alloc(1, sizeof *pool);
    if (!pool) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for a thread pool");
    if (options) pool->host = *options;
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    pool->threads = pool->host.threads      ? pool->host.threads
                    : processors > 0        ? (unsigned)processors
                                            : 1;
    if (pool->threads > MOST_THREADS) pool->threads = MOST_THREADS;
    pthread_mutex_init(&pool->lock, NULL);
    pthread_cond_init(&pool->work, NULL);
    pthread_cond_init(&pool->left, NULL);
    *out = pool;
    return SOFTSHADOW_OK;
}

void ss_pool_destroy(ss_pool *pool) {
    if (!pool) return;
    pthread_mutex_lock(&pool->lock);
    pool->stop = true;
    pthread_cond_broadcast(&pool->work);
    pthread_mutex_unlock(&pool->lock);
    for (unsigned i = 0; i < pool->started; i++) pthread_join(pool->worker[i], NULL);
    pthread_cond_destroy(&pool->work);
    pthread_cond_destroy(&pool->left);
    pthread_mutex_destroy(&pool->lock);
    ss_free(pool);
}

unsigned ss_pool_threads(const ss_pool *pool) { return pool->threads; }

const softshadow_options *ss_pool_options(const ss_pool *pool) { return &pool->host; }

static void run_on_pool(ss_pool *pool, ss_job *job) {
    pthread_mutex_lock(&pool->lock);
    start_workers(pool);
    job->older = pool->jobs;
    pool->jobs = job;
    pthread_cond_broadcast(&pool->work);
    pthread_mutex_unlock(&pool->lock);

    run_job(job);

    pthread_mutex_lock(&pool->lock);
    for (ss_job **link = &pool->jobs; *link; link = &(*link)->older) {
        if (*link == job) {
            *link = job->older;
            break;
        }
    }
    while (job->helpers) pthread_cond_wait(&pool->left, &pool->lock);
    pthread_mutex_unlock(&pool->lock);
}

/* What the host's scheduler calls, on threads whose floating-point mode is not ours. */
static void host_body(void *ctx, uint64_t begin, uint64_t end) {
    ss_job *job = ctx;
    ss_fpu host;
    ss_fpu_enter(&host);
    const bool outer = inside_loop;
    inside_loop = true;
    if (end > job->chunks) end = job->chunks;
    for (uint64_t chunk = begin; chunk < end; chunk++) {
        atomic_fetch_add(&job->next, 1);
        run_chunk(job, chunk);
    }
    inside_loop = outer;
    ss_fpu_leave(&host);
}

static void run_on_host(ss_pool *pool, ss_job *job) {
    pool->host.parallel(pool->host.user, job->chunks, host_body, job);
    if (atomic_load(&job->next) < job->chunks) {
        remember(job, job->chunks - 1,
                 ss_fail(SOFTSHADOW_E_INTERNAL, "options.parallel returned before it had called "
                                                "body for the whole range 0..%llu",
                         (unsigned long long)job->chunks));
    }
}

bool ss_parallel_alone(bool alone) {
    const bool before = inside_loop;
    inside_loop = alone;
    return before;
}

softshadow_status ss_parallel_for(ss_pool *pool, uint64_t n, uint64_t grain, ss_body *body,
                                  void *ctx) {
    if (n == 0) return SOFTSHADOW_OK;
    if (grain == 0) grain = 1;
    ss_job job = {.body = body, .ctx = ctx, .n = n, .grain = grain};
    job.chunks = n / grain + (n % grain != 0);
    atomic_init(&job.next, 0);
    atomic_init(&job.failed, UINT64_MAX);
    pthread_mutex_init(&job.lock, NULL);
    if (inside_loop || pool->host.threads == 1 || job.chunks == 1) run_job(&job);
    else if (pool->host.parallel) run_on_host(pool, &job);
    else if (pool->threads == 1) run_job(&job);
    else run_on_pool(pool, &job);
    pthread_mutex_destroy(&job.lock);
    if (job.status != SOFTSHADOW_OK) return ss_fail(job.status, "%s", job.message);
    return SOFTSHADOW_OK;
}

struct ss_progress {
    const softshadow_options *host;
    pthread_mutex_t lock; /* held while the host's callback runs */
    double told;
    _Atomic uint64_t total, done;
    _Atomic bool cancelled;
};

struct ss_progress *ss_progress_create(const softshadow_options *options, uint64_t total) {
    ss_progress *progress = ss_alloc(1, sizeof *progress);
    if (!progress) return NULL;
    progress->host = options;
    atomic_init(&progress->total, total ? total : 1);
    pthread_mutex_init(&progress->lock, NULL);
    return progress;
}

void ss_progress_destroy(ss_progress *progress) {
    if (!progress) return;
    pthread_mutex_destroy(&progress->lock);
    ss_free(progress);
}

void ss_progress_expect(ss_progress *progress, uint64_t more) {
    if (progress) atomic_fetch_add(&progress->total, more);
}

softshadow_status ss_progress_add(ss_progress *progress, uint64_t done) {
    if (!progress) return SOFTSHADOW_OK;
    const uint64_t sum = atomic_fetch_add(&progress->done, done) + done;
    /* A busy callback is passed over, but the end is always told. */
    const uint64_t total = atomic_load(&progress->total);
    const bool whole = sum >= total;
    if (!atomic_load(&progress->cancelled) &&
        (whole ? pthread_mutex_lock : pthread_mutex_trylock)(&progress->lock) == 0) {
        double share = (double)sum / (double)total;
        if (share > 1) share = 1;
        if (share < progress->told) share = progress->told; /* never backwards */
        progress->told = share;
        if (progress->host->progress(progress->host->user, share)) {
            atomic_store(&progress->cancelled, true);
        }
        pthread_mutex_unlock(&progress->lock);
    }
    if (atomic_load(&progress->cancelled)) {
        return ss_fail(SOFTSHADOW_E_CANCELLED, "cancelled by the progress callback");
    }
    return SOFTSHADOW_OK;
}
