/* Walks the hierarchy: nodes whose faces all face the light, or all turn away, hold no
 * silhouette. */
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/predicate.h"
#include "base/status.h"
#include "base/vec.h"
#include "silhouette/tree.h"

/* Rounding error of the plain determinant below, relative to its permanent: differences of floats
 * in double add 3 roundings to the exact predicate's (7 + 56 u) u. */
#define FILTER (16 * 0x1p-53)
#define MARGIN 1e-5 /* of a cosine: the nodes' floats are good to 1e-6 */
#define TASKS 64    /* subtrees worth handing out */

typedef struct finder {
    const ss_silhouette_tree *tree;
    const ss_world *world;
    const ss_topology *topology;
    ss_eye eye;
    double doubt; /* of normal . eye - offset: whatever is less may have either sign */
    uint32_t top;         /* level that tasks are taken from */
    ss_silhouette *parts; /* one a task, one more for free edges */
} finder;

ss_eye ss_eye_of(const ss_light *light) {
    ss_eye eye = {.w = light->type != SOFTSHADOW_SUN};
    memcpy(eye.place, eye.w ? light->centre : light->normal, sizeof eye.place);
    return eye;
}

static void vertex(const ss_world *world, size_t i, double out[3]) {
    for (int k = 0; k < 3; k++) out[k] = world->vertices[3 * (size_t)world->indices[i] + (size_t)k];
}

int ss_silhouette_sign(const ss_world *world, uint32_t t, const ss_eye *eye) {
    double a[3], b[3], c[3], e[3], f[3], d[3];
    vertex(world, 3 * (size_t)t, a), vertex(world, 3 * (size_t)t + 1, b);
    vertex(world, 3 * (size_t)t + 2, c);
    for (int k = 0; k < 3; k++) {
        e[k] = b[k] - a[k], f[k] = c[k] - a[k];
        d[k] = eye->w ? eye->place[k] - a[k] : eye->place[k];
    }
    double determinant = 0, permanent = 0;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const double p = e[i] * f[j], q = e[j] * f[i];
        determinant += (p - q) * d[k];
        permanent += (fabs(p) + fabs(q)) * fabs(d[k]);
    }
    if (permanent > 1e-280 && fabs(determinant) > FILTER * permanent)
        return determinant > 0 ? 1 : -1;
    const int exact = eye->w ? ss_orient3d(a, b, c, eye->place)
                             : ss_orient3d_towards(a, b, c, eye->place);
    return exact > 0 ? 1 : -1;
}

static int sign_of(const finder *f, uint32_t t) {
    const ss_silhouette_plane *plane = &f->tree->planes[t];
    double height = f->eye.w ? -(double)plane->offset : 0;
    for (int k = 0; k < 3; k++) height += (double)plane->normal[k] * f->eye.place[k];
    if (fabs(height) > f->doubt) return height > 0 ? 1 : -1;
    return ss_silhouette_sign(f->world, t, &f->eye);
}

/* A normal's numbers and the offset are rounded by 2^-25 of at most 1 and sqrt 3, in local
 * coordinates; more than twice that, for what doubles round: 4e-9 at most, by THIN in tree.c. */
static double doubt_of(const ss_eye *eye) {
    double square = 0;
    for (int k = 0; k < 3; k++) square += eye->place[k] * eye->place[k];
    return 0x1p-23 * (sqrt(square) + 2);
}

static bool append(ss_silhouette *list, size_t *room, const ss_silhouette_edge *edge) {
    if (list->count == *room) {
        const size_t wanted = *room ? 2 * *room : 64;
        ss_silhouette_edge *grown = ss_grow(list->edges, list->count, wanted, sizeof *grown);
        if (!grown) return false;
        list->edges = grown, *room = wanted;
    }
    list->edges[list->count++] = *edge;
    return true;
}

static bool append_edge(const finder *f, uint32_t e, int64_t sum, ss_silhouette *list,
                        size_t *room) {
    const ss_edge *edge = &f->topology->edges[e];
    if (sum == 0) return true;
    const bool forwards = sum > 0;
    const ss_silhouette_edge found = {{edge->vertex[!forwards], edge->vertex[forwards]}, e,
                                      (uint32_t)(forwards ? sum : -sum)};
    return append(list, room, &found);
}

static bool test_edge(const finder *f, uint32_t e, ss_silhouette *list, size_t *room) {
    const ss_edge *edge = &f->topology->edges[e];
    int64_t sum = 0;
    for (uint32_t i = edge[0].first_use; i < edge[1].first_use; i++) {
        const uint32_t use = f->topology->uses[i];
        sum += sign_of(f, ss_use_triangle(use)) * ss_use_sign(use);
    }
    return append_edge(f, e, sum, list, room);
}

/* Do all faces of the node face the same way? For any normal n of the cone and any x of the sphere,
 * |n . (eye - x)| >= |eye - centre| cos(angle to the axis + half opening) - radius. */
static bool uniform(const ss_silhouette_node *node, const ss_eye *eye) {
    if (!(node->angle < M_PI / 2)) return false;
    double to[3], along = 0, square = 0;
    for (int k = 0; k < 3; k++) {
        to[k] = eye->w ? eye->place[k] - node->centre[k] : eye->place[k];
        along += to[k] * node->axis[k], square += to[k] * to[k];
    }
    const double distance = sqrt(square), cosine = fabs(along) / distance;
    const double sine = sqrt(fmax(0, 1 - cosine * cosine));
    const double least = cosine * node->cosine - sine * node->sine - MARGIN;
    return least * distance > (eye->w ? node->radius : 0);
}

/* Everything below is far apart in memory, and most of the time would go by waiting for it: what a
 * family of leaves needs is asked for before any of it is used. */

typedef struct family {
    uint32_t leaf[SS_SILHOUETTE_FAN];
    uint32_t count;
} family;

static size_t leaf_end(const finder *f, size_t leaf) {
    const size_t end = (leaf + 1) * SS_SILHOUETTE_LEAF, all = f->tree->balanced_count;
    return end < all ? end : all;
}

static void ask_planes(const finder *f, size_t leaf) {
    for (size_t j = leaf * SS_SILHOUETTE_LEAF; j < leaf_end(f, leaf); j++) {
        const uint32_t *faces = f->tree->faces[j];
        if (faces[0] == SS_NO_TRIANGLE) continue;
        __builtin_prefetch(&f->tree->planes[faces[0]]);
        __builtin_prefetch(&f->tree->planes[faces[1]]);
    }
}

/* An edge, and twice the sign of the face that runs along it where that is one of two; 0: to be
 * tested. */
typedef struct candidate {
    uint32_t edge;
    int32_t sum;
} candidate;

/* The edges of a leaf that are not settled by two faces of the same sign. */
static size_t unsettled(const finder *f, size_t leaf, candidate *out) {
    size_t n = 0;
    for (size_t j = leaf * SS_SILHOUETTE_LEAF; j < leaf_end(f, leaf); j++) {
        const uint32_t *faces = f->tree->faces[j], e = f->tree->balanced[j];
        const int sign = faces[0] == SS_NO_TRIANGLE ? 0 : sign_of(f, faces[0]);
        if (sign != 0 && sign == sign_of(f, faces[1])) continue;
        __builtin_prefetch(&f->topology->edges[e]);
        out[n++] = (candidate){e, 2 * sign};
    }
    return n;
}

static bool test_family(const finder *f, const family *leaves, ss_silhouette *list, size_t *room) {
    candidate edges[SS_SILHOUETTE_FAN * SS_SILHOUETTE_LEAF];
    size_t n = 0;
    for (uint32_t i = 0; i < leaves->count; i++) ask_planes(f, leaves->leaf[i]);
    for (uint32_t i = 0; i < leaves->count; i++) n += unsettled(f, leaves->leaf[i], edges + n);
    for (size_t i = 0; i < n; i++) {
        const candidate *c = &edges[i];
        const bool fine = c->sum ? append_edge(f, c->edge, c->sum, list, room)
                                 : test_edge(f, c->edge, list, room);
        if (!fine) return false;
    }
    return true;
}

/* Of the leaves first .. end - 1 those that may hold a silhouette. */
static void find_family(const finder *f, size_t first, size_t end, family *out) {
    const ss_silhouette_tree *tree = f->tree;
    out->count = 0;
    for (size_t j = first; j < end; j++) {
        if (uniform(&tree->node[0][j], &f->eye)) continue;
        __builtin_prefetch(tree->faces[j * SS_SILHOUETTE_LEAF]);
        __builtin_prefetch(tree->faces[j * SS_SILHOUETTE_LEAF + SS_SILHOUETTE_LEAF / 2]);
        __builtin_prefetch(&tree->balanced[j * SS_SILHOUETTE_LEAF]);
        out->leaf[out->count++] = (uint32_t)j;
    }
}

static softshadow_status walk(const finder *f, uint32_t level, size_t i, ss_silhouette *list,
                              size_t *room) {
    const ss_silhouette_tree *tree = f->tree;
    const size_t fan = SS_SILHOUETTE_FAN, all = level ? tree->count[level - 1] : i + 1;
    const size_t first = level ? i * fan : i, end = first + fan < all ? first + fan : all;
    softshadow_status status = SOFTSHADOW_OK;
    family leaves;
    if (level && uniform(&tree->node[level][i], &f->eye)) return SOFTSHADOW_OK;
    for (size_t j = first; j < end && level > 1 && !status; j++) {
        status = walk(f, level - 1, j, list, room);
    }
    if (level > 1) return status;
    find_family(f, first, end, &leaves);
    if (test_family(f, &leaves, list, room)) return SOFTSHADOW_OK;
    return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu silhouette edges", *room);
}

static softshadow_status find_parts(void *ctx, uint64_t begin, uint64_t end) {
    finder *f = ctx;
    for (uint64_t i = begin; i < end; i++) {
        size_t room = 0;
        const softshadow_status status = walk(f, f->top, i, &f->parts[i], &room);
        if (status) return status;
    }
    return SOFTSHADOW_OK;
}

static softshadow_status find_free(finder *f, ss_silhouette *list) {
    size_t room = 0;
    for (size_t i = 0; i < f->tree->free_count; i++) {
        if (test_edge(f, f->tree->free_edges[i], list, &room)) continue;
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu silhouette edges", room);
    }
    return SOFTSHADOW_OK;
}

static softshadow_status join(ss_silhouette *out, const ss_silhouette *parts, size_t n) {
    size_t count = 0;
    for (size_t i = 0; i < n; i++) count += parts[i].count;
    out->edges = ss_alloc(count, sizeof *out->edges);
    if (!out->edges)
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu silhouette edges", count);
    for (size_t i = 0; i < n; i++) {
        if (parts[i].count == 0) continue;
        memcpy(out->edges + out->count, parts[i].edges, parts[i].count * sizeof *out->edges);
        out->count += parts[i].count;
    }
    return SOFTSHADOW_OK;
}

softshadow_status ss_silhouette_find(ss_silhouette *out, const ss_silhouette_tree *tree,
                                     const ss_world *world, const ss_topology *topology,
                                     const ss_eye *eye, ss_pool *pool) {
    *out = (ss_silhouette){0};
    finder f = {
        .tree = tree, .world = world, .topology = topology, .eye = *eye, .doubt = doubt_of(eye)};
    f.top = tree->levels ? tree->levels - 1 : 0;
    while (f.top > 0 && tree->count[f.top] < TASKS) f.top--;
    const size_t tasks = tree->levels ? tree->count[f.top] : 0;
    f.parts = ss_alloc(tasks + 1, sizeof *f.parts);
    softshadow_status status = SOFTSHADOW_OK;
    if (!f.parts) status = ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for silhouettes");
    if (!status) status = ss_parallel_for(pool, tasks, 1, find_parts, &f);
    if (!status) status = find_free(&f, &f.parts[tasks]);
    if (!status) status = join(out, f.parts, tasks + 1);
    for (size_t i = 0; f.parts && i <= tasks; i++) ss_free(f.parts[i].edges);
    ss_free(f.parts);
    return status;
}

static size_t count_tested(const ss_silhouette_tree *tree, uint32_t level, size_t i,
                           const ss_eye *eye) {
    if (uniform(&tree->node[level][i], eye)) return 0;
    const size_t fan = level ? SS_SILHOUETTE_FAN : SS_SILHOUETTE_LEAF;
    const size_t all = level ? tree->count[level - 1] : tree->balanced_count;
    const size_t end = (i + 1) * fan < all ? (i + 1) * fan : all;
    size_t sum = 0;
    for (size_t j = i * fan; j < end && level; j++) sum += count_tested(tree, level - 1, j, eye);
    return level ? sum : end - i * fan;
}

size_t ss_silhouette_tested(const ss_silhouette_tree *tree, const ss_eye *eye) {
    size_t sum = tree->free_count;
    const uint32_t top = tree->levels ? tree->levels - 1 : 0;
    for (size_t i = 0; tree->levels && i < tree->count[top]; i++)
        sum += count_tested(tree, top, i, eye);
    return sum;
}

void ss_silhouette_free(ss_silhouette *silhouette) {
    ss_free(silhouette->edges);
    *silhouette = (ss_silhouette){0};
}
