/* Is there a GPU, or something that does as one? */
#ifndef TESTS_GPU_H
#define TESTS_GPU_H

#include "ask.h"

/* What a build of an empty scene says. */
static inline softshadow_status gpu_try(const char *method, char message[512]) {
    softshadow *handle;
    softshadow_build build = SOFTSHADOW_BUILD_INIT;
    const softshadow_light light = scene_sphere_light(0, 0, 1, .1);
    build.method = method, build.backend = SOFTSHADOW_EGL, build.resolution = 16;
    softshadow_status status = softshadow_create(&handle, NULL);
    if (!status) status = softshadow_set_light(handle, &light);
    if (!status) status = softshadow_build_maps(handle, &build);
    snprintf(message, 512, "%s", softshadow_last_message(handle));
    softshadow_destroy(handle);
    return status;
}

/* Ends the test as skipped where none is. */
static inline void gpu_required(void) {
    char message[512];
    if (gpu_try("hard", message) != SOFTSHADOW_E_BACKEND) return;
    printf("%s\n", message);
    exit(77);
}

/* Does the method run there? Anything but yes is SOFTSHADOW_E_UNSUPPORTED with a message. */
static inline bool gpu_runs(const char *method) {
    char message[512];
    const softshadow_status status = gpu_try(method, message);
    CHECK(status == SOFTSHADOW_OK || (status == SOFTSHADOW_E_UNSUPPORTED && *message), "%s: %s",
          method, message);
    return status == SOFTSHADOW_OK;
}

#endif
