/* Procedural scenes, shared by the tests and the bench: meshes made from numbers, so that anybody
 * can make them again, and truths in closed form where there is one.
 *
 * Everything is in double; z is up, receivers lie near z = 0. Ratios are dyadic where a truth
 * depends on two edges meeting exactly. */
#ifndef TESTS_SCENES_H
#define TESTS_SCENES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "softshadow.h"

#define SCENE_PI 3.14159265358979323846

/* ---- Meshes ---------------------------------------------------------------------------------*/

typedef struct scene_mesh {
    double *xyz;
    uint32_t *indices;
    size_t vertices, triangles, vertex_room, triangle_room;
} scene_mesh;

void scene_free(scene_mesh *mesh);
uint32_t scene_vertex(scene_mesh *mesh, double x, double y, double z);
void scene_triangle(scene_mesh *mesh, uint32_t a, uint32_t b, uint32_t c);
/* Four corners in order, two triangles. */
void scene_quad(scene_mesh *mesh, const double corners[4][3]);
/* A rectangle in the plane z = height. */
void scene_rect(scene_mesh *mesh, double x0, double x1, double y0, double y1, double height);
void scene_box(scene_mesh *mesh, const double low[3], const double high[3]);
/* A fan with `edges` rim vertices around (x, y, height): its area is
 * edges/2 r^2 sin(2 pi / edges), see scene_polygon_area(). */
void scene_disk(scene_mesh *mesh, double x, double y, double height, double radius, unsigned edges);
double scene_polygon_area(double radius, unsigned edges);
/* The square |x|, |y| <= half in the plane z = height, without that fan. */
void scene_holed_square(scene_mesh *mesh, double half, double height, double radius,
                        unsigned edges);
/* `count` slats of period p, each from first + i p to first + i p + width, |y| <= length. */
void scene_slats(scene_mesh *mesh, double first, double period, double width, unsigned count,
                 double length, double height);
/* A square lattice of holes of side `hole` at period p: the hole's area fraction is (hole/p)^2. */
void scene_lattice(scene_mesh *mesh, double first, double period, double hole, unsigned count,
                   double height);
/* A sphere of 20 * 4^levels triangles, closed; every vertex moved along its normal by up to
 * `displacement` radii of smooth noise. */
void scene_icosphere(scene_mesh *mesh, const double centre[3], double radius, unsigned levels,
                     double displacement);
/* `count` leaves: small quads at random places in the unit-radius crown around (0, 0, 1.5), turned
 * at random. */
void scene_leaves(scene_mesh *mesh, unsigned count, uint64_t seed);
/* A wall along the y axis that stands on z = 0: x = 0, |y| <= length, 0 <= z <= height. */
void scene_wall(scene_mesh *mesh, double length, double height);

/* The Stanford bunny of glmark2, z up; false and nothing where it is not installed. */
bool scene_bunny(scene_mesh *mesh);

/* Adds all of `more`; copies; the same with each triangle cut into four at the edges' midpoints. */
void scene_append(scene_mesh *mesh, const scene_mesh *more);
scene_mesh scene_copy(const scene_mesh *mesh);
scene_mesh scene_split(const scene_mesh *mesh);
/* x' = A x + t for every vertex; rows of [A | t]. */
void scene_transform(scene_mesh *mesh, const double matrix[12]);
void scene_bounds(const scene_mesh *mesh, double low[3], double high[3]);
/* Triangles in another order, each turned and a third of them reversed. */
void scene_shuffle(scene_mesh *mesh, uint64_t seed);

/* A small scene of everything a mesh may do wrong: open, non-manifold, flipped, duplicated and
 * degenerate triangles, needles, within |x|, |y| <= 2, 1 <= z <= 4. */
void scene_garbage(scene_mesh *mesh, uint64_t seed);

/* ---- The scenes of the bench ----------------------------------------------------------------*/

typedef struct scene_camera {
    double eye[3], target[3], fov_degrees; /* the full vertical angle; z is up */
    uint32_t width, height;
} scene_camera;

typedef struct scene_entry {
    const char *name;
    void (*make)(scene_mesh *mesh);
    double centre[3], radius; /* of the casters' bounding sphere */
    double medium; /* light radius for 25 % of the camera points (ground z = 0 and casters) in
                      penumbra */
    scene_camera camera;
} scene_entry;

/* Four bumpy icospheres, 80 * 4^levels triangles: the entries' spheres have 5 and 7 levels. */
void scene_spheres(scene_mesh *mesh, unsigned levels);

/* One skewed triangle, 2k and 20k leaves, displaced icospheres of 80k and 1.3M triangles. */
extern const scene_entry scene_entries[];
extern const size_t scene_entry_count;

enum { SCENE_LIGHT_SMALL, SCENE_LIGHT_MEDIUM, SCENE_LIGHT_OBJECT };
/* A sphere at three scene radii from the centre, elevation 50 degrees. Small: .02 scene radii;
 * medium: the entry's; object: the radius of the casters' bounding sphere. */
softshadow_light scene_bench_light(const scene_entry *entry, int size);
/* The direction (not unit) of pixel (x, y), row 0 on top; through pixel centres. */
void scene_camera_ray(const scene_camera *camera, uint32_t x, uint32_t y, double direction[3]);
/* Where the camera's pixels see the plane z = ground: count points of width * height at most, in
 * rows; returns how many. */
size_t scene_camera_ground(const scene_camera *camera, double ground, double (*points)[3]);

/* ---- Lights and points ----------------------------------------------------------------------*/

softshadow_light scene_sphere_light(double x, double y, double z, double radius);
softshadow_light scene_disk_light(double x, double y, double z, double nx, double ny, double nz,
                                  double radius);
/* Half sides a (along x) and b (along y), normal -z. */
softshadow_light scene_rect_light(double x, double y, double z, double a, double b);
softshadow_light scene_sun_light(double dx, double dy, double dz, double angle);

/* n x n points of the plane z = height over [x0, x1] x [y0, y1], at the centres of cells. */
void scene_grid(double (*points)[3], size_t n, double x0, double x1, double y0, double y1,
                double height);

/* ---- Random numbers that are the same everywhere ---------------------------------------------*/

uint64_t scene_random(uint64_t *state);
double scene_uniform(uint64_t *state, double low, double high);
void scene_direction(uint64_t *state, double direction[3]);
/* A random rotation as rows. */
void scene_rotation(uint64_t *state, double rows[9]);

#endif
