/* The plan: the one place that decides which stages a scene and a method need, and what to skip. */
#ifndef SS_ENGINE_PLAN_H
#define SS_ENGINE_PLAN_H

#include "scene/scene.h"
#include "technique/technique.h"

typedef struct ss_plan {
    const ss_technique *technique;
    uint32_t needs;       /* SS_NEEDS_, less what this scene does without */
    ss_params params;     /* defaults filled in; bounds still in the host's coordinates */
    const char *backend;  /* "cpu" */
    bool fell_back;       /* SOFTSHADOW_ANY found no GPU path and took the CPU */
} ss_plan;

/* Checks a request against the scene and decides. Changes nothing. */
softshadow_status ss_plan_make(ss_plan *plan, const softshadow_build *request,
                               const ss_scene *scene);

#endif
