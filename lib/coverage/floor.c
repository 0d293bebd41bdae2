#include "coverage/floor.h"

#include <math.h>

#include "base/vec.h"
#include "trace/contact.h"
#include "trace/shaft.h"

#define LEAST_SINE 0.01 /* of the light's height over a floor */

bool ss_floor_make(ss_floor *f, const ss_world *world, const ss_light *light, uint32_t triangle,
                   const double low[3], const double high[3]) {
    double corner[3][3], one[3], two[3], down[3], farthest = 0;
    ss_world_triangle(world, triangle, corner);
    ss_sub(corner[1], corner[0], one);
    ss_sub(corner[2], corner[0], two);
    ss_cross(one, two, f->normal);
    if (!ss_normalize(f->normal)) return false;
    f->triangle = triangle;
    const bool sun = light->type == SOFTSHADOW_SUN;
    f->offset = ss_dot(f->normal, corner[0]);
    const double side =
        ss_dot(f->normal, sun ? light->normal : light->centre) - (sun ? 0 : f->offset);
    for (int k = 0; k < 3 && side < 0; k++) f->normal[k] = -f->normal[k];
    if (side < 0) f->offset = -f->offset;
    for (int k = 0; k < 3; k++) down[k] = -f->normal[k];
    if (sun) {
        const double spread = hypot(ss_dot(down, light->u), ss_dot(down, light->v));
        f->sine = (ss_dot(f->normal, light->normal) - spread) / hypot(1, light->radius);
        return f->sine >= LEAST_SINE;
    }
    for (int k = 0; k < 3; k++) {
        const double to = fmax(fabs(light->centre[k] - low[k]), fabs(light->centre[k] - high[k]));
        farthest += to * to;
    }
    const double lowest = -ss_light_support(light, low, high, down) - f->offset;
    f->sine = lowest / (sqrt(farthest) + 2 * light->radius);
    return f->sine >= LEAST_SINE;
}

static bool same_plane(const ss_world *world, const ss_floor *f, uint32_t triangle) {
    double corner[3][3];
    ss_world_triangle(world, triangle, corner);
    for (int i = 0; i < 3; i++) {
        if (fabs(ss_dot(f->normal, corner[i]) - f->offset) > SS_TOUCH) return false;
    }
    return true;
}

/* From a depth below the plane segments leave it within depth / sine, and 4 ulp of 1/2 or more is
 * touching. */
bool ss_floor_holds(const ss_floor *f, const ss_world *world, const ss_point *point) {
    const double height = ss_dot(f->normal, point->p) - f->offset;
    if (height > SS_NEAR) return true;
    if (point->ulp > 0) return height >= -2 * (double)point->ulp * f->sine / (1 + f->sine);
    return point->triangle == f->triangle ||
           (point->triangle != SS_NO_TRIANGLE && same_plane(world, f, point->triangle));
}
