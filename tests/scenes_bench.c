/* The scenes of the bench: meshes, lights and cameras as numbers. */
#include <math.h>

#include "scenes.h"

static void make_triangle(scene_mesh *mesh) {
    const uint32_t a = scene_vertex(mesh, -0.9, -0.3, 0.4), b = scene_vertex(mesh, 0.7, -0.5, 1.1);
    scene_triangle(mesh, a, b, scene_vertex(mesh, 0.1, 0.8, 1.9));
}

static void make_leaves_2k(scene_mesh *mesh) { scene_leaves(mesh, 1000, 1); }
static void make_leaves_20k(scene_mesh *mesh) { scene_leaves(mesh, 10000, 2); }

void scene_spheres(scene_mesh *mesh, unsigned levels) {
    static const double centre[4][3] = {
        {-0.55, -0.5, 0.55}, {0.6, -0.35, 0.7}, {0.05, 0.6, 0.6}, {0.0, 0.0, 1.55}};
    for (int i = 0; i < 4; i++) scene_icosphere(mesh, centre[i], i == 3 ? 0.4 : 0.5, levels, 0.12);
}

static void make_spheres_100k(scene_mesh *mesh) { scene_spheres(mesh, 5); }
static void make_spheres_1m(scene_mesh *mesh) { scene_spheres(mesh, 7); }

/* From 2.4 radii away, looking a little below the centre: casters and shadow fill the picture. */
#define CAMERA(x, y, z, r)                                                                         \
    {                                                                                              \
        {(x) + 1.5 * (r), (y)-1.6 * (r), (z) + 1.0 * (r)},                                         \
            {(x)-0.3 * (r), (y)-0.1 * (r), (z)-0.4 * (r)}, 40, 512, 512                            \
    }

/* A crown's every point is in penumbra: it must not fill the picture. */
#define FAR_CAMERA                                                                                 \
    { {0.0, -8.0, 7.6}, {-0.4, -0.3, 0.6}, 36, 512, 512 }

/* centre and radius: of the sphere around the casters' bounding box; tests/oracle checks that. */
const scene_entry scene_entries[] = {
    {"triangle", make_triangle, {-0.1, 0.15, 1.15}, 1.19, 0.434, CAMERA(-0.1, 0.15, 1.15, 1.19)},
    {"leaves-2k", make_leaves_2k, {0, 0, 1.5}, 1.08, 0.162, FAR_CAMERA},
    {"leaves-20k", make_leaves_20k, {0, 0, 1.5}, 1.03, 0.076, FAR_CAMERA},
    {"spheres-80k", make_spheres_100k, {0.03, 0.1, 1.0}, 1.49, 0.637, CAMERA(0.03, 0.1, 1.0, 1.49)},
    {"spheres-1m", make_spheres_1m, {0.03, 0.1, 1.0}, 1.49, 0.637, CAMERA(0.03, 0.1, 1.0, 1.49)},
};
const size_t scene_entry_count = sizeof scene_entries / sizeof *scene_entries;

softshadow_light scene_bench_light(const scene_entry *entry, int size) {
    const double elevation = 50 * SCENE_PI / 180, azimuth = 30 * SCENE_PI / 180;
    const double far = 3 * entry->radius;
    const double radius = size == SCENE_LIGHT_SMALL    ? 0.02 * entry->radius
                          : size == SCENE_LIGHT_MEDIUM ? entry->medium
                                                       : entry->radius;
    return scene_sphere_light(entry->centre[0] + far * cos(elevation) * cos(azimuth),
                              entry->centre[1] + far * cos(elevation) * sin(azimuth),
                              entry->centre[2] + far * sin(elevation), radius);
}

static void unit(double v[3]) {
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int k = 0; k < 3; k++) v[k] /= length;
}

void scene_camera_ray(const scene_camera *camera, uint32_t x, uint32_t y, double direction[3]) {
    double ahead[3];
    for (int k = 0; k < 3; k++) ahead[k] = camera->target[k] - camera->eye[k];
    unit(ahead);
    double right[3] = {ahead[1], -ahead[0], 0}; /* ahead x z */
    unit(right);
    const double up[3] = {right[1] * ahead[2], -right[0] * ahead[2],
                          right[0] * ahead[1] - right[1] * ahead[0]};
    const double half = tan(camera->fov_degrees * SCENE_PI / 360);
    const double v = half * (1 - 2 * (y + 0.5) / camera->height);
    const double u = half * (2 * (x + 0.5) / camera->width - 1) * camera->width / camera->height;
    for (int k = 0; k < 3; k++) direction[k] = ahead[k] + u * right[k] + v * up[k];
}

size_t scene_camera_ground(const scene_camera *camera, double ground, double (*points)[3]) {
    size_t n = 0;
    for (uint32_t y = 0; y < camera->height; y++) {
        for (uint32_t x = 0; x < camera->width; x++) {
            double d[3];
            scene_camera_ray(camera, x, y, d);
            const double t = (ground - camera->eye[2]) / d[2];
            if (!(t > 0)) continue;
            for (int k = 0; k < 3; k++) points[n][k] = camera->eye[k] + t * d[k];
            points[n++][2] = ground;
        }
    }
    return n;
}
