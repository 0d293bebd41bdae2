/* What may be between a group and the light, and from which side it is seen: tests of sixteen boxes
 * or triangles at once. All of them are certain in the direction that matters. */
#ifndef SS_COVERAGE_KERNEL_TEST_H
#define SS_COVERAGE_KERNEL_TEST_H

typedef struct box {
    vf low[3], high[3];
} box;

static inline box child_box(const ss_bvh_node *node) {
    box b;
    for (int k = 0; k < 3; k++) b.low[k] = f_load(node->low[k]), b.high[k] = f_load(node->high[k]);
    return b;
}

static inline box triangle_box(const ss_bvh_leaf *leaf) {
    box b;
    for (int k = 0; k < 3; k++) {
        const vf v0 = f_load(leaf->corner[0][k]), v1 = f_load(leaf->corner[1][k]),
                 v2 = f_load(leaf->corner[2][k]);
        b.low[k] = f_min(v0, f_min(v1, v2)), b.high[k] = f_max(v0, f_max(v1, v2));
    }
    return b;
}

static inline vm in_hull_box(const ss_shaft *shaft, const box *b) {
    vm in = f_le(b->low[0], f_set(shaft->high[0]));
    in = m_and(in, f_le(f_set(shaft->low[0]), b->high[0]));
    for (int k = 1; k < 3; k++) {
        in = m_and(in, f_le(b->low[k], f_set(shaft->high[k])));
        in = m_and(in, f_le(f_set(shaft->low[k]), b->high[k]));
    }
    return in;
}

static inline vf height(const float n[3], vf x, vf y, vf z) {
    return f_fma(x, f_set(n[0]), f_fma(y, f_set(n[1]), f_mul(z, f_set(n[2]))));
}

/* Boxes that are in the shaft at least in part; *inside: wholly, but for rounding. */
static inline vm in_shaft(const ss_shaft *shaft, const box *b, vm *inside) {
    vm in = in_hull_box(shaft, b), whole = in;
    for (unsigned p = 0; p < shaft->planes; p++) {
        const float *n = shaft->normal[p];
        const vf limit = f_set(shaft->limit[p]);
        const bool x = n[0] > 0, y = n[1] > 0, z = n[2] > 0;
        in = m_and(in, f_le(height(n, x ? b->low[0] : b->high[0], y ? b->low[1] : b->high[1],
                                   z ? b->low[2] : b->high[2]),
                            limit));
        whole = m_and(whole, f_le(height(n, x ? b->high[0] : b->low[0], y ? b->high[1] : b->low[1],
                                         z ? b->high[2] : b->low[2]),
                                  limit));
    }
    *inside = whole;
    return in;
}

static inline vm triangles_in_shaft(const ss_shaft *shaft, const ss_bvh_leaf *leaf, const box *b) {
    vm in = in_hull_box(shaft, b);
    for (unsigned p = 0; p < shaft->planes; p++) {
        vf least = height(shaft->normal[p], f_load(leaf->corner[0][0]), f_load(leaf->corner[0][1]),
                          f_load(leaf->corner[0][2]));
        for (int c = 1; c < 3; c++) {
            least = f_min(least, height(shaft->normal[p], f_load(leaf->corner[c][0]),
                                        f_load(leaf->corner[c][1]), f_load(leaf->corner[c][2])));
        }
        in = m_and(in, f_le(least, f_set(shaft->limit[p])));
    }
    return in;
}

/* How far along the segments boxes lie, for all lanes. */
typedef struct depths {
    vf low, high;
} depths;

static inline depths depths_of(const ss_group *g, const box *b) {
    depths d = {f_set(g->t_least), f_set(g->t_most)};
    for (int k = 0; k < 3; k++) {
        const vf from = f_sub(b->low[k], f_set(g->middle[k])),
                 to = f_sub(b->high[k], f_set(g->middle[k]));
        const vf n = f_set(g->t_axis[k]);
        const vf one = f_mul(from, n), two = f_mul(to, n);
        const vf spread = f_mul(f_set(g->t_spread[k]), f_max(f_abs(from), f_abs(to)));
        d.low = f_add(d.low, f_sub(f_min(one, two), spread));
        d.high = f_add(d.high, f_add(f_max(one, two), spread));
    }
    return d;
}

/* Boxes between every lane's near and far plane: nothing of them is clipped, or too near. */
static inline vm between_planes(const ss_slab *slab, const depths *d) {
    return m_and(f_lt(f_set(slab->t_safe), d->low), f_lt(d->high, f_set(slab->t_beyond)));
}

/* Boxes of which other slabs draw everything that this one could. */
static inline vm out_of_slab(const ss_slab *slab, const depths *d) {
    return m_or(f_lt(d->high, f_set(slab->t_floor)),
                m_and(f_lt(f_set(slab->t_until), d->low), f_lt(d->high, f_set(slab->t_again))));
}

/* ---- sides
 * -------------------------------------------------------------------------------------*/

/* front, back: all faces show it to all points; hidden: need not be drawn, because points and light
 * are on one side of all faces, which are therefore in nobody's way, or because the faces behind
 * will do (outline.h). */
typedef struct sides {
    vm front, back, hidden;
} sides;

/* Where a body (middle w, half size h, relative to the faces' middles) lies to planes whose normals
 * and offsets are in these ranges. */
static inline void side_of(const ss_outline_node *o, const vf w[3], const float h[3], vf low,
                           vf high, vm *front, vm *back) {
    vf least = f_set(0), most = f_set(0), slack = f_set(0), along = f_set(0), square = f_set(0);
    for (int k = 0; k < 3; k++) {
        const vf a = f_load(o->normal_low[k]), b = f_load(o->normal_high[k]);
        const vf p = f_mul(a, w[k]), q = f_mul(b, w[k]);
        least = f_add(least, f_min(p, q)), most = f_add(most, f_max(p, q));
        slack = f_fma(f_max(f_abs(a), f_abs(b)), f_set(h[k]), slack);
        slack = f_fma(f_abs(w[k]), f_set(0x1p-20f), slack);
        along = f_fma(f_load(o->axis[k]), w[k], along);
        square = f_fma(w[k], w[k], square);
    }
    *front = f_lt(high, f_sub(least, slack)), *back = f_lt(f_add(most, slack), low);
    /* The cone: n . w >= along cosine - across sine for along > 0, and likewise below. */
    const vf rest = f_max(f_set(0), f_fnma(along, along, square));
    const vf across = f_sqrt(f_fma(square, f_set(0x1p-20f), rest)); /* the difference is rounded */
    const vf cosine = f_load(o->cosine), lean = f_mul(across, f_load(o->sine));
    const vf main = f_mul(along, cosine);
    const vm cone = f_lt(f_set(0), cosine);
    const vm ahead = m_and(cone, f_lt(f_set(0), along)),
             behind = m_and(cone, f_lt(along, f_set(0)));
    *front = m_or(*front, m_and(ahead, f_lt(high, f_sub(f_sub(main, lean), slack))));
    *back = m_or(*back, m_and(behind, f_lt(f_add(f_add(main, lean), slack), low)));
}

static inline sides child_sides(const ss_group *g, const ss_outline_node *o) {
    sides s;
    vf w[3];
    for (int k = 0; k < 3; k++) w[k] = f_sub(f_set(g->middle[k]), f_load(o->middle[k]));
    side_of(o, w, g->half, f_load(o->offset_low), f_load(o->offset_high), &s.front, &s.back);
    s.hidden = m_or(m_and(s.front, m_from(o->drop_front)), m_and(s.back, m_from(o->drop_back)));
    return s;
}

/* The planes of a leaf's faces: what is at `middle` + x is n . x + at before one, but for slack;
 * and the slots that are in nobody's way for points that see their front, or back. */
typedef struct planes {
    _Alignas(64) float n[3][SS_BVH_WIDTH], at[SS_BVH_WIDTH], slack[SS_BVH_WIDTH];
    uint32_t front, back;
} planes;

/* Lanes to which the face shows for sure a side that hides nothing from them. */
static inline uint32_t idle_lanes(const ss_group *g, const planes *p, unsigned slot) {
    vf at = f_set(p->at[slot]);
    for (int k = 0; k < 3; k++) at = f_fma(f_set(p->n[k][slot]), f_load(g->apart[k]), at);
    const vf slack = f_set(p->slack[slot]);
    uint32_t idle = 0;
    if (p->front >> slot & 1) idle |= m_bits(f_lt(slack, at));
    if (p->back >> slot & 1) idle |= m_bits(f_lt(f_add(at, slack), f_set(0)));
    return idle;
}

static inline sides triangle_sides(const ss_group *g, const ss_bvh_leaf *leaf,
                                   const uint16_t drop[2], planes *out) {
    vf e[3], f[3], n[3], from[3];
    for (int k = 0; k < 3; k++) {
        from[k] = f_load(leaf->corner[0][k]);
        e[k] = f_sub(f_load(leaf->corner[1][k]), from[k]),
        f[k] = f_sub(f_load(leaf->corner[2][k]), from[k]);
    }
    vf at = f_set(0), slack = f_set(0), size = f_set(0), longest = f_set(0), room = f_set(0);
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        n[k] = f_sub(f_mul(e[i], f[j]), f_mul(e[j], f[i]));
        const vf w = f_sub(f_set(g->middle[k]), from[k]);
        const vf a = f_abs(n[k]);
        at = f_fma(n[k], w, at);
        slack = f_fma(a, f_set(SS_SIDE_ERROR), slack);
        room = f_fma(a, f_set(g->half[k]), room);
        size = f_add(size, a);
        longest = f_max(longest, f_max(f_abs(e[k]), f_abs(f[k])));
    }
    const vf reach = f_set(0x1p-20f);
    vf w_size = f_set(0);
    for (int k = 0; k < 3; k++) {
        w_size = f_max(w_size, f_abs(f_sub(f_set(g->middle[k]), from[k])));
    }
    slack = f_fma(f_mul(size, w_size), reach, f_fma(room, reach, slack));
    room = f_add(room, slack);
    /* Thinner than rounding: see ss_outline_build(). */
    const vm solid = f_lt(f_mul(longest, f_set(4 * SS_SIDE_ERROR)), size);
    sides s;
    s.front = m_and(solid, f_lt(room, at));
    s.back = m_and(solid, f_lt(f_add(at, room), f_set(0)));
    s.hidden = m_or(m_and(s.front, m_from(drop[0])), m_and(s.back, m_from(drop[1])));
    if (!out) return s;
    for (int k = 0; k < 3; k++) f_store(out->n[k], n[k]);
    f_store(out->at, at);
    f_store(out->slack, slack);
    out->front = m_bits(solid) & drop[0], out->back = m_bits(solid) & drop[1];
    return s;
}

#endif
