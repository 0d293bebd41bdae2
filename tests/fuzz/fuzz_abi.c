/* libFuzzer on the ABI as a sequence of calls: the input is a tape from which calls and their
 * arguments are read, right ones and wrong ones. Nothing crashes or leaks, no call answers
 * E_INTERNAL, every error has a message of one line, and a visibility is in 0..1, or NaN where a
 * point was bad or the call failed. All arrays are exactly as long as the library is told.
 *
 * Embree and TBB are not built with the fuzzer's instruments: what they do to memory is seen where
 * it is ours, and what they keep is no leak. */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "softshadow.h"

enum { TRIANGLES = 8, VERTICES = 10, POINTS = 24, TEXELS = 4, CALLS = 24, MESHES = 4 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
const char *__lsan_default_suppressions(void);

const char *__lsan_default_suppressions(void) { return "leak:libembree3\nleak:libtbb\n"; }

static void must(bool holds) {
    if (!holds) abort();
}

/* ---- The tape: 0 for ever behind its end ----------------------------------------------------- */

static const uint8_t *tape, *tape_end;

static uint8_t byte(void) { return tape < tape_end ? *tape++ : 0; }

static uint32_t word(void) {
    uint32_t w = 0;
    for (int i = 0; i < 4; i++) w = w << 8 | byte();
    return w;
}

/* Mostly numbers of a scene; now and then those that scenes should not have. */
static double number(void) {
    static const double odd[] = {NAN, INFINITY, -INFINITY, 1e15, -1e16, 1e-300, 0x1p-126, -0.0,
                                 1e7, 1e-6,     3.4e38,    0,    1,     -1,     0x1p-149, 1e300};
    const uint8_t kind = byte();
    if (kind < 16) return odd[kind];
    if (kind < 128) return (int8_t)byte() / 16.0;
    if (kind < 250) return (int8_t)byte() / 16.0 + byte() / 4096.0;
    const uint32_t bits = word();
    float any;
    memcpy(&any, &bits, sizeof any);
    return any;
}

static void *zeroed(size_t count, size_t size) {
    void *memory = calloc(count ? count : 1, size);
    must(memory != NULL);
    return memory;
}

static void *numbers(size_t count, uint32_t type) {
    void *all = zeroed(count, type == SOFTSHADOW_F64 ? 8 : 4);
    for (size_t i = 0; i < count; i++) {
        if (type == SOFTSHADOW_F64)
            ((double *)all)[i] = number();
        else
            ((float *)all)[i] = (float)number();
    }
    return all;
}

/* ---- What must hold after every call ----------------------------------------------------------- */

static softshadow_status checked(const softshadow *handle, softshadow_status status) {
    must(status <= SOFTSHADOW_OK && status > SOFTSHADOW_E_INTERNAL);
    const char *message = softshadow_last_message(handle);
    must(message != NULL && strchr(message, '\n') == NULL);
    if (status != SOFTSHADOW_OK) must(message[0] != 0);
    return status;
}

static void check_visibility(softshadow_status status, const float *visibility, size_t count) {
    for (size_t i = 0; i < count; i++) {
        if (status != SOFTSHADOW_OK)
            must(isnan(visibility[i]));
        else
            must(isnan(visibility[i]) || (visibility[i] >= 0 && visibility[i] <= 1));
    }
}

/* ---- Calls ------------------------------------------------------------------------------------ */

/* A mesh of a version to come: whatever size is claimed, up to 4096 is there. */
typedef union wide_mesh {
    softshadow_mesh mesh;
    uint8_t bytes[4096];
} wide_mesh;

/* A handle and the arrays that it borrowed. */
typedef struct session {
    softshadow *handle;
    void *kept[5 * MESHES];
    uint32_t kept_count;
} session;

static void keep_or_free(session *s, bool keep, void *memory) {
    if (keep)
        s->kept[s->kept_count++] = memory;
    else
        free(memory);
}

static void put_mesh(session *s, bool update) {
    wide_mesh wide = {.bytes = {0}};
    softshadow_mesh *mesh = &wide.mesh;
    *mesh = (softshadow_mesh)SOFTSHADOW_MESH_INIT;
    double transform[12];
    mesh->flags = byte() & 7;
    const bool room = s->kept_count + 4 <= sizeof s->kept / sizeof *s->kept;
    if (!room) mesh->flags &= ~(uint32_t)SOFTSHADOW_BORROW;
    mesh->position_type = byte() % 8 ? byte() & 1 : byte();
    mesh->vertex_count = byte() % (VERTICES + 1), mesh->triangle_count = byte() % (TRIANGLES + 1);
    void *positions = numbers(3 * mesh->vertex_count, mesh->position_type);
    uint32_t *indices = zeroed(3 * mesh->triangle_count, sizeof *indices);
    for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
        const uint8_t b = byte();
        indices[i] = b == 255 || !mesh->vertex_count ? word() : b % (uint32_t)mesh->vertex_count;
    }
    mesh->positions = byte() ? positions : NULL, mesh->indices = byte() ? indices : NULL;
    const uint8_t extra = byte();
    float *uvs = extra & 1 ? numbers(2 * mesh->vertex_count, SOFTSHADOW_F32) : NULL;
    uint8_t *texels = NULL;
    if (extra & 2) {
        mesh->opacity.width = byte() % (TEXELS + 1), mesh->opacity.height = byte() % (TEXELS + 1);
        texels = zeroed((size_t)mesh->opacity.width * mesh->opacity.height, 1);
        for (uint32_t i = 0; i < mesh->opacity.width * mesh->opacity.height; i++)
            texels[i] = byte();
        mesh->opacity_threshold = (float)number();
    }
    mesh->uvs = uvs, mesh->opacity.texels = texels;
    for (int i = 0; i < 12 && extra & 4; i++) transform[i] = number();
    if (extra & 4) mesh->transform = transform;
    if (extra & 128) mesh->struct_size = byte() & 1 ? word() : (uint32_t)(word() % sizeof wide);
    if (extra & 64) wide.bytes[sizeof *mesh + word() % (sizeof wide - sizeof *mesh)] = 1;
    uint32_t id = 0;
    const softshadow_status status =
        checked(s->handle, update ? softshadow_update_mesh(s->handle, byte() % MESHES, mesh)
                                  : softshadow_add_mesh(s->handle, mesh, &id));
    if (status && !update) must(id == UINT32_MAX);
    const bool keep = !status && mesh->flags & SOFTSHADOW_BORROW;
    keep_or_free(s, keep, positions), keep_or_free(s, keep, indices);
    keep_or_free(s, keep, uvs), keep_or_free(s, keep, texels);
}

static void put_light(session *s, bool add) {
    softshadow_light light = SOFTSHADOW_LIGHT_INIT;
    float *profile = NULL;
    light.type = byte() % 8 ? byte() % 4 : byte();
    for (int k = 0; k < 3; k++) light.position[k] = number(), light.direction[k] = number();
    for (int k = 0; k < 3; k++) light.u[k] = number(), light.v[k] = number();
    light.radius = number();
    if (light.type == SOFTSHADOW_RECT && byte() % 4) { /* chance seldom makes right angles */
        for (int k = 0; k < 3; k++)
            light.u[k] = k == 0, light.v[k] = k == 1, light.direction[k] = 0;
    }
    if (byte() % 8 == 0) {
        light.profile_count = byte() % 5;
        profile = numbers(light.profile_count, SOFTSHADOW_F32);
        light.profile = profile;
    }
    uint32_t id;
    checked(s->handle, add ? softshadow_add_light(s->handle, &light, &id)
                           : softshadow_set_light(s->handle, &light));
    free(profile);
}

static void build(session *s) {
    softshadow_build build = SOFTSHADOW_BUILD_INIT;
    softshadow_method method = SOFTSHADOW_METHOD_INIT;
    uint32_t count;
    double bounds[6];
    must(softshadow_method_count(&count) == SOFTSHADOW_OK && count > 0);
    must(softshadow_method_info(byte() % count, &method) == SOFTSHADOW_OK);
    build.method = method.name;
    build.resolution = 1 + byte() % 64;
    build.layers = byte() % 5, build.max_samples = byte();
    build.samples = byte() % 4 ? 0 : word() % 2048;
    build.falloff = byte() % 5, build.weighting = byte() % 4;
    build.mask_taps = byte() % 10, build.blur = byte() & 1, build.sub_lights = byte() % 10;
    const uint8_t extra = byte();
    if (extra & 1) build.tolerance = number();
    if (extra & 2) build.depth_bias = number();
    if (extra & 4) build.smoothie_width = number();
    for (int i = 0; i < 6 && extra & 8; i++) bounds[i] = number();
    if (extra & 8) build.bounds = bounds;
    /* Ever finer tolerances take ever more samples; that is time, not a defect. */
    if (build.tolerance > 0 && build.tolerance < 1e-3) build.tolerance = 1e-3;
    checked(s->handle, softshadow_build_maps(s->handle, extra & 16 ? NULL : &build));
}

/* Few samples: each is a ray, and so many times as slow under the fuzzer's instruments. */
static void measure(session *s, const softshadow_points *points) {
    softshadow_error e = SOFTSHADOW_ERROR_INIT;
    e.samples = 40, e.max_points = 7;
    const softshadow_status status =
        checked(s->handle, softshadow_measure_error(s->handle, points, &e));
    const double all[] = {e.rms, e.max, e.p99, e.reference_error};
    must(e.points <= 7 && (status == SOFTSHADOW_OK || e.points == 0));
    for (int i = 0; i < 4; i++) must(e.points ? all[i] >= 0 && all[i] <= 1 : isnan(all[i]));
    must(e.points ? fabs(e.mean) <= 1 : isnan(e.mean));
}

static void query(session *s) {
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    points.count = byte() % (POINTS + 1);
    points.position_type = byte() % 8 ? byte() & 1 : byte();
    points.light = byte() % 3;
    const uint8_t extra = byte();
    void *positions = numbers(3 * points.count, points.position_type);
    float *normals = extra & 1 ? numbers(3 * points.count, SOFTSHADOW_F32) : NULL;
    uint32_t *ids = extra & 2 ? zeroed(points.count, sizeof *ids) : NULL;
    uint64_t *primitives = extra & 4 ? zeroed(points.count, sizeof *primitives) : NULL;
    float *bound = extra & 8 ? zeroed(points.count, sizeof *bound) : NULL;
    for (size_t i = 0; i < points.count; i++) {
        if (ids) ids[i] = byte() % 3;
        if (primitives) {
            const uint8_t b = byte();
            primitives[i] = b > 200 ? SOFTSHADOW_NO_PRIMITIVE
                                    : (uint64_t)(b % MESHES) << 32 | byte() % TRIANGLES;
        }
    }
    if (extra & 16) points.width = byte() % 9;
    points.positions = extra & 32 ? NULL : positions;
    points.normals = normals, points.ids = ids, points.primitives = primitives;
    points.error_bound = bound;
    float *visibility = zeroed(points.count, sizeof *visibility);
    const softshadow_status status =
        checked(s->handle, softshadow_query_visibility(s->handle, &points, visibility));
    check_visibility(status, visibility, points.count);
    for (size_t i = 0; bound && status == SOFTSHADOW_OK && i < points.count; i++) {
        must(isnan(bound[i]) || bound[i] >= 0);
    }
    if (extra & 64) measure(s, &points);
    free(positions), free(normals), free(ids), free(primitives), free(bound), free(visibility);
}

static void explain(session *s) {
    softshadow_explanation e = SOFTSHADOW_EXPLANATION_INIT;
    for (int k = 0; k < 3; k++) e.point[k] = number();
    e.light = byte() % 3, e.size = byte() % 20;
    const size_t count = (size_t)e.size * e.size;
    e.image = zeroed(count, sizeof *e.image), e.hider = zeroed(count, sizeof *e.hider);
    checked(s->handle, softshadow_explain(s->handle, &e));
    free(e.image), free(e.hider);
}

static void look(session *s) {
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    softshadow_mesh_report report = SOFTSHADOW_MESH_REPORT_INIT;
    uint32_t count = 0;
    checked(s->handle, softshadow_get_stats(s->handle, &stats));
    checked(s->handle, softshadow_mesh_info(s->handle, byte() % MESHES, &report));
    if (checked(s->handle, softshadow_map_count(s->handle, &count))) return;
    for (uint32_t i = 0; i <= count; i++) {
        softshadow_map map = SOFTSHADOW_MAP_INIT;
        const softshadow_status status = checked(s->handle, softshadow_get_map(s->handle, i, &map));
        must((status == SOFTSHADOW_OK) == (i < count));
        if (status) continue;
        const size_t size = (size_t)map.width * map.height * map.channels;
        volatile float last = size ? map.pixels[size - 1] : 0; /* all of it may be read */
        (void)last;
    }
}

/* A scene that is in order, so that few bytes lead to a query. */
static void start_well(session *s) {
    static const float positions[] = {-1, -1, 1, 1, -1, 1, 0, 1, 1};
    static const uint32_t indices[] = {0, 1, 2};
    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    softshadow_light light = SOFTSHADOW_LIGHT_INIT;
    mesh.positions = positions, mesh.vertex_count = 3;
    mesh.indices = indices, mesh.triangle_count = 1;
    must(softshadow_add_mesh(s->handle, &mesh, NULL) == SOFTSHADOW_OK);
    light.position[2] = 3, light.radius = .5;
    must(softshadow_set_light(s->handle, &light) == SOFTSHADOW_OK);
    build(s);
}

static void call(session *s) {
    switch (byte() % 10) {
    case 0: case 1: put_mesh(s, false); break;
    case 2: put_mesh(s, true); break;
    case 3: checked(s->handle, softshadow_remove_mesh(s->handle, byte() % MESHES)); break;
    case 4: put_light(s, false); break;
    case 5: put_light(s, true); break;
    case 6: build(s); break;
    case 7: query(s); break;
    case 8: explain(s); break;
    default: look(s); break;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    session s = {0};
    softshadow_options options = SOFTSHADOW_OPTIONS_INIT;
    tape = data, tape_end = data + size;
    const uint8_t first = byte();
    options.threads = first % 16 == 1 ? 2 : 1; /* seldom two, which takes ten times as long */
    must(softshadow_create(&s.handle, &options) == SOFTSHADOW_OK);
    if (first & 2) start_well(&s);
    for (int i = 0; i < CALLS && tape < tape_end; i++) call(&s);
    softshadow_destroy(s.handle);
    for (uint32_t i = 0; i < s.kept_count; i++) free(s.kept[i]);
    return 0;
}
