#include "scenes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- Random numbers: splitmix64 -------------------------------------------------------------*/

uint64_t scene_random(uint64_t *state) {
    uint64_t z = (*state += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

double scene_uniform(uint64_t *state, double low, double high) {
    return low + (high - low) * (double)(scene_random(state) >> 11) * 0x1p-53;
}

void scene_direction(uint64_t *state, double direction[3]) {
    const double z = scene_uniform(state, -1, 1), turn = scene_uniform(state, 0, 2 * SCENE_PI);
    const double h = sqrt(1 - z * z);
    direction[0] = h * cos(turn), direction[1] = h * sin(turn), direction[2] = z;
}

void scene_rotation(uint64_t *state, double rows[9]) {
    /* The rotation of a random unit quaternion: a normalised direction of R^4 by rejection. */
    double q[4], length;
    do {
        length = 0;
        for (int i = 0; i < 4; i++) q[i] = scene_uniform(state, -1, 1), length += q[i] * q[i];
    } while (length > 1 || length < 0.01);
    for (int i = 0; i < 4; i++) q[i] /= sqrt(length);
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    const double r[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                         2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                         2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    memcpy(rows, r, sizeof r);
}

/* ---- Meshes ---------------------------------------------------------------------------------*/

static void *grown(void *old, size_t bytes) {
    void *memory = realloc(old, bytes);
    if (!memory) {
        fprintf(stderr, "scenes: out of memory\n");
        exit(99); /* automake: a hard error, not a failure */
    }
    return memory;
}

void scene_free(scene_mesh *mesh) {
    free(mesh->xyz);
    free(mesh->indices);
    *mesh = (scene_mesh){0};
}

uint32_t scene_vertex(scene_mesh *mesh, double x, double y, double z) {
    if (mesh->vertices == mesh->vertex_room) {
        mesh->vertex_room = mesh->vertex_room ? 2 * mesh->vertex_room : 64;
        mesh->xyz = grown(mesh->xyz, mesh->vertex_room * 3 * sizeof(double));
    }
    double *v = mesh->xyz + 3 * mesh->vertices;
    v[0] = x, v[1] = y, v[2] = z;
    return (uint32_t)mesh->vertices++;
}

void scene_triangle(scene_mesh *mesh, uint32_t a, uint32_t b, uint32_t c) {
    if (mesh->triangles == mesh->triangle_room) {
        mesh->triangle_room = mesh->triangle_room ? 2 * mesh->triangle_room : 64;
        mesh->indices = grown(mesh->indices, mesh->triangle_room * 3 * sizeof(uint32_t));
    }
    uint32_t *t = mesh->indices + 3 * mesh->triangles++;
    t[0] = a, t[1] = b, t[2] = c;
}

void scene_quad(scene_mesh *mesh, const double c[4][3]) {
    uint32_t v[4];
    for (int i = 0; i < 4; i++) v[i] = scene_vertex(mesh, c[i][0], c[i][1], c[i][2]);
    scene_triangle(mesh, v[0], v[1], v[2]);
    scene_triangle(mesh, v[0], v[2], v[3]);
}

void scene_rect(scene_mesh *mesh, double x0, double x1, double y0, double y1, double height) {
    scene_quad(mesh, (const double[4][3]){
                         {x0, y0, height}, {x1, y0, height}, {x1, y1, height}, {x0, y1, height}});
}

void scene_box(scene_mesh *mesh, const double low[3], const double high[3]) {
    static const unsigned char face[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                             {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    uint32_t v[8];
    for (int i = 0; i < 8; i++) {
        v[i] = scene_vertex(mesh, i & 1 ? high[0] : low[0], i & 2 ? high[1] : low[1],
                            i & 4 ? high[2] : low[2]);
    }
    for (int f = 0; f < 6; f++) {
        scene_triangle(mesh, v[face[f][0]], v[face[f][1]], v[face[f][2]]);
        scene_triangle(mesh, v[face[f][0]], v[face[f][2]], v[face[f][3]]);
    }
}

static void rim(double out[2], double x, double y, double radius, unsigned i, unsigned edges) {
    const double turn = 2 * SCENE_PI * i / edges;
    out[0] = x + radius * cos(turn), out[1] = y + radius * sin(turn);
}

void scene_disk(scene_mesh *mesh, double x, double y, double height, double radius,
                unsigned edges) {
    const uint32_t centre = scene_vertex(mesh, x, y, height);
    for (unsigned i = 0; i < edges; i++) {
        double at[2];
        rim(at, x, y, radius, i, edges);
        scene_vertex(mesh, at[0], at[1], height);
    }
    for (unsigned i = 0; i < edges; i++) {
        scene_triangle(mesh, centre, centre + 1 + i, centre + 1 + (i + 1) % edges);
    }
}

double scene_polygon_area(double radius, unsigned edges) {
    return edges / 2.0 * radius * radius * sin(2 * SCENE_PI / edges);
}

void scene_holed_square(scene_mesh *mesh, double half, double height, double radius,
                        unsigned edges) {
    const uint32_t first = (uint32_t)mesh->vertices;
    for (unsigned i = 0; i < edges; i++) {
        double at[2];
        rim(at, 0, 0, radius, i, edges);
        /* Straight outwards to the square; the corners are rim points when 8 divides edges. */
        const double c = cos(2 * SCENE_PI * i / edges), s = sin(2 * SCENE_PI * i / edges);
        const double out = half / fmax(fabs(c), fabs(s));
        scene_vertex(mesh, at[0], at[1], height);
        scene_vertex(mesh, out * c, out * s, height);
    }
    for (unsigned i = 0; i < edges; i++) {
        const uint32_t a = first + 2 * i, b = first + 2 * ((i + 1) % edges);
        scene_triangle(mesh, a, a + 1, b + 1);
        scene_triangle(mesh, a, b + 1, b);
    }
}

void scene_slats(scene_mesh *mesh, double first, double period, double width, unsigned count,
                 double length, double height) {
    for (unsigned i = 0; i < count; i++) {
        const double x = first + i * period;
        scene_rect(mesh, x, x + width, -length, length, height);
    }
}

void scene_lattice(scene_mesh *mesh, double first, double period, double hole, unsigned count,
                   double height) {
    const double end = first + count * period;
    for (unsigned i = 0; i < count; i++) {
        const double x = first + i * period, bar = period - hole;
        scene_rect(mesh, x, x + bar, first, end, height);
        for (unsigned j = 0; j < count; j++) {
            const double y = first + j * period;
            scene_rect(mesh, x + bar, x + period, y, y + bar, height);
        }
    }
}

void scene_wall(scene_mesh *mesh, double length, double height) {
    scene_quad(mesh,
               (const double[4][3]){
                   {0, -length, 0}, {0, length, 0}, {0, length, height}, {0, -length, height}});
}

static uint32_t midpoint(scene_mesh *mesh, uint32_t a, uint32_t b) {
    const double *p = mesh->xyz + 3 * (size_t)a, *q = mesh->xyz + 3 * (size_t)b;
    return scene_vertex(mesh, (p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2);
}

/* Each triangle's own midpoints: the same edge gives the same bits from both sides. */
scene_mesh scene_split(const scene_mesh *mesh) {
    scene_mesh out = {0};
    for (size_t i = 0; i < mesh->vertices; i++) {
        scene_vertex(&out, mesh->xyz[3 * i], mesh->xyz[3 * i + 1], mesh->xyz[3 * i + 2]);
    }
    for (size_t i = 0; i < mesh->triangles; i++) {
        const uint32_t *t = mesh->indices + 3 * i;
        const uint32_t ab = midpoint(&out, t[0], t[1]), bc = midpoint(&out, t[1], t[2]),
                       ca = midpoint(&out, t[2], t[0]);
        scene_triangle(&out, t[0], ab, ca);
        scene_triangle(&out, ab, t[1], bc);
        scene_triangle(&out, ca, bc, t[2]);
        scene_triangle(&out, ab, bc, ca);
    }
    return out;
}

/* Edges between numbers, for sharing midpoints: open addressing. */
typedef struct edge_table {
    uint64_t *key;
    uint32_t *value;
    size_t mask;
} edge_table;

static uint32_t shared_midpoint(scene_mesh *mesh, edge_table *table, uint32_t a, uint32_t b) {
    const uint64_t key = (uint64_t)(a < b ? a : b) << 32 | (a < b ? b : a);
    uint64_t hash = key;
    size_t slot = scene_random(&hash) & table->mask;
    while (table->key[slot] && table->key[slot] != key) slot = (slot + 1) & table->mask;
    if (!table->key[slot]) {
        table->key[slot] = key;
        table->value[slot] = midpoint(mesh, a, b);
    }
    return table->value[slot];
}

static void subdivide(scene_mesh *mesh) {
    size_t slots = 64;
    while (slots < 4 * mesh->triangles) slots *= 2;
    edge_table table = {grown(NULL, slots * sizeof(uint64_t)),
                        grown(NULL, slots * sizeof(uint32_t)), slots - 1};
    memset(table.key, 0, slots * sizeof(uint64_t));
    const size_t n = mesh->triangles;
    for (size_t i = 0; i < n; i++) {
        uint32_t t[3];
        memcpy(t, mesh->indices + 3 * i, sizeof t);
        const uint32_t ab = shared_midpoint(mesh, &table, t[0], t[1]);
        const uint32_t bc = shared_midpoint(mesh, &table, t[1], t[2]);
        const uint32_t ca = shared_midpoint(mesh, &table, t[2], t[0]);
        memcpy(mesh->indices + 3 * i, (const uint32_t[3]){ab, bc, ca}, sizeof t);
        scene_triangle(mesh, t[0], ab, ca);
        scene_triangle(mesh, ab, t[1], bc);
        scene_triangle(mesh, ca, bc, t[2]);
    }
    free(table.key);
    free(table.value);
}

/* Smooth noise: a few plane waves, so that it needs no table. */
static double waves(const double n[3]) {
    static const double k[5][3] = {
        {5, 3, -4}, {-7, 6, 2}, {11, -9, 8}, {-14, 17, 5}, {23, 12, -19}};
    double sum = 0;
    for (int i = 0; i < 5; i++) {
        sum += sin(k[i][0] * n[0] + k[i][1] * n[1] + k[i][2] * n[2] + i) / (i + 1);
    }
    return sum / 2.2833333333333333; /* 1 + 1/2 + ... + 1/5: stays within -1..1 */
}

void scene_icosphere(scene_mesh *mesh, const double centre[3], double radius, unsigned levels,
                     double displacement) {
    static const unsigned char face[20][3] = {
        {0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
        {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
        {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    const double g = (1 + sqrt(5)) / 2;
    const double corner[12][3] = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                                  {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                                  {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
    scene_mesh ball = {0};
    for (int i = 0; i < 12; i++) scene_vertex(&ball, corner[i][0], corner[i][1], corner[i][2]);
    for (int i = 0; i < 20; i++) scene_triangle(&ball, face[i][0], face[i][1], face[i][2]);
    for (unsigned level = 0; level < levels; level++) subdivide(&ball);
    for (size_t i = 0; i < ball.vertices; i++) {
        double *v = ball.xyz + 3 * i;
        const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        const double n[3] = {v[0] / length, v[1] / length, v[2] / length};
        const double r = radius * (1 + (displacement != 0 ? displacement * waves(n) : 0));
        for (int k = 0; k < 3; k++) v[k] = centre[k] + r * n[k];
    }
    scene_append(mesh, &ball);
    scene_free(&ball);
}

void scene_leaves(scene_mesh *mesh, unsigned count, uint64_t seed) {
    /* The crown is as dense whatever the count: the area of all leaves is the same. */
    const double size = 2.2 / sqrt(count);
    for (unsigned i = 0; i < count; i++) {
        double at[3], r[9];
        scene_direction(&seed, at);
        const double out = cbrt(scene_uniform(&seed, 0, 1));
        scene_rotation(&seed, r);
        double c[4][3];
        for (int k = 0; k < 4; k++) {
            const double s = k == 0 || k == 3 ? -size : size, t = k < 2 ? -size / 2 : size / 2;
            for (int a = 0; a < 3; a++) {
                c[k][a] = out * at[a] + (a == 2 ? 1.5 : 0) + s * r[3 * a] + t * r[3 * a + 1];
            }
        }
        scene_quad(mesh, (const double(*)[3])c);
    }
}

/* Its faces are corners alone, or corners with what follows a slash. */
bool scene_bunny(scene_mesh *mesh) {
    FILE *file = fopen("/usr/share/glmark2/models/bunny.obj", "r");
    char line[256];
    double v[3];
    unsigned a, b, c;
    while (file && fgets(line, sizeof line, file)) {
        if (sscanf(line, "v %lf %lf %lf", &v[0], &v[1], &v[2]) == 3)
            scene_vertex(mesh, v[0], -v[2], v[1]);
        else if (sscanf(line, "f %u%*[^ ] %u%*[^ ] %u", &a, &b, &c) == 3 ||
                 sscanf(line, "f %u %u %u", &a, &b, &c) == 3)
            scene_triangle(mesh, a - 1, b - 1, c - 1);
    }
    if (file) fclose(file);
    return mesh->triangles > 0;
}

void scene_append(scene_mesh *mesh, const scene_mesh *more) {
    const uint32_t base = (uint32_t)mesh->vertices;
    for (size_t i = 0; i < more->vertices; i++) {
        scene_vertex(mesh, more->xyz[3 * i], more->xyz[3 * i + 1], more->xyz[3 * i + 2]);
    }
    for (size_t i = 0; i < more->triangles; i++) {
        const uint32_t *t = more->indices + 3 * i;
        scene_triangle(mesh, base + t[0], base + t[1], base + t[2]);
    }
}

scene_mesh scene_copy(const scene_mesh *mesh) {
    scene_mesh out = {0};
    scene_append(&out, mesh);
    return out;
}

void scene_transform(scene_mesh *mesh, const double m[12]) {
    for (size_t i = 0; i < mesh->vertices; i++) {
        double *v = mesh->xyz + 3 * i, w[3];
        for (int k = 0; k < 3; k++) {
            w[k] = m[4 * k] * v[0] + m[4 * k + 1] * v[1] + m[4 * k + 2] * v[2] + m[4 * k + 3];
        }
        memcpy(v, w, sizeof w);
    }
}

void scene_bounds(const scene_mesh *mesh, double low[3], double high[3]) {
    for (int k = 0; k < 3; k++) low[k] = INFINITY, high[k] = -INFINITY;
    for (size_t i = 0; i < 3 * mesh->vertices; i++) {
        low[i % 3] = fmin(low[i % 3], mesh->xyz[i]);
        high[i % 3] = fmax(high[i % 3], mesh->xyz[i]);
    }
}

void scene_shuffle(scene_mesh *mesh, uint64_t seed) {
    for (size_t i = mesh->triangles; i-- > 1;) {
        uint32_t *a = mesh->indices + 3 * i;
        uint32_t *b = mesh->indices + 3 * (scene_random(&seed) % (i + 1));
        const uint32_t turned[3] = {b[1], b[2], b[0]}, reversed[3] = {b[1], b[0], b[2]};
        const bool reverse = scene_random(&seed) % 3 == 0;
        memmove(b, a, 3 * sizeof *a);
        memcpy(a, reverse ? reversed : turned, 3 * sizeof *a);
    }
}

static uint32_t garbage_vertex(scene_mesh *mesh, uint64_t *state) {
    const double x = scene_uniform(state, -2, 2), y = scene_uniform(state, -2, 2);
    return scene_vertex(mesh, x, y, scene_uniform(state, 1, 4));
}

void scene_garbage(scene_mesh *mesh, uint64_t seed) {
    uint64_t s = seed * 7919 + 1;
    uint32_t v[12];
    for (int i = 0; i < 12; i++) v[i] = garbage_vertex(mesh, &s);
    const unsigned soup = 3 + (unsigned)(scene_random(&s) % 6);
    for (unsigned i = 0; i < soup; i++) { /* shares vertices: open and non-manifold at once */
        const uint32_t a = v[scene_random(&s) % 12], b = v[scene_random(&s) % 12];
        scene_triangle(mesh, a, b, v[scene_random(&s) % 12]); /* at times degenerate */
    }
    scene_triangle(mesh, v[0], v[1], v[2]); /* three on one edge, one of them flipped */
    scene_triangle(mesh, v[0], v[1], v[3]);
    scene_triangle(mesh, v[0], v[1], v[4]);
    scene_triangle(mesh, v[1], v[0], v[3]); /* the same once more, reversed */
    scene_triangle(mesh, v[0], v[1], v[2]); /* and a duplicate */
    scene_triangle(mesh, v[5], v[5], v[6]); /* no area */
    const double *p = mesh->xyz + 3 * (size_t)v[7];
    const uint32_t near = scene_vertex(mesh, p[0] + 1e-6, p[1], p[2]);
    scene_triangle(mesh, v[7], near, v[8]); /* a needle 1e-6 wide */
    if (scene_random(&s) % 2) {
        const double c[3] = {scene_uniform(&s, -1.5, 1), scene_uniform(&s, -1.5, 1),
                             scene_uniform(&s, 1, 3)};
        const double side = scene_uniform(&s, 0.2, 0.5);
        scene_box(mesh, c, (const double[3]){c[0] + side, c[1] + side, c[2] + side});
    }
}

/* ---- Lights and points ----------------------------------------------------------------------*/

softshadow_light scene_sphere_light(double x, double y, double z, double radius) {
    softshadow_light light = SOFTSHADOW_LIGHT_INIT;
    light.type = SOFTSHADOW_SPHERE;
    light.position[0] = x, light.position[1] = y, light.position[2] = z;
    light.radius = radius;
    return light;
}

softshadow_light scene_disk_light(double x, double y, double z, double nx, double ny, double nz,
                                  double radius) {
    softshadow_light light = scene_sphere_light(x, y, z, radius);
    light.type = SOFTSHADOW_DISK;
    light.direction[0] = nx, light.direction[1] = ny, light.direction[2] = nz;
    return light;
}

softshadow_light scene_rect_light(double x, double y, double z, double a, double b) {
    softshadow_light light = scene_sphere_light(x, y, z, 0);
    light.type = SOFTSHADOW_RECT;
    light.u[0] = -a, light.v[1] = b; /* u x v = -z */
    return light;
}

softshadow_light scene_sun_light(double dx, double dy, double dz, double angle) {
    softshadow_light light = SOFTSHADOW_LIGHT_INIT;
    light.type = SOFTSHADOW_SUN;
    light.direction[0] = dx, light.direction[1] = dy, light.direction[2] = dz;
    light.radius = angle;
    return light;
}

void scene_grid(double (*points)[3], size_t n, double x0, double x1, double y0, double y1,
                double height) {
    for (size_t i = 0; i < n * n; i++) {
        points[i][0] = x0 + (x1 - x0) * ((double)(i % n) + 0.5) / (double)n;
        points[i][1] = y0 + (y1 - y0) * ((double)(i / n) + 0.5) / (double)n;
        points[i][2] = height;
    }
}
