/* The techniques' own polygons. Penumbrae overlap tens of times where a light is large, and of all
 * that is offered to a texel the nearest is kept: so a band's tiles get their polygons sorted by
 * the least distance that each can have there, and once a tile is full of what is nearer the rest
 * is passed over (as a hierarchical depth buffer does: [GKM93]). The order, and with it what is
 * kept of things alike, depends on the polygons only. */
#include "raster/cpu/keep.h"

#include <math.h>
#include <string.h>

#include "base/lanes.h"
#include "base/memory.h"
#include "base/status.h"
#include "raster/casters.h"
#include "raster/cpu/bins.h"

#define TILE    SS_RASTER_TILE /* texels along a side; two rows of tiles make a band */
#define BUCKETS 32 /* of distance, in a tile */
#define LOOK_EACH 8 /* polygons drawn until it is asked again what a tile has room for */
#define ROOMS 4 /* depths that a tile is asked for */
#define MOST_PARTS (SS_CLIP_MOST - 2) /* of a clipped polygon */

typedef struct sketch {
    const ss_raster_polygon *polygons;
    uint32_t resolution;
    const ss_raster_ink *ink;
    uint32_t *first; /* part of each polygon */
    ss_scan *parts;  /* first_x > last_x: covers nothing */
    uint32_t *owner; /* polygon of each part */
    ss_bins bins;
} sketch;

/* ---- polygons ------------------------------------------------------------------------------- */

static bool is_far(const ss_raster_polygon *t) {
    bool far = false;
    for (uint32_t k = 0; k < t->corners; k++) {
        far |= !(fabs(t->corner[k][0]) < SS_GUARD && fabs(t->corner[k][1]) < SS_GUARD);
    }
    return far;
}

static uint32_t parts_of(const ss_raster_polygon *p) {
    return is_far(p) ? MOST_PARTS : p->corners - 2;
}

static const ss_scan nothing = {.first_x = 1};

static void set_up_part(const sketch *s, const ss_scan_corner part[3], ss_scan *scan) {
    if (!ss_scan_snap(scan, part, s->resolution) || ss_scan_area(scan) == 0) {
        *scan = nothing;
        return;
    }
    ss_scan_gradients(scan, part, SS_RASTER_ATTRIBUTES);
    ss_scan_lines(scan);
}

/* Gives how many parts. Quadrilaterals stay whole, if nothing has cut them. */
static uint32_t set_up_polygon(const sketch *s, const ss_raster_polygon *polygon, ss_scan *parts) {
    ss_scan_corner corner[SS_CLIP_MOST];
    const int count = ss_raster_polygon_corners(polygon, corner);
    const bool quad = polygon->corners == 4 && count == 4;
    if (quad && ss_scan_quad(parts, corner, s->resolution)) return 1;
    for (int k = 2; k < count; k++) {
        const ss_scan_corner part[3] = {corner[0], corner[k - 1], corner[k]};
        set_up_part(s, part, &parts[k - 2]);
    }
    return count > 2 ? (uint32_t)count - 2 : 0;
}

static softshadow_status set_up(void *ctx, uint64_t begin, uint64_t end) {
    const sketch *s = ctx;
    for (uint64_t t = begin; t < end; t++) {
        const uint32_t first = s->first[t], room = s->first[t + 1] - first;
        uint32_t used = set_up_polygon(s, &s->polygons[t], s->parts + first);
        for (; used < room; used++) s->parts[first + used] = nothing;
        for (uint32_t k = 0; k < room; k++) s->owner[first + k] = (uint32_t)t;
    }
    return SOFTSHADOW_OK;
}

static bool part_rows(const void *ctx, size_t i, int32_t *first, int32_t *last) {
    const ss_scan *scan = &((const sketch *)ctx)->parts[i];
    *first = scan->first_y, *last = scan->last_y;
    return scan->first_x <= scan->last_x;
}

/* ---- a band --------------------------------------------------------------------------------- */

typedef ss_raster_visit visit;

typedef struct band {
    const sketch *sketch;
    int32_t first_row, last_row;
    uint32_t across;   /* tiles */
    visit *visits;     /* as they come; then sorted */
    uint32_t *order;
    size_t count, room;
    uint32_t *start;   /* of each tile's buckets */
} band;

static int32_t least_of(int32_t a, int32_t b) { return a < b ? a : b; }
static int32_t greatest_of(int32_t a, int32_t b) { return a > b ? a : b; }

/* What the attributes can be in a box of texels, all four at once. */
static inline void bound(const ss_scan *s, const int32_t box[4], ss_floats *low, ss_floats *high) {
    const ss_floats sx = ss_floats_load(s->step_x), sy = ss_floats_load(s->step_y);
    const ss_floats left = sx * (float)(box[0] - s->first_x),
                    right = sx * (float)(box[2] - s->first_x);
    const ss_floats below = sy * (float)(box[1] - s->first_y),
                    above = sy * (float)(box[3] - s->first_y);
    const ss_floats start = ss_floats_load(s->start);
    const ss_floats least = ss_floats_load(s->least), most = ss_floats_load(s->most);
    const ss_floats a = start + ss_floats_less(left, right) + ss_floats_less(below, above);
    const ss_floats b = start + ss_floats_more(left, right) + ss_floats_more(below, above);
    *low = ss_floats_less(ss_floats_more(a, least), most);
    *high = ss_floats_less(ss_floats_more(b, least), most);
}

/* Is all of a box outside of an edge? Then so is its best corner. */
static inline bool misses(const ss_scan *s, const int32_t box[4]) {
    int64_t least = 0;
    for (int k = 0; k < 4; k++) {
        const ss_scan_line *e = &s->line[k];
        const int64_t x = (e->right > 0 ? box[2] : box[0]) - s->first_x;
        const int64_t y = (e->up > 0 ? box[3] : box[1]) - s->first_y;
        least |= e->at + x * e->right + y * e->up;
    }
    return least < 0; /* one of them is */
}

/* For one polygon in all tiles. */
static bool make_room(band *b) {
    const size_t most = 2 * (size_t)b->across;
    if (b->room - b->count >= most) return true;
    const size_t wanted = 2 * b->room + 4096 + most;
    visit *grown = ss_grow(b->visits, b->count, wanted, sizeof *grown);
    if (!grown) return false;
    b->visits = grown, b->room = wanted;
    return true;
}

static void add_visits(band *b, uint32_t part) {
    const sketch *s = b->sketch;
    const ss_scan *scan = &s->parts[part];
    const uint32_t tag = s->polygons[s->owner[part]].tag;
    const int32_t low = greatest_of(scan->first_y, b->first_row),
                  high = least_of(scan->last_y, b->last_row);
    for (int32_t row = (low - b->first_row) / TILE; row <= (high - b->first_row) / TILE; row++) {
        for (int32_t column = scan->first_x / TILE; column <= scan->last_x / TILE; column++) {
            const int32_t x = column * TILE, y = b->first_row + row * TILE;
            const int32_t box[4] = {greatest_of(x, scan->first_x), greatest_of(y, low),
                                    least_of(x + TILE - 1, scan->last_x),
                                    least_of(y + TILE - 1, high)};
            if (misses(scan, box)) continue;
            ss_floats lowest, highest;
            bound(scan, box, &lowest, &highest);
            float from[4], to[4];
            ss_floats_store(from, lowest), ss_floats_store(to, highest);
            int kind = 0;
            visit v = {.part = part, .nearest = from[1],
                       .tile = (uint16_t)((uint32_t)row * b->across + (uint32_t)column)};
            v.least = s->ink->least(s->ink->keep_ctx, tag, from, to, &kind);
            v.kind = (uint8_t)kind;
            b->visits[b->count++] = v;
        }
    }
}

static bool visit_band(band *b, uint32_t index) {
    const sketch *s = b->sketch;
    const ss_raster_tiler *tiler = s->ink->tiler;
    const ss_raster_band rows = {b->first_row, b->last_row, b->across};
    for (uint32_t i = s->bins.first[index]; i < s->bins.first[index + 1]; i++) {
        const uint32_t part = s->bins.item[i];
        if (!make_room(b)) return false;
        if (!tiler || !tiler->visit)
            add_visits(b, part);
        else
            b->count += tiler->visit(s->ink->tiler_ctx, &s->parts[part],
                                     s->polygons[s->owner[part]].tag, &rows, part,
                                     b->visits + b->count);
    }
    return true;
}

/* A tile's distances are spread over its buckets. */
typedef struct span {
    float least, most, nearest, farthest; /* the last two: of visits' `nearest` */
} span;

static bool sort_visits(band *b, span *spans) {
    const uint32_t tiles = 2 * b->across;
    for (uint32_t t = 0; t < tiles; t++)
        spans[t] = (span){INFINITY, -INFINITY, INFINITY, -INFINITY};
    for (size_t i = 0; i < b->count; i++) {
        const visit *v = &b->visits[i];
        span *to = &spans[v->tile];
        to->least = v->least < to->least ? v->least : to->least;
        to->most = v->least > to->most ? v->least : to->most;
        to->nearest = v->nearest < to->nearest ? v->nearest : to->nearest;
        to->farthest = v->nearest > to->farthest ? v->nearest : to->farthest;
    }
    memset(b->start, 0, ((size_t)tiles * BUCKETS + 1) * sizeof *b->start);
    for (size_t i = 0; i < b->count; i++) {
        visit *v = &b->visits[i];
        const span *of = &spans[v->tile];
        const float wide = of->most - of->least;
        v->bucket = wide > 0 ? (uint8_t)((v->least - of->least) / wide * (BUCKETS - .01f)) : 0;
        b->start[v->tile * BUCKETS + v->bucket + 1]++;
    }
    for (size_t i = 0; i < (size_t)tiles * BUCKETS; i++) b->start[i + 1] += b->start[i];
    b->order = ss_alloc_any(b->count, sizeof *b->order);
    if (!b->order) return false;
    for (size_t i = 0; i < b->count; i++) {
        const visit *v = &b->visits[i];
        b->order[b->start[v->tile * BUCKETS + v->bucket]++] = (uint32_t)i;
    }
    return true; /* start[k] is now where bucket k ends */
}

/* Texels of a tile, the last column and row included. */
static void box_of(const band *b, uint32_t tile, uint32_t box[4]) {
    const int32_t row = b->first_row + (int32_t)(tile / b->across) * TILE;
    const uint32_t column = tile % b->across * TILE, last = b->sketch->resolution - 1;
    box[0] = column, box[1] = (uint32_t)row;
    box[2] = column + TILE - 1 < last ? column + TILE - 1 : last;
    box[3] = (uint32_t)least_of(row + TILE - 1, b->last_row);
}

/* A tile's visits, in order: numbers of `order`. */
static void visits_of(const band *b, uint32_t tile, uint32_t *begin, uint32_t *end) {
    *begin = tile ? b->start[tile * BUCKETS - 1] : 0, *end = b->start[(tile + 1) * BUCKETS - 1];
}

static void draw_runs(const band *b, uint32_t tile, const span *of) {
    const sketch *s = b->sketch;
    uint32_t begin, end, box[4], since = 0;
    float room[2] = {INFINITY, INFINITY};
    visits_of(b, tile, &begin, &end), box_of(b, tile, box);
    for (uint32_t i = begin; i < end; i++) {
        const visit *v = &b->visits[b->order[i]];
        if (since >= LOOK_EACH && v->least > 0)
            s->ink->room(s->ink->keep_ctx, box, of->nearest, room), since = 0;
        if (!(v->least < room[v->kind])) continue;
        const ss_raster_polygon *t = &s->polygons[s->owner[v->part]];
        ss_scan part = s->parts[v->part];
        ss_scan_tile_runs(&part, (const int32_t *)box, t->tag, s->ink->shade, s->ink->ctx);
        since++;
    }
}

/* What a tile has room for, of things not nearer than each of some depths from the nearest to the
 * farthest of its polygons. */
typedef struct rooms {
    float nearest, per, most[ROOMS][2];
} rooms;

static void find_rooms(const band *b, const ss_raster_tile *tile, const span *of, rooms *r) {
    const ss_raster_ink *ink = b->sketch->ink;
    const float step = (of->farthest - of->nearest) / ROOMS;
    r->nearest = of->nearest, r->per = step > 0 ? (1 - 0x1p-16f) / step : 0;
    for (int i = 0; i < ROOMS; i++) {
        const float at = of->nearest + (float)i * step, rounding = 0x1p-21f * fabsf(at);
        ink->tiler->room(ink->tiler_ctx, tile, at - rounding, r->most[i]);
        if (!(step > 0)) return;
    }
}

static inline bool has_room(const rooms *r, const visit *v) {
    const float level = (v->nearest - r->nearest) * r->per;
    return v->least < r->most[level < ROOMS ? (int)level : ROOMS - 1][v->kind];
}

static void draw_tile(const band *b, uint32_t number, const span *of) {
    const sketch *s = b->sketch;
    const ss_raster_tiler *tiler = s->ink->tiler;
    uint32_t begin, end, box[4], since = 0;
    bool looked = false;
    visits_of(b, number, &begin, &end), box_of(b, number, box);
    if (box[1] > box[3]) return; /* below the map's last row */
    ss_raster_tile tile;
    rooms r;
    tile.x = (int32_t)box[0], tile.y = (int32_t)box[1];
    tile.width = (int32_t)(box[2] - box[0]) + 1, tile.height = (int32_t)(box[3] - box[1]) + 1;
    if (begin == end && tiler->blank) {
        tiler->blank(s->ink->tiler_ctx, &tile);
        return;
    }
    tiler->begin(s->ink->tiler_ctx, &tile);
    for (uint32_t i = begin; i < end; i++) {
        const visit *v = &b->visits[b->order[i]];
        if (since >= LOOK_EACH && v->least > 0)
            find_rooms(b, &tile, of, &r), since = 0, looked = true;
        if (looked && !has_room(&r, v)) continue;
        tiler->draw(s->ink->tiler_ctx, &tile, &s->parts[v->part],
                    s->polygons[s->owner[v->part]].tag);
        since++;
    }
    tiler->end(s->ink->tiler_ctx, &tile);
}

static softshadow_status draw_band(band *b, span *spans, uint32_t index) {
    const sketch *s = b->sketch;
    softshadow_status status = SOFTSHADOW_OK;
    b->start = ss_alloc(2 * (size_t)b->across * BUCKETS + 1, sizeof *b->start);
    bool fine = b->start && visit_band(b, index) && sort_visits(b, spans);
    for (uint32_t tile = 0; tile < 2 * b->across && fine; tile++)
        (s->ink->tiler ? draw_tile : draw_runs)(b, tile, &spans[tile]);
    if (!fine) status = ss_fail(SOFTSHADOW_E_MEMORY, "map: out of memory for penumbrae");
    ss_free(b->start), ss_free(b->order), ss_free(b->visits);
    return status;
}

static softshadow_status draw_bands(void *ctx, uint64_t begin, uint64_t end) {
    const sketch *s = ctx;
    const uint32_t across = (s->resolution + TILE - 1) / TILE;
    span *spans = ss_alloc(2 * (size_t)across, sizeof *spans);
    softshadow_status status = SOFTSHADOW_OK;
    if (!spans) status = ss_fail(SOFTSHADOW_E_MEMORY, "map: out of memory for penumbrae");
    for (uint64_t i = begin; i < end && !status; i++) {
        const uint32_t index = s->bins.order[i];
        const int32_t first = (int32_t)index * SS_BAND;
        band b = {.sketch = s, .first_row = first,
                  .last_row = least_of(first + SS_BAND - 1, (int32_t)s->resolution - 1),
                  .across = across};
        status = draw_band(&b, spans, index);
    }
    ss_free(spans);
    return status;
}

/* ---- all ------------------------------------------------------------------------------------ */

static softshadow_status draw_near_first(sketch *s, size_t count, ss_pool *pool) {
    s->first = ss_alloc(count + 1, sizeof *s->first);
    if (!s->first) return SOFTSHADOW_E_MEMORY;
    for (size_t t = 0; t < count; t++) {
        s->first[t + 1] = s->first[t] + parts_of(&s->polygons[t]);
    }
    s->parts = ss_alloc_any(s->first[count], sizeof *s->parts);
    s->owner = ss_alloc_any(s->first[count], sizeof *s->owner);
    if (!s->parts || !s->owner) return SOFTSHADOW_E_MEMORY;
    softshadow_status status = ss_parallel_for(pool, count, 1024, set_up, s);
    if (!status) {
        status = ss_bins_build(&s->bins, s->first[count], s->resolution, part_rows, NULL, s,
                               pool);
    }
    return status ? status : ss_parallel_for(pool, s->bins.bands, 1, draw_bands, s);
}

softshadow_status ss_cpu_keep(const ss_raster_polygon *polygons, size_t count,
                              uint32_t resolution, const ss_raster_ink *ink, ss_pool *pool) {
    sketch s = {.polygons = polygons, .resolution = resolution, .ink = ink};
    softshadow_status status = draw_near_first(&s, count, pool);
    if (status == SOFTSHADOW_E_MEMORY) {
        status = ss_fail(status, "map: out of memory for the penumbrae of %zu polygons", count);
    }
    ss_bins_free(&s.bins);
    ss_free(s.first), ss_free(s.parts), ss_free(s.owner);
    return status;
}
