/* Questions: a technique's query as a compute shader over chunks of points. */
#include "raster/egl/ask.h"

#include <string.h>

#include "base/clock.h"
#include "base/memory.h"

#define GROUP       64
#define FIRST_TABLE 2 /* binding */
#define STATES      7 /* binding */

static const char head[] =
    "#version 430\n"
    "layout(local_size_x = 64) in;\n"
    "layout(std430, binding = 0) readonly buffer Looks { vec4 looks[]; };\n"
    "layout(std430, binding = 1) writeonly buffer Answers { float answers[]; };\n"
    "layout(location = 0) uniform uint count;\n"
    "float answer(vec3 look, uint face);\n"
    "void main() {\n"
    "    uint i = gl_GlobalInvocationID.x;\n"
    "    if (i >= count) return;\n"
    "    vec4 l = looks[i];\n"
    "    answers[i] = answer(l.xyz, uint(l.w));\n"
    "}\n";

/* The same for what may take many steps: where a device ends loops early, points are taken up again
 * until none is left. */
static const char head_of_parts[] =
    "#version 430\n"
    "layout(local_size_x = 64) in;\n"
    "layout(std430, binding = 0) readonly buffer Looks { vec4 looks[]; };\n"
    "layout(std430, binding = 1) writeonly buffer Answers { float answers[]; };\n"
    "layout(std430, binding = 7) buffer States { uint left; uint unused[3]; uvec4 states[]; };\n"
    "layout(location = 0) uniform uint count;\n"
    "layout(location = 1) uniform uint most_steps;\n"
    "uint steps = 0u;\n"
    "bool advance(vec3 look, uint face, inout uvec4 at);\n"
    "void main() {\n"
    "    uint i = gl_GlobalInvocationID.x;\n"
    "    bool whole = most_steps == 0xffffffffu;\n"
    "    uvec4 at = uvec4(0u);\n"
    "    if (i < count && !whole) at = states[i];\n"
    "    if (i >= count || at.x == 0xffffffffu) return;\n"
    "    vec4 l = looks[i];\n"
    "    bool done = advance(l.xyz, uint(l.w), at);\n"
    "    if (done) answers[i] = uintBitsToFloat(at.x);\n"
    "    if (!whole) states[i] = done ? uvec4(0xffffffffu) : at;\n"
    "    if (!done) atomicAdd(left, 1u);\n"
    "}\n";

struct ss_raster_program {
    unsigned generation;
    bool parts;
    GLuint program, table[SS_RASTER_TABLES];
    uint32_t tables;
};

/* ---- loading --------------------------------------------------------------------------------- */

typedef struct loading {
    ss_egl_job job;
    const ss_raster_question *question;
    ss_raster_program *program;
} loading;

softshadow_status ss_egl_upload(ss_egl_context *c, GLuint buffer, const void *data, size_t size) {
    const ss_gl *gl = &c->gl;
    char doing[80];
    snprintf(doing, sizeof doing, "a buffer of %zu bytes", size);
    if (size > (uint64_t)c->largest) {
        return ss_fail(SOFTSHADOW_E_BACKEND, "EGL: %s: %s, its shaders read at most %lld",
                       c->device.name, doing, (long long)c->largest);
    }
    gl->BindBuffer(GL_SHADER_STORAGE_BUFFER, buffer);
    gl->BufferData(GL_SHADER_STORAGE_BUFFER, (GLsizeiptr)(size ? size : 4), data, GL_DYNAMIC_DRAW);
    return ss_egl_check(c, doing);
}

static softshadow_status load_tables(ss_egl_job *job, ss_egl_context *c) {
    const loading *l = (const loading *)job;
    ss_raster_program *p = l->program;
    const double start = ss_clock();
    p->generation = job->generation;
    c->gl.GenBuffers((GLsizei)p->tables, p->table);
    softshadow_status status = p->parts ? ss_egl_measure_loops(c) : SOFTSHADOW_OK;
    if (!status) {
        status = ss_egl_compile(c, p->parts ? head_of_parts : head, l->question->glsl, &p->program);
    }
    for (uint32_t i = 0; i < p->tables && !status; i++) {
        status =
            ss_egl_upload(c, p->table[i], l->question->table[i].data, l->question->table[i].size);
    }
    if (status) c->gl.DeleteBuffers((GLsizei)p->tables, p->table);
    job->spent.up = ss_clock() - start;
    return status;
}

softshadow_status ss_egl_program_load(const ss_raster_question *question, ss_raster_program **out) {
    *out = NULL;
    ss_raster_program *program = ss_alloc(1, sizeof *program);
    if (!program) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory");
    program->tables = question->tables, program->parts = question->parts;
    loading l = {.job.begin = load_tables, .question = question, .program = program};
    const softshadow_status status = ss_egl_run(&l.job);
    if (status)
        ss_free(program);
    else
        *out = program;
    return status;
}

static softshadow_status delete_tables(ss_egl_job *job, ss_egl_context *c) {
    const ss_raster_program *p = ((const loading *)job)->program;
    c->gl.DeleteBuffers((GLsizei)p->tables, p->table);
    return SOFTSHADOW_OK;
}

/* Fails only where the context is gone, and the tables with it. */
void ss_egl_program_unload(ss_raster_program *program) {
    if (!program) return;
    loading l = {.job = {.begin = delete_tables, .generation = program->generation},
                 .program = program};
    if (ss_egl_here()) ss_egl_begin(&l.job), ss_egl_join(&l.job);
    ss_free(program);
}

/* ---- asking ---------------------------------------------------------------------------------- */

struct ss_raster_ticket {
    ss_egl_job job;
    const ss_raster_program *program;
    const ss_raster_look *looks;
    float *answers;
    size_t n;
    GLuint buffer[3]; /* looks, answers, states */
    GLsync fence;
};

/* How many points are to be taken up again? */
static softshadow_status read_left(ss_egl_context *c, const ss_raster_ticket *t, uint32_t *left) {
    const ss_gl *gl = &c->gl;
    *left = 0;
    gl->BindBuffer(GL_SHADER_STORAGE_BUFFER, t->buffer[2]);
    gl->GetBufferSubData(GL_SHADER_STORAGE_BUFFER, 0, sizeof *left, left);
    if (*left) gl->BufferSubData(GL_SHADER_STORAGE_BUFFER, 0, sizeof *left, &(GLuint){0});
    const softshadow_status status = ss_egl_check(c, "asking points");
    if (status || ss_egl_lost(c)) *left = 0;
    return status;
}

static softshadow_status make_states(ss_egl_context *c, const ss_raster_ticket *t) {
    if (!t->program->parts) return SOFTSHADOW_OK;
    const size_t kept = c->most_steps == UINT32_MAX ? 0 : t->n;
    const softshadow_status status = ss_egl_upload(c, t->buffer[2], NULL, 16 + 16 * kept);
    if (status) return status;
    c->gl.ClearBufferData(GL_SHADER_STORAGE_BUFFER, GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT,
                          &(GLuint){0});
    return ss_egl_check(c, "clearing states");
}

static softshadow_status dispatch(ss_egl_context *c, const ss_raster_ticket *t) {
    const ss_raster_program *p = t->program;
    const ss_gl *gl = &c->gl;
    const bool again = p->parts && c->most_steps < UINT32_MAX;
    softshadow_status status = SOFTSHADOW_OK;
    gl->UseProgram(p->program);
    gl->Uniform1ui(0, (GLuint)t->n);
    if (p->parts) gl->Uniform1ui(1, c->most_steps);
    for (GLuint i = 0; i < 2; i++) gl->BindBufferBase(GL_SHADER_STORAGE_BUFFER, i, t->buffer[i]);
    if (p->parts) gl->BindBufferBase(GL_SHADER_STORAGE_BUFFER, STATES, t->buffer[2]);
    for (GLuint i = 0; i < p->tables; i++) {
        gl->BindBufferBase(GL_SHADER_STORAGE_BUFFER, FIRST_TABLE + i, p->table[i]);
    }
    for (uint32_t left = 1; left && !status;) {
        gl->DispatchCompute((GLuint)((t->n + GROUP - 1) / GROUP), 1, 1);
        gl->MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
        left = 0;
        if (again) status = read_left(c, t, &left);
    }
    return status;
}

static softshadow_status begin(ss_egl_job *job, ss_egl_context *c) {
    ss_raster_ticket *t = (ss_raster_ticket *)job;
    const ss_gl *gl = &c->gl;
    const double start = ss_clock();
    gl->GenBuffers(3, t->buffer);
    softshadow_status status = ss_egl_upload(c, t->buffer[0], t->looks, t->n * sizeof *t->looks);
    if (!status) status = ss_egl_upload(c, t->buffer[1], NULL, t->n * sizeof *t->answers);
    if (!status) status = make_states(c, t);
    job->spent.up = ss_clock() - start;
    if (!status) status = dispatch(c, t);
    if (!status) {
        t->fence = gl->FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
        status = ss_egl_check(c, "asking points");
    }
    if (status) gl->DeleteBuffers(3, t->buffer);
    return status;
}

static softshadow_status end(ss_egl_job *job, ss_egl_context *c) {
    ss_raster_ticket *t = (ss_raster_ticket *)job;
    const ss_gl *gl = &c->gl;
    while (gl->ClientWaitSync(t->fence, GL_SYNC_FLUSH_COMMANDS_BIT, 1000000000) ==
               GL_TIMEOUT_EXPIRED &&
           !ss_egl_lost(c)) {
    }
    const double start = ss_clock();
    gl->BindBuffer(GL_SHADER_STORAGE_BUFFER, t->buffer[1]);
    gl->GetBufferSubData(GL_SHADER_STORAGE_BUFFER, 0, (GLsizeiptr)(t->n * sizeof *t->answers),
                         t->answers);
    job->spent.down = ss_clock() - start;
    gl->DeleteSync(t->fence);
    gl->DeleteBuffers(3, t->buffer);
    return ss_egl_check(c, "reading answers");
}

softshadow_status ss_egl_submit(ss_raster_program *program, const ss_raster_look *looks, size_t n,
                                float *answers, ss_raster_ticket **out) {
    ss_raster_ticket *ticket = ss_alloc(1, sizeof *ticket);
    *out = ticket;
    if (!ticket) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory");
    *ticket =
        (ss_raster_ticket){.job = {.begin = begin, .end = end, .generation = program->generation},
                           .program = program,
                           .looks = looks,
                           .answers = answers,
                           .n = n};
    ss_egl_begin(&ticket->job);
    return SOFTSHADOW_OK;
}

softshadow_status ss_egl_wait(ss_raster_ticket *ticket) {
    const softshadow_status status = ss_egl_end(&ticket->job);
    ss_free(ticket);
    return status;
}
