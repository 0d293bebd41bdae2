/* Fitting light-space frames, and taking points into them. See frame.h for the geometry. */
#include "map/frame.h"

#include <math.h>
#include <pthread.h>
#include <string.h>

#include "base/cpu.h"
#include "base/status.h"
#include "base/vec.h"
#include "map/look.h"

/* Widest half opening of a single perspective frame, as a tangent: beyond it texels at the rim are
 * five times those in the middle and a cube is better. */
#define WIDEST 2.0
/* The near plane as a share of the reference distance. */
#define NEAREST 0x1p-10

typedef struct box {
    double low[3], high[3];
} box;

static void corner_of(const box *b, int i, double out[3]) {
    for (int k = 0; k < 3; k++) out[k] = i >> k & 1 ? b->high[k] : b->low[k];
}

static box box_of_casters(const ss_world *world) {
    box b;
    for (int k = 0; k < 3; k++) b.low[k] = world->bounds[k], b.high[k] = world->bounds[3 + k];
    return b;
}

static double diagonal(const box *b) {
    double d[3];
    ss_sub(b->high, b->low, d);
    return ss_length(d);
}

/* The radius that rate is made of. A rect is taken as the disk of its area, an ellipse likewise, or
 * as the one around it by those who look at all of it; what is a disk only for some directions is
 * one for all. */
static double radius_of(const ss_light *light, bool all) {
    if (all) return light->radius;
    const double u = ss_length(light->u), v = ss_length(light->v);
    if (light->type == SOFTSHADOW_RECT) return sqrt(4 * u * v / M_PI);
    return light->ellipse ? sqrt(u * v) : light->radius;
}

/* ---- one frame ------------------------------------------------------------------------------ */

static void set_axes(ss_frame *frame, const double z[3]) {
    memcpy(frame->z, z, sizeof frame->z);
    ss_basis(frame->z, frame->x, frame->y);
}

/* Along the sides of a rect, so that its shape stands straight in the map; unchanged if it has
 * none. */
static void sides_of(const ss_light *light, double x[3], double y[3]) {
    double u[3], v[3];
    memcpy(u, light->u, sizeof u);
    memcpy(v, light->v, sizeof v);
    if (!ss_normalize(u) || !ss_normalize(v)) return;
    memcpy(x, u, sizeof u);
    memcpy(y, v, sizeof v);
}

/* A perspective frame from the light's centre along z, its reference plane at that distance. */
static void place(ss_frame *frame, const ss_light *light, double distance, double radius) {
    ss_add_scaled(light->centre, distance, frame->z, frame->origin);
    frame->inverse = 1 / distance;
    frame->nearest = -distance * (1 - NEAREST);
    frame->rate = radius / distance;
}

/* A box in X, Y and h. */
typedef struct extent {
    double low[3], high[3];
    bool empty, cut; /* cut: something of it lies before the near plane */
} extent;

static const extent no_extent = {
    {INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, true, false};

static void extend(extent *e, const ss_frame *frame, const double p[3]) {
    double d[3], c[3];
    ss_sub(p, frame->origin, d);
    for (int r = 0; r < 3; r++) {
        const double *axis = r == 0 ? frame->x : r == 1 ? frame->y : frame->z;
        c[r] = d[0] * axis[0] + d[1] * axis[1] + d[2] * axis[2];
    }
    if (!(c[2] > frame->nearest)) {
        e->cut = true;
        return;
    }
    const double s = 1 / (1 + c[2] * frame->inverse);
    for (int k = 0; k < 3; k++) { /* not fmin and fmax, which are calls */
        const double at = c[k] * s;
        if (at < e->low[k]) e->low[k] = at;
        if (at > e->high[k]) e->high[k] = at;
    }
    e->empty = false;
}

static extent extent_of_box(const ss_frame *frame, const box *b) {
    extent e = no_extent;
    for (int i = 0; i < 8; i++) {
        double p[3];
        corner_of(b, i, p);
        extend(&e, frame, p);
    }
    return e;
}

/* Where the segment from p (before the near plane) to q (behind it) crosses. */
static void extend_crossing(extent *e, const ss_frame *frame, const double p[3],
                            const double q[3]) {
    double dp[3], dq[3], at[3];
    ss_sub(p, frame->origin, dp);
    ss_sub(q, frame->origin, dq);
    const double zp = ss_dot(dp, frame->z), zq = ss_dot(dq, frame->z);
    /* a little behind the plane, so that the crossing itself counts as seen */
    const double z = frame->nearest + 1e-6 / frame->inverse;
    if (!(zp < z && z < zq)) return;
    const double t = (z - zp) / (zq - zp);
    for (int k = 0; k < 3; k++) at[k] = p[k] + t * (q[k] - p[k]);
    extend(e, frame, at);
}

/* The sum of many parts' extents; min and max, so the order of parts does not matter. */
typedef struct measuring {
    const ss_frame *frame;
    const ss_world *world;
    const extent *region; /* only casters that can shadow it; NULL: all */
    double opening;       /* tangent of what the frame sees; only casters that reach into it */
    bool cut;             /* some vertex lies before the near plane */
    pthread_mutex_t lock;
    extent sum;
} measuring;

static void merge(measuring *m, const extent *e) {
    pthread_mutex_lock(&m->lock);
    for (int k = 0; k < 3; k++) {
        m->sum.low[k] = fmin(m->sum.low[k], e->low[k]);
        m->sum.high[k] = fmax(m->sum.high[k], e->high[k]);
    }
    m->sum.empty &= e->empty, m->sum.cut |= e->cut;
    pthread_mutex_unlock(&m->lock);
}

static softshadow_status measure_vertices(void *ctx, uint64_t begin, uint64_t end) {
    measuring *m = ctx;
    extent e = no_extent;
    for (uint64_t v = begin; v < end; v++) {
        const float *f = m->world->vertices + 3 * v;
        extend(&e, m->frame, (double[3]){f[0], f[1], f[2]});
    }
    merge(m, &e);
    return SOFTSHADOW_OK;
}

/* Can a caster of this extent shadow anything in the region? */
static bool shadows(const ss_frame *frame, const extent *caster, const extent *region) {
    if (caster->empty || !(caster->low[2] <= region->high[2])) return false;
    const double reach = frame->rate * (region->high[2] - caster->low[2]);
    return caster->low[0] <= region->high[0] + reach && caster->high[0] >= region->low[0] - reach &&
           caster->low[1] <= region->high[1] + reach && caster->high[1] >= region->low[1] - reach;
}

static void join(extent *sum, const extent *e) {
    for (int k = 0; k < 3; k++) {
        if (e->low[k] < sum->low[k]) sum->low[k] = e->low[k];
        if (e->high[k] > sum->high[k]) sum->high[k] = e->high[k];
    }
    sum->empty &= e->empty;
}

/* Is it beside what the frame sees, by more than the light's radius? Whatever goes from the light
 * to a point in view then passes it by. */
static bool beside(const measuring *m, double p[3][3]) {
    const ss_frame *f = m->frame;
    if (!(f->inverse > 0)) return false;
    const double radius = f->rate / f->inverse, far = radius * hypot(1, m->opening);
    uint32_t out = 31; /* right, left, above, below, behind: of all corners so far */
    for (int i = 0; i < 3; i++) {
        double d[3];
        ss_sub(p[i], f->origin, d);
        const double x = ss_dot(d, f->x), y = ss_dot(d, f->y), z = ss_dot(d, f->z) + 1 / f->inverse;
        const double most = m->opening * z + far;
        out &= (uint32_t)(x > most) | (uint32_t)(-x > most) << 1 | (uint32_t)(y > most) << 2 |
               (uint32_t)(-y > most) << 3 | (uint32_t)(z < -radius) << 4;
    }
    return out;
}

static softshadow_status measure_triangles(void *ctx, uint64_t begin, uint64_t end) {
    measuring *m = ctx;
    extent e = no_extent;
    for (uint64_t t = begin; t < end; t++) {
        double p[3][3];
        for (int i = 0; i < 3; i++) {
            const float *f = m->world->vertices + 3 * (size_t)m->world->indices[3 * t + (size_t)i];
            for (int k = 0; k < 3; k++) p[i][k] = f[k];
        }
        extent one = no_extent;
        if (beside(m, p)) continue;
        for (int i = 0; i < 3; i++) {
            extend(&one, m->frame, p[i]);
            if (!m->cut) continue;
            extend_crossing(&one, m->frame, p[i], p[(i + 1) % 3]);
            extend_crossing(&one, m->frame, p[(i + 1) % 3], p[i]);
        }
        if (!m->region || shadows(m->frame, &one, m->region)) join(&e, &one);
    }
    merge(m, &e);
    return SOFTSHADOW_OK;
}

/* Who measures, and what went wrong: nothing but a host's scheduler that does not do all. */
typedef struct workers {
    ss_pool *pool;
    softshadow_status status;
} workers;

static void share(workers *work, uint64_t count, ss_body *body, void *ctx) {
    if (!work->status) work->status = ss_parallel_for(work->pool, count, 16384, body, ctx);
}

/* Of the casters themselves, as the corners of their box can be far outside, and of those only that
 * can shadow the region. What lies before the near plane is clipped away. */
static extent extent_of_casters(const ss_frame *frame, const ss_world *world, const extent *region,
                                double opening, workers *work) {
    measuring m = {.frame = frame, .world = world, .opening = opening, .sum = no_extent};
    pthread_mutex_init(&m.lock, NULL);
    share(work, world->vertex_count, measure_vertices, &m);
    m.cut = m.sum.cut;
    if (region && !m.cut) { /* all of them inside: none to leave out */
        const double reach = frame->rate * (region->high[2] - m.sum.low[2]);
        bool within = m.sum.high[2] <= region->high[2];
        for (int k = 0; k < 2; k++) {
            within &=
                m.sum.low[k] >= region->low[k] - reach && m.sum.high[k] <= region->high[k] + reach;
        }
        if (!within) m.region = region;
    }
    if (m.cut || m.region) {
        m.sum = no_extent;
        m.region = region;
        share(work, world->triangle_count, measure_triangles, &m);
    }
    pthread_mutex_destroy(&m.lock);
    return m.sum;
}

/* Is all of the box within the opening, in front of the near plane? */
static bool holds(const ss_frame *frame, const box *b) {
    const extent e = extent_of_box(frame, b);
    const double widest = frame->inverse > 0 ? WIDEST / frame->inverse : INFINITY;
    return !e.cut && e.low[0] >= -widest && e.low[1] >= -widest && e.high[0] <= widest &&
           e.high[1] <= widest;
}

/* ---- how much of a frame is needed ---------------------------------------------------------- */

/* A receiver's h at least as deep as any that is asked: the bounds' farthest corner, or without
 * bounds one casters' diagonal behind the last caster. */
static double farthest(const ss_frame *frame, const ss_fit *fit, const box *casters) {
    box b = *casters;
    if (fit->bounded) memcpy(&b, fit->bounds, sizeof b);
    double z = -INFINITY;
    for (int i = 0; i < 8; i++) {
        double p[3], d[3];
        corner_of(&b, i, p);
        ss_sub(p, frame->origin, d);
        z = fmax(z, ss_dot(d, frame->z));
    }
    if (!fit->bounded) z += diagonal(casters);
    z = fmax(z, frame->nearest / 2); /* behind the light: nothing of it will be kept */
    return z / (1 + z * frame->inverse);
}

static void widen(extent *e, double by) {
    for (int k = 0; k < 2; k++) e->low[k] -= by, e->high[k] += by;
}

static void cut_to(extent *e, const double low[2], const double high[2]) {
    for (int k = 0; k < 2; k++) {
        e->low[k] = fmax(e->low[k], low[k]), e->high[k] = fmin(e->high[k], high[k]);
        if (!(e->low[k] <= e->high[k])) e->empty = true;
    }
}

static void cut_to_extent(extent *e, const extent *window) { cut_to(e, window->low, window->high); }

/* How much longer than at the axis a sphere's penumbra is, at most, in the extent. */
static double longest(const ss_frame *frame, const extent *e) {
    double square = 1;
    for (int k = 0; k < 2; k++) {
        const double tangent = fmax(fabs(e->low[k]), fabs(e->high[k])) * frame->inverse;
        square += tangent * tangent;
    }
    return sqrt(square);
}

/* Texels around what is asked: a filter's reach and a ring that holds nothing. Small maps, whose
 * texels are dear, have only the reach of 2 x 2. */
static uint32_t border_of(uint32_t resolution) { return resolution < 64 ? 1 : 2; }

/* Sets the frame's window; false: no point that is asked can be shadowed here. */
static bool fit_window(ss_frame *frame, const ss_fit *fit, const box *casters, double opening,
                       workers *work) {
    const double reach = frame->inverse > 0 ? opening / frame->inverse : INFINITY;
    extent view = {{-reach, -reach, -INFINITY}, {reach, reach, INFINITY}, false, false},
           region = view;
    frame->far_h = farthest(frame, fit, casters);
    if (fit->bounded) {
        box b;
        memcpy(&b, fit->bounds, sizeof b);
        const extent asked = extent_of_box(frame, &b);
        if (asked.empty) return false;
        if (!asked.cut) cut_to_extent(&region, &asked);
    }
    region.high[2] = frame->far_h;
    if (region.empty) return false;
    extent need = extent_of_casters(frame, fit->world, fit->bounded ? &region : NULL, opening,
                                    work);
    if (need.empty || need.low[2] > frame->far_h) return false;
    frame->near_h = need.low[2];
    double most = frame->rate * (frame->far_h - frame->near_h);
    if (fit->margin) most *= longest(frame, &need);
    widen(&need, most);
    cut_to_extent(&need, &region);
    if (need.empty) return false;
    if (fit->margin) widen(&need, most), cut_to_extent(&need, &view);
    double side = fmax(need.high[0] - need.low[0], need.high[1] - need.low[1]);
    const uint32_t n = fit->resolution;
    const double used = n > 4 ? n - 2 * border_of(n) : 1;
    if (!(side > 0)) side = 0x1p-20; /* a point or nothing at all */
    frame->texel = side * (1 + 1e-9) / used;
    for (int k = 0; k < 2; k++) {
        frame->low[k] = (need.low[k] + need.high[k]) / 2 - frame->texel * n / 2;
    }
    return true;
}

/* ---- which frames --------------------------------------------------------------------------- */

static void fit_sun(ss_frames *out, const ss_fit *fit, const box *casters, workers *work) {
    ss_frame *frame = &out->face[0];
    double z[3];
    for (int k = 0; k < 3; k++) {
        z[k] = -fit->light->normal[k];
        frame->origin[k] = (casters->low[k] + casters->high[k]) / 2;
    }
    set_axes(frame, z);
    frame->nearest = -INFINITY;
    frame->rate = out->radius;
    out->count = fit_window(frame, fit, casters, INFINITY, work);
}

/* The axis of a single frame: a flat light's normal, on the casters' side; for a sphere towards the
 * middle of what it must see. */
static bool aim(ss_frame *frame, const ss_light *light, const box *b, double radius) {
    double to[3], z[3];
    for (int k = 0; k < 3; k++) to[k] = (b->low[k] + b->high[k]) / 2 - light->centre[k];
    const bool flat = light->type != SOFTSHADOW_SPHERE && ss_dot(light->normal, light->normal) > 0;
    memcpy(z, flat ? light->normal : to, sizeof z);
    for (int k = 0; k < 3 && ss_dot(to, light->normal) < 0 && flat; k++) z[k] = -light->normal[k];
    if (!ss_normalize(z)) return false;
    const double distance = ss_dot(to, z);
    if (!(distance > 0)) return false;
    set_axes(frame, z);
    if (light->type == SOFTSHADOW_RECT) sides_of(light, frame->x, frame->y);
    place(frame, light, distance, radius);
    return holds(frame, b);
}

/* Six faces, 2 k for +axis k and 2 k + 1 for -axis k. */
static void fit_cube(ss_frames *out, const ss_fit *fit, const box *casters, workers *work) {
    const ss_light *light = fit->light;
    double distance = 0;
    for (int i = 0; i < 8; i++) {
        double p[3], d[3];
        corner_of(casters, i, p);
        ss_sub(p, light->centre, d);
        distance = fmax(distance, ss_length(d) / 2);
    }
    out->cube = true;
    memcpy(out->centre, light->centre, sizeof out->centre);
    const bool flat = light->type != SOFTSHADOW_SPHERE && ss_dot(light->normal, light->normal) > 0;
    for (int k = 0; k < 3; k++) out->axes[2][k] = flat ? light->normal[k] : k == 2;
    ss_basis(out->axes[2], out->axes[0], out->axes[1]);
    if (flat && light->type == SOFTSHADOW_RECT) sides_of(light, out->axes[0], out->axes[1]);
    for (int i = 0; i < SS_MAP_FACES; i++) {
        ss_frame *frame = &out->face[out->count];
        const int a = i / 2;
        *frame = (ss_frame){0};
        for (int k = 0; k < 3; k++) {
            frame->z[k] = i & 1 ? -out->axes[a][k] : out->axes[a][k];
            frame->x[k] = out->axes[(a + 1) % 3][k], frame->y[k] = out->axes[(a + 2) % 3][k];
        }
        place(frame, light, distance, out->radius);
        out->face_of[i] = -1;
        const double opening = fit->margin ? WIDEST : 1 + 4.0 / fit->resolution;
        if (!fit_window(frame, fit, casters, opening, work)) continue;
        out->face_of[i] = (int8_t)out->count++;
    }
}

/* The part of the casters' box that can be between the light and the bounds: inside the box around
 * both. Far casters then turn no frame away from what it is for. */
static box relevant(const ss_fit *fit, const box *casters, double radius) {
    box b = *casters;
    for (int k = 0; k < 3 && fit->bounded; k++) {
        const bool sun = fit->light->type == SOFTSHADOW_SUN;
        const double centre = fit->light->centre[k];
        const double low = sun ? -INFINITY : fmin(fit->bounds[k], centre - radius);
        const double high = sun ? INFINITY : fmax(fit->bounds[3 + k], centre + radius);
        b.low[k] = fmin(fmax(b.low[k], low), b.high[k]);
        b.high[k] = fmax(fmin(b.high[k], high), b.low[k]);
    }
    return b;
}

softshadow_status ss_frames_fit(ss_frames *out, const ss_fit *fit, ss_pool *pool) {
    workers work = {pool, SOFTSHADOW_OK};
    *out = (ss_frames){.resolution = fit->resolution, .radius = radius_of(fit->light, fit->margin),
                       .rung = (int)ss_cpu_rung()};
    if (fit->world->triangle_count == 0) return SOFTSHADOW_OK;
    const box all = box_of_casters(fit->world), casters = relevant(fit, &all, out->radius);
    box b;
    memcpy(&b, fit->bounds, sizeof b);
    if (fit->light->type == SOFTSHADOW_SUN) {
        fit_sun(out, fit, &casters, &work);
    } else if (aim(&out->face[0], fit->light, &casters, out->radius) ||
               (fit->bounded && aim(&out->face[0], fit->light, &b, out->radius))) {
        out->count = fit_window(&out->face[0], fit, &casters, 2 * WIDEST, &work);
    } else {
        fit_cube(out, fit, &casters, &work);
    }
    return work.status;
}

bool ss_frame_mirrored(const ss_frame *frame) {
    double across[3];
    ss_cross(frame->x, frame->y, across);
    return ss_dot(across, frame->z) > 0;
}

void ss_frame_depth(const ss_frame *frame, double depth[2]) {
    depth[0] = (frame->far_h + frame->near_h) / 2;
    depth[1] = fmax((frame->far_h - frame->near_h) / 2, 0x1p-40);
}

void ss_frame_matrix(const ss_frame *frame, const ss_world *world, uint32_t resolution,
                     double matrix[16]) {
    /* local = host * scale - shift; homogeneous (X w, Y w, h w, w) is linear in local coordinates.
     */
    double rows[4][4] = {{0}};
    const double *axis[3] = {frame->x, frame->y, frame->z};
    for (int r = 0; r < 3; r++) {
        for (int k = 0; k < 3; k++) {
            rows[r][k] = axis[r][k] * world->scale;
            rows[r][3] -=
                axis[r][k] * ((world->low[k] + world->half[k]) * world->scale + frame->origin[k]);
        }
    }
    for (int k = 0; k < 4; k++) rows[3][k] = rows[2][k] * frame->inverse + (k == 3);
    const double half = frame->texel * resolution / 2;
    double depth[2];
    ss_frame_depth(frame, depth);
    const double middle[3] = {frame->low[0] + half, frame->low[1] + half, depth[0]};
    const double size[3] = {half, half, depth[1]};
    for (int r = 0; r < 4; r++) {
        for (int k = 0; k < 4; k++) {
            matrix[4 * r + k] =
                r < 3 ? (rows[r][k] - middle[r] * rows[3][k]) / size[r] : rows[3][k];
        }
    }
}

/* ---- points --------------------------------------------------------------------------------- */

/* Outside of the map, or NaN from a division by nothing: the corner, which holds nothing. */
static inline void settle(ss_looks *out, size_t i, bool seen, float most) {
    const bool in =
        seen && out->x[i] >= 0 && out->y[i] >= 0 && out->x[i] < most && out->y[i] < most;
    out->x[i] = in ? out->x[i] : 0;
    out->y[i] = in ? out->y[i] : 0;
    out->h[i] = in ? out->h[i] : -SS_MAP_FAR;
}

static void look_cube(const ss_frames *frames, const ss_places *places, size_t n, ss_looks *out) {
    const float most = (float)frames->resolution;
    const uint32_t texels = frames->resolution * frames->resolution;
    out->nearest = INFINITY;
    for (size_t i = 0; i < (n + 7) / 8 * 8; i++) {
        const double p[3] = {places->at[0][i], places->at[1][i], places->at[2][i]};
        double d[3], along[3], at[3] = {0, 0, 0};
        ss_sub(p, frames->centre, d);
        const double square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        if (square < out->nearest) out->nearest = square;
        int a = 0;
        for (int k = 0; k < 3; k++) along[k] = ss_dot(d, frames->axes[k]);
        for (int k = 1; k < 3; k++) a = fabs(along[k]) > fabs(along[a]) ? k : a;
        const int face = frames->face_of[2 * a + (along[a] < 0)];
        const bool seen =
            face >= 0 && ss_frame_project(&frames->face[face < 0 ? 0 : face], p, at);
        for (int k = 0; k < 3; k++) at[k] = fmax(-1e30, fmin(1e30, at[k]));
        out->x[i] = (float)at[0], out->y[i] = (float)at[1], out->h[i] = (float)at[2];
        out->face[i] = (uint8_t)(face < 0 ? 0 : face);
        out->base[i] = out->face[i] * texels;
        settle(out, i, seen, most);
    }
}

static ss_look_single *const look_single[] = SS_RUNGS(ss_look_single);

void ss_frames_look(const ss_frames *frames, const ss_places *places, size_t n, ss_looks *out) {
    out->places = places;
    if (frames->cube) look_cube(frames, places, n, out);
    else look_single[frames->rung](frames, places, n, out);
}
