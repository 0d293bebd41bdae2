/* based on: edge functions evaluated in one order of their two ends, so that neighbours get the
 * same number with opposite signs (Woop et al. 2013), here in double. */
#include "coverage/direct.h"

#include "base/vec.h"

void ss_direct_set(ss_direct *direct, const ss_world *world, uint32_t triangle, const double p[3]) {
    ss_world_triangle(world, triangle, direct->corner);
    for (int i = 0; i < 3; i++) ss_sub(direct->corner[i], p, direct->corner[i]);
    direct->triangle = triangle;
}

static bool ordered(const double a[3], const double b[3]) {
    for (int k = 0; k < 3; k++) {
        if (a[k] != b[k]) return a[k] < b[k];
    }
    return true;
}

static double side(const double d[3], const double a[3], const double b[3]) {
    const bool forward = ordered(a, b);
    double moment[3];
    ss_cross(forward ? a : b, forward ? b : a, moment);
    return forward ? ss_dot(d, moment) : -ss_dot(d, moment);
}

bool ss_direct_blocks(const ss_direct *direct, const ss_world *world, const double d[3],
                      double t_end) {
    const double(*v)[3] = direct->corner;
    const double weight[3] = {side(d, v[1], v[2]), side(d, v[2], v[0]), side(d, v[0], v[1])};
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
