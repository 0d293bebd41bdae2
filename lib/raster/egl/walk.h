/* Triangles on their way to the device: set up in C, as for the CPU (setup.h), so that both cover
 * the same texels and say the same about them, and cut into pieces of few texels, one an
 * invocation. */
#ifndef SS_RASTER_EGL_WALK_H
#define SS_RASTER_EGL_WALK_H

#include "raster/casters.h"
#include "raster/egl/ask.h"

#define SS_WALK_PIECE 8 /* texels along each side, at most */

/* The shader's struct Scan. */
typedef struct ss_walk_scan {
    int32_t right[3], up[3]; /* of the edges, counter-clockwise */
    int32_t first_x, first_y;
    float start[SS_RASTER_ATTRIBUTES], step_x[SS_RASTER_ATTRIBUTES], step_y[SS_RASTER_ATTRIBUTES];
    float least[SS_RASTER_ATTRIBUTES], most[SS_RASTER_ATTRIBUTES];
    uint32_t tag;
    float bias;
} ss_walk_scan;

/* The shader's struct Piece. */
typedef struct ss_walk_piece {
    uint32_t scan, corner, size; /* x | y << 16 */
    int32_t at[3];               /* the edges at its first centre */
} ss_walk_piece;

/* As much as goes up at once. */
typedef struct ss_walk_list {
    ss_walk_scan *scan;
    ss_walk_piece *piece;
    size_t scans, scan_room, pieces, piece_room;
} ss_walk_list;

void ss_walk_list_free(ss_walk_list *list);
bool ss_walk_list_full(const ss_walk_list *list);
/* Adds a triangle that is snapped and has its gradients. */
softshadow_status ss_walk_list_add(ss_walk_list *list, const ss_scan *scan, uint32_t tag,
                                   float bias);

/* What begins every pass that walks pieces: it calls
 *   void texel(uint scan, ivec2 at, uint index)
 * for each texel that is covered. */
#define SS_WALK_GLSL \
    "#version 430\n" \
    "layout(local_size_x = 64) in;\n" \
    "layout(location = 0) uniform uint count;\n" \
    "layout(location = 1) uniform uint resolution;\n" \
    "struct Scan {\n" \
    "    int right[3]; int up[3]; int first_x; int first_y;\n" \
    "    float start[4]; float step_x[4]; float step_y[4]; float least[4]; float most[4];\n" \
    "    uint tag; float bias;\n" \
    "};\n" \
    "layout(std430, binding = 0) readonly buffer Scans { Scan scans[]; };\n" \
    /* what varies, as in C, operation by operation */ \
    "float varied(uint scan, int k, ivec2 at) {\n" \
    "    precise float row = scans[scan].start[k] +\n" \
    "        scans[scan].step_y[k] * float(at.y - scans[scan].first_y);\n" \
    "    precise float v = row + scans[scan].step_x[k] * float(at.x - scans[scan].first_x);\n" \
    "    v = v < scans[scan].least[k] ? scans[scan].least[k] : v;\n" \
    "    return v > scans[scan].most[k] ? scans[scan].most[k] : v;\n" \
    "}\n" \
    "uint invocation() {\n" \
    "    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;\n" \
    "    return group * 64u + gl_LocalInvocationID.x;\n" \
    "}\n" \
    /* whole numbers in the order of floats; both zeros alike */ \
    "uint ordered(float f) {\n" \
    "    uint b = f == 0.0 ? 0u : floatBitsToUint(f);\n" \
    "    return (b & 0x80000000u) != 0u ? ~b : b | 0x80000000u;\n" \
    "}\n" \
    "float unordered(uint b) {\n" \
    "    return uintBitsToFloat((b & 0x80000000u) != 0u ? b & 0x7fffffffu : ~b);\n" \
    "}\n"

#define SS_WALK_PIECES_GLSL \
    "struct Piece { uint scan; uint corner; uint size; int at[3]; };\n" \
    "layout(std430, binding = 1) readonly buffer Pieces { Piece pieces[]; };\n" \
    "void texel(uint scan, ivec2 at, uint index);\n" \
    "void main() {\n" \
    "    uint p = invocation();\n" \
    "    if (p >= count) return;\n" \
    "    uint s = pieces[p].scan;\n" \
    "    ivec2 corner = ivec2(pieces[p].corner & 0xffffu, pieces[p].corner >> 16);\n" \
    "    ivec2 size = ivec2(pieces[p].size & 0xffffu, pieces[p].size >> 16);\n" \
    "    ivec3 edge = ivec3(pieces[p].at[0], pieces[p].at[1], pieces[p].at[2]);\n" \
    "    ivec3 right = ivec3(scans[s].right[0], scans[s].right[1], scans[s].right[2]);\n" \
    "    ivec3 up = ivec3(scans[s].up[0], scans[s].up[1], scans[s].up[2]);\n" \
    "    for (int y = 0; y < size.y; y++) {\n" \
    "        ivec3 e = edge + up * y;\n" \
    "        for (int x = 0; x < size.x; x++, e += right) {\n" \
    "            ivec2 at = corner + ivec2(x, y);\n" \
    "            if ((e.x | e.y | e.z) >= 0) texel(s, at, uint(at.y) * resolution + uint(at.x));\n" \
    "        }\n" \
    "    }\n" \
    "}\n"

/* A pass under way: buffers that live from its first list to its last. */
#define SS_WALK_BUFFERS 8
typedef struct ss_walk {
    GLuint buffer[SS_WALK_BUFFERS]; /* by binding; 0: none. 0 and 1 are each list's own */
    unsigned generation;
    uint32_t resolution;
} ss_walk;

/* On the private thread: one dispatch, `count` invocations of at most 2^22. */
softshadow_status ss_walk_dispatch(ss_egl_context *c, const ss_walk *walk, GLuint program,
                                   size_t count);
/* Sends the list up as buffers 0 and 1. */
softshadow_status ss_walk_send(ss_egl_context *c, ss_walk *walk, const ss_walk_list *list);
void ss_walk_delete(ss_egl_context *c, ss_walk *walk);

#endif
