/* Ear clipping.
 * based on: Meisters 1975, "Polygons have ears"; Held 2001, "FIST: fast industrial-strength
 * triangulation of polygons", for the order of resorts when a polygon is none.
 *
 * The polygon is projected along the axis nearest to its Newell normal: coordinates stay the file's
 * and no rounding moves a corner. Every triangle made by clipping corners is bounded by sides and
 * diagonals of the outline, so the signed areas add up to the polygon's, and, for an outline that
 * does not cross itself, the triangles tile it if and only if none of them is turned over. That is
 * what CLEAN certifies; the search for ears only has to get there.
 *
 * Time: a corner is looked at when it enters a queue, at most four times per corner, and only
 * concave corners can lie inside an ear: corners x concave corners. */
#include "mesh/polygon.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { GONE = 1, CONCAVE = 2 };

typedef struct outline {
    double (*p)[2];
    uint32_t *next, *prev, *queue, *concave;
    uint32_t *place; /* of a concave corner in `concave` */
    uint8_t *state;
    uint32_t concave_count, head, tail;
} outline;

bool cli_polygon_reserve(cli_polygon *polygon, uint32_t count) {
    if (count <= polygon->room) return true;
    cli_polygon_free(polygon);
    size_t n = count;
    polygon->points = malloc(n * sizeof *polygon->points);
    polygon->triangles = malloc(n * 3 * sizeof *polygon->triangles);
    /* p, next, prev, concave, place, queue of 5 n, state */
    polygon->work = malloc(n * (2 * sizeof(double) + 9 * sizeof(uint32_t) + 1));
    if (!polygon->points || !polygon->triangles || !polygon->work) {
        cli_polygon_free(polygon);
        return false;
    }
    polygon->room = count;
    return true;
}

void cli_polygon_free(cli_polygon *polygon) {
    free(polygon->points);
    free(polygon->triangles);
    free(polygon->work);
    *polygon = (cli_polygon){.room = 0};
}

/* Twice the signed area of a, b, c; its sign is exact where the differences are, as they are for
 * floats of like size. The plain value suffices beyond its rounding error, 3 * 2^-53 of the terms;
 * below that a b - c d is formed with its products' low halves (Kahan). */
static double turn(const double a[2], const double b[2], const double c[2]) {
    double ux = b[0] - a[0], uy = b[1] - a[1], vx = c[0] - a[0], vy = c[1] - a[1];
    double left = ux * vy, right = uy * vx, area = left - right;
    if (fabs(area) > 2 * DBL_EPSILON * (fabs(left) + fabs(right))) return area;
    return fma(ux, vy, -right) + fma(-uy, vx, right);
}

/* Projects the corners so that the polygon runs counterclockwise; false if it has no area. */
static bool project(const double (*points)[3], uint32_t count, double (*p)[2]) {
    double normal[3] = {0, 0, 0};
    const double *o = points[0];
    for (uint32_t i = 1; i + 1 < count; i++)
        for (int k = 0; k < 3; k++) {
            int x = (k + 1) % 3, y = (k + 2) % 3;
            const double *a = points[i], *b = points[i + 1];
            normal[k] += (a[x] - o[x]) * (b[y] - o[y]) - (a[y] - o[y]) * (b[x] - o[x]);
        }
    int axis = 0;
    for (int k = 1; k < 3; k++)
        if (fabs(normal[k]) > fabs(normal[axis])) axis = k;
    int x = (axis + 1) % 3, y = (axis + 2) % 3;
    if (normal[axis] < 0) {
        int swap = x;
        x = y;
        y = swap;
    }
    for (uint32_t i = 0; i < count; i++) {
        p[i][0] = points[i][x];
        p[i][1] = points[i][y];
    }
    return normal[axis] != 0;
}

static void emit(cli_polygon *polygon, uint32_t *made, uint32_t a, uint32_t b, uint32_t c) {
    uint32_t *t = polygon->triangles + 3 * (size_t) (*made)++;
    t[0] = a;
    t[1] = b;
    t[2] = c;
}

static void fan(cli_polygon *polygon, uint32_t count) {
    uint32_t made = 0;
    for (uint32_t i = 1; i + 1 < count; i++) emit(polygon, &made, 0, i, i + 1);
}

static double corner_turn(const outline *o, uint32_t i) {
    return turn(o->p[o->prev[i]], o->p[i], o->p[o->next[i]]);
}

static void set_concave(outline *o, uint32_t i, bool concave) {
    if (concave == ((o->state[i] & CONCAVE) != 0)) return;
    o->state[i] ^= CONCAVE;
    if (concave) {
        o->place[i] = o->concave_count;
        o->concave[o->concave_count++] = i;
    } else {
        uint32_t last = o->concave[--o->concave_count];
        o->concave[o->place[i]] = last;
        o->place[last] = o->place[i];
    }
}

static bool same(const double a[2], const double b[2]) { return a[0] == b[0] && a[1] == b[1]; }

/* Does the diagonal from i towards q start inside the outline? */
static bool starts_inside(const outline *o, uint32_t i, const double q[2]) {
    const double *a = o->p[o->prev[i]], *b = o->p[i], *c = o->p[o->next[i]];
    bool right_of_prev = turn(a, b, q) >= 0, left_of_next = turn(b, c, q) >= 0;
    return turn(a, b, c) > 0 ? right_of_prev && left_of_next : right_of_prev || left_of_next;
}

/* Corner i is an ear when no concave corner lies in its triangle: on its rim either, unless
 * `touching` is allowed, which leaves degenerate triangles for later. Corners in the place of the
 * ear's own (a hole's bridge has such) do not count: starts_inside() sees their side. */
static bool is_ear(const outline *o, uint32_t i, bool touching) {
    if (o->state[i] & CONCAVE) return false;
    const double *a = o->p[o->prev[i]], *b = o->p[i], *c = o->p[o->next[i]];
    if (!touching && (!starts_inside(o, o->prev[i], c) || !starts_inside(o, o->next[i], a)))
        return false;
    double low[2], high[2];
    for (int k = 0; k < 2; k++) {
        low[k] = fmin(fmin(a[k], b[k]), c[k]);
        high[k] = fmax(fmax(a[k], b[k]), c[k]);
    }
    for (uint32_t k = 0; k < o->concave_count; k++) {
        const double *q = o->p[o->concave[k]];
        if (q[0] < low[0] || q[0] > high[0] || q[1] < low[1] || q[1] > high[1]) continue;
        if (same(q, a) || same(q, b) || same(q, c)) continue;
        double s = turn(a, b, q), t = turn(b, c, q), u = turn(c, a, q);
        if (touching ? s > 0 && t > 0 && u > 0 : s >= 0 && t >= 0 && u >= 0) return false;
    }
    return true;
}

static void outline_begin(outline *o, cli_polygon *polygon, uint32_t count) {
    size_t n = count;
    o->p = polygon->work;
    o->next = (uint32_t *) (o->p + n);
    o->prev = o->next + n;
    o->concave = o->prev + n;
    o->place = o->concave + n;
    o->queue = o->place + n;
    o->state = (uint8_t *) (o->queue + 5 * n);
    memset(o->state, 0, n);
    o->concave_count = o->head = o->tail = 0;
    for (uint32_t i = 0; i < count; i++) {
        o->next[i] = i + 1 < count ? i + 1 : 0;
        o->prev[i] = i ? i - 1 : count - 1;
    }
}

static void clip(outline *o, uint32_t i) {
    uint32_t a = o->prev[i], c = o->next[i];
    o->next[a] = c;
    o->prev[c] = a;
    set_concave(o, i, false);
    o->state[i] |= GONE;
    set_concave(o, a, corner_turn(o, a) <= 0);
    set_concave(o, c, corner_turn(o, c) <= 0);
    o->queue[o->tail++] = a;
    o->queue[o->tail++] = c;
}

/* Clips what the queue offers until `left` is 3 or the queue is empty; returns what is left. */
static uint32_t clip_queue(outline *o, cli_polygon *polygon, uint32_t *made, uint32_t left,
                           bool touching) {
    while (left > 3 && o->head < o->tail) {
        uint32_t i = o->queue[o->head++];
        if ((o->state[i] & GONE) || !is_ear(o, i, touching)) continue;
        emit(polygon, made, o->prev[i], i, o->next[i]);
        clip(o, i);
        left--;
    }
    return left;
}

/* True when no triangle is turned over. */
static bool none_turned(const outline *o, const cli_polygon *polygon, uint32_t count) {
    for (size_t t = 0; t + 2 < count; t++) {
        const uint32_t *v = polygon->triangles + 3 * t;
        if (turn(o->p[v[0]], o->p[v[1]], o->p[v[2]]) < 0) return false;
    }
    return true;
}

static cli_tiling tile_ears(outline *o, cli_polygon *polygon, uint32_t count) {
    uint32_t made = 0, left = count, start = 0;
    for (uint32_t i = 0; i < count; i++) o->queue[o->tail++] = i;
    left = clip_queue(o, polygon, &made, left, false);
    if (left > 3) { /* sides touch corners, or cross: one more round that minds less */
        o->head = o->tail = 0;
        for (uint32_t i = 0; i < count; i++)
            if (!(o->state[i] & GONE)) o->queue[o->tail++] = i;
        left = clip_queue(o, polygon, &made, left, true);
    }
    while (o->state[start] & GONE) start++;
    for (uint32_t i = o->next[start]; left > 2; left--, i = o->next[i])
        emit(polygon, &made, start, i, o->next[i]);
    return none_turned(o, polygon, count) ? CLI_TILING_CLEAN : CLI_TILING_UNCLEAN;
}

/* A quad has two diagonals; the file's own, 0-2, unless only the other one tiles it. */
static cli_tiling tile_quad(const outline *o, cli_polygon *polygon) {
    double t[4];
    for (uint32_t i = 0; i < 4; i++) t[i] = corner_turn(o, i);
    double first = fmin(t[1], t[3]), second = fmin(t[0], t[2]);
    uint32_t made = 0;
    if (first <= 0 && second > first) {
        emit(polygon, &made, 0, 1, 3);
        emit(polygon, &made, 1, 2, 3);
        return second >= 0 ? CLI_TILING_CLEAN : CLI_TILING_UNCLEAN;
    }
    fan(polygon, 4);
    return first >= 0 ? CLI_TILING_CLEAN : CLI_TILING_UNCLEAN;
}

cli_tiling cli_polygon_tile(cli_polygon *polygon, uint32_t count) {
    outline o;
    outline_begin(&o, polygon, count);
    polygon->effort = 0;
    if (!project((const double(*)[3]) polygon->points, count, o.p)) {
        fan(polygon, count);
        return CLI_TILING_UNCLEAN;
    }
    if (count == 4) return tile_quad(&o, polygon);
    for (uint32_t i = 0; i < count; i++) set_concave(&o, i, corner_turn(&o, i) <= 0);
    if (o.concave_count == 0) {
        fan(polygon, count);
        /* Turning left everywhere but more than once around, like a pentagram: not a tiling. */
        return none_turned(&o, polygon, count) ? CLI_TILING_CLEAN : CLI_TILING_UNCLEAN;
    }
    polygon->effort = (uint64_t) count * o.concave_count;
    if (polygon->effort > CLI_POLYGON_WORK) return CLI_TILING_TOO_LARGE;
    return tile_ears(&o, polygon, count);
}
