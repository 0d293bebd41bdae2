/* Where nothing of a light is seen, as a map in the sky's frame.
 *
 * Cut the casters' range of nearness into bins. Over a texel, a bin that no face of a closed
 * component passes through is all inside of it or all outside, which the winding number along the
 * line from the texel's middle to the light tells: where it is not 0, every segment from there to
 * the light leaves a solid, because the light is outside. Now if all that a point p can see of the
 * light it sees through such places of one bin, p is dark. A segment from p to the ball is, where
 * it is by h nearer to the light than p, at most width * h beside the line from p to the ball's
 * centre (sky.c). So p is dark if everything within this distance is inside, in any one bin: its
 * distance to what is not is a chamfer distance once more, bin by bin, from the light down.
 *
 * Two points in a texel and another are nearer to each other than the texels' middles by up to sqrt
 * 2 texels. Where the line from a texel's middle comes so near to an edge that doubles might see it
 * on either side the texel is taken to be outside. Faces reach farther by what floats and contact
 * move them and points, so that a face that p touches is in none of these bins. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "coverage/sky_parts.h"
#include "scene/connectivity.h"
#include "scene/scene.h"

#define ROOM  SS_SKY_ROOM
#define BINS  SS_SKY_BINS
#define LEAST 1024    /* faces: what fewer hide is drawn as fast */
#define SMALL 4       /* texels: faces no wider pass through all of their bins in each */
#define SURE  0x1p-40 /* of the ends' distances: a line is told from an edge */
#define DEEP  100     /* faces in a bin: more are not counted */

/* A vertex in the frame. */
typedef struct corner {
    double at[3], on[2], nearness, distance; /* from the ball's centre; sun: 1 */
} corner;

typedef struct canvas {
    ss_sky *sky;
    const ss_world *world;
    const ss_topology *topology;
    corner *corners;
    uint32_t *passed; /* of each texel: bins with a face, or all where the winding is not known */
    union {
        int8_t *winding; /* [texel][bin]: of faces that begin in it; then */
        uint8_t *away;   /* how far it is to where the bin is not all inside */
    };
    double steepest;  /* change of nearness over that of distance, at most */
} canvas;

static void place_corners(const canvas *c) {
    const ss_sky_frame *f = &c->sky->frame;
    for (size_t v = 0; v < c->world->vertex_count; v++) {
        double p[3];
        corner *out = &c->corners[v];
        for (size_t k = 0; k < 3; k++) p[k] = (double)c->world->vertices[3 * v + k];
        ss_sky_to_frame(f, p, out->at);
        ss_sky_project(f, out->at, out->on);
        out->distance = f->sun ? 1 : ss_length(out->at);
        out->nearness = f->sun ? -out->at[2] : ss_sky_nearness_at(f, out->distance);
    }
}

static bool is_solid(const ss_topology *topology, size_t triangle) {
    const uint32_t component = topology->triangle_component[triangle];
    return component != SS_NO_COMPONENT && topology->components[component].closed;
}

/* ---- bins ----------------------------------------------------------------------------------- */

static void set_bins(const canvas *c) {
    double low = INFINITY, high = -INFINITY;
    for (size_t v = 0; v < c->world->vertex_count; v++) {
        low = ss_min(low, c->corners[v].nearness), high = ss_max(high, c->corners[v].nearness);
    }
    c->sky->bin_low = low - 2 * ROOM * c->steepest;
    c->sky->bins = BINS / (high + 2 * ROOM * c->steepest - c->sky->bin_low);
}

static int bin_of(const ss_sky *sky, double nearness) {
    const double bin = (nearness - sky->bin_low) * sky->bins;
    return bin < 0 ? 0 : bin > BINS - 1 ? BINS - 1 : (int)bin;
}

/* ---- drawing -------------------------------------------------------------------------------- */

/* A face's edges as planes through the ball's centre (sun: along its direction), in the frame, by
 * which texels' middles are told to be on one side or the other. */
typedef struct lines {
    double plane[3][3], sure[3];
} lines;

/* The same for both faces at an edge, but for its sign. */
static void set_line(const canvas *c, uint32_t a, uint32_t b, double plane[3], double *sure) {
    const bool turned = a > b;
    const corner *p = &c->corners[turned ? b : a], *q = &c->corners[turned ? a : b];
    if (c->sky->frame.sun) {
        plane[0] = p->at[1] - q->at[1], plane[1] = q->at[0] - p->at[0];
        plane[2] = p->at[0] * q->at[1] - p->at[1] * q->at[0];
    } else {
        ss_cross(p->at, q->at, plane);
    }
    *sure = SURE * p->distance * q->distance;
    for (int k = 0; k < 3 && turned; k++) plane[k] = -plane[k];
}

static void set_lines(const canvas *c, const uint32_t v[3], lines *out) {
    for (int i = 0; i < 3; i++) set_line(c, v[i], v[(i + 1) % 3], out->plane[i], &out->sure[i]);
}

/* A face that passes through these bins over a texel. */
static void put(const canvas *c, const lines *of, uint32_t x, uint32_t y, int first, int last) {
    const ss_sky_frame *f = &c->sky->frame;
    const size_t texel = (size_t)y * f->width + x;
    const double unit = f->sun ? 1 : f->distance;
    const double u = (f->low[0] + (x + 0.5) * f->texel) / unit,
                 v = (f->low[1] + (y + 0.5) * f->texel) / unit;
    const double place[3] = {u, v, f->sun ? 1 : 1 - (u * u + v * v) / 4};
    int above = 0, below = 0;
    for (int i = 0; i < 3; i++) {
        const double side = ss_dot(of->plane[i], place);
        above += side > of->sure[i], below += side < -of->sure[i];
    }
    c->passed[texel] |= above + below < 3 ? UINT32_MAX
                                          : UINT32_MAX >> (BINS - 1 - (last - first)) << first;
    int8_t *sum = &c->winding[texel * BINS + (size_t)first];
    *sum = (int8_t)(*sum + (above == 3) - (below == 3));
    if (*sum > DEEP || *sum < -DEEP) c->passed[texel] = UINT32_MAX, *sum = 0;
}

/* Texel by texel, as sky.c does. */
static void draw_large(const canvas *c, const uint32_t v[3], const ss_sky_span *s, double least) {
    const ss_sky_frame *f = &c->sky->frame;
    ss_sky_shape face;
    lines of;
    double world[3][3];
    set_lines(c, v, &of);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            world[i][k] = (double)c->world->vertices[3 * (size_t)v[i] + (size_t)k];
    ss_sky_shape_make(f, (const double(*)[3])world, &face);
    const double unit = f->sun ? 1 : f->distance, reach = f->texel / unit * 0.7072 + ROOM / unit;
    const double *g = face.nearness, margin = 2 * ROOM * c->steepest;
    const double slope = (f->sun ? hypot(g[0], g[1]) : ss_length(g)) * reach;
    for (uint32_t y = s->y0; y <= s->y1; y++) {
        for (uint32_t x = s->x0; x <= s->x1; x++) {
            double at[3];
            bool in = true;
            ss_sky_middle(f, unit, x, y, at);
            for (int i = 0; i < 3; i++) in &= ss_dot(face.edge[i], at) >= -reach;
            if (!in) continue;
            const double here = ss_dot(g, at) + face.constant;
            const bool plane = isfinite(face.constant);
            const double low = plane ? ss_max(here - slope, least) : least,
                         high = plane ? ss_min(here + slope, face.most) : face.most;
            /* Where the face ends before the texel the plane's range is beside the face's. */
            const int one = bin_of(c->sky, low - margin), other = bin_of(c->sky, high + margin);
            put(c, &of, x, y, one < other ? one : other, one < other ? other : one);
        }
    }
}

static void draw_face(const canvas *c, const uint32_t v[3]) {
    const ss_sky_frame *f = &c->sky->frame;
    double rect[4] = {INFINITY, INFINITY, -INFINITY, -INFINITY};
    double least = INFINITY, most = -INFINITY, near = INFINITY, longest = 0;
    for (int i = 0; i < 3; i++) {
        const corner *a = &c->corners[v[i]];
        double way[3];
        for (int k = 0; k < 2; k++)
            rect[k] = ss_min(a->on[k], rect[k]), rect[2 + k] = ss_max(a->on[k], rect[2 + k]);
        least = ss_min(a->nearness, least), most = ss_max(a->nearness, most);
        near = ss_min(a->distance, near);
        ss_sub(c->corners[v[(i + 1) % 3]].at, a->at, way);
        longest = ss_max(ss_dot(way, way), longest);
    }
    ss_sky_widen(f, rect);
    const ss_sky_span s = ss_sky_span_of(f, rect);
    if (!ss_sky_is_small(&s, SMALL)) {
        draw_large(c, v, &s, least);
        return;
    }
    /* A chord of a circle comes nearer to its middle than its ends, by less than this. */
    const double bulge = f->sun ? 0 : longest / near * c->steepest;
    const double margin = 2 * ROOM * c->steepest;
    const int first = bin_of(c->sky, least - margin), last = bin_of(c->sky, most + bulge + margin);
    lines of;
    set_lines(c, v, &of);
    for (uint32_t y = s.y0; y <= s.y1; y++)
        for (uint32_t x = s.x0; x <= s.x1; x++) put(c, &of, x, y, first, last);
}

/* ---- what is dark --------------------------------------------------------------------------- */

/* Distances are bytes, in tenths of a texel, of all bins of a texel at once. With these steps from
 * one to the next they are nowhere more than the true ones: nine and thirteen tenths are the
 * corners of an octagon around the circle. */
#define TENTHS 10
#define SIDE   9
#define CORNER 13
#define FAR    240 /* or more: a step from there is still a byte */

static bool is_empty(const uint8_t *bins) {
    uint64_t words[BINS / sizeof(uint64_t)], all = 0;
    memcpy(words, bins, sizeof words);
    for (size_t i = 0; i < BINS / sizeof(uint64_t); i++) all |= words[i];
    return all == 0;
}

/* From windings to distances: 0 where a bin is not all inside. */
static void find_inside(const canvas *c, size_t texel) {
    int8_t *winding = c->winding + texel * BINS;
    uint8_t *away = c->away + texel * BINS;
    int sum = 0;
    if (is_empty(away)) return;
    for (int i = BINS - 1; i >= 0; i--) {
        sum += winding[i];
        away[i] = sum != 0 && !(c->passed[texel] >> i & 1) ? FAR : 0;
    }
}

static inline void approach(uint8_t *restrict away, const uint8_t *restrict from, uint8_t step) {
    for (int i = 0; i < BINS; i++) {
        const uint8_t by_there = (uint8_t)(from[i] + step);
        away[i] = by_there < away[i] ? by_there : away[i];
    }
}

/* One of the two passes [Bor86]: from the row before and the texel before. What is beside the map
 * is outside, and no texel of its rim is inside. */
static void pass(const canvas *c, bool back) {
    const ptrdiff_t width = c->sky->frame.width, height = c->sky->frame.height;
    const ptrdiff_t one = back ? -BINS : BINS, row = width * one;
    for (ptrdiff_t i = 1; i + 1 < height; i++) {
        for (ptrdiff_t j = 1; j + 1 < width; j++) {
            const ptrdiff_t y = back ? height - 1 - i : i, x = back ? width - 1 - j : j;
            uint8_t *here = c->away + (y * width + x) * BINS;
            approach(here, here - one, SIDE);
            approach(here, here - row, SIDE);
            approach(here, here - row - one, CORNER);
            approach(here, here - row + one, CORNER);
        }
    }
}

/* Bin by bin from the light down: `free` is how many tenths of a texel beside a point of the bin
 * may be in its way, for all of it to be inside at the lowest plane of some bin above. */
static void find_dark(const canvas *c, size_t texel, double width) {
    const ss_sky *sky = c->sky;
    const uint8_t *away = c->away + texel * BINS;
    const double tenth = sky->frame.texel / TENTHS, lost = 1.4143 * TENTHS + 4 * ROOM / tenth,
                 step = width / sky->bins / tenth;
    double free = -INFINITY;
    uint32_t dark = 0;
    sky->below[texel] = FLT_MAX;
    if (is_empty(away)) return;
    for (int i = BINS - 1; i >= 0; i--) {
        if (i + 1 < BINS) free -= step;
        dark |= (uint32_t)(free > 0) << i;
        if (away[i] > lost) free = ss_max(free, away[i] - lost);
    }
    sky->dark[texel] = dark;
    if (free > 0) sky->below[texel] = (float)(sky->bin_low - free * tenth / width + ROOM);
}

/* ---- all of it ------------------------------------------------------------------------------ */

static size_t count_solid(const canvas *c) {
    size_t count = 0;
    for (size_t t = 0; t < c->world->triangle_count; t++) count += is_solid(c->topology, t);
    return count;
}

static void draw_all(const canvas *c) {
    place_corners(c);
    set_bins(c);
    for (size_t t = 0; t < c->world->triangle_count; t++) {
        uint32_t v[3];
        if (!is_solid(c->topology, t)) continue;
        for (size_t i = 0; i < 3; i++) v[i] = c->topology->weld[c->world->indices[3 * t + i]];
        draw_face(c, v);
    }
}

static void fill(const canvas *c, double width) {
    const size_t texels = (size_t)c->sky->frame.width * c->sky->frame.height;
    for (size_t i = 0; i < texels; i++) find_inside(c, i);
    pass(c, false);
    pass(c, true);
    for (size_t i = 0; i < texels; i++) find_dark(c, i, width);
}

softshadow_status ss_sky_add_umbra(ss_sky *sky, const ss_world *world,
                                   const struct ss_topology *topology, double width) {
    const ss_sky_frame *f = &sky->frame;
    const size_t texels = (size_t)f->width * f->height;
    const double ratio = f->sun ? 1 : f->distance / f->least;
    canvas c = {.sky = sky, .world = world, .topology = topology,
                .steepest = ss_max(ratio * ratio, 1)};
    if (count_solid(&c) < LEAST) return SOFTSHADOW_OK;
    c.corners = ss_alloc(world->vertex_count, sizeof *c.corners);
    c.passed = ss_alloc(texels, sizeof *c.passed);
    c.winding = ss_alloc(texels, BINS * sizeof *c.winding);
    sky->dark = ss_alloc(texels, sizeof *sky->dark);
    sky->below = ss_alloc(texels, sizeof *sky->below);
    const bool room = c.corners && c.passed && c.winding && sky->dark && sky->below;
    if (room) draw_all(&c), fill(&c, width);
    ss_free(c.corners), ss_free(c.passed), ss_free(c.winding);
    if (room) return SOFTSHADOW_OK;
    return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for a map of %u by %u", f->width, f->height);
}
