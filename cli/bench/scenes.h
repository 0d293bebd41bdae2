/* What is measured: meshes, and points of their surroundings that ask how much light they see. */
#ifndef CLI_BENCH_SCENES_H
#define CLI_BENCH_SCENES_H

#include "../../tests/scenes.h"

#include "peer.h"

/* In single precision: both sides get the same floats. */
typedef struct bench_scene {
    char name[64];
    scene_entry entry; /* where it is, its light, its camera; make is NULL for a file */
    double ground;     /* the height of a plane that receives shadows */
    bool open;         /* its triangles have no outside */
    peer_mesh mesh;    /* owned */
} bench_scene;

/* The scenes there are, as one line, for help and errors. */
const char *bench_scene_names(void);
/* The index of a name, or -1. */
int bench_scene_find(const char *name, size_t length);
size_t bench_scene_count(void);

/* Makes scene number index or reads its file. A file that is not there: false, error->status 0. */
bool bench_scene_make(bench_scene *scene, size_t index, const char *models, cli_error *error);
/* Of files the user names, where they are: z is up, the ground touches the lowest vertex. */
bool bench_scene_read(bench_scene *scene, char *const *paths, int count, cli_error *error);
/* Four bumpy icospheres of so many levels: 80 * 4^levels triangles. */
bool bench_scene_spheres(bench_scene *scene, unsigned levels, cli_error *error);
void bench_scene_free(bench_scene *scene);

/* Points just off the surface they lie on, as a renderer asks for them: nothing touches a point, so
 * that no side needs to be told what it lies on. primitives: what that was, and surface: where. */
typedef struct bench_points {
    float (*at)[3];
    float (*surface)[3];
    uint64_t *primitives; /* SOFTSHADOW_NO_PRIMITIVE: on the ground */
    uint32_t *pixels;     /* of the camera's picture, row after row, top first */
    size_t count;
    uint32_t side; /* of that picture; 0: scattered, and pixels tell nothing */
} bench_points;

/* What the camera sees, row after row: of the mesh, else of the ground. */
bool bench_points_camera(bench_points *points, const bench_scene *scene, uint32_t side,
                         cli_error *error);
/* Half of them on the ground, half on the mesh evenly by area, in no order. */
bool bench_points_scattered(bench_points *points, const bench_scene *scene, size_t count);
/* Room for so many; all of the arrays. */
bool bench_points_reserve(bench_points *points, size_t count);
/* The box around them, widened by what rounding to float moves: min xyz, max xyz. */
void bench_points_box(const bench_points *points, double box[6]);
void bench_points_free(bench_points *points);

/* The order along a Morton curve: count indices, to be freed; NULL without memory. */
uint32_t *bench_morton(const float (*points)[3], size_t count);

#endif
