/* What the map techniques have in common: frames, the depth map of the hard shadow, what becomes of
 * a point beyond its map, and how planes are handed out. A technique's state begins with an
 * ss_light_maps. */
#ifndef SS_TECHNIQUE_LIGHT_MAPS_H
#define SS_TECHNIQUE_LIGHT_MAPS_H

#include <math.h>

#include "map/falloff.h"
#include "map/frame.h"
#include "raster/raster.h"
#include "technique/technique.h"

/* The steepest surface, in h per unit of X, that a bias follows: 86 degrees. Steeper ones receive
 * less than 7 % of the light and are below their own horizon for part of it. */
#define SS_MAP_STEEPEST 16.0

#define SS_LIGHTS_ROUND \
    (1u << SOFTSHADOW_SPHERE | 1u << SOFTSHADOW_DISK | 1u << SOFTSHADOW_SUN)
#define SS_LIGHTS_RECT (1u << SOFTSHADOW_RECT)

#define SS_LIGHT_MAPS_WORDS (8 + 64 * SS_MAP_FACES)

typedef struct ss_light_maps ss_light_maps;
/* One block's answers: out[i] for looks i. */
typedef void ss_light_maps_answer(const ss_light_maps *maps, const ss_looks *looks, size_t n,
                                  float *out);

struct ss_light_maps {
    ss_frames frames;
    ss_light_maps_answer *answer; /* ss_light_maps_hard() until the plane of its own is there */
    const ss_world *world;
    size_t texels; /* of all faces */
    float *depth;  /* the hard shadow's: nearest h, biased */
    float *below;  /* what lies below that, all faces' second layers first; NULL: nobody asked */
    float *plane;  /* the technique's own, `channels` numbers a texel; NULL: none */
    uint32_t channels;
    /* A tile of SS_RASTER_TILE texels squared: nothing before this depth is less than lit by what
     * the plane has there or in the tiles after it, along both axes; NULL: not known. */
    float *lit;
    const char *plane_name, *channel_names; /* "a,b,...": softshadow_map's; may be NULL */
    ss_falloff falloff;
    ss_light light; /* for horizons */
    uint64_t silhouette_edges, culled;
    size_t state_size;
    float *packed; /* a table that is made for the shader; NULL: none */
    float words[SS_LIGHT_MAPS_WORDS]; /* numbers for the shader: see SS_LIGHT_MAPS_GLSL */
};

/* How a technique wants its hard shadow. */
typedef struct ss_light_maps_wish {
    size_t state_size;    /* of the technique's state */
    double slope_texels;  /* how far from a texel's centre it is looked at, along each axis; half as
                             much again where the surface next to it may be steeper */
    bool bare;            /* depths as they are: the technique has its own way against acne */
    uint32_t below;       /* so many layers below the first, of bare ones */
    bool margin;          /* does it look beyond the point's own place by penumbra widths? */
    ss_falloff_paper paper;
} ss_light_maps_wish;

/* Allocates the state, fits the frames, draws the depth. *state is NULL on failure. In two steps
 * for who has to know the frames first: the second leaves the state where it is, whatever
 * happens. */
softshadow_status ss_light_maps_fit(const ss_stage *stage, const ss_light_maps_wish *wish,
                                    void **state);
softshadow_status ss_light_maps_draw(const ss_stage *stage, const ss_light_maps_wish *wish,
                                     ss_light_maps *maps);
softshadow_status ss_light_maps_build(const ss_stage *stage, const ss_light_maps_wish *wish,
                                      void **state);
/* A plane of `channels` a texel for all faces, zero, and what answers from it. */
softshadow_status ss_light_maps_add_plane(ss_light_maps *maps, const char *name, uint32_t channels,
                                          ss_light_maps_answer *answer);
/* The same, of any content: to be written whole. */
softshadow_status ss_light_maps_add_any(ss_light_maps *maps, const char *name, uint32_t channels,
                                        ss_light_maps_answer *answer);

/* Of a face, layer 0 to wish->below, while the state is built; drop them then. */
float *ss_light_maps_layer(const ss_light_maps *maps, uint32_t face, uint32_t layer);
void ss_light_maps_drop_layers(ss_light_maps *maps);

/* Channels' rows of n numbers, woven into texels. */
void ss_light_maps_weave(const float *const channel[], uint32_t channels, uint32_t n,
                         float *texels);

/* The table `lit`, of which nothing is known yet; who draws tiles writes what it knows. Then
 * finish: a place between texels may reach into the tiles after its own. */
softshadow_status ss_light_maps_add_lit(ss_light_maps *maps);
void ss_light_maps_finish_lit(ss_light_maps *maps);
static inline uint32_t ss_light_maps_tiles(const ss_light_maps *maps) { /* along a side */
    return (maps->frames.resolution + SS_RASTER_TILE - 1) / SS_RASTER_TILE;
}
static inline float *ss_light_maps_lit(const ss_light_maps *maps, uint32_t face) {
    const size_t tiles = ss_light_maps_tiles(maps);
    return maps->lit + face * tiles * tiles;
}
/* Writes a tile's. */
static inline void ss_light_maps_set_lit(float *lit, uint32_t side, const ss_raster_tile *tile,
                                         float depth) {
    const size_t across = (side + SS_RASTER_TILE - 1) / SS_RASTER_TILE;
    lit[(size_t)tile->y / SS_RASTER_TILE * across + (size_t)tile->x / SS_RASTER_TILE] = depth;
}

/* The technique vtable's, for states that begin with an ss_light_maps and hold nothing else. */
void ss_light_maps_destroy(void *state);
size_t ss_light_maps_bytes(const void *state);
uint32_t ss_light_maps_count(const void *state);
void ss_light_maps_get(const void *state, uint32_t index, softshadow_map *map);
uint64_t ss_light_maps_silhouettes(const void *state);
uint64_t ss_light_maps_culled(const void *state);

/* The vtable's query: blocks, the lamp's inside, horizons, counts. */
softshadow_status ss_light_maps_query(const ss_stage *stage, const void *state,
                                      const ss_point *points, size_t n, float *visibility,
                                      float *bound, ss_arena *scratch, ss_counts *counts);
void ss_light_maps_query_places(const void *state, const ss_places *places, size_t n,
                                float *visibility, ss_counts *counts);
/* At most SS_PLACES points' places. */
void ss_light_maps_place(const ss_point *points, size_t n, ss_places *out);
/* The hard shadow: 0 where something nearer is in the point's texel. */
void ss_light_maps_hard(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out);

/* ---- the same on a GPU ----------------------------------------------------------------------- */

/* What a technique's query_glsl begins with: the tables that ss_light_maps_tables() names, and what
 * the functions of the same names do in C. words[]: the side of a map, 7 numbers of the technique's
 * own, then 64 a face. */
#define SS_LIGHT_MAPS_GLSL \
    "layout(std430, binding = 2) readonly buffer Depths { float depths[]; };\n" \
    "layout(std430, binding = 3) readonly buffer Planes { float planes[]; };\n" \
    "layout(std430, binding = 4) readonly buffer Falloff { float falloff[]; };\n" \
    "layout(std430, binding = 5) readonly buffer Words { float words[]; };\n" \
    "uint side() { return uint(words[0]); }\n" \
    "uint base_of(uint face) { return face * side() * side(); }\n" \
    "float word(uint face, uint i) { return words[8u + 64u * face + i]; }\n" \
    "float falloff_at(float l) {\n" \
    "    float x = (l > 0.0 ? l < 1.0 ? l : 1.0 : 0.0) * 1024.0;\n" \
    "    int i = int(x);\n" \
    "    return falloff[i] + (x - float(i)) * (falloff[i + 1] - falloff[i]);\n" \
    "}\n" \
    "float hard(vec3 look, uint face) {\n" \
    "    uint at = base_of(face) + uint(look.y) * side() + uint(look.x);\n" \
    "    return depths[at] < look.z ? 0.0 : 1.0;\n" \
    "}\n"
/* A face's 64. */
static inline float *ss_light_maps_words(ss_light_maps *maps, uint32_t face) {
    return maps->words + 8 + 64 * (size_t)face;
}
/* The 16 that take a place in a face's map back to local coordinates, for SS_LIGHT_LIFT_GLSL. */
void ss_light_maps_lift_words(const ss_frame *frame, float *words);
#define SS_LIGHT_LIFT_GLSL \
    "vec3 word3(uint face, uint i) { return vec3(word(face, i), word(face, i + 1u), word(face, i + 2u)); }\n" \
    "vec3 lift(uint face, vec3 look) {\n" \
    "    float s = 1.0 - look.z * word(face, 15u);\n" \
    "    vec2 at = (vec2(word(face, 12u), word(face, 13u)) + look.xy * word(face, 14u)) / s;\n" \
    "    return word3(face, 0u) + at.x * word3(face, 3u) + at.y * word3(face, 6u) +\n" \
    "           look.z / s * word3(face, 9u);\n" \
    "}\n"
extern const char ss_light_maps_hard_glsl[];

/* The technique vtable's. The question is `glsl` with tables 0 to 3; the caller may add two. */
softshadow_status ss_light_maps_ask(ss_light_maps *maps, const char *glsl,
                                    ss_raster_question *question);
softshadow_status ss_light_maps_tables_hard(void *state, ss_raster_question *question);
void ss_light_maps_look(const void *state, const ss_point *points, size_t n, float (*looks)[4]);
void ss_light_maps_horizon(const ss_stage *stage, const void *state, const ss_point *points,
                           size_t n, float *visibility, float *bound, ss_counts *counts);

/* The rows of a technique's table that all of them have alike. */
#define SS_LIGHT_MAPS_ROWS                                                                         \
    .query = ss_light_maps_query, .query_places = ss_light_maps_query_places,                     \
    .look = ss_light_maps_look, .horizon = ss_light_maps_horizon,                                  \
    .map_count = ss_light_maps_count, .get_map = ss_light_maps_get,                                \
    .silhouette_edges = ss_light_maps_silhouettes, .casters_culled = ss_light_maps_culled

/* ---- outer penumbrae: penumbra-map and smoothie ---------------------------------------------- */

/* A texel of them, four floats: the hard shadow's depth; the occluder's depth h_v, SS_MAP_FAR:
 * none; `rise`, how much deeper than h_v a receiver must be for the penumbra to begin there; and
 * the coordinate of the map's own receiver, by which the darkest was kept. At a receiver at h_p the
 * outer coordinate is rise / (h_p - h_v). */
enum { SS_OUTER_DEPTH, SS_OUTER_VERTEX, SS_OUTER_RISE, SS_OUTER_KEY, SS_OUTER_CHANNELS };
/* Offers a texel a penumbra: kept if it is the darkest so far for the map's receiver. */
void ss_outer_offer(const ss_light_maps *maps, uint32_t face, uint32_t x, uint32_t y, float vertex,
                    float rise);
/* The vtable's, for a plane of these texels, or the hard shadow where there is none. */
extern const char ss_outer_glsl[];
softshadow_status ss_outer_tables(void *state, ss_raster_question *question);
void ss_outer_answer(const ss_light_maps *maps, const ss_looks *looks, size_t n, float *out);

#endif
