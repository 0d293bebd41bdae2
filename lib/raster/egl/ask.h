/* The vtable's questions. */
#ifndef SS_RASTER_EGL_ASK_H
#define SS_RASTER_EGL_ASK_H

#include <stdio.h>

#include "raster/egl/thread.h"

softshadow_status ss_egl_program_load(const ss_raster_question *question, ss_raster_program **out);
softshadow_status ss_egl_submit(ss_raster_program *program, const ss_raster_look *looks, size_t n,
                                float *answers, ss_raster_ticket **out);
softshadow_status ss_egl_wait(ss_raster_ticket *ticket);
void ss_egl_program_unload(ss_raster_program *program);

/* Sets most_steps, once a context: UINT32_MAX where loops end when they are done. */
softshadow_status ss_egl_measure_loops(ss_egl_context *c);

/* Gives the buffer this size and content. On the private thread. */
softshadow_status ss_egl_upload(ss_egl_context *c, GLuint buffer, const void *data, size_t size);

#endif
