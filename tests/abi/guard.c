/* Arrays between pages that may not be touched: each ends where one begins, or begins where one
 * ends. Whatever a call reads or writes beyond what it was told is there kills this program. Every
 * method, batches of 1 to 17 points and some of hundreds, both types of positions, strides; meshes,
 * profiles, bounds, images; and the answers are those for arrays in the open.
 *
 * A host that says N items of stride S hands over (N - 1) S bytes and one item. */
#include <signal.h>
#include <stdbool.h>
#include <sys/mman.h>
#include <unistd.h>

#include "abi/plain.h"

enum { MOST = 700, STRIDES = 3 };

static const plain_api api = PLAIN_LINKED;

/* ---- Memory with an end ---------------------------------------------------------------------------- */

typedef enum side { OPEN, ENDS, BEGINS } side;

/* What one call is given, freed together. */
typedef struct block {
    void *base;
    size_t size;
} block;
static block blocks[64];
static unsigned block_count;

static size_t page_size(void) { return (size_t)sysconf(_SC_PAGESIZE); }

/* `size` bytes that end at a page that cannot be touched (ENDS), or begin after one. */
static void *fenced(const void *from, size_t size, side where) {
    const size_t page = page_size(), inner = (size + page - 1) / page * page;
    REQUIRE(block_count < 64, "too many blocks");
    char *base = mmap(NULL, inner + 2 * page, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    REQUIRE(base != MAP_FAILED, "mmap");
    REQUIRE(!inner || mprotect(base + page, inner, PROT_READ | PROT_WRITE) == 0, "mprotect");
    blocks[block_count++] = (block){base, inner + 2 * page};
    char *at = where == ENDS ? base + page + inner - size : base + page;
    if (from && size) memcpy(at, from, size);
    return at;
}

static void *place(const void *from, size_t size, side where) {
    if (where != OPEN) return fenced(from, size, where);
    void *at = calloc(1, size ? size : 1);
    REQUIRE(at && block_count < 64, "no memory");
    blocks[block_count++] = (block){at, 0};
    if (from && size) memcpy(at, from, size);
    return at;
}

static void release_from(unsigned first) {
    while (block_count > first) {
        const block b = blocks[--block_count];
        if (b.size)
            munmap(b.base, b.size);
        else
            free(b.base);
    }
}

/* `count` items of `item` bytes at that stride. */
static void *spread(const void *items, size_t count, size_t item, size_t stride, side where) {
    const size_t size = count ? (count - 1) * stride + item : 0;
    char *packed = calloc(1, size ? size : 1);
    REQUIRE(packed, "no memory");
    for (size_t i = 0; i < count; i++)
        memcpy(packed + i * stride, (const char *)items + i * item, item);
    void *at = place(packed, size, where);
    free(packed);
    return at;
}

/* ---- Where it went wrong ----------------------------------------------------------------------------- */

static char doing[256];

static void on_fault(int signal_number) {
    (void)signal_number;
    const ssize_t told = write(2, doing, strlen(doing));
    (void)told;
    _exit(1);
}

/* ---- The scene ------------------------------------------------------------------------------------------ */

static const float xyz[7][3] = {{-1.1f, -.9f, 1.3f}, {1.2f, -.7f, 1.9f}, {.1f, 1.3f, 2.3f}, {.3f, .4f, 2.7f},
                                {1.7f, .5f, 1.1f},   {-3, -3, .2f},      {.9f, -1.7f, 1.2f}};
static const float uv[7][2] = {{0, 0}, {1, 0}, {1, 1}, {.3f, .4f}, {.9f, .1f}, {0, 1}, {.7f, .2f}};
static const uint32_t triangle[5][3] = {{0, 1, 2}, {2, 3, 4}, {0, 2, 4}, {5, 6, 1}, {4, 6, 3}};
static const uint8_t texel[6] = {255, 0, 200, 130, 255, 90};
static const float profile[5] = {1, .9f, .7f, .4f, .1f};
static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
static const double bounds[6] = {-4, -4, -1, 4, 4, 1};

/* Two meshes, the second borrowed and see-through in part; a light with a profile. What is borrowed
 * lives as long as the handle. */
static void fill_scene(softshadow *handle, side where, size_t stride, const char *method) {
    for (int i = 0; i < 2; i++) {
        softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
        mesh.flags = i ? SOFTSHADOW_BORROW : 0;
        mesh.position_stride = stride;
        mesh.positions = spread(xyz, 7, sizeof xyz[0], stride, where);
        mesh.vertex_count = 7, mesh.triangle_count = 5;
        mesh.indices = place(triangle, sizeof triangle, where);
        mesh.transform = place(identity, sizeof identity, where);
        if (i) {
            mesh.uvs = spread(uv, 7, sizeof uv[0], stride - 4, where), mesh.uv_stride = stride - 4;
            mesh.opacity = (softshadow_texture){3, 2, place(texel, sizeof texel, where)};
            mesh.opacity_threshold = .5f;
        }
        const softshadow_status status = softshadow_add_mesh(handle, &mesh, NULL);
        REQUIRE(status == SOFTSHADOW_OK, "%s: %s", method, softshadow_last_message(handle));
    }
    softshadow_light light = SOFTSHADOW_LIGHT_INIT;
    light.position[0] = .3, light.position[2] = 5.7, light.radius = 1.1;
    light.profile = place(profile, sizeof profile, where), light.profile_count = 5;
    REQUIRE(softshadow_set_light(handle, &light) == SOFTSHADOW_OK, "%s: %s", method,
            softshadow_last_message(handle));
}

/* NULL: this method or back end is not to be had here. */
static softshadow *make(const char *method, uint32_t backend, side where, size_t stride) {
    softshadow *handle = NULL;
    softshadow_build build = SOFTSHADOW_BUILD_INIT;
    REQUIRE(softshadow_create(&handle, NULL) == SOFTSHADOW_OK, "create");
    fill_scene(handle, where, stride, method);
    char *name = place(method, strlen(method) + 1, where);
    double *box = place(bounds, sizeof bounds, where);
    build.method = name, build.bounds = box;
    build.backend = backend, build.resolution = 61, build.samples = 24; /* no multiple of anything */
    const softshadow_status status = softshadow_build_maps(handle, &build);
    if (backend == SOFTSHADOW_EGL && status) {
        REQUIRE(status == SOFTSHADOW_E_UNSUPPORTED || status == SOFTSHADOW_E_BACKEND, "%s",
                softshadow_last_message(handle));
        softshadow_destroy(handle);
        return NULL;
    }
    REQUIRE(status == SOFTSHADOW_OK, "%s: %s", method, softshadow_last_message(handle));
    return handle;
}

/* ---- Batches ---------------------------------------------------------------------------------------------- */

typedef struct batch {
    size_t count;
    uint32_t type;
    size_t more[2]; /* bytes between positions, and normals */
    bool all;       /* normals, ids, primitives, bounds are given, too */
} batch;

static void query(softshadow *handle, const char *method, const batch *b, side where, float *answers,
                  float *bound) {
    static float single[MOST][3], normal[MOST][3];
    static double wide[MOST][3];
    static uint32_t id[MOST];
    static uint64_t primitive[MOST];
    const unsigned before = block_count;
    for (size_t i = 0; i < b->count; i++) {
        const size_t k = i * 37 % 1021;
        single[i][0] = (float)(k % 32) / 8 - 2, single[i][1] = (float)(k / 32) / 8 - 2;
        for (int c = 0; c < 3; c++) wide[i][c] = single[i][c];
        normal[i][2] = i % 3 ? 1 : 0, id[i] = (uint32_t)(i % 2);
        primitive[i] = SOFTSHADOW_NO_PRIMITIVE;
    }
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    const bool f64 = b->type == SOFTSHADOW_F64;
    const size_t item = f64 ? sizeof wide[0] : sizeof single[0];
    points.count = b->count, points.position_type = b->type;
    points.position_stride = item + b->more[0];
    points.positions =
        spread(f64 ? (void *)wide : (void *)single, b->count, item, item + b->more[0], where);
    if (b->all) {
        points.normal_stride = sizeof normal[0] + b->more[1];
        points.normals = spread(normal, b->count, sizeof normal[0], points.normal_stride, where);
        points.ids = place(id, b->count * sizeof *id, where);
        points.primitives = place(primitive, b->count * sizeof *primitive, where);
        points.error_bound = place(NULL, b->count * sizeof *bound, where);
        points.width = (uint32_t)b->count;
    }
    float *out = place(NULL, b->count * sizeof *out, where);
    REQUIRE(softshadow_query_visibility(handle, &points, out) == SOFTSHADOW_OK, "%s: %s", method,
            softshadow_last_message(handle));
    memcpy(answers, out, b->count * sizeof *out);
    if (b->all) memcpy(bound, points.error_bound, b->count * sizeof *bound);
    release_from(before);
}

static void compare(softshadow *open, softshadow *fence, const char *method, const batch *b,
                    side where) {
    static float want[2][MOST], got[2][MOST];
    memset(want, 0, sizeof want), memset(got, 0, sizeof got);
    snprintf(doing, sizeof doing,
             "%s: %zu points of type %u, %zu and %zu bytes between, arrays that %s: a page was touched "
             "that is not the array's\n",
             method, b->count, b->type, b->more[0], b->more[1], where == ENDS ? "end" : "begin");
    query(open, method, b, OPEN, want[0], want[1]);
    query(fence, method, b, where, got[0], got[1]);
    REQUIRE(memcmp(want, got, sizeof want) == 0, "%s: %zu points: answers differ", method, b->count);
}

/* measure_error and explain, which write arrays of the host's, too. */
static void look(softshadow *handle, const char *method, side where) {
    const unsigned before = block_count;
    static const float at[3][3] = {{0, 0, 0}, {.5f, .25f, 0}, {1, 0, 0}};
    snprintf(doing, sizeof doing, "%s: measure_error or explain touch another page\n", method);
    softshadow_points *points = place(NULL, sizeof *points, where);
    softshadow_error *error = place(NULL, sizeof *error, where);
    *points = (softshadow_points)SOFTSHADOW_POINTS_INIT;
    *error = (softshadow_error)SOFTSHADOW_ERROR_INIT;
    points->positions = place(at, sizeof at, where), points->count = 3;
    error->samples = 16;
    REQUIRE(softshadow_measure_error(handle, points, error) == SOFTSHADOW_OK && error->points == 3,
            "%s: %s", method, softshadow_last_message(handle));
    softshadow_explanation *e = place(NULL, sizeof *e, where);
    *e = (softshadow_explanation)SOFTSHADOW_EXPLANATION_INIT;
    e->size = 7;
    e->image = place(NULL, 49 * sizeof *e->image, where);
    e->hider = place(NULL, 49 * sizeof *e->hider, where);
    e->normal = place((const float[3]){0, 0, 1}, 3 * sizeof(float), where);
    e->primitive = place((const uint64_t[1]){SOFTSHADOW_NO_PRIMITIVE}, sizeof(uint64_t), where);
    REQUIRE(softshadow_explain(handle, e) == SOFTSHADOW_OK, "%s: %s", method,
            softshadow_last_message(handle));
    softshadow_stats *stats = place(NULL, sizeof *stats, where);
    *stats = (softshadow_stats)SOFTSHADOW_STATS_INIT;
    REQUIRE(softshadow_get_stats(handle, stats) == SOFTSHADOW_OK, "%s", method);
    release_from(before);
}

static unsigned try_method(const char *method, uint32_t backend, side where) {
    static const size_t more[STRIDES][2] = {{0, 0}, {4, 12}, {1, 3}};
    const size_t step = backend == SOFTSHADOW_EGL ? 8 : 1;
    unsigned batches = 0;
    snprintf(doing, sizeof doing, "%s: a build touches another page\n", method);
    softshadow *open = make(method, backend, OPEN, sizeof xyz[0]);
    softshadow *fence = open ? make(method, backend, where, 16) : NULL;
    for (size_t count = 1; open && count <= 19; count += step) {
        for (unsigned k = 0; k < 4 * STRIDES; k++) {
            batch b = {count, k & 1, {more[k / 4][0], more[k / 4][1]}, k & 2};
            if (count > 17) b.count = count == 18 ? 259 : MOST; /* on several threads */
            compare(open, fence, method, &b, where);
            batches++;
        }
    }
    if (open) look(fence, method, where);
    softshadow_destroy(open), softshadow_destroy(fence);
    release_from(0);
    return batches;
}

int main(void) {
    const char *names[64];
    struct sigaction action = {.sa_handler = on_fault};
    sigaction(SIGSEGV, &action, NULL), sigaction(SIGBUS, &action, NULL);
    const unsigned n = plain_methods(&api, names);
    unsigned batches = 0, gpu = 0;
    for (unsigned i = 0; i < 2 * n; i++) {
        const side where = i % 2 ? BEGINS : ENDS;
        batches += try_method(names[i / 2], SOFTSHADOW_CPU, where);
        gpu += try_method(names[i / 2], SOFTSHADOW_EGL, where);
    }
    printf("%u methods, %u batches, %u of them on a GPU\n", n, batches + gpu, gpu);
    return 0;
}
