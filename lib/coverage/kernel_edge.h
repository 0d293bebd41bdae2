/* Edges of casters as sixteen points see them: projected, clipped, and turned into rows of bits. */
#ifndef SS_COVERAGE_KERNEL_EDGE_H
#define SS_COVERAGE_KERNEL_EDGE_H

#define FAR 256 /* cells: an end farther away than that is not computed with */

typedef struct place {
    vf x, y, t; /* homogeneous: see group.h */
} place;
typedef struct pixel {
    vf x, y; /* on the grid */
} pixel;

/* Rows low <= y < high are crossed, at x + (y - pivot) slope. */
typedef struct edge {
    _Alignas(64) float slope[SS_LANES], x[SS_LANES], pivot[SS_LANES], low[SS_LANES], high[SS_LANES];
} edge;

typedef struct bounds {
    vf x_low, x_high, y_low, y_high;
} bounds;

static inline vf transform_row(const ss_group *g, int row, vf x, vf y, vf z) {
    const vf inner = f_fma(f_load(g->matrix[row][2]), z, f_load(g->shift[row]));
    return f_fma(f_load(g->matrix[row][0]), x, f_fma(f_load(g->matrix[row][1]), y, inner));
}

/* position: a caster's vertex, in the world's axes. */
static inline place transform(const ss_group *g, const float position[3]) {
    const vf x = f_set(position[g->axis[0]]), y = f_set(position[g->axis[1]]),
             z = f_set(position[g->axis[2]]);
    return (place){transform_row(g, 0, x, y, z), transform_row(g, 1, x, y, z),
                   transform_row(g, 2, x, y, z)};
}

static inline pixel project(const place *a) {
    const vf r = f_invert(a->t);
    return (pixel){f_mul(a->x, r), f_mul(a->y, r)};
}

/* An end far away, where it is nearly level with the point, has lost its digits: there the line is
 * taken from the homogeneous ends, n = a x b, and hung up in the middle of the grid. */
static inline void set_far_edge(edge *e, vm where, const place *a, const place *b, float middle) {
    const vf n0 = f_sub(f_mul(a->y, b->t), f_mul(b->y, a->t));
    const vf n1 = f_sub(f_mul(b->x, a->t), f_mul(a->x, b->t));
    const vf n2 = f_sub(f_mul(a->x, b->y), f_mul(b->x, a->y));
    const vf y = f_set(middle), scale = f_invert(f_sub(f_set(0), n0));
    f_store(e->slope, f_blend(where, f_load(e->slope), f_mul(n1, scale)));
    f_store(e->x, f_blend(where, f_load(e->x), f_mul(f_fma(n1, y, n2), scale)));
    f_store(e->pivot, f_blend(where, f_load(e->pivot), y));
}

/* From a to b; which way round makes no difference to the edge. Gives the lanes in which it runs
 * upwards. */
static inline vm set_edge(edge *e, bounds *box, const place *a, const place *b, const pixel *pa,
                          const pixel *pb, float middle) {
    const vm up = f_lt(pa->y, pb->y);
    const vf low = f_blend(up, pb->y, pa->y), high = f_blend(up, pa->y, pb->y);
    const vf x = f_blend(up, pb->x, pa->x), far_x = f_blend(up, pa->x, pb->x);
    f_store(e->slope, f_mul(f_sub(far_x, x), f_invert(f_sub(high, low))));
    f_store(e->x, x);
    f_store(e->pivot, low);
    f_store(e->low, low);
    f_store(e->high, high);
    *box = (bounds){f_min(pa->x, pb->x), f_max(pa->x, pb->x), low, high};
    const vf reach = f_max(f_max(box->x_high, high), f_sub(f_set(0), f_min(box->x_low, low)));
    const vm far = f_lt(f_set(FAR), reach);
    if (m_bits(far)) set_far_edge(e, far, a, b, middle);
    return up;
}

/* Where it crosses sixteen rows `y`, in columns after the word-th 32; *rows: those it crosses. */
static inline vf edge_columns(const edge *e, unsigned lane, vf y, uint32_t word, vm *rows) {
    *rows = m_and(f_le(f_set(e->low[lane]), y), f_lt(y, f_set(e->high[lane])));
    const vf u = f_fma(f_sub(y, f_set(e->pivot[lane])), f_set(e->slope[lane]), f_set(e->x[lane]));
    return word ? f_sub(u, f_set((float)(32 * word))) : u;
}

/* The places it covers in a block of one lane's mask: sixteen rows `y`, the word-th 32 columns. */
static inline vi edge_block(const edge *e, unsigned lane, vf y, uint32_t word) {
    vm rows;
    const vf u = edge_columns(e, lane, y, word, &rows);
    return i_columns_from(u, rows);
}

/* Likewise in that block and the one to its right, for little more. */
typedef struct pair {
    vi of[2];
} pair;

static inline pair edge_pair(const edge *e, unsigned lane, vf y, uint32_t word) {
    pair p;
    vm rows;
    const vf u = edge_columns(e, lane, y, word, &rows);
    i_columns_pair(u, rows, &p.of[0], &p.of[1]);
    return p;
}

/* ---- clipping ------------------------------------------------------------------------------- */

typedef struct segment {
    place a, b;
} segment;

static inline place blend(vm m, const place *a, const place *b) {
    return (place){f_blend(m, a->x, b->x), f_blend(m, a->y, b->y), f_blend(m, a->t, b->t)};
}

/* Where the segment meets the plane; always reckoned from its inner end, so that the two faces at
 * an edge find the same place. */
static inline place meet(const place *in, const place *out, vf plane) {
    const vf s = f_mul(f_sub(plane, in->t), f_invert(f_sub(out->t, in->t)));
    return (place){f_fma(f_sub(out->x, in->x), s, in->x), f_fma(f_sub(out->y, in->y), s, in->y),
                   plane};
}

/* Keeps what is beyond the plane (far: before it) and closes the gap with one more segment.
 * Segments that are cut away shrink to one point outside the grid. */
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

#endif
