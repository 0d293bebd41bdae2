/* Runs of points that follow each other mostly lie close together. A run is tried as a whole, then
 * in parts, down to a size at which a test costs as much as it saves. */
#include "engine/settle.h"

#include <math.h>

#include "base/vec.h"
#include "trace/bvh.h"

#define WHOLE 1024
#define PARTS 4
#define SMALLEST 64

static void bound_run(const ss_point *points, size_t n, double low[3], double high[3]) {
    for (int k = 0; k < 3; k++) low[k] = INFINITY, high[k] = -INFINITY;
    for (size_t i = 0; i < n; i++) {
        for (int k = 0; k < 3; k++) {
            low[k] = ss_min(points[i].p[k], low[k]), high[k] = ss_max(points[i].p[k], high[k]);
        }
    }
}

/* Points that are not answered, to where *left points. */
static void leave(const ss_point *points, size_t n, ss_point **left) {
    for (size_t i = 0; i < n; i++) *(*left)++ = points[i];
}

static void answer_lit(const ss_stage *stage, const ss_point *points, size_t n,
                       const ss_answers *answers, ss_point **left) {
    for (size_t i = 0; i < n; i++) {
        const ss_point *point = &points[i];
        const float *normal = point->normal;
        const bool horizon = normal[0] != 0 || normal[1] != 0 || normal[2] != 0;
        if (horizon && !ss_light_above(stage->light, point->p, normal)) {
            leave(point, 1, left);
            continue;
        }
        answers->visibility[point->place] = 1;
        if (answers->bound) answers->bound[point->place] = 0;
    }
}

static void settle_run(const ss_stage *stage, const ss_point *points, size_t n,
                       const ss_answers *answers, ss_point **left) {
    double low[3], high[3];
    bound_run(points, n, low, high);
    if (ss_bvh_shaft_empty(stage->bvh, stage->light, low, high)) {
        answer_lit(stage, points, n, answers, left);
        return;
    }
    const size_t part = n / PARTS;
    if (part < SMALLEST) {
        leave(points, n, left);
        return;
    }
    for (size_t first = 0; first < n; first += part) {
        const size_t size = n - first < part ? n - first : part;
        settle_run(stage, points + first, size, answers, left);
    }
}

size_t ss_settle(const ss_stage *stage, ss_point *points, size_t n, const ss_answers *answers) {
    ss_point *left = points;
    for (size_t first = 0; first < n; first += WHOLE) {
        const size_t size = n - first < WHOLE ? n - first : WHOLE;
        settle_run(stage, points + first, size, answers, &left);
    }
    return (size_t)(left - points);
}
