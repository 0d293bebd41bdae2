/* The edge table by a counting sort: uses are scattered to the lower vertex of their edge, then
 * each vertex sorts its few. Vertices are independent, so that part runs in parallel; scattering in
 * triangle order and sorting by distinct keys make the result the same on any number of threads. */
#include "topology/edges.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"

#define GRAIN 16384 /* vertices a task: about a millisecond */

/* upper vertex << 32 | use: sorting these gives edges and, within them, triangles in order. */
typedef uint64_t entry;

typedef struct builder {
    ss_topology *out;
    const ss_corners *corners;
    ss_pool *pool;
    entry *entries;
    uint32_t *first;      /* per vertex: its entries, vertex_count + 1 */
    uint32_t *first_edge; /* likewise its edges */
} builder;

static uint32_t low_of(uint32_t a, uint32_t b) { return a < b ? a : b; }
static uint32_t high_of(uint32_t a, uint32_t b) { return a < b ? b : a; }

/* Turns counts, kept one place further on, into places; gives the total. */
static void sum_up(uint32_t *first, size_t count) {
    for (size_t i = 0; i < count; i++) first[i + 1] += first[i];
}

static void count_uses(builder *b) {
    for (size_t t = 0; t < b->corners->triangle_count; t++) {
        uint32_t c[3];
        ss_corners_of(b->corners, t, c);
        if (ss_corners_degenerate(c)) continue;
        for (int k = 0; k < 3; k++) b->first[low_of(c[k], c[(k + 1) % 3]) + 1u]++;
    }
    sum_up(b->first, b->corners->vertex_count);
}

/* Moves every vertex's start up to its end; restore() undoes that. */
static void scatter_uses(builder *b) {
    for (size_t t = 0; t < b->corners->triangle_count; t++) {
        uint32_t c[3];
        ss_corners_of(b->corners, t, c);
        if (ss_corners_degenerate(c)) continue;
        for (int k = 0; k < 3; k++) {
            const uint32_t from = c[k], to = c[(k + 1) % 3];
            const uint32_t use = (uint32_t)(t << 1) | (from > to);
            b->entries[b->first[low_of(from, to)]++] = (entry)high_of(from, to) << 32 | use;
        }
    }
}

static void restore(uint32_t *first, size_t count) {
    memmove(first + 1, first, count * sizeof *first);
    first[0] = 0;
}

static int compare_entries(const void *a, const void *b) {
    const entry x = *(const entry *)a, y = *(const entry *)b;
    return (x > y) - (x < y);
}

static void sort_entries(entry *entries, size_t n) {
    if (n > 32) { /* the hub of a large fan */
        qsort(entries, n, sizeof *entries, compare_entries);
        return;
    }
    for (size_t i = 1; i < n; i++) {
        const entry moved = entries[i];
        size_t j = i;
        for (; j > 0 && entries[j - 1] > moved; j--) entries[j] = entries[j - 1];
        entries[j] = moved;
    }
}

static softshadow_status sort_vertices(void *ctx, uint64_t begin, uint64_t end) {
    builder *b = ctx;
    for (uint64_t v = begin; v < end; v++) {
        entry *entries = b->entries + b->first[v];
        const uint32_t n = b->first[v + 1] - b->first[v];
        sort_entries(entries, n);
        uint32_t edges = n > 0;
        for (uint32_t i = 1; i < n; i++) edges += entries[i] >> 32 != entries[i - 1] >> 32;
        b->first_edge[v + 1] = edges;
    }
    return SOFTSHADOW_OK;
}

/* Which side of its triangle a use is: the corner it starts from. */
static uint32_t side_of(const ss_corners *corners, uint32_t use, uint32_t low, uint32_t high) {
    uint32_t c[3];
    ss_corners_of(corners, ss_use_triangle(use), c);
    const uint32_t from = use & 1 ? high : low;
    return c[0] == from ? 0 : c[1] == from ? 1 : 2;
}

static softshadow_status write_edges(void *ctx, uint64_t begin, uint64_t end) {
    builder *b = ctx;
    for (uint64_t v = begin; v < end; v++) {
        uint32_t e = b->first_edge[v];
        for (uint32_t i = b->first[v]; i < b->first[v + 1]; i++) {
            const uint32_t high = (uint32_t)(b->entries[i] >> 32), use = (uint32_t)b->entries[i];
            if (i == b->first[v] || high != b->out->edges[e - 1].vertex[1]) {
                b->out->edges[e++] = (ss_edge){{(uint32_t)v, high}, i};
            }
            b->out->uses[i] = use;
            const size_t t = ss_use_triangle(use);
            b->out->triangle_edges[3 * t + side_of(b->corners, use, (uint32_t)v, high)] = e - 1;
        }
    }
    return SOFTSHADOW_OK;
}

static softshadow_status over_vertices(builder *b, ss_body *body) {
    const uint64_t n = b->corners->vertex_count;
    return b->pool ? ss_parallel_for(b->pool, n, GRAIN, body, b) : body(b, 0, n);
}

static softshadow_status no_memory(const builder *b) {
    return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for the edges of %zu triangles",
                   b->corners->triangle_count);
}

static softshadow_status sort_uses(builder *b) {
    const size_t vertices = b->corners->vertex_count;
    b->first = ss_alloc(vertices + 1, sizeof *b->first);
    b->first_edge = ss_alloc(vertices + 1, sizeof *b->first_edge);
    if (!b->first || !b->first_edge) return no_memory(b);
    count_uses(b);
    b->out->use_count = b->first[vertices];
    b->entries = ss_alloc(b->out->use_count, sizeof *b->entries);
    if (!b->entries) return no_memory(b);
    scatter_uses(b);
    restore(b->first, vertices);
    return over_vertices(b, sort_vertices);
}

static softshadow_status write_table(builder *b) {
    ss_topology *out = b->out;
    sum_up(b->first_edge, b->corners->vertex_count);
    out->edge_count = b->first_edge[b->corners->vertex_count];
    out->edges = ss_alloc(out->edge_count + 1, sizeof *out->edges);
    out->uses = ss_alloc(out->use_count, sizeof *out->uses);
    out->triangle_edges = ss_alloc(3 * out->triangle_count, sizeof *out->triangle_edges);
    if (!out->edges || !out->uses || !out->triangle_edges) return no_memory(b);
    memset(out->triangle_edges, 0xff, 3 * out->triangle_count * sizeof *out->triangle_edges);
    out->edges[out->edge_count] = (ss_edge){{UINT32_MAX, UINT32_MAX}, (uint32_t)out->use_count};
    return over_vertices(b, write_edges);
}

softshadow_status ss_edges_build(ss_topology *out, const ss_corners *corners, ss_pool *pool) {
    out->vertex_count = corners->vertex_count, out->triangle_count = corners->triangle_count;
    if (corners->triangle_count > UINT32_MAX / 3) {
        return ss_fail(SOFTSHADOW_E_UNSUPPORTED, "triangles: %zu, at most %u",
                       corners->triangle_count, UINT32_MAX / 3);
    }
    builder b = {.out = out, .corners = corners, .pool = pool};
    softshadow_status status = sort_uses(&b);
    if (status == SOFTSHADOW_OK) status = write_table(&b);
    ss_free(b.entries);
    ss_free(b.first);
    ss_free(b.first_edge);
    return status;
}

void ss_edges_free(ss_topology *topology) {
    ss_free(topology->weld);
    ss_free(topology->edges);
    ss_free(topology->uses);
    ss_free(topology->triangle_edges);
    ss_free(topology->triangle_component);
    ss_free(topology->components);
    ss_free(topology->triangle_solid);
    ss_free(topology->solids);
}
