/* Meshes and lights as the host gives them: checked once, copied unless borrowed. */
#include "scene/scene.h"

#include <string.h>

#include "base/memory.h"
#include "base/status.h"
#include "base/vec.h"

#define MOST_ITEMS ((size_t)UINT32_MAX - 1) /* vertices, triangles, texels: ids are 32 bits */
#define SKEW 1e-6                           /* largest cosine between a rect's axes */
#define WIDEST_SUN (80 * M_PI / 180)

static void read_position(const ss_mesh *mesh, size_t i, double out[3]) {
    const char *at = (const char *)mesh->positions + i * mesh->position_stride;
    if (mesh->position_type == SOFTSHADOW_F64) {
        memcpy(out, at, 3 * sizeof(double));
    } else {
        float f[3];
        memcpy(f, at, sizeof f);
        for (int k = 0; k < 3; k++) out[k] = f[k];
    }
}

void ss_mesh_vertex(const ss_mesh *mesh, size_t i, double out[3]) {
    double p[3];
    read_position(mesh, i, p);
    if (!mesh->transformed) {
        memcpy(out, p, sizeof p);
        return;
    }
    for (int k = 0; k < 3; k++) {
        const double *row = mesh->transform + 4 * k;
        out[k] = ss_dot(row, p) + row[3];
    }
}

static size_t position_size(uint32_t type) { return 3 * (type == SOFTSHADOW_F64 ? 8 : 4); }

/* A strided array: its stride (0: packed) must hold an item, and the whole must fit in memory. */
static softshadow_status check_array(const char *name, const void *array, size_t count, size_t size,
                                     size_t *stride) {
    if (*stride == 0) *stride = size;
    size_t bytes;
    if (count && !array) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT, "mesh.%s: NULL, but %zu items are announced", name,
                       count);
    }
    if (*stride < size) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT,
                       "mesh.%s: stride %zu, must be 0 or at least %zu bytes", name, *stride, size);
    }
    if (!ss_multiply(count, *stride, &bytes) || bytes > PTRDIFF_MAX) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT,
                       "mesh.%s: %zu items of stride %zu do not fit in memory", name, count,
                       *stride);
    }
    return SOFTSHADOW_OK;
}

static softshadow_status check_opacity(const softshadow_mesh *given) {
    const softshadow_texture *texture = &given->opacity;
    if (!texture->texels) return SOFTSHADOW_OK;
    size_t texels;
    if (!texture->width || !texture->height ||
        !ss_multiply(texture->width, texture->height, &texels) || texels > MOST_ITEMS) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT,
                       "mesh.opacity: %u x %u texels, must be at least 1 x 1 and fewer than 2^32",
                       texture->width, texture->height);
    }
    if (!given->uvs) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT, "mesh.uvs: NULL, but mesh.opacity needs them");
    }
    if (!isfinite(given->opacity_threshold)) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT, "mesh.opacity_threshold: %g, must be finite",
                       given->opacity_threshold);
    }
    return SOFTSHADOW_OK;
}

/* Fills in what needs no memory and refuses what is malformed. */
static softshadow_status check_shape(const softshadow_mesh *given, ss_mesh *mesh) {
    const uint32_t known = SOFTSHADOW_CASTS | SOFTSHADOW_RECEIVES | SOFTSHADOW_BORROW;
    if (given->flags & ~known) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT,
                       "mesh.flags: 0x%x, must be of SOFTSHADOW_CASTS, _RECEIVES and _BORROW",
                       given->flags);
    }
    if (given->position_type > SOFTSHADOW_F64) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT,
                       "mesh.position_type: %u, must be SOFTSHADOW_F32 or SOFTSHADOW_F64",
                       given->position_type);
    }
    if (given->vertex_count > MOST_ITEMS || given->triangle_count > MOST_ITEMS) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT,
                       "mesh: %zu vertices and %zu triangles, must be fewer than 2^32 - 1 each",
                       given->vertex_count, given->triangle_count);
    }
    mesh->used = true;
    mesh->flags = given->flags;
    if (!(mesh->flags & (SOFTSHADOW_CASTS | SOFTSHADOW_RECEIVES))) {
        mesh->flags |= SOFTSHADOW_CASTS | SOFTSHADOW_RECEIVES;
    }
    mesh->position_type = given->position_type;
    mesh->positions = given->positions, mesh->position_stride = given->position_stride;
    mesh->vertex_count = given->vertex_count;
    mesh->indices = given->indices, mesh->triangle_count = given->triangle_count;
    mesh->uvs = given->uvs, mesh->uv_stride = given->uv_stride;
    mesh->opacity = given->opacity, mesh->opacity_threshold = given->opacity_threshold;
    size_t packed = 3 * sizeof(uint32_t);
    softshadow_status status =
        check_array("positions", given->positions, given->vertex_count,
                    position_size(given->position_type), &mesh->position_stride);
    if (!status)
        status = check_array("indices", given->indices, given->triangle_count, packed, &packed);
    if (!status && given->uvs) {
        status = check_array("uvs", given->uvs, given->vertex_count, 2 * sizeof(float),
                             &mesh->uv_stride);
    }
    return status ? status : check_opacity(given);
}

static softshadow_status check_transform(const softshadow_mesh *given, ss_mesh *mesh) {
    if (!given->transform) return SOFTSHADOW_OK;
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    for (int i = 0; i < 12; i++) {
        if (!isfinite(given->transform[i])) {
            return ss_fail(SOFTSHADOW_E_ARGUMENT, "mesh.transform[%d]: %g, must be finite", i,
                           given->transform[i]);
        }
    }
    mesh->transformed = memcmp(given->transform, identity, sizeof identity) != 0;
    memcpy(mesh->transform, given->transform, sizeof identity);
    return SOFTSHADOW_OK;
}

static bool usable(const double p[3]) {
    for (int k = 0; k < 3; k++) {
        if (!(fabs(p[k]) <= SS_COORDINATE_LIMIT)) return false;
    }
    return true;
}

static softshadow_status check_vertices(const ss_mesh *mesh) {
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        double p[3];
        ss_mesh_vertex(mesh, i, p);
        if (!usable(p)) {
            return ss_fail(
                SOFTSHADOW_E_MESH,
                "mesh.positions: vertex %zu is (%g, %g, %g)%s, must be finite and within "
                "+-1e15",
                i, p[0], p[1], p[2], mesh->transformed ? " after the transform" : "");
        }
    }
    for (size_t i = 0; mesh->uvs && i < mesh->vertex_count; i++) {
        float uv[2];
        memcpy(uv, (const char *)mesh->uvs + i * mesh->uv_stride, sizeof uv);
        if (!(fabsf(uv[0]) <= 1e9f && fabsf(uv[1]) <= 1e9f)) {
            return ss_fail(SOFTSHADOW_E_MESH,
                           "mesh.uvs: vertex %zu has (%g, %g), must be finite and within +-1e9", i,
                           uv[0], uv[1]);
        }
    }
    return SOFTSHADOW_OK;
}

/* Indices in range; the bounds of the vertices that are used. */
static softshadow_status check_triangles(ss_mesh *mesh) {
    for (int k = 0; k < 3; k++) mesh->low[k] = INFINITY, mesh->high[k] = -INFINITY;
    for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
        if (mesh->indices[i] >= mesh->vertex_count) {
            return ss_fail(SOFTSHADOW_E_MESH,
                           "mesh.indices: triangle %zu names vertex %u, must be below %zu", i / 3,
                           mesh->indices[i], mesh->vertex_count);
        }
        double p[3];
        ss_mesh_vertex(mesh, mesh->indices[i], p);
        for (int k = 0; k < 3; k++) {
            mesh->low[k] = fmin(mesh->low[k], p[k]), mesh->high[k] = fmax(mesh->high[k], p[k]);
        }
    }
    return SOFTSHADOW_OK;
}

/* A packed copy of a strided array. */
static void *copy_array(const void *from, size_t count, size_t size, size_t stride) {
    char *copy = ss_alloc(count, size);
    for (size_t i = 0; copy && i < count; i++) {
        memcpy(copy + i * size, (const char *)from + i * stride, size);
    }
    return copy;
}

static void free_mesh(ss_mesh *mesh) {
    for (int i = 0; i < 4; i++) ss_free(mesh->owned[i]);
    *mesh = (ss_mesh){0};
}

static softshadow_status copy_arrays(ss_mesh *mesh) {
    const size_t packed = position_size(mesh->position_type), texels =
        (size_t)mesh->opacity.width * mesh->opacity.height;
    const struct {
        const void *from;
        size_t count, size, stride;
    } arrays[4] = {{mesh->positions, mesh->vertex_count, packed, mesh->position_stride},
                   {mesh->indices, mesh->triangle_count, 12, 12},
                   {mesh->uvs, mesh->uvs ? mesh->vertex_count : 0, 8, mesh->uv_stride},
                   {mesh->opacity.texels, mesh->opacity.texels ? texels : 0, 1, 1}};
    for (int i = 0; i < 4; i++) {
        mesh->owned[i] =
            copy_array(arrays[i].from, arrays[i].count, arrays[i].size, arrays[i].stride);
        if (!mesh->owned[i]) {
            free_mesh(mesh);
            return ss_fail(SOFTSHADOW_E_MEMORY, "mesh: out of memory copying %zu vertices",
                           arrays[0].count);
        }
    }
    mesh->positions = mesh->owned[0], mesh->position_stride = packed;
    mesh->indices = mesh->owned[1];
    if (mesh->uvs) mesh->uvs = mesh->owned[2], mesh->uv_stride = 8;
    if (mesh->opacity.texels) mesh->opacity.texels = mesh->owned[3];
    return SOFTSHADOW_OK;
}

static softshadow_status accept_mesh(const softshadow_mesh *given, ss_mesh *mesh) {
    *mesh = (ss_mesh){0};
    softshadow_status status = check_shape(given, mesh);
    if (!status) status = check_transform(given, mesh);
    if (!status) status = check_vertices(mesh);
    if (!status) status = check_triangles(mesh);
    if (!status && !(mesh->flags & SOFTSHADOW_BORROW)) status = copy_arrays(mesh);
    return status;
}

/* Room for one more item in a growing array. */
static bool reserve(void *array_pointer, uint32_t count, uint32_t *capacity, size_t size) {
    void **array = array_pointer;
    if (count < *capacity) return true;
    const uint32_t wanted = *capacity ? 2 * *capacity : 8;
    void *grown = ss_grow(*array, count, wanted, size);
    if (!grown) return false;
    *array = grown, *capacity = wanted;
    return true;
}

softshadow_status ss_scene_add_mesh(ss_scene *scene, const softshadow_mesh *given, uint32_t *id) {
    ss_mesh mesh;
    if (scene->mesh_count == UINT32_MAX / 2) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT, "mesh: %u were added, no more are allowed",
                       scene->mesh_count);
    }
    softshadow_status status = accept_mesh(given, &mesh);
    if (status) return status;
    if (!reserve(&scene->meshes, scene->mesh_count, &scene->mesh_capacity, sizeof mesh)) {
        free_mesh(&mesh);
        return ss_fail(SOFTSHADOW_E_MEMORY, "mesh: out of memory for mesh %u", scene->mesh_count);
    }
    *id = scene->mesh_count++;
    scene->meshes[*id] = mesh;
    scene->geometry_version++;
    return SOFTSHADOW_OK;
}

static softshadow_status check_id(const ss_scene *scene, uint32_t id) {
    if (id < scene->mesh_count && scene->meshes[id].used) return SOFTSHADOW_OK;
    return ss_fail(SOFTSHADOW_E_ARGUMENT,
                   "mesh_id: %u, is not a mesh of this scene (%u were added)", id,
                   scene->mesh_count);
}

softshadow_status ss_scene_update_mesh(ss_scene *scene, uint32_t id, const softshadow_mesh *given) {
    ss_mesh mesh;
    softshadow_status status = check_id(scene, id);
    if (!status) status = accept_mesh(given, &mesh);
    if (status) return status;
    free_mesh(&scene->meshes[id]);
    scene->meshes[id] = mesh;
    scene->geometry_version++;
    return SOFTSHADOW_OK;
}

softshadow_status ss_scene_remove_mesh(ss_scene *scene, uint32_t id) {
    const softshadow_status status = check_id(scene, id);
    if (status) return status;
    free_mesh(&scene->meshes[id]);
    scene->geometry_version++;
    return SOFTSHADOW_OK;
}

/* ---- lights -------------------------------------------------------------------------------- */

static softshadow_status check_numbers(const char *name, const double *x, double limit) {
    for (int k = 0; k < 3; k++) {
        if (!(fabs(x[k]) <= limit)) {
            return ss_fail(SOFTSHADOW_E_LIGHT, "light.%s: (%g, %g, %g), must be finite and within "
                                               "+-%g", name, x[0], x[1], x[2], limit);
        }
    }
    return SOFTSHADOW_OK;
}

static softshadow_status check_direction(const softshadow_light *light) {
    double direction[3] = {light->direction[0], light->direction[1], light->direction[2]};
    if (ss_finite3(direction) && ss_normalize(direction)) return SOFTSHADOW_OK;
    return ss_fail(SOFTSHADOW_E_LIGHT, "light.direction: (%g, %g, %g), must be finite and not zero",
                   light->direction[0], light->direction[1], light->direction[2]);
}

/* Of a rect or an ellipse. */
static softshadow_status check_axes(const softshadow_light *light) {
    softshadow_status status = check_numbers("u", light->u, SS_COORDINATE_LIMIT);
    if (!status) status = check_numbers("v", light->v, SS_COORDINATE_LIMIT);
    if (status) return status;
    const double u = ss_length(light->u), v = ss_length(light->v), dot = ss_dot(light->u, light->v);
    if ((u == 0) != (v == 0)) {
        return ss_fail(SOFTSHADOW_E_LIGHT,
                       "light.%c: zero, but the other half axis is not; give both or neither",
                       u == 0 ? 'u' : 'v');
    }
    if (u > 0 && fabs(dot) > SKEW * u * v) {
        return ss_fail(SOFTSHADOW_E_LIGHT,
                       "light.u, light.v: the cosine between them is %g, must be within 1e-6 of 0",
                       dot / u / v);
    }
    double normal[3], direction[3];
    memcpy(direction, light->direction, sizeof direction);
    ss_cross(light->u, light->v, normal);
    if (direction[0] == 0 && direction[1] == 0 && direction[2] == 0) return SOFTSHADOW_OK;
    status = check_direction(light);
    if (status || u == 0) return status;
    ss_normalize(direction);
    ss_normalize(normal);
    if (ss_dot(direction, normal) > 1 - SKEW) return SOFTSHADOW_OK;
    return ss_fail(SOFTSHADOW_E_LIGHT,
                   "light.direction: (%g, %g, %g), must be zero or along u x v",
                   light->direction[0], light->direction[1], light->direction[2]);
}

static softshadow_status check_radius(const softshadow_light *light) {
    const bool sun = light->type == SOFTSHADOW_SUN;
    if (light->radius >= 0 && light->radius <= (sun ? WIDEST_SUN : SS_COORDINATE_LIMIT)) {
        return SOFTSHADOW_OK;
    }
    return ss_fail(SOFTSHADOW_E_LIGHT,
                   sun ? "light.radius: %g, must be 0..1.396 radians (80 degrees)"
                       : "light.radius: %g, must be 0..1e15",
                   light->radius);
}

static softshadow_status check_profile(const softshadow_light *light) {
    if (!light->profile) return SOFTSHADOW_OK;
    if (light->profile_count == 0 || light->profile_count > 1u << 20) {
        return ss_fail(SOFTSHADOW_E_LIGHT, "light.profile_count: %u, must be 1..1048576",
                       light->profile_count);
    }
    if (light->type == SOFTSHADOW_RECT) {
        return ss_fail(SOFTSHADOW_E_LIGHT,
                       "light.profile: is for sphere, disk and sun, not for rect");
    }
    bool any = false;
    for (uint32_t i = 0; i < light->profile_count; i++) {
        if (!(light->profile[i] >= 0 && light->profile[i] <= 1e15f)) {
            return ss_fail(SOFTSHADOW_E_LIGHT, "light.profile[%u]: %g, must be 0..1e15", i,
                           light->profile[i]);
        }
        any |= light->profile[i] > 0;
    }
    if (any) return SOFTSHADOW_OK;
    return ss_fail(SOFTSHADOW_E_LIGHT, "light.profile: all zero, some part must shine");
}

static softshadow_status check_light(const softshadow_light *light) {
    softshadow_status status = SOFTSHADOW_OK;
    if (light->type > SOFTSHADOW_SUN) {
        return ss_fail(SOFTSHADOW_E_LIGHT,
                       "light.type: %u, must be SOFTSHADOW_SPHERE, _DISK, _RECT or _SUN",
                       light->type);
    }
    if (light->type != SOFTSHADOW_SUN) {
        status = check_numbers("position", light->position, SS_COORDINATE_LIMIT);
    }
    const bool axes = light->type == SOFTSHADOW_RECT || ss_light_is_ellipse(light);
    if (!status && !axes && light->type != SOFTSHADOW_SPHERE) status = check_direction(light);
    if (!status) status = axes ? check_axes(light) : check_radius(light);
    return status ? status : check_profile(light);
}

softshadow_status ss_scene_add_light(ss_scene *scene, const softshadow_light *given, bool only,
                                     uint32_t *id) {
    softshadow_status status = check_light(given);
    if (status) return status;
    softshadow_light light = *given;
    light.profile = NULL;
    if (!given->profile) light.profile_count = 0;
    if (!reserve(&scene->lights, scene->light_count, &scene->light_capacity, sizeof light)) {
        return ss_fail(SOFTSHADOW_E_MEMORY, "light: out of memory for light %u",
                       scene->light_count);
    }
    if (light.profile_count) {
        light.profile = copy_array(given->profile, light.profile_count, 4, 4);
        if (!light.profile)
            return ss_fail(SOFTSHADOW_E_MEMORY, "light: out of memory for a profile");
    }
    if (only) {
        for (uint32_t i = 0; i < scene->light_count; i++) ss_free((void *)scene->lights[i].profile);
        scene->light_count = 0;
    }
    *id = scene->light_count++;
    scene->lights[*id] = light;
    scene->light_version++;
    return SOFTSHADOW_OK;
}

void ss_scene_free(ss_scene *scene) {
    for (uint32_t i = 0; i < scene->mesh_count; i++) free_mesh(&scene->meshes[i]);
    for (uint32_t i = 0; i < scene->light_count; i++) ss_free((void *)scene->lights[i].profile);
    ss_free(scene->meshes);
    ss_free(scene->lights);
    *scene = (ss_scene){0};
}
