/* EGL and OpenGL as a table of functions, found at run time.
 *
 * Types are from libepoxy's headers; its library is not used: it ends the process with abort()
 * where libGL is not installed beside libEGL, as on the headless machines this is for. EGL itself
 * gives every function of OpenGL. */
#ifndef SS_RASTER_EGL_GL_H
#define SS_RASTER_EGL_GL_H

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include "softshadow.h"

#define SS_EGL_FUNCTIONS(X) \
    X(BindAPI) X(ChooseConfig) X(CreateContext) X(DestroyContext) X(GetError) X(Initialize) \
    X(MakeCurrent) X(QueryString)

#define SS_GL_FUNCTIONS(X) \
    X(AttachShader) X(BindBuffer) X(BindBufferBase) X(BufferData) X(BufferSubData) \
    X(ClearBufferData) X(ClientWaitSync) X(CompileShader) X(CreateProgram) X(CreateShader) \
    X(DeleteBuffers) X(DeleteProgram) X(DeleteShader) X(DeleteSync) X(DispatchCompute) \
    X(FenceSync) X(Finish) X(GenBuffers) X(GetBufferSubData) X(GetError) X(GetInteger64v) \
    X(GetIntegerv) X(GetProgramInfoLog) X(GetProgramiv) X(GetShaderInfoLog) X(GetShaderiv) \
    X(GetString) X(LinkProgram) X(MemoryBarrier) X(ShaderSource) X(Uniform1ui) X(UseProgram)

typedef struct ss_egl_functions {
#define X(name) __typeof__(epoxy_egl##name) name;
    SS_EGL_FUNCTIONS(X)
#undef X
    __typeof__(epoxy_eglGetProcAddress) find;
    /* of extensions: NULL where there are none */
    __typeof__(epoxy_eglGetPlatformDisplayEXT) GetPlatformDisplayEXT;
    __typeof__(epoxy_eglQueryDevicesEXT) QueryDevicesEXT;
    __typeof__(epoxy_eglQueryDeviceStringEXT) QueryDeviceStringEXT;
} ss_egl_functions;

typedef struct ss_gl {
#define X(name) __typeof__(epoxy_gl##name) name;
    SS_GL_FUNCTIONS(X)
#undef X
    __typeof__(epoxy_glGetGraphicsResetStatus) GetGraphicsResetStatus; /* NULL: not told */
} ss_gl;

/* Loads the library for good. E_BACKEND with the loader's words. */
softshadow_status ss_egl_load(const char *library, ss_egl_functions *egl);
/* With a context current. */
softshadow_status ss_gl_load(const ss_egl_functions *egl, ss_gl *gl);

/* The name of an EGL error. */
const char *ss_egl_error_name(EGLint error);

#endif
