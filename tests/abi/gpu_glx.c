/* A host that draws into a window system's context: EGL on the same thread would be refused it, and
 * taking it away would break the host. It is current before and after every call, with everything
 * in it. Under Xvfb where there is no display. */
#include <dlfcn.h>
#include <stdbool.h>
#include <unistd.h>

#include "abi/plain.h"

enum {
    DRAWABLE_TYPE = 0x8010,
    PBUFFER_BIT = 4,
    RENDER_TYPE = 0x8011,
    RGBA_BIT = 1,
    RGBA_TYPE = 0x8014
};
enum { PBUFFER_HEIGHT = 0x8040, PBUFFER_WIDTH = 0x8041, WIDE = 8 };
enum {
    VIEWPORT = 0xBA2,
    SCISSOR_TEST = 0xC11,
    COLOR_BUFFER_BIT = 0x4000,
    RGBA = 0x1908,
    UBYTE = 0x1401
};
enum { PROGRAM = 0x8B8D, STORAGE_BUFFER = 0x90D3, RENDERER = 0x1F01 };

typedef struct glx {
    void *display, *context;
    unsigned long drawable;
    void *(*current_display)(void), *(*current_context)(void);
    unsigned long (*current_drawable)(void);
    void (*get)(unsigned, int *);
    void (*read)(int, int, int, int, unsigned, unsigned, void *);
    unsigned (*error)(void);
} glx;

static void *x11, *gl;
#define X(type, name) ((type)dlsym(x11, name))
#define GL(type, name) ((type)dlsym(gl, name))

static const char *open_display(glx *h) {
    x11 = dlopen("libX11.so.6", RTLD_NOW | RTLD_LOCAL),
    gl = dlopen("libGL.so.1", RTLD_NOW | RTLD_LOCAL);
    if (!x11 || !gl) return dlerror();
    h->display = X(void *(*)(const char *), "XOpenDisplay")(NULL);
    return h->display ? NULL : "no X display";
}

static const char *make_context(glx *h) {
    const int wanted[] = {DRAWABLE_TYPE, PBUFFER_BIT, RENDER_TYPE, RGBA_BIT, 0};
    const int size[] = {PBUFFER_WIDTH, WIDE, PBUFFER_HEIGHT, WIDE, 0};
    int count = 0;
    void **config = GL(void **(*)(void *, int, const int *, int *), "glXChooseFBConfig")(
        h->display, 0, wanted, &count);
    if (!config || !count) return "no configuration of GLX";
    h->drawable = GL(unsigned long (*)(void *, void *, const int *), "glXCreatePbuffer")(
        h->display, config[0], size);
    h->context = GL(void *(*)(void *, void *, int, void *, int), "glXCreateNewContext")(
        h->display, config[0], RGBA_TYPE, NULL, 1);
    if (!h->drawable || !h->context) return "no context of GLX";
    const bool current =
        GL(int (*)(void *, unsigned long, unsigned long, void *),
           "glXMakeContextCurrent")(h->display, h->drawable, h->drawable, h->context);
    return current ? NULL : "the context cannot be used";
}

static void find_all(glx *h) {
    *(void **)&h->current_display = dlsym(gl, "glXGetCurrentDisplay");
    *(void **)&h->current_context = dlsym(gl, "glXGetCurrentContext");
    *(void **)&h->current_drawable = dlsym(gl, "glXGetCurrentDrawable");
    *(void **)&h->get = dlsym(gl, "glGetIntegerv");
    *(void **)&h->read = dlsym(gl, "glReadPixels");
    *(void **)&h->error = dlsym(gl, "glGetError");
}

/* A picture, a viewport, a scissor. */
static void draw(void) {
    GL(void (*)(float, float, float, float), "glClearColor")(1, 0, .4f, 1);
    GL(void (*)(unsigned), "glClear")(COLOR_BUFFER_BIT);
    GL(void (*)(int, int, int, int), "glViewport")(1, 2, 3, 4);
    GL(void (*)(unsigned), "glEnable")(SCISSOR_TEST);
}

typedef struct shape {
    void *display, *context;
    unsigned long drawable;
    int viewport[4], scissor, program, storage_buffer;
    unsigned char picture[WIDE * WIDE * 4];
} shape;

static shape shape_of(const glx *h) {
    shape s;
    memset(&s, 0, sizeof s);
    s.display = h->current_display(), s.context = h->current_context();
    s.drawable = h->current_drawable();
    h->get(VIEWPORT, s.viewport), h->get(SCISSOR_TEST, &s.scissor);
    h->get(PROGRAM, &s.program), h->get(STORAGE_BUFFER, &s.storage_buffer);
    h->read(0, 0, WIDE, WIDE, RGBA, UBYTE, s.picture);
    return s;
}

static void require_same(const glx *h, const shape *before, const char *call) {
    const shape after = shape_of(h);
    REQUIRE(memcmp(before, &after, sizeof after) == 0, "%s changed the host's context", call);
    REQUIRE(h->error() == 0, "%s left an error", call);
}

/* "hard" is the same on both machines. */
static void use(const glx *h) {
    static const plain_api api = PLAIN_LINKED;
    static float p[PLAIN_POINTS][3], v[2][PLAIN_POINTS];
    const shape before = shape_of(h);
    softshadow *handle;
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    REQUIRE(before.context == h->context && before.picture[0] == 255, "the test's own context");
    for (int i = 0; i < PLAIN_POINTS; i++) {
        p[i][0] = (float)(i % 32) / 8 - 2, p[i][1] = (float)(i / 32) / 8 - 2;
    }
    points.positions = p, points.count = PLAIN_POINTS;
    REQUIRE(plain_scene(&api, &handle, NULL) == SOFTSHADOW_OK, "a scene");
    for (uint32_t backend = SOFTSHADOW_CPU; backend <= SOFTSHADOW_EGL; backend++) {
        softshadow_build wish = SOFTSHADOW_BUILD_INIT;
        wish.method = "hard", wish.backend = backend, wish.resolution = 64;
        const softshadow_status status = softshadow_build_maps(handle, &wish);
        if (status == SOFTSHADOW_E_BACKEND) {
            printf("%s\n", softshadow_last_message(handle));
            exit(PLAIN_SKIP);
        }
        REQUIRE(status == SOFTSHADOW_OK, "%s", softshadow_last_message(handle));
        require_same(h, &before, "softshadow_build_maps");
        REQUIRE(softshadow_query_visibility(handle, &points, v[backend]) == SOFTSHADOW_OK, "%s",
                softshadow_last_message(handle));
        require_same(h, &before, "softshadow_query_visibility");
    }
    REQUIRE(memcmp(v[0], v[1], sizeof v[0]) == 0, "other answers beside a context of GLX");
    softshadow_destroy(handle);
    require_same(h, &before, "softshadow_destroy");
}

int main(int argc, char **argv) {
    static glx h;
    const char *why = NULL;
    if (plain_sanitized("leaks of the window system's libraries")) return PLAIN_SKIP;
    if (!getenv("DISPLAY") && argc == 1) {
        execlp("xvfb-run", "xvfb-run", "-a", argv[0], "again", (char *)NULL);
        printf("no display, and no xvfb-run\n");
        return PLAIN_SKIP;
    }
    why = open_display(&h);
    if (!why) why = make_context(&h);
    if (why) {
        printf("%s\n", why);
        return PLAIN_SKIP;
    }
    find_all(&h);
    printf("%s\n", (const char *)GL(const unsigned char *(*)(unsigned), "glGetString")(RENDERER));
    draw();
    use(&h);
    return 0;
}
