/* Where many points are ahead a map tells the lit ones before anything else is done, for small batches
 * none is made: under `exact` that must not change a bit, whatever the casters, the light and the
 * points. */
#include "property/truth.h"

enum { N = 3 << 14, PART = 1 << 12, SCENES = 24, AHEAD = 1 << 24 };

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

/* A third on the ground, a third anywhere, far away and behind the light too, and a third on the
 * casters, or off them by less than a float can tell. */
static void make_points(int scene, const scene_mesh *mesh, double (*points)[3]) {
    uint64_t s = (uint64_t)scene + 77;
    for (int i = 0; i < N; i++) {
        const double reach = i % 16 == 1 ? 100 : 3;
        for (int k = 0; k < 3; k++) points[i][k] = scene_uniform(&s, -reach, reach);
        if (i % 3 == 0) points[i][2] = 0;
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

static uint64_t settled(softshadow *handle) {
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    OK(handle, softshadow_get_stats(handle, &stats));
    CHECK(stats.points_lit + stats.points_umbra + stats.points_penumbra == stats.points,
          "counts do not add up");
    return stats.points_settled;
}

static void check_type(ask *question, bool floats, const char *what, uint64_t *told) {
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
    const uint64_t before = settled(without), after = settled(with);
    *told += after > before ? after - before : 0;
    ask_same_bits(whole, parts, N, what);
    softshadow_destroy(with), softshadow_destroy(without);
    free(narrow), free(whole), free(parts);
}

static void batches_of_any_size(void **state) {
    (void)state;
    uint64_t told = 0;
    double(*points)[3] = malloc(N * sizeof *points);
    for (int scene = 0; scene < SCENES; scene++) {
        scene_mesh mesh = {0};
        make_mesh(scene, &mesh);
        softshadow_light light = light_of(scene);
        make_points(scene, &mesh, points);
        if (scene >= SCENES / 2) move_all(&mesh, &light, points);
        for (int floats = 0; floats < 2; floats++) {
            char what[64];
            snprintf(what, sizeof what, "scene %d, %s", scene, floats ? "floats" : "doubles");
            ask question =
                ask_new("exact", &mesh, light, (const double(*)[3])points, N, 256);
            check_type(&question, floats, what, &told);
        }
        scene_free(&mesh);
    }
    /* Not by chance the same: the map does tell of points that nothing else would settle. */
    CHECK(told > (uint64_t)N * SCENES / 8, "only %lu points were told first", (unsigned long)told);
    free(points);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(batches_of_any_size)};
    return cmocka_run_group_tests_name("lit points first", tests, NULL, NULL);
}
