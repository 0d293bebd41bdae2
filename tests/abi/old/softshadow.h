/* softshadow.h as of 1.0, without its comments: what a program of that time was compiled against.
 * Never changed once 1.0 is out. Meanings are in the header of today. */
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
#define SOFTSHADOW_VERSION_MAJOR 1
#define SOFTSHADOW_VERSION_MINOR 0
#define SOFTSHADOW_VERSION_PATCH 0
#define SOFTSHADOW_VERSION 10000u
typedef int32_t softshadow_status;
enum {
    SOFTSHADOW_OK = 0,
    SOFTSHADOW_E_ARGUMENT = -1,
    SOFTSHADOW_E_STATE = -2,
    SOFTSHADOW_E_MESH = -3,
    SOFTSHADOW_E_LIGHT = -4,
    SOFTSHADOW_E_MEMORY = -5,
    SOFTSHADOW_E_UNSUPPORTED = -6,
    SOFTSHADOW_E_CANCELLED = -7,
    SOFTSHADOW_E_BACKEND = -8,
    SOFTSHADOW_E_INTERNAL = -9
};
typedef struct softshadow softshadow;
enum { SOFTSHADOW_F32 = 0, SOFTSHADOW_F64 };
enum { SOFTSHADOW_SPHERE = 0, SOFTSHADOW_DISK, SOFTSHADOW_RECT, SOFTSHADOW_SUN };
enum { SOFTSHADOW_CPU = 0, SOFTSHADOW_EGL, SOFTSHADOW_ANY };
enum { SOFTSHADOW_UNIFORM = 0, SOFTSHADOW_SOLID_ANGLE, SOFTSHADOW_IRRADIANCE };
enum {
    SOFTSHADOW_FALLOFF_DISK = 0,
    SOFTSHADOW_FALLOFF_LINEAR,
    SOFTSHADOW_FALLOFF_PAPER,
    SOFTSHADOW_FALLOFF_PROFILE
};
enum { SOFTSHADOW_BOUND_NONE = 0, SOFTSHADOW_BOUND_CERTIFIED, SOFTSHADOW_BOUND_STATISTICAL };
enum { SOFTSHADOW_CASTS = 1, SOFTSHADOW_RECEIVES = 2, SOFTSHADOW_BORROW = 4 };
#define SOFTSHADOW_NO_PRIMITIVE UINT64_MAX
typedef struct softshadow_options {
    uint32_t struct_size;
    uint32_t threads;
    void *user;
    void (*log)(void *user, int level, const char *text);
    int (*progress)(void *user, double done);
    void (*parallel)(void *user, uint64_t n, void (*body)(void *ctx, uint64_t begin, uint64_t end),
                     void *ctx);
} softshadow_options;
typedef struct softshadow_texture {
    uint32_t width, height;
    const uint8_t *texels;
} softshadow_texture;
typedef struct softshadow_mesh {
    uint32_t struct_size;
    uint32_t flags;
    uint32_t position_type;
    const void *positions;
    size_t position_stride;
    size_t vertex_count;
    const uint32_t *indices;
    size_t triangle_count;
    const double *transform;
    const float *uvs;
    size_t uv_stride;
    softshadow_texture opacity;
    float opacity_threshold;
} softshadow_mesh;
typedef struct softshadow_light {
    uint32_t struct_size;
    uint32_t type;
    double position[3];
    double direction[3];
    double u[3], v[3];
    double radius;
    const float *profile;
    uint32_t profile_count;
} softshadow_light;
typedef struct softshadow_build {
    uint32_t struct_size;
    const char *method;
    uint32_t backend;
    uint32_t samples;
    uint32_t resolution;
    uint32_t layers;
    uint32_t max_samples;
    uint32_t falloff;
    uint32_t weighting;
    uint32_t mask_taps;
    uint32_t blur;
    uint32_t seed;
    double tolerance;
    double depth_bias;
    double smoothie_width;
    const double *bounds;
    uint32_t propagate;
    uint64_t points_ahead;
} softshadow_build;
typedef struct softshadow_points {
    uint32_t struct_size;
    uint32_t position_type;
    const void *positions;
    size_t position_stride;
    size_t count;
    const float *normals;
    size_t normal_stride;
    const uint32_t *ids;
    const uint64_t *primitives;
    uint32_t width;
    uint32_t light;
    float *error_bound;
} softshadow_points;
typedef struct softshadow_error {
    uint32_t struct_size;
    uint64_t max_points;
    uint32_t samples;
    double rms, max, p99, mean;
    double reference_error;
    uint64_t points;
} softshadow_error;
typedef struct softshadow_stats {
    uint32_t struct_size;
    double build_seconds, query_seconds;
    uint64_t triangles;
    uint64_t casters_culled;
    uint64_t silhouette_edges;
    uint64_t points, points_lit, points_umbra, points_penumbra;
    uint64_t points_traced;
    uint64_t points_bad;
    uint64_t rays;
    uint64_t map_bytes, peak_bytes;
    const char *method_used, *backend_used;
    uint64_t points_settled;
    uint64_t lod_triangles;
    double upload_seconds, download_seconds;
} softshadow_stats;
typedef struct softshadow_map {
    uint32_t struct_size;
    const char *name;
    uint32_t width, height, channels;
    const float *pixels;
    double matrix[16];
    const char *channel_names;
    uint32_t light, face;
} softshadow_map;
typedef struct softshadow_method {
    uint32_t struct_size;
    const char *name, *title, *citation;
    uint32_t bound_kind;
    uint32_t lights_native;
    uint32_t lights_approximated;
    const char *notes;
    uint32_t backends;
} softshadow_method;
typedef struct softshadow_backend {
    uint32_t struct_size;
    softshadow_status status;
    const char *name;
    const char *device, *version;
    const char *why;
} softshadow_backend;
typedef struct softshadow_mesh_report {
    uint32_t struct_size;
    uint64_t vertices, triangles;
    uint64_t positions;
    uint64_t degenerate_triangles;
    uint64_t duplicate_triangles;
    uint64_t edges, boundary_edges;
    uint64_t nonmanifold_edges;
    uint64_t flipped_edges;
    uint64_t nonmanifold_vertices;
    uint64_t components;
    uint64_t closed_components;
    uint64_t silhouette_edges;
    double bounds[6];
} softshadow_mesh_report;
typedef struct softshadow_explanation {
    uint32_t struct_size;
    double point[3];
    const float *normal;
    const uint64_t *primitive;
    uint32_t light;
    uint32_t size;
    float *image;
    uint64_t *hider;
    float visibility;
    uint64_t triangles;
    double centre[3], u[3], v[3];
} softshadow_explanation;
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
SOFTSHADOW_API uint32_t softshadow_version(void);
SOFTSHADOW_API const char *softshadow_version_string(void);
SOFTSHADOW_API const char *softshadow_status_name(softshadow_status status);
SOFTSHADOW_API const char *softshadow_last_message(const softshadow *handle);
SOFTSHADOW_API softshadow_status softshadow_create(softshadow **out,
                                                   const softshadow_options *options);
SOFTSHADOW_API void softshadow_destroy(softshadow *handle);
SOFTSHADOW_API softshadow_status softshadow_add_mesh(softshadow *handle, const softshadow_mesh *mesh,
                                                     uint32_t *mesh_id);
SOFTSHADOW_API softshadow_status softshadow_update_mesh(softshadow *handle, uint32_t mesh_id,
                                                        const softshadow_mesh *mesh);
SOFTSHADOW_API softshadow_status softshadow_remove_mesh(softshadow *handle, uint32_t mesh_id);
SOFTSHADOW_API softshadow_status softshadow_set_light(softshadow *handle,
                                                      const softshadow_light *light);
SOFTSHADOW_API softshadow_status softshadow_add_light(softshadow *handle,
                                                      const softshadow_light *light,
                                                      uint32_t *light_id);
SOFTSHADOW_API softshadow_status softshadow_build_maps(softshadow *handle,
                                                       const softshadow_build *build);
SOFTSHADOW_API softshadow_status softshadow_query_visibility(softshadow *handle,
                                                             const softshadow_points *points,
                                                             float *visibility);
SOFTSHADOW_API softshadow_status softshadow_measure_error(softshadow *handle,
                                                          const softshadow_points *points,
                                                          softshadow_error *error);
SOFTSHADOW_API softshadow_status softshadow_get_stats(const softshadow *handle,
                                                      softshadow_stats *stats);
SOFTSHADOW_API softshadow_status softshadow_map_count(const softshadow *handle, uint32_t *count);
SOFTSHADOW_API softshadow_status softshadow_get_map(const softshadow *handle, uint32_t index,
                                                    softshadow_map *map);
SOFTSHADOW_API softshadow_status softshadow_method_count(uint32_t *count);
SOFTSHADOW_API softshadow_status softshadow_method_info(uint32_t index, softshadow_method *method);
SOFTSHADOW_API softshadow_status softshadow_backend_info(uint32_t backend, softshadow_backend *info);
SOFTSHADOW_API softshadow_status softshadow_mesh_info(softshadow *handle, uint32_t mesh_id,
                                                      softshadow_mesh_report *report);
SOFTSHADOW_API softshadow_status softshadow_explain(softshadow *handle,
                                                    softshadow_explanation *explanation);
#ifdef __cplusplus
}
#endif
#endif
