#include "base/process.h"

#include <pthread.h>
#include <stdatomic.h>

static _Atomic unsigned generation;
static pthread_once_t once = PTHREAD_ONCE_INIT;

static void in_child(void) { atomic_fetch_add(&generation, 1); }

/* The handler may stay registered for ever: the library is linked -z nodelete. */
static void watch(void) { pthread_atfork(NULL, NULL, in_child); }

void ss_process_watch(void) { pthread_once(&once, watch); }

unsigned ss_process_generation(void) { return atomic_load(&generation); }
