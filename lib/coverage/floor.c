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

/* The plane through edge a..b and another place, or along a direction; false without one. */
static bool plane_through(const double along[3], const double to[3], double normal[3]) {
    ss_cross(along, to, normal);
    return ss_normalize(normal);
}

#define SPARE 0x1p-10 /* of the room between the two planes below */
#define NEAR  0x1p-18 /* of lengths: more than floats' rounding takes, so that nothing is drawn */

/* Of all planes through the edge, the one through the box's middle has the box half on each side,
 * the one through the light's has the light so. Between them is one that leaves both bodies whole,
 * if there is room for what they need: shares `box` and `lamp` of the way. */
static bool edge_divides(const ss_light *light, const double corner[3][3], int edge,
                         const double low[3], const double high[3]) {
    const double *a = corner[edge], *b = corner[(edge + 1) % 3], *c = corner[(edge + 2) % 3];
    double along[3], to_box[3], to_light[3], by_box[3], by_light[3], n[3], across[3], size[3];
    for (int k = 0; k < 3; k++) {
        to_box[k] = low[k] + (high[k] - low[k]) / 2 - a[k], size[k] = (high[k] - low[k]) / 2;
        to_light[k] = light->type == SOFTSHADOW_SUN ? light->normal[k] : light->centre[k] - a[k];
    }
    ss_sub(b, a, along);
    ss_sub(c, a, across);
    if (!plane_through(along, to_box, by_box) || !plane_through(to_light, along, by_light))
        return false;
    /* Normals point to where the bodies should be: away from c. */
    if (ss_dot(by_box, across) > 0)
        for (int k = 0; k < 3; k++) by_box[k] = -by_box[k], by_light[k] = -by_light[k];
    const double light_height = ss_dot(by_box, to_light), box_height = ss_dot(by_light, to_box);
    if (!(light_height > 0 && box_height > 0)) return false;
    const double margin = NEAR * (1 + ss_length(a) + ss_length(to_box) + ss_length(to_light)),
                 lamp = (light->radius * (1 + SPARE) + margin) / light_height,
                 box = (ss_length(size) + margin) / box_height, room = 1 - lamp - box;
    if (!(room > SPARE)) return false;
    for (int k = 0; k < 3; k++) {
        n[k] = -(lamp + room / 2) * by_box[k] - (box + room / 2) * by_light[k];
    }
    const double place = ss_dot(n, a), limit = place - margin * room / 2;
    double support = 0;
    for (int k = 0; k < 3; k++) support += n[k] * (n[k] > 0 ? high[k] : low[k]);
    return ss_dot(n, c) >= place && support < limit &&
           ss_light_support(light, low, high, n) < limit;
}

bool ss_floor_beside(const ss_world *world, const ss_light *light, uint32_t triangle,
                     const double low[3], const double high[3]) {
    double corner[3][3];
    ss_world_triangle(world, triangle, corner);
    for (int i = 0; i < 3; i++) {
        if (edge_divides(light, (const double(*)[3])corner, i, low, high)) return true;
    }
    return false;
}
