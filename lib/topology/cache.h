/* Levels on disk: see levels.h for what and where. */
#ifndef SS_TOPOLOGY_CACHE_H
#define SS_TOPOLOGY_CACHE_H

#include <stdbool.h>

#include "base/parallel.h"
#include "scene/levels.h"
#include "topology/hash.h"

/* What the levels belong to: its content, and sizes that no level can exceed. */
typedef struct ss_cache_key {
    ss_hash hash;
    uint64_t vertex_count, triangle_count;
} ss_cache_key;

/* The directory, or NULL: no cache. */
const char *ss_cache_directory(void);

/* False where there is no such file. Also where something is wrong with it: that is logged. */
bool ss_cache_load(const char *directory, const ss_cache_key *key, ss_mesh_levels *out,
                   const softshadow_options *host);
/* Written aside and renamed: readers see a whole file or none. Failure is logged, never fatal. */
void ss_cache_save(const char *directory, const ss_cache_key *key, const ss_mesh_levels *levels,
                   const softshadow_options *host);

#endif
