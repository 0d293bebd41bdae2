/* A GPU that fails: no library, no display or none that starts, no context, none that can be used,
 * no memory at every place that asks for it, a context that is lost at every dispatch, a shader
 * that does not compile. SOFTSHADOW_EGL says so in the driver's words and the handle goes on
 * working on the CPU; SOFTSHADOW_ANY gives the CPU's answers and says so once. Then what a query
 * sends: chunks, the next on its way before the last is back; and what is left at the driver's:
 * nothing.
 *
 * The host's dlopen stands before the C library's: for libEGL it gives this program itself, whose
 * eglGetProcAddress puts its own functions before some of the driver's. */
#define _GNU_SOURCE /* RTLD_NEXT */
#include <dlfcn.h>
#include <stdbool.h>
#include <time.h>

#include "abi/plain.h"

typedef void function(void);
typedef unsigned GLenum, GLuint, GLbitfield;
typedef int GLint, GLsizei;
enum { GL_OUT_OF_MEMORY = 0x505, GL_GUILTY_CONTEXT_RESET = 0x8253, GL_COMPILE_STATUS = 0x8B81 };

/* ---- the faults ------------------------------------------------------------------------------ */

static bool no_library, no_display, no_start, no_context, not_current, no_shader;
static long buffers, fail_buffer, dispatches, fail_dispatch; /* the how manieth; 0: none */
static bool pending, lost;
static unsigned faults;
static long objects; /* buffers and fences that are there */
static const char *trouble;
static function *(*real_find)(const char *);

static function *driver(const char *name) { return real_find(name); }

static void buffer_data(GLenum target, ptrdiff_t size, const void *data, GLenum usage) {
    if (++buffers == fail_buffer) {
        pending = true, faults++;
        return;
    }
    ((void (*)(GLenum, ptrdiff_t, const void *, GLenum))driver("glBufferData"))(target, size, data,
                                                                                usage);
}

static GLenum get_error(void) {
    const GLenum own = ((GLenum(*)(void))driver("glGetError"))();
    const bool told = pending;
    pending = false;
    return told ? GL_OUT_OF_MEMORY : own;
}

static void dispatch(GLuint x, GLuint y, GLuint z) {
    if (++dispatches == fail_dispatch) lost = true, faults++;
    if (!lost) ((void (*)(GLuint, GLuint, GLuint))driver("glDispatchCompute"))(x, y, z);
}

static GLenum reset_status(void) { return lost ? GL_GUILTY_CONTEXT_RESET : 0; }

static void *get_display(unsigned platform, void *native, const GLint *attributes) {
    if (no_display) return faults++, NULL;
    return ((void *(*)(unsigned, void *, const GLint *))driver("eglGetPlatformDisplayEXT"))(
        platform, native, attributes);
}

static unsigned initialize(void *display, GLint *major, GLint *minor) {
    if (no_start) return faults++, 0;
    return ((unsigned (*)(void *, GLint *, GLint *))driver("eglInitialize"))(display, major, minor);
}

static unsigned make_current(void *display, void *draw, void *read, void *context) {
    if (not_current && context) return faults++, 0;
    return ((unsigned (*)(void *, void *, void *, void *))driver("eglMakeCurrent"))(display, draw,
                                                                                    read, context);
}

static void *create_context(void *display, void *config, void *share, const GLint *attributes) {
    lost = false, objects = 0;
    if (no_context) return faults++, NULL;
    return ((void *(*)(void *, void *, void *, const GLint *))driver("eglCreateContext"))(
        display, config, share, attributes);
}

static void shader_iv(GLuint shader, GLenum what, GLint *value) {
    ((void (*)(GLuint, GLenum, GLint *))driver("glGetShaderiv"))(shader, what, value);
    if (no_shader && what == GL_COMPILE_STATUS) *value = 0, faults++;
}

static void shader_log(GLuint shader, GLsizei room, GLsizei *length, char *text) {
    (void)shader, (void)length;
    snprintf(text, (size_t)room, "words of\nthe driver");
}

/* ---- what comes and goes ---------------------------------------------------------------------- */

/* Of one query: how many chunks went up before the answers to the first were fetched. */
static struct {
    bool on;
    long flying, most, chunks;
    ptrdiff_t largest;
} traffic;

static void gen_buffers(GLsizei n, GLuint *names) {
    ((void (*)(GLsizei, GLuint *))driver("glGenBuffers"))(n, names);
    objects += n;
}

static void delete_buffers(GLsizei n, const GLuint *names) {
    for (GLsizei i = 0; i < n; i++) objects -= names[i] != 0;
    ((void (*)(GLsizei, const GLuint *))driver("glDeleteBuffers"))(n, names);
}

static void *fence_sync(GLenum what, GLbitfield flags) {
    objects++, traffic.flying++, traffic.chunks++;
    if (traffic.flying > traffic.most) traffic.most = traffic.flying;
    return ((void *(*)(GLenum, GLbitfield))driver("glFenceSync"))(what, flags);
}

static void delete_sync(void *fence) {
    objects--;
    ((void (*)(void *))driver("glDeleteSync"))(fence);
}

/* A device that takes its time, so that it is not a matter of luck what is handed to it
 * meanwhile. */
static GLenum client_wait(void *fence, GLbitfield flags, uint64_t longest) {
    if (traffic.on) nanosleep(&(struct timespec){.tv_nsec = 20000000}, NULL);
    return ((GLenum(*)(void *, GLbitfield, uint64_t))driver("glClientWaitSync"))(fence, flags,
                                                                                 longest);
}

static void get_data(GLenum target, ptrdiff_t from, ptrdiff_t size, void *data) {
    traffic.flying--;
    if (size > traffic.largest) traffic.largest = size;
    ((void (*)(GLenum, ptrdiff_t, ptrdiff_t, void *))driver("glGetBufferSubData"))(target, from,
                                                                                   size, data);
}

function *eglGetProcAddress(const char *name);
function *eglGetProcAddress(const char *name) {
    static const struct {
        const char *name;
        function *ours;
    } wrapped[] = {{"glBufferData", (function *)buffer_data},
                   {"glGetError", (function *)get_error},
                   {"glDispatchCompute", (function *)dispatch},
                   {"glGetGraphicsResetStatus", (function *)reset_status},
                   {"eglGetPlatformDisplayEXT", (function *)get_display},
                   {"eglInitialize", (function *)initialize},
                   {"eglMakeCurrent", (function *)make_current},
                   {"eglCreateContext", (function *)create_context},
                   {"glGenBuffers", (function *)gen_buffers},
                   {"glDeleteBuffers", (function *)delete_buffers},
                   {"glFenceSync", (function *)fence_sync},
                   {"glDeleteSync", (function *)delete_sync},
                   {"glClientWaitSync", (function *)client_wait},
                   {"glGetBufferSubData", (function *)get_data},
                   {"glGetShaderiv", (function *)shader_iv},
                   {"glGetShaderInfoLog", (function *)shader_log}};
    for (size_t i = 0; i < sizeof wrapped / sizeof *wrapped; i++) {
        if (strcmp(wrapped[i].name, name) == 0) return wrapped[i].ours;
    }
    return driver(name);
}

void *dlopen(const char *file, int flags) {
    static void *(*real)(const char *, int);
    if (!real) *(void **)&real = dlsym(RTLD_NEXT, "dlopen");
    trouble = NULL;
    if (!file || strcmp(file, "libEGL.so.1") != 0) return real(file, flags);
    void *library = no_library ? NULL : real(file, flags);
    if (!library) {
        if (no_library) trouble = "libEGL.so.1: refused by the host of this test", faults++;
        return NULL;
    }
    *(void **)&real_find = dlsym(library, "eglGetProcAddress");
    return real(NULL, RTLD_NOW);
}

char *dlerror(void) {
    static char *(*real)(void);
    if (!real) *(void **)&real = dlsym(RTLD_NEXT, "dlerror");
    const char *text = trouble;
    trouble = NULL;
    return text ? (char *)(uintptr_t)text : real();
}

/* ---- what has to come of them ---------------------------------------------------------------- */

static const plain_api api = PLAIN_LINKED;
static float truth[PLAIN_POINTS], v[PLAIN_POINTS];
static unsigned told;
static char told_text[512];

static void on_log(void *user, int32_t level, const char *text) {
    (void)user, (void)level;
    if (!strstr(text, "SOFTSHADOW_ANY")) return;
    told++;
    snprintf(told_text, sizeof told_text, "%s", text);
}

static softshadow_status build(softshadow *handle, const char *method, uint32_t backend) {
    softshadow_build wish = SOFTSHADOW_BUILD_INIT;
    wish.method = method, wish.backend = backend, wish.resolution = 64;
    wish.mask_taps = 4, wish.blur = 8;
    return softshadow_build_maps(handle, &wish);
}

static softshadow_status ask(softshadow *handle, float *out) {
    static float p[PLAIN_POINTS][3];
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    for (int i = 0; i < PLAIN_POINTS; i++) {
        p[i][0] = (float)(i % 32) / 8 - 2, p[i][1] = (float)(i / 32) / 8 - 2, p[i][2] = 0;
    }
    points.positions = p, points.count = PLAIN_POINTS, points.width = 32;
    return softshadow_query_visibility(handle, &points, out);
}

static softshadow_status build_and_ask(softshadow *handle, const char *method, uint32_t backend) {
    const softshadow_status status = build(handle, method, backend);
    return status ? status : ask(handle, v);
}

/* Map methods on two machines: see tests/property/gpu.c for how near they are. */
static void require_truth(const char *where) {
    for (int i = 0; i < PLAIN_POINTS; i++) {
        REQUIRE(v[i] >= truth[i] - 1.f / 16 && v[i] <= truth[i] + 1.f / 16,
                "%s: point %d: %g, not %g", where, i, v[i], truth[i]);
    }
}

static softshadow *new_handle(void) {
    static const softshadow_options options = {.struct_size = sizeof options, .log = on_log};
    softshadow *handle;
    told = 0;
    REQUIRE(plain_scene(&api, &handle, &options) == SOFTSHADOW_OK, "a scene");
    return handle;
}

static void on_the_cpu(softshadow *handle, const char *method) {
    REQUIRE(build_and_ask(handle, method, SOFTSHADOW_CPU) == SOFTSHADOW_OK, "the CPU: %s",
            softshadow_last_message(handle));
    REQUIRE(memcmp(v, truth, sizeof v) == 0, "%s: the CPU's bits", method);
}

/* SOFTSHADOW_EGL, a fault ahead: false if it did not come to it. */
static bool fails(const char *method, const char *words) {
    softshadow *handle = new_handle();
    const unsigned before = faults;
    const softshadow_status status = build_and_ask(handle, method, SOFTSHADOW_EGL);
    const char *message = softshadow_last_message(handle);
    const bool fault = faults > before;
    if (fault) {
        REQUIRE(status == SOFTSHADOW_E_BACKEND, "%s: %d: %s", words, (int)status, message);
        REQUIRE(strstr(message, words), "\"%s\" has no \"%s\"", message, words);
        REQUIRE(!strchr(message, '\n'), "a message of one line");
        on_the_cpu(handle, method);
    } else {
        REQUIRE(status == SOFTSHADOW_OK, "no fault: %d: %s", (int)status, message);
        require_truth("no fault");
    }
    softshadow_destroy(handle);
    return fault;
}

/* SOFTSHADOW_ANY, a fault ahead, once or for good. */
static void falls_back(const char *method, const char *words) {
    softshadow *handle = new_handle();
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    const unsigned before = faults;
    REQUIRE(build_and_ask(handle, method, SOFTSHADOW_ANY) == SOFTSHADOW_OK, "%s: %s", words,
            softshadow_last_message(handle));
    require_truth(words);
    REQUIRE(softshadow_get_stats(handle, &stats) == SOFTSHADOW_OK, "stats");
    REQUIRE(strcmp(stats.backend_used, faults > before ? "cpu" : "egl") == 0, "%s",
            stats.backend_used);
    REQUIRE(ask(handle, v) == SOFTSHADOW_OK, "%s: again: %s", words,
            softshadow_last_message(handle));
    require_truth(words);
    REQUIRE(told == (faults > before), "%s: told %u times", words, told);
    REQUIRE(!told || strstr(told_text, words), "\"%s\" has no \"%s\"", told_text, words);
    REQUIRE(build(handle, method, SOFTSHADOW_ANY) == SOFTSHADOW_OK &&
                softshadow_get_stats(handle, &stats) == SOFTSHADOW_OK && stats.build_seconds == 0,
            "%s: built once more, though nothing was stale", words);
    softshadow_destroy(handle);
}

/* ---- the cases ------------------------------------------------------------------------------- */

static void for_good(bool *fault, const char *method, const char *words) {
    *fault = true;
    REQUIRE(fails(method, words), "%s: nothing failed", words);
    falls_back(method, words);
    *fault = false;
}

/* The how manieth of a build and a query fails, once, until there are no more; each time all is
 * well again afterwards. */
static void each(const char *method, long *count, long *fail, const char *words) {
    long at = 1;
    for (bool fault = true; fault; at++) {
        *count = 0, *fail = at;
        fault = fails(method, words);
        *count = 0;
        falls_back(method, words);
        *fail = 0;
        REQUIRE(!fails(method, words), "a fault that nobody asked for");
    }
    REQUIRE(at > 3, "%s: %s: only %ld places", method, words, at - 2);
    printf("%s: %s at each of %ld places\n", method, words, at - 2);
}

/* Ten chunks of points, 64 KiB of answers each. */
static void in_chunks(void) {
    enum { CHUNKS = 10, EACH = 16384 };
    static float p[CHUNKS * EACH][3], seen[CHUNKS * EACH];
    softshadow *handle = new_handle();
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    for (int i = 0; i < CHUNKS * EACH; i++) p[i][0] = (float)i / (CHUNKS * EACH), p[i][1] = .3f;
    points.positions = p, points.count = CHUNKS * EACH;
    REQUIRE(build(handle, "hard", SOFTSHADOW_EGL) == SOFTSHADOW_OK, "a build");
    traffic.on = true;
    traffic.flying = traffic.most = traffic.chunks = traffic.largest = 0;
    REQUIRE(softshadow_query_visibility(handle, &points, seen) == SOFTSHADOW_OK, "%s",
            softshadow_last_message(handle));
    traffic.on = false;
    REQUIRE(traffic.chunks == CHUNKS, "%ld chunks", traffic.chunks);
    REQUIRE(traffic.largest == EACH * (ptrdiff_t)sizeof(float), "%td bytes", traffic.largest);
    REQUIRE(traffic.most >= 2 && traffic.most <= 3, "%ld chunks under way at once", traffic.most);
    REQUIRE(softshadow_get_stats(handle, &stats) == SOFTSHADOW_OK, "stats");
    REQUIRE(stats.upload_seconds > 0 && stats.download_seconds > 0 &&
                stats.upload_seconds + stats.download_seconds <
                    stats.build_seconds + stats.query_seconds,
            "copies: %g and %g seconds of %g", stats.upload_seconds, stats.download_seconds,
            stats.build_seconds + stats.query_seconds);
    softshadow_destroy(handle);
}

int main(void) {
    static const char *const methods[] = {"hard", "smoothie", "backprojection", "penumbra-mask",
                                          "penumbra-volume"};
    if (plain_sanitized("the sanitizer's own dlopen stands in between")) return PLAIN_SKIP;
    for (size_t i = 0; i < sizeof methods / sizeof *methods; i++) {
        softshadow *handle = new_handle();
        REQUIRE(build_and_ask(handle, methods[i], SOFTSHADOW_CPU) == SOFTSHADOW_OK, "%s",
                methods[i]);
        memcpy(truth, v, sizeof truth);
        if (i == 0) for_good(&no_library, methods[i], "refused by the host");
        const softshadow_status status = build(handle, methods[i], SOFTSHADOW_EGL);
        if (i == 0 && status == SOFTSHADOW_E_BACKEND) {
            printf("%s\n", softshadow_last_message(handle));
            return PLAIN_SKIP;
        }
        softshadow_destroy(handle);
        if (i == 0) {
            /* the next has to make a context, with no program in it yet */
            dispatches = 0, fail_dispatch = 1;
            fails(methods[i], "lost");
            fail_dispatch = 0;
            for_good(&no_display, methods[i], "no display");
            for_good(&no_start, methods[i], "eglInitialize");
            for_good(&no_context, methods[i], "too old");
            for_good(&not_current, methods[i], "eglMakeCurrent");
            for_good(&no_shader, methods[i], "words of the driver");
        }
        each(methods[i], &buffers, &fail_buffer, "GL_OUT_OF_MEMORY");
        REQUIRE(objects == 0, "%s: %ld buffers or fences left", methods[i], objects);
        each(methods[i], &dispatches, &fail_dispatch, "lost");
    }
    in_chunks();
    REQUIRE(objects == 0, "%ld buffers or fences left", objects);
    return 0;
}
