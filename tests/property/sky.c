/* Where many points are ahead a map tells lit and dark ones before anything else is done, for small
 * batches none is made: under `exact` that must not change a bit, whatever the casters, the light
 * and the points. */
#include "property/truth.h"

enum { N = 3 << 14, PART = 1 << 12, SCENES = 24, SOLIDS = 8, AHEAD = 1 << 24 };

/* What a map of insides must tell apart: a ball over a floor, one within another and one turned
 * inside out, three that pierce each other, one with a face missing and a thin one. */
static void make_solid(int scene, scene_mesh *mesh) {
    const double middle[3] = {0, 0, 1}, beside[3] = {0.5, 0.25, 1.25}, above[3] = {-0.25, 0.5, 1.75};
    scene_mesh more = {0};
    scene_icosphere(mesh, middle, 0.9, 4, 0.1);
    if (scene % 4 == 0) scene_rect(mesh, -2, 2, -2, 2, 0);
    if (scene % 4 == 1) {
        scene_icosphere(&more, middle, 0.5, 3, 0);
        for (size_t t = 0; t < more.triangles && scene & 4; t++) {
            const uint32_t corner = more.indices[3 * t];
            more.indices[3 * t] = more.indices[3 * t + 1], more.indices[3 * t + 1] = corner;
        }
    }
    if (scene % 4 == 2) {
        scene_icosphere(&more, beside, 0.7, 4, 0.2);
        scene_append(mesh, &more);
        scene_free(&more);
        more = (scene_mesh){0};
        scene_icosphere(&more, above, 0.3, 3, 0);
    }
    if (scene % 4 == 3) {
        mesh->triangles -= scene & 4 ? 1 : 0;
        const double flat[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0.05, 1};
        scene_icosphere(&more, beside, 0.8, 4, 0);
        scene_transform(&more, flat);
    }
    scene_append(mesh, &more);
    scene_free(&more);
}

/* Everything a mesh may do wrong; leaves; a box on a floor that casts; a steep face alone. */
static void make_mesh(int scene, scene_mesh *mesh) {
    const double low[3] = {-0.5, -0.25, 0}, high[3] = {0.5, 0.75, 1.25};
    switch (scene % 4) {
    case 0:
        scene_garbage(mesh, (uint64_t)scene + 1);
        break;
    case 1:
        scene_leaves(mesh, 200, (uint64_t)scene + 1);
        break;
    case 2:
        scene_rect(mesh, -2, 2, -2, 2, 0);
        scene_box(mesh, low, high);
        break;
    default:
        scene_triangle(mesh, scene_vertex(mesh, -1, -0.75, 0.3), scene_vertex(mesh, 1.25, -0.5, 0.9),
                       scene_vertex(mesh, 0.1, 1, 1.7));
    }
}

static softshadow_light light_of(int scene) {
    const softshadow_light lights[] = {
        scene_sphere_light(1.5, -1, 6, 0.9),  scene_disk_light(-2, 0.5, 5, 0.4, 0.1, -1, 1),
        scene_sun_light(-0.4, 0.3, -1, 0.12), scene_rect_light(0.5, 1, 6.5, 1.5, 0.5),
        scene_sphere_light(0.5, 4.5, 2, 1.4), scene_disk_light(0, 0, 30, 0, 0, -1, 0.01),
        scene_sun_light(1, 0.2, -0.5, 0.5),   scene_sphere_light(4e4, 1e4, 5e4, 2e3),
    };
    return lights[(size_t)(scene / 4 + scene) % COUNT(lights)];
}

/* Where a shadow, or all of it, begins: behind a face that the light's rim grazes. */
static void graze(const scene_mesh *mesh, const softshadow_light *light, uint64_t *s, double p[3]) {
    const bool sun = light->type == SOFTSHADOW_SUN;
    for (int turn = 0; turn < 100; turn++) {
        double at[3], to[3], off[3], e[3], f[3], n[3], along = 0, length = 0, size = 0, way = 0;
        const uint32_t *v = mesh->indices + 3 * (scene_random(s) % mesh->triangles);
        const double *a = mesh->xyz + 3 * v[0], *b = mesh->xyz + 3 * v[1], *c = mesh->xyz + 3 * v[2];
        scene_direction(s, off);
        for (int k = 0; k < 3; k++) way += light->direction[k] * light->direction[k];
        for (int k = 0; k < 3; k++) {
            e[k] = b[k] - a[k], f[k] = c[k] - a[k], at[k] = (a[k] + b[k] + c[k]) / 3;
            to[k] = sun ? -light->direction[k] / sqrt(way) + off[k] * tan(light->radius)
                        : light->position[k] + off[k] * light->radius - at[k];
        }
        for (int k = 0; k < 3; k++) {
            n[k] = e[(k + 1) % 3] * f[(k + 2) % 3] - e[(k + 2) % 3] * f[(k + 1) % 3];
            along += n[k] * to[k], length += to[k] * to[k], size += n[k] * n[k];
        }
        if (along * along > 0.01 * length * size) continue;
        const double far = scene_uniform(s, 0, 2) / sqrt(length);
        for (int k = 0; k < 3; k++) p[k] = at[k] - far * to[k];
        return;
    }
}

/* A third on the ground, a third anywhere, far away and behind the light too or where shadows
 * begin, and a third on the casters, or off them by less than a float can tell. */
static void make_points(int scene, const scene_mesh *mesh, const softshadow_light *light,
                        double (*points)[3]) {
    uint64_t s = (uint64_t)scene + 77;
    for (int i = 0; i < N; i++) {
        const double reach = i % 16 == 1 ? 100 : 3;
        for (int k = 0; k < 3; k++) points[i][k] = scene_uniform(&s, -reach, reach);
        if (i % 3 == 0) points[i][2] = 0;
        if (i % 3 == 1 && i % 4) graze(mesh, light, &s, points[i]);
        if (i % 3 < 2) continue;
        const size_t t = scene_random(&s) % mesh->triangles;
        double u = scene_uniform(&s, 0, 1), v = scene_uniform(&s, 0, 1);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        for (int k = 0; k < 3; k++) {
            const double *corner[3];
            for (int c = 0; c < 3; c++) corner[c] = mesh->xyz + 3 * mesh->indices[3 * t + c];
            points[i][k] = corner[0][k] + u * (corner[1][k] - corner[0][k]) +
                           v * (corner[2][k] - corner[0][k]);
            if (i % 4 == 1) points[i][k] = (float)points[i][k];
            if (i % 4 == 2) points[i][k] += scene_uniform(&s, -1e-7, 1e-7);
            if (i % 4 == 3) points[i][k] += scene_uniform(&s, -1e-3, 1e-3);
        }
    }
}

/* Half of the scenes far from the host's origin, where floats are coarser. */
static void move_all(scene_mesh *mesh, softshadow_light *light, double (*points)[3]) {
    const double to[3] = {30, -20, 10};
    const double matrix[12] = {1, 0, 0, to[0], 0, 1, 0, to[1], 0, 0, 1, to[2]};
    scene_transform(mesh, matrix);
    for (int k = 0; k < 3; k++) light->position[k] += to[k];
    for (int i = 0; i < N; i++)
        for (int k = 0; k < 3; k++) points[i][k] += to[k];
}

/* The same points as floats, as most hosts have them. */
static void query(softshadow *handle, const void *at, bool floats, size_t count, float *out) {
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    points.positions = at, points.count = count;
    points.position_type = floats ? SOFTSHADOW_F32 : SOFTSHADOW_F64;
    points.position_stride = floats ? 3 * sizeof(float) : 3 * sizeof(double);
    OK(handle, softshadow_query_visibility(handle, &points, out));
}

/* How many points were told before anything was drawn, and of these at least how many are dark. */
typedef struct tally {
    uint64_t all, dark;
} tally;

static uint64_t settled(softshadow *handle, tally *sum) {
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    OK(handle, softshadow_get_stats(handle, &stats));
    CHECK(stats.points_lit + stats.points_umbra + stats.points_penumbra == stats.points,
          "counts do not add up");
    if (stats.points_settled > stats.points_lit)
        sum->dark += stats.points_settled - stats.points_lit;
    return stats.points_settled;
}

static void check_type(ask *question, bool floats, const char *what, tally *told) {
    float *narrow = malloc(3 * N * sizeof *narrow), *whole = malloc(N * sizeof *whole),
          *parts = malloc(N * sizeof *parts);
    for (int i = 0; i < 3 * N; i++) narrow[i] = (float)question->points[i / 3][i % 3];
    const char *at = floats ? (const char *)narrow : (const char *)question->points;
    const size_t stride = floats ? 3 * sizeof(float) : 3 * sizeof(double);
    softshadow *without = ask_handle(question);
    for (size_t i = 0; i < N; i += PART) {
        query(without, at + i * stride, floats, PART, parts + i);
    }
    question->build.points_ahead = AHEAD;
    softshadow *with = ask_handle(question);
    query(with, at, floats, N, whole);
    const uint64_t before = settled(without, told), after = settled(with, told);
    told->all += after > before ? after - before : 0;
    ask_same_bits(whole, parts, N, what);
    softshadow_destroy(with), softshadow_destroy(without);
    free(narrow), free(whole), free(parts);
}

static void check_scene(int scene, bool solid, tally *told) {
    double(*points)[3] = malloc(N * sizeof *points);
    scene_mesh mesh = {0};
    (solid ? make_solid : make_mesh)(scene, &mesh);
    softshadow_light light = light_of(scene);
    if (solid && light.type != SOFTSHADOW_RECT) light.radius *= 0.01; /* what a texel is off by shows */
    make_points(scene, &mesh, &light, points);
    if (scene >= (solid ? SOLIDS : SCENES) / 2) move_all(&mesh, &light, points);
    for (int floats = 0; floats < 2; floats++) {
        char what[64];
        snprintf(what, sizeof what, "%s %d, %s", solid ? "solid" : "scene", scene,
                 floats ? "floats" : "doubles");
        ask question = ask_new("exact", &mesh, light, (const double(*)[3])points, N, 256);
        check_type(&question, floats, what, told);
    }
    scene_free(&mesh);
    free(points);
}

/* In the end: not by chance the same, for the map does tell of points that nothing else would
 * settle. */
static void batches_of_any_size(void **state) {
    (void)state;
    tally told = {0};
    for (int scene = 0; scene < SCENES; scene++) check_scene(scene, false, &told);
    CHECK(told.all > (uint64_t)N * SCENES / 16, "only %lu points were told first",
          (unsigned long)told.all);
}

static void dark_in_solids(void **state) {
    (void)state;
    tally told = {0};
    for (int scene = 0; scene < SOLIDS; scene++) check_scene(scene, true, &told);
    CHECK(told.dark > (uint64_t)N * SOLIDS / 32, "only %lu dark points were told first",
          (unsigned long)told.dark);
}

/* A cup under a small sun, its wall leaning out by a third of a texel a bin, and points just
 * outside the wall, under the rim: they see some of the sun past a place of the wall that a map of
 * insides must not take to be inside, in a texel that the wall passes through. */
enum { CUP = 600 };

static void make_cup(scene_mesh *mesh, double inwards) {
    const uint32_t top = scene_vertex(mesh, 0, 0, 1), bottom = scene_vertex(mesh, 0, 0, -1);
    for (uint32_t i = 0; i < CUP; i++) {
        const double turn = 2 * 3.14159265358979 * i / CUP, low = 1 - inwards;
        scene_vertex(mesh, cos(turn), sin(turn), 1);
        scene_vertex(mesh, low * cos(turn), low * sin(turn), -1);
    }
    for (uint32_t i = 0; i < CUP; i++) {
        const uint32_t a = 2 + 2 * i, b = 2 + 2 * ((i + 1) % CUP);
        scene_triangle(mesh, top, a, b), scene_triangle(mesh, bottom, b + 1, a + 1);
        scene_triangle(mesh, a, a + 1, b), scene_triangle(mesh, b, a + 1, b + 1);
    }
}

static void under_a_rim(void **state) {
    (void)state;
    double(*points)[3] = malloc(N * sizeof *points);
    tally told = {0};
    uint64_t s = 5;
    for (int i = 0; i < 4; i++) {
        scene_mesh mesh = {0};
        const double inwards = scene_uniform(&s, 0.045, 0.065);
        make_cup(&mesh, inwards);
        for (int j = 0; j < N; j++) {
            const double turn = scene_uniform(&s, 0, 6.2832), z = 1 - scene_uniform(&s, 0.1, 0.125),
                         rim = 1 - inwards * (1 - z) / 2, far = rim + scene_uniform(&s, -1e-4, 1e-3);
            points[j][0] = far * cos(turn), points[j][1] = far * sin(turn), points[j][2] = z;
        }
        const softshadow_light light = scene_sun_light(0, 0, -1, scene_uniform(&s, 0.03, 0.04));
        ask question = ask_new("exact", &mesh, light, (const double(*)[3])points, N, 256);
        check_type(&question, false, "under a rim", &told);
        scene_free(&mesh);
    }
    free(points);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(batches_of_any_size),
                                       cmocka_unit_test(dark_in_solids),
                                       cmocka_unit_test(under_a_rim)};
    return cmocka_run_group_tests_name("lit and dark points first", tests, NULL, NULL);
}
