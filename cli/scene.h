/* A scene on the command line: mesh files, lights and options become a built softshadow handle.
 * Messages of the library go to stderr; a progress bar is drawn there when it is a terminal and the
 * work takes over a second. */
#ifndef CLI_SCENE_H
#define CLI_SCENE_H

#include <softshadow.h>

#include "build_options.h"
#include "mesh/mesh.h"
#include "progress.h"

typedef struct cli_scene {
    softshadow *handle;
    cli_mesh *meshes; /* borrowed by the handle: they live as long as it does */
    uint32_t mesh_count, light_count;
    cli_progress progress;
} cli_scene;

/* Reads the meshes (in the order given: mesh_id is the place in it), sets the lights, builds (but
 * where options->unbuilt says that nothing will be asked).
 * On error nothing is held. */
bool cli_scene_open(cli_scene *scene, const cli_build_options *options, char *const *mesh_paths,
                    int mesh_count, cli_error *error);
void cli_scene_close(cli_scene *scene);

/* A failed call in the library's own words. what: "query", "--light 2"; NULL: nothing in front. */
bool cli_scene_fail(const cli_scene *scene, softshadow_status status, const char *what,
                    cli_error *error);

/* What --stats and --verify print, on stderr. */
bool cli_scene_print_stats(const cli_scene *scene, bool json, cli_error *error);
bool cli_scene_print_error(cli_scene *scene, const softshadow_points *points, cli_error *error);

#endif
