/* One reader a format: fills a builder that cli_mesh_read() has begun and will end. Each has been
 * told apart by its signature (cli_mesh_read), checks all the rest, and says false with the error
 * set. Inside cli/mesh only. */
#ifndef CLI_MESH_READERS_H
#define CLI_MESH_READERS_H

#include "mesh/builder.h"

bool cli_read_obj(cli_builder *builder, bool uvs);
bool cli_read_ply(cli_builder *builder, bool uvs);
bool cli_read_off(cli_builder *builder, bool uvs);
bool cli_read_stl_text(cli_builder *builder);
bool cli_read_stl_binary(cli_builder *builder);

/* Is the size the one that the 84 bytes of a binary STL's head announce? */
bool cli_stl_is_binary(const cli_source *source);

#endif
