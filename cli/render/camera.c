/* camera.c */
#include "camera.h"

#include <string.h>

#include "../number.h"

static const double default_fov = 35; /* of a portrait lens: little distortion */

/* Three numbers and what closes them. */
static bool triple(const char **at, const char *end, vector *out) {
    double *const to[3] = {&out->x, &out->y, &out->z};
    for (int i = 0; i < 3; i++) {
        if (i > 0 && (*at == end || *(*at)++ != ',')) return false;
        if (cli_number_double(at, end, to[i]) != CLI_NUMBER_OK) return false;
    }
    return true;
}

static bool slash(const char **at, const char *end) { return *at < end && *(*at)++ == '/'; }

bool camera_parse(viewpoint *out, const char *text, cli_error *error) {
    const char *at = text, *end = text + strlen(text);
    cli_shown shown;
    out->fov = default_fov;
    bool good = triple(&at, end, &out->eye) && slash(&at, end) && triple(&at, end, &out->target);
    if (good && at < end)
        good = slash(&at, end) && cli_number_double(&at, end, &out->fov) == CLI_NUMBER_OK;
    if (!good || at != end)
        return cli_fail(error, CLI_USAGE,
                        "--camera: %s is none, EX,EY,EZ/TX,TY,TZ/FOV_DEGREES is allowed",
                        cli_show(&shown, text, strlen(text)));
    if (!(out->fov >= 0.01 && out->fov <= 170))
        return cli_fail(error, CLI_USAGE,
                        "--camera: a field of view of %g degrees, 0.01 to 170 is allowed",
                        out->fov);
    return true;
}

bool camera_aim(viewpoint *camera, char up, uint32_t width, uint32_t height, cli_error *error) {
    camera->forward = vector_unit(vector_sub(camera->target, camera->eye));
    if (vector_length(camera->forward) < 0.5)
        return cli_fail(error, CLI_USAGE, "--camera: the eye is the target, two places are wanted");
    vector sky = up == 'z' ? (vector){0, 0, 1} : (vector){0, 1, 0};
    if (fabs(vector_dot(sky, camera->forward)) > 0.999999) /* straight up or down: any will do */
        sky = up == 'z' ? (vector){0, 1, 0} : (vector){0, 0, -1};
    camera->right = vector_unit(vector_cross(camera->forward, sky));
    camera->up = vector_cross(camera->right, camera->forward);
    const double half = tan(camera->fov / 2 * M_PI / 180);
    const double shorter = width < height ? width : height;
    camera->tan_x = half * width / shorter;
    camera->tan_y = half * height / shorter;
    return true;
}

/* How far back the eye must be for a corner, seen from the centre, to stay within the picture's
 * inner part. */
static double distance_for(const viewpoint *c, vector corner) {
    const double inner = 0.78; /* the rest is air, and room for shadows */
    const double x = fabs(vector_dot(corner, c->right)) / (inner * c->tan_x);
    const double y = fabs(vector_dot(corner, c->up)) / (inner * c->tan_y);
    return fmax(x, y) - vector_dot(corner, c->forward);
}

void camera_frame(viewpoint *out, const double bounds[6], char up, uint32_t width,
                  uint32_t height) {
    const vector low = vector_of(bounds), high = vector_of(bounds + 3);
    const vector centre = vector_scale(vector_add(low, high), 0.5);
    const vector half = vector_scale(vector_sub(high, low), 0.5);
    const vector from = up == 'z' ? (vector){0.35, -1, 0.36} : (vector){0.35, 0.36, 1};
    cli_error never; /* from is not zero */
    *out = (viewpoint){.eye = vector_add(centre, from), .target = centre, .fov = default_fov};
    camera_aim(out, up, width, height, &never);
    double distance = 0;
    for (int i = 0; i < 8; i++) {
        const vector corner = {i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y,
                               i & 4 ? half.z : -half.z};
        distance = fmax(distance, distance_for(out, corner));
    }
    if (!(distance > 0)) distance = 1;
    out->eye = vector_add(centre, vector_scale(vector_unit(from), distance));
}
