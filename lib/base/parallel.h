/* Parallel loops on the host's scheduler, or on our own threads. Results never depend on which.
 *
 * A body gets ranges of 0..n. It may fail: the first failure (by range, so that the message does
 * not depend on the schedule more than it must) stops further ranges and is what ss_parallel_for
 * gives. Any number of host threads may run loops on one pool at once; nested loops run
 * serially. */
#ifndef SS_BASE_PARALLEL_H
#define SS_BASE_PARALLEL_H

#include <stdbool.h>
#include <stdint.h>

#include "softshadow.h"

typedef struct ss_pool ss_pool;
typedef softshadow_status ss_body(void *ctx, uint64_t begin, uint64_t end);

/* Starts no thread before the first loop needs one; where none can be started loops run
 * serially. */
softshadow_status ss_pool_create(ss_pool **out, const softshadow_options *options);
void ss_pool_destroy(ss_pool *pool);
unsigned ss_pool_threads(const ss_pool *pool);
/* The host's options as they were given, all zero without any: its log callback for one. */
const softshadow_options *ss_pool_options(const ss_pool *pool);

/* Loops of the calling thread run on it alone from now on, or no longer. Gives what was so
 * before. */
bool ss_parallel_alone(bool alone);
/* Calls body for ranges of at most `grain` items that together cover 0..n once. */
softshadow_status ss_parallel_for(ss_pool *pool, uint64_t n, uint64_t grain, ss_body *body,
                                  void *ctx);

/* Progress of one public call. Thread-safe; the host's callback runs on one thread at a time. */
typedef struct ss_progress ss_progress;
struct ss_progress *ss_progress_create(const softshadow_options *options, uint64_t total);
void ss_progress_destroy(ss_progress *progress);
/* More is to be done than was thought; NULL progress is fine. */
void ss_progress_expect(ss_progress *progress, uint64_t more);
/* Adds done of total; SOFTSHADOW_E_CANCELLED once the host has said stop. NULL progress is fine. */
softshadow_status ss_progress_add(ss_progress *progress, uint64_t done);

#endif
