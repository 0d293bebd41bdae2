/* Inks: of all that is offered a texel, the least key, of equals the first triangle. Three
 * dispatches a list: the least key by an atomic minimum, the first who has it by another, then that
 * one's value. */
#include "raster/egl/passes.h"

#include "base/clock.h"
#include "base/memory.h"
#include "raster/egl/walk.h"

enum { VALUES = 1, KEYS = 2, BEFORE = 3, TABLES = 4, WINNERS = 7 };

#define OFFER_GLSL                                                                                 \
    "bool offer(uint tag, ivec2 texel, vec4 varied, precise out float key, out vec4 value);\n"             \
    "layout(location = 2) uniform uint first_key;\n"                                               \
    "layout(std430, binding = 2) buffer Keys { uint keys[]; };\n"                                  \
    "layout(std430, binding = 7) buffer Winners { uint winners[]; };\n"                            \
    "bool offered(uint scan, ivec2 at, precise out float key, out vec4 value) {\n"                         \
    "    vec4 a;\n"                                                                                \
    "    for (int k = 0; k < 4; k++) a[k] = varied(scan, k, at);\n"                                \
    "    return offer(scans[scan].tag, at, a, key, value) && key < uintBitsToFloat(first_key);\n"  \
    "}\n"

static const char least_key[] = SS_WALK_GLSL SS_WALK_PIECES_GLSL OFFER_GLSL
    "void texel(uint scan, ivec2 at, uint index) {\n"
    "    float key; vec4 value;\n"
    "    if (offered(scan, at, key, value)) atomicMin(keys[index], ordered(key));\n"
    "}\n";

static const char first_of_equals[] = SS_WALK_GLSL SS_WALK_PIECES_GLSL OFFER_GLSL
    "layout(std430, binding = 3) readonly buffer Before { uint before[]; };\n"
    "void texel(uint scan, ivec2 at, uint index) {\n"
    "    float key; vec4 value;\n"
    "    if (keys[index] == before[index]) return;\n" /* an earlier list's is as good */
    "    if (offered(scan, at, key, value) && ordered(key) == keys[index]) "
    "atomicMin(winners[index], scan);\n"
    "}\n";

static const char its_value[] = SS_WALK_GLSL OFFER_GLSL
    "layout(std430, binding = 1) writeonly buffer Values { vec4 values[]; };\n"
    "layout(std430, binding = 3) writeonly buffer Before { uint before[]; };\n"
    "void main() {\n"
    "    uint i = invocation();\n"
    "    if (i >= count || winners[i] == 0xffffffffu) return;\n"
    "    float key; vec4 value;\n"
    "    offered(winners[i], ivec2(i % resolution, i / resolution), key, value);\n"
    "    values[i] = value, before[i] = keys[i], winners[i] = 0xffffffffu;\n"
    "}\n";

/* ---- on the private thread ------------------------------------------------------------------- */

typedef struct keeping {
    ss_egl_job job;
    ss_walk walk;
    GLuint pieces, values; /* which take turns as binding 1 */
    const ss_raster_ink *ink;
    const ss_walk_list *list;
    uint32_t *key; /* what comes back; NULL: nothing */
    float (*value)[4];
} keeping;

static size_t texels_of(const keeping *k) {
    return (size_t)k->walk.resolution * k->walk.resolution;
}

/* The same order as in the shaders. */
static uint32_t ordered(float f) {
    union {
        float f;
        uint32_t bits;
    } u = {f == 0 ? 0 : f};
    return u.bits & 0x80000000u ? ~u.bits : u.bits | 0x80000000u;
}

static float unordered(uint32_t bits) {
    union {
        uint32_t bits;
        float f;
    } u = {bits & 0x80000000u ? bits & 0x7fffffffu : ~bits};
    return u.f;
}

static softshadow_status fill(ss_egl_context *c, GLuint buffer, size_t texels, uint32_t value) {
    const softshadow_status status = ss_egl_upload(c, buffer, NULL, texels * sizeof value);
    if (status) return status;
    c->gl.ClearBufferData(GL_SHADER_STORAGE_BUFFER, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT,
                          &value);
    return ss_egl_check(c, "clearing a map");
}

static softshadow_status start(ss_egl_job *job, ss_egl_context *c) {
    keeping *k = (keeping *)job;
    const size_t n = texels_of(k);
    const uint32_t first = ordered(k->ink->first_key);
    const double begun = ss_clock();
    k->walk.generation = job->generation;
    c->gl.GenBuffers(SS_WALK_BUFFERS, k->walk.buffer);
    c->gl.GenBuffers(1, &k->values);
    k->pieces = k->walk.buffer[VALUES];
    softshadow_status status = fill(c, k->walk.buffer[KEYS], n, first);
    if (!status) status = fill(c, k->walk.buffer[BEFORE], n, first);
    if (!status) status = fill(c, k->walk.buffer[WINNERS], n, UINT32_MAX);
    if (!status) status = ss_egl_upload(c, k->values, NULL, n * sizeof *k->value);
    for (uint32_t i = 0; i < k->ink->tables && !status; i++) {
        status = ss_egl_upload(c, k->walk.buffer[TABLES + i], k->ink->table[i].data,
                               k->ink->table[i].size);
    }
    job->spent.up += ss_clock() - begun;
    if (status) ss_walk_delete(c, &k->walk), c->gl.DeleteBuffers(1, &k->values);
    return status;
}

static softshadow_status dispatch(ss_egl_context *c, keeping *k, const char *pass, size_t count) {
    union {
        float f;
        uint32_t bits;
    } first = {k->ink->first_key};
    GLuint program;
    const softshadow_status status = ss_egl_compile(c, pass, k->ink->offer_glsl, &program);
    if (status) return status;
    c->gl.UseProgram(program);
    c->gl.Uniform1ui(2, first.bits);
    return ss_walk_dispatch(c, &k->walk, program, count);
}

static softshadow_status keep_list(ss_egl_job *job, ss_egl_context *c) {
    keeping *k = (keeping *)job;
    const double begun = ss_clock();
    softshadow_status status = ss_walk_send(c, &k->walk, k->list);
    job->spent.up += ss_clock() - begun;
    if (!status) status = dispatch(c, k, least_key, k->list->pieces);
    if (!status) status = dispatch(c, k, first_of_equals, k->list->pieces);
    k->walk.buffer[VALUES] = k->values;
    if (!status) status = dispatch(c, k, its_value, texels_of(k));
    k->walk.buffer[VALUES] = k->pieces;
    return status;
}

static void read_back(ss_egl_context *c, GLuint buffer, void *to, size_t size) {
    c->gl.BindBuffer(GL_SHADER_STORAGE_BUFFER, buffer);
    c->gl.GetBufferSubData(GL_SHADER_STORAGE_BUFFER, 0, (GLsizeiptr)size, to);
}

static softshadow_status stop(ss_egl_job *job, ss_egl_context *c) {
    keeping *k = (keeping *)job;
    softshadow_status status = SOFTSHADOW_OK;
    if (k->key) {
        c->gl.Finish();
        const double begun = ss_clock();
        read_back(c, k->walk.buffer[KEYS], k->key, texels_of(k) * sizeof *k->key);
        read_back(c, k->values, k->value, texels_of(k) * sizeof *k->value);
        job->spent.down += ss_clock() - begun;
        status = ss_egl_check(c, "reading a map");
    }
    ss_walk_delete(c, &k->walk);
    c->gl.DeleteBuffers(1, &k->values);
    return status;
}

/* ---- on the caller's ------------------------------------------------------------------------- */

static softshadow_status add_polygon(const ss_raster_polygon *polygon, uint32_t resolution,
                                     ss_walk_list *list) {
    ss_scan_corner corner[SS_CLIP_MOST];
    const int count = ss_raster_polygon_corners(polygon, corner);
    const bool quad = polygon->corners == 4 && count == 4;
    ss_scan whole;
    const bool shared = quad && ss_scan_quad(&whole, corner, resolution);
    softshadow_status status = SOFTSHADOW_OK;
    for (int i = 2; i < count && !status; i++) {
        const ss_scan_corner part[3] = {corner[0], corner[i - 1], corner[i]};
        ss_scan scan;
        if (!ss_scan_snap(&scan, part, resolution)) continue;
        if (shared) ss_scan_share(&scan, &whole);
        else ss_scan_gradients(&scan, part, SS_RASTER_ATTRIBUTES);
        status = ss_walk_list_add(list, &scan, polygon->tag, 0);
    }
    return status;
}

static softshadow_status keep_all(const ss_raster_polygon *polygons, size_t count, keeping *k) {
    ss_walk_list list = {0};
    softshadow_status status = SOFTSHADOW_OK;
    k->list = &list;
    for (size_t t = 0; t < count && !status; t++) {
        status = add_polygon(&polygons[t], k->walk.resolution, &list);
        if (status || (t + 1 < count && !ss_walk_list_full(&list)) || !list.pieces) continue;
        k->job = (ss_egl_job){.begin = keep_list, .generation = k->walk.generation};
        status = ss_egl_run(&k->job);
        list.scans = list.pieces = 0;
    }
    ss_walk_list_free(&list);
    return status;
}

static void hand_back(const keeping *k) {
    const uint32_t side = k->walk.resolution, *bits = k->key;
    const uint32_t first = ordered(k->ink->first_key);
    for (size_t i = 0; i < texels_of(k); i++) {
        if (bits[i] == first) continue;
        k->ink->keep(k->ink->keep_ctx, (uint32_t)(i % side), (uint32_t)(i / side),
                     unordered(bits[i]), k->value[i]);
    }
}

static softshadow_status keep_on(const ss_raster_polygon *polygons, size_t count, keeping *k) {
    k->job = (ss_egl_job){.begin = start};
    softshadow_status status = ss_egl_run(&k->job);
    if (status) return status;
    status = keep_all(polygons, count, k);
    uint32_t *const key = k->key;
    if (status) k->key = NULL;
    k->job = (ss_egl_job){.begin = stop, .generation = k->walk.generation};
    ss_egl_begin(&k->job);
    if (status)
        ss_egl_join(&k->job);
    else
        status = ss_egl_end(&k->job);
    k->key = key;
    if (!status) hand_back(k);
    return status;
}

softshadow_status ss_egl_keep(const ss_raster_polygon *polygons, size_t count,
                              uint32_t resolution, const ss_raster_ink *ink, ss_pool *pool) {
    (void)pool;
    if (ink->tables > SS_RASTER_INK_TABLES) {
        return ss_fail(SOFTSHADOW_E_INTERNAL, "EGL: an ink with %u tables", ink->tables);
    }
    keeping k = {.walk.resolution = resolution, .ink = ink};
    k.key = ss_alloc(texels_of(&k), sizeof *k.key);
    k.value = ss_alloc(texels_of(&k), sizeof *k.value);
    softshadow_status status = SOFTSHADOW_OK;
    if (!k.key || !k.value)
        status = ss_fail(SOFTSHADOW_E_MEMORY, "map: out of memory for its texels");
    if (!status) status = keep_on(polygons, count, &k);
    ss_free(k.key);
    ss_free(k.value);
    return status;
}
