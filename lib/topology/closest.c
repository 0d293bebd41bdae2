/* A complete tree of boxes, four to a node, over triangles in Morton order, four to a leaf: child k
 * of node i is node 4i + k one level down, so there is nothing to link and little to build. Four
 * boxes or triangles are measured at once in float, to find the nearest; its distance is then taken
 * in double. Where rounding hides the nearest triangle, the answer is the distance of one hardly
 * farther. */
#include "topology/closest.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"
#include "base/vec.h"

#define WIDE   4
#define LEVELS 16 /* 4^16 leaves */

/* Vectors of the compiler's: they become whatever the machine has. */
typedef float lanes __attribute__((vector_size(16)));
typedef int32_t mask __attribute__((vector_size(16)));

typedef struct boxes {
    lanes low[3], high[3];
} boxes;

/* Triangles a, a + u, a + v, with what does not depend on the point. */
typedef struct leaf {
    lanes a[3], u[3], v[3], n[3];
    lanes uu, uv, vv, nn;           /* products of them */
    lanes per_uu, per_vv, per_side; /* 1 / squared lengths of the sides; 0 for none */
    uint32_t triangle[WIDE];
} leaf;

struct ss_closest {
    const float *vertices;
    const uint32_t *triangles;
    uint32_t *order; /* triangles along the Morton curve */
    size_t count;
    leaf *leaves;
    boxes *nodes;                       /* level by level; the leaves' parents come first */
    size_t size[LEVELS], first[LEVELS]; /* of the levels; 0 are the leaves, in leaves */
    unsigned top;                       /* the level with one node */
};

typedef struct box {
    float low[3], high[3];
} box;

static uint64_t spread(uint64_t x) { /* 21 bits, two zeros between each */
    x = (x | x << 32) & 0x1f00000000ffff;
    x = (x | x << 16) & 0x1f0000ff0000ff;
    x = (x | x << 8) & 0x100f00f00f00f00f;
    x = (x | x << 4) & 0x10c30c30c30c30c3;
    return (x | x << 2) & 0x1249249249249249;
}

static void grow(box *b, const float p[3]) {
    for (int k = 0; k < 3; k++) {
        if (p[k] < b->low[k]) b->low[k] = p[k];
        if (p[k] > b->high[k]) b->high[k] = p[k];
    }
}

static const box nothing = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static const float *corner(const ss_closest *c, size_t t, size_t k) {
    return c->vertices + 3 * (size_t)c->triangles[3 * t + k];
}

static uint64_t morton(const ss_closest *c, const box *all, const float scale[3], size_t t) {
    uint64_t code = 0;
    for (int k = 0; k < 3; k++) {
        const float sum = corner(c, t, 0)[k] + corner(c, t, 1)[k] + corner(c, t, 2)[k];
        code |= spread((uint64_t)((sum / 3 - all->low[k]) * scale[k])) << k;
    }
    return code;
}

/* Ten bits an axis: finer than the triangles matter. One stable pass for each ten bits. */
static bool sort_triangles(ss_closest *c) {
    uint32_t *code = ss_alloc(c->count, sizeof *code), *spare = ss_alloc(c->count, sizeof *spare);
    if (code && spare) {
        box all = nothing;
        float scale[3];
        for (size_t i = 0; i < 3 * c->count; i++) grow(&all, corner(c, i / 3, i % 3));
        for (int k = 0; k < 3; k++) {
            const float side = all.high[k] - all.low[k];
            scale[k] = side > 0 ? 1023 / side : 0;
        }
        for (size_t t = 0; t < c->count; t++) {
            code[t] = (uint32_t)morton(c, &all, scale, t), c->order[t] = (uint32_t)t;
        }
        for (int shift = 0; shift < 30; shift += 10) {
            size_t place[1025] = {0};
            for (size_t i = 0; i < c->count; i++) place[(code[i] >> shift & 1023) + 1]++;
            for (size_t i = 0; i < 1024; i++) place[i + 1] += place[i];
            for (size_t i = 0; i < c->count; i++) {
                spare[place[code[c->order[i]] >> shift & 1023]++] = c->order[i];
            }
            memcpy(c->order, spare, c->count * sizeof *spare);
        }
    }
    const bool sorted = code && spare;
    ss_free(code), ss_free(spare);
    return sorted;
}

static float per(float x) { return x > 0 && 1 / x < INFINITY ? 1 / x : 0; }

static float dot(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void fill_lane(const ss_closest *c, leaf *l, int lane, uint32_t t) {
    float u[3], v[3], side[3], n[3];
    for (int k = 0; k < 3; k++) {
        const float a = corner(c, t, 0)[k];
        u[k] = corner(c, t, 1)[k] - a, v[k] = corner(c, t, 2)[k] - a, side[k] = v[k] - u[k];
        l->a[k][lane] = a, l->u[k][lane] = u[k], l->v[k][lane] = v[k];
    }
    for (int k = 0; k < 3; k++) {
        n[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
        l->n[k][lane] = n[k];
    }
    l->uu[lane] = dot(u, u), l->uv[lane] = dot(u, v), l->vv[lane] = dot(v, v);
    l->nn[lane] = dot(n, n);
    l->per_uu[lane] = per(dot(u, u)), l->per_vv[lane] = per(dot(v, v));
    l->per_side[lane] = per(dot(side, side));
    l->triangle[lane] = t;
}

/* The last leaf is filled up with its last triangle. */
static void fill_leaves(ss_closest *c) {
    for (size_t i = 0; i < WIDE * c->size[0]; i++) {
        const size_t last = c->count - 1;
        fill_lane(c, &c->leaves[i / WIDE], (int)(i % WIDE), c->order[i < last ? i : last]);
    }
}

static box box_of_leaf(const ss_closest *c, size_t i) {
    box b = nothing;
    for (size_t k = 0; k < 3 * WIDE; k++) {
        grow(&b, corner(c, c->leaves[i].triangle[k / 3], k % 3));
    }
    return b;
}

static box box_of_node(const boxes *node) {
    box b = nothing;
    for (int k = 0; k < 3; k++) {
        for (int lane = 0; lane < WIDE; lane++) {
            b.low[k] = fminf(b.low[k], node->low[k][lane]);
            b.high[k] = fmaxf(b.high[k], node->high[k][lane]);
        }
    }
    return b;
}

static void fit_boxes(ss_closest *c) {
    for (unsigned level = 1; level <= c->top; level++) {
        for (size_t i = 0; i < WIDE * c->size[level]; i++) {
            box b = nothing;
            if (i < c->size[level - 1]) {
                b = level == 1 ? box_of_leaf(c, i)
                               : box_of_node(&c->nodes[c->first[level - 1] + i]);
            }
            boxes *node = &c->nodes[c->first[level] + i / WIDE];
            for (int k = 0; k < 3; k++) {
                node->low[k][i % WIDE] = b.low[k], node->high[k][i % WIDE] = b.high[k];
            }
        }
    }
}

/* Sizes of the levels; the number of nodes above the leaves. */
static size_t plan(ss_closest *c) {
    size_t nodes = 0;
    c->size[0] = (c->count + WIDE - 1) / WIDE;
    do {
        c->top++;
        c->size[c->top] = (c->size[c->top - 1] + WIDE - 1) / WIDE;
        c->first[c->top] = nodes;
        nodes += c->size[c->top];
    } while (c->size[c->top] > 1);
    return nodes;
}

softshadow_status ss_closest_create(ss_closest **out, const float *vertices,
                                    const uint32_t *triangles, size_t triangle_count) {
    *out = NULL;
    ss_closest *c = ss_alloc(1, sizeof *c);
    if (c) {
        c->vertices = vertices, c->triangles = triangles, c->count = triangle_count;
        c->nodes = ss_alloc(plan(c), sizeof *c->nodes);
        c->leaves = ss_alloc(c->size[0], sizeof *c->leaves);
        c->order = ss_alloc(triangle_count, sizeof *c->order);
    }
    if (!c || !c->order || !c->nodes || !c->leaves || !sort_triangles(c)) {
        ss_closest_destroy(c);
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for distances to %zu triangles",
                       triangle_count);
    }
    fill_leaves(c);
    fit_boxes(c);
    *out = c;
    return SOFTSHADOW_OK;
}

void ss_closest_destroy(ss_closest *c) {
    if (!c) return;
    ss_free(c->order);
    ss_free(c->nodes);
    ss_free(c->leaves);
    ss_free(c);
}

/* ---- Four at once ---- */

static inline lanes choose(mask m, lanes a, lanes b) {
    return (lanes)(((mask)a & m) | ((mask)b & ~m));
}
static inline lanes lower(lanes a, lanes b) { return choose(a < b, a, b); }
static inline lanes higher(lanes a, lanes b) { return choose(a > b, a, b); }
static inline lanes clamp(lanes x) {
    const lanes zero = {0, 0, 0, 0}, one = {1, 1, 1, 1};
    return lower(higher(x, zero), one);
}
static inline lanes dot4(const lanes a[3], const lanes b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static lanes to_boxes(const boxes *b, const float p[3]) {
    lanes sum = {0, 0, 0, 0};
    const lanes zero = {0, 0, 0, 0};
    for (int k = 0; k < 3; k++) {
        const lanes out = higher(higher(b->low[k] - p[k], p[k] - b->high[k]), zero);
        sum += out * out;
    }
    return sum;
}

/* From w, relative to one end, to the segment along d. */
static inline lanes to_side(const lanes w[3], const lanes d[3], lanes along, lanes per_length2) {
    const lanes s = clamp(along * per_length2);
    const lanes r[3] = {w[0] - s * d[0], w[1] - s * d[1], w[2] - s * d[2]};
    return dot4(r, r);
}

/* Over the inside of a triangle its plane counts, else the nearest side. */
static lanes to_leaf(const leaf *l, const float p[3]) {
    lanes w[3], x[3], side[3];
    for (int k = 0; k < 3; k++) {
        w[k] = p[k] - l->a[k], x[k] = w[k] - l->u[k], side[k] = l->v[k] - l->u[k];
    }
    const lanes wu = dot4(w, l->u), wv = dot4(w, l->v), height = dot4(w, l->n);
    lanes best = to_side(w, l->u, wu, l->per_uu);
    best = lower(best, to_side(w, l->v, wv, l->per_vv));
    best = lower(best, to_side(x, side, dot4(x, side), l->per_side));
    const lanes s = l->vv * wu - l->uv * wv, t = l->uu * wv - l->uv * wu;
    const lanes zero = {0, 0, 0, 0};
    const mask inside = (s >= zero) & (t >= zero) & (s + t <= l->nn) & (l->nn > zero);
    return choose(inside, height * height / l->nn, best);
}

/* ---- One, in double ---- */

static double to_segment(const double a[3], const double ab[3]) { /* from the origin */
    const double length2 = ss_dot(ab, ab);
    double s = length2 > 0 ? -ss_dot(a, ab) / length2 : 0;
    s = s < 0 ? 0 : s > 1 ? 1 : s;
    double q[3];
    ss_add_scaled(a, s, ab, q);
    return ss_dot(q, q);
}

static double to_triangle(const ss_closest *c, uint32_t t, const float p[3]) {
    double a[3][3], side[3][3], n[3], best = INFINITY;
    bool inside = true;
    for (size_t i = 0; i < 3; i++) {
        const float *x = corner(c, t, i);
        for (int k = 0; k < 3; k++) a[i][k] = (double)x[k] - p[k];
    }
    for (int i = 0; i < 3; i++) ss_sub(a[(i + 1) % 3], a[i], side[i]);
    ss_cross(side[0], side[1], n);
    for (int i = 0; i < 3; i++) {
        double across[3];
        ss_cross(n, side[i], across);
        if (ss_dot(across, a[i]) > 0) inside = false;
        best = fmin(best, to_segment(a[i], side[i]));
    }
    const double size2 = ss_dot(n, n), height = ss_dot(n, a[0]);
    return inside && size2 > 0 ? height * height / size2 : best;
}

/* ---- Search ---- */

typedef struct visit {
    uint32_t node;
    uint32_t level;
    float distance2;
} visit;

/* Puts the children that may hold something nearer on the stack, the nearest on top. */
static visit *push_children(const ss_closest *c, visit at, const float p[3], float best,
                            visit *stack) {
    const lanes distance2 = to_boxes(&c->nodes[c->first[at.level] + at.node], p);
    visit *bottom = stack;
    for (uint32_t lane = 0; lane < WIDE; lane++) {
        if (!(distance2[lane] < best)) continue;
        visit *place = stack++;
        for (; place > bottom && place[-1].distance2 < distance2[lane]; place--) {
            place[0] = place[-1];
        }
        *place = (visit){WIDE * at.node + lane, at.level - 1, distance2[lane]};
    }
    return stack;
}

/* The nearest triangle if it is nearer than best2, else hint. */
static uint32_t nearest(const ss_closest *c, const float p[3], float best2, uint32_t hint) {
    visit stack[LEVELS * (WIDE - 1) + 1], *top = stack;
    *top++ = (visit){0, c->top, 0};
    while (top > stack) {
        const visit at = *--top;
        if (!(at.distance2 < best2)) continue;
        if (at.level > 0) {
            top = push_children(c, at, p, best2, top);
            continue;
        }
        const leaf *l = &c->leaves[at.node];
        const lanes distance2 = to_leaf(l, p);
        for (int lane = 0; lane < WIDE; lane++) {
            if (distance2[lane] < best2) best2 = distance2[lane], hint = l->triangle[lane];
        }
    }
    return hint;
}

double ss_closest_distance2(const ss_closest *c, const float p[3], double bound, uint32_t *hint) {
    if (*hint < c->count) bound = fmin(bound, to_triangle(c, *hint, p));
    const uint32_t found = nearest(c, p, (float)bound, SS_NO_HINT);
    if (found == SS_NO_HINT) return bound;
    *hint = found;
    return fmin(bound, to_triangle(c, found, p));
}
