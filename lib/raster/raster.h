/* Drawing into maps: one table of passes; nothing above knows which machine draws.
 *
 * The fill rule, which every backend keeps: a texel is covered where its centre is inside the
 * triangle; a centre exactly on an edge belongs to the triangle for which that edge is a top or a
 * left one. Corners are snapped to 1/256 of a texel first, the same way for whoever shares them:
 * neighbours neither overlap nor leave gaps. Both sides of a triangle are drawn.
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
    bool holes_only; /* triangles without an opacity texture are left out */
    uint8_t *held;  /* per triangle, set to 1 where the map needs it; or NULL */
} ss_raster_casters;

#define SS_RASTER_ATTRIBUTES 4

/* A triangle or a convex quadrilateral of the techniques' own, in map coordinates, with numbers
 * that vary linearly across all of it. */
typedef struct ss_raster_polygon {
    double corner[4][2];
    double attribute[4][SS_RASTER_ATTRIBUTES];
    uint32_t corners; /* 3 or 4, one after the other around it */
    uint32_t tag;     /* handed to shade */
} ss_raster_polygon;

/* Called for runs of covered texels: n of them from column x on in row y. attribute[k][i] belongs
 * to texel x + i. Runs of one row come in the order of their polygons; rows may come from any
 * thread. */
typedef struct ss_raster_run {
    uint32_t x, y, n, tag;
    const float *attribute[SS_RASTER_ATTRIBUTES];
} ss_raster_run;
typedef void ss_raster_shade(void *ctx, const ss_raster_run *run);

/* A read-only array that a shader sees as a buffer of 32-bit words. */
typedef struct ss_raster_table {
    const void *data;
    size_t size; /* bytes */
} ss_raster_table;
#define SS_RASTER_TABLES 6

/* How a technique keeps what covers a texel: of all that is offered there the one with the least
 * key; which of those that are alike is the machine's to choose, and always the same one. The same
 * twice: for machines that run C, and as text. */
#define SS_RASTER_INK_TABLES 3

/* A square of texels while it is drawn, in rows as registers take them; of a smaller one at the
 * map's edge the first columns and rows count. The names are the inks'. */
#define SS_RASTER_TILE 16
typedef struct ss_raster_tile {
    int32_t x, y, width, height;
    _Alignas(64) float key[SS_RASTER_TILE][SS_RASTER_TILE], depth[SS_RASTER_TILE][SS_RASTER_TILE],
        value[3][SS_RASTER_TILE][SS_RASTER_TILE];
} ss_raster_tile;

/* A polygon in a tile: not nearer than `least`, as the ink's `least` below has it, with attribute
 * 1 not below `nearest`. */
typedef struct ss_raster_visit {
    uint32_t part; /* of what is drawn */
    uint16_t tile; /* of a band */
    uint8_t kind, bucket;
    float least, nearest;
} ss_raster_visit;

/* Rows of the map, and tiles along them: two rows of tiles make a band. */
typedef struct ss_raster_band {
    int32_t first_row, last_row;
    uint32_t across;
} ss_raster_band;

/* How an ink draws whole tiles: reads what it needs of its planes, adds polygons, says what there
 * is room for (as `room` below), writes every texel. What it keeps is what `shade` would. */
struct ss_scan;
typedef struct ss_raster_tiler {
    /* The tiles of a band that a polygon touches: writes them, gives how many. NULL: by `least`
     * below, one by one, which says the same. */
    uint32_t (*visit)(const void *tiler_ctx, const struct ss_scan *scan, uint32_t tag,
                      const ss_raster_band *band, uint32_t part, ss_raster_visit *out);
    /* Instead of all that follows where nothing is drawn; NULL: it begins and ends. */
    void (*blank)(const void *tiler_ctx, const ss_raster_tile *tile);
    void (*begin)(const void *tiler_ctx, ss_raster_tile *tile);
    void (*draw)(const void *tiler_ctx, ss_raster_tile *tile, const struct ss_scan *scan,
                 uint32_t tag);
    void (*room)(const void *tiler_ctx, const ss_raster_tile *tile, float nearest, float most[2]);
    void (*end)(const void *tiler_ctx, ss_raster_tile *tile); /* whose numbers are done with */
} ss_raster_tiler;

typedef struct ss_raster_ink {
    ss_raster_shade *shade; /* offers and keeps by itself */
    void *ctx;
    /* Declares its tables, at most SS_RASTER_INK_TABLES (binding 4 and on) and defines
     *   bool offer(uint tag, ivec2 texel, vec4 varied, precise out float key, out vec4 value)
     * false: not offered. It is called more than once, by several programs: whatever key depends on
     * is to be `precise`. `resolution` is a constant of the text before it. */
    const char *offer_glsl;
    ss_raster_table table[SS_RASTER_TABLES];
    uint32_t tables;
    float first_key; /* what each texel has at first: only lesser keys count */
    void (*keep)(void *keep_ctx, uint32_t x, uint32_t y, float key, const float value[4]);
    void *keep_ctx;
    /* Of keep_ctx. What lets the CPU draw near things first and pass over what is too far to be
     * kept; NULL: all is drawn. `least` is not above the distance, in a measure of the ink's own,
     * of anything that a tag with attributes within low..high can offer; *kind: 0 or 1, as room()
     * tells apart. `room` gives for both kinds a distance from which on nothing is kept in a box of
     * texels (last ones included) of what has attribute 1 not below `nearest`. */
    float (*least)(const void *keep_ctx, uint32_t tag, const float *low, const float *high,
                   int *kind);
    void (*room)(const void *keep_ctx, const uint32_t box[4], float nearest, float most[2]);
    const ss_raster_tiler *tiler; /* instead of shade and room, where the machine has tiles; or NULL */
    const void *tiler_ctx;
} ss_raster_ink;

/* What answers points: text that declares its tables (binding 2 and on) and defines
 *   float answer(vec3 look, uint face)
 * of a point in map coordinates, and those tables. Texts are constants: they are known by
 * address. */
typedef struct ss_raster_question {
    const char *glsl;
    ss_raster_table table[SS_RASTER_TABLES]; /* one less where it is in parts */
    uint32_t tables;
    /* A point may take very many steps, more than some devices run in one go. The text defines
     *   bool advance(vec3 look, uint face, inout uvec4 at)
     * instead, which goes on from `at`, at first all 0, and adds to `steps`, each time a loop goes
     * round, what that may need at most: points run side by side, and wait for each other. From
     * most_steps on it stops: false. true: at.x has the bits of the answer. at.x is never ~0; two
     * such loops at most. */
    bool parts;
} ss_raster_question;

typedef struct ss_raster_program ss_raster_program; /* a question at the machine, its tables copied */
typedef struct ss_raster_ticket ss_raster_ticket;   /* points on their way */
typedef float ss_raster_look[4];                    /* column, row, h, face */

/* An image to work over, pass by pass: text that defines
 *   uint pixel(uvec2 at, uint pass)
 * the bits of a pixel's new value, from before[] as the last pass left it, the bits of all row
 * after row; width, height, number, and id_of(index) are there. */
typedef struct ss_raster_image {
    const char *glsl;
    float *values;       /* written only when all has gone well */
    const uint32_t *ids; /* a pixel; NULL: all the same */
    uint32_t width, height, passes, number;
} ss_raster_image;

/* What the thread that calls has spent on copies since it last asked, in seconds. */
typedef struct ss_raster_spent {
    double up, down;
} ss_raster_spent;

typedef struct ss_raster_device {
    char name[128], version[128]; /* the driver's words */
} ss_raster_device;

typedef struct ss_raster {
    const char *name;
    /* Makes the machine ready, once a process; what it is goes to *device. NULL: always ready. */
    softshadow_status (*open)(ss_raster_device *device);
    /* The nearest h of any caster at each texel, SS_MAP_FAR where there is none; in each layer
     * after the first the nearest that is below the one before, as ss_map_below() has it. */
    softshadow_status (*depth)(const ss_raster_casters *casters, float *const layer[],
                               uint32_t layers, ss_pool *pool);
    /* The nearest h deeper than `above`. */
    softshadow_status (*peel)(const ss_raster_casters *casters, const float *above, float *plane,
                              ss_pool *pool);
    bool tiles; /* keep() draws by the ink's tiler, if there is one: all texels are written */
    /* What the ink keeps of the polygons, whose corners may be anywhere. */
    softshadow_status (*keep)(const ss_raster_polygon *polygons, size_t count,
                              uint32_t resolution, const ss_raster_ink *ink, ss_pool *pool);

    /* Questions. NULL, all four: they are asked in C. A ticket is to be waited for, whatever
     * happened meanwhile; looks and answers stay where they are until then. Any number of threads
     * may ask. */
    softshadow_status (*load)(const ss_raster_question *question, ss_raster_program **out);
    softshadow_status (*submit)(ss_raster_program *program, const ss_raster_look *looks, size_t n,
                                float *answers, ss_raster_ticket **out);
    softshadow_status (*wait)(ss_raster_ticket *ticket);
    void (*unload)(ss_raster_program *program); /* NULL is fine */
    softshadow_status (*work)(const ss_raster_image *image); /* NULL: done in C */
    ss_raster_spent (*spent)(void);             /* and starts anew; NULL: there are no copies */
} ss_raster;

extern const ss_raster ss_raster_cpu, ss_raster_egl;

#endif
