/* exact: no noise. For a group of nearby points everything between them and the light is found once
 * and drawn, from each point, onto the light; what stays uncovered of one fixed set of samples is
 * seen.
 *
 * A point's answer is a function of the point alone: the group only decides what is looked at
 * together and what is certainly not in the way. */
#include "technique/exact.h"

#include <math.h>
#include <string.h>

#include "base/status.h"
#include "base/vec.h"
#include "coverage/bound.h"
#include "coverage/slab.h"
#include "coverage/view.h"
#include "technique/exact_parts.h"
#include "technique/raytrace.h"

/* ---- a point's view of the light
 * ---------------------------------------------------------------*/

static void direction(const ss_view *view, double s, double t, double d[3]) {
    for (int k = 0; k < 3; k++) d[k] = view->centre[k] + s * view->a[k] + t * view->b[k];
}

/* ---- samples
 * -----------------------------------------------------------------------------------*/

static bool is_covered(const uint32_t *mask, uint32_t place) {
    return mask[place / 32] >> (place % 32) & 1;
}

/* Directions in the world's axes. */
static void world_direction(const scratch *s, unsigned lane, double at_s, double at_t,
                            double d[3]) {
    double turned[3];
    direction(&s->view[lane], at_s, at_t, turned);
    for (int k = 0; k < 3; k++) d[s->state->axis[k]] = turned[k];
}

/* Can a face near the point be in the way at all? Not if the whole square around the light is
 * beyond one of its edges and within another: sides are linear in the direction. */
static bool can_block(const double v[3][3], const double square[4][3]) {
    bool left = false, right = false;
    for (int i = 0; i < 3; i++) {
        double moment[3], least = INFINITY, most = -INFINITY;
        ss_cross(v[i], v[(i + 1) % 3], moment);
        for (int c = 0; c < 4; c++) {
            const double side = ss_dot(moment, square[c]);
            least = fmin(least, side), most = fmax(most, side);
        }
        left |= least > 0, right |= most < 0;
    }
    return !(left && right);
}

static bool any_tested_blocks(const scratch *s, unsigned lane) {
    const ss_contact *contact = &s->contact[lane];
    double square[4][3];
    if (!contact->tested_count) return false;
    for (int c = 0; c < 4; c++) world_direction(s, lane, c & 1 ? 1 : -1, c & 2 ? 1 : -1, square[c]);
    for (uint32_t i = 0; i < contact->tested_count; i++) {
        if (can_block((const double(*)[3])contact->tested[i], (const double(*)[3])square))
            return true;
    }
    return false;
}

static void hide_tested(const scratch *s, unsigned lane, size_t direct_count, double t_end,
                        uint32_t *mask) {
    const ss_lattice *samples = s->group->lattice;
    const bool near = any_tested_blocks(s, lane);
    if (!near && !direct_count) return;
    for (uint32_t i = 0; i < samples->blocks * SS_BLOCK * 32; i++) {
        if (is_covered(mask, i)) continue;
        double d[3];
        world_direction(s, lane, samples->s[i], samples->t[i], d);
        bool blocked = near && ss_contact_blocked(&s->contact[lane], s->stage->world, d, t_end);
        for (size_t j = 0; j < direct_count && !blocked; j++) {
            blocked = ss_direct_blocks(&s->direct[j], s->stage->world, d, t_end);
        }
        if (blocked) mask[i / 32] |= 1u << (i % 32);
    }
}

static float fraction(const scratch *s, const ss_view *view, const double *normal,
                      const uint32_t *mask) {
    const ss_lattice *samples = s->group->lattice;
    const uint32_t weighting = s->stage->params->weighting;
    if (weighting == SOFTSHADOW_UNIFORM) {
        return samples->total
                   ? (float)((double)ss_lattice_visible(samples, mask) / (double)samples->total)
                   : 0;
    }
    double seen = 0, all = 0;
    for (uint32_t i = 0; i < samples->blocks * SS_BLOCK * 32; i++) {
        if (!samples->weight[i]) continue;
        const double weight =
            samples->weight[i] * ss_light_weight(&s->state->light, view, weighting, normal,
                                                 samples->s[i], samples->t[i]);
        all += weight;
        if (!is_covered(mask, i)) seen += weight;
    }
    return all > 0 ? (float)(seen / all) : 0;
}

/* ---- one point, in double -------------------------------------------------------------------- */

/* Everything in this point's shaft, ready to be tested one by one. */
static softshadow_status gather_direct(scratch *s, unsigned lane, size_t *count) {
    const ss_contact *contact = &s->contact[lane];
    size_t found;
    for (;;) {
        found = ss_bvh_shaft(s->stage->bvh, s->stage->light, contact->p, contact->p, s->triangles,
                             s->direct_room);
        if (found <= s->direct_room) break;
        if (!ss_exact_room(s, found)) return ss_fail(SOFTSHADOW_E_MEMORY, "exact: out of memory");
    }
    *count = 0;
    for (size_t i = 0; i < found; i++) {
        if (ss_contact_lists(contact, s->triangles[i])) continue;
        ss_direct_set(&s->direct[(*count)++], s->stage->world, s->triangles[i], contact->p);
    }
    return SOFTSHADOW_OK;
}

/* A point light: one segment. */
static float hard(const scratch *s, unsigned lane, const double *normal, size_t direct_count) {
    const ss_contact *contact = &s->contact[lane];
    const ss_view *view = &s->view[lane];
    const double t_end = view->t_end < INFINITY ? view->t_end : INFINITY;
    double d[3];
    if (normal && ss_light_below(view, normal, 0, 0)) return 0;
    if (ss_light_weight(&s->state->light, view, s->stage->params->weighting, normal, 0, 0) <= 0)
        return 0;
    for (int k = 0; k < 3; k++) d[s->state->axis[k]] = view->centre[k];
    if (contact->tested_count && ss_contact_blocked(contact, s->stage->world, d, t_end)) return 0;
    for (size_t j = 0; j < direct_count; j++) {
        if (ss_direct_blocks(&s->direct[j], s->stage->world, d, t_end)) return 0;
    }
    return 1;
}

/* ---- groups
 * ------------------------------------------------------------------------------------*/

/* The normal in summing order; NULL if none was given. */
static const double *normal_of(const exact *e, const ss_point *point, double out[3]) {
    const double given[3] = {point->normal[0], point->normal[1], point->normal[2]};
    if (given[0] == 0 && given[1] == 0 && given[2] == 0) return NULL;
    ss_exact_turn(e->axis, given, out);
    return out;
}

static float finish(scratch *s, unsigned lane, const ss_point *point, size_t direct_count) {
    const ss_view *view = &s->view[lane];
    double turned[3];
    const double *normal = normal_of(s->state, point, turned);
    uint32_t *mask = ss_group_mask(s->group, lane);
    hide_tested(s, lane, direct_count, view->t_end, mask);
    if (normal) ss_bound_hide_below(s->group->lattice, view, normal, mask);
    return fraction(s, view, normal, mask);
}

/* The usual case, where what the kernel drew is all there is to it. */
static bool finish_fast(scratch *s, unsigned lane, const ss_point *point, float *out) {
    const ss_group *g = s->group;
    if (g->dark >> lane & 1) {
        *out = 0;
        return true;
    }
    if (g->listed_count) return false;
    if (s->contact[lane].tested_count) {
        ss_exact_view(s, lane);
        if (any_tested_blocks(s, lane)) return false;
    }
    if (s->stage->params->weighting != SOFTSHADOW_UNIFORM) return false;
    const float *n = point->normal;
    const bool horizon = n[0] != 0 || n[1] != 0 || n[2] != 0;
    if (horizon && !ss_light_above(s->stage->light, s->contact[lane].p, n)) return false;
    *out = g->lit >> lane & 1 ? 1 : (float)((double)g->visible[lane] / (double)g->lattice->total);
    return true;
}

static softshadow_status answer_direct(scratch *s, unsigned lane, const ss_point *point,
                                       float *out) {
    const exact *e = s->state;
    const ss_lattice *before = s->group->lattice;
    double turned[3];
    size_t count = 0;
    const softshadow_status status = gather_direct(s, lane, &count);
    if (status) return status;
    if (e->light.point) {
        *out = hard(s, lane, normal_of(e, point, turned), count);
    } else {
        const ss_lattice *samples = s->group->lattice = ss_exact_usual(e);
        memcpy(ss_group_mask(s->group, lane), samples->outside,
               samples->blocks * SS_BLOCK * sizeof(uint32_t));
        *out = finish(s, lane, point, count);
        s->group->lattice = before;
    }
    return SOFTSHADOW_OK;
}

/* Finds how far along the segments of the group's lanes what scene counts. The group is enclosed
 * already. */
static void set_depths(scratch *s) {
    ss_group *g = s->group;
    s->state->kernel->depths(g, s->reach);
    const double strays = ss_group_set_slabs(g, s->stage->lod, s->stray);
    if (g->marks && strays > 0) { /* of the casters themselves, and around them */
        ss_group_widen(g, strays);
        g->slab_count = 1, g->slabs[0].t_until = INFINITY;
    }
}

/* Draws the lanes that floats can do; lists the opacity-tested triangles in their way. */
static softshadow_status draw(scratch *s) {
    ss_group *g = s->group;
    ss_exact_clear_planes(s);
    for (;;) {
        g->listed = s->triangles, g->listed_room = (uint32_t)s->direct_room;
        s->state->kernel->draw(g);
        if (g->listed_count <= g->listed_room) return SOFTSHADOW_OK;
        if (!ss_exact_room(s, g->listed_count))
            return ss_fail(SOFTSHADOW_E_MEMORY, "exact: out of memory");
    }
}

/* Draws the group's lanes and answers those for which this step is enough. Gives the others. */
static softshadow_status answer_drawn(scratch *s, const ss_point *points, unsigned step, float *out,
                                      uint32_t *others) {
    ss_group *g = s->group;
    const bool last = step + 1 == s->state->steps;
    *others = 0;
    g->fronts_first = s->in_dark;
    const softshadow_status status = draw(s);
    if (status) return status;
    s->in_dark = g->dark == g->lanes;
    for (uint32_t m = g->lanes; m; m &= m - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(m);
        if (!last && !((g->lit | g->dark) >> lane & 1) && g->rough[lane] > s->state->rough[step]) {
            *others |= 1u << lane;
            continue;
        }
        if (finish_fast(s, lane, &points[lane], &out[lane])) continue;
        ss_exact_view(s, lane);
        for (uint32_t i = 0; i < g->listed_count; i++) {
            ss_direct_set(&s->direct[i], s->stage->world, s->triangles[i], s->contact[lane].p);
        }
        out[lane] = finish(s, lane, &points[lane], g->listed_count);
    }
    return SOFTSHADOW_OK;
}

/* Where most groups of this range have needed all samples, foliage for one, the next will. Where it
 * is the walk that takes time, samples take little, and a second walk takes as much again. */
#define LONG 100000 /* ns */
static unsigned first_step(scratch *s) {
    unsigned step = s->last > LONG ? s->state->usual : 0;
    for (; step + 1 < s->state->steps; step++) {
        if (s->failed[step] <= 2 || 2 * s->failed[step] <= s->tried[step]) break;
    }
    return step;
}

/* ---- rays ----------------------------------------------------------------------------------- */

/* Where the last group took less than this share of what rays would, the next hardly takes all. */
#define CHEAP 0.25

/* Nanoseconds of a ray in a packet of sixteen, of any tree that is too large for the caches; umbrae
 * and penumbrae take the same. */
#define RAY 150

static uint32_t cost_of_rays(const ss_stage *stage) {
    return (uint32_t)fmin((double)RAY * SS_LANES * ss_raytrace_first(stage->tracer), INT32_MAX);
}

/* Would drawing this group take longer than rays? Foretold from the nodes in its shaft. */
static bool rays_are_faster(scratch *s) {
    if (s->last < CHEAP * s->rays_take) return false;
    s->last = s->state->kernel->weigh(s->group, s->rays_take);
    return s->last >= s->rays_take;
}

static softshadow_status trace_group(scratch *s, const ss_point *points, unsigned n, float *out) {
    ss_counts counts = {0};
    const softshadow_status status =
        ss_raytrace.query(s->stage, s->stage->tracer, points, n, out, NULL, s->arena, &counts);
    s->traced += counts.traced, s->rays += counts.rays;
    return status;
}

/* Those that a step does not do take the next. */
static softshadow_status answer_steps(scratch *s, const ss_point *points, unsigned step, float *out,
                                      unsigned taken[SS_LANES]) {
    const exact *e = s->state;
    ss_group *g = s->group;
    for (bool first = true;; first = false) {
        uint32_t others;
        s->tried[step]++;
        const softshadow_status status = answer_drawn(s, points, step, out, &others);
        if (first) s->last = ss_group_took(g);
        if (status || !others) return status;
        s->failed[step]++;
        g->lattice = e->step[++step];
        for (uint32_t m = others; m; m &= m - 1) taken[__builtin_ctz(m)] = step;
        e->kernel->view(g, &e->light, s->views);
        g->lanes = others;
        set_depths(s);
    }
}

/* The group is enclosed already, by its points as they were given. taken: which step's samples each
 * of them was answered with. */
static softshadow_status answer_group(scratch *s, const ss_point *points, unsigned n, float *out,
                                      unsigned taken[SS_LANES]) {
    const exact *e = s->state;
    ss_group *g = s->group;
    const unsigned first = first_step(s);
    g->lattice = e->step[first];
    ss_exact_set_up(s, points, n);
    if (e->light.point) g->lanes = 0;
    for (unsigned i = 0; i < n; i++) taken[i] = g->lanes >> i & 1 ? first : e->usual;
    for (uint32_t m = ((1u << n) - 1) & ~g->lanes; m; m &= m - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(m);
        ss_exact_view(s, lane);
        out[lane] = 1;
        if (s->view[lane].inside && !e->light.point) continue;
        const softshadow_status status = answer_direct(s, lane, &points[lane], &out[lane]);
        if (status) return status;
    }
    if (!g->lanes) return SOFTSHADOW_OK;
    set_depths(s);
    if (s->rays_take && rays_are_faster(s)) return trace_group(s, points, n, out);
    return answer_steps(s, points, first, out, taken);
}

/* How wrong the answers of some of the group's lanes can be, as their marks say after a draw. */
static void sum_marks(scratch *s, const ss_point *points, uint32_t lanes, float *out) {
    ss_group *g = s->group;
    double turned[3];
    for (; lanes; lanes &= lanes - 1) {
        const unsigned i = (unsigned)__builtin_ctz(lanes);
        const double *normal = normal_of(s->state, &points[i], turned);
        uint32_t *tight = ss_group_marks(g, i), *wide = tight + g->lattice->blocks * SS_BLOCK;
        ss_exact_view(s, i);
        out[i] = 1;
        if (any_tested_blocks(s, i) || g->listed_count) continue; /* holes are in no lattice */
        if (normal && !ss_light_above(s->stage->light, s->contact[i].p, points[i].normal)) {
            ss_bound_mark_horizon(g->lattice, &s->view[i], normal, tight, wide);
        }
        out[i] = ss_bound_sum(g->lattice, &s->state->light, &s->view[i],
                              s->stage->params->weighting, normal, tight, wide);
    }
}

/* Bounds of the first n lanes of a group that is set up, so far as they are in `lanes`; the group's
 * views are of this lattice. */
static softshadow_status bound_lanes(scratch *s, const ss_point *points, unsigned n, uint32_t lanes,
                                     float *out) {
    ss_group *g = s->group;
    const bool point = s->state->light.point;
    const uint32_t drawn = point ? 0 : g->lanes & lanes;
    for (unsigned i = 0; i < n; i++) {
        if (lanes >> i & 1) out[i] = point || s->views->inside >> i & 1 ? 0 : 1;
    }
    if (!drawn) return SOFTSHADOW_OK;
    g->lanes = drawn, g->marks = s->marks;
    for (uint32_t m = drawn; m; m &= m - 1) {
        memset(ss_group_marks(g, (unsigned)__builtin_ctz(m)), 0,
               2 * (size_t)g->lattice->blocks * SS_BLOCK * sizeof *s->marks);
    }
    set_depths(s);
    const softshadow_status status = draw(s);
    if (!status) sum_marks(s, points, drawn, out);
    g->marks = NULL;
    return status;
}

/* As answer_group(), but for one point: which edges cancel depends on the group, and a bound shall
 * not. */
static softshadow_status find_bound(scratch *s, const ss_point *point, const ss_lattice *lattice,
                                    float *out) {
    ss_shaft_frame own;
    const ss_shaft_frame *frame = NULL;
    const bool settles = ss_exact_settles(s, point, 1, &own, &frame);
    *out = 0;
    if (settles && !s->stage->lod) return SOFTSHADOW_OK; /* as in any block that does */
    s->group->lattice = lattice;
    ss_exact_set_up(s, point, 1);
    return bound_lanes(s, point, 1, 1, out);
}

/* For all of a group at once, right after it was answered: each walk serves sixteen points. */
static softshadow_status find_bounds(scratch *s, const ss_point *points, unsigned n,
                                     const unsigned taken[SS_LANES], float *out) {
    const exact *e = s->state;
    softshadow_status status = SOFTSHADOW_OK;
    for (unsigned step = 0; step < e->steps && !status; step++) {
        uint32_t lanes = 0;
        for (unsigned i = 0; i < n; i++) lanes |= (uint32_t)(taken[i] == step) << i;
        if (!lanes) continue;
        s->group->lattice = e->step[step];
        e->kernel->view(s->group, &e->light, s->views);
        status = bound_lanes(s, points, n, lanes, out);
    }
    return status;
}

/* Answers a run of points: as a block if it is lit, else in parts, in the end by groups. */
static softshadow_status answer_run(scratch *s, const ss_point *points, size_t n,
                                    const ss_shaft_frame *frame, float *out, float *bound) {
    ss_shaft_frame own;
    if ((s->may_settle || n <= SS_LANES) && ss_exact_settles(s, points, n, &own, &frame)) {
        for (size_t i = 0; i < n; i++) {
            out[i] = 1;
            if (bound) bound[i] = 0;
        }
        s->settled += n;
        return SOFTSHADOW_OK;
    }
    if (n <= SS_LANES) {
        unsigned taken[SS_LANES];
        softshadow_status status = answer_group(s, points, (unsigned)n, out, taken);
        if (bound && s->together && !status)
            return find_bounds(s, points, (unsigned)n, taken, bound);
        for (size_t i = 0; i < n && bound && !status; i++) {
            status = find_bound(s, &points[i], s->state->step[taken[i]], &bound[i]);
        }
        return status;
    }
    const size_t part = n > 64 ? 64 : SS_LANES;
    for (size_t i = 0; i < n; i += part) {
        const size_t count = n - i < part ? n - i : part;
        const softshadow_status status =
            answer_run(s, points + i, count, frame, out + i, bound ? bound + i : NULL);
        if (status) return status;
    }
    return SOFTSHADOW_OK;
}

static softshadow_status exact_query(const ss_stage *stage, const void *state,
                                     const ss_point *points, size_t n, float *visibility,
                                     float *bound, ss_arena *arena, ss_counts *counts) {
    scratch s;
    if (!ss_exact_prepare(&s, stage, state, arena) || !ss_exact_measure(&s, points, n))
        return ss_fail(SOFTSHADOW_E_MEMORY, "exact: out of memory");
    /* Rays cannot certify a bound. */
    if (stage->tracer && !bound) s.rays_take = s.last = cost_of_rays(stage);
    const softshadow_status status = answer_run(&s, points, n, NULL, visibility, bound);
    if (status) return status;
    counts->settled += s.settled, counts->traced += s.traced, counts->rays += s.rays;
    for (size_t i = 0; i < n; i++) {
        counts->lit += visibility[i] == 1;
        counts->umbra += visibility[i] == 0;
        counts->penumbra += visibility[i] > 0 && visibility[i] < 1;
    }
    return SOFTSHADOW_OK;
}

const ss_technique ss_exact = {
    .name = "exact",
    .title = "Noise-free coverage of the light by everything in the way",
    .cite = "ours",
    .notes = "all lights native; the same samples of the light for every point",
    .needs = SS_NEEDS_BVH | SS_NEEDS_EDGES | SS_NEEDS_COMPONENTS | SS_NEEDS_SKY,
    .bound_kind = SOFTSHADOW_BOUND_CERTIFIED,
    .lights_native = SS_LIGHTS_ALL,
    .weightings =
        1u << SOFTSHADOW_UNIFORM | 1u << SOFTSHADOW_SOLID_ANGLE | 1u << SOFTSHADOW_IRRADIANCE,
    .group = SS_LANES,
    .build = ss_exact_build,
    .query = exact_query,
    .plates = ss_exact_plates,
    .destroy = ss_exact_destroy,
    .bytes = ss_exact_bytes,
    .casters_culled = ss_exact_culled,
};
