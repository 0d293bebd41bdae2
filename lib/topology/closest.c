/* A complete binary tree of boxes over triangles in Morton order. The children of node i are 2i and
 * 2i + 1, so there is nothing to link and little to build. */
#include "topology/closest.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"
#include "base/vec.h"

#define LEAF  4 /* triangles */
#define DEPTH 32

typedef struct box {
    float low[3], high[3];
} box;

struct ss_closest {
    const float *vertices;
    const uint32_t *triangles;
    uint32_t *order; /* triangles along the Morton curve */
    size_t count, leaves;
    box *boxes; /* 2 x leaves; 1 is the root */
};

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

static void fit_boxes(ss_closest *c) {
    for (size_t i = 0; i < 2 * c->leaves; i++) c->boxes[i] = nothing;
    for (size_t i = 0; i < c->count; i++) {
        for (size_t k = 0; k < 3; k++) {
            grow(&c->boxes[c->leaves + i / LEAF], corner(c, c->order[i], k));
        }
    }
    for (size_t i = c->leaves - 1; i > 0; i--) {
        for (size_t side = 0; side < 2; side++) {
            if (c->boxes[2 * i + side].low[0] > c->boxes[2 * i + side].high[0])
                continue; /* empty */
            grow(&c->boxes[i], c->boxes[2 * i + side].low);
            grow(&c->boxes[i], c->boxes[2 * i + side].high);
        }
    }
}

softshadow_status ss_closest_create(ss_closest **out, const float *vertices,
                                    const uint32_t *triangles, size_t triangle_count) {
    *out = NULL;
    ss_closest *c = ss_alloc(1, sizeof *c);
    if (c) {
        *c = (ss_closest){.vertices = vertices, .triangles = triangles, .count = triangle_count};
        for (c->leaves = 1; c->leaves * LEAF < triangle_count;) c->leaves *= 2;
        c->order = ss_alloc(triangle_count, sizeof *c->order);
        c->boxes = ss_alloc(2 * c->leaves, sizeof *c->boxes);
    }
    if (!c || !c->order || !c->boxes || !sort_triangles(c)) {
        ss_closest_destroy(c);
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for distances to %zu triangles",
                       triangle_count);
    }
    fit_boxes(c);
    *out = c;
    return SOFTSHADOW_OK;
}

void ss_closest_destroy(ss_closest *c) {
    if (!c) return;
    ss_free(c->order);
    ss_free(c->boxes);
    ss_free(c);
}

static float to_box(const box *b, const float p[3]) {
    float sum = 0;
    for (int k = 0; k < 3; k++) {
        const float under = b->low[k] - p[k], over = p[k] - b->high[k];
        const float out = under > over ? under : over;
        sum += out > 0 ? out * out : 0;
    }
    return sum;
}

static double to_segment(const double a[3], const double ab[3]) { /* from the origin */
    const double length2 = ss_dot(ab, ab);
    double s = length2 > 0 ? -ss_dot(a, ab) / length2 : 0;
    s = s < 0 ? 0 : s > 1 ? 1 : s;
    double q[3];
    ss_add_scaled(a, s, ab, q);
    return ss_dot(q, q);
}

/* The smaller of best and the squared distance. Over the inside of the triangle its plane counts,
 * else the nearest of those sides that p lies beyond (the nearest corner is an end of one). */
static double to_triangle(const ss_closest *c, uint32_t t, const float p[3], double best) {
    double a[3][3], side[3][3], n[3];
    for (size_t i = 0; i < 3; i++) {
        const float *x = corner(c, t, i);
        for (int k = 0; k < 3; k++) a[i][k] = (double)x[k] - p[k];
    }
    for (int i = 0; i < 3; i++) ss_sub(a[(i + 1) % 3], a[i], side[i]);
    ss_cross(side[0], side[1], n);
    const double size2 = ss_dot(n, n), height = ss_dot(n, a[0]);
    if (size2 > 0 && height * height >= best * size2) return best;
    bool inside = size2 > 0;
    for (int i = 0; i < 3; i++) {
        double across[3];
        ss_cross(n, side[i], across);
        if (size2 > 0 && ss_dot(across, a[i]) <= 0) continue;
        const double distance2 = to_segment(a[i], side[i]);
        if (distance2 < best) best = distance2;
        inside = false;
    }
    return inside ? height * height / size2 : best;
}

/* Boxes are compared in float: so much may its rounding have added. */
#define BOX_ROUNDING (1 - 0x1p-20f)

double ss_closest_distance2(const ss_closest *c, const float p[3], double best, uint32_t *hint) {
    struct {
        size_t node;
        float distance2;
    } stack[DEPTH + 1];
    size_t depth = 0;
    if (*hint < c->count) best = to_triangle(c, *hint, p, best);
    stack[depth].node = 1, stack[depth++].distance2 = 0;
    while (depth) {
        const size_t node = stack[--depth].node;
        if (!((double)(stack[depth].distance2 * BOX_ROUNDING) < best)) continue;
        if (node >= c->leaves) {
            const size_t first = (node - c->leaves) * LEAF;
            for (size_t i = first; i < c->count && i < first + LEAF; i++) {
                const double distance2 = to_triangle(c, c->order[i], p, best);
                if (distance2 < best) best = distance2, *hint = c->order[i];
            }
            continue;
        }
        const float left = to_box(&c->boxes[2 * node], p),
                    right = to_box(&c->boxes[2 * node + 1], p);
        const size_t far = right > left; /* the far one is pushed first */
        stack[depth].node = 2 * node + far, stack[depth++].distance2 = far ? right : left;
        stack[depth].node = 2 * node + !far, stack[depth++].distance2 = far ? left : right;
    }
    return best;
}
