/* request.h - what a picture shall show, from options, from a scene file, or both.
 *
 * A scene file (.softshadow) is text that names the same options without their dashes, one a line,
 * and the meshes:
 *
 *     softshadow 1
 *     # paths are relative to this file; a value goes to the end of its line
 *     mesh bunny.obj
 *     light sphere:2.2,2.9,1.1,0.5
 *     size 640x480
 *     aov visibility
 *
 * "mesh" and "light" may be repeated; of the others the last one counts. The command line and the
 * plugin for OpenImageIO read it through this one parser. */
#ifndef CLI_RENDER_REQUEST_H
#define CLI_RENDER_REQUEST_H

#include "../build_options.h"
#include "picture.h"

enum { AOV_VISIBILITY = 1, AOV_POSITION = 2, AOV_NORMAL = 4, AOV_DEPTH = 8, AOV_UNSHADOWED = 16 };
enum { REQUEST_TABLE = 12 };

typedef struct request {
    picture picture;
    cli_build_options build;
    double ground; /* NAN: none, INFINITY: under the meshes */
    uint32_t aov, shading, up;
    uint32_t scene_aov; /* of aov, what scene files asked for */
    double exposure;
    char **meshes;
    uint32_t mesh_count;
    char **texts; /* strings that options point to; owned, as meshes are */
    uint32_t text_count;
} request;

void request_init(request *r);
void request_free(request *r);

/* The options of the picture itself; those of its lights and method are cli_build_options'. */
void request_table(request *r, cli_option table[REQUEST_TABLE]);

/* One line of a scene file: "light", "sphere:0,4,0,1". folder: what a relative path is relative to,
 * with its slash; "" is the current one. */
bool request_set(request *r, const char *folder, const char *name, const char *value,
                 cli_error *error);

/* Reads a scene file on top of what is set. Messages begin with FILE:LINE. */
bool request_read(request *r, const char *path, cli_error *error);

/* Parses a command's arguments: operands are scene files and meshes, options win over scenes.
 *   job  what the command's tables point into, r included; nothing in it is owned yet */
bool request_arguments(request *r, void *job, size_t job_size, const cli_command *command, int argc,
                       char **argv, int *status);

/* Whether a name is one of a scene file, by its end; whether 16 bytes begin one. */
bool request_is_scene(const char *path);
bool request_begins_scene(const char bytes[16]);

bool request_add_mesh(request *r, const char *folder, const char *path, cli_error *error);

/* When all is set: there are a mesh and a light, numbers fit each other, the profile is read. */
bool request_finish(request *r, cli_error *error);

#endif
