/* A soup under construction. Inside cli/mesh only.
 *
 * Faces may come before the vertices they name (PLY elements in any order, OBJ lines in any order):
 * a face of n corners takes the places of its n - 2 triangles at once, as a fan, and concave ones
 * are tiled, in these places, when all vertices are known. */
#ifndef CLI_MESH_BUILDER_H
#define CLI_MESH_BUILDER_H

#include "mesh/mesh.h"
#include "mesh/polygon.h"
#include "mesh/source.h"

/* The highest number that a face named of something (vertices, texture coordinates), and where: it
 * is checked when all are known. */
typedef struct cli_reference {
    uint64_t highest; /* counted from 1; 0: none */
    const char *at;
} cli_reference;

static inline void cli_reference_note(cli_reference *reference, uint64_t number, const char *at) {
    if (number > reference->highest) *reference = (cli_reference){number, at};
}

typedef struct cli_outline { /* a face of more than three corners */
    size_t triangle;         /* its first */
    uint32_t corners;
    const char *at;
} cli_outline;

typedef struct cli_builder {
    const cli_source *source;
    cli_error *error;
    cli_mesh mesh;
    size_t vertex_room, triangle_room, uv_room, outline_count, outline_room, face_room;
    bool corner_uvs;      /* faces come with face_uvs, kept beside mesh.indices; OBJ */
    bool split;           /* and vertices shall be split by them in the end */
    uint32_t *uv_indices;
    float *uvs;           /* the file's, uv_count x 2 */
    size_t uv_count;
    cli_outline *outlines;
    uint32_t *face, *face_uvs; /* the face being read */
    cli_polygon polygon;
    uint64_t effort; /* of all faces */
} cli_builder;

/* Sets what the file announces: rooms for vertices and triangles, which the caller has checked
 * against the file's size; 0 where the file does not say. */
bool cli_builder_begin(cli_builder *builder, uint32_t position_type, size_t vertices,
                       size_t triangles);
/* The mesh on success; everything is freed on failure, where the error is set. */
bool cli_builder_end(cli_builder *builder, bool ok, cli_mesh *out);

bool cli_builder_vertex(cli_builder *builder, const double position[3]); /* rounds to F32 if that */
bool cli_builder_uv(cli_builder *builder, const float uv[2]);

/* Room for a face of this many corners in builder->face (and face_uvs). */
bool cli_builder_face_room(cli_builder *builder, size_t corners);
/* Takes builder->face, indices from 0, corners 3..CLI_POLYGON_CORNERS; at is the face's place. */
bool cli_builder_face(cli_builder *builder, uint32_t corners, const char *at);

bool cli_builder_no_memory(const cli_builder *builder);

#endif
