/* Ray tracing: shadow rays to a low-discrepancy set of samples on the light [CPC84].
 *
 * The set is turned for each point by a hash of where the point lies relative to the light, so a
 * result is a pure function of the point. Rays are spent only where something can be between a
 * point and the light: a group of nearby points with an empty shaft is settled at once, and what
 * lies below a horizon is hidden without a ray. Float arithmetic never sees a face near the point:
 * trace/contact.h.
 *
 * The error bound is Wilson's score interval [Wil27] at 99.9 %: it holds for independent samples of
 * any scene; these sets do better on most, and on none could be shown to do worse. */
#include "technique/raytrace.h"

#include <math.h>
#include <string.h>

#include "base/fpu.h"
#include "base/status.h"
#include "base/vec.h"
#include "coverage/direct.h"
#include "trace/bvh.h"
#include "trace/contact.h"
#include "trace/rays.h"

#define GROUP 16
#define PACKET 16
#define MOST_SUSPECTS 8  /* a test each and point: 8 of them cost less than 16 rays */
#define LINE_MOST 64     /* in the shaft of a point and a point light; where there are more, rays answer */
#define FAR 4.0          /* casters fill [-1, 1]: beyond this, floats would be too coarse to start from */
#define CLEAR_SHARE 0.9  /* of contact.clear: the origin is rounded, too */
#define END_GAP 0x1p-21  /* rounding of floats at the light's end, local units: trace/contact.h */
/* Triangles across a packet, up to which it is traced as one. Time of that over rays for
 * themselves:
 * width             1 1.7 2.6 3.4 4.6 5.8 6.1 6.8 7.7 8.2 8.5 14 20
 * 2,000 leaves     .62    .89    .98   1.20   1.13          1.19
 * 20,000 leaves           .71 .86 1.10 1.34 1.80
 * bunny 70k                                                 .87           1.13
 * spheres 80k                                                      .95           .97
 * dragons 202k, 871k                                  .81 .87 1.07 1.03
 * On a surface neighbours hide the same; loose triangles leave a packet's rays to go on one by
 * one. */
#define COHERENT       7
#define COHERENT_LOOSE 3
#define NORMAL_999 3.2905267314919255 /* two-sided 99.9 % of the normal distribution */

typedef struct state {
    ss_samples *samples;
    ss_samples *few; /* tried first, or NULL: enough where fewer packets than `rough` see a part */
    double rough;
    double widest; /* of packets that are traced as one */
    double spread; /* a packet's share of the light's width */
} state;

/* The few triangles that could be between a group of points and the light; count > MOST_SUSPECTS:
 * too many to look at one by one. */
typedef struct suspects {
    size_t count;
    uint32_t triangle[MOST_SUSPECTS];
    double corner[MOST_SUSPECTS][3][3];
} suspects;

/* One point that looks at the light. */
typedef struct eye {
    const ss_stage *stage;
    const state *state;
    const double *normal; /* NULL: no horizon cuts the light */
    double unit_normal[3];
    const suspects *suspects; /* of the point's group */
    bool open;            /* known: nothing between the point and the light */
    bool weighted;        /* samples differ in weight */
    ss_contact contact;
    ss_view view;
    ss_turn turn;
    bool coherent;        /* a packet's rays pass the same few triangles */
    bool meets_near;      /* floats might find hits with faces near the point */
    double factor;        /* the power of two that brings directions to a size near 1 */
} eye;

/* What the samples said. */
typedef struct tally {
    double weight, seen, squares;
    uint32_t mixed; /* packets that see a part of their own */
} tally;

/* ---- Segments ---- */

static void direction_to(const eye *e, float s, float t, double d[3]) {
    const ss_view *view = &e->view;
    for (int k = 0; k < 3; k++) d[k] = view->centre[k] + s * view->a[k] + t * view->b[k];
}

/* From the point itself. */
static void aim(const eye *e, const float s[PACKET], const float t[PACKET], ss_segments *segments) {
    float c[3], a[3], b[3], o[3];
    for (int k = 0; k < 3; k++) {
        c[k] = (float)(e->factor * e->view.centre[k]);
        a[k] = (float)(e->factor * e->view.a[k]), b[k] = (float)(e->factor * e->view.b[k]);
        o[k] = (float)e->contact.p[k];
    }
    const float clear = (float)(CLEAR_SHARE * e->contact.clear);
    const float end = (float)(e->view.t_end / e->factor);
    for (int i = 0; i < PACKET; i++) {
        const float x = c[0] + s[i] * a[0] + t[i] * b[0], y = c[1] + s[i] * a[1] + t[i] * b[1],
                    z = c[2] + s[i] * a[2] + t[i] * b[2];
        const float pace = 1 / sqrtf(x * x + y * y + z * z);
        segments->ox[i] = o[0], segments->oy[i] = o[1], segments->oz[i] = o[2];
        segments->dx[i] = x, segments->dy[i] = y, segments->dz[i] = z;
        segments->t_begin[i] = clear * pace;
        segments->t_end[i] = end - (float)END_GAP * pace;
    }
}

/* From where each segment comes near the casters, found in double: a float origin far away would
 * miss them by its own rounding. */
static void aim_from_afar(const eye *e, const float s[PACKET], const float t[PACKET],
                          ss_segments *segments) {
    for (int i = 0; i < PACKET; i++) {
        double d[3];
        direction_to(e, s[i], t[i], d);
        for (int k = 0; k < 3; k++) d[k] *= e->factor;
        const double pace = 1 / ss_length(d);
        const double start = fmax(0, -ss_dot(e->contact.p, d) * pace * pace - FAR * pace);
        segments->ox[i] = (float)(e->contact.p[0] + start * d[0]);
        segments->oy[i] = (float)(e->contact.p[1] + start * d[1]);
        segments->oz[i] = (float)(e->contact.p[2] + start * d[2]);
        segments->dx[i] = (float)d[0], segments->dy[i] = (float)d[1], segments->dz[i] = (float)d[2];
        segments->t_begin[i] = 0;
        segments->t_end[i] = (float)(e->view.t_end / e->factor - start - END_GAP * pace);
    }
}

static bool is_far(const double p[3]) {
    return fmax(fabs(p[0]), fmax(fabs(p[1]), fabs(p[2]))) > FAR;
}

/* Which of the samples in `valid` cannot be seen. */
static uint32_t hidden(const eye *e, const float s[PACKET], const float t[PACKET], uint32_t valid,
                       ss_counts *counts) {
    uint32_t out = 0;
    for (int i = 0; i < PACKET && e->normal; i++) {
        if (ss_light_below(&e->view, e->normal, s[i], t[i])) out |= 1u << i;
    }
    if (e->open) return out & valid;
    for (int i = 0; i < PACKET && e->contact.tested_count; i++) {
        double d[3];
        if (!((valid & ~out) >> i & 1)) continue;
        direction_to(e, s[i], t[i], d);
        if (ss_contact_blocked(&e->contact, e->stage->world, d, e->view.t_end)) out |= 1u << i;
    }
    if ((valid & ~out) == 0) return valid;
    ss_segments segments;
    if (is_far(e->contact.p)) aim_from_afar(e, s, t, &segments);
    else aim(e, s, t, &segments);
    counts->rays += (uint64_t)__builtin_popcount(valid & ~out);
    out |= ss_rays_blocked(e->stage->rays, &segments, valid & ~out, e->coherent, e->contact.near,
                           e->meets_near ? e->contact.near_count : 0);
    return out & valid;
}

/* ---- One point ---- */

/* Where the point is, to 2^-20 of the casters' size, relative to the light: symmetric in the
 * axes. */
static uint64_t hash_of(const eye *e) {
    const ss_light *light = e->stage->light;
    uint64_t sum = e->stage->params->seed;
    for (int k = 0; k < 3; k++) {
        const double origin = light->type == SOFTSHADOW_SUN ? 0 : light->centre[k];
        const double cell = rint((e->contact.p[k] - origin) * 0x1p20) + 0.0; /* no -0 */
        uint64_t bits;
        memcpy(&bits, &cell, sizeof bits);
        sum += ss_hash(bits);
    }
    return ss_hash(sum);
}

static double size_of(const ss_view *view) {
    return ss_length(view->centre) + ss_length(view->a) + ss_length(view->b);
}

/* How far the light reaches above and below the height of its centre, along the normal. */
static double reach_along(const ss_view *view, const double normal[3]) {
    const double a = ss_dot(normal, view->a), b = ss_dot(normal, view->b);
    return view->disk ? sqrt(a * a + b * b) : fabs(a) + fabs(b);
}

typedef enum sight { ALL, NONE, SOME } sight;

/* What the normal's horizon leaves of the light; margins cover rounding, the samples decide
 * there. */
static sight horizon(eye *e, const ss_point *point) {
    e->normal = NULL;
    for (int k = 0; k < 3; k++) e->unit_normal[k] = point->normal[k];
    if (!ss_normalize(e->unit_normal)) return ALL;
    const double height = ss_dot(e->unit_normal, e->view.centre);
    const double reach = reach_along(&e->view, e->unit_normal);
    const double margin = 0x1p-48 * size_of(&e->view);
    e->normal = e->unit_normal;
    if (height - reach > margin) return ALL;
    return height + reach < -margin ? NONE : SOME;
}

/* The least and the largest n . (c + s a + t b) over the light. */
static void span(const ss_view *view, const double n[3], double *low, double *high) {
    const double middle = ss_dot(n, view->centre), reach = reach_along(view, n);
    *low = middle - reach, *high = middle + reach;
}

/* Can the triangle (corners relative to the point) not block any of the light? Certain when true:
 * it is so if the point and the light are on one side of its plane, or if a plane through the point
 * and one of its edges has the light on the other side. */
static bool is_aside(const ss_view *view, const double v[3][3]) {
    const double margin = 0x1p-46; /* of sines: 64 roundings of doubles */
    double one[3], two[3], normal[3], low, high;
    ss_sub(v[1], v[0], one);
    ss_sub(v[2], v[0], two);
    ss_cross(one, two, normal);
    if (!ss_normalize(normal)) return false;
    const double size = size_of(view), height = -ss_dot(normal, v[0]); /* of the point */
    span(view, normal, &low, &high);
    if (height >= -SS_TOUCH && low > margin * size) return true;
    if (height <= SS_TOUCH && high < -margin * size) return true;
    for (int i = 0; i < 3; i++) {
        double across[3];
        ss_cross(v[i], v[(i + 1) % 3], across);
        if (!ss_normalize(across)) continue;
        const double inside = ss_dot(across, v[(i + 2) % 3]);
        span(view, across, &low, &high);
        if (inside > 0 ? high < -margin * size : low > margin * size) return true;
    }
    return false;
}

static bool touches(const ss_contact *contact, uint32_t triangle) {
    for (uint32_t i = 0; i < ss_contact_touched(contact); i++) {
        if (contact->near[i] == triangle) return true;
    }
    return false;
}

/* Is it certain that nothing is between the point and the light? */
static bool is_open(const eye *e) {
    if (e->suspects->count > MOST_SUSPECTS) return false;
    for (size_t i = 0; i < e->suspects->count; i++) {
        double corner[3][3];
        if (touches(&e->contact, e->suspects->triangle[i])) continue;
        for (int k = 0; k < 3; k++) ss_sub(e->suspects->corner[i][k], e->contact.p, corner[k]);
        if (!is_aside(&e->view, (const double(*)[3])corner)) return false;
    }
    return true;
}

/* Where floats see a segment meet a plane that holds its origin: at its height above it, which is
 * rounding only, over the sine of the angle between them. Floats know a triangle's plane the worse
 * the thinner it is: its normal comes from edges whose rounding is one of the corners' distances,
 * and the height of the origin from a corner as far away as that. */
static bool meets(const eye *e, uint32_t triangle) {
    double v[3][3], one[3], two[3], three[3], normal[3], low, high, longest = 0;
    ss_world_triangle(e->stage->world, triangle, v);
    for (int i = 0; i < 3; i++) {
        ss_sub(v[i], e->contact.p, v[i]);
        longest = ss_max(longest, ss_dot(v[i], v[i]));
    }
    ss_sub(v[1], v[0], one);
    ss_sub(v[2], v[0], two);
    ss_sub(v[2], v[1], three);
    ss_cross(one, two, normal);
    const double area = ss_length(normal); /* twice */
    if (!ss_normalize(normal)) return true;
    const double edge = ss_max(ss_length(one), ss_max(ss_length(two), ss_length(three))),
                 reach = ss_max(sqrt(longest), edge), tilt = 0x1p-22 * reach * edge / area;
    span(&e->view, normal, &low, &high);
    const double sine = ss_max(low, -high) / size_of(&e->view) - tilt;
    const double rounding = 0x1p-23 + (0x1p-22 + tilt) * reach;
    return !(fabs(ss_dot(normal, v[0])) + rounding <
             CLEAR_SHARE * CLEAR_SHARE * e->contact.clear * sine);
}

/* Faces tested in double always count: floats must not answer for them. */
static bool meets_any(const eye *e) {
    if (e->contact.tested_count > 0 || e->contact.near_count > 4) return true;
    for (uint32_t i = 0; i < e->contact.near_count; i++) {
        if (meets(e, e->contact.near[i])) return true;
    }
    return false;
}

static void add_plain(tally *sum, uint32_t valid, uint32_t out) {
    sum->weight += __builtin_popcount(valid);
    sum->seen += __builtin_popcount(valid & ~out);
    sum->squares = sum->weight;
}

static void add_weighted(const eye *e, tally *sum, const float s[PACKET], const float t[PACKET],
                         uint32_t valid, uint32_t out) {
    const ss_stage *stage = e->stage;
    for (int i = 0; i < PACKET; i++) {
        if (!(valid >> i & 1)) continue;
        const double weight = ss_light_weight(stage->light, &e->view, stage->params->weighting,
                                              e->normal, s[i], t[i]);
        sum->weight += weight, sum->squares += weight * weight;
        if (!(out >> i & 1)) sum->seen += weight;
    }
}

static tally sample_light(const eye *e, const ss_samples *samples, ss_counts *counts) {
    tally sum = {0};
    const uint32_t count = ss_samples_count(samples);
    for (uint32_t first = 0; first < count; first += PACKET) {
        float s[PACKET], t[PACKET];
        const uint32_t valid = count - first >= PACKET ? 0xffff : (1u << (count - first)) - 1;
        ss_samples_get(samples, &e->turn, first, s, t);
        const uint32_t out = hidden(e, s, t, valid, counts);
        sum.mixed += out != 0 && out != valid;
        if (e->weighted) add_weighted(e, &sum, s, t, valid, out);
        else add_plain(&sum, valid, out);
    }
    return sum;
}

/* The farther end of Wilson's interval around v from n samples. */
static double wilson(double v, double n) {
    const double z2 = NORMAL_999 * NORMAL_999;
    const double centre = (v + z2 / (2 * n)) / (1 + z2 / n);
    const double half = NORMAL_999 / (1 + z2 / n) * sqrt(v * (1 - v) / n + z2 / (4 * n * n));
    return fmax(centre + half - v, v - (centre - half));
}

/* Where the light reaches highest above the horizon. */
static void find_top(const eye *e, float *s, float *t) {
    if (!e->normal) return;
    const double a = ss_dot(e->normal, e->view.a), b = ss_dot(e->normal, e->view.b);
    const double length = hypot(a, b);
    if (!e->view.disk) *s = (float)((a > 0) - (a < 0)), *t = (float)((b > 0) - (b < 0));
    else if (length > 0) *s = (float)(a / length), *t = (float)(b / length);
}

/* No sample has any weight: what counts, if anything does, is a sliver above the horizon that fell
 * between them. A ray to its top answers; how far the truth is, nobody knows. */
static double sliver(const eye *e, double *bound, ss_counts *counts) {
    float s[PACKET] = {0}, t[PACKET] = {0};
    const bool behind = e->stage->params->weighting == SOFTSHADOW_IRRADIANCE &&
                        ss_dot(e->view.normal, e->view.centre) >= 0;
    *bound = behind ? 0 : 1;
    find_top(e, &s[0], &t[0]);
    if (behind || !(ss_light_weight(e->stage->light, &e->view, e->stage->params->weighting,
                                    e->normal, s[0], t[0]) > 0)) {
        return 0;
    }
    return hidden(e, s, t, 1, counts) ? 0 : 1;
}

static double sampled(eye *e, double *bound, ss_counts *counts) {
    e->turn = ss_samples_turn(hash_of(e));
    const state *made = e->state;
    tally sum = {0};
    if (made->few) sum = sample_light(e, made->few, counts);
    if (!made->few || sum.mixed > made->rough || !(sum.weight > 0))
        sum = sample_light(e, made->samples, counts);
    if (!(sum.weight > 0)) return sliver(e, bound, counts);
    const double seen = fmin(sum.seen / sum.weight, 1);
    *bound = wilson(seen, sum.weight * sum.weight / sum.squares);
    return seen;
}

/* Embree's rays pass between no two faces, but one in 50,000 of those that are aimed at a corner
 * passes between all that meet there: looked at again in double, where none does. */
static bool slipped_through(const eye *e) {
    uint32_t triangle[LINE_MOST];
    const ss_stage *stage = e->stage;
    const size_t found =
        ss_bvh_shaft(stage->bvh, stage->light, e->contact.p, e->contact.p, triangle, LINE_MOST);
    double d[3];
    direction_to(e, 0, 0, d);
    for (size_t i = 0; i < found && found <= LINE_MOST; i++) {
        ss_direct one;
        if (ss_contact_lists(&e->contact, triangle[i])) continue;
        ss_direct_set(&one, stage->world, triangle[i], e->contact.p);
        if (ss_direct_blocks(&one, stage->world, d, e->view.t_end)) return true;
    }
    return false;
}

/* A light without extent: one ray, which is no estimate. */
static double sharp(const eye *e, ss_counts *counts) {
    const float centre[PACKET] = {0};
    const double weight = ss_light_weight(e->stage->light, &e->view, e->stage->params->weighting,
                                          e->normal, 0, 0);
    if (!(weight > 0)) return 0;
    if (hidden(e, centre, centre, 1, counts)) return 0;
    return !e->open && slipped_through(e) ? 0 : 1;
}

/* Looks for what is certain without rays; where nothing is, puts the point onto what it touches. */
static void face_the_light(eye *e, const ss_point *point) {
    const ss_stage *stage = e->stage;
    memcpy(e->contact.p, point->p, sizeof e->contact.p);
    e->contact.near_count = e->contact.tested_count = 0;
    ss_light_view(stage->light, point->p, &e->view);
    e->open = is_open(e);
    if (e->open) return;
    ss_contact_find(stage->bvh, stage->world, point, NULL, &e->contact);
    if (memcmp(e->contact.p, point->p, sizeof point->p) != 0) {
        ss_light_view(stage->light, e->contact.p, &e->view);
    }
    e->open = is_open(e);
}

/* By how wide a packet is where it meets the casters, about their middle. */
static bool is_coherent(const eye *e) {
    const double away = ss_max(ss_length(e->contact.p), 0.5) / ss_length(e->view.centre);
    const double width = 2 * ss_max(ss_length(e->view.a), ss_length(e->view.b)) * e->state->spread;
    return width * ss_min(away, e->view.t_end) < e->state->widest;
}

static bool has_normal(const ss_point *point) {
    return point->normal[0] != 0 || point->normal[1] != 0 || point->normal[2] != 0;
}

static double look(eye *e, const ss_point *point, double *bound, ss_counts *counts) {
    const ss_stage *stage = e->stage;
    const bool uniform = stage->params->weighting == SOFTSHADOW_UNIFORM;
    *bound = 0;
    e->open = e->suspects->count == 0;
    if (e->open && uniform && !has_normal(point)) return 1;
    face_the_light(e, point);
    if (e->view.inside) return 1;
    const sight above = horizon(e, point);
    if (above == NONE || (e->view.edge_on && !uniform)) return 0;
    if (uniform && above == ALL) {
        if (e->open) return 1;
        e->normal = NULL;
    }
    e->meets_near = !e->open && meets_any(e);
    int exponent;
    frexp(size_of(&e->view), &exponent);
    e->factor = ldexp(1, -exponent);
    e->coherent = is_coherent(e);
    e->weighted = !uniform || stage->light->profile_count > 0;
    return stage->light->point ? sharp(e, counts) : sampled(e, bound, counts);
}

/* ---- The technique ---- */

/* No other caster can touch a segment from any of these points to the light. */
static void find_suspects(const ss_stage *stage, const ss_point *points, size_t n,
                          suspects *found) {
    double low[3], high[3];
    memcpy(low, points[0].p, sizeof low), memcpy(high, points[0].p, sizeof high);
    for (size_t i = 1; i < n; i++) {
        for (int k = 0; k < 3; k++) {
            low[k] = ss_min(low[k], points[i].p[k]), high[k] = ss_max(high[k], points[i].p[k]);
        }
    }
    found->count =
        ss_bvh_shaft(stage->bvh, stage->light, low, high, found->triangle, MOST_SUSPECTS);
    for (size_t i = 0; i < found->count && found->count <= MOST_SUSPECTS; i++) {
        ss_world_triangle(stage->world, found->triangle[i], found->corner[i]);
    }
}

static void count_point(double seen, bool open, uint64_t rays, ss_counts *counts) {
    counts->lit += seen >= 1, counts->umbra += seen <= 0;
    counts->penumbra += seen > 0 && seen < 1;
    counts->settled += open;
    counts->traced += rays > 0;
}

static softshadow_status query(const ss_stage *stage, const void *made, const ss_point *points,
                               size_t n, float *visibility, float *bound, ss_arena *scratch,
                               ss_counts *counts) {
    (void)scratch;
    suspects group;
    eye e = {.stage = stage, .state = made, .suspects = &group};
    const unsigned saved = ss_fpu_flush_denormals();
    for (size_t first = 0; first < n; first += GROUP) {
        const size_t size = n - first < GROUP ? n - first : GROUP;
        find_suspects(stage, points + first, size, &group);
        for (size_t i = first; i < first + size; i++) {
            const uint64_t before = counts->rays;
            double error;
            const double seen = look(&e, &points[i], &error, counts);
            visibility[i] = (float)seen;
            if (bound) bound[i] = (float)error;
            count_point(seen, e.open, counts->rays - before, counts);
        }
    }
    ss_fpu_restore_denormals(saved);
    return SOFTSHADOW_OK;
}

/* RMS errors over penumbra points of the spiral and the lattice, against 8,192 Sobol' samples,
 * lights
 * three scene radii away:                  N =   16     64     256    1024   fit
 *   69,666-triangle bunny, light of .3 radii    .040   .014   .0047  .0017  .34 N^-.78
 *   the same, light as large as the bunny       .043   .015   .0050  .0020  .36 N^-.76
 *   2,000 leaves, light of .3 radii             .075   .027   .0100  .0037  .56 N^-.72
 *   the same, light as large as their ball      .086   .037   .0149  .0057  .56 N^-.66
 * The third is taken: surfaces get less error than asked for, dense foliage before a very large
 * light up to 1.5 times more. */
uint32_t ss_raytrace_samples(double tolerance) {
    const double wanted = pow(0.56 / tolerance, 1 / 0.72);
    return (uint32_t)(ceil(fmin(fmax(wanted, 1), 0x1p20) / PACKET) * PACKET);
}

/* The mean of the longest edges of some triangles. */
static double grain_of(const ss_world *world) {
    const size_t step = world->triangle_count / 4096 + 1;
    double sum = 0;
    size_t count = 0;
    for (size_t i = 0; i < world->triangle_count; i += step, count++) {
        double v[3][3], longest = 0;
        ss_world_triangle(world, (uint32_t)i, v);
        for (int k = 0; k < 3; k++) {
            double edge[3];
            ss_sub(v[(k + 1) % 3], v[k], edge);
            longest = ss_max(longest, ss_length(edge));
        }
        sum += longest;
    }
    return count ? sum / (double)count : 0;
}

/* Do most triangles share no corner with others? */
static bool is_loose(const ss_world *world) {
    return world->vertex_count > world->triangle_count + world->triangle_count / 2;
}

softshadow_status ss_raytrace_prepare(const ss_stage *stage, uint32_t samples,
                                      ss_sequence sequence, void **made) {
    *made = NULL;
    state *self = ss_alloc(1, sizeof *self);
    if (!self) return ss_fail(SOFTSHADOW_E_MEMORY, "raytrace: out of memory");
    if (samples == 0) samples = ss_raytrace_samples(stage->params->tolerance);
    const softshadow_status status = ss_samples_create(
        &self->samples, samples, stage->light->type != SOFTSHADOW_RECT, sequence);
    if (status) {
        ss_free(self);
        return status;
    }
    self->widest = grain_of(stage->world) * (is_loose(stage->world) ? COHERENT_LOOSE : COHERENT);
    self->spread = sqrt(fmin(1, (double)PACKET / samples));
    *made = self;
    return SOFTSHADOW_OK;
}

/* Of the table above, what surfaces need for four fifths of the tolerance. */
#define SURFACE_ERROR 0.36
#define SURFACE_SLOPE 0.76
/* The error is at most about this times the root of the packets that see a part, over the samples:
 * an edge across 400 samples meets five or six packets, foliage twenty. */
#define ROUGH 0.66

softshadow_status ss_raytrace_prepare_auto(const ss_stage *stage, void **made) {
    const double tolerance = stage->params->tolerance;
    const double wanted = pow(SURFACE_ERROR / (0.8 * tolerance), 1 / SURFACE_SLOPE);
    const uint32_t few = (uint32_t)(ceil(fmin(wanted, 0x1p20) / PACKET) * PACKET);
    softshadow_status status = ss_raytrace_prepare(stage, 0, SS_SPIRAL, made);
    if (status) return status;
    state *self = *made;
    if (few >= ss_samples_count(self->samples)) return SOFTSHADOW_OK;
    const double root = tolerance * few / ROUGH;
    self->rough = root * root;
    status = ss_samples_create(&self->few, few, stage->light->type != SOFTSHADOW_RECT, SS_SPIRAL);
    if (!status) return status;
    ss_raytrace.destroy(self);
    *made = NULL;
    return status;
}

uint32_t ss_raytrace_first(const void *made) {
    const state *self = made;
    return ss_samples_count(self->few ? self->few : self->samples);
}

static softshadow_status build(const ss_stage *stage, void **made) {
    return ss_raytrace_prepare(stage, stage->params->samples, SS_SPIRAL, made);
}

static void destroy(void *made) {
    state *self = made;
    if (!self) return;
    ss_samples_destroy(self->samples);
    ss_samples_destroy(self->few);
    ss_free(self);
}

static size_t bytes(const void *made) {
    const state *self = made;
    return sizeof *self + ss_samples_bytes(self->samples) +
           (self->few ? ss_samples_bytes(self->few) : 0);
}


const ss_technique ss_raytrace = {
    .name = "raytrace",
    .title = "shadow rays to a low-discrepancy set on the light (Embree)",
    .cite = "CPC84",
    .notes = "converges to the truth; error_bound holds at 99.9 % of points",
    .needs = SS_NEEDS_BVH | SS_NEEDS_RAYS,
    .bound_kind = SOFTSHADOW_BOUND_STATISTICAL,
    .lights_native = SS_LIGHTS_ALL,
    .weightings = 1u << SOFTSHADOW_UNIFORM | 1u << SOFTSHADOW_SOLID_ANGLE |
                  1u << SOFTSHADOW_IRRADIANCE,
    .settles = true,
    .group = GROUP,
    .build = build,
    .query = query,
    .destroy = destroy,
    .bytes = bytes,
};
