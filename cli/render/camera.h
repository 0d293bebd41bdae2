/* camera.h - where a preview is seen from. A pinhole; the picture's rays have depth 1. */
#ifndef CLI_RENDER_CAMERA_H
#define CLI_RENDER_CAMERA_H

#include <stdbool.h>
#include <stdint.h>

#include "../error.h"
#include "vector.h"

typedef struct viewpoint {
    vector eye, target;
    double fov; /* degrees, of the picture's shorter side */
    /* by camera_aim(): */
    vector right, up, forward;
    double tan_x, tan_y; /* half the picture at depth 1 */
} viewpoint;

/* "EX,EY,EZ/TX,TY,TZ/FOV_DEGREES"; the last part may be left out (35). */
bool camera_parse(viewpoint *out, const char *text, cli_error *error);

/* A three-quarter view from slightly above that holds the box, with room for shadows on the ground.
 *   up  'y' or 'z' */
void camera_frame(viewpoint *out, const double bounds[6], char up, uint32_t width, uint32_t height);

/* Works the axes out. False if the eye is the target. */
bool camera_aim(viewpoint *camera, char up, uint32_t width, uint32_t height, cli_error *error);

/* A point in the camera's frame: to the right, up, and forward. */
static inline vector camera_see(const viewpoint *c, vector point) {
    const vector d = vector_sub(point, c->eye);
    return (vector){vector_dot(d, c->right), vector_dot(d, c->up), vector_dot(d, c->forward)};
}

#endif
