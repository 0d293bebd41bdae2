/* Finding fins: triangles are put to their lowest corner, where each has few others to look at. */
#include "topology/fins.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"

/* A triangle at its lowest corner: its two other corners, low << 32 | high, and which way round. */
typedef struct entry {
    uint64_t others;
    uint32_t triangle, against;
} entry;

static uint32_t lowest(const uint32_t c[3]) {
    const uint32_t low = c[0] < c[1] ? c[0] : c[1];
    return low < c[2] ? low : c[2];
}

static entry entry_of(const uint32_t c[3], uint32_t triangle) {
    const int at = c[0] == lowest(c) ? 0 : c[1] == lowest(c) ? 1 : 2;
    const uint32_t one = c[(at + 1) % 3], two = c[(at + 2) % 3];
    const uint64_t low = one < two ? one : two, high = one < two ? two : one;
    return (entry){low << 32 | high, triangle, one > two};
}

static int compare(const void *a, const void *b) {
    const entry *x = a, *y = b;
    if (x->others != y->others) return x->others < y->others ? -1 : 1;
    return x->triangle < y->triangle ? -1 : 1;
}

static void sort_entries(entry *entries, size_t n) {
    if (n > 32) { /* the hub of a large fan */
        qsort(entries, n, sizeof *entries, compare);
        return;
    }
    for (size_t i = 1; i < n; i++) {
        const entry moved = entries[i];
        size_t j = i;
        for (; j > 0 && compare(&entries[j - 1], &moved) > 0; j--) entries[j] = entries[j - 1];
        entries[j] = moved;
    }
}

/* Among triangles with the same corners. */
static void mark_pairs(const entry *entries, size_t n, bool *fin) {
    size_t against = 0;
    for (size_t i = 0; i < n; i++) against += entries[i].against;
    const size_t pairs = against < n - against ? against : n - against;
    size_t left[2] = {pairs, pairs};
    for (size_t i = 0; i < n; i++) {
        if (left[entries[i].against] == 0) continue;
        left[entries[i].against]--;
        fin[entries[i].triangle] = true;
    }
}

static void mark_fins(const uint32_t *triangles, size_t count, uint32_t *first, size_t vertices,
                      entry *entries, bool *fin) {
    for (size_t t = 0; t < count; t++) first[lowest(triangles + 3 * t) + 1]++;
    for (size_t v = 0; v < vertices; v++) first[v + 1] += first[v];
    for (uint32_t t = 0; t < count; t++) {
        const uint32_t *c = triangles + 3 * (size_t)t;
        entries[first[lowest(c)]++] = entry_of(c, t);
    }
    for (size_t v = 0; v < vertices; v++) { /* each first is now the next one's */
        const size_t begin = v ? first[v - 1] : 0, end = first[v];
        sort_entries(entries + begin, end - begin);
        for (size_t i = begin, j; i < end; i = j) {
            for (j = i + 1; j < end && entries[j].others == entries[i].others;) j++;
            mark_pairs(entries + i, j - i, fin);
        }
    }
}

static void move_fins(uint32_t *triangles, size_t count, const bool *fin, uint32_t *moved,
                      size_t *others) {
    size_t fins = 0;
    *others = 0;
    for (size_t t = 0; t < count; t++) {
        uint32_t *to = fin[t] ? moved + 3 * fins++ : triangles + 3 * (*others)++;
        memmove(to, triangles + 3 * t, sizeof(uint32_t[3]));
    }
    memcpy(triangles + 3 * *others, moved, fins * sizeof(uint32_t[3]));
}

softshadow_status ss_fins_last(uint32_t *triangles, size_t count, size_t vertex_count,
                               size_t *others) {
    uint32_t *first = ss_alloc(vertex_count + 1, sizeof *first);
    entry *entries = ss_alloc(count, sizeof *entries);
    bool *fin = ss_alloc(count, sizeof *fin);
    const bool fine = first && entries && fin;
    if (fine) {
        mark_fins(triangles, count, first, vertex_count, entries, fin);
        /* An entry is larger than a triangle. */
        move_fins(triangles, count, fin, (uint32_t *)(void *)entries, others);
    }
    ss_free(first);
    ss_free(entries);
    ss_free(fin);
    if (fine) return SOFTSHADOW_OK;
    return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for the fins of %zu triangles", count);
}
