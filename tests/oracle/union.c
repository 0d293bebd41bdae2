/* The exact area of a union of projected triangles inside the light's shape.
 *
 * Each triangle is clipped against the light's pyramid in homogeneous coordinates (S, T, W) of
 *     q - p = W c + S a + T b,
 * projected to (S/W, T/W) and becomes a convex polygon. Between two neighbouring abscissae of the
 * set {corners, crossings of edges, crossings with the rim} no two boundaries cross, so the union
 * is the same stack of intervals all along and its area is a sum of exact integrals. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "oracle/oracle.h"

#define MOST_CORNERS 12

typedef struct polygon {
    double x[MOST_CORNERS], y[MOST_CORNERS];
    int n;
} polygon;

typedef struct edge {
    double x0, y0, x1, y1; /* x0 < x1 */
} edge;

typedef struct span {
    double low, high; /* at the slab's middle */
    int below, above; /* edges; -1: the shape's own boundary */
} span;

typedef struct arrangement {
    polygon *polygons;
    size_t count;
    edge *edges;
    size_t edge_count;
    size_t *first_edge; /* of each polygon, count + 1 */
    double *cuts;
    size_t cut_count, cut_room;
} arrangement;

/* ---- Projection -------------------------------------------------------------------------------*/

static double det(const double a[3], const double b[3], const double c[3]) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/* Keeps the part of a homogeneous polygon where k . (S, T, W) + k0 >= 0. */
static int clip(double (*v)[3], int n, const double k[3], double k0) {
    double out[MOST_CORNERS + 1][3];
    int m = 0;
    for (int i = 0; i < n; i++) {
        const double *a = v[i], *b = v[(i + 1) % n];
        const double da = k[0] * a[0] + k[1] * a[1] + k[2] * a[2] + k0;
        const double db = k[0] * b[0] + k[1] * b[1] + k[2] * b[2] + k0;
        if (da >= 0) memcpy(out[m++], a, sizeof *out);
        if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
            for (int j = 0; j < 3; j++) out[m][j] = a[j] + (b[j] - a[j]) * (da / (da - db));
            m++;
        }
    }
    memcpy(v, out, (size_t)m * sizeof *out);
    return m;
}

static bool project(const double *q[3], const double p[3], const oracle_view *view, polygon *out) {
    double v[MOST_CORNERS + 1][3];
    const double whole = det(view->c, view->a, view->b);
    for (int i = 0; i < 3; i++) {
        const double d[3] = {q[i][0] - p[0], q[i][1] - p[1], q[i][2] - p[2]};
        v[i][0] = det(view->c, d, view->b) / whole;
        v[i][1] = det(view->c, view->a, d) / whole;
        v[i][2] = det(d, view->a, view->b) / whole;
    }
    int n = 3;
    static const double side[4][3] = {{1, 0, 1}, {-1, 0, 1}, {0, 1, 1}, {0, -1, 1}};
    for (int i = 0; i < 4 && n; i++) n = clip(v, n, side[i], 0);
    if (n && isfinite(view->t_end)) n = clip(v, n, (const double[3]){0, 0, -1}, view->t_end);
    out->n = 0;
    for (int i = 0; i < n; i++) {
        if (v[i][2] <= 0) continue; /* the pyramid's tip */
        out->x[out->n] = v[i][0] / v[i][2], out->y[out->n] = v[i][1] / v[i][2];
        out->n++;
    }
    return out->n >= 3;
}

/* What lies below the horizon of a normal, as one more polygon: the square on that side. */
static bool below_horizon(const double normal[3], const oracle_view *view, polygon *out) {
    double k[3] = {0}, v[MOST_CORNERS + 1][3] = {{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}};
    for (int j = 0; j < 3; j++) {
        k[0] -= normal[j] * view->a[j], k[1] -= normal[j] * view->b[j];
        k[2] -= normal[j] * view->c[j];
    }
    out->n = clip(v, 4, k, 0);
    for (int i = 0; i < out->n; i++) out->x[i] = v[i][0], out->y[i] = v[i][1];
    return out->n >= 3;
}

/* ---- The arrangement --------------------------------------------------------------------------*/

static void cut(arrangement *all, double x) {
    if (!(x > -1 && x < 1)) return;
    if (all->cut_count == all->cut_room) {
        all->cut_room = all->cut_room ? 2 * all->cut_room : 256;
        all->cuts = realloc(all->cuts, all->cut_room * sizeof(double));
        if (!all->cuts) abort();
    }
    all->cuts[all->cut_count++] = x;
}

static void cross_edges(arrangement *all, const edge *e, const edge *f) {
    const double low = fmax(e->x0, f->x0), high = fmin(e->x1, f->x1);
    if (low >= high) return;
    const double me = (e->y1 - e->y0) / (e->x1 - e->x0), mf = (f->y1 - f->y0) / (f->x1 - f->x0);
    if (me == mf) return;
    const double x = ((f->y0 - mf * f->x0) - (e->y0 - me * e->x0)) / (me - mf);
    if (x > low && x < high) cut(all, x);
}

static void cross_rim(arrangement *all, const edge *e, double radius) {
    const double dx = e->x1 - e->x0, dy = e->y1 - e->y0;
    const double A = dx * dx + dy * dy, B = e->x0 * dx + e->y0 * dy;
    const double C = e->x0 * e->x0 + e->y0 * e->y0 - radius * radius, D = B * B - A * C;
    if (D <= 0) return;
    const double roots[2] = {(-B - sqrt(D)) / A, (-B + sqrt(D)) / A};
    for (int i = 0; i < 2; i++) {
        if (roots[i] > 0 && roots[i] < 1) cut(all, e->x0 + roots[i] * dx);
    }
}

static void collect_edges(arrangement *all) {
    all->edges = malloc((all->count * MOST_CORNERS + 1) * sizeof(edge));
    all->first_edge = malloc((all->count + 1) * sizeof(size_t));
    if (!all->edges || !all->first_edge) abort();
    for (size_t i = 0; i < all->count; i++) {
        const polygon *g = &all->polygons[i];
        all->first_edge[i] = all->edge_count;
        for (int k = 0; k < g->n; k++) {
            const int l = (k + 1) % g->n;
            cut(all, g->x[k]);
            if (g->x[k] < g->x[l]) {
                all->edges[all->edge_count++] = (edge){g->x[k], g->y[k], g->x[l], g->y[l]};
            } else if (g->x[k] > g->x[l]) {
                all->edges[all->edge_count++] = (edge){g->x[l], g->y[l], g->x[k], g->y[k]};
            }
        }
    }
    all->first_edge[all->count] = all->edge_count;
    for (size_t i = 0; i < all->edge_count; i++) {
        for (size_t k = 0; k < i; k++) cross_edges(all, &all->edges[i], &all->edges[k]);
    }
}

static double height_at(const edge *e, double x) {
    return e->y0 + (e->y1 - e->y0) * ((x - e->x0) / (e->x1 - e->x0));
}

/* Integral of the rim sqrt(r^2 - x^2). */
static double arc(double x0, double x1, double r) {
    const double a = fmin(1, fmax(-1, x0 / r)), b = fmin(1, fmax(-1, x1 / r));
    return r * r / 2 * (b * sqrt(1 - b * b) + asin(b) - a * sqrt(1 - a * a) - asin(a));
}

static double under(const arrangement *all, int which, double sign, double x0, double x1,
                    double radius) {
    if (which >= 0) {
        return height_at(&all->edges[which], (x0 + x1) / 2) * (x1 - x0);
    }
    return sign * (radius > 0 ? arc(x0, x1, radius) : x1 - x0);
}

static int by_low(const void *a, const void *b) {
    const double d = ((const span *)a)->low - ((const span *)b)->low;
    return (d > 0) - (d < 0);
}

/* A polygon's interval at x, cut to the shape; false if there is none. */
static bool span_at(const arrangement *all, size_t i, double x, double rim, span *out) {
    *out = (span){INFINITY, -INFINITY, -1, -1};
    for (size_t e = all->first_edge[i]; e < all->first_edge[i + 1]; e++) {
        if (!(all->edges[e].x0 <= x && x <= all->edges[e].x1)) continue;
        const double y = height_at(&all->edges[e], x);
        if (y < out->low) out->low = y, out->below = (int)e;
        if (y > out->high) out->high = y, out->above = (int)e;
    }
    /* An edge may touch the rim at this very x, as the pyramid's own sides do: to both sides of it
     * the rim is what bounds. 1e-9: far below any area that matters, far above rounding. */
    if (out->low < -rim * (1 - 1e-9)) out->low = -rim, out->below = -1;
    if (out->high > rim * (1 - 1e-9)) out->high = rim, out->above = -1;
    return out->low < out->high;
}

static double slab(const arrangement *all, double x0, double x1, double radius, span *spans) {
    const double x = (x0 + x1) / 2;
    const double rim = radius > 0 ? sqrt(fmax(0, radius * radius - x * x)) : 1;
    size_t n = 0;
    for (size_t i = 0; i < all->count; i++) n += span_at(all, i, x, rim, &spans[n]);
    qsort(spans, n, sizeof *spans, by_low);
    double area = 0;
    for (size_t i = 0; i < n;) {
        span run = spans[i++];
        while (i < n && spans[i].low <= run.high) {
            if (spans[i].high > run.high) run.high = spans[i].high, run.above = spans[i].above;
            i++;
        }
        area +=
            under(all, run.above, 1, x0, x1, radius) - under(all, run.below, -1, x0, x1, radius);
    }
    return area;
}

static int by_value(const void *a, const void *b) {
    const double d = *(const double *)a - *(const double *)b;
    return (d > 0) - (d < 0);
}

/* Hidden area: within the disk of that radius, or (radius 0) the square. */
static double hidden_area(arrangement *all, double radius) {
    const size_t kept = all->cut_count;
    if (radius > 0) {
        for (size_t i = 0; i < all->edge_count; i++) cross_rim(all, &all->edges[i], radius);
    }
    const double end = radius > 0 ? radius : 1;
    const size_t n = all->cut_count + 2;
    double *x = malloc(n * sizeof *x), area = 0;
    span *spans = malloc((all->count + 1) * sizeof *spans);
    if (!x || !spans) abort();
    if (all->cut_count) memcpy(x, all->cuts, all->cut_count * sizeof *x);
    x[n - 2] = -end, x[n - 1] = end;
    qsort(x, n, sizeof *x, by_value);
    for (size_t i = 0; i + 1 < n; i++) {
        if (x[i] >= -end && x[i + 1] <= end && x[i] < x[i + 1]) {
            area += slab(all, x[i], x[i + 1], radius, spans);
        }
    }
    free(x);
    free(spans);
    all->cut_count = kept;
    return area;
}

static void arrange(arrangement *all, const scene_mesh *mesh, const oracle_view *view,
                    const double p[3], const double normal[3]) {
    *all = (arrangement){0};
    all->polygons = malloc((mesh->triangles + 1) * sizeof(polygon));
    if (!all->polygons) abort();
    for (size_t i = 0; i < mesh->triangles; i++) {
        const double *q[3];
        for (int k = 0; k < 3; k++) q[k] = mesh->xyz + 3 * (size_t)mesh->indices[3 * i + k];
        all->count += project(q, p, view, &all->polygons[all->count]);
    }
    if (normal) all->count += below_horizon(normal, view, &all->polygons[all->count]);
    collect_edges(all);
}

static void dismantle(arrangement *all) {
    free(all->polygons);
    free(all->edges);
    free(all->first_edge);
    free(all->cuts);
}

double oracle_union(const scene_mesh *mesh, const softshadow_light *light, const double p[3],
                    const double normal[3]) {
    const oracle_view view = oracle_see(light, p);
    if (view.inside) return 1;
    arrangement all;
    arrange(&all, mesh, &view, p, normal);
    const double hidden = hidden_area(&all, view.disk ? 1 : 0);
    dismantle(&all);
    return fmin(1, fmax(0, 1 - hidden / (view.disk ? SCENE_PI : 4)));
}

/* With H(rho) the hidden area within rho: hidden weight = int w dH, midpoint rings; exact in H. */
double oracle_union_profile(const scene_mesh *mesh, const softshadow_light *light,
                            const double p[3], double (*profile)(double rho, void *user),
                            void *user, unsigned rings) {
    const oracle_view view = oracle_see(light, p);
    arrangement all;
    arrange(&all, mesh, &view, p, NULL);
    double hidden = 0, whole = 0, before = 0;
    for (unsigned i = 0; i < rings; i++) {
        const double r0 = (double)i / rings, r1 = (i + 1.0) / rings;
        const double now = hidden_area(&all, r1);
        const double weight = profile(sqrt((r0 * r0 + r1 * r1) / 2), user);
        hidden += weight * (now - before);
        whole += weight * SCENE_PI * (r1 * r1 - r0 * r0);
        before = now;
    }
    dismantle(&all);
    return 1 - hidden / whole;
}
