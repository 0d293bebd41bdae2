/* All casters as one soup of floats near the origin. See scene.h for the coordinates. */
#include <string.h>

#include "base/memory.h"
#include "base/status.h"
#include "base/vec.h"
#include "scene/scene.h"

#define PADDING 4  /* floats that Embree may read behind the last vertex */
#define HALF_BITS 8 /* of half, below the largest side's power of two */
#define LEAST (-1074) /* of the exponents that a double's numbers are multiples of */
#define MOST 1023     /* of the exponents of powers of two */

static bool casts(const ss_mesh *mesh) {
    return mesh->used && (mesh->flags & SOFTSHADOW_CASTS) && mesh->triangle_count > 0;
}

/* low, half and scale from the casters' bounds; every step commutes with exact translation and with
 * scaling by a power of two. */
static void place_origin(ss_world *world, const double low[3], const double high[3]) {
    double largest = 0;
    for (int k = 0; k < 3; k++) largest = fmax(largest, high[k] - low[k]);
    int exponent = 0;
    if (largest > 0) frexp(largest, &exponent); /* largest < 2^exponent */
    const double grid = ldexp(1, exponent < LEAST + HALF_BITS ? LEAST : exponent - HALF_BITS);
    for (int k = 0; k < 3; k++) {
        world->low[k] = low[k];
        world->half[k] = largest > 0 ? grid * rint((high[k] - low[k]) / (2 * grid)) : 0;
    }
    /* The half side is at most (1/2 + 2^-9) 2^exponent; +-1 holds it unless it rounds above. */
    double reach = 0;
    for (int k = 0; k < 3; k++) {
        reach = fmax(reach, fmax(world->half[k], (high[k] - low[k]) - world->half[k]));
    }
    if (reach > 0) frexp(reach, &exponent);
    if (reach > 0 && ldexp(0.5, exponent) == reach) exponent--; /* a power of two becomes 1 itself */
    /* Where all is denormal the scale would be none: the scene stays as small as 2^-51, then. */
    world->scale = reach > 0 ? ldexp(1, exponent < -MOST ? MOST : -exponent) : 1;
}

static softshadow_status count_casters(ss_world *world, const ss_scene *scene) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t m = 0; m < scene->mesh_count; m++) {
        const ss_mesh *mesh = &scene->meshes[m];
        if (!casts(mesh)) continue;
        world->mesh_count++;
        world->vertex_count += mesh->vertex_count;
        world->triangle_count += mesh->triangle_count;
        world->any_opacity |= mesh->opacity.texels != NULL;
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], mesh->low[k]), high[k] = fmax(high[k], mesh->high[k]);
        }
    }
    if (world->vertex_count >= UINT32_MAX || world->triangle_count >= UINT32_MAX) {
        return ss_fail(
            SOFTSHADOW_E_ARGUMENT,
            "scene: %zu vertices and %zu triangles cast, must be fewer than 2^32 - 1 each",
            world->vertex_count, world->triangle_count);
    }
    world->scale = 1;
    if (world->mesh_count) place_origin(world, low, high);
    return SOFTSHADOW_OK;
}

static void fill_mesh(ss_world *world, ss_world_mesh *part) {
    const ss_mesh *mesh = part->source;
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        double host[3], local[3];
        ss_mesh_vertex(mesh, i, host);
        ss_world_local(world, host, local);
        float *at = world->vertices + 3 * (part->first_vertex + i);
        for (int k = 0; k < 3; k++) at[k] = (float)local[k];
    }
    uint32_t *index = world->indices + 3 * (size_t)part->first_triangle;
    for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
        index[i] = mesh->indices[i] + part->first_vertex;
        const float *at = world->vertices + 3 * (size_t)index[i];
        for (int k = 0; k < 3; k++) {
            world->bounds[k] = fminf(world->bounds[k], at[k]);
            world->bounds[3 + k] = fmaxf(world->bounds[3 + k], at[k]);
        }
    }
}

static void fill(ss_world *world, const ss_scene *scene) {
    uint32_t triangle = 0, vertex = 0, part = 0;
    for (int k = 0; k < 3 && world->triangle_count; k++) {
        world->bounds[k] = INFINITY, world->bounds[3 + k] = -INFINITY;
    }
    for (uint32_t m = 0; m < scene->mesh_count; m++) {
        const ss_mesh *mesh = &scene->meshes[m];
        if (!casts(mesh)) continue;
        world->meshes[part] = (ss_world_mesh){mesh, m, triangle, vertex};
        fill_mesh(world, &world->meshes[part++]);
        triangle += (uint32_t)mesh->triangle_count, vertex += (uint32_t)mesh->vertex_count;
    }
    for (int i = 0; i < 6; i++) world->extent = fmax(world->extent, fabsf(world->bounds[i]));
}

softshadow_status ss_world_create(ss_world **out, const ss_scene *scene) {
    *out = NULL;
    ss_world *world = ss_alloc(1, sizeof *world);
    if (!world) return ss_fail(SOFTSHADOW_E_MEMORY, "scene: out of memory");
    softshadow_status status = count_casters(world, scene);
    if (status) {
        ss_world_destroy(world);
        return status;
    }
    world->vertices = ss_alloc(3 * world->vertex_count + PADDING, sizeof(float));
    world->indices = ss_alloc(3 * world->triangle_count, sizeof(uint32_t));
    world->meshes = ss_alloc(world->mesh_count, sizeof(ss_world_mesh));
    if (!world->vertices || !world->indices || !world->meshes) {
        status = ss_fail(SOFTSHADOW_E_MEMORY, "scene: out of memory for %zu triangles",
                         world->triangle_count);
        ss_world_destroy(world);
        return status;
    }
    fill(world, scene);
    *out = world;
    return SOFTSHADOW_OK;
}

void ss_world_destroy(ss_world *world) {
    if (!world) return;
    ss_free(world->vertices);
    ss_free(world->indices);
    ss_free(world->meshes);
    ss_free(world);
}

const ss_world_mesh *ss_world_mesh_of(const ss_world *world, uint32_t triangle) {
    uint32_t low = 0, high = world->mesh_count;
    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        if (world->meshes[middle].first_triangle <= triangle) low = middle;
        else high = middle;
    }
    return &world->meshes[low];
}

static void local_vertex(const ss_world *world, const ss_world_mesh *part, uint32_t v,
                         double out[3]) {
    double host[3];
    ss_mesh_vertex(part->source, v - part->first_vertex, host);
    ss_world_local(world, host, out);
}

void ss_world_vertex(const ss_world *world, uint32_t v, double out[3]) {
    uint32_t low = 0, high = world->mesh_count;
    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        if (world->meshes[middle].first_vertex <= v) low = middle;
        else high = middle;
    }
    local_vertex(world, &world->meshes[low], v, out);
}

void ss_world_triangle(const ss_world *world, uint32_t t, double out[3][3]) {
    const ss_world_mesh *part = ss_world_mesh_of(world, t);
    for (int i = 0; i < 3; i++)
        local_vertex(world, part, world->indices[3 * (size_t)t + i], out[i]);
}

uint64_t ss_world_primitive(const ss_world *world, uint32_t triangle) {
    const ss_world_mesh *part = ss_world_mesh_of(world, triangle);
    return (uint64_t)part->id << 32 | (triangle - part->first_triangle);
}

uint32_t ss_world_find(const ss_world *world, uint64_t primitive) {
    const uint32_t id = (uint32_t)(primitive >> 32), triangle = (uint32_t)primitive;
    uint32_t low = 0, high = world->mesh_count; /* ids ascend */
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (world->meshes[middle].id < id) low = middle + 1;
        else high = middle;
    }
    if (low == world->mesh_count || world->meshes[low].id != id ||
        triangle >= world->meshes[low].source->triangle_count) {
        return SS_NO_TRIANGLE;
    }
    return world->meshes[low].first_triangle + triangle;
}

/* A texel index for a coordinate that repeats. */
static uint32_t wrap(double coordinate, uint32_t size) {
    const double place = (coordinate - floor(coordinate)) * size;
    return place >= size ? size - 1 : (uint32_t)place;
}

bool ss_world_opaque_at(const ss_world *world, uint32_t triangle, double u, double v) {
    const ss_world_mesh *part = ss_world_mesh_of(world, triangle);
    const ss_mesh *mesh = part->source;
    if (!mesh->opacity.texels) return true;
    const uint32_t *corner = mesh->indices + 3 * (size_t)(triangle - part->first_triangle);
    const double weight[3] = {1 - u - v, u, v};
    double at[2] = {0, 0};
    for (int i = 0; i < 3; i++) {
        float uv[2];
        memcpy(uv, (const char *)mesh->uvs + corner[i] * mesh->uv_stride, sizeof uv);
        at[0] += weight[i] * uv[0], at[1] += weight[i] * uv[1];
    }
    const size_t row = wrap(at[1], mesh->opacity.height), column = wrap(at[0], mesh->opacity.width);
    return mesh->opacity.texels[row * mesh->opacity.width + column] / 255.0 >=
           mesh->opacity_threshold;
}

/* The mean of the profile over the unit disk's area: the integral of 2 rho f(rho). */
static double profile_mean(const ss_light *light) {
    const uint32_t n = light->profile_count;
    if (n < 2) return n ? light->profile[0] : 1;
    double sum = 0;
    for (uint32_t i = 0; i + 1 < n; i++) {
        const double x = (double)i / (n - 1), h = 1.0 / (n - 1);
        const double f = light->profile[i], g = light->profile[i + 1];
        /* the integral over x..x+h of 2 rho (f + (g - f)(rho - x)/h) */
        sum += h * (x * (f + g) + h * (f + 2 * g) / 3);
    }
    return sum;
}

/* A light so small is none but a point: its share of the scene, or of its distance, has no place
 * among floats, and is far below what coordinates are rounded to. */
#define POINT 0x1p-100

static void set_axes(ss_light *light, double length) {
    ss_basis(light->normal, light->u, light->v);
    for (int k = 0; k < 3; k++) light->u[k] *= length, light->v[k] *= length;
}

void ss_world_light(const ss_world *world, const softshadow_light *given, ss_light *out) {
    *out = (ss_light){.type = given->type, .profile_count = given->profile_count,
                      .profile = (float *)given->profile};
    out->profile_mean = profile_mean(out);
    if (given->type != SOFTSHADOW_SUN) ss_world_local(world, given->position, out->centre);
    memcpy(out->normal, given->direction, sizeof out->normal);
    out->radius = given->radius * world->scale;
    if (given->type == SOFTSHADOW_SUN) {
        for (int k = 0; k < 3; k++) out->normal[k] = -out->normal[k];
        ss_normalize(out->normal);
        out->radius = tan(given->radius);
        set_axes(out, out->radius);
    } else if (given->type == SOFTSHADOW_RECT || ss_light_is_ellipse(given)) {
        for (int k = 0; k < 3; k++) {
            out->u[k] = given->u[k] * world->scale, out->v[k] = given->v[k] * world->scale;
        }
        const double u = ss_length(out->u), v = ss_length(out->v);
        out->ellipse = given->type == SOFTSHADOW_DISK;
        out->radius = out->ellipse ? ss_max(u, v) : hypot(u, v);
        if (u > 0) ss_cross(out->u, out->v, out->normal);
        ss_normalize(out->normal);
    } else if (given->type == SOFTSHADOW_DISK) {
        ss_normalize(out->normal);
        set_axes(out, out->radius);
    }
    const double away = given->type == SOFTSHADOW_SUN ? 1 : ss_max(1, ss_length(out->centre));
    out->point = out->radius <= POINT * away;
    if (!out->point) return;
    out->radius = 0;
    memset(out->u, 0, sizeof out->u), memset(out->v, 0, sizeof out->v);
}
