/* Mesh files as triangle soups: OBJ, PLY (ascii, binary of either byte order), STL (ascii, binary)
 * and OFF. Readers of our own, because a file is not to be trusted: nothing is allocated that the
 * file's size does not account for, nothing is dropped, repaired or guessed. A file is read as it
 * is or refused with one line: file:line:column (or file: byte N), what is wrong, what is allowed.
 *
 * What is read  Faces with more than three corners become triangles that tile them, concave ones
 *               too. Degenerate triangles stay. Order is the file's: of vertices, faces, and the
 *               triangles of a face. Materials, normals, colours, lines and groups are passed over;
 *               no other file is opened.
 * Precision     The type a file declares: float is SOFTSHADOW_F32, double and 32-bit integers are
 *               _F64. OBJ, OFF and ascii STL declare none and are read as double: rounding to
 *               float would move the points of a scene that lies far from its origin.
 * Limits        Coordinates are finite and within +-1e15 (the library's own limit); a face has 3
 *               to 65536 corners; corners x concave corners are at most 2^24 for a face, and for a
 *               file 2^26 and 64 for each byte, which bounds the time; a line has 64 KiB, one that
 *               lists a face 1 MiB; a PLY header 64 KiB; vertices fit 32-bit indices; the file is
 *               a regular one of at most half the machine's memory. */
#ifndef CLI_MESH_H
#define CLI_MESH_H

#include "error.h"

#include <softshadow.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct cli_mesh {
    uint32_t position_type; /* SOFTSHADOW_F32 or _F64 */
    void *positions;        /* vertex_count x 3 */
    size_t vertex_count;
    uint32_t *indices; /* triangle_count x 3 */
    size_t triangle_count;
    float *uvs;             /* vertex_count x 2; NULL: not asked for, or the file has none */
    const char *format;     /* "OBJ", "binary PLY" ...; static */
    uint64_t faces;         /* in the file, of any number of corners */
    uint64_t unclean_faces; /* outlines that cross themselves or have no area: triangles overlap */
} cli_mesh;

/* Reads a mesh of at least one triangle. The name's ending tells the format (.obj .ply .stl .off,
 * in any case) and the content must agree; with another ending the content tells, where it can (OBJ
 * has no signature). On error *out is all zero. */
bool cli_mesh_read(const char *path, cli_mesh *out, cli_error *error);

/* The same with texture coordinates: of OBJ's corners (a vertex that has several is split, so that
 * vertices are more than the file's), of PLY's and OFF's vertices. */
bool cli_mesh_read_uvs(const char *path, cli_mesh *out, cli_error *error);

/* As the library takes it: it borrows the arrays. */
softshadow_mesh cli_mesh_given(const cli_mesh *mesh);

void cli_mesh_free(cli_mesh *mesh); /* NULL or all zero is fine */

#endif
