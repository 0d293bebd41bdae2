/* Every argument that can be wrong, wrong: the status is the one promised, the message names what
 * it was, outputs are set, and the handle answers as before. */
#define _GNU_SOURCE /* memfd_create */
#include <sys/mman.h>
#include <unistd.h>

#include "ask.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))

/* A call that has to fail with that status and a message that contains `text`. */
#define REFUSED(handle, status, text, call)                                                        \
    do {                                                                                           \
        const softshadow_status got_ = (call);                                                     \
        CHECK(got_ == (status), "%s: \"%s\"", softshadow_status_name(got_),                        \
              softshadow_last_message(handle));                                                    \
        CHECK(strstr(softshadow_last_message(handle), text), "message \"%s\" lacks \"%s\"",        \
              softshadow_last_message(handle), text);                                              \
    } while (0)

enum { N = 16 };

/* A built handle with one mesh and one light, and what it answers. */
typedef struct fixture {
    softshadow *handle;
    scene_mesh mesh;
    softshadow_light light;
    double points[N][3];
    float visibility[N];
    softshadow_points batch;
} fixture;

static fixture f;

static int set_up(void **state) {
    (void)state;
    memset(&f, 0, sizeof f);
    scene_rect(&f.mesh, -1, 1, -1, 1, 2);
    scene_grid(f.points, 4, -1.5, 1.5, -1.5, 1.5, 0);
    f.light = scene_sphere_light(0, 0, 6, 1);
    OK(NULL, softshadow_create(&f.handle, NULL));
    const softshadow_mesh mesh = ask_mesh(&f.mesh);
    OK(f.handle, softshadow_add_mesh(f.handle, &mesh, NULL));
    OK(f.handle, softshadow_set_light(f.handle, &f.light));
    OK(f.handle, softshadow_build_maps(f.handle, NULL));
    f.batch = ask_points((const double(*)[3])f.points, N);
    OK(f.handle, softshadow_query_visibility(f.handle, &f.batch, f.visibility));
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    softshadow_destroy(f.handle);
    scene_free(&f.mesh);
    return 0;
}

/* Whatever was refused, nothing changed: no new build is needed, and the bits are the same. */
static void unharmed(void) {
    float now[N];
    OK(f.handle, softshadow_query_visibility(f.handle, &f.batch, now));
    ask_same_bits(f.visibility, now, N, "after a refused call");
}

static bool all_nan(const float *v, size_t n) {
    for (size_t i = 0; i < n; i++) {
        if (!isnan(v[i])) return false;
    }
    return true;
}

/* ---- NULL
 * ---------------------------------------------------------------------------------------*/

static void null_handles(void **state) {
    (void)state;
    const softshadow_mesh mesh = ask_mesh(&f.mesh);
    softshadow_error error = SOFTSHADOW_ERROR_INIT;
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    softshadow_map map = SOFTSHADOW_MAP_INIT;
    softshadow_mesh_report report = SOFTSHADOW_MESH_REPORT_INIT;
    softshadow_explanation explanation = SOFTSHADOW_EXPLANATION_INIT;
    uint32_t number = 7;
    float v[N] = {0};
    const softshadow_status no = SOFTSHADOW_E_ARGUMENT;
    REFUSED(NULL, no, "handle", softshadow_add_mesh(NULL, &mesh, &number));
    CHECK(number == UINT32_MAX, "mesh_id %u", number);
    REFUSED(NULL, no, "handle", softshadow_update_mesh(NULL, 0, &mesh));
    REFUSED(NULL, no, "handle", softshadow_remove_mesh(NULL, 0));
    REFUSED(NULL, no, "handle", softshadow_set_light(NULL, &f.light));
    number = 7;
    REFUSED(NULL, no, "handle", softshadow_add_light(NULL, &f.light, &number));
    CHECK(number == UINT32_MAX, "light_id %u", number);
    REFUSED(NULL, no, "handle", softshadow_build_maps(NULL, NULL));
    REFUSED(NULL, no, "handle", softshadow_query_visibility(NULL, &f.batch, v));
    CHECK(all_nan(v, N), "a failed batch is all NaN");
    REFUSED(NULL, no, "handle", softshadow_measure_error(NULL, &f.batch, &error));
    REFUSED(NULL, no, "handle", softshadow_get_stats(NULL, &stats));
    REFUSED(NULL, no, "handle", softshadow_map_count(NULL, &number));
    REFUSED(NULL, no, "handle", softshadow_get_map(NULL, 0, &map));
    REFUSED(NULL, no, "handle", softshadow_mesh_info(NULL, 0, &report));
    REFUSED(NULL, no, "handle", softshadow_explain(NULL, &explanation));
    softshadow_destroy(NULL);
    CHECK(softshadow_last_message(NULL) != NULL, "never NULL");
}

static void null_arguments(void **state) {
    (void)state;
    softshadow *h = f.handle;
    float v[N];
    uint32_t id = 7;
    const softshadow_status no = SOFTSHADOW_E_ARGUMENT;
    REFUSED(NULL, no, "out", softshadow_create(NULL, NULL));
    REFUSED(h, no, "mesh", softshadow_add_mesh(h, NULL, &id));
    CHECK(id == UINT32_MAX, "mesh_id %u", id);
    REFUSED(h, no, "mesh", softshadow_update_mesh(h, 0, NULL));
    REFUSED(h, no, "light", softshadow_set_light(h, NULL));
    REFUSED(h, no, "light", softshadow_add_light(h, NULL, &id));
    REFUSED(h, no, "points", softshadow_query_visibility(h, NULL, v));
    REFUSED(h, no, "visibility", softshadow_query_visibility(h, &f.batch, NULL));
    REFUSED(h, no, "error", softshadow_measure_error(h, &f.batch, NULL));
    softshadow_error error = SOFTSHADOW_ERROR_INIT;
    REFUSED(h, no, "points", softshadow_measure_error(h, NULL, &error));
    REFUSED(h, no, "stats", softshadow_get_stats(h, NULL));
    REFUSED(h, no, "count", softshadow_map_count(h, NULL));
    CHECK(softshadow_get_map(h, 0, NULL) == no, "get_map");
    REFUSED(NULL, no, "count", softshadow_method_count(NULL));
    REFUSED(NULL, no, "method", softshadow_method_info(0, NULL));
    REFUSED(h, no, "report", softshadow_mesh_info(h, 0, NULL));
    REFUSED(h, no, "explanation", softshadow_explain(h, NULL));
    softshadow_points batch = f.batch;
    batch.positions = NULL;
    REFUSED(h, no, "positions", softshadow_query_visibility(h, &batch, v));
    CHECK(all_nan(v, N), "a failed batch is all NaN");
    softshadow_mesh mesh = ask_mesh(&f.mesh);
    mesh.positions = NULL;
    REFUSED(h, no, "positions", softshadow_add_mesh(h, &mesh, NULL));
    mesh = ask_mesh(&f.mesh);
    mesh.indices = NULL;
    REFUSED(h, no, "indices", softshadow_add_mesh(h, &mesh, NULL));
    unharmed();
}

/* What may be NULL, is. */
static void null_is_a_default(void **state) {
    (void)state;
    OK(f.handle, softshadow_add_light(f.handle, &f.light, NULL));
    const softshadow_mesh mesh = ask_mesh(NULL);
    OK(f.handle, softshadow_add_mesh(f.handle, &mesh, NULL));
    OK(f.handle, softshadow_build_maps(f.handle, NULL));
    softshadow_points none = ask_points(NULL, 0);
    OK(f.handle, softshadow_query_visibility(f.handle, &none, NULL));
}

/* ---- Sizes of structs
 * ---------------------------------------------------------------------------*/

/* A struct with a tail of 32 bytes that this library does not know. */
typedef union grown {
    uint32_t struct_size;
    softshadow_options options;
    softshadow_mesh mesh;
    softshadow_light light;
    softshadow_build build;
    softshadow_points points;
    softshadow_error error;
    softshadow_stats stats;
    softshadow_map map;
    softshadow_method method;
    softshadow_mesh_report report;
    softshadow_explanation explanation;
    unsigned char bytes[1024];
} grown;

enum { OPTIONS, MESH, LIGHT, BUILD, POINTS, ERROR, STATS, METHOD, REPORT, EXPLANATION, STRUCTS };

static uint32_t fill(grown *g, int which) {
    memset(g, 0, sizeof *g);
    switch (which) {
    case OPTIONS:
        g->options = (softshadow_options)SOFTSHADOW_OPTIONS_INIT;
        break;
    case MESH:
        g->mesh = ask_mesh(&f.mesh);
        break;
    case LIGHT:
        g->light = f.light;
        break;
    case BUILD:
        g->build = (softshadow_build)SOFTSHADOW_BUILD_INIT;
        break;
    case POINTS:
        g->points = f.batch;
        break;
    case ERROR:
        g->error = (softshadow_error)SOFTSHADOW_ERROR_INIT;
        g->error.samples = 64;
        break;
    case STATS:
        g->stats = (softshadow_stats)SOFTSHADOW_STATS_INIT;
        break;
    case METHOD:
        g->method = (softshadow_method)SOFTSHADOW_METHOD_INIT;
        break;
    case REPORT:
        g->report = (softshadow_mesh_report)SOFTSHADOW_MESH_REPORT_INIT;
        break;
    default:
        g->explanation = (softshadow_explanation)SOFTSHADOW_EXPLANATION_INIT;
        g->explanation.size = 8;
    }
    return g->struct_size;
}

static softshadow_status pass(grown *g, int which) {
    softshadow *other = NULL, *h = f.handle;
    float v[N];
    softshadow_status status;
    switch (which) {
    case OPTIONS:
        status = softshadow_create(&other, &g->options);
        CHECK((other != NULL) == (status == SOFTSHADOW_OK), "out is NULL on errors");
        softshadow_destroy(other);
        return status;
    case MESH:
        return softshadow_update_mesh(h, 0, &g->mesh);
    case LIGHT:
        return softshadow_set_light(h, &g->light);
    case BUILD:
        return softshadow_build_maps(h, &g->build);
    case POINTS:
        return softshadow_query_visibility(h, &g->points, v);
    case ERROR:
        return softshadow_measure_error(h, &f.batch, &g->error);
    case STATS:
        return softshadow_get_stats(h, &g->stats);
    case METHOD:
        return softshadow_method_info(0, &g->method);
    case REPORT:
        return softshadow_mesh_info(h, 0, &g->report);
    default:
        return softshadow_explain(h, &g->explanation);
    }
}

static void struct_sizes(void **state) {
    (void)state;
    static const char *const name[STRUCTS] = {"options", "mesh",       "light", "build",
                                              "points",  "error",      "stats", "method",
                                              "report",  "explanation"};
    for (int i = 0; i < STRUCTS; i++) {
        grown g;
        const uint32_t size = fill(&g, i);
        const size_t least = i == STATS   ? offsetof(softshadow_stats, depth_seconds)
                             : i == BUILD ? offsetof(softshadow_build, sub_lights)
                                          : size; /* in 1.0 */
        const uint32_t wrong[] = {0, 1, 3, 4, (uint32_t)least - 1, 4097, UINT32_MAX};
        const softshadow *owner = i == OPTIONS || i == METHOD ? NULL : f.handle;
        for (size_t k = 0; k < COUNT(wrong); k++) {
            fill(&g, i);
            g.struct_size = wrong[k];
            const softshadow_status status = pass(&g, i);
            CHECK(status == SOFTSHADOW_E_ARGUMENT, "%s of size %u: %s", name[i], wrong[k],
                  softshadow_status_name(status));
            CHECK(strstr(softshadow_last_message(owner), "struct_size"), "%s: \"%s\"", name[i],
                  softshadow_last_message(owner));
        }
        fill(&g, i);
        g.struct_size = size + 32;
        softshadow_status status = pass(&g, i);
        CHECK(status == SOFTSHADOW_OK, "%s with a zero tail: %s", name[i],
              softshadow_last_message(owner));
        CHECK(g.struct_size == size + 32, "%s: struct_size %u was changed", name[i], g.struct_size);
        for (uint32_t k = size; k < size + 32; k++) {
            CHECK(g.bytes[k] == 0, "%s: byte %u beyond what the library knows was written", name[i],
                  k);
        }
        /* What the library only writes has no tail to understand; what it reads has. */
        if (i == STATS || i == METHOD || i == REPORT) continue;
        fill(&g, i);
        g.struct_size = size + 32;
        g.bytes[size + 17] = 1;
        status = pass(&g, i);
        CHECK(status == SOFTSHADOW_E_ARGUMENT, "%s with a set tail: %s", name[i],
              softshadow_status_name(status));
        /* After set_light and update_mesh the handle is stale. */
        OK(f.handle, softshadow_build_maps(f.handle, NULL));
    }
    unharmed();
}

/* After an error no struct holds what could be taken for an answer. */
static void failed_structs(void **state) {
    (void)state;
    enum { SIDE = 3 };
    float image[SIDE * SIDE] = {0};
    uint64_t hider[SIDE * SIDE] = {0};
    softshadow_error error = SOFTSHADOW_ERROR_INIT;
    error.rms = error.max = error.p99 = error.mean = error.reference_error = 0.25;
    error.points = 7, error.max_points = 8, error.samples = 9;
    softshadow_points batch = f.batch;
    batch.light = 5;
    REFUSED(f.handle, SOFTSHADOW_E_ARGUMENT, "light",
            softshadow_measure_error(f.handle, &batch, &error));
    CHECK(isnan(error.rms) && isnan(error.max) && isnan(error.p99) && isnan(error.mean) &&
              isnan(error.reference_error) && error.points == 0,
          "rms %g of %llu points", error.rms, (unsigned long long)error.points);
    CHECK(error.max_points == 8 && error.samples == 9, "what was asked stays");
    error.samples = (1u << 24) + 1;
    REFUSED(f.handle, SOFTSHADOW_E_ARGUMENT, "error.samples: 16777217",
            softshadow_measure_error(f.handle, &f.batch, &error));
    softshadow_explanation explanation = SOFTSHADOW_EXPLANATION_INIT;
    explanation.size = SIDE, explanation.image = image, explanation.hider = hider;
    explanation.light = 5, explanation.visibility = 0.5f, explanation.triangles = 3;
    REFUSED(f.handle, SOFTSHADOW_E_ARGUMENT, "light",
            softshadow_explain(f.handle, &explanation));
    CHECK(isnan(explanation.visibility) && explanation.triangles == 0 && isnan(explanation.u[0]),
          "visibility %g", (double)explanation.visibility);
    CHECK(all_nan(image, SIDE * SIDE), "the image is NaN");
    for (int i = 0; i < SIDE * SIDE; i++) {
        CHECK(hider[i] == SOFTSHADOW_NO_PRIMITIVE, "pixel %d is hidden by a triangle", i);
    }
    softshadow_mesh_report report = SOFTSHADOW_MESH_REPORT_INIT;
    report.triangles = 7;
    REFUSED(f.handle, SOFTSHADOW_E_ARGUMENT, "mesh", softshadow_mesh_info(f.handle, 99, &report));
    CHECK(report.triangles == 0, "%llu triangles", (unsigned long long)report.triangles);
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    stats.points = 7;
    REFUSED(NULL, SOFTSHADOW_E_ARGUMENT, "handle", softshadow_get_stats(NULL, &stats));
    CHECK(stats.points == 0 && stats.method_used[0] == '\0', "stats are empty");
    unharmed();
}

/* The sizes of 1.0 are promises: programs have them compiled in. */
static void sizes_of_1_0(void **state) {
    (void)state;
    if (sizeof(void *) != 8) skip();
    CHECK(sizeof(softshadow_options) >= 40 && offsetof(softshadow_options, threads) == 4,
          "options");
    CHECK(sizeof(softshadow_points) >= offsetof(softshadow_points, error_bound) + 8, "points");
    CHECK(SOFTSHADOW_OK == 0 && SOFTSHADOW_E_ARGUMENT == -1 && SOFTSHADOW_E_STATE == -2 &&
              SOFTSHADOW_E_MESH == -3 && SOFTSHADOW_E_LIGHT == -4 && SOFTSHADOW_E_MEMORY == -5 &&
              SOFTSHADOW_E_UNSUPPORTED == -6 && SOFTSHADOW_E_CANCELLED == -7 &&
              SOFTSHADOW_E_BACKEND == -8 && SOFTSHADOW_E_INTERNAL == -9,
          "status numbers");
    CHECK(SOFTSHADOW_SPHERE == 0 && SOFTSHADOW_DISK == 1 && SOFTSHADOW_RECT == 2 &&
              SOFTSHADOW_SUN == 3,
          "light types");
    CHECK(SOFTSHADOW_CASTS == 1 && SOFTSHADOW_RECEIVES == 2 && SOFTSHADOW_BORROW == 4, "flags");
}

/* ---- Numbers
 * ------------------------------------------------------------------------------------*/

/* Room for `count` answers with little memory behind it: all but the last page are the same few
 * pages, again and again. */
enum { PAGE = 4096, SAME = 1 << 22 };

static float *wide_answers(size_t count, size_t *bytes) {
    const size_t whole = (count * sizeof(float) + PAGE - 1) / PAGE * PAGE;
    *bytes = whole;
    char *at = mmap(NULL, whole, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    const int file = memfd_create("answers", 0);
    CHECK(at != MAP_FAILED && file >= 0 && ftruncate(file, SAME + PAGE) == 0, "no room");
    for (size_t done = 0; done < whole;) {
        const size_t left = whole - done, size = left > SAME ? SAME : left > PAGE ? left - PAGE : PAGE;
        CHECK(mmap(at + done, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_FIXED, file,
                   left > PAGE ? 0 : SAME) == at + done,
              "mmap");
        done += size;
    }
    close(file);
    return (float *)(void *)at;
}

/* A batch that cannot be is refused, and as many answers as it was said to have are NaN: the last
 * one is where only a count of 64 bits leads. */
static void refuse_batch(softshadow_points batch, const char *text) {
    size_t bytes;
    float *v = wide_answers(batch.count, &bytes);
    v[batch.count - 1] = .5f;
    REFUSED(f.handle, SOFTSHADOW_E_ARGUMENT, text, softshadow_query_visibility(f.handle, &batch, v));
    CHECK(isnan(v[0]) && isnan(v[batch.count - 1]), "%zu points: the last is %g", batch.count,
          (double)v[batch.count - 1]);
    munmap(v, bytes);
}

static void strides_and_overflow(void **state) {
    (void)state;
    static const size_t count[] = {2,
                                   ((size_t)1 << 31) - 1,
                                   (size_t)1 << 31,
                                   ((size_t)1 << 31) + 1,
                                   ((size_t)1 << 32) - 1,
                                   ((size_t)1 << 32) + 1,
                                   (size_t)1 << 60,
                                   SIZE_MAX / 24,
                                   SIZE_MAX / 12,
                                   SIZE_MAX};
    static const size_t stride[] = {((size_t)1 << 32) + 24, (size_t)1 << 33, SIZE_MAX / 2,
                                    SIZE_MAX - 11, SIZE_MAX};
    float v[N];
    for (size_t i = 0; i < COUNT(count); i++) {
        for (size_t k = 0; k < COUNT(stride); k++) {
            size_t bytes;
            if (!__builtin_mul_overflow(count[i], stride[k], &bytes) && bytes <= PTRDIFF_MAX)
                continue;
            softshadow_mesh mesh = ask_mesh(&f.mesh);
            mesh.vertex_count = count[i], mesh.position_stride = stride[k];
            CHECK(softshadow_add_mesh(f.handle, &mesh, NULL) == SOFTSHADOW_E_ARGUMENT,
                  "%zu vertices of stride %zu", count[i], stride[k]);
            softshadow_points batch = f.batch;
            batch.count = count[i], batch.position_stride = stride[k];
            /* Those that could be in memory are below; more could not, and nothing is set. */
            if (count[i] > 2 && count[i] < (size_t)1 << 44) continue;
            REFUSED(f.handle, SOFTSHADOW_E_ARGUMENT, "positions",
                    softshadow_query_visibility(f.handle, &batch, v));
        }
    }
    for (size_t i = 5; i < COUNT(count); i++) {
        softshadow_mesh mesh = ask_mesh(&f.mesh);
        mesh.triangle_count = count[i];
        CHECK(softshadow_add_mesh(f.handle, &mesh, NULL) == SOFTSHADOW_E_ARGUMENT, "%zu triangles",
              count[i]);
    }
    softshadow_points batch = f.batch;
    batch.position_stride = 23;
    REFUSED(f.handle, SOFTSHADOW_E_ARGUMENT, "stride",
            softshadow_query_visibility(f.handle, &batch, v));
    batch = f.batch;
    batch.normals = v, batch.normal_stride = 11;
    REFUSED(f.handle, SOFTSHADOW_E_ARGUMENT, "stride",
            softshadow_query_visibility(f.handle, &batch, v));
    batch = f.batch;
    batch.width = 5;
    REFUSED(f.handle, SOFTSHADOW_E_ARGUMENT, "width",
            softshadow_query_visibility(f.handle, &batch, v));
    batch.width = 8;
    OK(f.handle, softshadow_query_visibility(f.handle, &batch, v));
    unharmed();
}

/* Batches that 32 bits cannot count: refused for their rows, as 2^31 + 1 points, and for their
 * stride, as 2^32 + 3; in 32 bits they would be a negative number of points, and three. */
static void counts_beyond_32_bits(void **state) {
    (void)state;
    const char *sanitizers = getenv("SANITIZERS");
    softshadow_points batch = f.batch;
    batch.count = ((size_t)1 << 31) + 1, batch.width = 2;
    refuse_batch(batch, "width");
    if (sanitizers && *sanitizers) return; /* 16 GiB of writes, each of them looked at */
    batch = f.batch, batch.count = ((size_t)1 << 32) + 3;
    batch.position_stride = SIZE_MAX / 2;
    refuse_batch(batch, "position");
    unharmed();
}

/* Any stride and any address that holds the item will do. */
static void odd_strides(void **state) {
    (void)state;
    unsigned char raw[N * 37 + 40], mesh_raw[4 * 29 + 40], normals[N * 13 + 40];
    float v[N];
    for (int i = 0; i < N; i++) memcpy(raw + 1 + 37 * i, f.points[i], sizeof f.points[i]);
    for (int i = 0; i < 4; i++) memcpy(mesh_raw + 3 + 29 * i, f.mesh.xyz + 3 * i, 24);
    for (int i = 0; i < N; i++) memcpy(normals + 1 + 13 * i, (const float[3]){0, 0, 1}, 12);
    softshadow_mesh mesh = ask_mesh(&f.mesh);
    mesh.positions = mesh_raw + 3, mesh.position_stride = 29;
    OK(f.handle, softshadow_update_mesh(f.handle, 0, &mesh));
    OK(f.handle, softshadow_build_maps(f.handle, NULL));
    softshadow_points batch = f.batch;
    batch.positions = raw + 1, batch.position_stride = 37;
    OK(f.handle, softshadow_query_visibility(f.handle, &batch, v));
    ask_same_bits(f.visibility, v, N, "odd strides");
    /* What a point is told under auto may be reckoned otherwise where it has a normal. */
    float up[N][3], plain[N];
    for (int i = 0; i < N; i++) memcpy(up[i], normals + 1 + 13 * i, sizeof up[i]);
    batch.normals = up[0], batch.normal_stride = sizeof up[0];
    OK(f.handle, softshadow_query_visibility(f.handle, &batch, plain));
    batch.normals = (const float *)(const void *)(normals + 1), batch.normal_stride = 13;
    OK(f.handle, softshadow_query_visibility(f.handle, &batch, v));
    ask_same_bits(plain, v, N, "odd strides of normals");
}

static void enums_out_of_range(void **state) {
    (void)state;
    static const uint32_t wrong[] = {4, 77, 0x7fffffff, 0xffffffff};
    softshadow *h = f.handle;
    float v[N];
    for (size_t i = 0; i < COUNT(wrong); i++) {
        softshadow_mesh mesh = ask_mesh(&f.mesh);
        mesh.position_type = wrong[i];
        REFUSED(h, SOFTSHADOW_E_ARGUMENT, "position_type", softshadow_add_mesh(h, &mesh, NULL));
        mesh = ask_mesh(&f.mesh);
        mesh.flags = wrong[i] | 8;
        REFUSED(h, SOFTSHADOW_E_ARGUMENT, "flags", softshadow_add_mesh(h, &mesh, NULL));
        softshadow_points batch = f.batch;
        batch.position_type = wrong[i];
        REFUSED(h, SOFTSHADOW_E_ARGUMENT, "position_type",
                softshadow_query_visibility(h, &batch, v));
        batch = f.batch;
        batch.light = wrong[i];
        REFUSED(h, SOFTSHADOW_E_ARGUMENT, "light", softshadow_query_visibility(h, &batch, v));
        softshadow_light light = f.light;
        light.type = wrong[i];
        const softshadow_status status = softshadow_set_light(h, &light);
        CHECK(status == SOFTSHADOW_E_ARGUMENT || status == SOFTSHADOW_E_LIGHT, "%s",
              softshadow_status_name(status));
    }
    unharmed(); /* builds come last: a failed one leaves nothing built */
    for (size_t i = 0; i < COUNT(wrong); i++) {
        for (int field = 0; field < 3; field++) {
            softshadow_build build = SOFTSHADOW_BUILD_INIT;
            *(field == 0   ? &build.backend
              : field == 1 ? &build.falloff
                           : &build.weighting) = wrong[i];
            REFUSED(h, SOFTSHADOW_E_ARGUMENT,
                    ((const char *[]){"backend", "falloff", "weighting"})[field],
                    softshadow_build_maps(h, &build));
        }
    }
    OK(h, softshadow_build_maps(h, NULL));
    unharmed();
}

static void numbers_out_of_range(void **state) {
    (void)state;
    softshadow *h = f.handle;
    const double wrong[] = {NAN, INFINITY, -1, -INFINITY};
    for (size_t i = 0; i < COUNT(wrong); i++) {
        softshadow_build build = SOFTSHADOW_BUILD_INIT;
        build.tolerance = wrong[i];
        REFUSED(h, SOFTSHADOW_E_ARGUMENT, "tolerance", softshadow_build_maps(h, &build));
        build = (softshadow_build)SOFTSHADOW_BUILD_INIT;
        build.depth_bias = wrong[i];
        REFUSED(h, SOFTSHADOW_E_ARGUMENT, "depth_bias", softshadow_build_maps(h, &build));
        build = (softshadow_build)SOFTSHADOW_BUILD_INIT;
        build.smoothie_width = wrong[i];
        REFUSED(h, SOFTSHADOW_E_ARGUMENT, "smoothie_width", softshadow_build_maps(h, &build));
        double bounds[6] = {-1, -1, -1, 1, 1, 1};
        bounds[3] = i == 2 ? -2 : wrong[i];
        build = (softshadow_build)SOFTSHADOW_BUILD_INIT;
        build.bounds = bounds;
        REFUSED(h, SOFTSHADOW_E_ARGUMENT, "bounds", softshadow_build_maps(h, &build));
    }
    softshadow_build build = SOFTSHADOW_BUILD_INIT;
    build.samples = UINT32_MAX;
    REFUSED(h, SOFTSHADOW_E_ARGUMENT, "samples", softshadow_build_maps(h, &build));
    build = (softshadow_build)SOFTSHADOW_BUILD_INIT;
    build.resolution = UINT32_MAX;
    REFUSED(h, SOFTSHADOW_E_ARGUMENT, "resolution", softshadow_build_maps(h, &build));
    OK(h, softshadow_build_maps(h, NULL));
    unharmed();
}

static void unknown_methods_and_backends(void **state) {
    (void)state;
    softshadow_build build = SOFTSHADOW_BUILD_INIT;
    build.method = "no-such-method";
    REFUSED(f.handle, SOFTSHADOW_E_UNSUPPORTED, "no-such-method",
            softshadow_build_maps(f.handle, &build));
    build.method = "";
    REFUSED(f.handle, SOFTSHADOW_E_UNSUPPORTED, "method", softshadow_build_maps(f.handle, &build));
    build.method = NULL, build.backend = SOFTSHADOW_EGL;
    const softshadow_status status = softshadow_build_maps(f.handle, &build);
    CHECK(status == SOFTSHADOW_E_UNSUPPORTED || status == SOFTSHADOW_E_BACKEND, "%s",
          softshadow_status_name(status));
    CHECK(*softshadow_last_message(f.handle), "a message");
    build.backend = SOFTSHADOW_ANY;
    OK(f.handle, softshadow_build_maps(f.handle, &build));
    softshadow_method method = SOFTSHADOW_METHOD_INIT;
    REFUSED(NULL, SOFTSHADOW_E_ARGUMENT, "index", softshadow_method_info(1000, &method));
    unharmed();
}

/* ---- Meshes and lights
 * ----------------------------------------------------------------------------*/

static void bad_vertices_and_indices(void **state) {
    (void)state;
    scene_mesh big = {0};
    scene_icosphere(&big, (const double[3]){0, 0, 3}, 1, 3, 0);
    softshadow_mesh mesh = ask_mesh(&big);
    uint32_t id = 7;
    const double wrong[] = {NAN, INFINITY, -INFINITY, 1.01e15, -1e200};
    for (size_t i = 0; i < COUNT(wrong); i++) {
        const double kept = big.xyz[3 * 123 + i % 3];
        big.xyz[3 * 123 + i % 3] = wrong[i];
        REFUSED(f.handle, SOFTSHADOW_E_MESH, "123", softshadow_add_mesh(f.handle, &mesh, &id));
        CHECK(id == UINT32_MAX, "mesh_id %u", id);
        REFUSED(f.handle, SOFTSHADOW_E_MESH, "123", softshadow_update_mesh(f.handle, 0, &mesh));
        big.xyz[3 * 123 + i % 3] = kept;
    }
    const uint32_t far[] = {(uint32_t)big.vertices, 0x7fffffff, UINT32_MAX};
    for (size_t i = 0; i < COUNT(far); i++) {
        const uint32_t kept = big.indices[3 * 77 + i];
        big.indices[3 * 77 + i] = far[i];
        REFUSED(f.handle, SOFTSHADOW_E_MESH, "77", softshadow_update_mesh(f.handle, 0, &mesh));
        big.indices[3 * 77 + i] = kept;
    }
    const double matrix[12] = {1, 0, 0, NAN, 0, 1, 0, 0, 0, 0, 1, 0},
                 huge[12] = {1e15, 0, 0, 0, 0, 1e15, 0, 0, 0, 0, 1e15, 0};
    mesh.transform = matrix;
    CHECK(softshadow_add_mesh(f.handle, &mesh, NULL) < 0, "a transform that is not finite");
    mesh.transform = huge;
    REFUSED(f.handle, SOFTSHADOW_E_MESH, "vertex", softshadow_add_mesh(f.handle, &mesh, NULL));
    unharmed();
    softshadow_mesh_report report = SOFTSHADOW_MESH_REPORT_INIT;
    REFUSED(f.handle, SOFTSHADOW_E_ARGUMENT, "mesh", softshadow_remove_mesh(f.handle, 1));
    REFUSED(f.handle, SOFTSHADOW_E_ARGUMENT, "mesh", softshadow_mesh_info(f.handle, 99, &report));
    REFUSED(f.handle, SOFTSHADOW_E_ARGUMENT, "mesh",
            softshadow_update_mesh(f.handle, UINT32_MAX, &mesh));
    unharmed();
    scene_free(&big);
}

static void bad_lights(void **state) {
    (void)state;
    const float profile[3] = {1, NAN, 0.5f}, negative[2] = {1, -1};
    softshadow_light bad[20];
    size_t n = 0;
    bad[n] = scene_sphere_light(0, 0, 5, 1), bad[n++].radius = -1;
    bad[n] = scene_sphere_light(0, 0, 5, 1), bad[n++].radius = NAN;
    bad[n++] = scene_sphere_light(NAN, 0, 5, 1);
    bad[n++] = scene_sphere_light(INFINITY, 0, 5, 1);
    bad[n++] = scene_disk_light(0, 0, 5, 0, 0, 0, 1);
    bad[n++] = scene_disk_light(0, 0, 5, NAN, 0, 1, 1);
    bad[n++] = scene_sun_light(0, 0, 0, 0.1);
    bad[n++] = scene_sun_light(0, 0, -1, 1.5); /* over 80 degrees */
    bad[n++] = scene_sun_light(0, 0, -1, -0.1);
    bad[n] = scene_rect_light(0, 0, 5, 1, 1), bad[n++].v[0] = 1e-5;      /* skewed */
    bad[n] = scene_rect_light(0, 0, 5, 1, 1), bad[n++].direction[0] = 1; /* not along u x v */
    bad[n] = scene_rect_light(0, 0, 5, 1, 1), bad[n++].u[2] = NAN;
    bad[n] = scene_disk_light(0, 0, 5, 0, 0, 1, 0), bad[n++].u[0] = 1; /* half an ellipse */
    bad[n] = scene_disk_light(0, 0, 5, 0, 0, 1, 0), bad[n].u[0] = bad[n].v[0] = 1, n++;
    bad[n] = scene_disk_light(0, 0, 5, 1, 0, 0, 0), bad[n].u[0] = bad[n].v[1] = 1, n++;
    bad[n] = scene_disk_light(0, 0, 5, 0, 0, 1, 1), bad[n].profile = profile,
    bad[n++].profile_count = 3;
    bad[n] = scene_disk_light(0, 0, 5, 0, 0, 1, 1), bad[n].profile = negative,
    bad[n++].profile_count = 2;
    for (size_t i = 0; i < n; i++) {
        uint32_t id = 7;
        softshadow_status status = softshadow_set_light(f.handle, &bad[i]);
        CHECK(status == SOFTSHADOW_E_LIGHT, "light %zu: %s", i, softshadow_status_name(status));
        CHECK(*softshadow_last_message(f.handle), "light %zu: a message", i);
        status = softshadow_add_light(f.handle, &bad[i], &id);
        CHECK(status == SOFTSHADOW_E_LIGHT && id == UINT32_MAX, "light %zu: %s", i,
              softshadow_status_name(status));
    }
    unharmed();
    softshadow_light fine = scene_rect_light(0, 0, 5, 1, 1);
    fine.v[0] = 1e-7; /* within 1e-6 */
    fine.direction[2] = -3;
    OK(f.handle, softshadow_set_light(f.handle, &fine));
}

/* ---- Names
 * ------------------------------------------------------------------------------------------*/

static void names_and_versions(void **state) {
    (void)state;
    static const char *const name[] = {"SOFTSHADOW_OK",
                                       "SOFTSHADOW_E_ARGUMENT",
                                       "SOFTSHADOW_E_STATE",
                                       "SOFTSHADOW_E_MESH",
                                       "SOFTSHADOW_E_LIGHT",
                                       "SOFTSHADOW_E_MEMORY",
                                       "SOFTSHADOW_E_UNSUPPORTED",
                                       "SOFTSHADOW_E_CANCELLED",
                                       "SOFTSHADOW_E_BACKEND",
                                       "SOFTSHADOW_E_INTERNAL"};
    for (int i = 0; i < 10; i++) assert_string_equal(softshadow_status_name(-i), name[i]);
    static const softshadow_status none[] = {1, -10, INT32_MIN, INT32_MAX};
    for (size_t i = 0; i < COUNT(none); i++)
        assert_string_equal(softshadow_status_name(none[i]), "unknown status");
    assert_int_equal(softshadow_version(), SOFTSHADOW_VERSION);
    char text[32];
    snprintf(text, sizeof text, "%u.%u.%u", SOFTSHADOW_VERSION / 10000,
             SOFTSHADOW_VERSION / 100 % 100, SOFTSHADOW_VERSION % 100);
    assert_string_equal(softshadow_version_string(), text);
    size_t n;
    const softshadow_method *list = ask_methods(&n);
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < i; k++)
            CHECK(strcmp(list[i].name, list[k].name), "%s twice", list[i].name);
        CHECK(!(list[i].lights_native & list[i].lights_approximated),
              "%s: a light both native and not", list[i].name);
        CHECK(!list[i].title || (*list[i].title && !strchr(list[i].title, '\n')), "%s: title",
              list[i].name);
    }
}

int main(void) {
#define TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        TEST(null_handles),
        TEST(null_arguments),
        TEST(null_is_a_default),
        TEST(struct_sizes),
        TEST(sizes_of_1_0),
        TEST(failed_structs),
        TEST(strides_and_overflow),
        TEST(counts_beyond_32_bits),
        TEST(odd_strides),
        TEST(enums_out_of_range),
        TEST(numbers_out_of_range),
        TEST(unknown_methods_and_backends),
        TEST(bad_vertices_and_indices),
        TEST(bad_lights),
        TEST(names_and_versions),
    };
    return cmocka_run_group_tests_name("arguments", tests, NULL, NULL);
}
