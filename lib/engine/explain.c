/* The light as one point sees it: every triangle against every pixel, in double, by the definition
 * "hidden where a caster lies strictly between". No method's approximation is in here. */
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"
#include "base/vec.h"
#include "engine/engine.h"
#include "trace/bvh.h"
#include "trace/contact.h"

/* The picture in the making. nearest holds the t of the nearest hider of a pixel. */
typedef struct picture {
    const ss_world *world;
    ss_view view;
    uint32_t size;
    double *nearest;
    uint64_t *hider;
    double to_light[3][3]; /* rows: direction -> t (s, u, 1); all zero where there is no inverse */
    bool invertible;
} picture;

/* Pixel centres run from -1 to 1 along both half axes; row 0 is at +b. */
static double column_place(const picture *pic, double i) { return (2 * i + 1) / pic->size - 1; }

static void direction(const picture *pic, uint32_t row, uint32_t column, double out[3]) {
    const double s = column_place(pic, column), t = -column_place(pic, row);
    for (int k = 0; k < 3; k++) {
        out[k] = pic->view.centre[k] + s * pic->view.a[k] + t * pic->view.b[k];
    }
}

static void invert_view(picture *pic) {
    const ss_view *view = &pic->view;
    ss_cross(view->b, view->centre, pic->to_light[0]);
    ss_cross(view->centre, view->a, pic->to_light[1]);
    ss_cross(view->a, view->b, pic->to_light[2]);
    const double det = ss_dot(view->centre, pic->to_light[2]);
    pic->invertible = !view->edge_on && det != 0 && isfinite(1 / det);
    for (int i = 0; i < 9 && pic->invertible; i++) pic->to_light[i / 3][i % 3] /= det;
}

/* The pixels that a triangle may touch, as rows and columns [low, high). */
typedef struct window {
    uint32_t low[2], high[2];
} window;

static uint32_t pixel(const picture *pic, double place) {
    const double at = floor((place + 1) / 2 * pic->size);
    return at > 0 ? (at < pic->size ? (uint32_t)at : pic->size) : 0;
}

static window find_window(const picture *pic, double corner[3][3]) {
    const window all = {{0, 0}, {pic->size, pic->size}}, none = {{0, 0}, {0, 0}};
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    int before = 0;
    for (int i = 0; i < 3 && pic->invertible; i++) {
        const double t = ss_dot(pic->to_light[2], corner[i]);
        before += t > 0;
        for (int k = 0; k < 2; k++) {
            const double place = (k ? -1 : 1) * ss_dot(pic->to_light[k], corner[i]) / t;
            low[k] = fmin(low[k], place), high[k] = fmax(high[k], place);
        }
    }
    if (!pic->invertible || (before > 0 && before < 3)) return all;
    if (before == 0) return none;
    window w;
    for (int k = 0; k < 2; k++) {
        w.low[k] = pixel(pic, low[k]);
        if (w.low[k] > 0) w.low[k]--;
        w.high[k] = pixel(pic, high[k]) + 1;
        if (w.high[k] > pic->size) w.high[k] = pic->size;
    }
    return w;
}

/* Where the line p + t d meets the triangle, strictly between its ends. */
static bool meets(const picture *pic, uint32_t triangle, double corner[3][3], const double d[3],
                  double *t) {
    double side[3], normal[3];
    for (int i = 0; i < 3; i++) {
        ss_cross(corner[i], corner[(i + 1) % 3], normal);
        side[i] = ss_dot(normal, d);
    }
    const double sum = side[0] + side[1] + side[2];
    const bool inside = (side[0] >= 0 && side[1] >= 0 && side[2] >= 0) ||
                        (side[0] <= 0 && side[1] <= 0 && side[2] <= 0);
    if (!inside || sum == 0) return false;
    ss_cross(corner[0], corner[1], normal);
    *t = ss_dot(normal, corner[2]) / sum;
    if (!(*t > 0 && *t < pic->view.t_end)) return false;
    return ss_world_opaque_at(pic->world, triangle, side[2] / sum, side[0] / sum);
}

static void draw(picture *pic, uint32_t triangle, double corner[3][3]) {
    const window w = find_window(pic, corner);
    for (uint32_t row = w.low[1]; row < w.high[1]; row++) {
        for (uint32_t column = w.low[0]; column < w.high[0]; column++) {
            double d[3], t;
            const size_t at = (size_t)row * pic->size + column;
            direction(pic, row, column, d);
            if (!meets(pic, triangle, corner, d, &t) || t >= pic->nearest[at]) continue;
            pic->nearest[at] = t;
            pic->hider[at] = ss_world_primitive(pic->world, triangle);
        }
    }
}

static bool is_near(const ss_contact *contact, uint32_t triangle) {
    for (uint32_t i = 0; i < contact->near_count; i++) {
        if (contact->near[i] == triangle) return true;
    }
    return false;
}

static void draw_scene(picture *pic, ss_contact *contact) {
    for (uint32_t t = 0; t < pic->world->triangle_count; t++) {
        double corner[3][3];
        if (is_near(contact, t)) continue;
        ss_world_triangle(pic->world, t, corner);
        for (int i = 0; i < 3; i++) ss_sub(corner[i], contact->p, corner[i]);
        draw(pic, t, corner);
    }
    for (uint32_t i = 0; i < contact->tested_count; i++) {
        draw(pic, contact->near[ss_contact_touched(contact) + i], contact->tested[i]);
    }
}

/* Fills what the caller asked for from the finished picture. */
static void develop(const picture *pic, const ss_stage *stage, const double *normal,
                    softshadow_explanation *out) {
    double seen = 0, all = 0;
    for (uint32_t row = 0; row < pic->size; row++) {
        for (uint32_t column = 0; column < pic->size; column++) {
            const size_t at = (size_t)row * pic->size + column;
            const double s = column_place(pic, column), t = -column_place(pic, row);
            const bool on = !pic->view.disk || s * s + t * t <= 1;
            const bool below = normal && ss_light_below(&pic->view, normal, s, t);
            const bool hidden = below || !isinf(pic->nearest[at]);
            const double weight = on ? ss_light_weight(stage->light, &pic->view,
                                                       stage->params->weighting, normal, s, t)
                                     : 0;
            all += weight, seen += hidden ? 0 : weight;
            if (out->image) out->image[at] = on ? (hidden ? 0.0f : 1.0f) : NAN;
            if (!on) pic->hider[at] = SOFTSHADOW_NO_PRIMITIVE;
        }
    }
    out->visibility = all > 0 ? (float)(seen / all) : 0;
}

static int by_value(const void *a, const void *b) {
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

static uint64_t count_different(uint64_t *value, size_t n) {
    uint64_t different = 0;
    qsort(value, n, sizeof *value, by_value);
    for (size_t i = 0; i < n; i++) {
        different += value[i] != SOFTSHADOW_NO_PRIMITIVE && (i == 0 || value[i] != value[i - 1]);
    }
    return different;
}

static void report_view(const picture *pic, const ss_world *world, const ss_stage *stage,
                        const double p[3], softshadow_explanation *out) {
    const bool sun = stage->light->type == SOFTSHADOW_SUN;
    for (int k = 0; k < 3; k++) {
        const double at = pic->view.centre[k] + p[k];
        out->centre[k] =
            sun ? pic->view.centre[k] : at / world->scale + world->half[k] + world->low[k];
        out->u[k] = sun ? pic->view.a[k] : pic->view.a[k] / world->scale;
        out->v[k] = sun ? pic->view.b[k] : pic->view.b[k] / world->scale;
    }
}

static softshadow_status paint(const ss_stage *stage, const ss_bvh *bvh, const ss_point *point,
                               softshadow_explanation *out) {
    const size_t pixels = (size_t)out->size * out->size;
    ss_contact *contact = ss_alloc(1, sizeof *contact);
    picture pic = {.world = stage->world, .size = out->size};
    pic.nearest = ss_alloc(pixels, sizeof *pic.nearest);
    pic.hider = ss_alloc(pixels, sizeof *pic.hider);
    softshadow_status status = SOFTSHADOW_OK;
    if (contact && pic.nearest && pic.hider) {
        for (size_t i = 0; i < pixels; i++) {
            pic.nearest[i] = INFINITY, pic.hider[i] = SOFTSHADOW_NO_PRIMITIVE;
        }
        ss_contact_find(bvh, stage->world, point, NULL, contact);
        ss_light_view(stage->light, contact->p, &pic.view);
        invert_view(&pic);
        if (!pic.view.inside) draw_scene(&pic, contact);
        const double normal[3] = {point->normal[0], point->normal[1], point->normal[2]};
        develop(&pic, stage, ss_dot(normal, normal) > 0 && !pic.view.inside ? normal : NULL, out);
        report_view(&pic, stage->world, stage, contact->p, out);
        if (out->hider) memcpy(out->hider, pic.hider, pixels * sizeof *pic.hider);
        out->triangles = count_different(pic.hider, pixels);
        if (pic.view.inside) out->visibility = 1;
    } else {
        status = ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu pixels", pixels);
    }
    ss_free(contact);
    ss_free(pic.nearest);
    ss_free(pic.hider);
    return status;
}

softshadow_status ss_engine_explain(softshadow *handle, softshadow_explanation *out) {
    const ss_built *built = &handle->built;
    if (out->size == 0 || out->size > SS_LARGEST_PICTURE) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT, "explanation.size: %u, must be 1..%u", out->size,
                       SS_LARGEST_PICTURE);
    }
    if (out->light >= built->light_count) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT, "explanation.light: %u, must be below %u", out->light,
                       built->light_count);
    }
    const ss_stage *stage = &built->stages[out->light];
    const softshadow_points points = {.position_type = SOFTSHADOW_F64, .positions = out->point,
                                      .position_stride = 24, .count = 1, .normals = out->normal,
                                      .normal_stride = 12};
    ss_point point;
    if (!ss_engine_point(stage, &points, 0, &point)) {
        return ss_fail(
            SOFTSHADOW_E_ARGUMENT,
            "explanation.point: (%g, %g, %g), must be finite, within +-1e15 and the bounds",
            out->point[0], out->point[1], out->point[2]);
    }
    softshadow_status status = SOFTSHADOW_OK;
    ss_bvh *bvh = NULL;
    if (out->primitive) {
        status = ss_engine_primitive(&handle->scene, stage, *out->primitive, &point);
    }
    if (!status && !stage->bvh) status = ss_bvh_build(&bvh, stage->world, handle->pool, NULL);
    if (!status) status = paint(stage, stage->bvh ? stage->bvh : bvh, &point, out);
    ss_bvh_destroy(bvh);
    return status;
}
