/* exact: no noise. For a group of nearby points everything between them and the light is found once and
 * drawn, from each point, onto the light; what stays uncovered of one fixed set of samples is seen.
 *
 * A point's answer is a function of the point alone: the group only decides what is looked at together
 * and what is certainly not in the way. */
#include "technique/exact.h"

#include <math.h>
#include <string.h>

#include "base/status.h"
#include "base/vec.h"
#include "coverage/direct.h"
#include "coverage/group.h"
#include "trace/contact.h"

/* Floats reach this near a point's own plane, and the light's, in local units: above the rounding of h
 * for vertices in [-1, 1], below SS_NEAR, so that faces at the point are contact's business. */
#define FLOAT_REACH 0x1p-20
/* Where that is more than this share of the way to the light, doubles do it sample by sample. */
#define COARSE 0x1p-6
#define DEFAULT_SAMPLES 512

typedef struct exact {
    ss_lattice *samples;
    ss_outline *outline;
    ss_light light;  /* with its axes in summing order */
    uint8_t axis[3];
    uint8_t *tested; /* per triangle: has an opacity texture; NULL if none has */
    ss_group_kernel *kernel;
} exact;

/* What one query works with. */
typedef struct scratch {
    const ss_stage *stage;
    const exact *state;
    ss_arena *arena;
    ss_group *group;
    ss_contact *contact; /* per lane */
    ss_view *view;       /* per lane, axes in summing order */
    uint32_t *skip;
    uint16_t *skip_lanes;
    ss_direct *direct;
    uint32_t *triangles;
    size_t direct_room;
} scratch;

/* ---- building ----------------------------------------------------------------------------------*/

/* Floats are summed in an order of axes that turns with the scene: bits then do not depend on how the
 * scene's axes are named. The first vertex that tells two axes apart decides, else the light. */
static int compare_axes(const ss_world *world, const ss_light *light, int a, int b) {
    for (size_t v = 0; v < world->vertex_count; v++) {
        const float x = world->vertices[3 * v + (size_t)a], y = world->vertices[3 * v + (size_t)b];
        if (x != y) return x < y ? -1 : 1;
    }
    const double *const vectors[] = {light->centre, light->normal, light->u, light->v};
    for (int i = 0; i < 4; i++) {
        if (vectors[i][a] != vectors[i][b]) return vectors[i][a] < vectors[i][b] ? -1 : 1;
    }
    return 0;
}

static void order_axes(const ss_world *world, const ss_light *light, uint8_t axis[3]) {
    for (int k = 0; k < 3; k++) axis[k] = (uint8_t)k;
    for (int i = 1; i < 3; i++) {
        for (int j = i; j > 0 && compare_axes(world, light, axis[j], axis[j - 1]) < 0; j--) {
            const uint8_t swap = axis[j];
            axis[j] = axis[j - 1], axis[j - 1] = swap;
        }
    }
}

static void turn(const uint8_t axis[3], const double in[3], double out[3]) {
    for (int k = 0; k < 3; k++) out[k] = in[axis[k]];
}

static void turn_light(const uint8_t axis[3], const ss_light *in, ss_light *out) {
    *out = *in;
    turn(axis, in->centre, out->centre);
    turn(axis, in->normal, out->normal);
    turn(axis, in->u, out->u);
    turn(axis, in->v, out->v);
}

static bool mark_tested(const ss_world *world, uint8_t **tested) {
    if (!world->any_opacity) return true;
    *tested = ss_alloc(world->triangle_count, 1);
    for (uint32_t m = 0; m < world->mesh_count && *tested; m++) {
        const ss_world_mesh *mesh = &world->meshes[m];
        if (!mesh->source->opacity.texels) continue;
        memset(*tested + mesh->first_triangle, 1, mesh->source->triangle_count);
    }
    return *tested != NULL;
}

static void exact_destroy(void *state) {
    exact *e = state;
    if (!e) return;
    ss_lattice_destroy(e->samples);
    ss_outline_destroy(e->outline);
    ss_free(e->tested);
    ss_free(e);
}

static softshadow_status exact_build(const ss_stage *stage, void **state) {
    exact *e = ss_alloc(1, sizeof *e);
    if (!e || !mark_tested(stage->world, &e->tested)) {
        exact_destroy(e);
        return ss_fail(SOFTSHADOW_E_MEMORY, "exact: out of memory");
    }
    e->kernel = ss_group_kernel_here();
    order_axes(stage->world, stage->light, e->axis);
    turn_light(e->axis, stage->light, &e->light);
    /* Other weightings reckon with the profile themselves. */
    ss_light shape = *stage->light;
    if (stage->params->weighting != SOFTSHADOW_UNIFORM) shape.profile_count = 0;
    uint32_t samples = stage->params->samples ? stage->params->samples : DEFAULT_SAMPLES;
    if (!stage->params->samples && stage->params->tolerance < 1.0 / 256) {
        /* The error of a lattice falls with the samples to the power of -3/4. */
        const double more = pow(1.0 / 256 / stage->params->tolerance, 4.0 / 3);
        samples = (uint32_t)fmin(DEFAULT_SAMPLES * more, SS_LATTICE_MOST);
    }
    softshadow_status status = ss_lattice_create(&e->samples, &shape, samples);
    if (!status) {
        status = ss_outline_build(&e->outline, stage->bvh, stage->topology, e->tested, stage->pool);
    }
    if (status) exact_destroy(e);
    else *state = e;
    return status;
}

static size_t exact_bytes(const void *state) {
    const exact *e = state;
    return sizeof *e + ss_lattice_bytes(e->samples) + ss_outline_bytes(e->outline);
}

/* ---- a point's view of the light ---------------------------------------------------------------*/

static void direction(const ss_view *view, double s, double t, double d[3]) {
    for (int k = 0; k < 3; k++) d[k] = view->centre[k] + s * view->a[k] + t * view->b[k];
}

/* Writes the lane's projective map; false where floats will not do. */
static bool set_lane(ss_group *g, unsigned lane, const ss_view *view, const double p[3]) {
    double row[3][3], map[3][3], shift[3], reach = 0;
    ss_cross(view->b, view->centre, row[0]);
    ss_cross(view->centre, view->a, row[1]);
    ss_cross(view->a, view->b, row[2]);
    const double det = ss_dot(view->centre, row[2]);
    if (det == 0) return false;
    const double(*grid)[3] = (const double(*)[3])g->lattice->grid;
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < 2; i++) {
            map[i][k] = (grid[i][0] * row[0][k] + grid[i][1] * row[1][k] + grid[i][2] * row[2][k]) / det;
        }
        map[2][k] = row[2][k] / det;
        reach += fabs(map[2][k]);
    }
    for (int i = 0; i < 3; i++) shift[i] = -ss_dot(map[i], p);
    const double near = FLOAT_REACH * reach, far = view->t_end - FLOAT_REACH * (reach + fabs(shift[2]));
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) g->matrix[i][k][lane] = (float)map[i][k];
        g->shift[i][lane] = (float)shift[i];
    }
    g->t_near[lane] = (float)near, g->t_far[lane] = (float)far;
    return near < COARSE * fmin(view->t_end, 1) || isinf(view->t_end);
}

/* ---- samples -----------------------------------------------------------------------------------*/

static bool is_covered(const uint32_t *mask, uint32_t place) {
    return mask[place / 32] >> (place % 32) & 1;
}

/* What is below the horizon of a given normal is hidden: part of the light, all or none of it. */
static void hide_below(const ss_lattice *samples, const ss_view *view, const double normal[3],
                       uint32_t *mask) {
    const double height = ss_dot(normal, view->centre);
    const double a = fabs(ss_dot(normal, view->a)), b = fabs(ss_dot(normal, view->b));
    if (height > a + b) return;
    for (uint32_t i = 0; i < samples->blocks * SS_BLOCK * 32; i++) {
        if (!is_covered(mask, i) && ss_light_below(view, normal, samples->s[i], samples->t[i])) {
            mask[i / 32] |= 1u << (i % 32);
        }
    }
}

static void hide_tested(const scratch *s, unsigned lane, size_t direct_count, double t_end,
                        uint32_t *mask) {
    const ss_lattice *samples = s->state->samples;
    const ss_contact *contact = &s->contact[lane];
    if (!contact->tested_count && !direct_count) return;
    for (uint32_t i = 0; i < samples->blocks * SS_BLOCK * 32; i++) {
        if (is_covered(mask, i)) continue;
        double turned[3], d[3];
        direction(&s->view[lane], samples->s[i], samples->t[i], turned);
        for (int k = 0; k < 3; k++) d[s->state->axis[k]] = turned[k];
        bool blocked = contact->tested_count &&
                       ss_contact_blocked(contact, s->stage->world, d, t_end);
        for (size_t j = 0; j < direct_count && !blocked; j++) {
            blocked = ss_direct_blocks(&s->direct[j], s->stage->world, d, t_end);
        }
        if (blocked) mask[i / 32] |= 1u << (i % 32);
    }
}

static float fraction(const scratch *s, const ss_view *view, const double *normal,
                      const uint32_t *mask) {
    const ss_lattice *samples = s->state->samples;
    const uint32_t weighting = s->stage->params->weighting;
    if (weighting == SOFTSHADOW_UNIFORM) {
        return samples->total ? (float)((double)ss_lattice_visible(samples, mask) / (double)samples->total) : 0;
    }
    double seen = 0, all = 0;
    for (uint32_t i = 0; i < samples->blocks * SS_BLOCK * 32; i++) {
        if (!samples->weight[i]) continue;
        const double weight = samples->weight[i] * ss_light_weight(&s->state->light, view, weighting,
                                                                   normal, samples->s[i], samples->t[i]);
        all += weight;
        if (!is_covered(mask, i)) seen += weight;
    }
    return all > 0 ? (float)(seen / all) : 0;
}

/* ---- one point, in double ----------------------------------------------------------------------*/

static bool room_for(scratch *s, size_t count) {
    if (count <= s->direct_room) return true;
    s->direct_room = count * 2;
    s->direct = ss_arena_alloc(s->arena, s->direct_room, sizeof *s->direct);
    s->triangles = ss_arena_alloc(s->arena, s->direct_room, sizeof *s->triangles);
    return s->direct && s->triangles;
}

static bool skipped(const ss_contact *contact, uint32_t triangle) {
    for (uint32_t i = 0; i < contact->near_count; i++) {
        if (contact->near[i] == triangle) return true;
    }
    return false;
}

/* Everything in this point's shaft, ready to be tested one by one. */
static softshadow_status gather_direct(scratch *s, unsigned lane, size_t *count) {
    const ss_contact *contact = &s->contact[lane];
    size_t found;
    for (;;) {
        found = ss_bvh_shaft(s->stage->bvh, s->stage->light, contact->p, contact->p, s->triangles,
                             s->direct_room);
        if (found <= s->direct_room) break;
        if (!room_for(s, found)) return ss_fail(SOFTSHADOW_E_MEMORY, "exact: out of memory");
    }
    *count = 0;
    for (size_t i = 0; i < found; i++) {
        if (skipped(contact, s->triangles[i])) continue;
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
    if (ss_light_weight(&s->state->light, view, s->stage->params->weighting, normal, 0, 0) <= 0) return 0;
    for (int k = 0; k < 3; k++) d[s->state->axis[k]] = view->centre[k];
    if (contact->tested_count && ss_contact_blocked(contact, s->stage->world, d, t_end)) return 0;
    for (size_t j = 0; j < direct_count; j++) {
        if (ss_direct_blocks(&s->direct[j], s->stage->world, d, t_end)) return 0;
    }
    return 1;
}

/* ---- groups ------------------------------------------------------------------------------------*/

/* The normal in summing order; NULL if none was given. */
static const double *normal_of(const exact *e, const ss_point *point, double out[3]) {
    const double given[3] = {point->normal[0], point->normal[1], point->normal[2]};
    if (given[0] == 0 && given[1] == 0 && given[2] == 0) return NULL;
    turn(e->axis, given, out);
    return out;
}

static float finish(scratch *s, unsigned lane, const ss_point *point, size_t direct_count) {
    const exact *e = s->state;
    const ss_view *view = &s->view[lane];
    double turned[3];
    const double *normal = normal_of(e, point, turned);
    uint32_t *mask = ss_group_mask(s->group, lane);
    hide_tested(s, lane, direct_count, view->t_end, mask);
    if (normal) hide_below(e->samples, view, normal, mask);
    return fraction(s, view, normal, mask);
}

static softshadow_status answer_direct(scratch *s, unsigned lane, const ss_point *point, float *out) {
    const exact *e = s->state;
    double turned[3];
    size_t count = 0;
    const softshadow_status status = gather_direct(s, lane, &count);
    if (status) return status;
    if (e->light.point) {
        *out = hard(s, lane, normal_of(e, point, turned), count);
    } else {
        memcpy(ss_group_mask(s->group, lane), e->samples->outside,
               e->samples->blocks * SS_BLOCK * sizeof(uint32_t));
        *out = finish(s, lane, point, count);
    }
    return SOFTSHADOW_OK;
}

static void skip_near(scratch *s, unsigned lane) {
    ss_group *g = s->group;
    const ss_contact *contact = &s->contact[lane];
    for (uint32_t i = 0; i < contact->near_count; i++) {
        uint32_t j = 0;
        while (j < g->skip_count && s->skip[j] != contact->near[i]) j++;
        if (j == g->skip_count) s->skip[j] = contact->near[i], s->skip_lanes[j] = 0, g->skip_count++;
        s->skip_lanes[j] |= (uint16_t)(1u << lane);
    }
}

/* How far from its point a face of contact's list can be. */
static double near_reach(const ss_world *world, const ss_point *point) {
    double size = 0;
    for (int k = 0; k < 3; k++) {
        const double origin = (world->low[k] + world->half[k]) * world->scale;
        size = fmax(size, fabs(point->p[k] + origin));
        size = fmax(size, fmax(fabs(world->bounds[k] + origin), fabs(world->bounds[3 + k] + origin)));
    }
    return SS_NEAR + 8 * (double)point->ulp * (size + 1) + 2 * SS_TOUCH;
}

static void enclose_points(ss_group *g, const double low[3], const double high[3]) {
    for (int k = 0; k < 3; k++) {
        const double middle = low[k] + (high[k] - low[k]) / 2;
        g->middle[k] = (float)middle;
        g->half[k] = (float)((high[k] - low[k]) / 2 + 0x1p-22 * (fabs(low[k]) + fabs(high[k])));
    }
}

/* The light, or the directions to the sun, as anything in the box sees it. */
static void enclose_light(ss_group *g, const ss_light *light, const double low[3],
                          const double high[3]) {
    const bool sun = light->type == SOFTSHADOW_SUN;
    g->light_finite = sun ? 0 : 1;
    for (int k = 0; k < 3; k++) {
        double from = light->normal[k] - hypot(light->u[k], light->v[k]);
        double to = light->normal[k] + hypot(light->u[k], light->v[k]);
        if (!sun) {
            double n[3] = {0, 0, 0};
            n[k] = 1;
            to = ss_light_support(light, low, high, n);
            n[k] = -1;
            from = -ss_light_support(light, low, high, n);
        }
        g->light_middle[k] = (float)(from + (to - from) / 2);
        g->light_half[k] = (float)((to - from) / 2 + 0x1p-22 * (fabs(from) + fabs(to)));
    }
}

/* The range of t over the lanes, as ss_group has it. reach: see near_reach(). */
static void enclose_depths(ss_group *g, double reach) {
    double least[3], most[3];
    g->t_least = INFINITY, g->t_most = -INFINITY, g->t_safe = 0, g->t_beyond = INFINITY;
    for (int k = 0; k < 3; k++) least[k] = INFINITY, most[k] = -INFINITY;
    for (uint32_t m = g->lanes; m; m &= m - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(m);
        double at = g->shift[2][lane], size = 0;
        for (int k = 0; k < 3; k++) {
            const double n = g->matrix[2][k][lane];
            at += n * g->middle[g->axis[k]];
            size += fabs(n);
            least[k] = fmin(least[k], n), most[k] = fmax(most[k], n);
        }
        g->t_least = fminf(g->t_least, (float)at), g->t_most = fmaxf(g->t_most, (float)at);
        g->t_safe = fmaxf(g->t_safe, (float)fmax(4 * g->t_near[lane], 2 * reach * size));
        g->t_beyond = fminf(g->t_beyond, g->t_far[lane] - 4 * g->t_near[lane]);
    }
    for (int k = 0; k < 3; k++) {
        g->t_axis[g->axis[k]] = (float)((least[k] + most[k]) / 2);
        g->t_spread[g->axis[k]] = (float)((most[k] - least[k]) * 0.5000001);
    }
}

/* Draws the lanes that floats can do; lists the opacity-tested triangles in their way. */
static softshadow_status draw(scratch *s, const double low[3], const double high[3], double reach) {
    ss_group *g = s->group;
    const ss_light *light = s->stage->light;
    ss_shaft_make(&g->shaft, light, s->stage->world->extent, low, high);
    enclose_points(g, low, high);
    enclose_light(g, light, low, high);
    enclose_depths(g, reach);
    for (;;) {
        g->listed = s->triangles, g->listed_room = (uint32_t)s->direct_room;
        s->state->kernel(g);
        if (g->listed_count <= g->listed_room) return SOFTSHADOW_OK;
        if (!room_for(s, g->listed_count)) return ss_fail(SOFTSHADOW_E_MEMORY, "exact: out of memory");
    }
}

static softshadow_status answer_group(scratch *s, const ss_point *points, unsigned n, float *out) {
    const exact *e = s->state;
    ss_group *g = s->group;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    double reach = 0;
    g->lanes = g->skip_count = 0;
    for (unsigned lane = 0; lane < n; lane++) {
        double p[3];
        ss_contact *contact = &s->contact[lane];
        ss_contact_find(s->stage->bvh, s->stage->world, &points[lane], contact);
        turn(e->axis, contact->p, p);
        ss_light_view(&e->light, p, &s->view[lane]);
        if (s->view[lane].inside && !e->light.point) {
            out[lane] = 1;
        } else if (e->light.point || s->view[lane].edge_on ||
                   !set_lane(g, lane, &s->view[lane], p)) {
            const softshadow_status status = answer_direct(s, lane, &points[lane], &out[lane]);
            if (status) return status;
        } else {
            g->lanes |= 1u << lane;
            skip_near(s, lane);
            reach = fmax(reach, near_reach(s->stage->world, &points[lane]));
            for (int k = 0; k < 3; k++) {
                low[k] = fmin(low[k], contact->p[k]), high[k] = fmax(high[k], contact->p[k]);
            }
        }
    }
    if (!g->lanes) return SOFTSHADOW_OK;
    const softshadow_status status = draw(s, low, high, reach);
    if (status) return status;
    for (uint32_t m = g->lanes; m; m &= m - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(m);
        for (uint32_t i = 0; i < g->listed_count; i++) {
            ss_direct_set(&s->direct[i], s->stage->world, s->triangles[i], s->contact[lane].p);
        }
        out[lane] = finish(s, lane, &points[lane], g->listed_count);
    }
    return SOFTSHADOW_OK;
}

static bool prepare(scratch *s, const ss_stage *stage, const exact *e, ss_arena *arena) {
    *s = (scratch){.stage = stage, .state = e, .arena = arena};
    s->group = ss_arena_alloc(arena, 1, sizeof *s->group);
    s->contact = ss_arena_alloc(arena, SS_LANES, sizeof *s->contact);
    s->view = ss_arena_alloc(arena, SS_LANES, sizeof *s->view);
    s->skip = ss_arena_alloc(arena, SS_LANES * SS_NEAR_MOST, sizeof *s->skip);
    s->skip_lanes = ss_arena_alloc(arena, SS_LANES * SS_NEAR_MOST, sizeof *s->skip_lanes);
    if (!s->group || !s->contact || !s->view || !s->skip || !s->skip_lanes) return false;
    memset(s->group, 0, sizeof *s->group);
    s->group->bvh = stage->bvh, s->group->lattice = e->samples, s->group->tested = e->tested;
    s->group->outline = e->outline;
    s->group->stamp = 1;
    s->group->skip = s->skip, s->group->skip_lanes = s->skip_lanes;
    memcpy(s->group->axis, e->axis, sizeof e->axis);
    s->group->covered = ss_arena_alloc(arena, (size_t)SS_LANES * e->samples->blocks * SS_BLOCK,
                                       sizeof(uint32_t));
    const size_t planes = (size_t)SS_LANES * e->samples->blocks * 2 * SS_GROUP_PLANES * SS_BLOCK;
    s->group->planes = ss_arena_alloc(arena, planes, sizeof(uint32_t));
    s->group->list = ss_arena_alloc(arena, SS_GROUP_LIST, sizeof *s->group->list);
    s->group->slots = ss_arena_alloc(arena, SS_GROUP_SLOTS, sizeof *s->group->slots);
    if (!s->group->covered || !s->group->planes || !s->group->list || !s->group->slots) return false;
    memset(s->group->planes, 0, planes * sizeof(uint32_t));
    memset(s->group->slots, 0, SS_GROUP_SLOTS * sizeof *s->group->slots);
    return room_for(s, 512);
}

static softshadow_status exact_query(const ss_stage *stage, const void *state, const ss_point *points,
                                     size_t n, float *visibility, float *bound, ss_arena *arena,
                                     ss_counts *counts) {
    scratch s;
    if (!prepare(&s, stage, state, arena)) return ss_fail(SOFTSHADOW_E_MEMORY, "exact: out of memory");
    for (size_t i = 0; i < n; i += SS_LANES) {
        const unsigned lanes = n - i < SS_LANES ? (unsigned)(n - i) : SS_LANES;
        const softshadow_status status = answer_group(&s, points + i, lanes, visibility + i);
        if (status) return status;
    }
    for (size_t i = 0; i < n; i++) {
        if (bound) bound[i] = NAN;
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
    .needs = SS_NEEDS_BVH | SS_NEEDS_EDGES,
    .bound_kind = SOFTSHADOW_BOUND_NONE,
    .lights_native = 1u << SOFTSHADOW_SPHERE | 1u << SOFTSHADOW_DISK | 1u << SOFTSHADOW_RECT |
                     1u << SOFTSHADOW_SUN,
    .weightings = 1u << SOFTSHADOW_UNIFORM | 1u << SOFTSHADOW_SOLID_ANGLE |
                  1u << SOFTSHADOW_IRRADIANCE,
    .settles = true,
    .group = SS_LANES,
    .build = exact_build,
    .query = exact_query,
    .destroy = exact_destroy,
    .bytes = exact_bytes,
};
