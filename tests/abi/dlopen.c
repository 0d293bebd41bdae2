/* A host that is not linked with the library and loads it by hand, a hundred times or as often as
 * the argument says: dlopen, create, query, destroy, dlclose. The memory it holds and its threads
 * stay what they were after the first rounds, and so do its answers. Says how long loading takes.
 *
 * dlopen twice: two rounds a method, for valgrind, which has an eye on the memory itself. */
#include <dirent.h>
#include <dlfcn.h>
#include <malloc.h>
#include <stdbool.h>
#include <time.h>
#include <unistd.h>

#include "abi/plain.h"

static long resident_kib(void) {
    malloc_trim(0); /* what is free: how much of it the heap keeps depends on which method was last */
    long pages = 0, resident = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    REQUIRE(file && fscanf(file, "%ld %ld", &pages, &resident) == 2, "/proc/self/statm");
    fclose(file);
    return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

static int thread_count(void) {
    DIR *folder = opendir("/proc/self/task");
    REQUIRE(folder, "/proc/self/task");
    int n = 0;
    for (struct dirent *entry; (entry = readdir(folder));) n += entry->d_name[0] != '.';
    closedir(folder);
    return n;
}

static void *symbol(void *library, const char *name) {
    void *found = dlsym(library, name);
    REQUIRE(found, "%s: %s", name, dlerror());
    return found;
}

static void *load(const char *path, plain_api *api) {
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    REQUIRE(library, "%s", dlerror());
    *(void **)&api->create = symbol(library, "softshadow_create");
    *(void **)&api->add_mesh = symbol(library, "softshadow_add_mesh");
    *(void **)&api->set_light = symbol(library, "softshadow_set_light");
    *(void **)&api->build_maps = symbol(library, "softshadow_build_maps");
    *(void **)&api->query_visibility = symbol(library, "softshadow_query_visibility");
    *(void **)&api->method_count = symbol(library, "softshadow_method_count");
    *(void **)&api->method_info = symbol(library, "softshadow_method_info");
    *(void **)&api->last_message = symbol(library, "softshadow_last_message");
    *(void **)&api->destroy = symbol(library, "softshadow_destroy");
    return library;
}

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec / 1e6;
}

enum { TWICE = 0, SETTLED = 20 };

/* With every method, a method a round; TWICE: until each was there twice. Returns the rounds. */
static int cycle(const char *path, int rounds) {
    const bool twice = rounds == TWICE;
    static float first[64][PLAIN_POINTS], v[PLAIN_POINTS];
    long resident = 0;
    int threads = 0;
    for (int round = 0; round < rounds || round == 0; round++) {
        plain_api api;
        const char *names[64];
        const double start = now();
        void *library = load(path, &api);
        const double took = now() - start;
        if (round == 0) printf("first dlopen and look-ups: %.2f ms\n", took);
        const unsigned n = plain_methods(&api, names), which = (unsigned)round % n;
        if (twice) rounds = 2 * (int)n;
        plain_run(&api, names[which], v);
        if ((unsigned)round < n) {
            memcpy(first[which], v, sizeof v);
            plain_plausible(v, names[which]);
        }
        REQUIRE(memcmp(first[which], v, sizeof v) == 0, "round %d: %s answers otherwise", round,
                names[which]);
        REQUIRE(dlclose(library) == 0, "%s", dlerror());
        if (round + 1 == SETTLED) resident = resident_kib(), threads = thread_count();
    }
    if (twice) return rounds;
    const long grown = resident_kib() - resident;
    const int more = thread_count() - threads;
    printf("%d further rounds: %+ld KiB resident, %+d threads\n", rounds - SETTLED, grown, more);
    /* Heaps breathe; 80 leaks of a scene, or of one thread's stack, would show; in 980 rounds a
     * page a round would. */
    REQUIRE(grown < 1024, "%ld KiB more than after %d rounds", grown, SETTLED);
    REQUIRE(more <= 0, "%d threads more than after %d rounds", more, SETTLED);
    return rounds;
}

int main(int argc, char **argv) {
    if (plain_sanitized("a sanitizer's runtime cannot be loaded late")) return PLAIN_SKIP;
    /* Left to itself glibc keeps ever more freed memory once it has met a large block: up to 17 MiB
     * here. With a fixed threshold it gives it back, and what is left is what is in use. */
    mallopt(M_TRIM_THRESHOLD, 128 << 10);
    const char *build = getenv("top_builddir");
    char path[4096];
    snprintf(path, sizeof path, "%s/.libs/libsoftshadow.so.1", build ? build : ".");
    const bool twice = argc > 1 && strcmp(argv[1], "twice") == 0;
    const int asked = twice ? TWICE : argc > 1 ? atoi(argv[1]) : 100;
    REQUIRE(twice || asked > SETTLED, "%s: twice or more than %d is allowed", argv[1], SETTLED);
    const int rounds = cycle(path, asked);
    printf("%d rounds of dlopen, query, dlclose\n", rounds);
    return 0;
}
