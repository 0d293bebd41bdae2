/* A soup under construction: arrays that grow, faces tiled at the end, corners split by their
 * texture coordinates. */
#include "mesh/builder.h"

#include "softshadow.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

bool cli_builder_no_memory(const cli_builder *builder) {
    return cli_fail(builder->error, CLI_FAILED, "%s: the mesh does not fit in memory",
                    builder->source->name);
}

static size_t position_size(const cli_builder *builder) {
    return builder->mesh.position_type == SOFTSHADOW_F32 ? sizeof(float) : sizeof(double);
}

/* Room for count items of a size; grows by half, so that a mesh costs little more than its size. */
static bool grow(const cli_builder *builder, void *array, size_t *room, size_t count, size_t size) {
    if (count <= *room) return true;
    size_t wanted = *room + *room / 2 > count ? *room + *room / 2 : count, bytes;
    if (wanted < 64) wanted = 64;
    void *grown = NULL, *old; /* array points to a pointer of any type, hence memcpy */
    memcpy(&old, array, sizeof old);
    if (!__builtin_mul_overflow(wanted, size, &bytes)) grown = realloc(old, bytes);
    if (!grown) return cli_builder_no_memory(builder);
    memcpy(array, &grown, sizeof grown);
    *room = wanted;
    return true;
}

static bool grow_triangles(cli_builder *builder, size_t count) {
    if (builder->corner_uvs) {
        size_t room = builder->triangle_room;
        if (!grow(builder, &builder->uv_indices, &room, count, 3 * sizeof(uint32_t))) return false;
    }
    return grow(builder, &builder->mesh.indices, &builder->triangle_room, count,
                3 * sizeof(uint32_t));
}

bool cli_builder_begin(cli_builder *builder, uint32_t position_type, size_t vertices,
                       size_t triangles) {
    builder->mesh.position_type = position_type;
    return grow(builder, &builder->mesh.positions, &builder->vertex_room, vertices,
                3 * position_size(builder)) &&
           grow_triangles(builder, triangles);
}

bool cli_builder_vertex(cli_builder *builder, const double position[3]) {
    cli_mesh *mesh = &builder->mesh;
    if (mesh->vertex_count >= UINT32_MAX - 1)
        return cli_fail(builder->error, CLI_FAILED, "%s: more than %" PRIu32 " vertices",
                        builder->source->name, UINT32_MAX - 1);
    if (!grow(builder, &mesh->positions, &builder->vertex_room, mesh->vertex_count + 1,
              3 * position_size(builder)))
        return false;
    size_t at = 3 * mesh->vertex_count++;
    for (int k = 0; k < 3; k++) {
        if (mesh->position_type == SOFTSHADOW_F32)
            ((float *) mesh->positions)[at + k] = (float) position[k];
        else
            ((double *) mesh->positions)[at + k] = position[k];
    }
    return true;
}

bool cli_builder_uv(cli_builder *builder, const float uv[2]) {
    if (!grow(builder, &builder->uvs, &builder->uv_room, builder->uv_count + 1, 2 * sizeof(float)))
        return false;
    memcpy(builder->uvs + 2 * builder->uv_count++, uv, 2 * sizeof(float));
    return true;
}

bool cli_builder_face_room(cli_builder *builder, size_t corners) {
    size_t room = builder->face_room;
    return grow(builder, &builder->face_uvs, &room, corners, sizeof(uint32_t)) &&
           grow(builder, &builder->face, &builder->face_room, corners, sizeof(uint32_t));
}

static void set_corner(cli_builder *builder, size_t at, uint32_t corner) {
    builder->mesh.indices[at] = builder->face[corner];
    if (builder->corner_uvs) builder->uv_indices[at] = builder->face_uvs[corner];
}

bool cli_builder_face(cli_builder *builder, uint32_t corners, const char *at) {
    cli_mesh *mesh = &builder->mesh;
    size_t first = mesh->triangle_count, count = corners - 2;
    if (!grow_triangles(builder, first + count)) return false;
    for (uint32_t i = 0; i < count; i++) {
        size_t t = 3 * (first + i);
        set_corner(builder, t, 0);
        set_corner(builder, t + 1, i + 1);
        set_corner(builder, t + 2, i + 2);
    }
    mesh->triangle_count += count;
    mesh->faces++;
    if (corners == 3) return true;
    if (!grow(builder, &builder->outlines, &builder->outline_room, builder->outline_count + 1,
              sizeof *builder->outlines))
        return false;
    builder->outlines[builder->outline_count++] = (cli_outline){first, corners, at};
    return true;
}

/* ---- When all vertices are known --------------------------------------------------------------*/

/* Takes the corners back out of the fan that cli_builder_face() made of them. */
static void recover_face(cli_builder *builder, const cli_outline *outline) {
    size_t t = 3 * outline->triangle;
    for (uint32_t i = 0; i < outline->corners; i++) {
        size_t at = i < 2 ? t + i : t + 3 * (size_t) (i - 2) + 2;
        builder->face[i] = builder->mesh.indices[at];
        if (builder->corner_uvs) builder->face_uvs[i] = builder->uv_indices[at];
        double *p = builder->polygon.points[i];
        size_t v = 3 * (size_t) builder->face[i];
        for (int k = 0; k < 3; k++)
            p[k] = builder->mesh.position_type == SOFTSHADOW_F32
                       ? (double) ((const float *) builder->mesh.positions)[v + k]
                       : ((const double *) builder->mesh.positions)[v + k];
    }
}

static bool fail_effort(const cli_builder *builder, const cli_outline *outline) {
    const cli_source *source = builder->source;
    const char *wrong =
        "concave corners; corners x concave corners are at most 2^24 for a face, and "
        "for a file 2^26 and 64 for each byte";
    if (builder->mesh.format[0] == 'b') /* binary: a place is a byte */
        return cli_source_fail_byte(source, (size_t) (outline->at - source->data), builder->error,
                                    "a face of %" PRIu32 " corners has too many %s",
                                    outline->corners, wrong);
    return cli_source_fail(source, outline->at, builder->error,
                           "a face of %" PRIu32 " corners has too many %s", outline->corners,
                           wrong);
}

/* A face's limit alone would let a file of many such faces take seconds for each 100 KB. */
static bool tile(cli_builder *builder, const cli_outline *outline) {
    recover_face(builder, outline);
    cli_tiling tiling = cli_polygon_tile(&builder->polygon, outline->corners);
    builder->effort += builder->polygon.effort;
    if (tiling == CLI_TILING_TOO_LARGE ||
        builder->effort > ((uint64_t) 1 << 26) + 64 * (uint64_t) builder->source->size)
        return fail_effort(builder, outline);
    if (tiling == CLI_TILING_UNCLEAN) builder->mesh.unclean_faces++;
    for (size_t i = 0; i < 3 * (size_t) (outline->corners - 2); i++)
        set_corner(builder, 3 * outline->triangle + i, builder->polygon.triangles[i]);
    return true;
}

static bool tile_all(cli_builder *builder) {
    for (size_t i = 0; i < builder->outline_count; i++) {
        const cli_outline *outline = &builder->outlines[i];
        if (!cli_polygon_reserve(&builder->polygon, outline->corners))
            return cli_builder_no_memory(builder);
        if (!tile(builder, outline)) return false;
    }
    return true;
}

/* The vertex that stands for (vertex, uv), in an open-addressed table of vertex numbers. The first
 * uv of a vertex keeps its number, further ones get new vertices at the end. */
typedef struct splitter {
    uint32_t *table, *uv_of, *origin;
    size_t mask, uv_room, origin_room;
} splitter;

static bool split_new(cli_builder *builder, splitter *s, uint32_t vertex, uint32_t *made) {
    double position[3];
    for (int k = 0; k < 3; k++)
        position[k] = ((double *) builder->mesh.positions)[3 * (size_t) vertex + k];
    *made = (uint32_t) builder->mesh.vertex_count;
    if (!cli_builder_vertex(builder, position) ||
        !grow(builder, &s->uv_of, &s->uv_room, *made + (size_t) 1, sizeof(uint32_t)) ||
        !grow(builder, &s->origin, &s->origin_room, *made + (size_t) 1, sizeof(uint32_t)))
        return false;
    s->origin[*made] = vertex;
    return true;
}

static bool split_corner(cli_builder *builder, splitter *s, size_t corner) {
    uint32_t vertex = builder->mesh.indices[corner], uv = builder->uv_indices[corner], found;
    uint64_t hash = ((uint64_t) vertex << 32 | uv) * 0x9e3779b97f4a7c15u;
    for (size_t at = hash >> 20 & s->mask;; at = (at + 1) & s->mask) {
        found = s->table[at];
        if (found == UINT32_MAX) {
            found = vertex;
            if (s->uv_of[vertex] != UINT32_MAX && !split_new(builder, s, vertex, &found))
                return false;
            s->table[at] = found;
            s->uv_of[found] = uv;
            break;
        }
        if (s->origin[found] == vertex && s->uv_of[found] == uv) break;
    }
    builder->mesh.indices[corner] = found;
    return true;
}

/* mesh.uvs from uv_of; a vertex that no face uses gets 0, 0. */
static bool spread_uvs(cli_builder *builder, const splitter *s) {
    size_t count = builder->mesh.vertex_count;
    builder->mesh.uvs = calloc(count, 2 * sizeof(float));
    if (!builder->mesh.uvs) return cli_builder_no_memory(builder);
    for (size_t v = 0; v < count; v++)
        if (s->uv_of[v] != UINT32_MAX)
            memcpy(builder->mesh.uvs + 2 * v, builder->uvs + 2 * (size_t) s->uv_of[v],
                   2 * sizeof(float));
    return true;
}

static bool split_corners(cli_builder *builder) {
    splitter s = {.mask = 63};
    size_t corners = 3 * builder->mesh.triangle_count, vertices = builder->mesh.vertex_count;
    while (s.mask < 2 * corners) s.mask = 2 * s.mask + 1;
    s.table = malloc((s.mask + 1) * sizeof(uint32_t));
    bool ok = s.table ? grow(builder, &s.uv_of, &s.uv_room, vertices, sizeof(uint32_t)) &&
                            grow(builder, &s.origin, &s.origin_room, vertices, sizeof(uint32_t))
                      : cli_builder_no_memory(builder);
    if (ok) {
        memset(s.table, 0xff, (s.mask + 1) * sizeof(uint32_t));
        memset(s.uv_of, 0xff, vertices * sizeof(uint32_t));
        for (size_t v = 0; v < vertices; v++) s.origin[v] = (uint32_t) v;
    }
    for (size_t i = 0; ok && i < corners; i++) ok = split_corner(builder, &s, i);
    ok = ok && spread_uvs(builder, &s);
    free(s.table);
    free(s.uv_of);
    free(s.origin);
    return ok;
}

static bool finish(cli_builder *builder) {
    if (builder->mesh.triangle_count == 0)
        return cli_fail(builder->error, CLI_FAILED,
                        "%s: has no faces; a mesh has at least one triangle",
                        builder->source->name);
    return tile_all(builder) && (!builder->split || split_corners(builder));
}

bool cli_builder_end(cli_builder *builder, bool ok, cli_mesh *out) {
    ok = ok && finish(builder);
    free(builder->uv_indices);
    free(builder->uvs);
    free(builder->outlines);
    free(builder->face);
    free(builder->face_uvs);
    cli_polygon_free(&builder->polygon);
    if (ok)
        *out = builder->mesh;
    else
        cli_mesh_free(&builder->mesh);
    return ok;
}
