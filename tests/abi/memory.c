/* Memory runs out, at every single place where the library asks for it, once or from there on: the
 * call answers E_MEMORY, or does without; nothing crashes or leaks; and the handle then, when there
 * is memory again, gives the right bits.
 *
 * This program's own malloc and operator new stand before the C library's. They count, and fail,
 * only calls that come from libsoftshadow's text; what Embree and TBB ask for is theirs. */
#define _GNU_SOURCE /* RTLD_NEXT, dl_iterate_phdr */
#include <dlfcn.h>
#include <link.h>
#include <malloc.h>
#include <pthread.h>

#include "ask.h"

enum { SKIP = 77, N = 256 };

/* ---- The allocator before the allocator
 * ---------------------------------------------------------*/

extern void *__libc_malloc(size_t), *__libc_calloc(size_t, size_t), *__libc_realloc(void *, size_t);
extern void *__libc_memalign(size_t, size_t);
extern void __libc_free(void *);

static uintptr_t text_low, text_high;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static long calls, fail_at, failures; /* of the library, since arm() */
static bool for_good;                 /* not only this one fails but all that follow */
static __thread bool fail_next;       /* below operator new */

/* What the library holds: open addressing, NULL free, 1 removed. */
enum { SLOTS = 1 << 16 };
static void *held[SLOTS];
static long held_count;

static void hold(void *memory) {
    size_t slot = ((uintptr_t)memory >> 4) % SLOTS;
    while ((uintptr_t)held[slot] > 1) slot = (slot + 1) % SLOTS;
    held[slot] = memory, held_count++;
}

static void let_go(void *memory) {
    size_t slot = ((uintptr_t)memory >> 4) % SLOTS;
    for (int i = 0; i < SLOTS && held[slot]; i++, slot = (slot + 1) % SLOTS) {
        if (held[slot] != memory) continue;
        held[slot] = (void *)1, held_count--;
        return;
    }
}

static bool is_ours(const void *caller) {
    return (uintptr_t)caller >= text_low && (uintptr_t)caller < text_high;
}

/* One request of the library: is it the one to fail? */
static bool refuse(void) {
    pthread_mutex_lock(&lock);
    calls++;
    const bool now = calls == fail_at || (for_good && fail_at > 0 && calls > fail_at);
    failures += now;
    pthread_mutex_unlock(&lock);
    return now;
}

static void *given(const void *caller, void *memory) {
    if (memory && is_ours(caller)) {
        pthread_mutex_lock(&lock);
        hold(memory);
        pthread_mutex_unlock(&lock);
    }
    return memory;
}

/* Once: the exception that follows wants memory too. */
static bool told_to_fail(void) {
    const bool now = fail_next;
    fail_next = false;
    return now;
}

#define CALLER __builtin_return_address(0)
#define REFUSE (told_to_fail() || (is_ours(CALLER) && refuse()))

void *malloc(size_t size) { return REFUSE ? NULL : given(CALLER, __libc_malloc(size)); }
void *calloc(size_t n, size_t size) {
    return REFUSE ? NULL : given(CALLER, __libc_calloc(n, size));
}
void *memalign(size_t to, size_t size) {
    return REFUSE ? NULL : given(CALLER, __libc_memalign(to, size));
}
void *aligned_alloc(size_t to, size_t size) {
    return REFUSE ? NULL : given(CALLER, __libc_memalign(to, size));
}

int posix_memalign(void **out, size_t to, size_t size) {
    if (REFUSE) return 12; /* ENOMEM */
    *out = given(CALLER, __libc_memalign(to, size));
    return *out ? 0 : 12;
}

void free(void *memory) {
    if (memory && held_count) {
        pthread_mutex_lock(&lock);
        let_go(memory);
        pthread_mutex_unlock(&lock);
    }
    __libc_free(memory);
}

void *realloc(void *old, size_t size) {
    if (REFUSE) return NULL;
    if (old && held_count) {
        pthread_mutex_lock(&lock);
        let_go(old);
        pthread_mutex_unlock(&lock);
    }
    return given(CALLER, __libc_realloc(old, size));
}

/* Shims in C++ ask operator new, which asks malloc and throws: let it. */
void *_Znwm(size_t size);
void *_Znwm(size_t size) {
    static void *(*real)(size_t);
    if (!real) *(void **)&real = dlsym(RTLD_NEXT, "_Znwm");
    if (!real) return __libc_malloc(size); /* no C++ yet */
    if (!is_ours(CALLER)) return real(size);
    fail_next = refuse();
    return given(CALLER, real(size)); /* may throw through this frame: -fexceptions */
}

static int find_text(struct dl_phdr_info *info, size_t size, void *unused) {
    (void)size, (void)unused;
    if (!strstr(info->dlpi_name, "libsoftshadow.so")) return 0;
    for (int i = 0; i < info->dlpi_phnum; i++) {
        const ElfW(Phdr) *h = &info->dlpi_phdr[i];
        if (h->p_type != PT_LOAD || !(h->p_flags & PF_X)) continue;
        text_low = info->dlpi_addr + h->p_vaddr, text_high = text_low + h->p_memsz;
    }
    return 1;
}

/* ---- The work whose every allocation fails
 * ------------------------------------------------------*/

typedef struct work {
    const char *method;
    softshadow_build build; /* what differs from the defaults */
    scene_mesh mesh;
    softshadow_light light;
    double points[N][3];
    float want[N];
    uint32_t threads;
} work;

static void arm(long at) {
    pthread_mutex_lock(&lock);
    calls = 0, failures = 0, fail_at = at;
    pthread_mutex_unlock(&lock);
}

static bool acceptable(softshadow_status status) {
    return status == SOFTSHADOW_OK || status == SOFTSHADOW_E_MEMORY;
}

static softshadow_status add(softshadow *handle, const work *w) {
    const softshadow_mesh mesh = ask_mesh(&w->mesh);
    softshadow_status status = softshadow_add_mesh(handle, &mesh, NULL);
    if (!status) status = softshadow_set_light(handle, &w->light);
    return status;
}

static softshadow_status build_and_ask(softshadow *handle, const work *w, float *v) {
    softshadow_build build = w->build;
    build.resolution = 64; /* as many allocations as for any other, and quick */
    build.method = w->method, build.samples = 256;
    softshadow_status status = softshadow_build_maps(handle, &build);
    const softshadow_points points = ask_points((const double(*)[3])w->points, N);
    if (!status) status = softshadow_query_visibility(handle, &points, v);
    return status;
}

static softshadow_status look(softshadow *handle, const work *w) {
    softshadow_mesh_report report = SOFTSHADOW_MESH_REPORT_INIT;
    softshadow_status status = softshadow_mesh_info(handle, 0, &report);
    softshadow_explanation explanation = SOFTSHADOW_EXPLANATION_INIT;
    explanation.size = 8;
    if (!status) status = softshadow_explain(handle, &explanation);
    softshadow_error error = SOFTSHADOW_ERROR_INIT;
    error.samples = 64, error.max_points = 16;
    const softshadow_points points = ask_points((const double(*)[3])w->points, N);
    if (!status) status = softshadow_measure_error(handle, &points, &error);
    return status;
}

/* Everything once; the k-th allocation fails. Returns whether there was a k-th. */
static bool run(work *w, long k) {
    softshadow_options options = SOFTSHADOW_OPTIONS_INIT;
    options.threads = w->threads;
    softshadow *handle = NULL;
    static float v[N];
    arm(k);
    softshadow_status status = softshadow_create(&handle, &options);
    CHECK(acceptable(status) && (handle != NULL) == (status == SOFTSHADOW_OK),
          "create, allocation %ld: %s", k, softshadow_status_name(status));
    if (!status) status = add(handle, w);
    const bool added = !status;
    CHECK(acceptable(status), "add, allocation %ld: %s", k, softshadow_status_name(status));
    if (!status) status = build_and_ask(handle, w, v);
    CHECK(acceptable(status), "build and ask, allocation %ld: %s: %s", k,
          softshadow_status_name(status), softshadow_last_message(handle));
    if (!status) ask_same_bits(w->want, v, N, "with one allocation less");
    if (!status) status = look(handle, w);
    CHECK(acceptable(status), "looking inside, allocation %ld: %s: %s", k,
          softshadow_status_name(status), softshadow_last_message(handle));
    const bool failed = failures > 0;
    CHECK(failed || status == SOFTSHADOW_OK, "%s with all the memory it wants",
          softshadow_last_message(handle));
    arm(0);
    if (handle) { /* and now with memory */
        if (!added) {
            softshadow_remove_mesh(handle, 0); /* the light may be what failed */
            OK(handle, add(handle, w));
        }
        OK(handle, build_and_ask(handle, w, v));
        ask_same_bits(w->want, v, N, "after running out of memory");
    }
    softshadow_destroy(handle);
    return failed;
}

/* Each place in turn, on the threads of w; it alone, or it and all that follow. */
static void fail_each(work *w, bool all_that_follow) {
    softshadow *handle = NULL;
    arm(0);
    for_good = all_that_follow;
    OK(NULL, softshadow_create(&handle, NULL));
    OK(handle, add(handle, w));
    OK(handle, build_and_ask(handle, w, w->want));
    softshadow_destroy(handle);
    (void)run(w, 0); /* warm: whatever is made once per process is there now */
    const long before = held_count;
    long k = 1;
    while (run(w, k)) {
        CHECK(held_count == before, "allocation %ld: %ld blocks leaked", k, held_count - before);
        k++;
        CHECK(k < 5000, "too many allocations for a small scene");
    }
    print_message("           %u threads: %ld allocations, each failed%s\n", w->threads, k - 1,
                  for_good ? " with all that follow" : " once");
    CHECK(k > 10, "only %ld allocations were seen: the test sees nothing", k - 1);
}

static work new_work(const char *method) {
    work w = {.method = method,
              .build = SOFTSHADOW_BUILD_INIT,
              .threads = 1,
              .light = scene_sphere_light(0.2, 0.1, 6, 1)};
    static const float profile[3] = {1, 0.8f, 0.4f};
    w.light.profile = profile, w.light.profile_count = 3;
    scene_grid(w.points, 16, -2, 2, -2, 2, 0);
    return w;
}

static void add_small_scene(work *w) {
    scene_garbage(&w->mesh, 3);
    scene_icosphere(&w->mesh, (const double[3]){0, 0, 2}, 0.7, 1, 0);
}

static void every_allocation_fails_once(void **state) {
    work w = new_work(*state);
    add_small_scene(&w);
    for (w.threads = 1; w.threads <= 2; w.threads++) fail_each(&w, false);
    w.threads = 1;
    fail_each(&w, true);
    scene_free(&w.mesh);
}

static bool is_limit(const char *method) { return strcmp(method, "penumbra-limit") == 0; }

static void propagated_penumbrae(void **state) {
    work w = new_work(*state);
    add_small_scene(&w);
    w.build.propagate = 1;
    fail_each(&w, false);
    scene_free(&w.mesh);
}

/* A mesh just dense enough for coarser levels, which many points repay. */
static void coarser_levels(void **state) {
    enum { SIDE = 66 };
    work w = new_work(*state);
    uint64_t random = 3;
    for (uint32_t i = 0; i < SIDE * SIDE; i++) {
        scene_vertex(&w.mesh, i % SIDE / 32.0 - 1, i / SIDE / 32.0 - 1,
                     2 + scene_uniform(&random, 0, .005));
        if (i % SIDE == 0 || i < SIDE) continue;
        scene_triangle(&w.mesh, i, i - 1, i - SIDE);
        scene_triangle(&w.mesh, i - 1, i - SIDE - 1, i - SIDE);
    }
    w.build.points_ahead = 1 << 30, w.build.tolerance = 1.0 / 64;
    softshadow *handle = NULL;
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    OK(NULL, softshadow_create(&handle, NULL));
    OK(handle, add(handle, &w));
    OK(handle, build_and_ask(handle, &w, w.want));
    OK(handle, softshadow_get_stats(handle, &stats));
    CHECK(stats.lod_triangles > 0, "no levels were made of %zu triangles", w.mesh.triangles);
    softshadow_destroy(handle);
    fail_each(&w, false);
    scene_free(&w.mesh);
}

static bool is_exact(const char *method) { return strcmp(method, "exact") == 0; }

/* A map of lit and dark points, which many points repay, of a ball that has enough faces for
 * both. */
static void lit_and_dark_first(void **state) {
    work w = new_work(*state);
    scene_icosphere(&w.mesh, (const double[3]){0, 0, 2}, 1.2, 3, 0);
    CHECK(w.mesh.triangles >= 1024, "%zu faces are too few for a map of dark points",
          w.mesh.triangles);
    w.build.points_ahead = 1 << 30;
    w.light.radius = 0.2;
    softshadow *handle = NULL;
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    OK(NULL, softshadow_create(&handle, NULL));
    OK(handle, add(handle, &w));
    OK(handle, build_and_ask(handle, &w, w.want));
    OK(handle, softshadow_get_stats(handle, &stats));
    CHECK(stats.points_settled > stats.points_lit, "no dark points were told first: %lu, %lu lit",
          (unsigned long)stats.points_settled, (unsigned long)stats.points_lit);
    softshadow_destroy(handle);
    fail_each(&w, false);
    scene_free(&w.mesh);
}

/* A plate, by which points are told. */
static void flat_casters(void **state) {
    work w = new_work(*state);
    scene_rect(&w.mesh, -0.5, 0.5, -0.5, 0.5, 2);
    w.light.profile = NULL, w.light.profile_count = 0; /* plates know of none */
    softshadow *handle = NULL;
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    OK(NULL, softshadow_create(&handle, NULL));
    OK(handle, add(handle, &w));
    OK(handle, build_and_ask(handle, &w, w.want));
    OK(handle, softshadow_get_stats(handle, &stats));
    CHECK(stats.points_settled > 0, "no point was told by the plate");
    softshadow_destroy(handle);
    fail_each(&w, false);
    scene_free(&w.mesh);
}

/* One method with its maps and its query on the GPU. */
static void on_the_gpu(void **state) {
    softshadow_backend egl = SOFTSHADOW_BACKEND_INIT;
    OK(NULL, softshadow_backend_info(SOFTSHADOW_EGL, &egl));
    if (egl.status != SOFTSHADOW_OK) {
        print_message("           left out: %s\n", egl.why);
        return;
    }
    work w = new_work(*state);
    add_small_scene(&w);
    w.build.backend = SOFTSHADOW_EGL;
    fail_each(&w, false);
    scene_free(&w.mesh);
}

int main(void) {
    const char *sanitizers = getenv("SANITIZERS");
    if (sanitizers && *sanitizers) {
        fprintf(stderr, "SKIPPED: sanitizers (%s) bring an allocator of their own\n", sanitizers);
        return SKIP;
    }
    dl_iterate_phdr(find_text, NULL);
    if (!text_high) {
        fprintf(stderr, "libsoftshadow.so is not loaded: is this linked statically?\n");
        return 99;
    }
    const ask_test tests[] = {
        {"every allocation fails once", every_allocation_fails_once, NULL},
        {"with propagated penumbrae", propagated_penumbrae, is_limit},
        {"with coarser levels", coarser_levels, ask_auto},
        {"with lit and dark points told first", lit_and_dark_first, is_exact},
        {"with flat casters", flat_casters, is_exact},
        {"on the GPU", on_the_gpu, is_limit},
    };
    return ask_run("memory", tests, sizeof tests / sizeof *tests);
}
