/* libFuzzer on the readers of mesh files: no crash, no leak, no index out of range, no coordinate
 * that is not finite, and every refusal is one plain line. The first byte chooses the name's ending
 * (and with it the format) and whether texture coordinates are asked for. */
#include "mesh/readers.h"

#include "softshadow.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void must(bool holds) {
    if (!holds) abort();
}

static void check_mesh(const cli_mesh *mesh) {
    must(mesh->triangle_count > 0);
    for (size_t i = 0; i < 3 * mesh->triangle_count; i++)
        must(mesh->indices[i] < mesh->vertex_count);
    for (size_t i = 0; i < 3 * mesh->vertex_count; i++)
        must(fabs(mesh->position_type == SOFTSHADOW_F32
                      ? (double) ((const float *) mesh->positions)[i]
                      : ((const double *) mesh->positions)[i]) <= 1e15);
    for (size_t i = 0; mesh->uvs && i < 2 * mesh->vertex_count; i++) must(isfinite(mesh->uvs[i]));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const char *const paths[] = {"a.obj", "a.ply", "a.stl", "a.off", "a"};
    cli_source source = {.name = "a"};
    cli_mesh mesh;
    cli_error error;
    if (size < 2) return 0;
    source.size = size - 1;
    source.data = malloc(size);
    if (!source.data) return 0;
    memcpy(source.data, data + 1, size - 1);
    source.data[size - 1] = 0;
    if (cli_mesh_from_source(&source, paths[(data[0] & 0x7f) % 5], data[0] & 0x80, &mesh, &error)) {
        check_mesh(&mesh);
        cli_mesh_free(&mesh);
    } else {
        must(error.status == 1 && strncmp(error.text, "a:", 2) == 0 && !mesh.positions);
        for (const char *c = error.text; *c; c++) must(*c >= 0x20 && *c < 0x7f);
    }
    cli_source_free(&source);
    return 0;
}
