/* Mesh files for tests: written into a folder of the test's own, read, and looked at. */
#ifndef TESTS_MESH_FILES_H
#define TESTS_MESH_FILES_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "cli/mesh/mesh.h"
#include "softshadow.h"

static char mesh_folder[64];

static inline int mesh_folder_make(void **state) {
    (void) state;
    /* In memory where there is such a place: a mutant a file costs a disk a millisecond each. */
    strcpy(mesh_folder, "/dev/shm/softshadow-mesh-XXXXXX");
    if (mkdtemp(mesh_folder)) return 0;
    strcpy(mesh_folder, "/tmp/softshadow-mesh-XXXXXX");
    return mkdtemp(mesh_folder) ? 0 : -1;
}

static inline int mesh_folder_remove(void **state) {
    (void) state;
    char command[96];
    snprintf(command, sizeof command, "rm -rf '%s'", mesh_folder);
    return system(command);
}

static inline const char *mesh_path(const char *name) {
    static char path[512];
    snprintf(path, sizeof path, "%s/%s", mesh_folder, name);
    return path;
}

static inline const char *mesh_write(const char *name, const void *bytes, size_t size) {
    const char *path = mesh_path(name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
    return path;
}

/* A buffer to build files in. */
typedef struct blob {
    char bytes[4 << 20];
    size_t size;
} blob;

static inline void blob_text(blob *to, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(to->bytes + to->size, sizeof to->bytes - to->size, format, arguments);
    va_end(arguments);
    assert_true(length >= 0 && to->size + (size_t) length < sizeof to->bytes);
    to->size += (size_t) length;
}

/* The low bytes of a value in either order. */
static inline void blob_bytes(blob *to, uint64_t value, unsigned size, bool big) {
    assert_true(to->size + size < sizeof to->bytes);
    for (unsigned i = 0; i < size; i++)
        to->bytes[to->size++] = (char) (value >> 8 * (big ? size - 1 - i : i));
}

static inline void blob_float(blob *to, float value, bool big) {
    uint32_t bits;
    memcpy(&bits, &value, 4);
    blob_bytes(to, bits, 4, big);
}

static inline void blob_double(blob *to, double value, bool big) {
    uint64_t bits;
    memcpy(&bits, &value, 8);
    blob_bytes(to, bits, 8, big);
}

static inline double mesh_coordinate(const cli_mesh *mesh, size_t vertex, int k) {
    size_t at = 3 * vertex + (size_t) k;
    return mesh->position_type == SOFTSHADOW_F32 ? (double) ((const float *) mesh->positions)[at]
                                                 : ((const double *) mesh->positions)[at];
}

/* What is true of every mesh that was read. */
static inline void mesh_check(const cli_mesh *mesh) {
    assert_true(mesh->triangle_count > 0 && mesh->vertex_count > 0);
    for (size_t i = 0; i < 3 * mesh->triangle_count; i++)
        if (mesh->indices[i] >= mesh->vertex_count) fail_msg("index %zu is out of range", i);
    for (size_t v = 0; v < mesh->vertex_count; v++)
        for (int k = 0; k < 3; k++)
            if (!(fabs(mesh_coordinate(mesh, v, k)) <= 1e15)) fail_msg("vertex %zu", v);
}

/* What is true of every refusal: one line that begins with the file, and nothing is handed out. */
static inline void mesh_check_refusal(const char *path, const cli_mesh *mesh,
                                      const cli_error *error) {
    if (strncmp(error->text, path, strlen(path))) fail_msg("no file in: %s", error->text);
    for (const char *c = error->text; *c; c++)
        if ((unsigned char)*c < 0x20 || *c == 0x7f) fail_msg("not one plain line: %s", error->text);
    assert_true(strlen(error->text) > strlen(path) + 10);
    assert_int_equal(error->status, 1);
    assert_true(!mesh->positions && !mesh->indices && !mesh->uvs && !mesh->vertex_count);
}

static inline cli_mesh mesh_read_good(const char *path) {
    cli_mesh mesh;
    cli_error error;
    if (!cli_mesh_read(path, &mesh, &error)) fail_msg("refused: %s", error.text);
    mesh_check(&mesh);
    return mesh;
}

static inline bool mesh_same(const cli_mesh *a, const cli_mesh *b) {
    if (a->vertex_count != b->vertex_count || a->triangle_count != b->triangle_count) return false;
    for (size_t v = 0; v < a->vertex_count; v++)
        for (int k = 0; k < 3; k++)
            if (mesh_coordinate(a, v, k) != mesh_coordinate(b, v, k)) return false;
    return memcmp(a->indices, b->indices, 12 * a->triangle_count) == 0;
}

/* splitmix64: every run draws the same. */
static inline uint64_t mesh_random(uint64_t *seed) {
    uint64_t z = *seed += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

static inline double mesh_uniform(uint64_t *seed) {
    return (double) (mesh_random(seed) >> 11) * 0x1p-53;
}

#endif
