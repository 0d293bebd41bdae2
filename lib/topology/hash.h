/* A 128-bit hash of bytes, to name things and to notice damage; not a secret-keeping one. */
#ifndef SS_TOPOLOGY_HASH_H
#define SS_TOPOLOGY_HASH_H

#include <stddef.h>
#include <stdint.h>

typedef struct ss_hash {
    uint64_t a, b;
} ss_hash;

/* A further piece of what is hashed; start from {0}. Pieces count: "ab" is not "a", "b". */
void ss_hash_add(ss_hash *hash, const void *bytes, size_t count);

#endif
