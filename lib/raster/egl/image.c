/* Images that are worked over: one invocation a pixel, two buffers that take turns. */
#include "raster/egl/passes.h"

#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "raster/egl/ask.h"

#define GROUP  64
#define ACROSS 4096 /* groups along the first axis of a dispatch */

enum { BEFORE, AFTER, IDS, BUFFERS };

static const char head[] =
    "#version 430\n"
    "layout(local_size_x = 64) in;\n"
    "layout(std430, binding = 0) readonly buffer Before { uint before[]; };\n"
    "layout(std430, binding = 1) writeonly buffer After { uint after[]; };\n"
    "layout(std430, binding = 2) readonly buffer Ids { uint ids[]; };\n"
    "layout(location = 0) uniform uint width;\n"
    "layout(location = 1) uniform uint height;\n"
    "layout(location = 2) uniform uint number;\n"
    "layout(location = 3) uniform uint many;\n"
    "layout(location = 4) uniform uint pass;\n"
    "uint id_of(uint i) { return many != 0u ? ids[i] : 0u; }\n"
    "uint pixel(uvec2 at, uint pass);\n"
    "void main() {\n"
    "    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;\n"
    "    uint i = group * 64u + gl_LocalInvocationID.x;\n"
    "    if (i < width * height) after[i] = pixel(uvec2(i % width, i / width), pass);\n"
    "}\n";

typedef struct working {
    ss_egl_job job;
    const ss_raster_image *image;
    size_t pixels;
    float *values; /* what comes back: also of a context that turns out to be lost */
    GLuint buffer[BUFFERS];
} working;

static softshadow_status send(ss_egl_context *c, working *w) {
    const size_t size = w->pixels * sizeof(float);
    const uint32_t *ids = w->image->ids;
    softshadow_status status = ss_egl_upload(c, w->buffer[BEFORE], w->image->values, size);
    if (!status) status = ss_egl_upload(c, w->buffer[AFTER], NULL, size);
    if (!status) status = ss_egl_upload(c, w->buffer[IDS], ids, ids ? size : 0);
    return status;
}

static softshadow_status work(ss_egl_context *c, working *w, GLuint program) {
    const ss_gl *gl = &c->gl;
    const ss_raster_image *image = w->image;
    const size_t groups = (w->pixels + GROUP - 1) / GROUP,
                 across = groups < ACROSS ? groups : ACROSS;
    gl->UseProgram(program);
    gl->Uniform1ui(0, image->width), gl->Uniform1ui(1, image->height);
    gl->Uniform1ui(2, image->number), gl->Uniform1ui(3, image->ids != NULL);
    gl->BindBufferBase(GL_SHADER_STORAGE_BUFFER, IDS, w->buffer[IDS]);
    for (uint32_t pass = 0; pass < image->passes; pass++) {
        gl->Uniform1ui(4, pass);
        for (GLuint i = BEFORE; i <= AFTER; i++)
            gl->BindBufferBase(GL_SHADER_STORAGE_BUFFER, i, w->buffer[(i + pass) % 2]);
        gl->DispatchCompute((GLuint)across, (GLuint)((groups + across - 1) / across), 1);
        gl->MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    }
    gl->Finish();
    return ss_egl_check(c, "working over an image");
}

static softshadow_status receive(ss_egl_context *c, const working *w) {
    c->gl.BindBuffer(GL_SHADER_STORAGE_BUFFER, w->buffer[w->image->passes % 2]);
    c->gl.GetBufferSubData(GL_SHADER_STORAGE_BUFFER, 0, (GLsizeiptr)(w->pixels * sizeof(float)),
                           w->values);
    return ss_egl_check(c, "reading an image");
}

static softshadow_status begin(ss_egl_job *job, ss_egl_context *c) {
    working *w = (working *)job;
    GLuint program;
    softshadow_status status = ss_egl_compile(c, head, w->image->glsl, &program);
    if (status) return status;
    c->gl.GenBuffers(BUFFERS, w->buffer);
    double start = ss_clock();
    status = send(c, w);
    job->spent.up = ss_clock() - start;
    if (!status) status = work(c, w, program);
    start = ss_clock();
    if (!status) status = receive(c, w);
    job->spent.down = ss_clock() - start;
    c->gl.DeleteBuffers(BUFFERS, w->buffer);
    return status;
}

softshadow_status ss_egl_work(const ss_raster_image *image) {
    working w = {.job.begin = begin,
                 .image = image,
                 .pixels = (size_t)image->width * image->height};
    if (w.pixels > UINT32_MAX) {
        return ss_fail(SOFTSHADOW_E_BACKEND, "EGL: an image of %zu pixels, must be below 2^32",
                       w.pixels);
    }
    if (!w.pixels) return SOFTSHADOW_OK;
    w.values = ss_alloc(w.pixels, sizeof *w.values);
    if (!w.values) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu pixels", w.pixels);
    const softshadow_status status = ss_egl_run(&w.job);
    if (!status) memcpy(image->values, w.values, w.pixels * sizeof *w.values);
    ss_free(w.values);
    return status;
}
