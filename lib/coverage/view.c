/* The projective maps of group.h, reckoned in double. */
#include "coverage/view.h"

#include <math.h>

#include "base/vec.h"
#include "trace/bvh_node.h"

void ss_group_view_of(const ss_group *g, const ss_group_views *v, unsigned lane,
                      const ss_light *light, ss_view *view) {
    double p[3];
    for (int k = 0; k < 3; k++) p[k] = v->at[g->axis[k]][lane];
    if (light->type != SOFTSHADOW_SPHERE || (v->inside >> lane & 1)) {
        ss_light_view(light, p, view);
        return;
    }
    *view = (ss_view){.t_end = v->t_end[lane], .disk = true};
    double a = 0, b = 0, distance = 0;
    for (int k = 0; k < 3; k++) {
        view->centre[k] = light->centre[k] - p[k];
        distance += view->centre[k] * view->centre[k];
        a += v->row[0][k][lane] * v->row[0][k][lane], b += v->row[1][k][lane] * v->row[1][k][lane];
    }
    distance = sqrt(distance);
    for (int k = 0; k < 3; k++) {
        view->a[k] = v->row[0][k][lane] / a, view->b[k] = v->row[1][k][lane] / b;
        view->normal[k] = -view->centre[k] / distance;
    }
}

static void enclose_points(ss_group *g, const double low[3], const double high[3]) {
    for (int k = 0; k < 3; k++) {
        const double middle = low[k] + (high[k] - low[k]) / 2;
        g->middle[k] = (float)middle;
        g->half[k] = (float)((high[k] - low[k]) / 2 + 0x1p-22 * (fabs(low[k]) + fabs(high[k])));
    }
}

/* The light, or the directions to the sun, as anything in the frame's box sees it. */
void ss_group_enclose(ss_group *g, const ss_light *light, const ss_shaft_frame *frame,
                      const double low[3], const double high[3], const ss_group_views *views) {
    const double *at[3] = {0};
    for (int k = 0; k < 3 && views; k++) at[k] = views->at[k];
    ss_shaft_in_frame(&g->shaft, frame, light, g->bvh->world->extent, low, high,
                      views ? at : NULL, SS_LANES);
    enclose_points(g, low, high);
}

void ss_group_widen(ss_group *g, double by) {
    if (!(by > 0)) return;
    const float room = (float)(by * 1.001);
    for (unsigned p = 0; p < g->shaft.planes; p++) {
        const float *n = g->shaft.normal[p];
        const float far = room * (fabsf(n[0]) + fabsf(n[1]) + fabsf(n[2]));
        g->shaft.limit[p] = nextafterf(g->shaft.limit[p] + far, INFINITY);
    }
    for (int k = 0; k < 3; k++) {
        g->shaft.low[k] = nextafterf(g->shaft.low[k] - room, -INFINITY);
        g->shaft.high[k] = nextafterf(g->shaft.high[k] + room, INFINITY);
        g->half[k] = nextafterf(g->half[k] + room, INFINITY);
    }
}
