/* The plan: the one place that decides which stages a scene and a method need, and what to skip. */
#ifndef SS_ENGINE_PLAN_H
#define SS_ENGINE_PLAN_H

#include "base/status.h"
#include "raster/raster.h"
#include "scene/scene.h"
#include "technique/technique.h"

typedef struct ss_plan {
    const ss_technique *technique;
    uint32_t needs;       /* SS_NEEDS_, less what this scene does without */
    ss_params params;     /* defaults filled in; bounds still in the host's coordinates */
    const ss_raster *raster;   /* the backend */
    bool any;                  /* SOFTSHADOW_ANY: the CPU where the GPU cannot */
    char why[SS_MESSAGE_SIZE]; /* it is the CPU then; "" where it is not */
} ss_plan;

/* The methods there are: "auto", then the techniques. False: there are not so many. */
uint32_t ss_plan_method_count(void);
bool ss_plan_method(uint32_t index, softshadow_method *method);

/* Checks a request against the scene and decides. Changes nothing. */
softshadow_status ss_plan_make(ss_plan *plan, const softshadow_build *request,
                               const ss_scene *scene);

/* Is the backend here? On failure this thread's message says why not. */
softshadow_status ss_plan_backend(uint32_t backend, const char **name, ss_raster_device *device);
/* Takes the CPU instead, because of this thread's message. */
void ss_plan_spare(ss_plan *plan);

#endif
