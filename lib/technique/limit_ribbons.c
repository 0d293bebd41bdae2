/* The limits of silhouettes as ribbons: [Lawlor06] 3.1, step 2. See penumbra_limit.c. */
#include <math.h>

#include "base/memory.h"
#include "base/status.h"
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

/* Where the light gets past the silhouette is looked up last: it can only make a key worse. */
static void offer(ss_limit_face *f, size_t at, float c, float q, double x, double y,
                  const double outwards[2]) {
    if (!(ss_limit_key(f, at, c, q, SS_MAP_FAR) < f->key[at])) return;
    const float open = ss_limit_open(f, x, y, outwards), key = ss_limit_key(f, at, c, q, open);
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
        offer(f, first + i, c, away * f->per_texel, run->x + i + 0.5 + foot * right[0],
              run->y + 0.5 + foot * right[1], right);
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
        offer(f, first + i, c, (float)sign * away * f->per_texel, v->x, v->y, outwards);
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

/* Something nearer hides it all along, so that offer() would refuse every texel: on a closed body half
 * of the silhouette, which never gets as far as the scan converter. */
static bool edge_hidden(const ss_limit_face *f, const ss_rim *rim, const ss_rim_edge *edge) {
    const ss_rim_vertex *a = &rim->vertex[edge->vertex[0]], *b = &rim->vertex[edge->vertex[1]];
    const double right[2] = {edge->along[1], -edge->along[0]};
    if (!(edge->length < 1024)) return false; /* also end on: nothing to look along */
    const int steps = 1 + (int)(2 * edge->length);
    for (int i = 0; i <= steps; i++) {
        const double t = (double)i / steps, x = a->x + t * (b->x - a->x), y = a->y + t * (b->y - a->y);
        const float c = (float)(a->h + t * (b->h - a->h));
        if (!(ss_limit_open(f, x, y, right) < c - f->near)) return false;
    }
    return true;
}

static softshadow_status find_hidden(const ss_limit_face *f, const ss_rim *rim, uint8_t **out) {
    *out = ss_alloc(rim->edge_count, 1);
    if (!*out) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu edges", rim->edge_count);
    for (size_t i = 0; i < rim->edge_count; i++) (*out)[i] = edge_hidden(f, rim, &rim->edge[i]);
    return SOFTSHADOW_OK;
}

softshadow_status ss_limit_ribbons(const ss_stage *stage, ss_limit_face *face,
                                   const ss_silhouette *found) {
    ss_rim_style style = {.width = width, .ctx = face->frame, .inside = true};
    uint8_t *unseen = NULL;
    ss_rim rim;
    ss_raster_triangle *triangles = NULL;
    size_t count = 0;
    ribbons r = {face, &rim};
    softshadow_status status = ss_rim_build(&rim, stage, found, face->frame, face->side);
    if (!status) status = find_hidden(face, &rim, &unseen);
    style.hidden = unseen;
    if (!status) status = ss_rim_draw(&rim, &style, &triangles, &count);
    if (!status) status = ss_raster_cpu.draw(triangles, count, 4, face->side, shade, &r, stage->pool);
    ss_free(triangles), ss_free(unseen);
    ss_rim_free(&rim);
    return status;
}
