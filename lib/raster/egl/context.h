/* Which device, and the context on it. All of this runs on the private thread (thread.h). */
#ifndef SS_RASTER_EGL_CONTEXT_H
#define SS_RASTER_EGL_CONTEXT_H

#include <stdint.h>

#include "raster/egl/gl.h"
#include "raster/raster.h"

#define SS_EGL_PROGRAMS 64

/* A compiled text, known by its address: texts are constants of the techniques. */
typedef struct ss_egl_compiled {
    const char *head, *text;
    GLuint program;
} ss_egl_compiled;

typedef struct ss_egl_context {
    ss_egl_functions egl;
    ss_gl gl;
    EGLDisplay display;
    EGLContext context;
    ss_raster_device device;
    int64_t largest; /* bytes of a buffer that a shader can read */
    uint32_t most_steps; /* in one go: see ss_egl_measure_loops(); 0: not known yet */
    ss_egl_compiled compiled[SS_EGL_PROGRAMS];
    uint32_t compiled_count;
} ss_egl_context;

/* Makes a context current on this thread. `wish`: the index of a device, as text; NULL: the first
 * that will do, hardware before software. */
softshadow_status ss_egl_context_open(ss_egl_context *out, const char *wish);
/* Forgets it: what it held is freed by the driver. */
void ss_egl_context_close(ss_egl_context *context);

/* The program of head and text together, compiled on first use. */
softshadow_status ss_egl_compile(ss_egl_context *c, const char *head, const char *text,
                                 GLuint *out);
/* What GL has to say since it was last asked. `doing` is for the message. */
softshadow_status ss_egl_check(ss_egl_context *c, const char *doing);
/* Is the context gone, with all that was in it? */
bool ss_egl_lost(ss_egl_context *c);

#endif
