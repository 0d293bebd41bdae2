/* Triangles that tile a polygon. Inside cli/mesh only. */
#ifndef CLI_MESH_POLYGON_H
#define CLI_MESH_POLYGON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { CLI_POLYGON_CORNERS = 65536, CLI_POLYGON_WORK = 1 << 24 };

/* Scratch that grows with the largest polygon; begin with all zero. */
typedef struct cli_polygon {
    double (*points)[3]; /* in: the corners, room for `room` of them */
    uint32_t *triangles; /* out: 3 (count - 2) corner numbers */
    uint64_t effort;     /* out: corners x concave corners where ears had to be sought, else 0 */
    void *work;
    uint32_t room;
} cli_polygon;

typedef enum cli_tiling {
    CLI_TILING_CLEAN,    /* in the polygon's plane the triangles tile it exactly */
    CLI_TILING_UNCLEAN,  /* as good as it gets: the outline crosses itself or has no area */
    CLI_TILING_TOO_LARGE /* corners x concave corners beyond CLI_POLYGON_WORK; nothing done */
} cli_tiling;

bool cli_polygon_reserve(cli_polygon *polygon, uint32_t count); /* false: out of memory */
void cli_polygon_free(cli_polygon *polygon);

/* Always count - 2 triangles, wound like the polygon. A convex one becomes the fan of corner 0. */
cli_tiling cli_polygon_tile(cli_polygon *polygon, uint32_t count);

#endif
