/* SPDX-License-Identifier: Apache-2.0
 *
 * softshadow.h - how much of a light does this point see?
 *
 * You give triangle meshes and area lights; you ask, for any batch of points, what fraction of a
 * light each point sees: 1 is fully lit, 0 is umbra, between them is penumbra.
 *
 *     softshadow *s;
 *     softshadow_create(&s, NULL);
 *     softshadow_add_mesh(s, &mesh, NULL);
 *     softshadow_set_light(s, &light);
 *     softshadow_build_maps(s, NULL);
 *     softshadow_query_visibility(s, &points, visibility);
 *     softshadow_destroy(s);
 *
 * This header is the whole contract. It compiles alone as C99, C11 and C++11.
 *
 * Status     Every call that can fail returns SOFTSHADOW_OK (0) or a negative SOFTSHADOW_E_ code;
 *            softshadow_last_message() then says which argument was wrong, what it was and what is
 *            allowed. Outputs are always set: after an error a pointer is NULL, an id is
 *            UINT32_MAX, visibilities and measurements are NaN, counts are 0.
 * Structs    Begin with struct_size. Start from the matching _INIT macro; zero means "default" in
 *            every field. A program compiled against 1.0 runs with every 1.x.
 * Units      Lengths are in the scene's own unit and any handedness will do. Angles are radians.
 *            Sizes of lights are radii and HALF axes.
 * Threads    Once maps are built any number of threads may query one handle. A call that changes a
 *            handle while another one uses it answers SOFTSHADOW_E_STATE and changes nothing.
 *            A calling thread needs 64 KiB of stack, 128 KiB where rays are traced.
 *            Results do not depend on thread count, batch split or order, bit for bit (the method
 *            "auto": for the same batch).
 * Host       Nothing of yours is touched: no output, signal, locale, floating-point mode or current
 *            GL context is changed. After fork() a handle made by the parent answers E_STATE.
 */
#ifndef SOFTSHADOW_H
#define SOFTSHADOW_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef SOFTSHADOW_API
#if defined(__GNUC__)
#define SOFTSHADOW_API __attribute__((visibility("default")))
#else
#define SOFTSHADOW_API
#endif
#endif

/* The version this header describes: major, minor, patch. softshadow_version() tells what runs. */
#define SOFTSHADOW_VERSION_MAJOR 1
#define SOFTSHADOW_VERSION_MINOR 0
#define SOFTSHADOW_VERSION_PATCH 0
#define SOFTSHADOW_VERSION 10000u /* major * 10000 + minor * 100 + patch */

/* ---- What a call answers ------------------------------------------------------------------- */

typedef int32_t softshadow_status;

enum {
    SOFTSHADOW_OK = 0,
    SOFTSHADOW_E_ARGUMENT = -1,    /* an argument is not allowed; the message names it */
    SOFTSHADOW_E_STATE = -2,       /* not now: nothing built, in use, or made before fork() */
    SOFTSHADOW_E_MESH = -3,        /* a vertex or an index cannot be used; the message has its number */
    SOFTSHADOW_E_LIGHT = -4,       /* a light that is none: NaN, negative radius, skewed axes */
    SOFTSHADOW_E_MEMORY = -5,      /* memory ran out: the scene is as it was; after a build nothing is built */
    SOFTSHADOW_E_UNSUPPORTED = -6, /* this build, machine or method cannot do it */
    SOFTSHADOW_E_CANCELLED = -7,   /* your progress callback said stop */
    SOFTSHADOW_E_BACKEND = -8,     /* Embree, EGL or a driver failed; the message has its words */
    SOFTSHADOW_E_INTERNAL = -9     /* a defect of ours: please report the message */
};

/* Scene, lights and whatever was built from them. Opaque. */
typedef struct softshadow softshadow;

/* ---- Names for small numbers ----------------------------------------------------------------*/

/* position_type: what positions are made of, three numbers each. */
enum { SOFTSHADOW_F32 = 0, SOFTSHADOW_F64 };

/* light type */
enum { SOFTSHADOW_SPHERE = 0, SOFTSHADOW_DISK, SOFTSHADOW_RECT, SOFTSHADOW_SUN };

/* backend: where maps are built and asked.
 *   CPU  every method
 *   EGL  the methods that work from maps, on a GPU that is found without a display. It is never used
 *        unless asked for. One thread of the library's own has the context, which is made once a
 *        process; a context of the host's stays as it is. Answers are those of the CPU within a few
 *        texels' share of the light, and the same from run to run on one device. The environment's
 *        SOFTSHADOW_EGL_DEVICE chooses the device by its number. Not in a child of fork() whose
 *        parent has used it.
 *   ANY  EGL where the method, the device and its memory allow it, else the CPU: the log is told why,
 *        once a handle, and softshadow_stats has what it was */
enum { SOFTSHADOW_CPU = 0, SOFTSHADOW_EGL, SOFTSHADOW_ANY };

/* weighting: how much each part of the light counts.
 *   UNIFORM      all parts of the light's measure alike (see softshadow_light)
 *   SOLID_ANGLE  by the solid angle d(omega) the part fills at the point
 *   IRRADIANCE   by cos(theta at the receiver) d(omega): what unshadowed direct light on a diffuse
 *                surface is made of. Needs normals. */
enum { SOFTSHADOW_UNIFORM = 0, SOFTSHADOW_SOLID_ANGLE, SOFTSHADOW_IRRADIANCE };

/* falloff: how a map technique turns its linear penumbra coordinate into a fraction.
 *   DISK     exact area of a disk cut by a line   LINEAR   exact for a square light
 *   PAPER    what the technique's paper printed   PROFILE  from the light's radial profile */
enum {
    SOFTSHADOW_FALLOFF_DISK = 0,
    SOFTSHADOW_FALLOFF_LINEAR,
    SOFTSHADOW_FALLOFF_PAPER,
    SOFTSHADOW_FALLOFF_PROFILE
};

/* What error_bound means for a method: nothing (NaN), a bound the truth never leaves, or one it
 * leaves at one point in a thousand. Where "auto" uses coarser levels, what they add to its bound is
 * the largest deviation measured at the mesh's vertices. */
enum { SOFTSHADOW_BOUND_NONE = 0, SOFTSHADOW_BOUND_CERTIFIED, SOFTSHADOW_BOUND_STATISTICAL };

/* Mesh flags. A mesh with neither CASTS nor RECEIVES does both. BORROW: the arrays stay yours and
 * must stay as they are until the mesh is updated or removed, or the handle destroyed. */
enum { SOFTSHADOW_CASTS = 1, SOFTSHADOW_RECEIVES = 2, SOFTSHADOW_BORROW = 4 };

/* "No triangle": the value of a primitive that is not known. */
#define SOFTSHADOW_NO_PRIMITIVE UINT64_MAX

/* ---- What you give --------------------------------------------------------------------------*/

/* How a handle works with its host. All of it is optional. */
typedef struct softshadow_options {
    uint32_t struct_size;
    uint32_t threads; /* how many threads a call may use, its own included; 0: one per processor.
                         Embree builds for rays on TBB's threads, one per processor, whatever this says */
    void *user;       /* handed to the callbacks below */
    /* Called with one line of text; level 0 error, 1 warning, 2 information. Any thread. */
    void (*log)(void *user, int level, const char *text);
    /* Called now and then with done in 0..1 while a call works; non-zero cancels that call. One
     * thread at a time, never after the call has returned. It must not call this handle. */
    int (*progress)(void *user, double done);
    /* Your scheduler: call body(ctx, begin, end) for ranges that together cover 0..n, on as many
     * threads as you like, and return when all are done. NULL: threads of our own. */
    void (*parallel)(void *user, uint64_t n, void (*body)(void *ctx, uint64_t begin, uint64_t end),
                     void *ctx);
} softshadow_options;

/* An 8-bit image, width x height, row after row; v = 0 is the first row, u and v repeat. */
typedef struct softshadow_texture {
    uint32_t width, height;
    const uint8_t *texels;
} softshadow_texture;

/* Triangles. Any soup is welcome: open, non-manifold, degenerate, in any winding. */
typedef struct softshadow_mesh {
    uint32_t struct_size;
    uint32_t flags;           /* SOFTSHADOW_CASTS | _RECEIVES | _BORROW */
    uint32_t position_type;   /* SOFTSHADOW_F32 or _F64 */
    const void *positions;    /* vertex_count x 3, finite, within +-1e15 */
    size_t position_stride;   /* bytes from one vertex to the next; 0: packed */
    size_t vertex_count;
    const uint32_t *indices;  /* triangle_count x 3, each below vertex_count */
    size_t triangle_count;    /* 0 is allowed: such a mesh casts nothing */
    const double *transform;  /* 12: three rows of [A | t], x' = A x + t; NULL: identity */
    const float *uvs;         /* vertex_count x 2, for the opacity texture; or NULL */
    size_t uv_stride;         /* bytes; 0: packed */
    softshadow_texture opacity; /* texels NULL: opaque */
    float opacity_threshold;  /* a spot casts where texel / 255 >= this */
} softshadow_mesh;

/* A light, and the measure in which "fraction" is meant:
 *   RECT    centre, half axes u and v, perpendicular; normal u x v; uniform in area
 *   DISK    centre, normal (direction), radius; uniform in area. Of radius 0 with half axes u and v,
 *           perpendicular: an ellipse, normal u x v
 *   SPHERE  centre and radius r; a point at distance d sees a disk of radius r d / sqrt(d^2 - r^2)
 *           through the centre, facing it; uniform in that disk's area. Only what lies before the
 *           circle where the tangent cone touches the lamp occludes. Inside the lamp all is seen.
 *   SUN     the direction the light travels and its angular radius (0..80 degrees, in radians): the
 *           disk of radius tan(angle) at distance 1 towards the sun; uniform in its area
 * Radius 0, or below 1e-30 of the scene's size or of its distance, is a point light: 0 or 1. Rect
 * and disk shine to both sides except under IRRADIANCE, where they emit on their normal's side. */
typedef struct softshadow_light {
    uint32_t struct_size;
    uint32_t type;
    double position[3];
    double direction[3]; /* disk: normal; rect, ellipse: zero or along u x v; sun: the way light
                            travels */
    double u[3], v[3];   /* rect, ellipse */
    double radius;       /* sphere, disk: length; sun: radians */
    const float *profile; /* weight of the area at rho = i / (profile_count - 1); NULL: uniform */
    uint32_t profile_count;
} softshadow_light;

/* What to build. Every zero is a default. */
typedef struct softshadow_build {
    uint32_t struct_size;
    const char *method;   /* a name softshadow_method_info() lists; NULL: "auto" */
    uint32_t backend;     /* SOFTSHADOW_CPU, _EGL, _ANY */
    uint32_t samples;     /* light samples a point for "raytrace", "exact"; 0: what tolerance needs */
    uint32_t resolution;  /* side of a map in texels; 0: 1024 */
    uint32_t layers;      /* depth layers of "backprojection"; 0: 3 */
    uint32_t max_samples; /* most texels a back-projection or a filter visits; 0: all */
    uint32_t falloff;     /* SOFTSHADOW_FALLOFF_ */
    uint32_t weighting;   /* SOFTSHADOW_UNIFORM, _SOLID_ANGLE, _IRRADIANCE */
    uint32_t mask_taps;   /* "penumbra-mask": taps along a side; 0: 8 */
    uint32_t blur;        /* "penumbra-mask" where points are rows of an image: blur over so many
                             pixels, 64 at most; 1: over 12; 0: not at all */
    uint32_t seed;        /* turns the sample pattern of "raytrace" and "penumbra-mask" */
    double tolerance;     /* wanted RMS error of a point in penumbra; 0: 1/256 */
    double depth_bias;    /* for techniques that compare depths, in units of length; 0: their own */
    double smoothie_width; /* "smoothie": in tangent units; 0: R/b */
    const double *bounds; /* 6: min xyz, max xyz of all points you will ask; NULL: anywhere */
    uint32_t propagate;   /* "penumbra-limit": non-zero: penumbrae spread from the depth image instead
                             of from silhouettes: for foliage, soup and cut-out opacity */
    uint64_t points_ahead; /* about how many points you will ask in all while the meshes stay as they
                              are; 0: who knows. "auto" makes coarser levels of dense meshes, which
                              takes seconds a million triangles, when this, or one batch, repays it */
    uint32_t sub_lights; /* "penumbra-volume", "penumbra-mask": the light is divided in so many, 8 at
                            most, along each of two sides, each with maps of its own, whose mean
                            counts; 0, 1: not at all. A rect into rects; round ones into as many
                            round ones of the same area in all, which is nearly the same light */
} softshadow_build;

/* A batch of points. Two input arrays may be the same memory; outputs must not overlap inputs. */
typedef struct softshadow_points {
    uint32_t struct_size;
    uint32_t position_type;
    const void *positions;      /* count x 3 */
    size_t position_stride;     /* bytes; 0: packed */
    size_t count;               /* 0 is allowed */
    const float *normals;       /* count x 3, any length, 0 0 0: none; or NULL. What lies below the
                                   point's horizon is hidden. Not finite: no point */
    size_t normal_stride;       /* bytes; 0: packed */
    const uint32_t *ids;        /* count: objects a blur must not cross; or NULL */
    const uint64_t *primitives; /* count: mesh_id << 32 | triangle the point lies on, or
                                   SOFTSHADOW_NO_PRIMITIVE; or NULL. With it no epsilon decides what
                                   touches the point; without, a face within 4 units in the last
                                   place of the largest coordinate counts as touched */
    uint32_t width;             /* > 0: the points are rows of an image; divides count */
    uint32_t light;             /* which light: an id */
    float *error_bound;         /* out, count, or NULL: how far the truth may be. Unlike the
                                   visibility it may be tighter in one batch than in another, where
                                   a whole group of points was settled at once; "auto" bounds the
                                   points of a group together. Rays bound nothing for sure: where
                                   bounds are asked for "auto" traces none */
} softshadow_points;

/* ---- What you get ---------------------------------------------------------------------------*/

/* A measurement against ray-traced truth of another sequence. */
typedef struct softshadow_error {
    uint32_t struct_size;
    uint64_t max_points; /* in: measure on at most so many of the points; 0: all */
    uint32_t samples;    /* in: rays a point for the reference; 0: 4096 */
    double rms, max, p99, mean; /* out: of method minus reference over the points measured */
    double reference_error;     /* out: RMS error of the reference itself, from two halves */
    uint64_t points;            /* out: how many were measured; 0: the numbers above are NaN */
} softshadow_error;

/* Sums since the last build. */
typedef struct softshadow_stats {
    uint32_t struct_size;
    double build_seconds, query_seconds;
    uint64_t triangles;        /* that cast */
    uint64_t casters_culled;   /* triangles that no query could need and no map holds */
    uint64_t silhouette_edges;
    uint64_t points, points_lit, points_umbra, points_penumbra;
    uint64_t points_traced;    /* that any ray, or any tap of "penumbra-mask", was spent on; under
                                  sub_lights: of the part of the light with the most of them */
    uint64_t points_bad;       /* not finite, beyond 1e15 or outside bounds: answered NaN */
    uint64_t rays;
    uint64_t map_bytes, peak_bytes; /* held by what was built; most ever held */
    const char *method_used, *backend_used;
    uint64_t points_settled;   /* told to see all of the light, or nothing, before anything was drawn from
                                  them: a whole group at once, or by a map */
    uint64_t lod_triangles;    /* triangles of coarser levels at hand; 0: none was used */
    double upload_seconds, download_seconds; /* of build and queries, spent on copies to the GPU and
                                                back; of queries the sum over threads */
    double depth_seconds, silhouette_seconds; /* of build, spent on maps of the nearest depths and on
                                                 finding silhouettes */
} softshadow_stats;

/* One plane of what was built, to look at or to use on a GPU. Valid until the next build. A depth of
 * 1e30 says that a texel holds nothing; others compare with depth[0] + depth[1] z / w of a point in
 * clip space, which is greater where the plane's depth shadows it. */
typedef struct softshadow_map {
    uint32_t struct_size;
    const char *name;
    uint32_t width, height, channels;
    const float *pixels; /* row after row, the lowest y of clip space first */
    double matrix[16]; /* row-major: world to clip space of the plane */
    const char *channel_names; /* "c,g,b,q": what each channel holds; NULL: it says so itself */
    uint32_t light, face; /* whose it is; around a light inside the scene there are faces 0, 1, ... */
    double depth[2];      /* from z / w in clip space, -1..1, to the unit of the plane's depths */
    double origin[3], unit; /* of channels .x .y .z: world = origin + value * unit */
} softshadow_map;

typedef struct softshadow_method {
    uint32_t struct_size;
    const char *name, *title, *citation;
    uint32_t bound_kind;        /* SOFTSHADOW_BOUND_ */
    uint32_t lights_native;     /* bit (1 << SOFTSHADOW_SPHERE) ... : exactly as the method means it */
    uint32_t lights_approximated; /* likewise: by a stand-in, see notes */
    const char *notes;
    uint32_t backends;          /* bit (1 << SOFTSHADOW_CPU) ... : where it runs */
} softshadow_method;

/* Something that builds and answers. */
typedef struct softshadow_backend {
    uint32_t struct_size;
    softshadow_status status;   /* SOFTSHADOW_OK: here it is; else what a build would answer */
    const char *name;           /* "cpu", "egl" */
    const char *device, *version; /* in the driver's words; "": none */
    const char *why;            /* it is not here; "" if it is */
} softshadow_backend;

/* What a mesh is made of, after vertices in the same place were taken as one. */
typedef struct softshadow_mesh_report {
    uint32_t struct_size;
    uint64_t vertices, triangles;
    uint64_t positions;             /* vertices that differ */
    uint64_t degenerate_triangles;  /* no area */
    uint64_t duplicate_triangles;   /* same three positions as an earlier one */
    uint64_t edges, boundary_edges; /* boundary: used by one triangle */
    uint64_t nonmanifold_edges;     /* used by three triangles or more */
    uint64_t flipped_edges;         /* used twice in the same direction */
    uint64_t nonmanifold_vertices;  /* where more than one fan of triangles meets */
    uint64_t components;            /* connected by edges */
    uint64_t closed_components;     /* every edge used equally often in both directions */
    uint64_t silhouette_edges;      /* as seen from the centre of light 0; 0 without a light */
    double bounds[6];               /* min xyz, max xyz, transformed */
} softshadow_mesh_report;

/* One point's view of a light. Fill the upper part; arrays you leave NULL are not computed. */
typedef struct softshadow_explanation {
    uint32_t struct_size;
    double point[3];
    const float *normal;       /* 3, or NULL */
    const uint64_t *primitive; /* 1: the triangle the point lies on, or NULL */
    uint32_t light;
    uint32_t size;        /* side of the image, 1..4096 */
    float *image;         /* out, size x size: 1 seen, 0 hidden, NaN not part of the light; row 0 is
                             at +v, column 0 at -u of the light's frame as the point sees it */
    uint64_t *hider;      /* out, size x size: a triangle that hides this spot (the nearest), or
                             SOFTSHADOW_NO_PRIMITIVE */
    float visibility;     /* out: from the pixels of the image */
    uint64_t triangles;   /* out: how many different triangles are in hider */
    double centre[3], u[3], v[3]; /* out: the light as the point sees it: centre, half axes */
} softshadow_explanation;

/* A struct with its size set and everything else zero, which is the default. */
#ifdef __cplusplus
extern "C++" {
template <class T> inline T softshadow_init_of_() {
    T zero = T();
    zero.struct_size = sizeof(T);
    return zero;
}
}
#define SOFTSHADOW_INIT_(type) softshadow_init_of_<type>()
#else
#define SOFTSHADOW_INIT_(type) { .struct_size = sizeof(type) }
#endif
#define SOFTSHADOW_OPTIONS_INIT SOFTSHADOW_INIT_(softshadow_options)
#define SOFTSHADOW_MESH_INIT SOFTSHADOW_INIT_(softshadow_mesh)
#define SOFTSHADOW_LIGHT_INIT SOFTSHADOW_INIT_(softshadow_light)
#define SOFTSHADOW_BUILD_INIT SOFTSHADOW_INIT_(softshadow_build)
#define SOFTSHADOW_POINTS_INIT SOFTSHADOW_INIT_(softshadow_points)
#define SOFTSHADOW_ERROR_INIT SOFTSHADOW_INIT_(softshadow_error)
#define SOFTSHADOW_STATS_INIT SOFTSHADOW_INIT_(softshadow_stats)
#define SOFTSHADOW_MAP_INIT SOFTSHADOW_INIT_(softshadow_map)
#define SOFTSHADOW_METHOD_INIT SOFTSHADOW_INIT_(softshadow_method)
#define SOFTSHADOW_BACKEND_INIT SOFTSHADOW_INIT_(softshadow_backend)
#define SOFTSHADOW_MESH_REPORT_INIT SOFTSHADOW_INIT_(softshadow_mesh_report)
#define SOFTSHADOW_EXPLANATION_INIT SOFTSHADOW_INIT_(softshadow_explanation)

/* ---- The library itself ---------------------------------------------------------------------*/

/* The version that runs, as SOFTSHADOW_VERSION counts. A host that loads the library by hand should
 * refuse another major version. Any thread, any time. */
SOFTSHADOW_API uint32_t softshadow_version(void);

/* The same as text, "1.0.0". Static. */
SOFTSHADOW_API const char *softshadow_version_string(void);

/* The name of a status, "SOFTSHADOW_E_MESH"; "unknown status" for numbers that are none. Static. */
SOFTSHADOW_API const char *softshadow_status_name(softshadow_status status);

/* What the calling thread's last failed call on this handle had to say, one line; "" if it did not
 * fail. NULL as the handle: what the last failed softshadow_create() said. Valid until the thread's
 * next call. Never NULL. */
SOFTSHADOW_API const char *softshadow_last_message(const softshadow *handle);

/* ---- A handle -------------------------------------------------------------------------------*/

/* Makes an empty scene.
 *   out      receives the handle, or NULL on error
 *   options  NULL: all defaults
 * Errors: E_ARGUMENT, E_MEMORY. Loads nothing else: no Embree, no GL. */
SOFTSHADOW_API softshadow_status softshadow_create(softshadow **out,
                                                   const softshadow_options *options);

/* Frees a handle and all it holds; NULL is fine. No other call may be using it. */
SOFTSHADOW_API void softshadow_destroy(softshadow *handle);

/* ---- The scene ------------------------------------------------------------------------------*/

/* Adds a mesh. Its arrays are copied unless SOFTSHADOW_BORROW is set.
 *   mesh     see softshadow_mesh
 *   mesh_id  receives the mesh's number (0, 1, ... never used again), or UINT32_MAX; may be NULL
 * Errors: E_MESH with the number of the first vertex or triangle that cannot be used; E_ARGUMENT for
 * strides, types, flags and sizes; E_MEMORY; E_STATE while a query runs. */
SOFTSHADOW_API softshadow_status softshadow_add_mesh(softshadow *handle, const softshadow_mesh *mesh,
                                                     uint32_t *mesh_id);

/* Puts another mesh in the place of mesh_id. Refused, the handle stays as it was. Errors as above. */
SOFTSHADOW_API softshadow_status softshadow_update_mesh(softshadow *handle, uint32_t mesh_id,
                                                        const softshadow_mesh *mesh);

/* Takes a mesh out of the scene. Errors: E_ARGUMENT for an id that is none, E_STATE. */
SOFTSHADOW_API softshadow_status softshadow_remove_mesh(softshadow *handle, uint32_t mesh_id);

/* Makes this the only light, id 0. Errors: E_LIGHT, E_ARGUMENT, E_MEMORY, E_STATE. */
SOFTSHADOW_API softshadow_status softshadow_set_light(softshadow *handle,
                                                      const softshadow_light *light);

/* Adds a further light.
 *   light_id  receives its id, to be used in softshadow_points.light; may be NULL */
SOFTSHADOW_API softshadow_status softshadow_add_light(softshadow *handle,
                                                      const softshadow_light *light,
                                                      uint32_t *light_id);

/* ---- Build and ask --------------------------------------------------------------------------*/

/* Prepares a method for the scene and its lights; builds again only what has become stale.
 *   build  NULL: the method "auto" with its defaults
 * Errors: E_ARGUMENT names the field; E_UNSUPPORTED for a method, weighting or light that is not to
 * be had; E_STATE without a light; E_CANCELLED; E_BACKEND when Embree or a driver is missing or
 * fails; E_MEMORY. After an error nothing is built and a query answers E_STATE. */
SOFTSHADOW_API softshadow_status softshadow_build_maps(softshadow *handle,
                                                       const softshadow_build *build);

/* The fraction of the light that each point sees.
 *   points      see softshadow_points
 *   visibility  out, count floats in 0..1; NaN for a point that is not finite, beyond 1e15 or
 *               outside the bounds given to the build; all NaN after an error
 * Errors: E_STATE before a build or after the scene changed; E_ARGUMENT; E_CANCELLED; E_MEMORY.
 * Any number of threads may be in here with one handle. */
SOFTSHADOW_API softshadow_status softshadow_query_visibility(softshadow *handle,
                                                             const softshadow_points *points,
                                                             float *visibility);

/* Compares what was built with ray-traced truth (another sequence of samples, far more of them) on
 * evenly chosen points of the batch.
 *   error  in: max_points, samples; out: the rest
 * Errors: as softshadow_query_visibility(), and E_BACKEND without Embree. */
SOFTSHADOW_API softshadow_status softshadow_measure_error(softshadow *handle,
                                                          const softshadow_points *points,
                                                          softshadow_error *error);

/* ---- Looking inside -------------------------------------------------------------------------*/

/* Sums since the last build. Any thread. */
SOFTSHADOW_API softshadow_status softshadow_get_stats(const softshadow *handle,
                                                      softshadow_stats *stats);

/* How many planes the build made, and the index-th of them. Methods without maps have none. */
SOFTSHADOW_API softshadow_status softshadow_map_count(const softshadow *handle, uint32_t *count);
SOFTSHADOW_API softshadow_status softshadow_get_map(const softshadow *handle, uint32_t index,
                                                    softshadow_map *map);

/* The methods this library has, in a fixed order, "auto" first; needs no handle. */
SOFTSHADOW_API softshadow_status softshadow_method_count(uint32_t *count);
SOFTSHADOW_API softshadow_status softshadow_method_info(uint32_t index, softshadow_method *method);

/* Looks whether a backend can be had; needs no handle. For SOFTSHADOW_EGL this makes the context that
 * builds use, once a process: tens of milliseconds and megabytes.
 *   backend  SOFTSHADOW_CPU or SOFTSHADOW_EGL; another: E_ARGUMENT
 *   info     out; its strings are valid until the thread's next call of this */
SOFTSHADOW_API softshadow_status softshadow_backend_info(uint32_t backend, softshadow_backend *info);

/* Counts what a mesh is made of. Works before any build. Errors: E_ARGUMENT, E_MEMORY, E_STATE. */
SOFTSHADOW_API softshadow_status softshadow_mesh_info(softshadow *handle, uint32_t mesh_id,
                                                      softshadow_mesh_report *report);

/* Draws the light as one point sees it and names the triangles that hide it, in double precision
 * and without any method's approximations. Needs a built handle. Errors: as a query. */
SOFTSHADOW_API softshadow_status softshadow_explain(softshadow *handle,
                                                    softshadow_explanation *explanation);

#ifdef __cplusplus
}
#endif
#endif
