/* Drawing into maps: one table of passes; nothing above knows which machine draws.
 *
 * The fill rule, which every backend keeps: a texel is covered where its centre is inside the triangle;
 * a centre exactly on an edge belongs to the triangle for which that edge is a top or a left one.
 * Corners are snapped to 1/256 of a texel first, the same way for whoever shares them: neighbours
 * neither overlap nor leave gaps. Both sides of a triangle are drawn.
 *
 * Planes are resolution x resolution floats, row after row; row 0 is at the lowest Y. */
#ifndef SS_RASTER_RASTER_H
#define SS_RASTER_RASTER_H

#include "base/parallel.h"
#include "map/frame.h"
#include "scene/scene.h"

/* What the passes over the casters read. */
typedef struct ss_raster_casters {
    const ss_world *world;
    const ss_frame *frame;
    uint32_t resolution;
    /* The stored depth is the deepest that the surface reaches within so many texels of the centre
     * along each axis, at most `steepest` (h per unit of X or Y); 0: the depth at the centre. */
    double slope_texels, steepest;
    double deepest; /* triangles wholly beyond this h are left out */
    bool front_only; /* triangles that turn their back to the light are left out */
    uint8_t *held;  /* per triangle, set to 1 where the map needs it; or NULL */
} ss_raster_casters;

#define SS_RASTER_ATTRIBUTES 4

/* A triangle of the techniques' own, in map coordinates, with numbers that vary linearly across it. */
typedef struct ss_raster_triangle {
    double corner[3][2];
    double attribute[3][SS_RASTER_ATTRIBUTES];
    uint32_t tag; /* handed to shade */
} ss_raster_triangle;

/* Called for runs of covered texels: n of them from column x on in row y. attribute[k][i] belongs to
 * texel x + i. Runs of one row come in the order of their triangles; rows may come from any thread. */
typedef struct ss_raster_run {
    uint32_t x, y, n, tag;
    const float *attribute[SS_RASTER_ATTRIBUTES];
} ss_raster_run;
typedef void ss_raster_shade(void *ctx, const ss_raster_run *run);

typedef struct ss_raster {
    const char *name;
    /* The nearest h of any caster at each texel, SS_MAP_FAR where there is none. */
    softshadow_status (*depth)(const ss_raster_casters *casters, float *plane, ss_pool *pool);
    /* The nearest h deeper than `above`: the next layer. */
    softshadow_status (*peel)(const ss_raster_casters *casters, const float *above, float *plane,
                              ss_pool *pool);
    /* `used` of the attributes; corners may be anywhere. */
    softshadow_status (*draw)(const ss_raster_triangle *triangles, size_t count, uint32_t used,
                              uint32_t resolution, ss_raster_shade *shade, void *ctx, ss_pool *pool);
} ss_raster;

extern const ss_raster ss_raster_cpu;

#endif
