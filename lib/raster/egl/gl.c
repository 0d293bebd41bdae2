#include "raster/egl/gl.h"

#include <dlfcn.h>

#include "base/status.h"

softshadow_status ss_egl_load(const char *library, ss_egl_functions *egl) {
    void *handle = dlopen(library, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (!handle) {
        const char *words = dlerror();
        return ss_fail(SOFTSHADOW_E_BACKEND,
                       "EGL: %s; install the Debian package libegl1 and the driver's",
                       words ? words : library);
    }
    *egl = (ss_egl_functions){0};
    *(void **)&egl->find = dlsym(handle, "eglGetProcAddress");
    if (!egl->find) {
        return ss_fail(SOFTSHADOW_E_BACKEND, "EGL: eglGetProcAddress is not in %s", library);
    }
#define X(name)                                                                                    \
    *(void **)&egl->name = (void *)egl->find("egl" #name);                                         \
    if (!egl->name) *(void **)&egl->name = dlsym(handle, "egl" #name);                             \
    if (!egl->name) return ss_fail(SOFTSHADOW_E_BACKEND, "EGL: egl" #name " is not in %s", library);
    SS_EGL_FUNCTIONS(X)
#undef X
    *(void **)&egl->GetPlatformDisplayEXT = (void *)egl->find("eglGetPlatformDisplayEXT");
    *(void **)&egl->QueryDevicesEXT = (void *)egl->find("eglQueryDevicesEXT");
    *(void **)&egl->QueryDeviceStringEXT = (void *)egl->find("eglQueryDeviceStringEXT");
    return SOFTSHADOW_OK;
}

softshadow_status ss_gl_load(const ss_egl_functions *egl, ss_gl *gl) {
#define X(name)                                                                                    \
    *(void **)&gl->name = (void *)egl->find("gl" #name);                                           \
    if (!gl->name) return ss_fail(SOFTSHADOW_E_BACKEND, "EGL: the driver has no gl" #name);
    SS_GL_FUNCTIONS(X)
#undef X
    *(void **)&gl->GetGraphicsResetStatus = (void *)egl->find("glGetGraphicsResetStatus");
    return SOFTSHADOW_OK;
}

const char *ss_egl_error_name(EGLint error) {
    static const char *const name[] = {
        "EGL_SUCCESS",       "EGL_NOT_INITIALIZED",     "EGL_BAD_ACCESS",
        "EGL_BAD_ALLOC",     "EGL_BAD_ATTRIBUTE",       "EGL_BAD_CONFIG",
        "EGL_BAD_CONTEXT",   "EGL_BAD_CURRENT_SURFACE", "EGL_BAD_DISPLAY",
        "EGL_BAD_MATCH",     "EGL_BAD_NATIVE_PIXMAP",   "EGL_BAD_NATIVE_WINDOW",
        "EGL_BAD_PARAMETER", "EGL_BAD_SURFACE",         "EGL_CONTEXT_LOST"};
    const EGLint i = error - EGL_SUCCESS;
    return i >= 0 && i < (EGLint)(sizeof name / sizeof *name) ? name[i] : "unknown EGL error";
}
