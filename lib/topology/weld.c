/* An open-addressing hash of exact positions, filled in vertex order: the first vertex in a place
 * is the one that stands for it, whatever the threads do. */
#include "topology/weld.h"

#include <stdbool.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"

/* hash(32) << 32 | vertex + 1; 0 is free. The hash in the slot saves most position look-ups. */
typedef uint64_t slot;

static uint64_t mix(uint64_t x) {
    x ^= x >> 31;
    x *= 0x9e3779b97f4a7c15u;
    return x ^ x >> 29;
}

static uint64_t hash_of(const double p[3]) {
    uint64_t hash = 0x2545f4914f6cdd1du;
    for (int k = 0; k < 3; k++) {
        const double positive = p[k] + 0.0; /* -0 becomes 0 */
        uint64_t bits;
        memcpy(&bits, &positive, sizeof bits);
        hash = mix(hash + bits) * 0xd6e8feb86659fd93u;
    }
    return hash ^ hash >> 32;
}

static bool same(const double a[3], const double b[3]) {
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* The vertex that stands for i, which it becomes itself where its place is new. */
static uint32_t find(slot *slots, size_t mask, ss_place *place, const void *ctx, uint32_t i) {
    double p[3], q[3];
    place(ctx, i, p);
    const uint64_t hash = hash_of(p);
    const uint64_t tag = hash << 32;
    for (size_t at = (size_t)(hash & mask);; at = (at + 1) & mask) {
        if (slots[at] == 0) {
            slots[at] = tag | (i + 1u);
            return i;
        }
        if ((slots[at] ^ tag) >> 32) continue;
        const uint32_t other = (uint32_t)slots[at] - 1u;
        place(ctx, other, q);
        if (same(p, q)) return other;
    }
}

softshadow_status ss_weld(ss_place *place, const void *ctx, size_t count, uint32_t offset,
                          uint32_t *weld) {
    if (count >= UINT32_MAX) {
        return ss_fail(SOFTSHADOW_E_UNSUPPORTED, "mesh.vertex_count: %zu, at most 2^32 - 2", count);
    }
    size_t size = 16;
    while (size < count + count / 2) size *= 2;
    slot *slots = ss_alloc(size, sizeof *slots);
    if (!slots)
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for welding %zu vertices", count);
    for (uint32_t i = 0; i < count; i++) {
        weld[i] = offset + find(slots, size - 1, place, ctx, i);
    }
    ss_free(slots);
    return SOFTSHADOW_OK;
}
