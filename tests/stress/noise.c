/* Numbers that are only bits. Points of random bits, NaN, infinite, denormal and huge ones among
 * them: each is answered with NaN where it is none, else with a fraction. Meshes of random bits, as
 * far as they are finite and indices are in range, under lamps anywhere: built and asked by every
 * method.
 *
 * based on: Embree's tests with 20,000 garbage meshes and with rays that are NaN or infinite.
 *
 * noise [POINTS [MESHES [FIRST]]]: so many points and meshes for each method; the number of the
 * first mesh, which is all that makes it. */
#include "ask.h"

enum { BATCH = 2000, FEW = 12, VERTICES = 20, TRIANGLES = 30, RESOLUTION = 32 };

static uint64_t points_wanted = 50000, meshes_wanted = 300, first_mesh;

/* ---- Bits -------------------------------------------------------------------------------------------- */

typedef enum kind { BITS, DENORMAL, HUGE_ONE, SCENE } kind;

static kind any_kind(uint64_t *random) {
    const uint64_t die = scene_random(random) % 16;
    return die < 3 ? BITS : die == 3 ? DENORMAL : die == 4 ? HUGE_ONE : SCENE;
}

/* Of floats as any bits 3 in 10 are no coordinate, of doubles half. */
static double any_number(uint64_t *random, kind what, bool single) {
    const uint64_t bits = scene_random(random);
    const uint32_t low = (uint32_t)bits & (what == DENORMAL ? 0x807fffff : 0xffffffff);
    const uint64_t all = bits & (what == DENORMAL ? 0x800fffffffffffff : UINT64_MAX);
    double wide;
    float narrow;
    memcpy(&wide, &all, sizeof wide), memcpy(&narrow, &low, sizeof narrow);
    if (what == BITS || what == DENORMAL) return single ? (double)narrow : wide;
    const double x = what == HUGE_ONE ? pow(10, scene_uniform(random, 8, 15.1))
                                      : scene_uniform(random, -3, 3);
    return bits & 1 ? x : -x;
}

static bool is_coordinate(double x) { return fabs(x) <= 1e15; }

/* Until it is one. */
static double coordinate(uint64_t *random, kind what, bool single) {
    double x;
    do {
        x = any_number(random, what, single);
        if (single) x = (float)x;
    } while (!is_coordinate(x));
    return x;
}

/* ---- Points ------------------------------------------------------------------------------------------- */

typedef struct batch {
    float single[BATCH][3], normal[BATCH][3], visibility[BATCH], bound[BATCH];
    double wide[BATCH][3];
    uint32_t ids[BATCH];
    uint64_t primitives[BATCH];
    bool bad[BATCH];
} batch;

static void fill(batch *b, uint64_t *random, bool single, size_t triangles) {
    for (size_t i = 0; i < BATCH; i++) {
        b->bad[i] = false;
        for (int k = 0; k < 3; k++) {
            const double x = any_number(random, any_kind(random), single);
            b->wide[i][k] = x, b->single[i][k] = (float)x;
            b->bad[i] |= !is_coordinate(single ? (double)b->single[i][k] : x);
            b->normal[i][k] = (float)any_number(random, any_kind(random), true);
        }
        b->ids[i] = (uint32_t)scene_random(random);
        b->primitives[i] = scene_random(random) % 4 ? SOFTSHADOW_NO_PRIMITIVE
                                                    : scene_random(random) % triangles;
    }
}

/* extra: normals, primitives, ids and bounds, by bits. */
static void ask_bits(softshadow *handle, batch *b, bool single, unsigned extra) {
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    points.position_type = single ? SOFTSHADOW_F32 : SOFTSHADOW_F64;
    points.positions = single ? (const void *)b->single : b->wide, points.count = BATCH;
    points.normals = extra & 1 ? b->normal[0] : NULL;
    points.primitives = extra & 2 ? b->primitives : NULL;
    points.ids = extra & 4 ? b->ids : NULL, points.error_bound = extra & 8 ? b->bound : NULL;
    OK(handle, softshadow_query_visibility(handle, &points, b->visibility));
    for (size_t i = 0; i < BATCH; i++) {
        const float *n = b->normal[i], v = b->visibility[i];
        const bool bad =
            b->bad[i] || (extra & 1 && !(isfinite(n[0]) && isfinite(n[1]) && isfinite(n[2])));
        CHECK(bad ? isnan(v) : v >= 0 && v <= 1, "%s %a %a %a, normal %a %a %a, extra %u: %g",
              single ? "floats" : "doubles", b->wide[i][0], b->wide[i][1], b->wide[i][2],
              (double)n[0], (double)n[1], (double)n[2], extra, (double)v);
        CHECK(!(extra & 8) || isnan(b->bound[i]) || b->bound[i] >= 0, "bound %g",
              (double)b->bound[i]);
    }
}

static void points_of_bits(void **state) {
    static batch b;
    scene_mesh mesh = {0};
    scene_garbage(&mesh, 5);
    scene_icosphere(&mesh, (const double[3]){0, 0, 1}, .8, 2, .1);
    ask q = ask_new(*state, &mesh, scene_sphere_light(.4, -.3, 6, .9), NULL, 0, 16);
    q.build.resolution = RESOLUTION;
    softshadow *handle = ask_handle(&q);
    uint64_t random = 77, asked = 0;
    for (unsigned extra = 0; asked < points_wanted; extra++, asked += BATCH) {
        const bool single = extra / 16 % 2;
        fill(&b, &random, single, mesh.triangles);
        ask_bits(handle, &b, single, extra % 16);
    }
    softshadow_destroy(handle);
    scene_free(&mesh);
}

/* ---- Meshes ------------------------------------------------------------------------------------------- */

/* All of one kind or of any; some vertices twice; indices in range, often of few vertices. */
static void make_garbage(scene_mesh *mesh, uint64_t *random, bool single) {
    const bool mixed = scene_random(random) % 2;
    const kind one = any_kind(random);
    const uint32_t vertices = 1 + (uint32_t)(scene_random(random) % VERTICES),
                   triangles = 1 + (uint32_t)(scene_random(random) % TRIANGLES);
    for (uint32_t i = 0; i < vertices; i++) {
        double at[3];
        for (int k = 0; k < 3; k++) {
            at[k] = coordinate(random, mixed ? any_kind(random) : one, single);
            if (i && scene_random(random) % 8 == 0) at[k] = mesh->xyz[3 * (i - 1) + (uint32_t)k];
        }
        scene_vertex(mesh, at[0], at[1], at[2]);
    }
    const uint32_t used = scene_random(random) % 4 ? vertices : 1 + vertices / 4;
    for (uint32_t i = 0; i < triangles; i++) {
        uint32_t v[3];
        for (int k = 0; k < 3; k++) v[k] = (uint32_t)(scene_random(random) % used);
        scene_triangle(mesh, v[0], v[1], v[2]);
    }
}

static softshadow_light make_lamp(uint64_t *random) {
    const kind what = any_kind(random);
    double at[3], radius = fabs(coordinate(random, any_kind(random), false));
    for (int k = 0; k < 3; k++) at[k] = coordinate(random, what, false);
    const double x = scene_uniform(random, -1, 1), y = scene_uniform(random, -1, 1);
    switch (scene_random(random) % 4) {
    case 0: return scene_disk_light(at[0], at[1], at[2], x, y, .5, radius);
    case 1: return scene_sun_light(x, y, -.5, fmin(radius, 1.3));
    case 2: return scene_rect_light(at[0], at[1], at[2], fmax(radius, 1e-9), fmax(radius, 1e-9));
    default: return scene_sphere_light(at[0], at[1], at[2], scene_random(random) % 4 ? radius : 0);
    }
}

/* What a host could be told of such a scene: its answers, or why there are none. */
static bool is_refusal(softshadow_status status) {
    return status == SOFTSHADOW_E_UNSUPPORTED || status == SOFTSHADOW_E_LIGHT;
}

static void ask_garbage(softshadow *handle, const scene_mesh *mesh, uint64_t number,
                        uint64_t *random) {
    double points[FEW][3];
    float visibility[FEW];
    for (size_t i = 0; i < FEW; i++) {
        const kind what = any_kind(random);
        const double *near = mesh->xyz + 3 * (scene_random(random) % mesh->vertices);
        for (int k = 0; k < 3; k++) points[i][k] = i % 2 ? near[k] : coordinate(random, what, false);
    }
    const softshadow_points given = ask_points((const double(*)[3])points, FEW);
    OK(handle, softshadow_query_visibility(handle, &given, visibility));
    for (size_t i = 0; i < FEW; i++) {
        CHECK(visibility[i] >= 0 && visibility[i] <= 1, "mesh %llu, point %zu: %a %a %a: %g",
              (unsigned long long)number, i, points[i][0], points[i][1], points[i][2],
              (double)visibility[i]);
    }
}

/* Whether it was built and asked. */
static bool try_mesh(const char *method, uint64_t number) {
    uint64_t random = 2 * number + 1;
    scene_mesh mesh = {0};
    const bool single = scene_random(&random) % 2;
    make_garbage(&mesh, &random, single);
    ask q = ask_new(method, NULL, make_lamp(&random), NULL, 0, 16);
    softshadow *handle = NULL;
    const softshadow_mesh given = ask_mesh(&mesh);
    q.build.method = method, q.build.resolution = RESOLUTION;
    OK(NULL, softshadow_create(&handle, NULL));
    OK(handle, softshadow_add_mesh(handle, &given, NULL));
    softshadow_status status = softshadow_set_light(handle, &q.light);
    if (!status) status = softshadow_build_maps(handle, &q.build);
    CHECK(!status || is_refusal(status), "mesh %llu: %s", (unsigned long long)number,
          softshadow_last_message(handle));
    if (!status) ask_garbage(handle, &mesh, number, &random);
    softshadow_destroy(handle);
    scene_free(&mesh);
    return !status;
}

static void meshes_of_bits(void **state) {
    uint64_t built = 0;
    for (uint64_t i = 0; i < meshes_wanted; i++) built += try_mesh(*state, first_mesh + i);
    print_message("           %llu of %llu meshes were built\n", (unsigned long long)built,
                  (unsigned long long)meshes_wanted);
    CHECK(2 * built >= meshes_wanted, "no more than %llu were not refused",
          (unsigned long long)built);
}

int main(int argc, char **argv) {
    if (argc > 1) points_wanted = strtoull(argv[1], NULL, 10);
    if (argc > 2) meshes_wanted = strtoull(argv[2], NULL, 10);
    if (argc > 3) first_mesh = strtoull(argv[3], NULL, 10);
    const ask_test tests[] = {{"points of bits", points_of_bits, NULL},
                              {"meshes of bits", meshes_of_bits, NULL}};
    return ask_run("noise", tests, COUNT(tests));
}
