/* Which reader for which file: by the name's ending, and the content must agree. */
#include "mesh/mesh.h"

#include "mesh/readers.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

typedef enum format { UNKNOWN, OBJ, PLY, STL, OFF } format;

static const char *const names[] = {"a mesh", "OBJ", "PLY", "STL", "OFF"};

static format format_of_name(const char *path) {
    static const char *const endings[] = {[OBJ] = ".obj", [PLY] = ".ply", [STL] = ".stl",
                                          [OFF] = ".off"};
    const char *dot = strrchr(path, '.');
    for (int f = OBJ; dot && f <= OFF; f++)
        if (strcasecmp(dot, endings[f]) == 0) return (format) f;
    return UNKNOWN;
}

/* Is the first word, past blank lines and comments of OFF, a header like COFF? */
static bool begins_off(const cli_source *source) {
    cli_scan text = {source, NULL, source->data, false};
    if (!cli_scan_next_record(&text)) return false;
    const char *end = cli_scan_word_end(&text);
    return end - text.at >= 3 && end - text.at <= 9 && memcmp(end - 3, "OFF", 3) == 0;
}

static bool begins_solid(const cli_source *source) {
    const char *c = source->data;
    while (cli_is_blank(*c) || *c == '\n' || *c == '\r') c++;
    return strncasecmp(c, "solid", 5) == 0 && (cli_is_blank(c[5]) || cli_is_line_end(c[5]));
}

/* OBJ has no signature. */
static format format_of_content(const cli_source *source) {
    const char *d = source->data;
    if (strncmp(d, "ply", 3) == 0 && (cli_is_line_end(d[3]) || cli_is_blank(d[3]))) return PLY;
    if (cli_stl_is_binary(source) || begins_solid(source)) return STL;
    return begins_off(source) ? OFF : UNKNOWN;
}

static bool check_format(const cli_source *source, format name, format content, cli_error *error) {
    if (name == UNKNOWN && content == UNKNOWN)
        return cli_fail(error, CLI_FAILED, "%s: neither its name nor its first line tells the "
                        "format; .obj .ply .stl .off are allowed", source->name);
    if (name == UNKNOWN || name == content) return true;
    if (content != UNKNOWN)
        return cli_fail(error, CLI_FAILED, "%s: is named like %s but begins like %s", source->name,
                        names[name], names[content]);
    /* A binary STL of a wrong size is no STL by its content; its reader says more about it. */
    if (name == OBJ || name == STL) return true;
    return cli_source_fail(source, source->data, error, "no %s; such a file begins with %s",
                           names[name], name == PLY ? "ply" : "OFF");
}

static bool read_format(cli_builder *builder, format which, bool uvs) {
    switch (which) {
    case OBJ: return cli_read_obj(builder, uvs);
    case PLY: return cli_read_ply(builder, uvs);
    case OFF: return cli_read_off(builder, uvs);
    case STL:
    default:
        return !cli_stl_is_binary(builder->source) && begins_solid(builder->source)
                   ? cli_read_stl_text(builder)
                   : cli_read_stl_binary(builder);
    }
}

bool cli_mesh_from_source(const cli_source *source, const char *path, bool uvs, cli_mesh *out,
                          cli_error *error) {
    *out = (cli_mesh){.vertex_count = 0};
    format name = format_of_name(path), content = format_of_content(source);
    if (!check_format(source, name, content, error)) return false;
    cli_builder builder = {.source = source, .error = error};
    bool ok = read_format(&builder, name == UNKNOWN ? content : name, uvs);
    return cli_builder_end(&builder, ok, out);
}

static bool read_mesh(const char *path, bool uvs, cli_mesh *out, cli_error *error) {
    cli_source source;
    *out = (cli_mesh){.vertex_count = 0};
    if (!cli_source_read(&source, path, error)) return false;
    bool ok = cli_mesh_from_source(&source, path, uvs, out, error);
    cli_source_free(&source);
    return ok;
}

bool cli_mesh_read(const char *path, cli_mesh *out, cli_error *error) {
    return read_mesh(path, false, out, error);
}

bool cli_mesh_read_uvs(const char *path, cli_mesh *out, cli_error *error) {
    return read_mesh(path, true, out, error);
}

softshadow_mesh cli_mesh_given(const cli_mesh *mesh) {
    softshadow_mesh given = SOFTSHADOW_MESH_INIT;
    given.flags = SOFTSHADOW_BORROW;
    given.position_type = mesh->position_type;
    given.positions = mesh->positions;
    given.vertex_count = mesh->vertex_count;
    given.indices = mesh->indices;
    given.triangle_count = mesh->triangle_count;
    return given;
}

void cli_mesh_free(cli_mesh *mesh) {
    if (!mesh) return;
    free(mesh->positions);
    free(mesh->indices);
    free(mesh->uvs);
    *mesh = (cli_mesh){.vertex_count = 0};
}
