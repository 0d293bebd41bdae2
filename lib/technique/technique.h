/* What every technique is: a row of this table. One file per algorithm, listed in registry.c. */
#ifndef SS_TECHNIQUE_TECHNIQUE_H
#define SS_TECHNIQUE_TECHNIQUE_H

#include "base/memory.h"
#include "base/parallel.h"
#include "scene/point.h"
#include "scene/scene.h"
#include "softshadow.h"

struct ss_bvh;
struct ss_rays;
struct ss_raster;
struct ss_raster_question;
struct ss_sky;
struct ss_plates;

/* What a technique needs before its build; the plan prepares these and nothing else. */
enum {
    SS_NEEDS_BVH = 1,        /* trace/bvh.h: near faces, shafts */
    SS_NEEDS_RAYS = 2,       /* trace/rays.h: Embree */
    SS_NEEDS_EDGES = 4,      /* topology's edge table */
    SS_NEEDS_COMPONENTS = 8, /* topology's closed components */
    SS_NEEDS_LOD = 16,       /* trace/lod.h: coarser scenes, in queries large enough to repay them */
    SS_NEEDS_SILHOUETTES = 32, /* silhouette/silhouette.h's tree, and the edge table it reads */
    SS_NEEDS_SKY = 64          /* coverage/sky.h: lit and dark points told first, likewise */
};

#define SS_LIGHTS_ALL 15u /* a bit per light type */
#define SS_MOST_LAYERS 64 /* that a build may ask for */
#define SS_MOST_SUB_LIGHTS 8 /* likewise, along a side */
#define SS_MOST_SAMPLES (1u << 24) /* likewise, and a measurement */

/* The build as asked, every default filled in, lengths in the host's unit. */
typedef struct ss_params {
    uint32_t samples;      /* 0: what the tolerance needs */
    uint32_t few;          /* samples to try first, where they may do; 0: none */
    uint32_t resolution, layers, max_samples, falloff, weighting, mask_taps, blur, seed, propagate;
    uint32_t sub_lights;   /* into how many, along a side, a light is divided */
    uint32_t bounded;      /* are bounds given? */
    double tolerance, depth_bias, smoothie_width;
    uint64_t points_ahead; /* that the host told of */
    double bounds[6]; /* local: min xyz, max xyz */
} ss_params;

/* What a build spends, in seconds. */
typedef struct ss_spent {
    double depth, silhouettes; /* on maps of the nearest depths; on finding silhouettes */
} ss_spent;

/* Everything a technique may read; all of it is const while the technique lives. */
typedef struct ss_stage {
    const ss_world *world;
    const ss_light *light;   /* in the world's coordinates */
    uint32_t light_id;
    const ss_params *params;
    ss_pool *pool;           /* for the build; queries run inside the engine's own loop */
    ss_progress *progress;   /* of the build */
    const struct ss_bvh *bvh;   /* NULL unless needed */
    const struct ss_rays *rays; /* NULL unless needed */
    const struct ss_topology *topology; /* NULL unless needed: scene/connectivity.h */
    const struct ss_silhouette_tree *silhouettes; /* NULL unless needed */
    const struct ss_raster *raster; /* draws the maps, in builds */
    int rung;                       /* base/cpu.h */
    const struct ss_lod_light *lod; /* NULL in builds, and in queries that do not repay it */
    const struct ss_sky *sky; /* likewise; read by the engine only */
    const void *tracer; /* likewise: raytrace.h's state for auto; then rays are not NULL either */
    ss_spent *spent; /* of builds: techniques add to it */
    bool rows; /* of this query: its points are rows of an image, and finish() follows */
} ss_stage;

/* All answers to points that are rows of an image. */
typedef struct ss_image {
    size_t width, height;
    const uint32_t *ids; /* of the objects the points lie on; NULL: one */
    float *visibility;   /* NaN: a bad point */
} ss_image;

/* What a query counts; one per worker, summed by the engine. */
typedef struct ss_counts {
    uint64_t lit, umbra, penumbra, traced, settled, rays;
    uint64_t spared; /* answered by the CPU because the GPU failed */
    double up, down; /* seconds of copies to the GPU and back */
} ss_counts;

typedef struct ss_technique {
    const char *name, *title, *cite, *notes;
    uint32_t needs, spared; /* spared: what of it params->propagate makes needless */
    uint32_t bound_kind;
    uint32_t lights_native, lights_approximated; /* bit per light type */
    uint32_t weightings;                         /* bit per weighting */
    bool settles;    /* where nothing can be between a point and all of the light the answer is 1: the
                        engine may give it for whole groups at once (uniform weighting only) */
    uint32_t group;  /* the query likes points in Morton order, in multiples of this; 0: as they come */

    /* Builds for one light; *state owns what it made. May be NULL: nothing to build. */
    softshadow_status (*build)(const ss_stage *stage, void **state);
    /* Answers n points: visibility[i] and bound[i] (bound may be NULL) belong to points[i].
     * Re-entrant; scratch comes from the arena, nothing else is allocated. Points in Morton order
     * where group > 0. */
    softshadow_status (*query)(const ss_stage *stage, const void *state, const ss_point *points,
                               size_t n, float *visibility, float *bound, ss_arena *scratch,
                               ss_counts *counts);
    /* The same for at most SS_PLACES points that have no normal, without bounds. NULL: query() for
     * all. */
    void (*query_places)(const void *state, const ss_places *places, size_t n, float *visibility,
                         ss_counts *counts);
    /* Points that are told before query() is asked for the others, where the casters are so few:
     * see coverage/plates.h. NULL, or gives NULL: none. *most: how wrong they may be, as
     * ss_plates_tell has it. */
    const struct ss_plates *(*plates)(const void *state, float *most);
    /* Works over the answers to a whole image in place, on all threads, or on stage->raster.
     * query() may mark points for it by setting the sign bit of their answers where stage->rows is
     * set; finish() takes the marks away and brings the counts in line with what it changed. NULL:
     * images are not special. */
    softshadow_status (*finish)(const ss_stage *stage, const void *state, const ss_image *image,
                                ss_pool *pool, ss_counts *counts);
    /* The query once more for a GPU, in three parts; all NULL: the CPU only. `query_glsl` is a pure
     * function of the tables that `tables` names (raster.h, ss_raster_question); `look` takes
     * points to where it starts from; `horizon` adds to its answers what no map knows, counts, and
     * marks points as query() does. */
    const char *query_glsl;
    /* Sets question->glsl to NULL where query() needs no map. */
    softshadow_status (*tables)(void *state, struct ss_raster_question *question);
    void (*look)(const void *state, const ss_point *points, size_t n, float (*looks)[4]);
    void (*horizon)(const ss_stage *stage, const void *state, const ss_point *points, size_t n,
                    float *visibility, float *bound, ss_counts *counts);
    void (*destroy)(void *state);
    size_t (*bytes)(const void *state);                            /* held by state; may be NULL */
    uint32_t (*map_count)(const void *state);                      /* NULL: none */
    void (*get_map)(const void *state, uint32_t index, softshadow_map *map);
    uint64_t (*silhouette_edges)(const void *state);               /* NULL: 0 */
    uint64_t (*casters_culled)(const void *state);                 /* NULL: 0 */
} ss_technique;

extern const ss_technique *const ss_techniques[];
extern const uint32_t ss_technique_count;
/* By name; NULL if there is none. */
const ss_technique *ss_technique_find(const char *name);

#endif
