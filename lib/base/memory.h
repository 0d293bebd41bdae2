/* Memory: every allocation of ours goes through here, is 64-byte aligned, zeroed and checked for
 * overflow; NULL means out of memory (never a zero-sized request: that gives a valid pointer). */
#ifndef SS_BASE_MEMORY_H
#define SS_BASE_MEMORY_H

#include <stdbool.h>
#include <stddef.h>

void *ss_alloc(size_t count, size_t size);
/* The same, of any content: for what is written whole. */
void *ss_alloc_any(size_t count, size_t size);
/* Grows to count items, keeping the first `kept`; frees nothing and returns NULL on failure. */
void *ss_grow(void *old, size_t kept, size_t count, size_t size);
void ss_free(void *memory);

/* a * b into *product; false on overflow. */
static inline bool ss_multiply(size_t a, size_t b, size_t *product) {
    return !__builtin_mul_overflow(a, b, product);
}

/* A bump allocator for scratch that dies together: one per worker, reset between chunks. Grows by
 * blocks; pointers stay valid until reset. */
typedef struct ss_arena {
    struct ss_arena_block *first, *current;
    size_t total;
} ss_arena;

void *ss_arena_alloc(ss_arena *arena, size_t count, size_t size); /* 64-byte aligned, NOT zeroed */
void ss_arena_reset(ss_arena *arena);
void ss_arena_free(ss_arena *arena);

#endif
