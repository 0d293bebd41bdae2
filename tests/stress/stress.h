/* The cases of make check-stress: one small scene put where arithmetic hurts, and scenes that are
 * trouble of their own. Each carries its truth, the exact area of the union of its casters. */
#ifndef TESTS_STRESS_STRESS_H
#define TESTS_STRESS_STRESS_H

#include <stdbool.h>

#include "oracle/oracle.h"

typedef struct stress_case {
    char sweep[32], cell[32]; /* "scale", "1e-6" */
    scene_mesh mesh;
    softshadow_light light;
    double (*points)[3];
    size_t count;
    bool single;         /* given as floats; coordinates are rounded to floats already */
    uint64_t *primitives; /* or NULL */
    double *truth;
    bool no_rays;        /* smaller than floats of a scene's size: rays are refused */
    bool in_modes;       /* to be asked in every floating-point mode of the host, too */
    bool no_maps;        /* map methods are not asked: drawing it takes them minutes, each */
    bool maps_too;       /* false: a map method's answer is not defined here, it only must not fall */
} stress_case;

typedef void stress_each(const stress_case *one, void *user);
void stress_cases(stress_each *each, void *user);

/* ---- Asking ----------------------------------------------------------------------------------- */

/* A host's floating-point mode: rounding up, down, to zero; denormals flushed and taken for
 * zero. */
typedef enum stress_mode {
    STRESS_UPWARD,
    STRESS_DOWNWARD,
    STRESS_TO_ZERO,
    STRESS_FLUSHED,
    STRESS_USUAL
} stress_mode;

/* Like a host: status and answers; visibility and bound have room for the case's points. The mode
 * is that of the calls; what is handed over is made in the usual one. */
softshadow_status stress_ask(const char *method, const stress_case *one, float *visibility,
                             float *bound, stress_mode mode);
uint32_t stress_method_count(void);
softshadow_method stress_method(uint32_t index);

#endif
