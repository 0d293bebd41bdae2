/* Building the wide BVH: a binary tree by binned surface area, its top serially, the subtrees below
 * in parallel, then sixteen children at a time are pulled up into one node. Which subtrees there
 * are depends on the triangles alone, so any number of threads gives the same tree.
 *
 * based on: binned SAH (Wald 2007), collapsing by largest area (Dammertz et al. 2008). */
#include <math.h>
#include <string.h>

#include "base/status.h"
#include "trace/bvh_node.h"

#define BINS 16
#define SERIAL_DEPTH 64 /* deeper than this, halves: adversarial soup must not build a list */
#define SUBTREE 8192    /* ranges up to this are one task */

/* A triangle's box. Boxes are moved about, not pointers to them: partitions then run through
 * memory. */
typedef struct primitive {
    float low[3];
    uint32_t triangle;
    float high[3];
    uint32_t unused;
} primitive;

typedef struct binary {
    float low[3], high[3];
    uint32_t begin, end;
    uint32_t left; /* its sibling follows; 0: a leaf */
    uint32_t depth;
} binary;

typedef struct bin {
    float low[3], high[3];
    uint32_t count;
} bin;

typedef struct builder {
    const ss_world *world;
    primitive *primitives;
    binary *tree;    /* the root, room for the top, then 2 slots a triangle for the subtrees */
    uint32_t base;   /* where the slots of the subtrees begin */
    uint32_t *tasks; /* tree slots of subtree roots */
    uint32_t task_count;
    ss_bvh *bvh;
} builder;

static void empty_box(float low[3], float high[3]) {
    for (int k = 0; k < 3; k++) low[k] = INFINITY, high[k] = -INFINITY;
}
static inline void include(float low[3], float high[3], const float l[3], const float h[3]) {
    for (int k = 0; k < 3; k++) {
        low[k] = l[k] < low[k] ? l[k] : low[k];
        high[k] = h[k] > high[k] ? h[k] : high[k];
    }
}
static float half_area(const float low[3], const float high[3]) {
    const float x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
    return x * y + y * z + z * x;
}

static softshadow_status measure(void *ctx, uint64_t begin, uint64_t end) {
    builder *b = ctx;
    for (uint64_t t = begin; t < end; t++) {
        primitive *out = &b->primitives[t];
        empty_box(out->low, out->high);
        for (int c = 0; c < 3; c++) {
            const float *v = b->world->vertices + 3 * (size_t)b->world->indices[3 * t + c];
            include(out->low, out->high, v, v);
        }
        out->triangle = (uint32_t)t;
    }
    return SOFTSHADOW_OK;
}

/* Where a range is cut: primitives whose bin along the axis is below `at` go left. */
typedef struct cut {
    int axis, at;
    float origin[3], scale[3];
    float cost;
} cut;

static inline int bin_of(const cut *c, const primitive *p, int axis) {
    const int i = (int)((p->low[axis] + p->high[axis] - c->origin[axis]) * c->scale[axis]);
    return i < 0 ? 0 : i > BINS - 1 ? BINS - 1 : i;
}

/* Leaves are tested sixteen triangles at once, but half-filled ones cull better: count in fours. */
static float blocks(uint32_t count) { return (float)((count + 3) / 4); }

static void best_on_axis(cut *c, int axis, const bin bins[BINS]) {
    float low[3], high[3], area[BINS];
    uint32_t right[BINS], count = 0;
    empty_box(low, high);
    for (int i = BINS - 1; i > 0; i--) {
        include(low, high, bins[i].low, bins[i].high);
        count += bins[i].count;
        right[i] = count;
        area[i] = count ? half_area(low, high) : 0;
    }
    empty_box(low, high);
    count = 0;
    for (int i = 1; i < BINS; i++) {
        include(low, high, bins[i - 1].low, bins[i - 1].high);
        count += bins[i - 1].count;
        if (count == 0 || right[i] == 0) continue;
        const float cost = half_area(low, high) * blocks(count) + area[i] * blocks(right[i]);
        if (cost < c->cost) c->cost = cost, c->axis = axis, c->at = i;
    }
}

static void find_cut(const primitive *p, uint32_t begin, uint32_t end, cut *c) {
    float low[3], high[3];
    empty_box(low, high);
    for (uint32_t i = begin; i < end; i++) {
        float middle[3];
        for (int k = 0; k < 3; k++) middle[k] = p[i].low[k] + p[i].high[k];
        include(low, high, middle, middle);
    }
    c->axis = -1, c->at = 0, c->cost = INFINITY;
    for (int k = 0; k < 3; k++) {
        c->origin[k] = low[k];
        c->scale[k] = BINS * 0.9999f / (high[k] - low[k]);
        if (!isfinite(c->scale[k])) c->scale[k] = 0;
    }
    bin bins[3][BINS];
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < BINS; i++) {
            empty_box(bins[k][i].low, bins[k][i].high);
            bins[k][i].count = 0;
        }
    }
    for (uint32_t i = begin; i < end; i++) {
        for (int k = 0; k < 3; k++) {
            bin *into = &bins[k][bin_of(c, &p[i], k)];
            include(into->low, into->high, p[i].low, p[i].high);
            into->count++;
        }
    }
    for (int k = 0; k < 3; k++) best_on_axis(c, k, bins[k]);
}

static uint32_t partition(primitive *p, uint32_t begin, uint32_t end, const cut *c) {
    uint32_t i = begin, j = end;
    for (;;) {
        while (i < j && bin_of(c, &p[i], c->axis) < c->at) i++;
        while (i < j && bin_of(c, &p[j - 1], c->axis) >= c->at) j--;
        if (i >= j) return i;
        const primitive swap = p[i];
        p[i] = p[j - 1];
        p[j - 1] = swap;
    }
}

static void bound(binary *node, const primitive *p) {
    empty_box(node->low, node->high);
    for (uint32_t i = node->begin; i < node->end; i++) {
        include(node->low, node->high, p[i].low, p[i].high);
    }
}

/* Gives the node two children in the next two slots. */
static void split(builder *b, uint32_t at, uint32_t *slots) {
    binary *node = &b->tree[at];
    uint32_t middle = node->begin + (node->end - node->begin) / 2;
    if (node->depth < SERIAL_DEPTH) {
        cut c;
        find_cut(b->primitives, node->begin, node->end, &c);
        if (c.axis >= 0) middle = partition(b->primitives, node->begin, node->end, &c);
    }
    node->left = *slots;
    *slots += 2;
    for (int side = 0; side < 2; side++) {
        binary *child = &b->tree[node->left + side];
        *child = (binary){.begin = side ? middle : node->begin,
                          .end = side ? node->end : middle,
                          .depth = node->depth + 1};
        bound(child, b->primitives);
    }
}

/* Splits everything below a slot until ranges are at most `most`; lists those, if asked. */
static void split_all(builder *b, uint32_t root, uint32_t most, uint32_t *slots, uint32_t *found,
                      uint32_t *found_count) {
    uint32_t stack[SS_BVH_DEPTH + 2];
    int depth = 0;
    stack[depth++] = root;
    while (depth) {
        const uint32_t at = stack[--depth];
        const binary *node = &b->tree[at];
        if (node->end - node->begin <= most) {
            if (found) found[(*found_count)++] = at;
            continue;
        }
        split(b, at, slots);
        stack[depth++] = b->tree[at].left + 1;
        stack[depth++] = b->tree[at].left;
    }
}

static softshadow_status build_subtrees(void *ctx, uint64_t begin, uint64_t end) {
    builder *b = ctx;
    for (uint64_t i = begin; i < end; i++) {
        const uint32_t root = b->tasks[i];
        uint32_t slots = b->base + 2 * b->tree[root].begin;
        split_all(b, root, SS_BVH_WIDTH, &slots, NULL, NULL);
    }
    return SOFTSHADOW_OK;
}

/* The up to sixteen descendants that one wide node takes, largest box opened first. */
static uint32_t pull_up(const builder *b, uint32_t root, uint32_t children[SS_BVH_WIDTH]) {
    uint32_t count = 1;
    children[0] = root;
    while (count < SS_BVH_WIDTH) {
        int widest = -1;
        float area = -1;
        for (uint32_t i = 0; i < count; i++) {
            const binary *node = &b->tree[children[i]];
            const float a = node->left ? half_area(node->low, node->high) : -1;
            if (a > area) area = a, widest = (int)i;
        }
        if (widest < 0) break;
        const uint32_t left = b->tree[children[widest]].left;
        children[widest] = left;
        children[count++] = left + 1;
    }
    return count;
}

static void fill_child(ss_bvh_node *node, uint32_t slot, const binary *from) {
    for (int k = 0; k < 3; k++) {
        node->low[k][slot] = from->low[k];
        node->high[k][slot] = from->high[k];
    }
    node->first[slot] = from->begin;
    node->last[slot] = from->end;
}

static bool add_node(ss_bvh *bvh, uint32_t *room) {
    if (bvh->node_count == *room) {
        const uint32_t more = *room ? *room * 2 : 64;
        ss_bvh_node *grown = ss_grow(bvh->nodes, *room, more, sizeof *grown);
        if (!grown) return false;
        bvh->nodes = grown;
        *room = more;
    }
    ss_bvh_node *node = &bvh->nodes[bvh->node_count++];
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < SS_BVH_WIDTH; i++)
            node->low[k][i] = INFINITY, node->high[k][i] = -INFINITY;
    }
    return true;
}

/* Depth first, so that what lies together in space lies together in memory. */
static bool collapse(builder *b) {
    ss_bvh *bvh = b->bvh;
    struct {
        uint32_t binary, node, slot;
    } stack[SS_BVH_STACK];
    uint32_t room = 0, depth = 0;
    if (!add_node(bvh, &room)) return false;
    if (b->world->triangle_count == 0) return true;
    uint32_t root = 0, into = 0;
    for (;;) {
        uint32_t children[SS_BVH_WIDTH];
        const uint32_t count = pull_up(b, root, children);
        bvh->nodes[into].count = count;
        for (uint32_t i = count; i-- > 0;) {
            const binary *child = &b->tree[children[i]];
            fill_child(&bvh->nodes[into], i, child);
            if (child->left) {
                stack[depth].binary = children[i], stack[depth].node = into,
                stack[depth++].slot = i;
            } else {
                bvh->nodes[into].child[i] = SS_BVH_LEAF | bvh->leaf_count++;
            }
        }
        if (depth == 0) return true;
        depth--;
        if (!add_node(bvh, &room)) return false;
        root = stack[depth].binary, into = bvh->node_count - 1;
        bvh->nodes[stack[depth].node].child[stack[depth].slot] = into;
    }
}

static void fill_leaf(const builder *b, ss_bvh_leaf *leaf, uint32_t first, uint32_t last) {
    leaf->first = first;
    leaf->count = last - first;
    for (uint32_t s = 0; s < SS_BVH_WIDTH; s++) {
        const uint32_t t = b->bvh->order[first + (s < leaf->count ? s : 0)];
        leaf->triangle[s] = t;
        for (int c = 0; c < 3; c++) {
            const float *v = b->world->vertices + 3 * (size_t)b->world->indices[3 * (size_t)t + c];
            for (int k = 0; k < 3; k++) leaf->corner[c][k][s] = v[k];
        }
    }
}

static softshadow_status fill_leaves(void *ctx, uint64_t begin, uint64_t end) {
    builder *b = ctx;
    for (uint64_t n = begin; n < end; n++) {
        const ss_bvh_node *node = &b->bvh->nodes[n];
        for (uint32_t i = 0; i < node->count; i++) {
            for (uint32_t j = node->first[i]; j < node->last[i]; j++) {
                if (!(node->child[i] & SS_BVH_LEAF)) break;
                b->bvh->order[j] = b->primitives[j].triangle;
            }
            if (!(node->child[i] & SS_BVH_LEAF)) continue;
            fill_leaf(b, &b->bvh->leaves[node->child[i] & ~SS_BVH_LEAF], node->first[i],
                      node->last[i]);
        }
    }
    return SOFTSHADOW_OK;
}

/* Children come after their parents. */
static void find_least(ss_bvh *bvh) {
    for (uint32_t n = bvh->node_count; n-- > 0;) {
        ss_bvh_node *node = &bvh->nodes[n];
        node->least = UINT32_MAX;
        for (uint32_t i = 0; i < node->count; i++) {
            const bool leaf = node->child[i] & SS_BVH_LEAF;
            uint32_t least = leaf ? UINT32_MAX : bvh->nodes[node->child[i]].least;
            for (uint32_t j = node->first[i]; leaf && j < node->last[i]; j++)
                least = bvh->order[j] < least ? bvh->order[j] : least;
            node->least = least < node->least ? least : node->least;
        }
    }
}

static bool allocate(builder *b) {
    const size_t n = b->world->triangle_count;
    /* Ranges at one depth are disjoint, so a depth of the top has at most n / SUBTREE inner
     * nodes. */
    const size_t tops = 2 * SS_BVH_DEPTH * (n / SUBTREE + 1);
    b->primitives = ss_alloc(n, sizeof *b->primitives);
    b->tree = ss_alloc(2 * n + tops + 2, sizeof *b->tree);
    b->tasks = ss_alloc(tops + 2, sizeof *b->tasks);
    b->bvh->order = ss_alloc(n, sizeof *b->bvh->order);
    b->base = (uint32_t)tops + 2;
    return b->primitives && b->tree && b->tasks && b->bvh->order;
}

static softshadow_status run(builder *b, ss_pool *pool, ss_progress *progress) {
    const uint32_t n = (uint32_t)b->world->triangle_count;
    softshadow_status status = ss_parallel_for(pool, n, 4096, measure, b);
    if (status != SOFTSHADOW_OK) return status;
    b->tree[0] = (binary){.end = n};
    bound(&b->tree[0], b->primitives);
    uint32_t slots = 1;
    split_all(b, 0, SUBTREE, &slots, b->tasks, &b->task_count);
    status = ss_progress_add(progress, 0);
    if (status == SOFTSHADOW_OK) {
        status = ss_parallel_for(pool, b->task_count, 1, build_subtrees, b);
    }
    if (status != SOFTSHADOW_OK) return status;
    if (!collapse(b)) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %u BVH nodes", n);
    b->bvh->leaves = ss_alloc(b->bvh->leaf_count, sizeof *b->bvh->leaves);
    if (!b->bvh->leaves) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for BVH leaves");
    status = ss_parallel_for(pool, b->bvh->node_count, 64, fill_leaves, b);
    if (status == SOFTSHADOW_OK) find_least(b->bvh);
    return status;
}

softshadow_status ss_bvh_build(ss_bvh **out, const ss_world *world, ss_pool *pool,
                               ss_progress *progress) {
    *out = NULL;
    if (world->triangle_count > UINT32_MAX / 4) {
        return ss_fail(SOFTSHADOW_E_MESH, "triangles: %zu casters, at most %u are allowed",
                       world->triangle_count, UINT32_MAX / 4);
    }
    builder b = {.world = world, .bvh = ss_alloc(1, sizeof *b.bvh)};
    softshadow_status status = SOFTSHADOW_E_MEMORY;
    if (b.bvh) b.bvh->world = world;
    if (!b.bvh || !allocate(&b)) {
        ss_fail(status, "out of memory for a BVH of %zu triangles", world->triangle_count);
    } else {
        status = run(&b, pool, progress);
    }
    ss_free(b.primitives);
    ss_free(b.tree);
    ss_free(b.tasks);
    if (status == SOFTSHADOW_OK) *out = b.bvh;
    else ss_bvh_destroy(b.bvh);
    return status;
}
