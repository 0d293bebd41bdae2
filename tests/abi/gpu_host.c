/* A host with a context of its own: it is current before and after every call, with everything in
 * it. Then many handles one after the other in flat memory, two in two threads, one destroyed while
 * the other works, and a child of fork(), which must do without. */
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/gl.h>
#include <dlfcn.h>
#include <pthread.h>
#include <stdbool.h>
#include <sys/wait.h>
#include <unistd.h>

#include "abi/plain.h"

static const plain_api api = PLAIN_LINKED;

/* ---- the host's own context ------------------------------------------------------------------ */

typedef struct host {
    EGLDisplay (*current_display)(void);
    EGLContext (*current_context)(void);
    EGLSurface (*current_surface)(EGLint);
    EGLenum (*api)(void);
    void (*get)(GLenum, GLint *);
    GLenum (*error)(void);
    EGLContext context;
} host;

static void *find(const char *name) {
    static void *library;
    if (!library) library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
    return library ? dlsym(library, name) : NULL;
}

#define FIND(type, name) ((type)find(name))
#define GL(type, name)                                                                             \
    ((type)((__eglMustCastToProperFunctionPointerType(*)(const char *))find("eglGetProcAddress"))( \
        name))

/* A context with something of its own in it: a buffer that is bound, a viewport, a blend. */
static bool make_context(host *h) {
    EGLint major, minor, count;
    EGLConfig config;
    static const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0,
                                    EGL_NONE};
    if (!find("eglGetProcAddress")) return false;
    const PFNEGLGETPLATFORMDISPLAYEXTPROC get_display =
        GL(PFNEGLGETPLATFORMDISPLAYEXTPROC, "eglGetPlatformDisplayEXT");
    const EGLDisplay display =
        get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    if (display == EGL_NO_DISPLAY) return false;
    if (!FIND(PFNEGLINITIALIZEPROC, "eglInitialize")(display, &major, &minor)) return false;
    FIND(PFNEGLBINDAPIPROC, "eglBindAPI")(EGL_OPENGL_API);
    FIND(PFNEGLCHOOSECONFIGPROC, "eglChooseConfig")(display, wanted, &config, 1, &count);
    h->context =
        FIND(PFNEGLCREATECONTEXTPROC, "eglCreateContext")(display, config, EGL_NO_CONTEXT, NULL);
    if (h->context == EGL_NO_CONTEXT) return false;
    if (!FIND(PFNEGLMAKECURRENTPROC, "eglMakeCurrent")(display, EGL_NO_SURFACE, EGL_NO_SURFACE,
                                                       h->context)) {
        return false;
    }
    GL(void (*)(GLint, GLint, GLsizei, GLsizei), "glViewport")(1, 2, 3, 4);
    GL(void (*)(GLenum), "glEnable")(GL_SCISSOR_TEST);
    GLuint buffer;
    GL(void (*)(GLsizei, GLuint *), "glGenBuffers")(1, &buffer);
    GL(void (*)(GLenum, GLuint), "glBindBuffer")(0x8892 /* GL_ARRAY_BUFFER */, buffer);
    return true;
}

static void find_all(host *h) {
    *(void **)&h->current_display = find("eglGetCurrentDisplay");
    *(void **)&h->current_context = find("eglGetCurrentContext");
    *(void **)&h->current_surface = find("eglGetCurrentSurface");
    *(void **)&h->api = find("eglQueryAPI");
    h->get = GL(void (*)(GLenum, GLint *), "glGetIntegerv");
    h->error = GL(GLenum(*)(void), "glGetError");
}

typedef struct shape {
    EGLDisplay display;
    EGLContext context;
    EGLSurface surface[2];
    EGLenum api;
    GLint viewport[4], scissor, array_buffer, program, storage_buffer;
} shape;

static shape shape_of(const host *h) {
    shape s;
    memset(&s, 0, sizeof s);
    s.display = h->current_display(), s.context = h->current_context(), s.api = h->api();
    s.surface[0] = h->current_surface(EGL_DRAW), s.surface[1] = h->current_surface(EGL_READ);
    h->get(GL_VIEWPORT, s.viewport), h->get(GL_SCISSOR_TEST, &s.scissor);
    h->get(0x8894 /* GL_ARRAY_BUFFER_BINDING */, &s.array_buffer);
    h->get(0x8B8D /* GL_CURRENT_PROGRAM */, &s.program);
    h->get(0x90D3 /* GL_SHADER_STORAGE_BUFFER_BINDING */, &s.storage_buffer);
    return s;
}

static void require_same(const host *h, const shape *before, const char *call) {
    const shape after = shape_of(h);
    REQUIRE(memcmp(before, &after, sizeof after) == 0, "%s changed the host's context", call);
    REQUIRE(h->error() == GL_NO_ERROR, "%s left an error", call);
}

/* ---- asking ---------------------------------------------------------------------------------- */

static softshadow_status build(softshadow *handle, const char *method, uint32_t backend) {
    softshadow_build wish = SOFTSHADOW_BUILD_INIT;
    wish.method = method, wish.backend = backend, wish.resolution = 64;
    wish.mask_taps = 4, wish.blur = 8;
    return softshadow_build_maps(handle, &wish);
}

static softshadow_status ask(softshadow *handle, float *out) {
    float p[PLAIN_POINTS][3];
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    for (int i = 0; i < PLAIN_POINTS; i++) {
        p[i][0] = (float)(i % 32) / 8 - 2, p[i][1] = (float)(i / 32) / 8 - 2, p[i][2] = 0;
    }
    points.positions = p, points.count = PLAIN_POINTS, points.width = 32;
    return softshadow_query_visibility(handle, &points, out);
}

static void once(const char *method, float *out) {
    softshadow *handle;
    REQUIRE(plain_scene(&api, &handle, NULL) == SOFTSHADOW_OK, "a scene");
    REQUIRE(build(handle, method, SOFTSHADOW_EGL) == SOFTSHADOW_OK, "%s",
            softshadow_last_message(handle));
    REQUIRE(ask(handle, out) == SOFTSHADOW_OK, "%s", softshadow_last_message(handle));
    softshadow_destroy(handle);
}

/* All that run there. */
static const char *const methods[] = {"backprojection",  "hard",          "penumbra-map",
                                      "penumbra-volume", "penumbra-mask", "penumbra-limit",
                                      "pcf",             "pcss",          "single-sample",
                                      "smoothie"};
enum { METHODS = sizeof methods / sizeof *methods, FORKED = 1 };
static float first[METHODS][PLAIN_POINTS];

static void have_all(void) {
    uint32_t count, there = 0;
    REQUIRE(softshadow_method_count(&count) == SOFTSHADOW_OK, "methods");
    for (uint32_t i = 0; i < count; i++) {
        softshadow_method method = SOFTSHADOW_METHOD_INIT;
        REQUIRE(softshadow_method_info(i, &method) == SOFTSHADOW_OK, "method %u", i);
        there += method.backends >> SOFTSHADOW_EGL & 1;
    }
    REQUIRE(there == METHODS, "%u methods run on a GPU, %d are tried", there, METHODS);
}

static void unchanged(const host *h) {
    const shape before = shape_of(h);
    for (int i = 0; i < METHODS; i++) {
        softshadow *handle;
        REQUIRE(plain_scene(&api, &handle, NULL) == SOFTSHADOW_OK, "a scene");
        require_same(h, &before, "a scene");
        REQUIRE(build(handle, methods[i], SOFTSHADOW_EGL) == SOFTSHADOW_OK, "%s",
                softshadow_last_message(handle));
        require_same(h, &before, "softshadow_build_maps");
        REQUIRE(ask(handle, first[i]) == SOFTSHADOW_OK, "%s", softshadow_last_message(handle));
        require_same(h, &before, "softshadow_query_visibility");
        softshadow_destroy(handle);
        require_same(h, &before, "softshadow_destroy");
    }
}

/* ---- many, and several at once --------------------------------------------------------------- */

static long resident(void) { /* KiB; the driver's memory is the host's where it is software */
    long pages = 0, held = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    REQUIRE(file && fscanf(file, "%ld %ld", &pages, &held) == 2, "/proc/self/statm");
    fclose(file);
    return held * (sysconf(_SC_PAGESIZE) / 1024);
}

/* A leak of 1 KiB a cycle shows. Where sanitizers keep what was freed, there are fewer. */
static void cycles(void) {
    const char *sanitizers = getenv("SANITIZERS");
    const bool sanitized = sanitizers && *sanitizers;
    const int count = sanitized ? 100 : 1000;
    long before = 0;
    float v[PLAIN_POINTS];
    for (int i = -2 * METHODS; i < count; i++) {
        const int m = (i + 2 * METHODS) % METHODS;
        if (i == 0) before = resident();
        once(methods[m], v);
        REQUIRE(memcmp(v, first[m], sizeof v) == 0, "%s: other bits in cycle %d", methods[m], i);
    }
    const long grown = resident() - before;
    printf("%d cycles: %ld KiB more than after %d\n", count, grown, 2 * METHODS);
    REQUIRE(grown < 1024 || sanitized, "memory grew by %ld KiB in %d cycles",
            grown, count);
}

static void *come_and_go(void *stop) {
    float v[PLAIN_POINTS];
    for (int i = 0; !__atomic_load_n((bool *)stop, __ATOMIC_ACQUIRE) || i < 10; i++) {
        once(methods[i % METHODS], v);
        REQUIRE(memcmp(v, first[i % METHODS], sizeof v) == 0, "%s beside another handle",
                methods[i % METHODS]);
    }
    return NULL;
}

/* One handle answers while another thread builds, asks and destroys its own. */
static void together(void) {
    softshadow *handle;
    pthread_t other;
    bool stop = false;
    float v[PLAIN_POINTS];
    REQUIRE(plain_scene(&api, &handle, NULL) == SOFTSHADOW_OK, "a scene");
    REQUIRE(build(handle, methods[0], SOFTSHADOW_EGL) == SOFTSHADOW_OK, "%s",
            softshadow_last_message(handle));
    REQUIRE(pthread_create(&other, NULL, come_and_go, &stop) == 0, "a thread");
    for (int i = 0; i < 30; i++) {
        REQUIRE(ask(handle, v) == SOFTSHADOW_OK, "%s", softshadow_last_message(handle));
        REQUIRE(memcmp(v, first[0], sizeof v) == 0, "other bits beside another handle");
    }
    __atomic_store_n(&stop, true, __ATOMIC_RELEASE);
    pthread_join(other, NULL);
    softshadow_destroy(handle);
}

/* The thread that owns the context is not in a child. */
static void forked(void) {
    fflush(stdout);
    const pid_t child = fork();
    REQUIRE(child >= 0, "fork");
    if (child == 0) {
        softshadow *handle;
        float v[PLAIN_POINTS];
        alarm(60); /* a child that hangs fails */
        REQUIRE(plain_scene(&api, &handle, NULL) == SOFTSHADOW_OK, "a scene");
        REQUIRE(build(handle, "hard", SOFTSHADOW_EGL) == SOFTSHADOW_E_BACKEND,
                "a GPU after fork()");
        REQUIRE(strstr(softshadow_last_message(handle), "fork"), "%s",
                softshadow_last_message(handle));
        REQUIRE(build(handle, "hard", SOFTSHADOW_ANY) == SOFTSHADOW_OK, "%s",
                softshadow_last_message(handle));
        REQUIRE(ask(handle, v) == SOFTSHADOW_OK, "%s", softshadow_last_message(handle));
        REQUIRE(memcmp(v, first[FORKED], sizeof v) == 0, "hard is the same on both");
        softshadow_destroy(handle);
        _exit(0);
    }
    int status;
    REQUIRE(waitpid(child, &status, 0) == child && status == 0, "the child: %d", status);
}

int main(void) {
    static host h;
    softshadow *handle;
    REQUIRE(plain_scene(&api, &handle, NULL) == SOFTSHADOW_OK, "a scene");
    if (!make_context(&h)) {
        printf("no EGL context for the host of this test\n");
        return PLAIN_SKIP;
    }
    find_all(&h);
    if (build(handle, "hard", SOFTSHADOW_EGL) == SOFTSHADOW_E_BACKEND) {
        printf("%s\n", softshadow_last_message(handle));
        return PLAIN_SKIP;
    }
    softshadow_destroy(handle);
    have_all();
    unchanged(&h);
    cycles();
    together();
    forked();
    return 0;
}
