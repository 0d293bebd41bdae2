/* The limits from a depth image, for foliage and whatever has no silhouette that could be
 * enumerated.
 *
 * based on: [Lawlor06] section 3, which names the way ("expanding a rasterized depth image into a
 * Penumbra Limit Map") and leaves it to a thesis that we do not have; what follows is ours:
 * - An edge is where the depth jumps between neighbouring texels. Texels say where it is to half a
 *   texel only; a line through the same boundary in the rows next to it (least squares) says it
 *   finer, so that the limit is nearly the plane that interpolates well.
 * - Edges are handed on from texel to texel, as a distance transform does [Dan80], but by what they
 *   mean for the texel's receiver rather than by distance: ss_limit_key(). */
#include <math.h>

#include "base/memory.h"
#include "base/status.h"
#include "technique/limit.h"

#define REACH 3 /* rows on both sides that a line is laid through */
#define STEPS 2 /* texels that a boundary may move from row to row: steeper is another edge */
#define NONE  UINT32_MAX

/* A piece of an edge, half a texel to both sides of (x, y) along it. */
typedef struct piece {
    float x, y, normal[2], half, c, open;
    float tangent[2]; /* of the line of sight, 0 where penumbrae are round: see ss_rim */
} piece;

typedef struct pieces {
    piece *list;
    size_t count, room;
} pieces;

typedef struct spreading {
    ss_limit_face *face;
    const float *bare; /* depths as they are: no bias moves an edge's */
    pieces edges;
    uint32_t *best; /* a texel: the piece it goes by */
    bool round;     /* the lamp is a sphere, seen in perspective */
} spreading;

/* ---- edges ---------------------------------------------------------------------------------- */

/* A boundary between the texel (x, y) and its neighbour in direction (dx, dy), which is deeper. */
typedef struct boundary {
    int32_t x, y, dx, dy;
    float between; /* depths: less is this side */
} boundary;

static float bare_at(const spreading *s, int32_t x, int32_t y) {
    const int32_t side = (int32_t)s->face->side;
    if (x < 0 || y < 0 || x >= side || y >= side) return SS_MAP_FAR;
    return s->bare[(size_t)y * s->face->side + (size_t)x];
}

/* Is the texel `out` steps outwards in the row `row` on the near side? */
static bool within(const spreading *s, const boundary *b, int32_t row, int32_t out) {
    return bare_at(s, b->x + out * b->dx - row * b->dy, b->y + out * b->dy + row * b->dx) <
           b->between;
}

/* The last texel within, in a row next to one where that is known. false: the edge ends there. */
static bool follow(const spreading *s, const boundary *b, int32_t row, int32_t *out) {
    int32_t at = *out;
    for (int step = 0; step < STEPS && !within(s, b, row, at); step++) at--;
    if (!within(s, b, row, at)) return false;
    for (int step = 0; at >= *out && step < STEPS && within(s, b, row, at + 1); step++) at++;
    if (within(s, b, row, at + 1)) return false;
    *out = at;
    return true;
}

/* A line through the boundary: out = where + slope row, from the texel's centre. */
static void lay_line(const spreading *s, const boundary *b, double *where, double *slope) {
    double n = 1, rows = 0, outs = 0, squares = 0, products = 0;
    for (int32_t to = -1; to <= 1; to += 2) {
        int32_t out = 0;
        for (int32_t row = to; row * to <= REACH && follow(s, b, row, &out); row += to) {
            n += 1, rows += row, outs += out, squares += row * row, products += row * out;
        }
    }
    const double det = n * squares - rows * rows;
    *slope = det > 0 ? (n * products - rows * outs) / det : 0;
    *where = (outs - *slope * rows) / n + 0.5;
}

/* How far the surface in a texel may sink to the next: what its slope bias follows, 1.5 texels. */
static float sinks(const spreading *s, int32_t x, int32_t y) {
    const float bare = bare_at(s, x, y);
    if (!(bare < SS_MAP_FAR)) return 0;
    return s->face->depth[(size_t)y * s->face->side + (size_t)x] - bare;
}

/* May two neighbours that differ by so much be one surface? */
static bool one_surface(const spreading *s, float step, float sink, float other_sink) {
    return step <= s->face->near + (sink + other_sink) / 2;
}

/* The surface's depth at the edge, on from the last texels. Where it bends away from the light,
 * depth goes on as on a ball, whose distance from its last depth is as the root of that from the
 * edge; else straight. */
static float depth_at_edge(const spreading *s, const boundary *b, double where) {
    const int32_t x = b->x - b->dx, y = b->y - b->dy;
    const float here = bare_at(s, b->x, b->y), before = bare_at(s, x, y);
    const float rise = here - before, rose = before - bare_at(s, x - b->dx, y - b->dy);
    const double left = fmin(fmax(where, 0.1), 1);
    if (!one_surface(s, fabsf(rise), sinks(s, b->x, b->y), sinks(s, x, y))) return here;
    const bool bends = rose > 0 && rise > 1.2f * rose;
    return here + rise * (float)(bends ? 1 / (sqrt((left + 1) / left) - 1) : left);
}

static piece *next(pieces *list) {
    if (list->count == list->room) {
        const size_t wanted = list->room ? 2 * list->room : 1024;
        piece *grown = ss_grow(list->list, list->count, wanted, sizeof *grown);
        if (!grown) return NULL;
        list->list = grown, list->room = wanted;
    }
    return &list->list[list->count++];
}

static bool add_piece(spreading *s, const boundary *b) {
    const ss_limit_face *f = s->face;
    double where, slope;
    lay_line(s, b, &where, &slope);
    if (fabs(slope) > 1.01) return true; /* its other neighbours see this edge better */
    piece *p = next(&s->edges);
    if (!p) return false;
    const double long_way = hypot(1, slope);
    const double out[2] = {(b->dx + slope * b->dy) / long_way, (b->dy - slope * b->dx) / long_way};
    const double x = b->x + .5 + where * b->dx, y = b->y + .5 + where * b->dy;
    *p = (piece){.x = (float)x, .y = (float)y, .normal = {(float)out[0], (float)out[1]},
                 .half = (float)long_way / 2, .c = depth_at_edge(s, b, where)};
    p->open = ss_rim_open(f->depth, f->side, (float[2]){p->x, p->y}, p->normal);
    for (int k = 0; k < 2 && s->round; k++) {
        const double at = f->frame->low[k] + (k ? y : x) * f->frame->texel;
        p->tangent[k] = (float)(at * f->frame->inverse);
    }
    return true;
}

/* All four neighbours of one texel. */
static bool add_pieces(spreading *s, int32_t x, int32_t y) {
    static const int8_t to[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    const float here = bare_at(s, x, y), far = (float)s->face->frame->far_h;
    if (!(here < far)) return true;
    const float sink = sinks(s, x, y);
    for (int i = 0; i < 4; i++) {
        const int32_t u = x + to[i][0], v = y + to[i][1];
        const float there = fminf(bare_at(s, u, v), far);
        if (one_surface(s, there - here, sink, sinks(s, u, v))) continue;
        const boundary b = {x, y, to[i][0], to[i][1], (here + there) / 2};
        if (!add_piece(s, &b)) return false;
    }
    return true;
}

/* ---- spreading ------------------------------------------------------------------------------ */

/* q of a texel that goes by a piece: the distance from it in light cones, > 0 outside. */
static float limit_of(const spreading *s, const piece *p, uint32_t x, uint32_t y) {
    const float dx = (float)x + .5f - p->x, dy = (float)y + .5f - p->y;
    const float off = dx * p->normal[0] + dy * p->normal[1];
    const float along = fabsf(dy * p->normal[0] - dx * p->normal[1]) - p->half;
    const float past = along > 0 ? along : 0;
    const float distance = sqrtf(off * off + past * past);
    bool outside = off > 0;
    if (along > 1) { /* beyond its end; closer by, centres may lie on the wrong side of a line */
        outside = !(s->bare[(size_t)y * s->face->side + x] < p->c + s->face->near);
    }
    float wide = 1;
    if (s->round && distance > 0) {
        const float lean = (dx * p->tangent[0] + dy * p->tangent[1]);
        wide = sqrtf(1 + lean * lean / (dx * dx + dy * dy));
    }
    return (outside ? distance : -distance) / wide * s->face->per_texel;
}

/* No receiver sees a penumbra so far away. */
static bool beyond(const spreading *s, float c, float q) {
    return fabsf(q) > (float)s->face->frame->far_h - c + SS_LIMIT_RAISE * s->face->per_texel;
}

static void try_piece(spreading *s, uint32_t number, uint32_t x, uint32_t y) {
    const size_t at = (size_t)y * s->face->side + x;
    if (number == NONE || number == s->best[at]) return;
    const piece *p = &s->edges.list[number];
    const float q = limit_of(s, p, x, y);
    if (beyond(s, p->c, q)) return;
    const float key = ss_limit_key(s->face, at, p->c, q, p->open);
    if (!(key < s->face->key[at])) return;
    s->face->key[at] = key, s->best[at] = number;
}

/* The texels around it know it at first. */
static void sow(spreading *s, uint32_t number) {
    const piece *p = &s->edges.list[number];
    const int32_t side = (int32_t)s->face->side, x = (int32_t)p->x, y = (int32_t)p->y;
    for (int32_t v = y - 1; v <= y + 1; v++) {
        for (int32_t u = x - 1; u <= x + 1; u++) {
            if (u < 0 || v < 0 || u >= side || v >= side) continue;
            try_piece(s, number, (uint32_t)u, (uint32_t)v);
        }
    }
}

/* Takes on what the four neighbours know that this sweep has been at already. */
static void ask_neighbours(spreading *s, uint32_t x, uint32_t y, bool back) {
    const uint32_t side = s->face->side, last = side - 1;
    const size_t at = (size_t)y * side + x;
    const uint32_t *best = s->best;
    if (!back) {
        if (x > 0) try_piece(s, best[at - 1], x, y);
        if (y > 0 && x > 0) try_piece(s, best[at - side - 1], x, y);
        if (y > 0) try_piece(s, best[at - side], x, y);
        if (y > 0 && x < last) try_piece(s, best[at - side + 1], x, y);
    } else {
        if (x < last) try_piece(s, best[at + 1], x, y);
        if (y < last && x < last) try_piece(s, best[at + side + 1], x, y);
        if (y < last) try_piece(s, best[at + side], x, y);
        if (y < last && x > 0) try_piece(s, best[at + side - 1], x, y);
    }
}

/* Rows up, each to the right and back; then rows down: after that all have met their nearest but
 * for a few that lie behind two others. */
static void sweep(spreading *s) {
    const uint32_t side = s->face->side;
    for (int down = 0; down < 2; down++) {
        for (uint32_t row = 0; row < side; row++) {
            const uint32_t y = down ? side - 1 - row : row;
            for (uint32_t i = 0; i < side; i++) ask_neighbours(s, down ? side - 1 - i : i, y, down);
            for (uint32_t i = 0; i < side; i++) {
                const uint32_t x = down ? i : side - 1 - i;
                const size_t at = (size_t)y * side + x;
                if (down && x > 0) try_piece(s, s->best[at - 1], x, y);
                if (!down && x < side - 1) try_piece(s, s->best[at + 1], x, y);
            }
        }
    }
}

static void settle(const spreading *s) {
    ss_limit_face *f = s->face;
    for (uint32_t y = 0; y < f->side; y++) {
        for (uint32_t x = 0; x < f->side; x++) {
            const size_t at = (size_t)y * f->side + x;
            if (s->best[at] == NONE) continue;
            const piece *p = &s->edges.list[s->best[at]];
            float *texel = f->texels + at * LIMIT_CHANNELS;
            texel[LIMIT_C] = p->c, texel[LIMIT_Q] = limit_of(s, p, x, y);
            texel[LIMIT_B] = p->open;
        }
    }
}

/* ---- the whole ------------------------------------------------------------------------------ */

static softshadow_status draw_bare(const ss_stage *stage, const ss_limit_face *face, float *plane) {
    const ss_raster_casters casters = {.world = stage->world, .frame = face->frame,
                                       .resolution = face->side, .deepest = face->frame->far_h};
    return stage->raster->depth(&casters, &plane, 1, stage->pool);
}

static bool find_edges(spreading *s) {
    const int32_t side = (int32_t)s->face->side;
    for (int32_t y = 0; y < side; y++)
        for (int32_t x = 0; x < side; x++)
            if (!add_pieces(s, x, y)) return false;
    return true;
}

softshadow_status ss_limit_propagate(const ss_stage *stage, ss_limit_face *face) {
    const size_t n = (size_t)face->side * face->side;
    float *bare = ss_alloc(n, sizeof *bare);
    spreading s = {.face = face, .bare = bare, .best = ss_alloc(n, sizeof *s.best),
                   .round = stage->light->type == SOFTSHADOW_SPHERE && face->frame->inverse > 0};
    softshadow_status status = SOFTSHADOW_OK;
    if (!bare || !s.best) status = ss_fail(SOFTSHADOW_E_MEMORY, "build.resolution: out of memory");
    if (!status) status = draw_bare(stage, face, bare);
    if (!status && !find_edges(&s)) {
        status = ss_fail(SOFTSHADOW_E_MEMORY, "build.propagate: out of memory for %zu edges",
                         s.edges.count);
    }
    if (!status) {
        for (size_t i = 0; i < n; i++) s.best[i] = NONE;
        for (uint32_t i = 0; i < s.edges.count; i++) sow(&s, i);
        sweep(&s);
        settle(&s);
    }
    ss_free(bare), ss_free(s.best), ss_free(s.edges.list);
    return status;
}
