/* stage.c - what a picture shows: the scene's meshes, a ground under them, and from where. */
#include <float.h>
#include <stdlib.h>
#include <string.h>

#include "picture.h"

/* In radii of the scene: the ground is this far out gone, which hides that it ends. */
static const double ground_reach = 9;

/* The gap between the lowest vertex and a ground that is put there, as a part of the scene's
 * radius: too small to be seen, wide enough to win against a floor that the scene brought along. */
static const double ground_gap = 1.0 / 65536;

static bool no_memory(cli_error *error) { return cli_fail(error, CLI_FAILED, "memory ran out"); }

static bool copy_mesh(raster_surface *surface, const cli_mesh *mesh) {
    const size_t numbers = 3 * mesh->vertex_count;
    double *positions = malloc((numbers + 1) * sizeof *positions);
    uint32_t *indices = malloc((3 * mesh->triangle_count + 1) * sizeof *indices);
    surface->positions = positions, surface->indices = indices;
    if (!positions || !indices) return false;
    if (mesh->position_type == SOFTSHADOW_F64)
        memcpy(positions, mesh->positions, numbers * sizeof *positions);
    else
        for (size_t i = 0; i < numbers; i++) positions[i] = ((const float *)mesh->positions)[i];
    memcpy(indices, mesh->indices, 3 * mesh->triangle_count * sizeof *indices);
    surface->vertex_count = mesh->vertex_count;
    surface->triangle_count = mesh->triangle_count;
    return true;
}

/* The box of what triangles use: a stray vertex must not move the camera. */
static void measure(const raster_surface *surface, double bounds[6]) {
    for (size_t i = 0; i < 3 * surface->triangle_count; i++) {
        const double *p = surface->positions + 3 * (size_t)surface->indices[i];
        for (int axis = 0; axis < 3; axis++) {
            bounds[axis] = fmin(bounds[axis], p[axis]);
            bounds[3 + axis] = fmax(bounds[3 + axis], p[axis]);
        }
    }
}

static bool make_ground(raster_surface *surface, vector centre, double half, double height,
                        char up) {
    static const uint32_t corners[6] = {0, 1, 2, 0, 2, 3};
    static const int sign[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    double *positions = malloc(12 * sizeof *positions);
    uint32_t *indices = malloc(sizeof corners);
    surface->positions = positions, surface->indices = indices;
    if (!positions || !indices) return false;
    memcpy(indices, corners, sizeof corners);
    for (int i = 0; i < 4; i++) {
        double *p = positions + 3 * i;
        p[0] = centre.x + sign[i][0] * half;
        p[1] = up == 'z' ? centre.y + sign[i][1] * half : height;
        p[2] = up == 'z' ? height : centre.z - sign[i][1] * half;
    }
    surface->vertex_count = 4;
    surface->triangle_count = 2;
    return true;
}

bool picture_prepare(picture *p, const cli_scene *scene, double ground, cli_error *error) {
    double bounds[6] = {DBL_MAX, DBL_MAX, DBL_MAX, -DBL_MAX, -DBL_MAX, -DBL_MAX};
    p->ground = RASTER_NONE;
    p->surfaces = calloc(scene->mesh_count + 1u, sizeof *p->surfaces);
    p->normals = calloc(scene->mesh_count + 1u, sizeof *p->normals);
    if (!p->surfaces || !p->normals) return no_memory(error);
    for (uint32_t i = 0; i < scene->mesh_count; i++) {
        p->surface_count++;
        if (!copy_mesh(&p->surfaces[i], &scene->meshes[i])) return no_memory(error);
        measure(&p->surfaces[i], bounds);
    }
    p->centre = vector_scale(vector_add(vector_of(bounds), vector_of(bounds + 3)), 0.5);
    p->radius = vector_length(vector_sub(vector_of(bounds + 3), vector_of(bounds))) / 2;
    if (!(p->radius > 0)) p->radius = 1;
    if (!isnan(ground)) {
        p->ground = p->surface_count++;
        if (isinf(ground)) ground = bounds[p->up == 'z' ? 2 : 1] - ground_gap * p->radius;
        if (!make_ground(&p->surfaces[p->ground], p->centre, ground_reach * p->radius, ground,
                         p->up))
            return no_memory(error);
    }
    if (!(p->camera.fov > 0)) camera_frame(&p->camera, bounds, p->up, p->width, p->height);
    if (!camera_aim(&p->camera, p->up, p->width, p->height, error)) return false;
    for (uint32_t i = 0; i < p->surface_count; i++)
        if (!raster_see(&p->surfaces[i], &p->camera) ||
            !normals_make(&p->normals[i], &p->surfaces[i], p->smooth && i != p->ground))
            return no_memory(error);
    return true;
}

void picture_free(picture *p) {
    for (uint32_t i = 0; i < p->surface_count; i++) {
        free((void *)p->surfaces[i].positions);
        free((void *)p->surfaces[i].indices);
        free(p->surfaces[i].seen);
        normals_free(&p->normals[i]);
    }
    void *const owned[] = {p->surfaces,     p->normals,        p->beauty, p->visibility,
                           p->position,     p->normal,         p->depth,  p->kept_positions,
                           p->kept_normals, p->kept_primitives, p->unlit,  p->unshadowed,
                           p->bands_done};
    for (size_t i = 0; i < sizeof owned / sizeof *owned; i++) free(owned[i]);
}
