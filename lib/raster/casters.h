/* Casters and the techniques' own triangles as corners in the map: what every backend does before
 * it walks them. */
#ifndef SS_RASTER_CASTERS_H
#define SS_RASTER_CASTERS_H

#include "raster/clip.h"

/* A vertex in map coordinates; x is NaN where only clipping helps. */
typedef struct ss_caster_vertex {
    float x, y, h;
} ss_caster_vertex;

typedef struct ss_casters {
    const ss_raster_casters *asked;
    ss_caster_vertex *vertex;
    bool mirrored; /* does the light see X, Y mirrored? */
} ss_casters;

softshadow_status ss_casters_project(ss_casters *out, const ss_raster_casters *asked,
                                     ss_pool *pool);
void ss_casters_free(ss_casters *casters);

/* The corners to draw of triangle t: three as they are, or what clipping leaves. */
int ss_casters_corners(const ss_casters *casters, size_t t, ss_scan_corner corner[SS_CLIP_MOST]);
/* Triangle t as most are: whole, and not cut by anything. */
typedef struct ss_caster_plain {
    float x[3], y[3], h[3];
} ss_caster_plain;

static inline bool ss_casters_plain(const ss_casters *casters, size_t t, ss_caster_plain *out) {
    const uint32_t *index = casters->asked->world->indices + 3 * t;
    bool plain = true;
    SS_UNROLL
    for (int i = 0; i < 3; i++) {
        const ss_caster_vertex *p = &casters->vertex[index[i]];
        out->x[i] = p->x, out->y[i] = p->y, out->h[i] = p->h;
        plain &= p->x == p->x;
    }
    return plain;
}

/* Where a triangle is: x, y, h from; x, y to. */
typedef struct ss_caster_box {
    double low[3], high[2];
} ss_caster_box;

/* Is triangle t to be drawn, which is in this box? Marks it as held. */
bool ss_casters_want(const ss_casters *casters, size_t t, const ss_caster_box *box);
/* The rows that these corners can touch; false: none, or the triangle is left out. Marks it as
 * held. */
bool ss_casters_rows(const ss_casters *casters, size_t t, const ss_scan_corner *corner, int count,
                     int32_t *first, int32_t *last);
/* Is the triangle left out because it turns its back to the light? */
bool ss_casters_turned(const ss_casters *casters, const ss_scan *scan);
/* How much deeper than at a texel's centre its depth is stored. */
float ss_casters_bias(const ss_casters *casters, const ss_scan *scan);

/* Triangles with holes, texel by texel: an ss_scan_keep. */
typedef struct ss_caster_holes {
    const ss_world *world;
    const ss_frame *frame;
    uint32_t triangle;
    const ss_scan_corner *corner; /* three, of the part that is drawn */
} ss_caster_holes;
static inline bool ss_caster_has_holes(const ss_world *world, size_t t) {
    return world->any_opacity && ss_world_mesh_of(world, (uint32_t)t)->source->opacity.texels;
}
bool ss_caster_opaque_at(void *holes, const double weight[3]);

/* The same for a technique's own polygon. */
int ss_raster_polygon_corners(const ss_raster_polygon *polygon,
                              ss_scan_corner corner[SS_CLIP_MOST]);
bool ss_scan_corner_rows(const ss_scan_corner *corner, int count, uint32_t resolution,
                         int32_t *first, int32_t *last);

#endif
