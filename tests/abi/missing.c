/* Embree is not there: what needs it says so in words, what does not works as ever. The host's
 * dlopen stands before the C library's and finds no Embree. */
#define _GNU_SOURCE /* RTLD_NEXT */
#include <dlfcn.h>

#include "abi/plain.h"

static int refused;
static const char *trouble;

void *dlopen(const char *file, int flags) {
    static void *(*real)(const char *, int);
    if (!real) *(void **)&real = dlsym(RTLD_NEXT, "dlopen");
    trouble = NULL;
    if (file && strstr(file, "embree")) {
        refused++;
        trouble = "embree: refused by the host of this test";
        return NULL;
    }
    return real(file, flags);
}

char *dlerror(void) {
    static char *(*real)(void);
    if (!real) *(void **)&real = dlsym(RTLD_NEXT, "dlerror");
    const char *text = trouble;
    trouble = NULL;
    return text ? (char *)(uintptr_t)text : real();
}

int main(void) {
    static const plain_api api = PLAIN_LINKED;
    static float v[PLAIN_POINTS];
    const char *names[64];
    const unsigned n = plain_methods(&api, names);
    if (plain_sanitized("the sanitizer's own dlopen stands in between")) return PLAIN_SKIP;
    for (unsigned i = 0; i < n; i++) {
        softshadow *handle = NULL;
        REQUIRE(plain_scene(&api, &handle, NULL) == SOFTSHADOW_OK, "nothing but rays needs Embree");
        const softshadow_status status = plain_ask(&api, handle, names[i], v);
        const char *message = softshadow_last_message(handle);
        if (strcmp(names[i], "raytrace") == 0) {
            REQUIRE(status == SOFTSHADOW_E_BACKEND, "%s: %d", names[i], (int)status);
        }
        if (status == SOFTSHADOW_E_BACKEND) {
            REQUIRE(strstr(message, "mbree") && strstr(message, "refused by the host"),
                    "%s: the message \"%s\" does not say what is missing", names[i], message);
        } else {
            REQUIRE(status == SOFTSHADOW_OK, "%s: %d: %s", names[i], (int)status, message);
            plain_plausible(v, names[i]);
        }
        printf("%s: %s\n", names[i], status ? message : "works without Embree");
        softshadow_destroy(handle);
    }
    REQUIRE(refused > 0, "nobody asked for Embree: this test saw nothing");
    return 0;
}
