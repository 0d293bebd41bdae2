/* What belongs to the host: rounding mode, traps, flushed denormals, locale, working directory,
 * signal handlers, output. The library finds it in any state, gives the same bits and leaves it. */
#define _GNU_SOURCE /* feenableexcept */
#include <fcntl.h>
#include <fenv.h>
#include <locale.h>
#include <pthread.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>
#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#include "abi/plain.h"

static const plain_api api = PLAIN_LINKED;
static float want[PLAIN_POINTS], got[PLAIN_POINTS];

static void same(const char *method, const char *when) {
    REQUIRE(memcmp(want, got, sizeof want) == 0, "%s answers otherwise with %s", method, when);
}

/* ---- The floating-point environment
 * -------------------------------------------------------------*/

typedef struct mode {
    int rounding, traps;
    unsigned mxcsr;
} mode;

static mode current(void) {
    mode m = {.rounding = fegetround(), .traps = fegetexcept()};
#if defined(__x86_64__)
    m.mxcsr = _mm_getcsr() & ~0x3fu; /* sticky flags apart */
#endif
    return m;
}

static void floating_point(const char *method) {
    static const int rounding[] = {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO, FE_TONEAREST};
    for (int i = 0; i < 6; i++) {
        fenv_t before;
        fegetenv(&before);
        fesetround(rounding[i < 4 ? i : 3]);
        if (i == 4)
            feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW | FE_UNDERFLOW | FE_INEXACT);
#if defined(__x86_64__)
        if (i == 5) _mm_setcsr(_mm_getcsr() | 0x8040u); /* flush, and take denormals for zero */
#endif
        const mode mine = current();
        plain_run(&api, method, got);
        const mode after = current();
        fesetenv(&before);
        REQUIRE(mine.rounding == after.rounding && mine.traps == after.traps &&
                    mine.mxcsr == after.mxcsr,
                "%s, mode %d: rounding %d -> %d, traps %d -> %d, MXCSR %x -> %x", method, i,
                mine.rounding, after.rounding, mine.traps, after.traps, mine.mxcsr, after.mxcsr);
        char when[32];
        snprintf(when, sizeof when, "floating-point mode %d", i);
        same(method, when);
    }
}

/* Refusals leave by the same door. */
static void refused_calls(void) {
    feenableexcept(FE_DIVBYZERO);
    fesetround(FE_UPWARD);
    const mode mine = current();
    softshadow *handle = NULL;
    softshadow_create(&handle, NULL);
    softshadow_add_mesh(handle, NULL, NULL);
    softshadow_build_maps(handle, NULL);
    softshadow_query_visibility(handle, NULL, NULL);
    softshadow_query_visibility(NULL, NULL, NULL);
    softshadow_destroy(handle);
    const mode after = current();
    fedisableexcept(FE_ALL_EXCEPT);
    fesetround(FE_TONEAREST);
    REQUIRE(mine.rounding == after.rounding && mine.traps == after.traps &&
                mine.mxcsr == after.mxcsr,
            "a refused call changes the floating-point mode");
}

/* A host's threads, which run our bodies, keep theirs, too. */
typedef struct lent {
    void (*body)(void *, uint64_t, uint64_t);
    void *ctx;
    uint64_t n;
} lent;

static void *odd_thread(void *argument) {
    lent *l = argument;
    fesetround(FE_UPWARD);
    const mode mine = current();
    l->body(l->ctx, 0, l->n);
    const mode after = current();
    return (void *)(uintptr_t)(mine.rounding != after.rounding || mine.mxcsr != after.mxcsr);
}

static void on_an_odd_thread(void *user, uint64_t n, void (*body)(void *, uint64_t, uint64_t),
                             void *ctx) {
    (void)user;
    lent l = {body, ctx, n};
    pthread_t thread;
    void *changed = NULL;
    REQUIRE(pthread_create(&thread, NULL, odd_thread, &l) == 0, "pthread_create");
    pthread_join(thread, &changed);
    REQUIRE(!changed, "a host's thread was left in another floating-point mode");
}

static void lent_threads(const char *method) {
    softshadow_options options = SOFTSHADOW_OPTIONS_INIT;
    options.parallel = on_an_odd_thread, options.threads = 2;
    softshadow *handle = NULL;
    REQUIRE(plain_scene(&api, &handle, &options) == SOFTSHADOW_OK, "scene");
    REQUIRE(plain_ask(&api, handle, method, got) == SOFTSHADOW_OK, "%s",
            softshadow_last_message(handle));
    softshadow_destroy(handle);
    same(method, "a host's threads that round upwards");
}

/* A host with small stacks. Embree's packets of 16 take 60 KiB by themselves (measured); without
 * rays 64 KiB have to do. */
static void *run_small(void *method) {
    plain_run(&api, method, got);
    return NULL;
}

static void small_stacks(const char *method) {
    pthread_attr_t attributes;
    pthread_t thread;
    pthread_attr_init(&attributes);
    const int rays = strcmp(method, "raytrace") == 0 || strcmp(method, "auto") == 0;
    pthread_attr_setstacksize(&attributes, (size_t)(rays ? 128 : 64) << 10);
    REQUIRE(pthread_create(&thread, &attributes, run_small, (void *)(uintptr_t)method) == 0,
            "pthread_create");
    pthread_join(thread, NULL);
    pthread_attr_destroy(&attributes);
    same(method, "a small stack");
}

/* ---- Everything else
 * ----------------------------------------------------------------------------*/

/* 0: there is such a locale and decimals have commas. */
static int comma_locale(void) {
    if (setlocale(LC_ALL, "de_DE.UTF-8")) return strcmp(localeconv()->decimal_point, ",");
    return 1;
}

static void signals_and_folders(const char *method) {
    struct sigaction before[32], after;
    char folder[2][4096];
    for (int i = 1; i < 32; i++) sigaction(i, NULL, &before[i]);
    REQUIRE(getcwd(folder[0], sizeof *folder), "getcwd");
    plain_run(&api, method, got);
    REQUIRE(getcwd(folder[1], sizeof *folder) && strcmp(folder[0], folder[1]) == 0,
            "working directory");
    for (int i = 1; i < 32; i++) {
        sigaction(i, NULL, &after);
        REQUIRE(before[i].sa_handler == after.sa_handler && before[i].sa_flags == after.sa_flags,
                "%s: signal %d got another handler", method, i);
    }
}

/* Nothing is printed: both outputs go to a file that stays empty. */
static void silence(const char *method) {
    char name[] = "/tmp/softshadow-silence-XXXXXX";
    const int file = mkstemp(name), out = dup(1), err = dup(2);
    REQUIRE(file >= 0 && out >= 0 && err >= 0, "mkstemp, dup");
    unlink(name);
    fflush(NULL);
    dup2(file, 1), dup2(file, 2);
    softshadow *handle = NULL;
    plain_scene(&api, &handle, NULL);
    plain_ask(&api, handle, method, got);
    plain_ask(&api, handle, "no-such-method", got);
    softshadow_destroy(handle);
    fflush(NULL);
    dup2(out, 1), dup2(err, 2);
    struct stat status;
    REQUIRE(fstat(file, &status) == 0 && status.st_size == 0, "%s: %ld bytes were printed", method,
            (long)status.st_size);
    close(file), close(out), close(err);
}

int main(void) {
    const char *names[64];
    const int comma = comma_locale();
    setlocale(LC_ALL, "C");
    const unsigned n = plain_methods(&api, names);
    refused_calls();
    for (unsigned i = 0; i < n; i++) {
        plain_run(&api, names[i], want);
        plain_plausible(want, names[i]);
        floating_point(names[i]);
        lent_threads(names[i]);
        if (!plain_sanitized("small stacks: instrumented frames are larger"))
            small_stacks(names[i]);
        signals_and_folders(names[i]);
        silence(names[i]);
        if (comma) continue;
        setlocale(LC_ALL, "de_DE.UTF-8");
        plain_run(&api, names[i], got);
        REQUIRE(strcmp(setlocale(LC_ALL, NULL), "de_DE.UTF-8") == 0, "the locale was changed");
        setlocale(LC_ALL, "C");
        same(names[i], "a comma locale");
    }
    printf("%u methods leave the host as it was%s\n", n,
           comma ? "; NO COMMA LOCALE on this machine" : "");
    return comma && getenv("LOCPATH") ? 1 : 0;
}
