/* Runs of points as they come (image rows, texels, clusters) mostly lie close together. A run is tried
 * as a whole, then in parts, down to a size at which a test costs as much as it saves. */
#include "engine/settle.h"

#include <math.h>

#include "engine/order.h"
#include "trace/bvh.h"

#define WHOLE 1024
#define PARTS 4
#define SMALLEST 64

/* false: none is to be answered */
static bool bound_run(const ss_point *points, size_t n, double low[3], double high[3]) {
    size_t count = 0;
    for (int k = 0; k < 3; k++) low[k] = INFINITY, high[k] = -INFINITY;
    for (size_t i = 0; i < n; i++) {
        if (points[i].place == SS_ORDER_NOT) continue;
        for (int k = 0; k < 3; k++) {
            low[k] = points[i].p[k] < low[k] ? points[i].p[k] : low[k];
            high[k] = points[i].p[k] > high[k] ? points[i].p[k] : high[k];
        }
        count++;
    }
    return count > 0;
}

static uint64_t answer_lit(const ss_stage *stage, ss_point *points, size_t n,
                           const ss_answers *answers) {
    uint64_t answered = 0;
    for (size_t i = 0; i < n; i++) {
        ss_point *point = &points[i];
        const float *normal = point->normal;
        const bool horizon = normal[0] != 0 || normal[1] != 0 || normal[2] != 0;
        if (point->place == SS_ORDER_NOT) continue;
        if (horizon && !ss_light_above(stage->light, point->p, normal)) continue;
        answers->visibility[point->place] = 1;
        if (answers->bound) answers->bound[point->place] = 0;
        point->place = SS_ORDER_NOT;
        answered++;
    }
    return answered;
}

static uint64_t settle_run(const ss_stage *stage, ss_point *points, size_t n,
                           const ss_answers *answers) {
    double low[3], high[3];
    if (!bound_run(points, n, low, high)) return 0;
    if (ss_bvh_shaft_empty(stage->bvh, stage->light, low, high)) {
        return answer_lit(stage, points, n, answers);
    }
    const size_t part = n / PARTS;
    if (part < SMALLEST) return 0;
    uint64_t answered = 0;
    for (size_t first = 0; first < n; first += part) {
        const size_t size = n - first < part ? n - first : part;
        answered += settle_run(stage, points + first, size, answers);
    }
    return answered;
}

uint64_t ss_settle(const ss_stage *stage, ss_point *points, size_t n, const ss_answers *answers) {
    uint64_t answered = 0;
    for (size_t first = 0; first < n; first += WHOLE) {
        const size_t size = n - first < WHOLE ? n - first : WHOLE;
        answered += settle_run(stage, points + first, size, answers);
    }
    return answered;
}
