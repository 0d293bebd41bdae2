/* Triangles back to back: two with the same corners that run opposite ways. */
#ifndef SS_TOPOLOGY_FINS_H
#define SS_TOPOLOGY_FINS_H

#include <stddef.h>
#include <stdint.h>

#include "softshadow.h"

/* Moves them, both of each pair, behind the others, else keeping the order of both kinds; *others
 * becomes how many those are. Corners are below vertex_count, and different. */
softshadow_status ss_fins_last(uint32_t *triangles, size_t count, size_t vertex_count,
                               size_t *others);

#endif
