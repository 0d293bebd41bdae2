#define _DEFAULT_SOURCE
#include "base/memory.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#define ALIGNMENT 64
/* What is looked up all over the place, such as maps, asks for pages that the processor finds at
 * once. */
#define HUGE_PAGE ((size_t)2 << 20)
#define LARGE     (2 * HUGE_PAGE)
#define BLOCK ((size_t)256 << 10)

/* Room for `bytes`, rounded up to the alignment; NULL if that overflows or memory is out. */
static void *aligned(size_t bytes) {
    const size_t unit = bytes >= LARGE ? HUGE_PAGE : ALIGNMENT;
    if (bytes > SIZE_MAX - unit) return NULL;
    const size_t rounded = (bytes + unit - 1) / unit * unit;
    void *memory = aligned_alloc(unit, rounded ? rounded : unit);
#ifdef MADV_HUGEPAGE
    if (memory && unit == HUGE_PAGE) madvise(memory, rounded, MADV_HUGEPAGE); /* a wish */
#endif
    return memory;
}

void *ss_alloc(size_t count, size_t size) {
    size_t bytes;
    if (!ss_multiply(count, size, &bytes)) return NULL;
    void *memory = aligned(bytes);
    if (memory) memset(memory, 0, bytes);
    return memory;
}

void *ss_alloc_any(size_t count, size_t size) {
    size_t bytes;
    return ss_multiply(count, size, &bytes) ? aligned(bytes) : NULL;
}

void *ss_grow(void *old, size_t kept, size_t count, size_t size) {
    void *memory = ss_alloc(count, size);
    if (!memory) return NULL;
    if (kept) memcpy(memory, old, kept * size);
    ss_free(old);
    return memory;
}

void ss_free(void *memory) { free(memory); }

typedef struct ss_arena_block {
    struct ss_arena_block *next;
    size_t size, used;
    _Alignas(ALIGNMENT) unsigned char bytes[];
} ss_arena_block;

static ss_arena_block *new_block(ss_arena *arena, size_t bytes) {
    const size_t size = bytes > BLOCK ? bytes : BLOCK;
    if (size > SIZE_MAX - sizeof(ss_arena_block)) return NULL;
    ss_arena_block *block = aligned(sizeof *block + size);
    if (!block) return NULL;
    block->next = NULL, block->size = size, block->used = 0;
    arena->total += size;
    return block;
}

void *ss_arena_alloc(ss_arena *arena, size_t count, size_t size) {
    size_t bytes;
    if (!ss_multiply(count, size, &bytes) || bytes > SIZE_MAX - ALIGNMENT) return NULL;
    bytes = (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    ss_arena_block *block = arena->current;
    while (block && block->size - block->used < bytes && block->next) block = block->next;
    if (!block || block->size - block->used < bytes) {
        ss_arena_block *fresh = new_block(arena, bytes);
        if (!fresh) return NULL;
        if (block) block->next = fresh;
        else arena->first = fresh;
        block = fresh;
    }
    arena->current = block;
    void *memory = block->bytes + block->used;
    block->used += bytes;
    return memory;
}

void ss_arena_reset(ss_arena *arena) {
    for (ss_arena_block *block = arena->first; block; block = block->next) block->used = 0;
    arena->current = arena->first;
}

void ss_arena_free(ss_arena *arena) {
    for (ss_arena_block *block = arena->first; block;) {
        ss_arena_block *next = block->next;
        free(block);
        block = next;
    }
    *arena = (ss_arena){0};
}
