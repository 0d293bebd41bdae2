/* Faces in nobody's way: those that points lie on, as a floor, as long as the light is well above
 * them, and those beside. */
#ifndef SS_COVERAGE_FLOOR_H
#define SS_COVERAGE_FLOOR_H

#include <stdbool.h>

#include "scene/point.h"
#include "scene/scene.h"

typedef struct ss_floor {
    double normal[3], offset; /* the light is on its positive side */
    double sine;              /* at least, of the angle at which segments leave it */
    uint32_t triangle;
} ss_floor;

/* The face as a plane with all of the light above it, as seen from the box; false if it is not. */
bool ss_floor_make(ss_floor *floor, const ss_world *world, const ss_light *light, uint32_t triangle,
                   const double low[3], const double high[3]);

/* Is the point of that box above the face, or so little below it that it touches whatever of it its
 * segments could meet? Then the face hides nothing from it. */
bool ss_floor_holds(const ss_floor *floor, const ss_world *world, const ss_point *point);

/* Is the triangle beside everything between the box and the light, by a plane through one of its
 * edges? A shaft's planes alone cannot tell that of a large one. A certain yes. */
bool ss_floor_beside(const ss_world *world, const ss_light *light, uint32_t triangle,
                     const double low[3], const double high[3]);

#endif
