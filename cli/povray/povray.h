/* povray.h - what the files of `softshadow povray` share. */
#ifndef CLI_POVRAY_H
#define CLI_POVRAY_H

#include "../output.h"
#include "../render/planes.h"
#include "../render/request.h"

enum { POVRAY_AREA, POVRAY_PROJECTED, POVRAY_BAKED, POVRAY_NONE };

typedef struct povray_job {
    request request;
    const char *output;
    uint32_t shadows;     /* POVRAY_AREA ... */
    uint32_t area;        /* an area light is area x area points */
    uint32_t most;        /* baked: triangles */
    const char *positions, *normals; /* passes that POV-Ray rendered: "HIGH.png,LOW.png" */
    double box[6];
    bool box_given;
} povray_job;

/* ---- Surfaces -------------------------------------------------------------------------------*/

typedef struct povray_vertex {
    double position[3];
    float normal[3]; /* as POV-Ray shades it */
    float seen;      /* baked: from the triangle it is a corner of */
    uint32_t triangle;
} povray_vertex;

typedef struct povray_surface {
    povray_vertex *vertices;
    uint32_t *corners; /* triangle_count x 3 */
    uint8_t *seen;     /* of each corner, 0..255; baked */
    size_t vertex_count, vertex_room, triangle_count;
} povray_surface;

/* The number-th surface of a prepared picture; each triangle has vertices of its own. */
bool povray_surface_make(povray_surface *out, const picture *p, uint32_t number, cli_error *error);
void povray_surface_free(povray_surface *surface);

/* Makes one vertex of those with the same position and normal; what they see stays with corners. */
bool povray_surface_weld(povray_surface *surface, cli_error *error);

/* Fills seen at every vertex, after splitting triangles until visibility is nearly linear across
 * them. *room: how many more triangles there may be; it shrinks. */
bool povray_bake(povray_surface *surface, const picture *p, uint32_t number, cli_scene *scene,
                 size_t *room, cli_error *error);

/* ---- Files ----------------------------------------------------------------------------------*/

bool povray_write_scene(povray_job *job, cli_scene *scene, cli_error *error);
bool povray_read_passes(const povray_job *job, cli_error *error);

/* One picture into one file, EXR of floats. */

bool povray_write_exr(const char *path, const planes *list, uint32_t width,
                      uint32_t height, cli_error *error);

#endif
