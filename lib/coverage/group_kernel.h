/* The kernel of group.h, compiled once for every instruction set: include lanes_*.h and define
 * GROUP_KERNEL first. Static inline C throughout, so that no copy of a function built for one set
 * can take the place of another's at link time.
 *
 * A caster seen from one point is a polygon in grid coordinates. Each of its edges covers, in the
 * rows it crosses, the columns to its right; the exclusive or over the edges is the polygon. Two
 * faces that share an edge compute it from the same two projected ends, the lower one first, so
 * they agree about it bit for bit: no crack, no overlap. That is also why faces that show one side
 * to the points may be drawn by the sum of their signed edges, in which inner edges cancel: each
 * face adds 0 or 1 to a sample's winding number, and it does not matter which faces are summed
 * together. */
#include <math.h>
#include <string.h>

#include "coverage/group.h"
#include "coverage/kernel_edge.h"

#include "coverage/kernel_draw.h"
#include "coverage/kernel_test.h"
#include "coverage/kernel_view.h"

#define SMALL 64 /* boundaries up to this are drawn even where a part is outside the shaft */
#define OFTEN 96 /* edges of single triangles between two looks at what is covered */

static uint32_t seen_by(const ss_group *g, uint32_t triangle, uint32_t lanes) {
    for (uint32_t i = 0; i < g->slab->skip_count; i++) {
        if (g->skip[i] == triangle) lanes &= ~(uint32_t)g->skip_lanes[i];
    }
    return lanes;
}

static void list_triangle(ss_group *g, uint32_t triangle) {
    if (g->listed_count < g->listed_room) g->listed[g->listed_count] = triangle;
    g->listed_count++;
}

/* Lanes from which the triangle is beside the light: on one side of the grid with all three
 * corners. It holds for corners behind the point, too, because x >= c t is kept by every mixture of
 * corners. */
static inline vm beside(const walk *w, const place v[3]) {
    const vf left = f_set(0.75f), right = f_set(w->columns + 0.25f), below = f_set(0.75f),
             above = f_set(w->rows + 0.25f);
    vm l = f_lt(v[0].x, f_mul(left, v[0].t)), r = f_lt(f_mul(right, v[0].t), v[0].x);
    vm b = f_lt(v[0].y, f_mul(below, v[0].t)), a = f_lt(f_mul(above, v[0].t), v[0].y);
    for (int c = 1; c < 3; c++) {
        l = m_and(l, f_lt(v[c].x, f_mul(left, v[c].t)));
        r = m_and(r, f_lt(f_mul(right, v[c].t), v[c].x));
        b = m_and(b, f_lt(v[c].y, f_mul(below, v[c].t)));
        a = m_and(a, f_lt(f_mul(above, v[c].t), v[c].y));
    }
    return m_or(m_or(l, r), m_or(a, b));
}

/* The planes that beside() looks at, moved out by more than floats round a sum over [-1, 1] by. */
static inline void set_cones(walk *w) {
    const ss_group *g = w->g;
    const vf at[4] = {f_set(0.75f), f_set(w->columns + 0.25f), f_set(0.75f),
                      f_set(w->rows + 0.25f)};
    for (int p = 0; p < 4; p++) {
        const int row = p / 2;
        vf size = f_set(0);
        for (int k = 0; k < 4; k++) {
            const float *of = k < 3 ? g->matrix[row][k] : g->shift[row],
                        *t = k < 3 ? g->matrix[2][k] : g->shift[2];
            vf n = f_fnma(at[p], f_load(t), f_load(of));
            if (p & 1) n = f_sub(f_set(0), n);
            f_store(w->cone[p][k], n);
            if (k < 3) f_store(w->cone_size[p][k], f_abs(n));
            size = f_add(size, f_add(f_abs(f_load(of)), f_mul(at[p], f_abs(f_load(t)))));
        }
        f_store(w->cone[p][3], f_fma(size, f_set(0x1p-20f), f_load(w->cone[p][3])));
    }
}

/* Open lanes from which something of a child may be before the light. A group of points spread over
 * a dense mesh has hundreds of faces in its shaft, each before the light of a point or two. */
static inline uint32_t lanes_of(const walk *w, const ss_bvh_node *node, uint32_t i) {
    const ss_group *g = w->g;
    vf middle[3], half[3];
    for (int k = 0; k < 3; k++) {
        const float low = node->low[g->axis[k]][i], high = node->high[g->axis[k]][i];
        middle[k] = f_set((high + low) * 0.5f), half[k] = f_set((high - low) * 0.5f);
    }
    vm out = m_from(0);
    for (int p = 0; p < 4; p++) {
        vf most = f_load(w->cone[p][3]), room = f_mul(f_load(w->cone_size[p][0]), half[0]);
        for (int k = 0; k < 3; k++) {
            most = f_fma(f_load(w->cone[p][k]), middle[k], most);
            if (k) room = f_fma(f_load(w->cone_size[p][k]), half[k], room);
        }
        out = m_or(out, f_lt(f_add(most, room), f_set(0)));
    }
    return w->open & ~m_bits(out);
}

/* A face that cannot be part of an outline: clipped, near, seen from both sides or thin. */
static inline void single(walk *w, const ss_bvh_leaf *leaf, unsigned slot, uint32_t here) {
    ss_group *g = w->g;
    uint32_t lanes = seen_by(g, leaf->triangle[slot], w->open & here);
    if (!lanes) return;
    place v[3];
    vf x[3][3];
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < 3; k++) x[c][k] = f_set(leaf->corner[c][g->axis[k]][slot]);
        v[c].t = transform_row(g, 2, x[c][0], x[c][1], x[c][2]);
    }
    const vf least = f_min(v[0].t, f_min(v[1].t, v[2].t)),
             most = f_max(v[0].t, f_max(v[1].t, v[2].t));
    const vf near = f_load(g->slab->t_near), far = f_load(g->slab->t_far);
    lanes &= m_bits(m_and(f_le(near, most), f_le(least, far)));
    if (!lanes) return;
    for (int c = 0; c < 3; c++) {
        v[c].x = transform_row(g, 0, x[c][0], x[c][1], x[c][2]);
        v[c].y = transform_row(g, 1, x[c][0], x[c][1], x[c][2]);
    }
    if (!g->marks) lanes &= ~m_bits(beside(w, v)); /* marks reach beyond the grid */
    if (!lanes) return;
    if (g->tested && g->tested[leaf->triangle[slot]]) {
        list_triangle(g, leaf->triangle[slot]);
        return;
    }
    const uint32_t whole = m_bits(m_and(f_le(near, least), f_le(most, far)));
    draw_triangle(w, v, lanes, (whole & lanes) != lanes);
}

/* The edges of these slots' faces, all of one side. */
static inline void leaf_uses(walk *w, const uint32_t uses[3][SS_BVH_WIDTH], uint32_t slots,
                             uint32_t side) {
    uint32_t list[3 * SS_BVH_WIDTH], n = 0;
    for (; slots; slots &= slots - 1) {
        const unsigned slot = (unsigned)__builtin_ctz(slots);
        for (int k = 0; k < 3; k++) {
            list[n] = uses[k][slot];
            n += list[n] != SS_NO_USE;
        }
    }
    reserve(w, n);
    add_uses(w->g, list, n, side);
}

/* merge: its faces share enough edges that a common outline pays. */
static inline void visit_leaf(walk *w, uint32_t index, bool merge, uint32_t here) {
    ss_group *g = w->g;
    const ss_outline *outline = g->slab->outline;
    const ss_bvh_leaf *leaf = &g->slab->bvh->leaves[index];
    const box b = triangle_box(leaf);
    const depths d = depths_of(g, &b);
    vm in = m_andnot(m_from((1u << leaf->count) - 1), out_of_slab(g->slab, &d));
    in = m_and(in, triangles_in_shaft(&g->shaft, leaf, &b));
    if (!m_bits(in)) return;
    planes p;
    const sides s = triangle_sides(g, leaf, outline->leaf_drop[index], &p);
    const uint32_t rest = m_bits(m_andnot(in, s.hidden));
    if (!rest) return;
    uint32_t joint = 0;
    if (merge) joint = m_bits(m_and(m_or(s.front, s.back), between_planes(g->slab, &d))) & rest;
    const uint32_t back = m_bits(s.back);
    if (joint & ~back) leaf_uses(w, outline->leaf_uses[index], joint & ~back, 0);
    if (joint & back) leaf_uses(w, outline->leaf_uses[index], joint & back, 1);
    for (uint32_t m = rest & ~joint; m; m &= m - 1) {
        const unsigned slot = (unsigned)__builtin_ctz(m);
        const uint32_t lanes = g->marks ? here : here & ~idle_lanes(g, &p, slot);
        if (lanes) single(w, leaf, slot, lanes);
    }
    if (w->work > OFTEN) close_lanes(w);
}

static inline void whole_child(walk *w, const ss_outline_node *o, unsigned i, uint32_t side) {
    const uint32_t *uses = w->g->slab->outline->uses + o->first[i];
    for (uint32_t done = 0; done < o->count[i];) {
        /* Boundaries longer than a list cancel in pieces only; that costs time, not truth. */
        const uint32_t left = o->count[i] - done, n = left < SS_GROUP_LIST ? left : SS_GROUP_LIST;
        reserve(w, n);
        add_uses(w->g, uses + done, n, side);
        done += n;
    }
}

/* Children to be opened, nearest to the points last. */
static inline uint32_t sort_children(const ss_group *g, const ss_bvh_node *node, uint32_t mask,
                                     uint32_t sorted[SS_BVH_WIDTH]) {
    float key[SS_BVH_WIDTH];
    _Alignas(64) float away[SS_BVH_WIDTH];
    vf sum = f_set(0);
    for (int k = 0; k < 3; k++) {
        sum = f_fma(f_add(f_load(node->low[k]), f_load(node->high[k])), f_set(g->t_axis[k]), sum);
    }
    f_store(away, sum);
    uint32_t count = 0;
    for (; mask; mask &= mask - 1) {
        const uint32_t i = (uint32_t)__builtin_ctz(mask);
        uint32_t at = count++;
        for (; at > 0 && key[at - 1] < away[i]; at--)
            key[at] = key[at - 1], sorted[at] = sorted[at - 1];
        key[at] = away[i], sorted[at] = i;
    }
    return count;
}

/* Children of a node that may matter: those whose outline stands for them, and the rest. */
typedef struct choice {
    uint32_t whole, back, open;
} choice;

static inline choice choose(const ss_group *g, uint32_t index) {
    const ss_bvh_node *node = &g->slab->bvh->nodes[index];
    const ss_outline_node *o = &g->slab->outline->nodes[index];
    const box b = child_box(node);
    const depths d = depths_of(g, &b);
    choice c = {0, 0, 0};
    vm inside;
    vm in = m_andnot(m_from((1u << node->count) - 1), out_of_slab(g->slab, &d));
    in = m_and(in, in_shaft(&g->shaft, &b, &inside));
    if (!m_bits(in)) return c;
    const sides s = child_sides(g, o);
    c.open = m_bits(m_andnot(in, s.hidden)), c.back = m_bits(s.back);
    const uint32_t one_side = m_bits(m_or(s.front, s.back));
    c.whole = c.open & one_side & o->whole & m_bits(between_planes(g->slab, &d));
    for (uint32_t m = c.whole & ~m_bits(inside); m; m &= m - 1) {
        if (o->count[__builtin_ctz(m)] > SMALL) c.whole &= ~(m & -m);
    }
    c.open &= ~c.whole;
    return c;
}

static inline uint32_t visit_node(walk *w, uint32_t index, uint32_t *stack) {
    ss_group *g = w->g;
    const ss_bvh_node *node = &g->slab->bvh->nodes[index];
    const ss_outline_node *o = &g->slab->outline->nodes[index];
    const choice c = choose(g, index);
    g->nodes++;
    for (uint32_t m = c.whole; m; m &= m - 1) {
        const unsigned i = (unsigned)__builtin_ctz(m);
        whole_child(w, o, i, c.back >> i & 1);
        g->edges += o->count[i];
    }
    uint32_t sorted[SS_BVH_WIDTH], depth = 0;
    const uint32_t count = sort_children(g, node, c.open, sorted);
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t child = node->child[sorted[i]];
        if (child & SS_BVH_LEAF) continue;
        if (g->marks || lanes_of(w, node, sorted[i])) stack[depth++] = child;
    }
    for (uint32_t i = count; i-- > 0;) {
        const uint32_t child = node->child[sorted[i]];
        if (!(child & SS_BVH_LEAF)) continue;
        const uint32_t here = g->marks ? w->open : lanes_of(w, node, sorted[i]);
        if (!here) continue;
        g->leaves++;
        visit_leaf(w, child & ~SS_BVH_LEAF, o->whole >> sorted[i] & 1, here);
    }
    return depth;
}

/* Of the samples that are seen the weight, and how many samples differ from the next in their row,
 * or column within a block: how long the rims of what is covered are, in cells. */
static inline void count_samples(ss_group *g, uint32_t blocks, unsigned lane) {
    _Alignas(64) static const uint32_t within[SS_BLOCK] = {
        ~0u, ~0u, ~0u, ~0u, ~0u, ~0u, ~0u, ~0u, ~0u, ~0u, ~0u, ~0u, ~0u, ~0u, ~0u, 0};
    const ss_lattice *lattice = g->lattice;
    const uint32_t *mask = ss_group_mask(g, lane);
    const size_t words = (size_t)blocks * SS_BLOCK;
    vi seen = i_zero(), rims = i_zero();
    for (uint32_t b = 0; b < blocks; b++) {
        const vi m = i_load(mask + SS_BLOCK * b), all = i_set(~0u);
        const vi in = i_andnot(all, i_load(lattice->outside + SS_BLOCK * b));
        for (uint32_t p = 0; p < lattice->planes; p++) {
            const uint32_t *plane = lattice->plane + p * words + SS_BLOCK * b;
            seen = i_count(seen, i_andnot(i_load(plane), m), p);
        }
        const vi across = i_and(i_xor(m, i_halve(m)), i_and(in, i_halve(in)));
        const vi along = i_and(i_xor(m, i_next(m)), i_and(in, i_next(in)));
        rims = i_count(i_count(rims, across, 0), i_and(along, i_load(within)), 0);
    }
    g->visible[lane] = i_total(seen), g->rough[lane] = (uint32_t)i_total(rims);
}

/* What came out for each lane. */
static inline void conclude(const walk *w) {
    ss_group *g = w->g;
    const ss_lattice *lattice = g->lattice;
    g->lit = g->dark = 0;
    for (uint32_t lanes = g->lanes; lanes; lanes &= lanes - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(lanes);
        const uint32_t *mask = ss_group_mask(g, lane);
        if (!(w->open >> lane & 1)) {
            g->dark |= 1u << lane;
            continue;
        }
        vi added = i_zero();
        for (uint32_t b = 0; b < w->blocks; b++) {
            added = i_or(
                added, i_xor(i_load(mask + SS_BLOCK * b), i_load(lattice->outside + SS_BLOCK * b)));
        }
        if (i_any(added)) count_samples(g, w->blocks, lane);
        else g->lit |= 1u << lane;
    }
}

static inline void walk_slab(walk *w, uint32_t slab) {
    ss_group *g = w->g;
    uint32_t stack[SS_BVH_STACK], depth = 0;
    g->slab = &g->slabs[slab];
    stack[depth++] = 0;
    while (depth && w->open) {
        depth--;
        depth += visit_node(w, stack[depth], stack + depth);
    }
    flush(w); /* edges are numbered slab by slab */
}

/* ---- what the points lie behind -----------------------------------------------------------------
 *
 * Points on the far side of a solid see nothing for what is right before them: faces that the walk
 * leaves to those behind, which are on the near side. A solid's fronts and backs wind equally often
 * around a sample, edge by edge, so that a lane is covered by the one just where it is by the
 * other: drawn first, the fronts near the points tell the same, and sooner. */

#define AROUND 0.25f /* of the largest half of the points' box: faces are near */

static inline vm near_points(const ss_group *g, const box *b) {
    const float reach = AROUND * fmaxf(g->half[0], fmaxf(g->half[1], g->half[2]));
    vm in = m_from(0xffff);
    for (int k = 0; k < 3; k++) {
        in = m_and(in, f_le(b->low[k], f_set(g->middle[k] + g->half[k] + reach)));
        in = m_and(in, f_le(f_set(g->middle[k] - g->half[k] - reach), b->high[k]));
    }
    return in;
}

/* Those of a leaf that are near, for lanes that are in front of them and the light, or most of it,
 * behind. */
static inline void leaf_fronts(walk *w, uint32_t index) {
    ss_group *g = w->g;
    const ss_bvh_leaf *leaf = &g->slab->bvh->leaves[index];
    const box b = triangle_box(leaf);
    const uint32_t near = m_bits(near_points(g, &b)) & ((1u << leaf->count) - 1);
    if (!near) return;
    planes p;
    triangle_sides(g, leaf, g->slab->outline->leaf_drop[index], &p);
    vf up = f_set(0);
    for (int k = 0; k < 3; k++) up = f_fma(f_load(p.n[k]), f_set(g->t_axis[k]), up);
    const uint32_t away = m_bits(f_lt(up, f_set(0)));
    p.front &= away, p.back &= ~away;
    for (uint32_t m = near & (p.front | p.back); m; m &= m - 1) {
        const unsigned slot = (unsigned)__builtin_ctz(m);
        const uint32_t lanes = idle_lanes(g, &p, slot);
        if (lanes && !(g->tested && g->tested[leaf->triangle[slot]])) single(w, leaf, slot, lanes);
    }
}

/* Closes lanes that these cover; of the others they are forgotten. */
static inline void draw_fronts(walk *w) {
    ss_group *g = w->g;
    uint32_t stack[SS_BVH_STACK], depth = 0;
    g->slab = &g->slabs[0];
    stack[depth++] = 0;
    while (depth) {
        const ss_bvh_node *node = &g->slab->bvh->nodes[stack[--depth]];
        const box b = child_box(node);
        for (uint32_t m = m_bits(near_points(g, &b)) & ((1u << node->count) - 1); m; m &= m - 1) {
            const uint32_t child = node->child[__builtin_ctz(m)];
            if (child & SS_BVH_LEAF)
                leaf_fronts(w, child & ~SS_BVH_LEAF);
            else
                stack[depth++] = child;
        }
    }
    close_lanes(w);
}

/* Nothing is covered but places that are no samples. */
static inline void clear_masks(const walk *w) {
    for (uint32_t m = w->open; m; m &= m - 1) {
        memcpy(ss_group_mask(w->g, (unsigned)__builtin_ctz(m)), w->g->lattice->outside,
               w->blocks * SS_BLOCK * sizeof(uint32_t));
    }
}

static inline void run(ss_group *g, uint32_t blocks, uint32_t words) {
    _Static_assert(sizeof(walk) <= SS_GROUP_WALK_BYTES, "room for a walk");
    walk *w = g->walk;
    w->g = g, w->blocks = blocks, w->words = words, w->row_blocks = blocks / words,
    w->open = g->lanes;
    g->nodes = g->leaves = g->edges = 0;
    w->planes = 3, w->work = w->uses = w->batch.count = 0;
    w->rows = (float)(w->row_blocks * SS_BLOCK), w->columns = (float)(32 * words);
    for (uint32_t i = 0; i < w->row_blocks * SS_BLOCK; i++) w->row[i] = (float)(i + 1);
    clear_masks(w);
    set_cones(w);
    if (g->fronts_first && !g->marks) {
        draw_fronts(w);
        clear_masks(w);
    }
    for (uint32_t i = g->slab_count; i-- > 0 && w->open;) walk_slab(w, i);
    conclude(w);
}

static void draw_group(ss_group *g) {
    g->listed_count = g->list_count = 0;
    if (g->lattice->blocks == 2 && g->lattice->words == 1)
        run(g, 2, 1);
    else
        run(g, g->lattice->blocks, g->lattice->words);
}

/* What choose() keeps, all of it; single faces of leaves are not looked at. */
static uint32_t weigh_group(ss_group *g, uint32_t most) {
    walk *w = g->walk;
    uint32_t took = 0;
    g->nodes = g->leaves = g->edges = 0;
    w->g = g, w->open = g->lanes;
    w->rows = (float)(SS_BLOCK * g->lattice->row_blocks);
    w->columns = (float)(32 * g->lattice->words);
    set_cones(w);
    for (uint32_t i = g->slab_count; i-- > 0 && took < most;) {
        uint32_t stack[SS_BVH_STACK], depth = 0;
        g->slab = &g->slabs[i];
        stack[depth++] = 0;
        while (depth && took < most) {
            const uint32_t index = stack[--depth];
            const ss_bvh_node *node = &g->slab->bvh->nodes[index];
            const choice c = choose(g, index);
            g->nodes++;
            for (uint32_t m = c.whole; m; m &= m - 1)
                g->edges += g->slab->outline->nodes[index].count[__builtin_ctz(m)];
            for (uint32_t m = c.open; m; m &= m - 1) {
                const uint32_t at = (uint32_t)__builtin_ctz(m), child = node->child[at];
                if (!lanes_of(w, node, at)) continue;
                if (child & SS_BVH_LEAF)
                    g->leaves++;
                else
                    stack[depth++] = child;
            }
            took = ss_group_took(g);
        }
    }
    return took;
}

static void survey_group(ss_group *g) {
    uint32_t stack[SS_BVH_STACK], depth = 0;
    g->listed_count = 0;
    stack[depth++] = 0;
    while (depth && g->listed_count <= g->listed_room) {
        const uint32_t index = stack[--depth];
        const ss_bvh_node *node = &g->bvh->nodes[index];
        const box b = child_box(node);
        vm inside;
        vm in = m_and(m_from((1u << node->count) - 1), in_shaft(&g->shaft, &b, &inside));
        if (!m_bits(in)) continue;
        in = m_andnot(in, child_sides(g, &g->outline->nodes[index]).hidden);
        for (uint32_t m = m_bits(in); m; m &= m - 1) {
            const uint32_t child = node->child[__builtin_ctz(m)];
            if (!(child & SS_BVH_LEAF)) {
                stack[depth++] = child;
                continue;
            }
            const uint32_t l = child & ~SS_BVH_LEAF;
            const ss_bvh_leaf *leaf = &g->bvh->leaves[l];
            const box c = triangle_box(leaf);
            vm left =
                m_and(m_from((1u << leaf->count) - 1), triangles_in_shaft(&g->shaft, leaf, &c));
            if (!m_bits(left)) continue;
            left = m_andnot(left, triangle_sides(g, leaf, g->outline->leaf_drop[l], NULL).hidden);
            for (uint32_t t = m_bits(left); t; t &= t - 1)
                list_triangle(g, leaf->triangle[__builtin_ctz(t)]);
        }
    }
}

const ss_group_kernel GROUP_KERNEL = {view_light, enclose_depths, draw_group, weigh_group,
                                      survey_group};
