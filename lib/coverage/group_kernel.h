/* The kernel of group.h, compiled once for every instruction set: include lanes_*.h and define
 * GROUP_KERNEL first. Static inline C throughout, so that no copy of a function built for one set can
 * take the place of another's at link time.
 *
 * Drawing: a caster seen from one point is a polygon in grid coordinates. Each of its edges covers, in
 * the rows it crosses, the columns to its right; the exclusive or over the edges is the polygon. Two
 * faces that share an edge compute it from the same two projected vertices, lower one first, so they
 * agree about it bit for bit: no crack, no overlap. */
#include <string.h>

#include "coverage/group.h"
#include "trace/bvh_node.h"

#define MOST_EDGES 5 /* of a triangle clipped by two planes */
#define FAR 256      /* cells: an end farther away than that is not computed with */

/* Row or lane numbers and constants of one walk. */
typedef struct walk {
    ss_group *g;
    uint32_t blocks, words;
    uint32_t open; /* lanes that still see some of the light */
    float rows, columns;
    _Alignas(64) float row[SS_BLOCK * 20]; /* y of every row; more rows than that: row_at() */
} walk;

typedef struct place {
    vf x, y, t; /* homogeneous */
} place;

/* One edge from sixteen points. Rows low <= y < high are crossed, at x + (y - pivot) slope. */
typedef struct edge {
    _Alignas(64) float slope[SS_LANES], x[SS_LANES], pivot[SS_LANES], low[SS_LANES], high[SS_LANES];
} edge;

typedef struct polygon {
    edge edges[MOST_EDGES];
    int count;
    vf x_low, x_high, y_low, y_high;
} polygon;

/* Good to the last bit or two, whatever the instruction set: two steps of third order. */
static inline vf reciprocal(vf a) {
    vf r = f_magic(a);
    for (int step = 0; step < 2; step++) {
        const vf e = f_fnma(a, r, f_set(1));
        r = f_fma(r, f_fma(e, e, e), r);
    }
    return r;
}

static inline vf transform_row(const ss_group *g, int row, const float x[3]) {
    const vf inner = f_fma(f_load(g->matrix[row][2]), f_set(x[2]), f_load(g->shift[row]));
    return f_fma(f_load(g->matrix[row][0]), f_set(x[0]),
                 f_fma(f_load(g->matrix[row][1]), f_set(x[1]), inner));
}

static inline place transform(const ss_group *g, const float x[3]) {
    return (place){transform_row(g, 0, x), transform_row(g, 1, x), transform_row(g, 2, x)};
}

static inline vf row_at(const walk *w, uint32_t row_block) {
    if (row_block < 20) return f_load(w->row + SS_BLOCK * row_block);
    return f_add(f_load(w->row), f_set((float)(SS_BLOCK * row_block)));
}

/* ---- edges -------------------------------------------------------------------------------------*/

/* From pixel a to pixel b; which way round does not matter. */
static inline void set_edge(edge *e, vf ax, vf ay, vf bx, vf by) {
    const vm up = f_lt(ay, by);
    const vf low = f_blend(up, by, ay), high = f_blend(up, ay, by);
    const vf x = f_blend(up, bx, ax), far = f_blend(up, ax, bx);
    f_store(e->slope, f_mul(f_sub(far, x), reciprocal(f_sub(high, low))));
    f_store(e->x, x);
    f_store(e->pivot, low);
    f_store(e->low, low);
    f_store(e->high, high);
}

/* An end far away, where it is nearly level with the point, has lost its digits: there the line is taken
 * from the homogeneous ends, n = a x b, and hung up in the middle of the grid. */
static inline void set_far_edge(edge *e, vm where, const place *a, const place *b, float middle) {
    const vf n0 = f_sub(f_mul(a->y, b->t), f_mul(b->y, a->t));
    const vf n1 = f_sub(f_mul(b->x, a->t), f_mul(a->x, b->t));
    const vf n2 = f_sub(f_mul(a->x, b->y), f_mul(b->x, a->y));
    const vf y = f_set(middle), scale = reciprocal(f_sub(f_set(0), n0));
    f_store(e->slope, f_blend(where, f_load(e->slope), f_mul(n1, scale)));
    f_store(e->x, f_blend(where, f_load(e->x), f_mul(f_fma(n1, y, n2), scale)));
    f_store(e->pivot, f_blend(where, f_load(e->pivot), y));
}

static inline void add_edge(const walk *w, polygon *p, const place *a, const place *b) {
    const vf ra = reciprocal(a->t), rb = reciprocal(b->t);
    const vf ax = f_mul(a->x, ra), ay = f_mul(a->y, ra), bx = f_mul(b->x, rb), by = f_mul(b->y, rb);
    edge *e = &p->edges[p->count++];
    set_edge(e, ax, ay, bx, by);
    const vf x_low = f_min(ax, bx), x_high = f_max(ax, bx);
    const vf y_low = f_min(ay, by), y_high = f_max(ay, by);
    p->x_low = f_min(p->x_low, x_low), p->x_high = f_max(p->x_high, x_high);
    p->y_low = f_min(p->y_low, y_low), p->y_high = f_max(p->y_high, y_high);
    const vf reach = f_max(f_max(x_high, y_high), f_sub(f_set(0), f_min(x_low, y_low)));
    const vm far = f_lt(f_set(FAR), reach);
    if (m_bits(far)) set_far_edge(e, far, a, b, w->rows / 2);
}

static inline vi edge_block(const edge *e, unsigned lane, vf y, uint32_t word) {
    const vf low = f_set(e->low[lane]);
    const vm rows = m_and(f_le(low, y), f_lt(y, f_set(e->high[lane])));
    vf u = f_fma(f_sub(y, f_set(e->pivot[lane])), f_set(e->slope[lane]), f_set(e->x[lane]));
    if (word) u = f_sub(u, f_set((float)(32 * word)));
    return i_columns_from(u, rows);
}

/* ---- clipping ----------------------------------------------------------------------------------*/

typedef struct segment {
    place a, b;
} segment;

static inline place blend(vm m, const place *a, const place *b) {
    return (place){f_blend(m, a->x, b->x), f_blend(m, a->y, b->y), f_blend(m, a->t, b->t)};
}

/* Where the segment meets the plane; always reckoned from its inner end, so that the two faces at an
 * edge find the same place. */
static inline place meet(const place *in, const place *out, vf plane) {
    const vf s = f_mul(f_sub(plane, in->t), reciprocal(f_sub(out->t, in->t)));
    return (place){f_fma(f_sub(out->x, in->x), s, in->x), f_fma(f_sub(out->y, in->y), s, in->y),
                   plane};
}

/* Keeps what is beyond the plane (far: before it) and closes the gap with one more segment. */
static inline int clip(segment *s, int count, vf plane, int far) {
    const place none = {f_set(0), f_set(0), f_set(1)};
    place leave = none, enter = none;
    for (int i = 0; i < count; i++) {
        const vm a_in = far ? f_le(s[i].a.t, plane) : f_le(plane, s[i].a.t);
        const vm b_in = far ? f_le(s[i].b.t, plane) : f_le(plane, s[i].b.t);
        const vm crossed = m_xor(a_in, b_in);
        if (m_bits(crossed)) {
            const place in = blend(a_in, &s[i].b, &s[i].a), out = blend(a_in, &s[i].a, &s[i].b);
            const place cut = meet(&in, &out, plane);
            leave = blend(m_and(crossed, a_in), &leave, &cut);
            enter = blend(m_and(crossed, b_in), &enter, &cut);
            s[i].a = blend(m_andnot(crossed, a_in), &s[i].a, &cut);
            s[i].b = blend(m_andnot(crossed, b_in), &s[i].b, &cut);
        }
        const vm any = m_or(a_in, b_in);
        s[i].a = blend(any, &none, &s[i].a);
        s[i].b = blend(any, &none, &s[i].b);
    }
    s[count].a = leave, s[count].b = enter;
    return count + 1;
}

/* Bounds for the lanes where everything was cut away are those of `none`: outside the grid. */
static inline void clipped_polygon(const walk *w, const place v[3], polygon *p) {
    segment s[MOST_EDGES] = {{v[0], v[1]}, {v[1], v[2]}, {v[2], v[0]}};
    int count = clip(s, 3, f_load(w->g->t_near), 0);
    count = clip(s, count, f_load(w->g->t_far), 1);
    for (int i = 0; i < count; i++) add_edge(w, p, &s[i].a, &s[i].b);
}

/* ---- one triangle ------------------------------------------------------------------------------*/

/* Lanes in which the polygon can cover a sample. The margins are for rounding in x at a row. */
static inline uint32_t touched(const walk *w, const polygon *p) {
    const vf first = f_max(f_ceil(p->y_low), f_set(1));
    const vf end = f_min(f_ceil(p->y_high), f_set(w->rows + 1));
    const vm rows = f_lt(first, end);
    const vm columns = m_and(f_lt(p->x_low, f_set(w->columns + 0.25f)), f_lt(f_set(0.75f), p->x_high));
    return m_bits(m_and(rows, columns));
}

static inline void draw(const walk *w, const polygon *p, uint32_t lanes) {
    for (; lanes; lanes &= lanes - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(lanes);
        uint32_t *mask = ss_group_mask(w->g, lane);
        for (uint32_t b = 0; b < w->blocks; b++) {
            const vf y = row_at(w, b / w->words);
            const uint32_t word = b % w->words;
            vi cover = edge_block(&p->edges[0], lane, y, word);
            for (int i = 1; i + 1 < p->count; i += 2) {
                cover = i_xor3(cover, edge_block(&p->edges[i], lane, y, word),
                               edge_block(&p->edges[i + 1], lane, y, word));
            }
            i_store(mask + SS_BLOCK * b, i_or(i_load(mask + SS_BLOCK * b), cover));
        }
    }
}

static uint32_t seen_by(const ss_group *g, uint32_t triangle, uint32_t lanes) {
    for (uint32_t i = 0; i < g->skip_count; i++) {
        if (g->skip[i] == triangle) lanes &= ~(uint32_t)g->skip_lanes[i];
    }
    return lanes;
}

static void list(ss_group *g, uint32_t triangle) {
    if (g->listed_count < g->listed_room) g->listed[g->listed_count] = triangle;
    g->listed_count++;
}

static inline void triangle(const walk *w, const ss_bvh_leaf *leaf, unsigned slot) {
    ss_group *g = w->g;
    const uint32_t lanes = seen_by(g, leaf->triangle[slot], w->open);
    if (!lanes) return;
    place v[3];
    for (int c = 0; c < 3; c++) {
        float x[3];
        for (int k = 0; k < 3; k++) x[k] = leaf->corner[c][g->axis[k]][slot];
        v[c] = transform(g, x);
    }
    const vf least = f_min(v[0].t, f_min(v[1].t, v[2].t)), most = f_max(v[0].t, f_max(v[1].t, v[2].t));
    const vf near = f_load(g->t_near), far = f_load(g->t_far);
    const uint32_t between = m_bits(m_and(f_le(near, most), f_le(least, far))) & lanes;
    if (!between) return;
    if (g->tested && g->tested[leaf->triangle[slot]]) {
        list(g, leaf->triangle[slot]);
        return;
    }
    polygon p = {.count = 0, .x_low = f_set(1e30f), .x_high = f_set(-1e30f), .y_low = f_set(1e30f),
                 .y_high = f_set(-1e30f)};
    if ((m_bits(m_and(f_le(near, least), f_le(most, far))) & between) == between) {
        for (int c = 0; c < 3; c++) add_edge(w, &p, &v[c], &v[(c + 1) % 3]);
    } else {
        clipped_polygon(w, v, &p);
    }
    draw(w, &p, touched(w, &p) & between);
}

/* ---- the walk ----------------------------------------------------------------------------------*/

static inline vf load_child(const float *p) { return f_load(p); }

/* Children that are inside the shaft, or might be. */
static inline uint32_t children(const ss_group *g, const ss_bvh_node *node) {
    const ss_shaft *shaft = &g->shaft;
    vm in = m_from((1u << node->count) - 1);
    for (int k = 0; k < 3; k++) {
        in = m_and(in, f_le(load_child(node->low[k]), f_set(shaft->high[k])));
        in = m_and(in, f_le(f_set(shaft->low[k]), load_child(node->high[k])));
    }
    for (unsigned p = 0; p < shaft->planes; p++) {
        const float *n = shaft->normal[p];
        const vf x = load_child(n[0] > 0 ? node->low[0] : node->high[0]),
                 y = load_child(n[1] > 0 ? node->low[1] : node->high[1]),
                 z = load_child(n[2] > 0 ? node->low[2] : node->high[2]);
        const vf height = f_fma(x, f_set(n[0]), f_fma(y, f_set(n[1]), f_mul(z, f_set(n[2]))));
        in = m_and(in, f_le(height, f_set(shaft->limit[p])));
    }
    return m_bits(in);
}

static inline vf corner(const ss_bvh_leaf *leaf, int c, int k) { return f_load(leaf->corner[c][k]); }

static inline uint32_t triangles(const ss_group *g, const ss_bvh_leaf *leaf) {
    const ss_shaft *shaft = &g->shaft;
    vm in = m_from((1u << leaf->count) - 1);
    for (int k = 0; k < 3; k++) {
        const vf a = corner(leaf, 0, k), b = corner(leaf, 1, k), c = corner(leaf, 2, k);
        in = m_and(in, f_le(f_min(a, f_min(b, c)), f_set(shaft->high[k])));
        in = m_and(in, f_le(f_set(shaft->low[k]), f_max(a, f_max(b, c))));
    }
    for (unsigned p = 0; p < shaft->planes; p++) {
        const vf x = f_set(shaft->normal[p][0]), y = f_set(shaft->normal[p][1]),
                 z = f_set(shaft->normal[p][2]);
        vf least = f_set(0);
        for (int c = 0; c < 3; c++) {
            const vf height = f_fma(corner(leaf, c, 0), x,
                                    f_fma(corner(leaf, c, 1), y, f_mul(corner(leaf, c, 2), z)));
            least = c ? f_min(least, height) : height;
        }
        in = m_and(in, f_le(least, f_set(shaft->limit[p])));
    }
    return m_bits(in);
}

/* Closes lanes that see nothing of the light any more. */
static inline void close_lanes(walk *w) {
    for (uint32_t m = w->open; m; m &= m - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(m);
        const uint32_t *mask = ss_group_mask(w->g, lane);
        uint32_t full = 1;
        for (uint32_t b = 0; b < w->blocks && full; b++) full = (uint32_t)i_all_ones(i_load(mask + SS_BLOCK * b));
        if (full) w->open &= ~(1u << lane);
    }
}

static inline void run(ss_group *g, uint32_t blocks, uint32_t words) {
    walk w = {.g = g, .blocks = blocks, .words = words, .open = g->lanes};
    w.rows = (float)(blocks / words * SS_BLOCK), w.columns = (float)(32 * words);
    for (int i = 0; i < SS_BLOCK * 20; i++) w.row[i] = (float)(i + 1);
    for (unsigned lane = 0; lane < SS_LANES; lane++) {
        memcpy(ss_group_mask(g, lane), g->samples->outside, blocks * SS_BLOCK * sizeof(uint32_t));
    }
    uint32_t stack[SS_BVH_STACK], depth = 0;
    stack[depth++] = 0;
    while (depth && w.open) {
        const ss_bvh_node *node = &g->bvh->nodes[stack[--depth]];
        for (uint32_t m = children(g, node); m; m &= m - 1) {
            const uint32_t child = node->child[__builtin_ctz(m)];
            if (!(child & SS_BVH_LEAF)) {
                stack[depth++] = child;
                continue;
            }
            const ss_bvh_leaf *leaf = &g->bvh->leaves[child & ~SS_BVH_LEAF];
            const uint32_t in = triangles(g, leaf);
            for (uint32_t t = in; t; t &= t - 1) triangle(&w, leaf, (unsigned)__builtin_ctz(t));
            if (in) close_lanes(&w);
        }
    }
}

void GROUP_KERNEL(ss_group *g) {
    g->listed_count = 0;
    if (g->samples->blocks == 2 && g->samples->words == 1) run(g, 2, 1);
    else run(g, g->samples->blocks, g->samples->words);
}
