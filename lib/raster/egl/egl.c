/* The GPU backend: depths, layers and inks drawn by compute shaders, queries answered by them, on a
 * device that EGL finds without any display. What C does to set triangles up is shared with the
 * CPU's backend, so that maps are the same to the last bits of a device's arithmetic. */
#include "raster/egl/ask.h"
#include "raster/egl/passes.h"

const ss_raster ss_raster_egl = {
    .name = "egl",
    .open = ss_egl_open,
    .depth = ss_egl_depth,
    .peel = ss_egl_peel,
    .keep = ss_egl_keep,
    .load = ss_egl_program_load,
    .submit = ss_egl_submit,
    .wait = ss_egl_wait,
    .unload = ss_egl_program_unload,
    .work = ss_egl_work,
    .spent = ss_egl_spent,
};
