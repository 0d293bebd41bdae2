/* normals.h - which way a surface faces, flat or smooth.
 *
 * Smooth: at a corner the faces around its vertex are averaged, weighted by their area, but only
 * those that turn less than 40 degrees from this one: a cube keeps its edges though its faces share
 * vertices. */
#ifndef CLI_RENDER_NORMALS_H
#define CLI_RENDER_NORMALS_H

#include <stdbool.h>

#include "raster.h"

typedef struct facing {
    vector *faces;    /* of length 2 x area, as the triangle is wound */
    uint32_t *around; /* faces at each vertex, one list after the other ... */
    size_t *first;    /* ... beginning here; vertex_count + 1 numbers */
} facing;

/* around and first are made only when smooth. False when memory runs out. */
bool normals_make(facing *out, const raster_surface *surface, bool smooth);
void normals_free(facing *normals);

/* Unit normal of the face itself; zero without area. */
vector normals_flat(const facing *normals, uint32_t triangle);

/* Unit normal between the corners, wound as the face. */
vector normals_smooth(const facing *normals, const raster_surface *surface, uint32_t triangle,
                      const double weight[3]);

#endif
