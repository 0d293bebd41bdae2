/* One reader a format: fills a builder that cli_mesh_from_source() ends. That has seen the format's
 * signature; a reader checks all the rest, and says false with the error set. Inside cli/mesh, and
 * for fuzzing. */
#ifndef CLI_MESH_READERS_H
#define CLI_MESH_READERS_H

#include "mesh/builder.h"

/* What cli_mesh_read() does once the file is in memory; of the path only the ending matters. */
bool cli_mesh_from_source(const cli_source *source, const char *path, bool uvs, cli_mesh *out,
                          cli_error *error);

bool cli_read_obj(cli_builder *builder, bool uvs);
bool cli_read_ply(cli_builder *builder, bool uvs);
bool cli_read_off(cli_builder *builder, bool uvs);
bool cli_read_stl_text(cli_builder *builder);
bool cli_read_stl_binary(cli_builder *builder);

/* Is the size the one that the 84 bytes of a binary STL's head announce? */
bool cli_stl_is_binary(const cli_source *source);

#endif
