/* Scenes of tests/scenes_bench.c, and the models everybody knows: files that are not ours to ship.
 */
#include "scenes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "../mesh/mesh.h"

/* Models are turned z up, scaled to radius 1 and set on the ground at the origin. */
#define MODEL_CAMERA                                                                               \
    { {0.0, -2.2, 1.95}, {-0.2, -0.2, 0.4}, 36, 512, 512 }

static const struct model {
    const char *name, *file;
    const char *folder; /* where a package has it, or NULL: with the fetched models */
    double medium;
} models_known[] = {
    {"bunny", "bunny.obj", "/usr/share/glmark2/models", 0.449},
    {"dragon-11k", "dragon_vrip_res4.ply", NULL, 0.418},
    {"dragon-48k", "dragon_vrip_res3.ply", NULL, 0.433},
    {"dragon-202k", "dragon_vrip_res2.ply", NULL, 0.418},
    {"dragon-871k", "dragon_vrip.ply", NULL, 0.403},
};
enum { MODELS = sizeof models_known / sizeof *models_known };

size_t bench_scene_count(void) { return scene_entry_count + MODELS; }

static const char *name_of(size_t i) {
    return i < scene_entry_count ? scene_entries[i].name : models_known[i - scene_entry_count].name;
}

const char *bench_scene_names(void) {
    static char text[256];
    text[0] = 0;
    for (size_t i = 0; i < bench_scene_count(); i++) {
        const size_t used = strlen(text);
        const char *between = i == 0 ? "" : i == 5 ? ",\n" : ", ";
        snprintf(text + used, sizeof text - used, "%s%s", between, name_of(i));
    }
    return text;
}

int bench_scene_find(const char *name, size_t length) {
    for (size_t i = 0; i < bench_scene_count(); i++)
        if (strlen(name_of(i)) == length && memcmp(name_of(i), name, length) == 0) return (int)i;
    return -1;
}

/* ---- Meshes ---------------------------------------------------------------------------------*/

/* Takes the double mesh's content over: vertices become floats. */
static bool adopt(bench_scene *scene, scene_mesh *from, cli_error *error) {
    float *positions = malloc((3 * from->vertices + 1) * sizeof *positions);
    uint32_t *indices = malloc((3 * from->triangles + 1) * sizeof *indices);
    const bool fine = positions && indices;
    if (fine) {
        for (size_t i = 0; i < 3 * from->vertices; i++) positions[i] = (float)from->xyz[i];
        positions[3 * from->vertices] = 0;
        memcpy(indices, from->indices, 3 * from->triangles * sizeof *indices);
        scene->mesh = (peer_mesh){positions, indices, from->vertices, from->triangles};
    } else {
        free(positions);
        free(indices);
    }
    scene_free(from);
    return fine || cli_fail(error, CLI_FAILED, "memory ran out");
}

static bool append_file(scene_mesh *mesh, const char *path, cli_error *error) {
    cli_mesh file;
    if (!cli_mesh_read(path, &file, error)) return false;
    const uint32_t base = (uint32_t)mesh->vertices;
    for (size_t i = 0; i < file.vertex_count; i++) {
        double v[3];
        for (int k = 0; k < 3; k++)
            v[k] = file.position_type == SOFTSHADOW_F64
                       ? ((const double *)file.positions)[3 * i + k]
                       : (double)((const float *)file.positions)[3 * i + k];
        scene_vertex(mesh, v[0], v[1], v[2]);
    }
    for (size_t i = 0; i < file.triangle_count; i++) {
        const uint32_t *t = file.indices + 3 * i;
        scene_triangle(mesh, base + t[0], base + t[1], base + t[2]);
    }
    cli_mesh_free(&file);
    return true;
}

/* The sphere around the box of the mesh. */
static void measure(scene_entry *entry, const scene_mesh *mesh) {
    double low[3], high[3], square = 0;
    scene_bounds(mesh, low, high);
    for (int k = 0; k < 3; k++) {
        entry->centre[k] = (low[k] + high[k]) / 2;
        square += (high[k] - low[k]) * (high[k] - low[k]) / 4;
    }
    entry->radius = sqrt(square);
}

/* As MODEL_CAMERA sees models, for others. */
static void aim(scene_entry *entry) {
    const scene_camera model = MODEL_CAMERA;
    entry->camera = model;
    for (int k = 0; k < 3; k++) {
        entry->camera.eye[k] = entry->centre[k] + entry->radius * (model.eye[k] - model.target[k]);
        entry->camera.target[k] = entry->centre[k];
    }
}

static bool read_model(bench_scene *scene, const struct model *model, const char *models,
                       cli_error *error) {
    char path[1024];
    snprintf(path, sizeof path, "%s/%s", model->folder ? model->folder : models, model->file);
    if (access(path, R_OK) != 0)
        return cli_fail(error, 0, "%s is not there; %s", path,
                        model->folder ? "install the Debian package glmark2-data"
                                      : "examples/fetch-models gets it");
    scene_mesh mesh = {0};
    if (!append_file(&mesh, path, error)) {
        scene_free(&mesh);
        return false;
    }
    scene_transform(&mesh, (const double[12]){1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0});
    measure(&scene->entry, &mesh);
    double low[3], high[3];
    scene_bounds(&mesh, low, high);
    const double s = 1 / scene->entry.radius, *c = scene->entry.centre;
    scene_transform(
        &mesh, (const double[12]){s, 0, 0, -s * c[0], 0, s, 0, -s * c[1], 0, 0, s, -s * low[2]});
    measure(&scene->entry, &mesh);
    const scene_camera camera = MODEL_CAMERA;
    scene->entry.name = model->name, scene->entry.medium = model->medium;
    scene->entry.camera = camera;
    return adopt(scene, &mesh, error);
}

bool bench_scene_make(bench_scene *scene, size_t index, const char *models, cli_error *error) {
    *scene = (bench_scene){0};
    snprintf(scene->name, sizeof scene->name, "%s", name_of(index));
    if (index >= scene_entry_count)
        return read_model(scene, &models_known[index - scene_entry_count], models, error);
    scene_mesh mesh = {0};
    scene->entry = scene_entries[index];
    scene->open = strncmp(scene->name, "spheres", 7) != 0;
    scene->entry.make(&mesh);
    return adopt(scene, &mesh, error);
}

bool bench_scene_spheres(bench_scene *scene, unsigned levels, cli_error *error) {
    const int base = bench_scene_find("spheres-80k", 11);
    scene_mesh mesh = {0};
    *scene = (bench_scene){.entry = scene_entries[base]};
    scene_spheres(&mesh, levels);
    snprintf(scene->name, sizeof scene->name, "spheres-%zu", mesh.triangles);
    return adopt(scene, &mesh, error);
}

bool bench_scene_read(bench_scene *scene, char *const *paths, int count, cli_error *error) {
    *scene = (bench_scene){.open = true};
    snprintf(scene->name, sizeof scene->name, "mesh");
    scene_mesh mesh = {0};
    for (int i = 0; i < count; i++) {
        if (append_file(&mesh, paths[i], error)) continue;
        scene_free(&mesh);
        return false;
    }
    double low[3], high[3];
    scene_bounds(&mesh, low, high);
    scene->ground = low[2];
    measure(&scene->entry, &mesh);
    scene->entry.name = scene->name, scene->entry.medium = 0.3 * scene->entry.radius;
    aim(&scene->entry);
    return adopt(scene, &mesh, error);
}

void bench_scene_free(bench_scene *scene) {
    free((void *)(uintptr_t)scene->mesh.positions);
    free((void *)(uintptr_t)scene->mesh.indices);
    *scene = (bench_scene){0};
}

/* ---- Points ---------------------------------------------------------------------------------*/

/* In scene radii: what keeps a float ray off the surface it starts from. */
#define LIFT 4e-4

bool bench_points_reserve(bench_points *points, size_t count) {
    *points = (bench_points){malloc(count * sizeof *points->at), malloc(count * sizeof *points->at),
                             malloc(count * sizeof *points->primitives),
                             malloc(count * sizeof *points->pixels), count, 0};
    if (points->at && points->surface && points->primitives && points->pixels) return true;
    bench_points_free(points);
    return false;
}

void bench_points_box(const bench_points *points, double box[6]) {
    for (int k = 0; k < 3; k++) box[k] = INFINITY, box[3 + k] = -INFINITY;
    for (size_t i = 0; i < points->count; i++) {
        for (int k = 0; k < 3; k++) {
            const double at = points->at[i][k], by = 1e-6 * fabs(at);
            box[k] = fmin(box[k], at - by), box[3 + k] = fmax(box[3 + k], at + by);
        }
    }
}

void bench_points_free(bench_points *points) {
    free(points->at);
    free(points->surface);
    free(points->primitives);
    free(points->pixels);
    *points = (bench_points){0};
}

static void corners(const peer_mesh *mesh, size_t triangle, double out[3][3]) {
    for (int v = 0; v < 3; v++)
        for (int k = 0; k < 3; k++)
            out[v][k] = (double)mesh->positions[3 * (size_t)mesh->indices[3 * triangle + v] + k];
}

/* Twice the area; the normal is unit, or zero for a triangle that has no area. */
static double normal_of(double c[3][3], double n[3]) {
    double e[3], f[3];
    for (int k = 0; k < 3; k++) e[k] = c[1][k] - c[0][k], f[k] = c[2][k] - c[0][k];
    n[0] = e[1] * f[2] - e[2] * f[1];
    n[1] = e[2] * f[0] - e[0] * f[2];
    n[2] = e[0] * f[1] - e[1] * f[0];
    const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int k = 0; k < 3 && length > 0; k++) n[k] /= length;
    return length;
}

/* towards: the point is lifted to the side that this direction points to; NULL: along n. */
static void put(bench_points *points, size_t i, const double p[3], const double n[3],
                const double *towards, double lift) {
    double side = 1;
    if (towards && n[0] * towards[0] + n[1] * towards[1] + n[2] * towards[2] < 0) side = -1;
    for (int k = 0; k < 3; k++) {
        points->surface[i][k] = (float)p[k];
        points->at[i][k] = (float)(p[k] + side * lift * n[k]);
    }
}

static const double up[3] = {0, 0, 1};

static bool see(bench_points *points, const bench_scene *scene, const peer *caster, uint32_t side) {
    scene_camera camera = scene->entry.camera;
    camera.width = camera.height = side;
    const double lift = LIFT * scene->entry.radius;
    if (!bench_points_reserve(points, (size_t)side * side)) return false;
    size_t n = 0;
    for (uint32_t i = 0; i < side * side; i++) {
        double d[3], p[3], normal[3], c[3][3], t;
        scene_camera_ray(&camera, i % side, i / side, d);
        const uint32_t triangle = peer_first_hit(caster, camera.eye, d, &t);
        const bool mesh = triangle != UINT32_MAX;
        if (!mesh) t = (scene->ground - camera.eye[2]) / d[2];
        if (!(t > 0)) continue; /* the sky */
        for (int k = 0; k < 3; k++) p[k] = camera.eye[k] + t * d[k], d[k] = -d[k];
        if (mesh) corners(&scene->mesh, triangle, c), normal_of(c, normal);
        points->primitives[n] = mesh ? triangle : SOFTSHADOW_NO_PRIMITIVE;
        points->pixels[n] = i;
        put(points, n++, p, mesh ? normal : up, d, lift);
    }
    points->count = n, points->side = side;
    return n > 0;
}

bool bench_points_camera(bench_points *points, const bench_scene *scene, uint32_t side,
                         cli_error *error) {
    peer *caster;
    if (!peer_create(&caster, &scene->mesh, true, error)) return false;
    const bool fine = see(points, scene, caster, side);
    peer_destroy(caster);
    return fine || cli_fail(error, CLI_FAILED, "%s: no points", scene->name);
}

static size_t pick(const double *sums, size_t count, double at) {
    size_t low = 0, high = count - 1;
    while (low < high) {
        const size_t middle = (low + high) / 2;
        if (sums[middle] > at)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

bool bench_points_scattered(bench_points *points, const bench_scene *scene, size_t count) {
    const peer_mesh *mesh = &scene->mesh;
    double *sums = malloc(mesh->triangle_count * sizeof *sums), sum = 0, c[3][3], n[3];
    uint64_t state = 4242;
    if (!sums || !bench_points_reserve(points, count)) {
        free(sums);
        return false;
    }
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        corners(mesh, i, c);
        sums[i] = sum += normal_of(c, n);
    }
    const softshadow_light light = scene_bench_light(&scene->entry, SCENE_LIGHT_SMALL);
    const double lift = LIFT * scene->entry.radius, half = 2 * scene->entry.radius;
    for (size_t i = 0; i < count; i++) {
        double u = scene_uniform(&state, 0, 1), v = scene_uniform(&state, 0, 1), p[3], to[3];
        points->primitives[i] = SOFTSHADOW_NO_PRIMITIVE;
        if (scene_random(&state) % 2) {
            p[0] = scene->entry.centre[0] + half * (2 * u - 1);
            p[1] = scene->entry.centre[1] + half * (2 * v - 1), p[2] = scene->ground;
            put(points, i, p, up, NULL, lift);
            continue;
        }
        const size_t t = pick(sums, mesh->triangle_count, scene_uniform(&state, 0, sum));
        corners(mesh, t, c);
        normal_of(c, n);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        for (int k = 0; k < 3; k++) {
            p[k] = c[0][k] + u * (c[1][k] - c[0][k]) + v * (c[2][k] - c[0][k]);
            to[k] = light.position[k] - p[k];
        }
        points->primitives[i] = t;
        put(points, i, p, n, scene->open ? to : NULL, lift);
    }
    free(sums);
    return true;
}

/* ---- Order ----------------------------------------------------------------------------------*/

typedef struct keyed {
    uint64_t key;
    uint32_t index;
} keyed;

static uint64_t spread(uint64_t x) {
    x &= 0x1fffff;
    x = (x | x << 32) & 0x1f00000000ffffu;
    x = (x | x << 16) & 0x1f0000ff0000ffu;
    x = (x | x << 8) & 0x100f00f00f00f00fu;
    x = (x | x << 4) & 0x10c30c30c30c30c3u;
    return (x | x << 2) & 0x1249249249249249u;
}

static int by_key(const void *a, const void *b) {
    const uint64_t x = ((const keyed *)a)->key, y = ((const keyed *)b)->key;
    return (x > y) - (x < y);
}

uint32_t *bench_morton(const float (*points)[3], size_t count) {
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    keyed *all = malloc(count * sizeof *all);
    uint32_t *order = malloc(count * sizeof *order);
    for (size_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            low[k] = fminf(low[k], points[i][k]), high[k] = fmaxf(high[k], points[i][k]);
    const float side = fmaxf(fmaxf(high[0] - low[0], high[1] - low[1]), high[2] - low[2]);
    const float scale = side > 0 ? 2097151.0f / side : 0;
    for (size_t i = 0; all && order && i < count; i++) {
        all[i] = (keyed){0, (uint32_t)i};
        for (int k = 0; k < 3; k++)
            all[i].key |= spread((uint64_t)((points[i][k] - low[k]) * scale)) << k;
    }
    if (all && order) {
        qsort(all, count, sizeof *all, by_key);
        for (size_t i = 0; i < count; i++) order[i] = all[i].index;
    }
    free(all);
    if (all) return order;
    free(order);
    return NULL;
}
