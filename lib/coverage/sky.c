/* What hides something of a light, as a map of the nearness beyond which nothing is hidden.
 *
 * For a light in a ball of radius R around c, say a caster's point X is in the hull of p and the
 * ball but not in the ball. The line through p and X then passes c at R at most: with the angle w
 * between X - c and p - c, and a = 1 / |X - c| >= b = 1 / |p - c|,
 *     sin w <= R |p - X| a b,  |p - X|^2 a^2 b^2 = (a - b)^2 + 4 a b sin^2(w/2),
 * so that 4 sin^2(w/2) (1 - sin^2(w/2) - a b R^2) <= R^2 (a - b)^2. The bracket is at least 1 - k
 * with k = (a R)^2, as long as k <= 1/2: it is where b = a, and no less for smaller b, because
 * sin^2(w/2) <= R^2 (a - b)^2 / 4 / bracket grows by less than a b R^2 falls. Hence
 *     2 sin(w/2) <= R (a - b) / sqrt(1 - k).
 * On the stereographic plane, lengths in units of D, two directions w apart are
 *     2 sin(w/2) sqrt((1 + u^2/4) (1 + v^2/4))
 * apart, u and v their own distances from its middle. So p is hidden by X only if
 *     distance on the plane <= width (nearness of X - nearness of p),
 *     width = R / D / sqrt(1 - k) (1 + T^2/4), T the largest of u, v;
 * under a sun the same holds, with width = tan(angle), of plain distances. Turned round: p is lit
 * if its nearness is above
 *     max over X of (nearness of X - distance / width),
 * and that is what the map holds: casters are drawn into it by their largest nearness in each
 * texel, and then each texel looks at all others by a chamfer distance that is nowhere more than
 * the true one [Bor86].
 *
 * Texels are squares: two points in them are nearer to each other than the texels' middles by up to
 * sqrt 2 texels, which is taken off all distances: each texel first takes what its neighbours have.
 * (No more: what is no nearer to the light than p does not hide it, however close by.) What floats
 * and contact move, points and casters, is less than ROOM. SPARE is for whoever draws: what is this
 * far beside the light cannot cover a sample of it by rounding either. */
#include "coverage/sky.h"

#include <float.h>
#include <math.h>

#include "base/vec.h"
#include "coverage/sky_parts.h"
#include "trace/bvh_node.h"
#include "trace/contact.h"

#define SIDE    512      /* texels */
#define ROOM    SS_SKY_ROOM
#define SURE    0x1p-18  /* lengths of edges, and heights over them, that lines are told from */
#define SPARE   0x1p-5   /* of the light's radius */
#define NARROW  0x1p-10  /* a width: points lights are no more than that, and it keeps slopes finite */
#define DISTANT 0x1p+20  /* a light farther than this is left without a map: too coarse in doubles */
#define NEAREST 64       /* casters are no nearer than a 64th of their middle's distance */
#define SMALL   4        /* texels: boxes no wider are drawn whole */
#define LARGE   0.03125  /* area of a face that is worth a map of its own, local units */

/* Weights of the steps (1, 0), (1, 1) and (2, 1): of all polygons around the unit circle whose
 * corners are in these directions the one that is nearest to it. */
#define STEP_SIDE   0.97325
#define STEP_CORNER 1.40851
#define STEP_KNIGHT 2.17627

void ss_sky_destroy(ss_sky *sky) {
    if (!sky) return;
    ss_free(sky->all);
    ss_free(sky->over);
    ss_free(sky->dark);
    ss_free(sky->below);
    ss_free(sky);
}

size_t ss_sky_bytes(const ss_sky *sky) {
    const size_t texels = (size_t)sky->frame.width * sky->frame.height;
    const size_t numbers = 1 + (sky->over != NULL) + (sky->dark ? 2 : 0);
    return sizeof *sky + numbers * texels * sizeof *sky->all;
}

/* ---- the frame ------------------------------------------------------------------------------ */

/* From the light's centre to a box. */
static double distance_to_box(const double from[3], const double low[3], const double high[3]) {
    double gap[3];
    for (int k = 0; k < 3; k++) {
        gap[k] = from[k] < low[k] ? low[k] - from[k] : from[k] > high[k] ? from[k] - high[k] : 0;
    }
    return ss_length(gap);
}

/* Axes and origin. false: there can be no map. */
static bool place_frame(ss_sky_frame *f, const ss_light *light, const double low[3],
                        const double high[3]) {
    double middle[3], half[3], reach = 0;
    for (int k = 0; k < 3; k++) {
        middle[k] = low[k] + (high[k] - low[k]) / 2, half[k] = (high[k] - low[k]) / 2;
        f->origin[k] = f->sun ? middle[k] : light->centre[k];
        f->axis[2][k] = f->sun ? -light->normal[k] : middle[k] - light->centre[k];
    }
    f->distance = f->sun ? 1 : ss_length(f->axis[2]);
    if (!ss_normalize(f->axis[2]) || f->distance > DISTANT) return false;
    ss_basis(f->axis[2], f->axis[0], f->axis[1]);
    for (int k = 0; k < 3; k++) reach += fabs(f->axis[2][k]) * half[k];
    f->least = f->sun ? -reach - ROOM : distance_to_box(light->centre, low, high) - ROOM;
    return f->sun || f->least * NEAREST > f->distance;
}

/* How far from the middle of the plane the box reaches, and the rectangle it is in. */
static double enclose(const ss_sky_frame *f, const double low[3], const double high[3],
                      double rect[4]) {
    double around = 0;
    rect[0] = rect[1] = INFINITY, rect[2] = rect[3] = -INFINITY;
    for (int c = 0; c < 8; c++) {
        const double p[3] = {c & 1 ? high[0] : low[0], c & 2 ? high[1] : low[1],
                             c & 4 ? high[2] : low[2]};
        double at[3], on[2];
        ss_sky_to_frame(f, p, at);
        ss_sky_project(f, at, on);
        around = ss_max(around, hypot(on[0], on[1]));
        for (int k = 0; k < 2; k++) {
            rect[k] = ss_min(on[k], rect[k]), rect[2 + k] = ss_max(on[k], rect[2 + k]);
        }
    }
    return around + ss_sky_widen(f, rect);
}

static double width_within(const ss_sky_frame *f, const ss_light *light, double radius) {
    if (f->sun) return ss_max(light->radius * (1 + SPARE) + 0x1p-40, NARROW);
    /* The centre is off by a rounding, too. */
    const double r = light->radius * (1 + SPARE) + 0x1p-48 * f->distance, share = r / f->least,
                 t = radius / f->distance;
    return ss_max(r / f->distance / sqrt(1 - share * share) * (1 + t * t / 4), NARROW);
}

/* Lays out the map, and what is beside it. Gives the width. */
static double lay_out(ss_sky *sky, const ss_light *light, const double low[3],
                      const double high[3]) {
    ss_sky_frame *f = &sky->frame;
    double rect[4];
    sky->around = enclose(f, low, high, rect);
    sky->most = (f->sun ? -f->least : ss_sky_nearness_at(f, f->least)) + ROOM;
    sky->outside = INFINITY;
    if (!f->sun) { /* the cone around the casters, opened by what the ball is seen as */
        const double turn = 2 * atan(sky->around / f->distance / 2) +
                            asin(light->radius * (1 + SPARE) / f->least) + ROOM;
        sky->outside = turn < 3 ? 2 * f->distance * tan(turn / 2) : INFINITY;
    }
    const double deep = f->sun ? -f->least : f->distance;
    const double drop = ss_min(2 * sky->most, sky->most + deep);
    double margin = ss_min(width_within(f, light, sky->around) * drop, sky->around);
    sky->inside = sky->around + margin;
    const double width = width_within(f, light, sky->inside);
    sky->slope = 1 / width_within(f, light, isinf(sky->outside) ? sky->inside : sky->outside);
    f->texel = ss_max(rect[2] - rect[0], rect[3] - rect[1]) + 2 * margin;
    f->texel = f->texel / (SIDE - 4);
    margin += 2 * f->texel;
    for (int k = 0; k < 2; k++) f->low[k] = rect[k] - margin;
    f->width = (uint32_t)ceil((rect[2] - rect[0] + 2 * margin) / f->texel);
    f->height = (uint32_t)ceil((rect[3] - rect[1] + 2 * margin) / f->texel);
    return width;
}

/* ---- drawing casters ------------------------------------------------------------------------ */

typedef struct canvas {
    const ss_bvh *bvh;
    const ss_sky_frame *f;
    const ss_sky *floor; /* casters that its face's points are over are left out; or NULL */
    float *map;
} canvas;

static void fill(const canvas *c, const ss_sky_span *s, double nearness) {
    const float value = (float)nearness;
    for (uint32_t y = s->y0; y <= s->y1; y++) {
        float *row = c->map + (size_t)y * c->f->width;
        for (uint32_t x = s->x0; x <= s->x1; x++) row[x] = row[x] > value ? row[x] : value;
    }
}

static double box_nearness(const ss_sky_frame *f, const double low[3], const double high[3]) {
    if (!f->sun)
        return ss_sky_nearness_at(f, ss_max(distance_to_box(f->origin, low, high), f->least));
    double least = 0;
    for (int k = 0; k < 3; k++) {
        const double a = f->axis[2][k];
        least += a * ((a > 0 ? low[k] : high[k]) - f->origin[k]);
    }
    return -least;
}

/* Lines through pairs of corners, the inside positive; one that is none bounds nothing. */
static void set_edges(const ss_sky_frame *f, const double corner[3][3], ss_sky_shape *out) {
    for (int i = 0; i < 3; i++) {
        const double *a = corner[i], *b = corner[(i + 1) % 3], *c = corner[(i + 2) % 3];
        const double from[3] = {a[0], a[1], f->sun ? 1 : a[2]},
                     way[3] = {b[0] - a[0], b[1] - a[1], f->sun ? 0 : b[2] - a[2]},
                     across[3] = {c[0] - a[0], c[1] - a[1], f->sun ? 0 : c[2] - a[2]};
        double *e = out->edge[i];
        ss_cross(from, way, e);
        const double inside = ss_dot(e, across);
        const double size = f->sun ? hypot(e[0], e[1]) : ss_length(e);
        const bool sure = size > SURE * f->distance && fabs(inside) > SURE * size;
        for (int k = 0; k < 3; k++) e[k] = sure ? e[k] / (inside > 0 ? size : -size) : 0;
    }
}

/* The plane's nearness. Where it is seen nearly along itself its largest will do. */
static void set_plane(const ss_sky_frame *f, const double corner[3][3], ss_sky_shape *out) {
    double one[3], two[3], n[3];
    ss_sub(corner[1], corner[0], one);
    ss_sub(corner[2], corner[0], two);
    ss_cross(one, two, n);
    out->nearness[0] = out->nearness[1] = out->nearness[2] = 0, out->constant = INFINITY;
    if (!ss_normalize(n)) return;
    const double place = ss_dot(n, corner[0]), across = f->sun ? n[2] : place / f->distance;
    if (fabs(across) < 0x1p-6) return;
    out->constant = f->sun ? 0 : -f->distance;
    if (f->sun) { /* z = (place - n0 x - n1 y) / n2 */
        out->nearness[0] = n[0] / n[2], out->nearness[1] = n[1] / n[2];
        out->nearness[2] = -place / n[2];
    } else {
        for (int k = 0; k < 3; k++) out->nearness[k] = f->distance * f->distance * n[k] / place;
    }
}

void ss_sky_shape_make(const ss_sky_frame *f, const double world[3][3], ss_sky_shape *out) {
    double corner[3][3], low[3] = {INFINITY, INFINITY, INFINITY},
                         high[3] = {-INFINITY, -INFINITY, -INFINITY}, nearest = INFINITY;
    out->rect[0] = out->rect[1] = INFINITY, out->rect[2] = out->rect[3] = -INFINITY;
    for (int i = 0; i < 3; i++) {
        double on[2];
        ss_sky_to_frame(f, world[i], corner[i]);
        ss_sky_project(f, corner[i], on);
        nearest = ss_min(nearest, corner[i][2]);
        for (int k = 0; k < 2; k++) {
            out->rect[k] = ss_min(on[k], out->rect[k]);
            out->rect[2 + k] = ss_max(on[k], out->rect[2 + k]);
        }
        for (int k = 0; k < 3; k++) {
            low[k] = ss_min(world[i][k], low[k]), high[k] = ss_max(world[i][k], high[k]);
        }
    }
    ss_sky_widen(f, out->rect);
    out->most = f->sun ? -nearest : box_nearness(f, low, high);
    set_edges(f, (const double(*)[3])corner, out);
    set_plane(f, (const double(*)[3])corner, out);
}

/* Texel by texel: a face may touch those whose middle is at most half a diagonal outside each
 * line. */
static void fill_face(const canvas *c, const ss_sky_shape *face, const ss_sky_span *s) {
    const ss_sky_frame *f = c->f;
    const double unit = f->sun ? 1 : f->distance, reach = f->texel / unit * 0.7072 + ROOM / unit;
    const double *g = face->nearness;
    const double more = (f->sun ? hypot(g[0], g[1]) : ss_length(g)) * reach + face->constant + ROOM;
    for (uint32_t y = s->y0; y <= s->y1; y++) {
        float *row = c->map + (size_t)y * f->width;
        for (uint32_t x = s->x0; x <= s->x1; x++) {
            double at[3];
            ss_sky_middle(f, unit, x, y, at);
            bool in = true;
            for (int i = 0; i < 3; i++) {
                const double *e = face->edge[i];
                in &= e[0] * at[0] + e[1] * at[1] + e[2] * at[2] >= -reach;
            }
            if (!in) continue;
            const double here = g[0] * at[0] + g[1] * at[1] + g[2] * at[2] + more;
            const float value = (float)(ss_min(here, face->most + ROOM));
            row[x] = row[x] > value ? row[x] : value;
        }
    }
}

/* Is it in or behind the face's plane? */
static bool is_under(const ss_sky *floor, const double corner[3][3]) {
    for (int i = 0; i < 3; i++) {
        if (ss_dot(floor->normal, corner[i]) - floor->offset > SS_TOUCH) return false;
    }
    return true;
}

static void draw_triangle(const canvas *c, uint32_t triangle) {
    double corner[3][3];
    ss_sky_shape face;
    ss_world_triangle(c->bvh->world, triangle, corner);
    if (c->floor && is_under(c->floor, (const double(*)[3])corner)) return;
    ss_sky_shape_make(c->f, (const double(*)[3])corner, &face);
    const ss_sky_span s = ss_sky_span_of(c->f, face.rect);
    if (ss_sky_is_small(&s, 2)) fill(c, &s, face.most + ROOM);
    else fill_face(c, &face, &s);
}

/* Of a box's lowest corner over the face; of the highest with high and low exchanged. */
static double height_of(const ss_sky *floor, const double low[3], const double high[3]) {
    double height = -floor->offset;
    for (int k = 0; k < 3; k++) {
        height += floor->normal[k] * (floor->normal[k] > 0 ? low[k] : high[k]);
    }
    return height;
}

/* A box that is small whole, unless its casters may be under the face. */
static bool draw_box(const canvas *c, const double low[3], const double high[3]) {
    double rect[4];
    if (c->floor && height_of(c->floor, low, high) < ROOM) return false;
    enclose(c->f, low, high, rect);
    const ss_sky_span s = ss_sky_span_of(c->f, rect);
    if (!ss_sky_is_small(&s, SMALL)) return false;
    fill(c, &s, box_nearness(c->f, low, high) + ROOM);
    return true;
}

static void draw_casters(const canvas *c) {
    uint32_t stack[SS_BVH_STACK];
    size_t depth = 0;
    stack[depth++] = 0;
    while (depth) {
        const ss_bvh_node *node = &c->bvh->nodes[stack[--depth]];
        for (uint32_t i = 0; i < node->count; i++) {
            double low[3], high[3];
            for (int k = 0; k < 3; k++) low[k] = node->low[k][i], high[k] = node->high[k][i];
            /* all of it under the face */
            if (c->floor && height_of(c->floor, high, low) < -ROOM) continue;
            if (draw_box(c, low, high)) continue;
            if (!(node->child[i] & SS_BVH_LEAF)) {
                stack[depth++] = node->child[i];
                continue;
            }
            for (uint32_t t = node->first[i]; t < node->last[i]; t++) {
                draw_triangle(c, c->bvh->order[t]);
            }
        }
    }
}

/* ---- what casters hide beside themselves ---------------------------------------------------- */

typedef struct steps {
    float side, corner, knight;
} steps;

static float larger(float a, float b) { return a > b ? a : b; }

/* What the two rows before give a row; they have two more texels on either side. */
static void from_rows(float *row, const float *near, const float *far, ptrdiff_t n, steps by) {
    for (ptrdiff_t x = 0; x < n; x++) {
        const float corner = larger(near[x - 1], near[x + 1]) - by.corner;
        const float knight =
            larger(larger(near[x - 2], near[x + 2]), larger(far[x - 1], far[x + 1])) - by.knight;
        row[x] = larger(larger(row[x], near[x] - by.side), larger(corner, knight));
    }
}

/* One of the two passes: rows in order, each from the two before it, then along itself. `rows`:
 * three padded rows of scratch. */
static void pass(float *map, uint32_t width, uint32_t height, bool back, steps by, float *rows) {
    const size_t pitch = width + 4;
    for (size_t i = 0; i < 3 * pitch; i++) rows[i] = -FLT_MAX;
    for (uint32_t i = 0; i < height; i++) {
        float *row = map + (size_t)(back ? height - 1 - i : i) * width;
        float *here = rows + i % 3 * pitch + 2;
        from_rows(row, rows + (i + 2) % 3 * pitch + 2, rows + (i + 1) % 3 * pitch + 2, width, by);
        float last = -FLT_MAX;
        for (uint32_t j = 0; j < width; j++) {
            const uint32_t x = back ? width - 1 - j : j;
            last = larger(row[x], last - by.side);
            here[x] = row[x] = last;
        }
    }
}

/* Each texel becomes the largest of itself and its eight neighbours. rows: two rows of scratch. */
static void grow(float *map, uint32_t width, uint32_t height, float *rows) {
    float *above = rows, *own = rows + width;
    for (uint32_t x = 0; x < width; x++) above[x] = -FLT_MAX;
    for (uint32_t y = 0; y < height; y++) {
        float *row = map + (size_t)y * width;
        const float *below = y + 1 < height ? row + width : row;
        for (uint32_t x = 0; x < width; x++) own[x] = row[x];
        for (uint32_t x = 0; x < width; x++) {
            float most = larger(own[x], larger(above[x], below[x]));
            if (x > 0) most = larger(most, larger(own[x - 1], larger(above[x - 1], below[x - 1])));
            if (x + 1 < width)
                most = larger(most, larger(own[x + 1], larger(above[x + 1], below[x + 1])));
            row[x] = most;
        }
        float *last = above;
        above = own, own = last;
    }
}

/* false: out of memory */
static bool spread(const ss_sky_frame *f, float *map, double width, double most) {
    const double step = f->texel / width;
    const size_t texels = (size_t)f->width * f->height;
    float *rows = ss_alloc(3 * ((size_t)f->width + 4), sizeof *rows);
    if (!rows) return false;
    /* Each step takes a little less than it might, which is what rounding may add. */
    const double little = 0x1p-21 * (1 + fabs(most));
    const steps by = {(float)fmax(STEP_SIDE * step - little, 0),
                      (float)fmax(STEP_CORNER * step - little, 0),
                      (float)fmax(STEP_KNIGHT * step - little, 0)};
    grow(map, f->width, f->height, rows);
    pass(map, f->width, f->height, false, by, rows);
    pass(map, f->width, f->height, true, by, rows);
    const float within = (float)(ROOM + ROOM / width);
    for (size_t i = 0; i < texels; i++) map[i] += within;
    ss_free(rows);
    return true;
}

static float *make_map(const ss_bvh *bvh, const ss_sky *sky, const ss_sky *floor, double width) {
    const size_t texels = (size_t)sky->frame.width * sky->frame.height;
    float *map = ss_alloc(texels, sizeof *map);
    if (!map) return NULL;
    for (size_t i = 0; i < texels; i++) map[i] = -FLT_MAX;
    const canvas c = {.bvh = bvh, .f = &sky->frame, .floor = floor, .map = map};
    draw_casters(&c);
    if (spread(&sky->frame, map, width, sky->most)) return map;
    ss_free(map);
    return NULL;
}

/* ---- the largest face ----------------------------------------------------------------------- */

static uint32_t largest_face(const ss_world *world) {
    uint32_t largest = SS_NO_TRIANGLE;
    float most = (float)(4 * LARGE * LARGE); /* of twice the area squared */
    for (size_t t = 0; t < world->triangle_count; t++) {
        const uint32_t *at = world->indices + 3 * t;
        const float *a = world->vertices + 3 * (size_t)at[0],
                    *b = world->vertices + 3 * (size_t)at[1],
                    *c = world->vertices + 3 * (size_t)at[2];
        float e[3], g[3];
        for (int k = 0; k < 3; k++) e[k] = b[k] - a[k], g[k] = c[k] - a[k];
        const float x = e[1] * g[2] - e[2] * g[1], y = e[2] * g[0] - e[0] * g[2],
                    z = e[0] * g[1] - e[1] * g[0], square = x * x + y * y + z * z;
        if (square > most) most = square, largest = (uint32_t)t;
    }
    return largest;
}

/* false: there is none that all of the light is over */
static bool find_floor(ss_sky *sky, const ss_world *world, const ss_light *light) {
    const uint32_t face = largest_face(world);
    double corner[3][3], one[3], two[3], down[3];
    const bool sun = light->type == SOFTSHADOW_SUN;
    if (face == SS_NO_TRIANGLE) return false;
    ss_world_triangle(world, face, corner);
    ss_sub(corner[1], corner[0], one);
    ss_sub(corner[2], corner[0], two);
    ss_cross(one, two, sky->normal);
    if (!ss_normalize(sky->normal)) return false;
    sky->offset = ss_dot(sky->normal, corner[0]);
    const double side =
        ss_dot(sky->normal, sun ? light->normal : light->centre) - (sun ? 0 : sky->offset);
    for (int k = 0; k < 3 && side < 0; k++) sky->normal[k] = -sky->normal[k];
    if (side < 0) sky->offset = -sky->offset;
    for (int k = 0; k < 3; k++) down[k] = -sky->normal[k], sky->centre[k] = light->centre[k];
    const double spread_ = hypot(ss_dot(down, light->u), ss_dot(down, light->v));
    const double ball = light->type == SOFTSHADOW_RECT || light->type == SOFTSHADOW_SPHERE
                            ? light->radius
                            : spread_;
    sky->finite = sun ? 0 : 1, sky->reach = sun ? hypot(1, light->radius) : 2 * light->radius;
    sky->lowest = fabs(side) - ball * (1 + SPARE);
    return sky->lowest > 0;
}

/* ---- all of it ------------------------------------------------------------------------------ */

softshadow_status ss_sky_create(ss_sky **out, const ss_bvh *bvh,
                                const struct ss_topology *topology, const ss_light *light) {
    const ss_world *world = bvh->world;
    double low[3], high[3];
    *out = NULL;
    if (!world->triangle_count || light->point) return SOFTSHADOW_OK;
    for (int k = 0; k < 3; k++) low[k] = world->bounds[k], high[k] = world->bounds[3 + k];
    ss_sky_frame frame = {.sun = light->type == SOFTSHADOW_SUN};
    if (!place_frame(&frame, light, low, high)) return SOFTSHADOW_OK;
    if (!frame.sun && light->radius * (1 + SPARE) > 0.7 * frame.least) return SOFTSHADOW_OK;
    ss_sky *sky = ss_alloc(1, sizeof *sky);
    if (!sky) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory");
    sky->frame = frame;
    const double width = lay_out(sky, light, low, high);
    if (!frame.sun && sky->around > frame.distance) { /* casters all around, nearly */
        ss_sky_destroy(sky);
        return SOFTSHADOW_OK;
    }
    sky->all = make_map(bvh, sky, NULL, width);
    const bool floor = find_floor(sky, world, light);
    if (floor) sky->over = make_map(bvh, sky, sky, width);
    if (!sky->all || (floor && !sky->over)) {
        ss_sky_destroy(sky);
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for a map of %u by %u", SIDE, SIDE);
    }
    for (int k = 0; k < 3; k++) {
        const double origin = (world->low[k] + world->half[k]) * world->scale;
        sky->size = ss_max(sky->size, ss_max(fabs(low[k] + origin), fabs(high[k] + origin)));
    }
    const softshadow_status status =
        topology ? ss_sky_add_umbra(sky, world, topology, width) : SOFTSHADOW_OK;
    if (status) ss_sky_destroy(sky);
    else *out = sky;
    return status;
}
