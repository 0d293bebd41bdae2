/* Devices are asked for by EGL_EXT_device_enumeration: NVIDIA's driver and Mesa's have it. Where no
 * device is hardware, Mesa's surfaceless platform gives its software one. */
#include "raster/egl/context.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/status.h"

#define LEAST_MAJOR  4
#define LEAST_MINOR  3
#define MOST_DEVICES 32

static bool has(const char *list, const char *name) {
    const size_t n = strlen(name);
    for (const char *at = list; at && (at = strstr(at, name)); at += n) {
        if ((at == list || at[-1] == ' ') && (at[n] == ' ' || at[n] == 0)) return true;
    }
    return false;
}

/* ---- one display ----------------------------------------------------------------------------- */

static softshadow_status words(ss_egl_context *c, const char *what) {
    return ss_fail(SOFTSHADOW_E_BACKEND, "EGL: %s: %s", what, ss_egl_error_name(c->egl.GetError()));
}

static EGLConfig config_of(ss_egl_context *c) {
    static const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0,
                                    EGL_NONE};
    EGLConfig config;
    EGLint count = 0;
    if (has(c->egl.QueryString(c->display, EGL_EXTENSIONS), "EGL_KHR_no_config_context"))
        return NULL;
    return c->egl.ChooseConfig(c->display, wanted, &config, 1, &count) && count ? config : NULL;
}

/* A context that tells when it is lost, where the driver can. */
static EGLContext create(ss_egl_context *c) {
    static const EGLint plain[] = {EGL_CONTEXT_MAJOR_VERSION,
                                   LEAST_MAJOR,
                                   EGL_CONTEXT_MINOR_VERSION,
                                   LEAST_MINOR,
                                   EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                   EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                   EGL_NONE};
    static const EGLint robust[] = {EGL_CONTEXT_MAJOR_VERSION,
                                    LEAST_MAJOR,
                                    EGL_CONTEXT_MINOR_VERSION,
                                    LEAST_MINOR,
                                    EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                    EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                    EGL_CONTEXT_OPENGL_ROBUST_ACCESS,
                                    EGL_TRUE,
                                    EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY,
                                    EGL_LOSE_CONTEXT_ON_RESET,
                                    EGL_NONE};
    const EGLConfig config = config_of(c);
    const EGLContext context = c->egl.CreateContext(c->display, config, EGL_NO_CONTEXT, robust);
    if (context != EGL_NO_CONTEXT) return context;
    return c->egl.CreateContext(c->display, config, EGL_NO_CONTEXT, plain);
}

static softshadow_status describe(ss_egl_context *c) {
    const ss_gl *gl = &c->gl;
    const char *renderer = (const char *)gl->GetString(GL_RENDERER);
    const char *version = (const char *)gl->GetString(GL_VERSION);
    int64_t groups = 0;
    GLint invocations = 0;
    gl->GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &c->largest);
    gl->GetInteger64v(GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS, &groups);
    gl->GetIntegerv(GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS, &invocations);
    snprintf(c->device.name, sizeof c->device.name, "%s", renderer ? renderer : "unnamed");
    snprintf(c->device.version, sizeof c->device.version, "%s", version ? version : "unknown");
    if (groups >= 8 && invocations >= 64 && c->largest > 0)
        return ss_egl_check(c, "asking its limits");
    return ss_fail(SOFTSHADOW_E_BACKEND,
                   "EGL: %s: a compute shader has %d storage buffers, 8 are needed", c->device.name,
                   (int)groups);
}

static softshadow_status make_current(ss_egl_context *c) {
    if (!c->egl.MakeCurrent(c->display, EGL_NO_SURFACE, EGL_NO_SURFACE, c->context)) {
        return words(c, "eglMakeCurrent");
    }
    softshadow_status status = ss_gl_load(&c->egl, &c->gl);
    return status ? status : describe(c);
}

/* The display is never terminated: the host may use the same one. */
static softshadow_status open_display(ss_egl_context *c, EGLenum platform, void *device) {
    EGLint major, minor;
    c->display = c->egl.GetPlatformDisplayEXT(platform, device, NULL);
    if (c->display == EGL_NO_DISPLAY) return words(c, "no display");
    if (!c->egl.Initialize(c->display, &major, &minor)) return words(c, "eglInitialize");
    if (!c->egl.BindAPI(EGL_OPENGL_API)) return words(c, "OpenGL");
    c->context = create(c);
    if (c->context == EGL_NO_CONTEXT) {
        return words(c, "no context of OpenGL 4.3 or later, the device or its driver is too old");
    }
    const softshadow_status status = make_current(c);
    if (status) ss_egl_context_close(c);
    return status;
}

/* ---- which device ---------------------------------------------------------------------------- */

typedef struct devices {
    EGLDeviceEXT device[MOST_DEVICES];
    bool software[MOST_DEVICES];
    EGLint count;
} devices;

static void list_devices(ss_egl_context *c, devices *out) {
    const ss_egl_functions *egl = &c->egl;
    const char *client = egl->QueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    out->count = 0;
    if (!has(client, "EGL_EXT_platform_device") || !egl->QueryDevicesEXT) return;
    if (!egl->QueryDevicesEXT(MOST_DEVICES, out->device, &out->count)) out->count = 0;
    for (EGLint i = 0; i < out->count; i++) {
        const char *can = egl->QueryDeviceStringEXT
                              ? egl->QueryDeviceStringEXT(out->device[i], EGL_EXTENSIONS)
                              : NULL;
        out->software[i] = has(can, "EGL_MESA_device_software");
    }
}

static softshadow_status open_wished(ss_egl_context *c, const devices *d, const char *wish) {
    char *end;
    const long index = strtol(wish, &end, 10);
    if (end == wish || *end || index < 0 || index >= d->count) {
        return ss_fail(
            SOFTSHADOW_E_BACKEND,
            "SOFTSHADOW_EGL_DEVICE: \"%.40s\", must be 0..%d, the number of an EGL device", wish,
            (int)d->count - 1);
    }
    return open_display(c, EGL_PLATFORM_DEVICE_EXT, d->device[index]);
}

static softshadow_status open_any(ss_egl_context *c, const devices *d) {
    softshadow_status status = SOFTSHADOW_E_BACKEND;
    const char *client = c->egl.QueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    bool tried = false;
    for (int software = 0; software < 2; software++) {
        for (EGLint i = 0; i < d->count; i++) {
            if (d->software[i] != software) continue;
            if (!open_display(c, EGL_PLATFORM_DEVICE_EXT, d->device[i])) return SOFTSHADOW_OK;
            tried = true;
        }
        if (software || !has(client, "EGL_MESA_platform_surfaceless")) continue;
        status = open_display(c, EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY);
        if (!status) return status;
        tried = true;
    }
    if (tried) return SOFTSHADOW_E_BACKEND; /* the last one's words */
    return ss_fail(SOFTSHADOW_E_BACKEND,
                   "EGL: no device and no platform without a display; install "
                   "the driver, or the Debian package libgl1-mesa-dri");
}

softshadow_status ss_egl_context_open(ss_egl_context *out, const char *wish) {
    devices d;
    *out = (ss_egl_context){0};
    softshadow_status status = ss_egl_load("libEGL.so.1", &out->egl);
    if (status) return status;
    if (!out->egl.GetPlatformDisplayEXT) {
        return ss_fail(SOFTSHADOW_E_BACKEND,
                       "EGL: no EGL_EXT_platform_base, the driver is too old");
    }
    list_devices(out, &d);
    return wish ? open_wished(out, &d, wish) : open_any(out, &d);
}

void ss_egl_context_close(ss_egl_context *c) {
    if (c->context == EGL_NO_CONTEXT) return;
    c->egl.MakeCurrent(c->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    c->egl.DestroyContext(c->display, c->context);
    c->context = EGL_NO_CONTEXT, c->compiled_count = 0, c->most_steps = 0;
}

/* ---- what went wrong ------------------------------------------------------------------------- */

bool ss_egl_lost(ss_egl_context *c) {
    return c->gl.GetGraphicsResetStatus && c->gl.GetGraphicsResetStatus() != GL_NO_ERROR;
}

static const char *gl_error_name(GLenum error) {
    switch (error) {
    case GL_INVALID_ENUM:
        return "GL_INVALID_ENUM";
    case GL_INVALID_VALUE:
        return "GL_INVALID_VALUE";
    case GL_INVALID_OPERATION:
        return "GL_INVALID_OPERATION";
    case GL_OUT_OF_MEMORY:
        return "GL_OUT_OF_MEMORY";
    case GL_CONTEXT_LOST:
        return "GL_CONTEXT_LOST";
    default:
        return "unknown GL error";
    }
}

softshadow_status ss_egl_check(ss_egl_context *c, const char *doing) {
    const GLenum error = c->gl.GetError();
    for (int i = 0; i < 8 && c->gl.GetError() != GL_NO_ERROR; i++) {
    }
    if (error == GL_NO_ERROR) return SOFTSHADOW_OK;
    return ss_fail(SOFTSHADOW_E_BACKEND, "EGL: %s: %s: %s", c->device.name, doing,
                   gl_error_name(error));
}

/* ---- programs -------------------------------------------------------------------------------- */

/* One line of the driver's log. */
static softshadow_status shader_error(ss_egl_context *c, const char *what, char *log) {
    for (char *at = log; *at; at++) *at = *at == '\n' || *at == '\r' ? ' ' : *at;
    return ss_fail(SOFTSHADOW_E_BACKEND, "EGL: %s: the shader does not %s: %s", c->device.name,
                   what, log);
}

static softshadow_status link_program(ss_egl_context *c, const char *head, const char *text,
                                      GLuint shader, GLuint program) {
    const ss_gl *gl = &c->gl;
    const char *source[] = {head, text};
    char log[300] = "";
    GLint ok = GL_FALSE;
    gl->ShaderSource(shader, 2, source, NULL);
    gl->CompileShader(shader);
    gl->GetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (!ok) {
        gl->GetShaderInfoLog(shader, sizeof log, NULL, log);
        return shader_error(c, "compile", log);
    }
    gl->AttachShader(program, shader);
    gl->LinkProgram(program);
    gl->GetProgramiv(program, GL_LINK_STATUS, &ok);
    if (ok) return ss_egl_check(c, "making a program");
    gl->GetProgramInfoLog(program, sizeof log, NULL, log);
    return shader_error(c, "link", log);
}

softshadow_status ss_egl_compile(ss_egl_context *c, const char *head, const char *text,
                                 GLuint *out) {
    for (uint32_t i = 0; i < c->compiled_count; i++) {
        const ss_egl_compiled *p = &c->compiled[i];
        if (p->head == head && p->text == text) return *out = p->program, SOFTSHADOW_OK;
    }
    if (c->compiled_count == SS_EGL_PROGRAMS) {
        return ss_fail(SOFTSHADOW_E_INTERNAL, "EGL: more than %d programs", SS_EGL_PROGRAMS);
    }
    const GLuint shader = c->gl.CreateShader(GL_COMPUTE_SHADER), program = c->gl.CreateProgram();
    const softshadow_status status = link_program(c, head, text, shader, program);
    c->gl.DeleteShader(shader);
    if (status) {
        c->gl.DeleteProgram(program);
        return status;
    }
    c->compiled[c->compiled_count++] = (ss_egl_compiled){head, text, program};
    *out = program;
    return SOFTSHADOW_OK;
}
