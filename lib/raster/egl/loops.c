/* How many steps a device's loops take. Mesa's software driver leaves all loops for good once those
 * of the 4 to 16 invocations that run together have gone round 65,535 times in all, and says
 * nothing: a shader then gives whatever it had got to. What no driver tells is tried. */
#include "raster/egl/ask.h"

#define MANY 1000000u /* a millisecond or two of one invocation */
#define SOME 60000u
/* Where there is an end: what invocations that run together take in two loops one after the other,
 * if each counts what the slowest may need, and as much as half of one for what comes before. */
#define FEW 25000u

static const char loop[] = "#version 430\n"
                           "layout(local_size_x = 1) in;\n"
                           "layout(std430, binding = 0) buffer Words { uint words[]; };\n"
                           "void main() {\n"
                           "    uint x = words[0], n = words[1];\n"
                           "    for (uint i = 0u; i < n; i++) x = x * 1664525u + 1013904223u;\n"
                           "    words[0] = x;\n"
                           "}\n";

static softshadow_status go_round(ss_egl_context *c, GLuint program, GLuint buffer, uint32_t n,
                                  bool *all) {
    const ss_gl *gl = &c->gl;
    uint32_t words[2] = {7, n}, last = 7;
    softshadow_status status = ss_egl_upload(c, buffer, words, sizeof words);
    if (status) return status;
    gl->UseProgram(program);
    gl->BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, buffer);
    gl->DispatchCompute(1, 1, 1);
    gl->MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl->GetBufferSubData(GL_SHADER_STORAGE_BUFFER, 0, sizeof words, words);
    for (uint32_t i = 0; i < n; i++) last = last * 1664525u + 1013904223u;
    *all = words[0] == last;
    return ss_egl_check(c, "measuring loops");
}

softshadow_status ss_egl_measure_loops(ss_egl_context *c) {
    GLuint program, buffer;
    bool many = false, some = false;
    if (c->most_steps) return SOFTSHADOW_OK;
    softshadow_status status = ss_egl_compile(c, loop, "", &program);
    if (status) return status;
    c->gl.GenBuffers(1, &buffer);
    status = go_round(c, program, buffer, MANY, &many);
    if (!status && !many) status = go_round(c, program, buffer, SOME, &some);
    c->gl.DeleteBuffers(1, &buffer);
    if (status) return status;
    if (!many && !some && !ss_egl_lost(c)) {
        return ss_fail(SOFTSHADOW_E_BACKEND, "EGL: %s: loops end before %u steps", c->device.name,
                       SOME);
    }
    c->most_steps = many ? UINT32_MAX : FEW;
    return SOFTSHADOW_OK;
}
