#include "raster/egl/walk.h"

#include "base/memory.h"

#define MOST_SCANS  ((size_t)1 << 16) /* 8 MiB */
#define MOST_PIECES ((size_t)1 << 18) /* 6 MiB; one scan may exceed it by its own */
#define GROUP       64

void ss_walk_list_free(ss_walk_list *list) {
    ss_free(list->scan);
    ss_free(list->piece);
    *list = (ss_walk_list){0};
}

bool ss_walk_list_full(const ss_walk_list *list) {
    return list->scans >= MOST_SCANS || list->pieces >= MOST_PIECES;
}

static bool grow(void **items, size_t used, size_t *room, size_t size) {
    if (used < *room) return true;
    const size_t wanted = *room ? 2 * *room : 4096;
    void *grown = ss_grow(*items, used, wanted, size);
    if (grown) *items = grown, *room = wanted;
    return grown != NULL;
}

static bool add_piece(ss_walk_list *list, const ss_scan_block *block) {
    if (!grow((void **)&list->piece, list->pieces, &list->piece_room, sizeof *list->piece))
        return false;
    ss_walk_piece *piece = &list->piece[list->pieces++];
    piece->scan = (uint32_t)list->scans;
    piece->corner = (uint32_t)block->x | (uint32_t)block->y << 16;
    piece->size = (uint32_t)block->width | (uint32_t)block->height << 16;
    for (int i = 0; i < 3; i++) piece->at[i] = block->e[i].at;
    return true;
}

static void describe(ss_walk_scan *out, const ss_scan *scan, const ss_scan_block *any, uint32_t tag,
                     float bias) {
    *out = (ss_walk_scan){
        .first_x = scan->first_x, .first_y = scan->first_y, .tag = tag, .bias = bias};
    for (int i = 0; i < 3; i++) out->right[i] = any->e[i].right, out->up[i] = any->e[i].up;
    for (int k = 0; k < SS_RASTER_ATTRIBUTES; k++) {
        out->start[k] = scan->start[k], out->step_x[k] = scan->step_x[k];
        out->step_y[k] = scan->step_y[k];
        out->least[k] = scan->least[k], out->most[k] = scan->most[k];
    }
}

static int32_t least(int32_t a, int32_t b) { return a < b ? a : b; }

softshadow_status ss_walk_list_add(ss_walk_list *list, const ss_scan *scan, uint32_t tag,
                                   float bias) {
    const size_t before = list->pieces;
    bool room = grow((void **)&list->scan, list->scans, &list->scan_room, sizeof *list->scan);
    if (ss_scan_area(scan) == 0) return SOFTSHADOW_OK;
    for (int32_t y = scan->first_y; y <= scan->last_y && room; y += SS_WALK_PIECE) {
        for (int32_t x = scan->first_x; x <= scan->last_x && room; x += SS_WALK_PIECE) {
            ss_scan_block block = {.x = x,
                                   .y = y,
                                   .width = least(SS_WALK_PIECE, scan->last_x - x + 1),
                                   .height = least(SS_WALK_PIECE, scan->last_y - y + 1)};
            if (!ss_scan_block_set(&block, scan)) continue;
            room = add_piece(list, &block);
            if (room && list->pieces == before + 1) {
                describe(&list->scan[list->scans], scan, &block, tag, bias);
            }
        }
    }
    if (!room)
        return ss_fail(SOFTSHADOW_E_MEMORY, "map: out of memory for %zu triangles", list->scans);
    if (list->pieces > before) list->scans++;
    return SOFTSHADOW_OK;
}

/* ---- on the private thread ------------------------------------------------------------------- */

softshadow_status ss_walk_dispatch(ss_egl_context *c, const ss_walk *walk, GLuint program,
                                   size_t count) {
    const ss_gl *gl = &c->gl;
    gl->UseProgram(program);
    gl->Uniform1ui(0, (GLuint)count);
    gl->Uniform1ui(1, walk->resolution);
    for (GLuint i = 0; i < SS_WALK_BUFFERS; i++) {
        if (walk->buffer[i]) gl->BindBufferBase(GL_SHADER_STORAGE_BUFFER, i, walk->buffer[i]);
    }
    const size_t groups = (count + GROUP - 1) / GROUP, across = groups < 4096 ? groups : 4096;
    if (groups) gl->DispatchCompute((GLuint)across, (GLuint)((groups + across - 1) / across), 1);
    gl->MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    return ss_egl_check(c, "drawing");
}

softshadow_status ss_walk_send(ss_egl_context *c, ss_walk *walk, const ss_walk_list *list) {
    softshadow_status status =
        ss_egl_upload(c, walk->buffer[0], list->scan, list->scans * sizeof *list->scan);
    if (status) return status;
    return ss_egl_upload(c, walk->buffer[1], list->piece, list->pieces * sizeof *list->piece);
}

void ss_walk_delete(ss_egl_context *c, ss_walk *walk) {
    c->gl.DeleteBuffers(SS_WALK_BUFFERS, walk->buffer);
    for (int i = 0; i < SS_WALK_BUFFERS; i++) walk->buffer[i] = 0;
}
