/* raster.h - which triangle each ray of the picture meets first, and where, in double precision.
 * based on: Olano and Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates" (1997):
 * edge functions of rays through the eye, so that no triangle is ever clipped, not even one that
 * passes beside or through the camera. */
#ifndef CLI_RENDER_RASTER_H
#define CLI_RENDER_RASTER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "camera.h"

enum { RASTER_NONE = UINT32_MAX };

/* A mesh as the picture needs it. Corners of triangles index positions. */
typedef struct raster_surface {
    const double *positions; /* vertex_count x 3 */
    const uint32_t *indices; /* triangle_count x 3, not checked again */
    size_t vertex_count, triangle_count;
    vector *seen; /* the positions in the camera's frame; made by raster_see() */
} raster_surface;

/* What one ray meets. */
typedef struct raster_hit {
    double depth;               /* along the camera's forward axis */
    uint32_t surface, triangle; /* RASTER_NONE: nothing */
} raster_hit;

/* Rays of some rows of the picture: ray (column, row) goes through the middle of its cell. */
typedef struct raster_band {
    uint32_t width, height; /* of the whole picture, in rays */
    uint32_t first_row, rows;
    raster_hit *hits; /* width x rows */
} raster_band;

/* Puts a surface's vertices into the camera's frame. False when memory runs out. */
bool raster_see(raster_surface *surface, const viewpoint *camera);

/* The nearest triangles of all surfaces along the rays of a band; of equals the first. */
void raster_fill(raster_band *band, const viewpoint *camera, const raster_surface *surfaces,
                 uint32_t surface_count);

/* The ray's direction in the camera's frame; its z is 1. */
static inline vector raster_ray(const viewpoint *c, uint32_t width, uint32_t height,
                                uint32_t column, uint32_t row) {
    return (vector){(2 * (column + 0.5) / width - 1) * c->tan_x,
                    (1 - 2 * (row + 0.5) / height) * c->tan_y, 1};
}

/* The weights of a triangle's corners where a ray meets its plane. */
void raster_weights(const raster_surface *surface, uint32_t triangle, vector ray, double weight[3]);

#endif
