/* picture.h - from a built scene and a camera to planes of pixels.
 *
 * The picture is made in bands of rows, so that memory stays bounded for any size and number of
 * rays: the first triangle of each ray, the visibility of what was met (one batch a light),
 * shading. */
#ifndef CLI_RENDER_PICTURE_H
#define CLI_RENDER_PICTURE_H

#include "../scene.h"
#include "camera.h"
#include "normals.h"
#include "raster.h"

typedef struct picture {
    /* what is wanted */
    uint32_t width, height, aa; /* aa x aa rays a pixel */
    viewpoint camera;
    bool smooth;
    double albedo[3], ground_albedo[3], ambient;
    char up;
    const cli_build_options *build; /* the lights, the weighting */
    uint64_t verify;                /* keep so many points for picture_verify() */
    bool split;                     /* make unlit and unshadowed, too */

    /* what is seen: the scene's meshes, then the ground, if there is one */
    raster_surface *surfaces;
    facing *normals;
    uint32_t surface_count, ground; /* the ground's surface, or RASTER_NONE */
    vector centre;                  /* of the meshes: where a light's brightness is 1 */
    double radius;

    /* what is made: width x height each */
    float *beauty; /* r g b a, linear, not multiplied out of the background: premultiplied */
    float
        *visibility; /* light_count values a pixel: the mean of what its rays met; 1 for nothing */
    float *position,
        *normal;  /* three values a pixel: of the ray in the pixel's middle; 0 for nothing */
    float *depth; /* along the camera's forward axis; 0 for nothing */
    /* beauty in parts, r g b each: the ambient light, and light_count times what a light would add
     * if nothing hid it. With one ray a pixel beauty = unlit + sum of visibility x unshadowed. */
    float *unlit, *unshadowed;
    bool *bands_done;
    uint32_t band_rows; /* rows of pixels that are made at a time */
    uint64_t points, rays;

    double *kept_positions; /* the points for picture_verify() */
    float *kept_normals;
    uint64_t *kept_primitives;
    uint64_t kept_count;
} picture;

/* Makes the surfaces: the meshes as double, a ground at the given height (NAN: none, INFINITY: just
 * under the meshes), normals. Frames the camera if its fov is 0. */
bool picture_prepare(picture *picture, const cli_scene *scene, double ground, cli_error *error);

/* Room for the planes; then rows may be asked for in any order, each is made once, in bands that do
 * not depend on that order. One thread at a time; rows that are made may be read meanwhile. After a
 * failure the band is made anew when it is asked for again. */
bool picture_begin(picture *picture, cli_error *error);
bool picture_rows(picture *picture, cli_scene *scene, uint32_t first, uint32_t count,
                  cli_error *error);

/* --verify: measures on points that the picture asked for. */
bool picture_verify(const picture *picture, cli_scene *scene, cli_error *error);
void picture_free(picture *picture);

#endif
