/* The scene as the host gave it, and the world the engines work in.
 *
 * LOCAL coordinates: the casters' bounding box is measured in double; every coordinate x becomes
 *     local = ((x - low) - half) * scale      in double, then rounded to float where floats are
 *                                             used.
 * low is the box's lowest corner, half is half its size rounded to a few bits, scale is the power
 * of two that brings all casters into [-1, 1]: so moving a whole scene by an exact amount, or
 * scaling it by a power of two, gives the same bits, and no engine ever meets tiny or huge casters.
 * Points and lights may be anywhere, up to 1e30 or so. The light stays in double. */
#ifndef SS_SCENE_SCENE_H
#define SS_SCENE_SCENE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "scene/light.h"
#include "softshadow.h"

#define SS_COORDINATE_LIMIT 1e15
#define SS_NO_TRIANGLE UINT32_MAX

/* A mesh as it was given, checked. Arrays are owned copies unless borrowed. */
typedef struct ss_mesh {
    bool used;            /* false: removed */
    uint32_t flags;       /* CASTS and RECEIVES resolved, BORROW */
    uint32_t position_type;
    const void *positions;
    size_t position_stride, vertex_count;
    const uint32_t *indices;
    size_t triangle_count;
    bool transformed;
    double transform[12];
    const float *uvs;
    size_t uv_stride;
    softshadow_texture opacity; /* texels NULL: opaque */
    float opacity_threshold;
    double low[3], high[3]; /* bounds after the transform */
    void *owned[4];         /* copies to free: positions, indices, uvs, texels */
} ss_mesh;

typedef struct ss_scene {
    ss_mesh *meshes;
    uint32_t mesh_count, mesh_capacity;
    softshadow_light *lights; /* as given (profile owned) */
    uint32_t light_count, light_capacity;
    uint64_t geometry_version, light_version; /* grow with every change */
} ss_scene;

softshadow_status ss_scene_add_mesh(ss_scene *scene, const softshadow_mesh *mesh, uint32_t *id);
softshadow_status ss_scene_update_mesh(ss_scene *scene, uint32_t id, const softshadow_mesh *mesh);
softshadow_status ss_scene_remove_mesh(ss_scene *scene, uint32_t id);
softshadow_status ss_scene_add_light(ss_scene *scene, const softshadow_light *light, bool only,
                                     uint32_t *id);
void ss_scene_free(ss_scene *scene);

/* Vertex i after the transform, in the host's coordinates. */
void ss_mesh_vertex(const ss_mesh *mesh, size_t i, double out[3]);

/* All casters as one triangle soup in local coordinates: what every engine reads. Immutable. */
typedef struct ss_world_mesh {
    const ss_mesh *source;
    uint32_t id, first_triangle, first_vertex;
} ss_world_mesh;

typedef struct ss_world {
    double low[3], half[3];
    float *vertices;      /* vertex_count x 3, padded by 16 bytes (Embree reads them) */
    uint32_t *indices;    /* triangle_count x 3, into vertices */
    size_t vertex_count, triangle_count;
    ss_world_mesh *meshes; /* casting, non-empty meshes in order of first_triangle */
    uint32_t mesh_count;
    bool any_opacity;     /* some mesh has an opacity texture */
    float bounds[6];      /* of vertices, local; all 0 when there are none */
    double extent;        /* largest |local coordinate| of a vertex: in (1/2, 1], or 0 without any */
    double scale;         /* local units per host unit, a power of two */
} ss_world;

softshadow_status ss_world_create(ss_world **out, const ss_scene *scene);
void ss_world_destroy(ss_world *world);

static inline void ss_world_local(const ss_world *world, const double host[3], double local[3]) {
    for (int k = 0; k < 3; k++) {
        local[k] = ((host[k] - world->low[k]) - world->half[k]) * world->scale;
    }
}
/* Vertex v in local coordinates, in double, as precise as the host gave it. */
void ss_world_vertex(const ss_world *world, uint32_t v, double out[3]);
/* The corners of triangle t likewise. */
void ss_world_triangle(const ss_world *world, uint32_t t, double out[3][3]);
/* Which mesh a world triangle belongs to. */
const ss_world_mesh *ss_world_mesh_of(const ss_world *world, uint32_t triangle);
/* mesh_id << 32 | triangle, as the host names it. */
uint64_t ss_world_primitive(const ss_world *world, uint32_t triangle);
/* The world triangle of a host primitive, SS_NO_TRIANGLE if it does not cast. */
uint32_t ss_world_find(const ss_world *world, uint64_t primitive);
/* Does the triangle cast at barycentric (u, v) (weights 1-u-v, u, v)? true without a texture. */
bool ss_world_opaque_at(const ss_world *world, uint32_t triangle, double u, double v);

/* A light in this world's coordinates (no copies: profile stays the scene's). */
void ss_world_light(const ss_world *world, const softshadow_light *given, ss_light *out);

#endif
