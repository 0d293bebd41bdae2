/* Finds copies of triangles by a hash table with linear probing. */
#include "trace/distinct.h"

#include <string.h>

#include "base/memory.h"
#include "base/status.h"

#define AHEAD 16 /* triangles whose slots are fetched before they are looked at: a table misses all caches */

/* Corners in an order of their own, without -0: the same bits for all copies. */
typedef struct corners {
    uint32_t at[3][3];
} corners;

typedef struct slot {
    uint32_t hash, triangle; /* one more than it is; 0: free */
} slot;

typedef struct table {
    const ss_world *world;
    slot *slots;
    size_t mask;
} table;

static void order(uint32_t a[3], uint32_t b[3]) {
    uint32_t kept[3];
    if (memcmp(a, b, sizeof kept) <= 0) return;
    memcpy(kept, a, sizeof kept), memcpy(a, b, sizeof kept), memcpy(b, kept, sizeof kept);
}

static corners corners_of(const ss_world *world, uint32_t triangle) {
    corners found;
    for (int i = 0; i < 3; i++) {
        const float *vertex =
            world->vertices + 3 * (size_t)world->indices[3 * (size_t)triangle + i];
        for (int k = 0; k < 3; k++) {
            const float unsigned_zero = vertex[k] + 0.0f;
            memcpy(&found.at[i][k], &unsigned_zero, sizeof unsigned_zero);
        }
    }
    order(found.at[0], found.at[1]);
    order(found.at[1], found.at[2]);
    order(found.at[0], found.at[1]);
    return found;
}

/* The same for the corners in any order. */
static uint32_t hash_of(const ss_world *world, uint32_t triangle) {
    uint64_t sum = 0;
    for (int i = 0; i < 3; i++) {
        const float *vertex =
            world->vertices + 3 * (size_t)world->indices[3 * (size_t)triangle + i];
        uint32_t bits[3];
        for (int k = 0; k < 3; k++) {
            const float unsigned_zero = vertex[k] + 0.0f;
            memcpy(&bits[k], &unsigned_zero, sizeof unsigned_zero);
        }
        uint64_t own = ((uint64_t)bits[0] << 32 | bits[1]) * 0x9e3779b97f4a7c15u;
        own = (own ^ own >> 32 ^ bits[2]) * 0xbf58476d1ce4e5b9u;
        sum += own ^ own >> 29;
    }
    return (uint32_t)((sum * 0x94d049bb133111ebu) >> 32);
}

/* false: a copy of it is there. */
static bool insert(table *t, uint32_t triangle, uint32_t hash) {
    size_t at = hash & t->mask;
    for (; t->slots[at].triangle; at = (at + 1) & t->mask) {
        if (t->slots[at].hash != hash) continue;
        const corners own = corners_of(t->world, triangle),
                      other = corners_of(t->world, t->slots[at].triangle - 1);
        if (memcmp(&own, &other, sizeof own) == 0) return false;
    }
    t->slots[at] = (slot){hash, triangle + 1};
    return true;
}

/* Writes no number until the first copy: most worlds have none. */
static bool sift_mesh(table *t, const ss_world_mesh *mesh, uint32_t **numbers, size_t *count) {
    const bool stays = mesh->source->opacity.texels != NULL;
    const uint32_t end = mesh->first_triangle + (uint32_t)mesh->source->triangle_count;
    uint32_t hash[AHEAD] = {0};
    for (uint32_t ahead = mesh->first_triangle, triangle = ahead; triangle < end; triangle++) {
        for (; !stays && ahead < end && ahead < triangle + AHEAD; ahead++) {
            hash[ahead % AHEAD] = hash_of(t->world, ahead);
            __builtin_prefetch(&t->slots[hash[ahead % AHEAD] & t->mask], 1);
        }
        const bool kept = stays || insert(t, triangle, hash[triangle % AHEAD]);
        if (!kept && !*numbers) {
            *numbers = ss_alloc(t->world->triangle_count, sizeof **numbers);
            if (!*numbers) return false;
            for (uint32_t k = 0; k < triangle; k++) (*numbers)[k] = k;
        }
        if (kept && *numbers) (*numbers)[*count] = triangle;
        *count += kept;
    }
    return true;
}

softshadow_status ss_distinct_find(const ss_world *world, uint32_t **numbers, size_t *count) {
    *numbers = NULL, *count = 0;
    size_t size = 16;
    while (size < 2 * world->triangle_count) size *= 2;
    table t = {world, ss_alloc(size, sizeof(slot)), size - 1};
    bool fine = t.slots != NULL;
    for (uint32_t m = 0; fine && m < world->mesh_count; m++) {
        fine = sift_mesh(&t, &world->meshes[m], numbers, count);
    }
    ss_free(t.slots);
    if (fine) return SOFTSHADOW_OK;
    return ss_fail(SOFTSHADOW_E_MEMORY, "ray tracing: out of memory for %zu triangles",
                   world->triangle_count);
}
