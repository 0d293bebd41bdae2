/* No thread can be started, or none after the first few: the work is done on those there are, at
 * least the caller's own, with the same bits. Not promised for rays: TBB, below Embree, ends the
 * process when it cannot start its own. */
#define _GNU_SOURCE /* RTLD_NEXT */
#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>

#include "abi/plain.h"

static int refusing, refused, left; /* left: how many may still be started */

int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*body)(void *),
                   void *argument) {
    static int (*real)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);
    if (!real) *(void **)&real = dlsym(RTLD_NEXT, "pthread_create");
    if (!refusing || __atomic_fetch_sub(&left, 1, __ATOMIC_SEQ_CST) > 0)
        return real(thread, attributes, body, argument);
    __atomic_add_fetch(&refused, 1, __ATOMIC_SEQ_CST);
    return EAGAIN;
}

static void run_on_four(const plain_api *api, const char *method, float *v) {
    softshadow_options options = SOFTSHADOW_OPTIONS_INIT;
    options.threads = 4;
    softshadow *handle = NULL;
    softshadow_status status = plain_scene(api, &handle, &options);
    if (!status) status = plain_ask(api, handle, method, v);
    REQUIRE(status == SOFTSHADOW_OK, "%s: %d: %s", method, (int)status, api->last_message(handle));
    api->destroy(handle);
}

int main(void) {
    static const plain_api api = PLAIN_LINKED;
    static float want[PLAIN_POINTS], got[PLAIN_POINTS];
    const char *names[64];
    int tried = 0;
    if (plain_sanitized("the sanitizer's own pthread_create stands in between")) return PLAIN_SKIP;
    const unsigned n = plain_methods(&api, names);
    for (unsigned i = 0; i < n; i++) {
        if (strcmp(names[i], "raytrace") == 0 || strcmp(names[i], "auto") == 0) continue;
        run_on_four(&api, names[i], want);
        plain_plausible(want, names[i]);
        for (int started = 0; started < 4; started++) {
            left = started, refusing = 1;
            run_on_four(&api, names[i], got);
            refusing = 0;
            REQUIRE(memcmp(want, got, sizeof want) == 0, "%s answers otherwise with %d threads more",
                    names[i], started);
        }
        tried++;
    }
    REQUIRE(!tried || refused, "nobody asked for a thread: this test saw nothing");
    printf("%d methods do without threads; %d were refused\n", tried, refused);
    return 0;
}
