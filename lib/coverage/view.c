/* The projective maps of group.h, reckoned in double. */
#include "coverage/view.h"

#include <math.h>

#include "base/vec.h"
#include "trace/bvh_node.h"

/* Where floats' reach is more than this share of the way to the light, doubles do it. */
#define COARSE 0x1p-6

bool ss_group_set_lane(ss_group *g, unsigned lane, const ss_view *view, const double p[3]) {
    double row[3][3], map[3][3], shift[3], reach = 0;
    ss_cross(view->b, view->centre, row[0]);
    ss_cross(view->centre, view->a, row[1]);
    ss_cross(view->a, view->b, row[2]);
    const double det = ss_dot(view->centre, row[2]);
    if (det == 0) return false;
    const double(*grid)[3] = (const double(*)[3])g->lattice->grid;
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < 2; i++) {
            map[i][k] =
                (grid[i][0] * row[0][k] + grid[i][1] * row[1][k] + grid[i][2] * row[2][k]) / det;
        }
        map[2][k] = row[2][k] / det;
        reach += fabs(map[2][k]);
    }
    for (int i = 0; i < 3; i++) shift[i] = -ss_dot(map[i], p);
    const double near = SS_FLOAT_REACH * reach,
                 far = view->t_end - SS_FLOAT_REACH * (reach + fabs(shift[2]));
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) g->matrix[i][k][lane] = (float)map[i][k];
        g->shift[i][lane] = (float)shift[i];
    }
    g->t_near[lane] = (float)near, g->t_far[lane] = (float)far;
    return near < COARSE * fmin(view->t_end, 1) || isinf(view->t_end);
}

static void enclose_points(ss_group *g, const double low[3], const double high[3]) {
    for (int k = 0; k < 3; k++) {
        const double middle = low[k] + (high[k] - low[k]) / 2;
        g->middle[k] = (float)middle;
        g->half[k] = (float)((high[k] - low[k]) / 2 + 0x1p-22 * (fabs(low[k]) + fabs(high[k])));
    }
}

/* The light, or the directions to the sun, as anything in the box sees it. */
static void enclose_light(ss_group *g, const ss_light *light, const double low[3],
                          const double high[3]) {
    const bool sun = light->type == SOFTSHADOW_SUN;
    g->light_finite = sun ? 0 : 1;
    for (int k = 0; k < 3; k++) {
        double from = light->normal[k] - hypot(light->u[k], light->v[k]);
        double to = light->normal[k] + hypot(light->u[k], light->v[k]);
        if (!sun) {
            double n[3] = {0, 0, 0};
            n[k] = 1;
            to = ss_light_support(light, low, high, n);
            n[k] = -1;
            from = -ss_light_support(light, low, high, n);
        }
        g->light_middle[k] = (float)(from + (to - from) / 2);
        g->light_half[k] = (float)((to - from) / 2 + 0x1p-22 * (fabs(from) + fabs(to)));
    }
}

void ss_group_enclose_box(ss_group *g, const ss_light *light, const double low[3],
                          const double high[3]) {
    ss_shaft_make(&g->shaft, light, g->bvh->world->extent, low, high);
    enclose_points(g, low, high);
    enclose_light(g, light, low, high);
}

void ss_group_enclose(ss_group *g, const ss_light *light, const double (*points)[3], size_t count,
                      double low[3], double high[3]) {
    ss_shaft_around(&g->shaft, light, g->bvh->world->extent, points, count, low, high);
    enclose_points(g, low, high);
    enclose_light(g, light, low, high);
}

void ss_group_widen(ss_group *g, double by) {
    if (!(by > 0)) return;
    const float room = (float)(by * 1.001);
    for (unsigned p = 0; p < g->shaft.planes; p++) {
        g->shaft.limit[p] = nextafterf(g->shaft.limit[p] + room, INFINITY);
    }
    for (int k = 0; k < 3; k++) {
        g->shaft.low[k] = nextafterf(g->shaft.low[k] - room, -INFINITY);
        g->shaft.high[k] = nextafterf(g->shaft.high[k] + room, INFINITY);
        g->half[k] = nextafterf(g->half[k] + room, INFINITY);
    }
}

void ss_group_enclose_depths(ss_group *g, double reach) {
    double least[3], most[3];
    g->t_least = INFINITY, g->t_most = -INFINITY, g->t_safe = 0, g->t_beyond = INFINITY;
    for (int k = 0; k < 3; k++) least[k] = INFINITY, most[k] = -INFINITY;
    for (uint32_t m = g->lanes; m; m &= m - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(m);
        double at = g->shift[2][lane], size = 0;
        for (int k = 0; k < 3; k++) {
            const double n = g->matrix[2][k][lane];
            at += n * g->middle[g->axis[k]];
            size += fabs(n);
            least[k] = fmin(least[k], n), most[k] = fmax(most[k], n);
        }
        g->t_least = fminf(g->t_least, (float)at), g->t_most = fmaxf(g->t_most, (float)at);
        g->t_safe = fmaxf(g->t_safe, (float)fmax(4 * g->t_near[lane], 2 * reach * size));
        g->t_beyond = fminf(g->t_beyond, g->t_far[lane] - 4 * g->t_near[lane]);
    }
    for (int k = 0; k < 3; k++) {
        g->t_axis[g->axis[k]] = (float)((least[k] + most[k]) / 2);
        g->t_spread[g->axis[k]] = (float)((most[k] - least[k]) * 0.5000001);
    }
}
