/* Depths and layers: the least of all that covers a texel, kept by an atomic minimum over whole
 * numbers in the order of floats. Its result does not depend on who comes first. Triangles with
 * holes are drawn by the CPU, which can look at their textures, into the plane that the device
 * starts from. */
#include "raster/egl/passes.h"

#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/status.h"
#include "raster/egl/walk.h"

enum { PLANE = 2, ABOVE = 3 };

static const char nearest[] = SS_WALK_GLSL SS_WALK_PIECES_GLSL
    "layout(std430, binding = 2) buffer Plane { uint plane[]; };\n"
    "void texel(uint scan, ivec2 at, uint index) {\n"
    "    precise float h = varied(scan, 0, at) + scans[scan].bias;\n"
    "    atomicMin(plane[index], ordered(h));\n"
    "}\n";

static const char next[] = SS_WALK_GLSL SS_WALK_PIECES_GLSL
    "layout(std430, binding = 2) buffer Plane { uint plane[]; };\n"
    "layout(std430, binding = 3) readonly buffer Above { float above[]; };\n"
    "void texel(uint scan, ivec2 at, uint index) {\n"
    "    precise float h = varied(scan, 0, at) + scans[scan].bias;\n"
    "    if (h > above[index]) atomicMin(plane[index], ordered(h));\n"
    "}\n";

/* Of a plane of floats whole numbers, and back. */
static const char to_order[] =
    SS_WALK_GLSL "layout(std430, binding = 2) buffer Plane { uint plane[]; };\n"
                 "void main() {\n"
                 "    uint i = invocation();\n"
                 "    if (i < count) plane[i] = ordered(uintBitsToFloat(plane[i]));\n"
                 "}\n";
static const char from_order[] =
    SS_WALK_GLSL "layout(std430, binding = 2) buffer Plane { uint plane[]; };\n"
                 "void main() {\n"
                 "    uint i = invocation();\n"
                 "    if (i < count) plane[i] = floatBitsToUint(unordered(plane[i]));\n"
                 "}\n";

/* ---- on the private thread ------------------------------------------------------------------- */

typedef struct drawing {
    ss_egl_job job;
    ss_walk walk;
    const ss_walk_list *list;
    float *plane; /* in: what it starts from */
    const float *above;
} drawing;

static size_t texels_of(const drawing *d) {
    return (size_t)d->walk.resolution * d->walk.resolution;
}

static softshadow_status dispatch(ss_egl_context *c, drawing *d, const char *pass, size_t count) {
    GLuint program;
    const softshadow_status status = ss_egl_compile(c, pass, "", &program);
    return status ? status : ss_walk_dispatch(c, &d->walk, program, count);
}

static softshadow_status start(ss_egl_job *job, ss_egl_context *c) {
    drawing *d = (drawing *)job;
    const size_t size = texels_of(d) * sizeof *d->plane;
    const double begun = ss_clock();
    d->walk.generation = job->generation;
    c->gl.GenBuffers(d->above ? 4 : 3, d->walk.buffer);
    softshadow_status status = ss_egl_upload(c, d->walk.buffer[PLANE], d->plane, size);
    if (!status && d->above) status = ss_egl_upload(c, d->walk.buffer[ABOVE], d->above, size);
    job->spent.up += ss_clock() - begun;
    if (!status) status = dispatch(c, d, to_order, texels_of(d));
    if (status) ss_walk_delete(c, &d->walk);
    return status;
}

static softshadow_status draw_list(ss_egl_job *job, ss_egl_context *c) {
    drawing *d = (drawing *)job;
    const double begun = ss_clock();
    const softshadow_status status = ss_walk_send(c, &d->walk, d->list);
    job->spent.up += ss_clock() - begun;
    return status ? status : dispatch(c, d, d->above ? next : nearest, d->list->pieces);
}

static softshadow_status stop(ss_egl_job *job, ss_egl_context *c) {
    drawing *d = (drawing *)job;
    softshadow_status status = SOFTSHADOW_OK;
    if (d->plane) {
        status = dispatch(c, d, from_order, texels_of(d));
        c->gl.Finish();
        const double begun = ss_clock();
        c->gl.BindBuffer(GL_SHADER_STORAGE_BUFFER, d->walk.buffer[PLANE]);
        c->gl.GetBufferSubData(GL_SHADER_STORAGE_BUFFER, 0,
                               (GLsizeiptr)(texels_of(d) * sizeof *d->plane), d->plane);
        job->spent.down += ss_clock() - begun;
        if (!status) status = ss_egl_check(c, "reading a map");
    }
    ss_walk_delete(c, &d->walk);
    return status;
}

/* ---- on the caller's ------------------------------------------------------------------------- */

static softshadow_status add_triangle(const ss_casters *casters, size_t t, ss_walk_list *list) {
    ss_scan_corner corner[SS_CLIP_MOST];
    int32_t first, last;
    softshadow_status status = SOFTSHADOW_OK;
    const int count = ss_casters_corners(casters, t, corner);
    if (!ss_casters_rows(casters, t, corner, count, &first, &last)) return status;
    if (ss_caster_has_holes(casters->asked->world, t)) return status;
    for (int k = 2; k < count && !status; k++) {
        const ss_scan_corner part[3] = {corner[0], corner[k - 1], corner[k]};
        ss_scan scan = {0};
        if (!ss_scan_snap(&scan, part, casters->asked->resolution)) continue;
        if (ss_casters_turned(casters, &scan)) continue;
        ss_scan_gradients(&scan, part, 1);
        status = ss_walk_list_add(list, &scan, 0, ss_casters_bias(casters, &scan));
    }
    return status;
}

/* One list is filled while the device has the other. */
static softshadow_status draw_all(const ss_casters *casters, drawing *d) {
    const size_t n = casters->asked->world->triangle_count;
    ss_walk_list list[2] = {{0}, {0}};
    softshadow_status status = SOFTSHADOW_OK;
    bool sent = false;
    int filling = 0;
    for (size_t t = 0; t < n && !status; t++) {
        status = add_triangle(casters, t, &list[filling]);
        if (status || (t + 1 < n && !ss_walk_list_full(&list[filling]))) continue;
        if (sent) status = ss_egl_end(&d->job);
        sent = !status && list[filling].pieces > 0;
        if (!sent) continue;
        d->job = (ss_egl_job){.begin = draw_list, .generation = d->walk.generation};
        d->list = &list[filling];
        ss_egl_begin(&d->job);
        filling ^= 1;
        list[filling].scans = list[filling].pieces = 0;
    }
    if (sent) {
        const softshadow_status last = ss_egl_end(&d->job);
        if (!status) status = last;
    }
    for (int i = 0; i < 2; i++) ss_walk_list_free(&list[i]);
    return status;
}

static softshadow_status draw_on(const ss_casters *casters, drawing *d) {
    d->job = (ss_egl_job){.begin = start};
    softshadow_status status = ss_egl_run(&d->job);
    if (status) return status;
    status = draw_all(casters, d);
    if (status) d->plane = NULL; /* nothing to read: only the buffers go */
    d->job = (ss_egl_job){.begin = stop, .generation = d->walk.generation};
    if (!status) return ss_egl_run(&d->job);
    ss_egl_begin(&d->job);
    ss_egl_join(&d->job);
    return status;
}

/* What the CPU has to draw, or nothing. */
static softshadow_status draw_holes(const ss_raster_casters *asked, const float *above,
                                    float *plane, ss_pool *pool) {
    const size_t texels = (size_t)asked->resolution * asked->resolution;
    ss_raster_casters holes = *asked;
    holes.holes_only = true;
    if (asked->world->any_opacity) {
        return above ? ss_raster_cpu.peel(&holes, above, plane, pool)
                     : ss_raster_cpu.depth(&holes, &plane, 1, pool);
    }
    for (size_t i = 0; i < texels; i++) plane[i] = SS_MAP_FAR;
    return SOFTSHADOW_OK;
}

static softshadow_status draw_casters(const ss_raster_casters *asked, const float *above,
                                      float *plane, ss_pool *pool) {
    ss_casters casters = {0};
    drawing d = {.walk.resolution = asked->resolution, .plane = plane, .above = above};
    softshadow_status status = draw_holes(asked, above, plane, pool);
    if (status || asked->holes_only) return status;
    status = ss_casters_project(&casters, asked, pool);
    if (!status) status = draw_on(&casters, &d);
    ss_casters_free(&casters);
    return status;
}

/* Is there anything in a layer that something may lie below? */
static bool begin_below(const float *layer, float *above, size_t texels) {
    bool any = false;
    for (size_t i = 0; i < texels; i++) {
        above[i] = ss_map_below(layer[i]);
        any |= layer[i] != SS_MAP_FAR;
    }
    return any;
}

softshadow_status ss_egl_depth(const ss_raster_casters *casters, float *const layer[],
                               uint32_t layers, ss_pool *pool) {
    const size_t texels = (size_t)casters->resolution * casters->resolution;
    float *above = layers > 1 ? ss_alloc_any(texels, sizeof *above) : NULL;
    softshadow_status status = draw_casters(casters, NULL, layer[0], pool);
    if (layers > 1 && !above && !status)
        status = ss_fail(SOFTSHADOW_E_MEMORY, "map: out of memory for a layer");
    for (uint32_t l = 1; l < layers && !status; l++) {
        if (begin_below(layer[l - 1], above, texels))
            status = draw_casters(casters, above, layer[l], pool);
        else
            memcpy(layer[l], layer[l - 1], texels * sizeof *above);
    }
    ss_free(above);
    return status;
}

softshadow_status ss_egl_peel(const ss_raster_casters *casters, const float *above, float *plane,
                              ss_pool *pool) {
    return draw_casters(casters, above, plane, pool);
}
