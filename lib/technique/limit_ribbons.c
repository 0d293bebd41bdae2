/* The limits of silhouettes as ribbons: [Lawlor06] 3.1, step 2. See penumbra_limit.c. */
#include <math.h>

#include "base/memory.h"
#include "technique/limit.h"

typedef struct ribbons {
    ss_limit_face *face;
    const ss_rim *rim;
} ribbons;

static float depth_near(const ss_limit_face *f, double x, double y) {
    const double most = f->side - 1;
    const uint32_t column = (uint32_t)(x > 0 ? x < most ? x : most : 0);
    const uint32_t row = (uint32_t)(y > 0 ? y < most ? y : most : 0);
    return f->depth[(size_t)row * f->side + column];
}

/* The depth a little outside of it, where its own surface has ended: one texel and a half away, or
 * two and a half where a bend is still in the way. Above c: something nearer hides the silhouette. */
float ss_limit_open(const ss_limit_face *f, double x, double y, const double outwards[2]) {
    const float near = depth_near(f, x + 1.5 * outwards[0], y + 1.5 * outwards[1]);
    const float far = depth_near(f, x + 2.5 * outwards[0], y + 2.5 * outwards[1]);
    return near > far ? near : far;
}

/* Outside of the silhouette a texel counts only where its own surface lies below c (else that
 * surface hides the light), and only down to where the penumbra has not begun on it ([WH03] line
 * 4), raised as ribbons are. Within a texel of the edge snapping decides what covers the centre:
 * those count. */
static bool outside_matters(const ss_limit_face *f, float depth, float c, float q) {
    if (q <= f->per_texel) return depth > c - f->near;
    return depth > c && c + q < depth + SS_LIMIT_RAISE * f->per_texel;
}

/* Whom a ribbon is for: outside, the surface in the map; inside, what is far below the occluder. */
static float receiver_of(const ss_limit_face *f, float depth, float c, float q) {
    const float far = (float)f->frame->far_h, most = depth < far && q > 0 ? depth : far;
    return most > c + f->near ? most : c + f->near;
}

/* The distance from the hard shadow in light radii, as that receiver sees it. Where light that
 * passes the silhouette meets another surface before it, only what passes between the two is left:
 * so little that an outline further away tells more. */
static float away_of(const ss_limit_face *f, float depth, float c, float q, float open) {
    const float receiver = receiver_of(f, depth, c, q), away = fabsf(q) / (receiver - c);
    if (q > 0 || !(open + f->near < receiver) || !(away < 1)) return away;
    const float behind = fabsf(q) / (receiver - (open > c ? open : c));
    return 1 - ((behind < 1 ? behind : 1) - away);
}

float ss_limit_key(const ss_limit_face *f, size_t texel, float c, float q, float open) {
    const float depth = f->depth[texel];
    if (open < c - f->near || (q > 0 && !outside_matters(f, depth, c, q))) return INFINITY;
    return f->highest ? c + fabsf(q) : away_of(f, depth, c, q, open);
}

static void offer(ss_limit_face *f, size_t at, float c, float q, float open) {
    const float key = ss_limit_key(f, at, c, q, open);
    if (!(key < f->key[at])) return;
    float *texel = f->texels + at * LIMIT_CHANNELS;
    f->key[at] = key;
    texel[LIMIT_C] = c, texel[LIMIT_Q] = q, texel[LIMIT_B] = open;
}

static void shade_strip(const ribbons *r, const ss_raster_run *run) {
    const ss_rim_edge *edge = &r->rim->edge[run->tag / SS_RIM_TAG];
    ss_limit_face *f = r->face;
    const double right[2] = {edge->along[1], -edge->along[0]};
    const double wide = ss_rim_stretch(&r->rim->vertex[edge->vertex[0]], right);
    const size_t first = (size_t)run->y * f->side + run->x;
    for (uint32_t i = 0; i < run->n; i++) {
        const float away = run->attribute[0][i], c = run->attribute[1][i];
        const double foot = -wide * away;
        const double x = run->x + i + 0.5 + foot * right[0], y = run->y + 0.5 + foot * right[1];
        offer(f, first + i, c, away * f->per_texel, ss_limit_open(f, x, y, right));
    }
}

/* Around a vertex; a whole disc (where more than two edges meet) is inside where the texel is
 * covered. */
static void shade_corner(const ribbons *r, const ss_raster_run *run) {
    const ss_rim_vertex *v = &r->rim->vertex[run->tag / SS_RIM_TAG];
    ss_limit_face *f = r->face;
    const bool disc = run->tag & SS_RIM_DISC;
    const size_t first = (size_t)run->y * f->side + run->x;
    for (uint32_t i = 0; i < run->n; i++) {
        const float c = run->attribute[1][i], away = ss_rim_away(run, i);
        const double dx = run->attribute[0][i], dy = run->attribute[2][i],
                     length = sqrt(dx * dx + dy * dy);
        bool inside = run->tag & SS_RIM_INSIDE;
        if (disc) inside = f->depth[first + i] < c + f->near;
        const double sign = inside ? -1 : 1, per = length > 0 ? sign / length : 0;
        const double outwards[2] = {dx * per, dy * per};
        offer(f, first + i, c, (float)sign * away * f->per_texel,
              ss_limit_open(f, v->x, v->y, outwards));
    }
}

static void shade(void *ctx, const ss_raster_run *run) {
    if (run->tag & SS_RIM_CORNER) shade_corner(ctx, run);
    else shade_strip(ctx, run);
}

/* The penumbra's half width at the farthest receiver, raised. */
static double width(const void *ctx, const ss_rim_vertex *vertex) {
    const ss_frame *frame = ctx;
    return fmax(0, ss_frame_rate(frame) * (frame->far_h - vertex->h)) + SS_LIMIT_RAISE;
}

softshadow_status ss_limit_ribbons(const ss_stage *stage, ss_limit_face *face,
                                   const ss_silhouette *found) {
    const ss_rim_style style = {.width = width, .ctx = face->frame, .inside = true};
    ss_rim rim;
    ss_raster_triangle *triangles = NULL;
    size_t count = 0;
    ribbons r = {face, &rim};
    softshadow_status status = ss_rim_build(&rim, stage, found, face->frame, face->side);
    if (!status) status = ss_rim_draw(&rim, &style, &triangles, &count);
    if (!status) status = ss_raster_cpu.draw(triangles, count, 4, face->side, shade, &r, stage->pool);
    ss_free(triangles);
    ss_rim_free(&rim);
    return status;
}
