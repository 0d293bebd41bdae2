/* Silhouettes in map coordinates, and the strips and corner pieces that penumbrae are drawn
 * with. */
#ifndef SS_TECHNIQUE_RIM_H
#define SS_TECHNIQUE_RIM_H

#include <math.h>

#include "map/frame.h"
#include "raster/raster.h"
#include "silhouette/silhouette.h"
#include "technique/technique.h"

#define SS_RIM_NONE UINT32_MAX

/* A silhouette vertex. Nearly all have one edge that arrives and one that leaves. */
typedef struct ss_rim_vertex {
    double x, y, h;
    uint32_t in, out; /* the last such edge */
    uint32_t arriving, leaving;
    bool cut; /* made by the near plane: the silhouette goes on behind it */
    double tangent[2]; /* X / D, Y / D; 0 where penumbrae are round: see ss_rim */
} ss_rim_vertex;

/* From vertex[0] to vertex[1]; in (X, Y), X to the right and Y up, the occluder is on the left. */
typedef struct ss_rim_edge {
    uint32_t vertex[2];
    double along[2]; /* unit; 0 0: seen end on */
    double length;
} ss_rim_edge;

/* A lamp that is a sphere, seen away from the frame's axis: the plane through a point and an edge
 * cuts it as its distance from the lamp's centre says; on the frame's reference plane that is as if
 * the light were a disk wider by sqrt(1 + o^2), o the tangent at which the edge's line passes the
 * axis. Every distance below is divided by that, so that `rate` turns it into h for every light. */
typedef struct ss_rim {
    ss_rim_vertex *vertex;
    ss_rim_edge *edge;
    size_t vertex_count, edge_count;
    float *row; /* SS_RIM_ROW a row, for what is drawn: of edge i and of vertex i */
    size_t rows;
} ss_rim;

/* A row: the way outwards of an edge in (X, Y), how much wider its penumbra is; the vertex's
 * place. */
enum { SS_RIM_RIGHT, SS_RIM_WIDE = 2, SS_RIM_PLACE, SS_RIM_ROW = 5 };

/* The silhouette as the light's frames see it; stage needs topology and silhouettes. */
softshadow_status ss_rim_find(const ss_stage *stage, ss_silhouette *out);
/* What of it can matter in one frame: before the far receivers, within penumbra's reach of the
 * map. */
softshadow_status ss_rim_build(ss_rim *out, const ss_stage *stage, const ss_silhouette *found,
                                   const ss_frame *frame, uint32_t resolution);
void ss_rim_free(ss_rim *rim);
/* How much wider a vertex's penumbra is in direction m, a unit vector. */
double ss_rim_stretch(const ss_rim_vertex *v, const double m[2]);

/* What is drawn along a rim. Attributes of the polygons:
 *   strips   0: distance from the edge in texels, > 0 outside, < 0 inside   1: the edge's h there
 *   corners  0, 2: the place relative to the vertex, in texels              1: the vertex's h
 *            3: that place times the vertex's tangent
 * tag = 8 * (index of the edge or vertex) + SS_RIM_ flags. */
typedef struct ss_rim_style {
    double (*width)(const void *ctx, const ss_rim_vertex *vertex); /* of a strip, in such texels */
    const void *ctx;
    bool tangent; /* strips touch the circles of these widths around their ends, as sheets touch cones;
                     else they are perpendicular to the edge */
    bool inside; /* draw both sides; a strip then is one, perpendicular to its edge */
    const uint8_t *hidden; /* of each edge: a hidden one draws nothing, nor do corners between such;
                              or NULL: all are seen */
    bool average; /* where more than two edges meet: pieces towards the mean normal, not a disc */
    const float *depth; /* of the map, `side` texels squared; NULL: not looked at */
    uint32_t side;
    bool sky;   /* polygons are to be marked with SS_RIM_SKY */
    float past; /* as for ss_rim_find_hidden(): corners that hide as much draw nothing, either */
} ss_rim_style;

/* INSIDE: of corners. DISC: all around a vertex whose inside and outside the rim does not tell. */
enum { SS_RIM_CORNER = 1, SS_RIM_INSIDE = 2, SS_RIM_DISC = 4, SS_RIM_TAG = 8 };
/* Only where it is asked for: light gets past as far as it likes, ss_rim_open() is SS_MAP_FAR for
 * all that hangs on it, of a corner from a texel away on. */
#define SS_RIM_SKY 0x80000000u
static inline uint32_t ss_rim_number(uint32_t tag) { return (tag & ~SS_RIM_SKY) / SS_RIM_TAG; }

/* How far texel i of a run is from its edge or vertex; the sign of strips is kept. */
static inline float ss_rim_away(const ss_raster_run *run, uint32_t i) {
    const float x = run->attribute[0][i];
    if (!(run->tag & SS_RIM_CORNER)) return x;
    const float y = run->attribute[2][i], lean = run->attribute[3][i], square = x * x + y * y;
    return square > 0 ? square / sqrtf(square + lean * lean) : 0;
}

/* Not above ss_rim_away() of anything whose attributes are within low..high; a little less, for
 * what rounding does. */
static inline float ss_rim_least(uint32_t tag, const float *low, const float *high) {
    const float x = low[0] > 0 ? low[0] : high[0] < 0 ? -high[0] : 0;
    if (!(tag & SS_RIM_CORNER)) return x * (1 - 0x1p-16f);
    const float y = low[2] > 0 ? low[2] : high[2] < 0 ? -high[2] : 0;
    const float lean = fmaxf(fabsf(low[3]), fabsf(high[3])), square = x * x + y * y;
    return square > 0 ? square / sqrtf(square + lean * lean) * (1 - 0x1p-16f) : 0;
}

/* Can something with such attributes be inside? */
static inline bool ss_rim_reaches_in(uint32_t tag, const float *low) {
    return tag & SS_RIM_CORNER ? tag & (SS_RIM_INSIDE | SS_RIM_DISC) : low[0] < 0;
}

/* What texel i of a run hangs on. */
typedef struct ss_rim_foot {
    float away;                /* from it, in texels, > 0 outside, < 0 inside */
    float place[2];            /* the nearest on its edge; its vertex */
    float outwards[2];         /* across the edge there, a unit vector; 0 0: on a vertex */
    bool inside;
} ss_rim_foot;
/* covered: does the occluder cover the texel? Discs are inside where it does. */
static inline ss_rim_foot ss_rim_foot_of(const ss_rim *rim, const ss_raster_run *run, uint32_t i,
                                         bool covered) {
    const float *row = rim->row + (size_t)(run->tag / SS_RIM_TAG) * SS_RIM_ROW;
    const float away = ss_rim_away(run, i), dx = run->attribute[0][i];
    if (!(run->tag & SS_RIM_CORNER)) {
        const float right[2] = {row[SS_RIM_RIGHT], row[SS_RIM_RIGHT + 1]};
        const float foot = row[SS_RIM_WIDE] * away;
        const float x = (float)(run->x + i) + .5f, y = (float)run->y + .5f;
        return (ss_rim_foot){away,
                             {x - foot * right[0], y - foot * right[1]},
                             {right[0], right[1]},
                             away < 0};
    }
    const bool inside = run->tag & SS_RIM_DISC ? covered : run->tag & SS_RIM_INSIDE;
    const float dy = run->attribute[2][i], length = sqrtf(dx * dx + dy * dy);
    const float sign = inside ? -1 : 1, per = length > 0 ? sign / length : 0;
    return (ss_rim_foot){sign * away,
                         {row[SS_RIM_PLACE], row[SS_RIM_PLACE + 1]},
                         {dx * per, dy * per},
                         inside};
}

/* How deep light gets past a silhouette: the map's depth a little outside of a place on it, one and
 * a half texels away where its own surface has ended, or two and a half where a bend is still in
 * the way. Above the edge: something nearer hides the silhouette. */
float ss_rim_open(const float *depth, uint32_t side, const float place[2], const float outwards[2]);

/* Past which edges light gets nowhere deeper than `past` below them, as nearer things hide them, for
 * one: all along is hidden. A byte each; *hidden is to be freed with ss_free. */
enum { SS_RIM_SEEN, SS_RIM_PARTLY, SS_RIM_HIDDEN };
softshadow_status ss_rim_find_hidden(const ss_stage *stage, const ss_rim *rim, const float *depth,
                                     uint32_t side, float past, uint8_t **hidden);

/* The same as text, for offers (raster.h, ss_raster_ink), operation by operation. */
#define SS_RIM_AWAY_GLSL \
    "float rim_away(uint tag, vec4 varied) {\n" \
    "    precise float square = varied.x * varied.x + varied.z * varied.z;\n" \
    "    if ((tag & 1u) == 0u) return varied.x;\n" \
    "    precise float away = square > 0.0 ? square / sqrt(square + varied.w * varied.w) : 0.0;\n" \
    "    return away;\n" \
    "}\n"

/* With the face's depths, a technique's own numbers and the rim's rows: see ss_rim_tables(). */
#define SS_RIM_GLSL SS_RIM_AWAY_GLSL \
    "layout(std430, binding = 4) readonly buffer Depths { float depths[]; };\n" \
    "layout(std430, binding = 5) readonly buffer Words { float words[]; };\n" \
    "layout(std430, binding = 6) readonly buffer Rows { float rows[]; };\n" \
    "float depth_at(ivec2 at) { return depths[uint(at.y) * resolution + uint(at.x)]; }\n" \
    "struct Foot { float away; vec2 place; vec2 outwards; bool inside; };\n" \
    "Foot rim_foot(uint tag, ivec2 texel, vec4 varied, bool covered) {\n" \
    "    uint row = (tag >> 3u) * 5u;\n" \
    "    precise Foot f;\n" \
    "    f.away = rim_away(tag, varied);\n" \
    "    if ((tag & 1u) == 0u) {\n" \
    "        precise float foot = rows[row + 2u] * f.away;\n" \
    "        f.outwards = vec2(rows[row], rows[row + 1u]);\n" \
    "        f.place = vec2(texel) + 0.5 - foot * f.outwards;\n" \
    "        f.inside = f.away < 0.0;\n" \
    "        return f;\n" \
    "    }\n" \
    "    f.inside = (tag & 4u) != 0u ? covered : (tag & 2u) != 0u;\n" \
    "    precise float reach = sqrt(varied.x * varied.x + varied.z * varied.z);\n" \
    "    float side = f.inside ? -1.0 : 1.0;\n" \
    "    precise float per = reach > 0.0 ? side / reach : 0.0;\n" \
    "    f.away = side * f.away;\n" \
    "    f.place = vec2(rows[row + 3u], rows[row + 4u]);\n" \
    "    f.outwards = vec2(varied.x * per, varied.z * per);\n" \
    "    return f;\n" \
    "}\n" \
    "float rim_depth(vec2 at) {\n" \
    "    float most = float(resolution - 1u);\n" \
    "    uint x = uint(at.x > 0.0 ? at.x < most ? at.x : most : 0.0);\n" \
    "    uint y = uint(at.y > 0.0 ? at.y < most ? at.y : most : 0.0);\n" \
    "    return depths[y * resolution + x];\n" \
    "}\n" \
    "float rim_open(Foot f) {\n" \
    "    precise vec2 near = f.place + 1.5 * f.outwards, far = f.place + 2.5 * f.outwards;\n" \
    "    return max(rim_depth(near), rim_depth(far));\n" \
    "}\n"
/* The ink's tables for it. */
void ss_rim_tables(const ss_rim *rim, const float *depth, uint32_t side, const float *words,
                   size_t word_count, ss_raster_ink *ink);

/* The polygons, to be freed with ss_free; *count of them, in an order that no thread changes. */
softshadow_status ss_rim_draw(const ss_rim *rim, const ss_rim_style *style, ss_pool *pool,
                              ss_raster_polygon **polygons, size_t *count);

#endif
