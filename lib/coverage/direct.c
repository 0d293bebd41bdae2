/* based on: edge functions of Pluecker's kind (Woop et al. 2013), here in double and with signs
 * that are never wrong. */
#include "coverage/direct.h"

#include <math.h>

#include "base/predicate.h"
#include "base/vec.h"

void ss_direct_set(ss_direct *direct, const ss_world *world, uint32_t triangle, const double p[3]) {
    ss_world_triangle(world, triangle, direct->corner);
    for (int i = 0; i < 3; i++) ss_sub(direct->corner[i], p, direct->corner[i]);
    direct->size = 0;
    for (int i = 0; i < 9; i++)
        direct->size = fmax(direct->size, fabs(direct->corner[i / 3][i % 3]));
    direct->triangle = triangle;
}

bool ss_direct_blocks(const ss_direct *direct, const ss_world *world, const double d[3],
                      double t_end) {
    const double(*v)[3] = direct->corner;
    const double limit = ss_side_limit(direct->size, d);
    const double weight[3] = {ss_side(d, v[1], v[2], limit), ss_side(d, v[2], v[0], limit),
                              ss_side(d, v[0], v[1], limit)};
    const bool some_left = weight[0] < 0 || weight[1] < 0 || weight[2] < 0;
    const bool some_right = weight[0] > 0 || weight[1] > 0 || weight[2] > 0;
    if (some_left == some_right) return false; /* outside, or the segment lies in the plane */
    const double sum = weight[0] + weight[1] + weight[2];
    double along[3], d_square = ss_dot(d, d);
    for (int k = 0; k < 3; k++) {
        along[k] = (weight[0] * v[0][k] + weight[1] * v[1][k] + weight[2] * v[2][k]) / sum;
    }
    const double t = ss_dot(along, d) / d_square;
    if (!(t > 0 && t < t_end)) return false;
    return ss_world_opaque_at(world, direct->triangle, weight[1] / sum, weight[2] / sum);
}
