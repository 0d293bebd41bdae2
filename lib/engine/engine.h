/* The handle: a scene, what was built from it, and sums. The public functions check and delegate to
 * what is declared here. */
#ifndef SS_ENGINE_ENGINE_H
#define SS_ENGINE_ENGINE_H

#include <pthread.h>
#include <stdatomic.h>

#include "engine/plan.h"
#include "scene/levels.h"
#include "scene/scene.h"
#include "technique/technique.h"

/* Sums since the last build. */
typedef struct ss_totals {
    double build_seconds, query_seconds;
    ss_spent build_spent;
    ss_raster_spent build_copies;
    ss_counts counts;
    uint64_t points, points_bad;
} ss_totals;

/* Everything that a build makes; immutable until the next. */
typedef struct ss_built {
    bool ready;
    uint64_t geometry_version, light_version;
    ss_plan plan;
    ss_world *world;
    struct ss_bvh *bvh;
    struct ss_rays *rays;
    struct ss_lod *lod; /* made when it first pays: see ss_engine_lend_lod() */
    struct ss_topology *lod_topology[SS_LEVELS_MOST];
    struct ss_lod_light **lod_lights; /* by light, as they are asked for */
    uint32_t lod_light_count;
    void **tracers; /* by light: raytrace's states for auto */
    struct ss_sky **skies; /* by light, as they are asked for; NULL for one: it can have none */
    bool *skies_tried;
    bool no_rays;   /* Embree cannot be used here: auto does without */
    struct ss_topology *topology;
    struct ss_silhouette_tree *silhouettes;
    ss_light *lights;
    ss_stage *stages; /* one a light */
    void **states;    /* the technique's, one a light */
    ss_raster_program **programs; /* its queries at the GPU; NULL, or NULL for a light: asked in C */
    uint32_t light_count;
    size_t bytes, peak_bytes;
    uint64_t lod_triangles; /* of lod, 0 without */
} ss_built;

struct softshadow {
    softshadow_options options;
    unsigned fork_generation;
    ss_pool *pool;
    _Atomic int users; /* calls that read the handle; -1: one call changes it */
    ss_scene scene;
    ss_built built;
    ss_plan requested; /* what built was made from */
    pthread_mutex_t totals_lock;
    ss_totals totals;
    bool told; /* has the host been told that SOFTSHADOW_ANY is the CPU? */
    pthread_mutex_t scratch_lock;
    struct ss_scratch *scratch; /* arenas of workers that rest */
    pthread_mutex_t lod_lock;   /* held while a query makes built.lod */
};

/* Builds what the request needs and is stale. On failure nothing is built. */
softshadow_status ss_engine_build(softshadow *handle, const softshadow_build *request);
void ss_built_free(ss_built *built);
/* Sets the stage's coarser scenes, or its rays, for a query of `count` points, where the technique
 * can use them and that many, or those the host told of, repay them. A choice by numbers only, so
 * that a batch always gets the same. progress: of the call; may be NULL. */
softshadow_status ss_engine_lend(softshadow *handle, uint32_t light, size_t count,
                                 ss_progress *progress, ss_stage *stage);
void ss_engine_drop_lod(ss_built *built);
void ss_engine_drop_lod_lights(ss_built *built); /* what depends on the lights */
void ss_engine_drop_tracers(ss_built *built);    /* and on what was asked for */
void ss_engine_drop_skies(ss_built *built);
size_t ss_engine_lod_bytes(const ss_built *built);

/* Answers a checked batch. */
softshadow_status ss_engine_query(softshadow *handle, const softshadow_points *points,
                                  float *visibility);
/* The same with another stage, technique and state, and no effect on the sums. */
typedef struct ss_asked {
    const ss_technique *technique;
    const ss_stage *stage;
    const void *state;
    ss_raster_program *program; /* NULL: asked in C */
    bool any;                   /* in C, too, where the GPU fails */
    ss_progress *progress;      /* of the call, for its points; NULL: makes its own */
} ss_asked;
/* What was built for one light. */
ss_asked ss_engine_asked(const softshadow *handle, const ss_stage *stage, uint32_t light);
softshadow_status ss_engine_ask(softshadow *handle, const ss_asked *asked,
                                const softshadow_points *points, float *visibility,
                                ss_totals *totals);
void ss_scratch_free(softshadow *handle);
/* Tells the host once, by its log. */
void ss_engine_tell(softshadow *handle, const char *why);

softshadow_status ss_engine_measure(softshadow *handle, const softshadow_points *points,
                                    softshadow_error *error);
#define SS_LARGEST_PICTURE 4096u /* the side of an explanation */
softshadow_status ss_engine_explain(softshadow *handle, softshadow_explanation *explanation);

softshadow_status ss_engine_inspect(softshadow *handle, uint32_t mesh_id,
                                    softshadow_mesh_report *report);

/* Finds the world triangle of a primitive and what a point on it needs. E_ARGUMENT for one that is
 * none; SOFTSHADOW_NO_PRIMITIVE changes nothing. */
softshadow_status ss_engine_primitive(const ss_scene *scene, const ss_stage *stage,
                                      uint64_t primitive, ss_point *point);
/* Point i of a batch in local coordinates; false if it must be answered NaN. */
bool ss_engine_point(const ss_stage *stage, const softshadow_points *points, size_t i,
                     ss_point *out);

#endif
