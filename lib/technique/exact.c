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
#include "coverage/direct.h"
#include "coverage/floor.h"
#include "coverage/group.h"
#include "coverage/view.h"
#include "trace/contact.h"

/* As many as fill the smallest grid that keeps a tolerance of 1/256: more would cost twice as much.
 */
#define DEFAULT_DISK 768
#define DEFAULT_RECT 528

typedef struct exact {
    ss_lattice *samples;
    ss_outline *outline;
    ss_light light; /* with its axes in summing order */
    uint8_t axis[3];
    uint8_t *tested; /* per triangle: has an opacity texture; NULL if none has */
    const ss_group_kernel *kernel;
} exact;

/* What one query works with. */
typedef struct scratch {
    const ss_stage *stage;
    const exact *state;
    ss_arena *arena;
    ss_group *group;
    ss_contact *contact; /* per lane */
    ss_contact_face *faces;
    ss_view *view; /* per lane, axes in summing order */
    uint32_t *skip;
    uint16_t *skip_lanes;
    uint32_t *marks; /* tight, wide: see ss_group */
    ss_direct *direct;
    uint32_t *triangles;
    size_t direct_room;
    bool may_settle; /* seeing all of the light makes 1, whatever its parts weigh */
} scratch;

/* ---- building
 * ----------------------------------------------------------------------------------*/

/* Floats are summed in an order of axes that turns with the scene: bits then do not depend on how
 * the scene's axes are named. The first vertex that tells two axes apart decides, else the light.
 */
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

/* A box that holds the light. A sphere is seen as a disk that sticks out of it, but segments are
 * only followed to where they would enter the sphere. */
static void bound_light(const ss_light *light, double low[3], double high[3]) {
    for (int k = 0; k < 3; k++) {
        double reach = fabs(light->u[k]) + fabs(light->v[k]);
        if (light->type == SOFTSHADOW_SPHERE) reach = light->radius;
        if (light->type == SOFTSHADOW_SUN) reach = INFINITY;
        const double centre = light->type == SOFTSHADOW_SUN ? 0 : light->centre[k];
        low[k] = centre - reach, high[k] = centre + reach;
    }
    /* The sun is infinitely far along every axis; along one it is never inside a scene. */
    if (light->type == SOFTSHADOW_SUN) low[0] = high[0] = INFINITY;
}

static softshadow_status exact_build(const ss_stage *stage, void **state) {
    exact *e = ss_alloc(1, sizeof *e);
    if (!e || !mark_tested(stage->world, &e->tested)) {
        exact_destroy(e);
        return ss_fail(SOFTSHADOW_E_MEMORY, "exact: out of memory");
    }
    e->kernel = ss_group_kernels_here();
    order_axes(stage->world, stage->light, e->axis);
    turn_light(e->axis, stage->light, &e->light);
    /* Other weightings reckon with the profile themselves. */
    ss_light shape = *stage->light;
    if (stage->params->weighting != SOFTSHADOW_UNIFORM) shape.profile_count = 0;
    const uint32_t usual = stage->light->type == SOFTSHADOW_RECT ? DEFAULT_RECT : DEFAULT_DISK;
    uint32_t samples = stage->params->samples ? stage->params->samples : usual;
    if (!stage->params->samples && stage->params->tolerance < 1.0 / 256) {
        /* The error of a lattice falls with the samples to the power of -3/4. */
        const double more = pow(1.0 / 256 / stage->params->tolerance, 4.0 / 3);
        samples = (uint32_t)fmin(usual * more, SS_LATTICE_MOST);
    }
    softshadow_status status = ss_lattice_create(&e->samples, &shape, samples);
    if (!status) {
        double low[3], high[3];
        bound_light(stage->light, low, high);
        status = ss_outline_build(&e->outline, stage->bvh, stage->topology, e->tested, low, high,
                                  stage->pool);
    }
    if (status)
        exact_destroy(e);
    else
        *state = e;
    return status;
}

static size_t exact_bytes(const void *state) {
    const exact *e = state;
    return sizeof *e + ss_lattice_bytes(e->samples) + ss_outline_bytes(e->outline);
}

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
    const ss_lattice *samples = s->state->samples;
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
    const ss_lattice *samples = s->state->samples;
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

/* ---- one point, in double
 * ----------------------------------------------------------------------*/

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
    if (normal) ss_bound_hide_below(e->samples, view, normal, mask);
    return fraction(s, view, normal, mask);
}

/* The usual case, where what the kernel drew is all there is to it. */
static bool finish_fast(const scratch *s, unsigned lane, const ss_point *point, float *out) {
    const ss_group *g = s->group;
    if (g->dark >> lane & 1) {
        *out = 0;
        return true;
    }
    if (g->listed_count || any_tested_blocks(s, lane)) return false;
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
        if (j == g->skip_count)
            s->skip[j] = contact->near[i], s->skip_lanes[j] = 0, g->skip_count++;
        s->skip_lanes[j] |= (uint16_t)(1u << lane);
    }
}

/* How far from its point a face of contact's list can be. */
static double near_reach(const ss_world *world, const ss_point *point) {
    double size = 0;
    for (int k = 0; k < 3; k++) {
        const double origin = (world->low[k] + world->half[k]) * world->scale;
        size = fmax(size, fabs(point->p[k] + origin));
        size =
            fmax(size, fmax(fabs(world->bounds[k] + origin), fabs(world->bounds[3 + k] + origin)));
    }
    return SS_NEAR + 8 * (double)point->ulp * (size + 1) + 2 * SS_TOUCH;
}

/* Draws the lanes that floats can do; lists the opacity-tested triangles in their way. The group is
 * enclosed already. */
static softshadow_status draw(scratch *s, double reach) {
    ss_group *g = s->group;
    ss_group_enclose_depths(g, reach);
    for (;;) {
        g->listed = s->triangles, g->listed_room = (uint32_t)s->direct_room;
        s->state->kernel->draw(g);
        if (g->listed_count <= g->listed_room) return SOFTSHADOW_OK;
        if (!room_for(s, g->listed_count))
            return ss_fail(SOFTSHADOW_E_MEMORY, "exact: out of memory");
    }
}

static double distance(const double a[3], const double b[3]) {
    double gap[3];
    ss_sub(a, b, gap);
    return ss_length(gap);
}

static void enclose_group(scratch *s, const ss_point *points, size_t n, double low[3],
                          double high[3]) {
    double at[SS_LANES][3];
    for (size_t i = 0; i < n; i++) memcpy(at[i], points[i].p, sizeof at[i]);
    ss_group_enclose(s->group, s->stage->light, (const double(*)[3])at, n, low, high);
}

/* The group is enclosed already, by its points as they were given. */
static softshadow_status answer_group(scratch *s, const ss_point *points, unsigned n, float *out) {
    const exact *e = s->state;
    ss_group *g = s->group;
    double reach = 0, moved = 0;
    g->lanes = g->skip_count = 0;
    for (unsigned lane = 0; lane < n; lane++) {
        double p[3];
        ss_contact *contact = &s->contact[lane];
        ss_contact_find(s->stage->bvh, s->stage->world, &points[lane], s->faces, contact);
        turn(e->axis, contact->p, p);
        ss_light_view(&e->light, p, &s->view[lane]);
        if (s->view[lane].inside && !e->light.point) {
            out[lane] = 1;
        } else if (e->light.point || s->view[lane].edge_on ||
                   !ss_group_set_lane(g, lane, &s->view[lane], p)) {
            const softshadow_status status = answer_direct(s, lane, &points[lane], &out[lane]);
            if (status) return status;
        } else {
            g->lanes |= 1u << lane;
            skip_near(s, lane);
            reach = fmax(reach, near_reach(s->stage->world, &points[lane]));
            moved = fmax(moved, distance(contact->p, points[lane].p));
        }
    }
    if (!g->lanes) return SOFTSHADOW_OK;
    ss_group_widen(g, moved);
    const softshadow_status status = draw(s, reach);
    if (status) return status;
    for (uint32_t m = g->lanes; m; m &= m - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(m);
        if (finish_fast(s, lane, &points[lane], &out[lane])) continue;
        for (uint32_t i = 0; i < g->listed_count; i++) {
            ss_direct_set(&s->direct[i], s->stage->world, s->triangles[i], s->contact[lane].p);
        }
        out[lane] = finish(s, lane, &points[lane], g->listed_count);
    }
    return SOFTSHADOW_OK;
}

/* ---- settling -----------------------------------------------------------------------------------
 *
 * A block of points is lit when nothing is in its shaft but faces that its points lie on. */

#define SURVIVORS 4 /* faces in the way looked at one by one */

static bool all_above(const scratch *s, const ss_point *points, size_t n) {
    for (size_t i = 0; i < n; i++) {
        const float *normal = points[i].normal;
        const bool horizon = normal[0] != 0 || normal[1] != 0 || normal[2] != 0;
        if (horizon && !ss_light_above(s->stage->light, points[i].p, normal)) return false;
    }
    return true;
}

/* Encloses the points, too; for a group that is what is drawn next. */
static bool settles(scratch *s, const ss_point *points, size_t n) {
    ss_group *g = s->group;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    const ss_world *world = s->stage->world;
    ss_floor face[SURVIVORS];
    for (size_t i = 0; i < n && n > SS_LANES; i++) {
        for (int k = 0; k < 3; k++) {
            low[k] = points[i].p[k] < low[k] ? points[i].p[k] : low[k];
            high[k] = points[i].p[k] > high[k] ? points[i].p[k] : high[k];
        }
    }
    if (n > SS_LANES)
        ss_group_enclose_box(g, s->stage->light, low, high);
    else
        enclose_group(s, points, n, low, high);
    if (!s->may_settle) return false;
    g->listed = s->triangles, g->listed_room = SURVIVORS;
    s->state->kernel->survey(g);
    if (g->listed_count > SURVIVORS) return false;
    for (uint32_t i = 0; i < g->listed_count; i++) {
        if (!ss_floor_make(&face[i], world, s->stage->light, s->triangles[i], low, high))
            return false;
        for (size_t j = 0; j < n; j++) {
            if (!ss_floor_holds(&face[i], world, &points[j])) return false;
        }
    }
    return all_above(s, points, n);
}

/* As answer_group(), but for one point, and only how wrong that can be: which edges cancel depends
 * on the group, and a bound shall not. */
static softshadow_status find_bound(scratch *s, const ss_point *point, float *out) {
    const exact *e = s->state;
    ss_group *g = s->group;
    double turned[3], p[3];
    ss_contact *contact = &s->contact[0];
    const double *normal = normal_of(e, point, turned);
    if (settles(s, point, 1)) { /* as in any block that does */
        *out = 0;
        return SOFTSHADOW_OK;
    }
    ss_contact_find(s->stage->bvh, s->stage->world, point, s->faces, contact);
    turn(e->axis, contact->p, p);
    ss_light_view(&e->light, p, s->view);
    uint32_t *wide = s->marks + (size_t)e->samples->blocks * SS_BLOCK;
    *out = e->light.point || s->view->inside ? 0 : 1;
    g->skip_count = 0, g->lanes = 1;
    if (e->light.point || s->view->inside || s->view->edge_on) return SOFTSHADOW_OK;
    if (!ss_group_set_lane(g, 0, s->view, p) || any_tested_blocks(s, 0)) return SOFTSHADOW_OK;
    skip_near(s, 0);
    memset(s->marks, 0, 2 * (size_t)e->samples->blocks * SS_BLOCK * sizeof *s->marks);
    g->marks = s->marks;
    ss_group_widen(g, distance(contact->p, point->p));
    const softshadow_status status = draw(s, near_reach(s->stage->world, point));
    g->marks = NULL;
    if (status || g->listed_count) return status; /* a texture's holes are not in the lattice */
    if (normal && !ss_light_above(s->stage->light, contact->p, point->normal)) {
        ss_bound_mark_horizon(e->samples, s->view, normal, s->marks, wide);
    }
    *out = ss_bound_sum(e->samples, &e->light, s->view, s->stage->params->weighting, normal,
                        s->marks, wide);
    return SOFTSHADOW_OK;
}

/* Answers a run of points: as a block if it is lit, else in parts, in the end by groups. */
static softshadow_status answer_run(scratch *s, const ss_point *points, size_t n, float *out,
                                    float *bound) {
    if ((s->may_settle || n <= SS_LANES) && settles(s, points, n)) {
        for (size_t i = 0; i < n; i++) {
            out[i] = 1;
            if (bound) bound[i] = 0;
        }
        return SOFTSHADOW_OK;
    }
    if (n <= SS_LANES) {
        softshadow_status status = answer_group(s, points, (unsigned)n, out);
        for (size_t i = 0; i < n && bound && !status; i++) {
            status = find_bound(s, &points[i], &bound[i]);
        }
        return status;
    }
    const size_t part = n > 64 ? 64 : SS_LANES;
    for (size_t i = 0; i < n; i += part) {
        const size_t count = n - i < part ? n - i : part;
        const softshadow_status status =
            answer_run(s, points + i, count, out + i, bound ? bound + i : NULL);
        if (status) return status;
    }
    return SOFTSHADOW_OK;
}

static bool prepare(scratch *s, const ss_stage *stage, const exact *e, ss_arena *arena) {
    *s = (scratch){.stage = stage, .state = e, .arena = arena};
    s->may_settle = stage->params->weighting == SOFTSHADOW_UNIFORM && e->samples->total > 0;
    s->group = ss_arena_alloc(arena, 1, sizeof *s->group);
    s->contact = ss_arena_alloc(arena, SS_LANES, sizeof *s->contact);
    s->faces = ss_arena_alloc(arena, SS_CONTACT_CACHE, sizeof *s->faces);
    s->view = ss_arena_alloc(arena, SS_LANES, sizeof *s->view);
    s->skip = ss_arena_alloc(arena, SS_LANES * SS_NEAR_MOST, sizeof *s->skip);
    s->skip_lanes = ss_arena_alloc(arena, SS_LANES * SS_NEAR_MOST, sizeof *s->skip_lanes);
    if (!s->group || !s->contact || !s->faces || !s->view || !s->skip || !s->skip_lanes)
        return false;
    for (int i = 0; i < SS_CONTACT_CACHE; i++) s->faces[i].filled = false;
    memset(s->group, 0, sizeof *s->group);
    s->group->bvh = stage->bvh, s->group->lattice = e->samples, s->group->tested = e->tested;
    s->group->outline = e->outline;
    s->group->skip = s->skip, s->group->skip_lanes = s->skip_lanes;
    memcpy(s->group->axis, e->axis, sizeof e->axis);
    s->group->covered =
        ss_arena_alloc(arena, (size_t)SS_LANES * e->samples->blocks * SS_BLOCK, sizeof(uint32_t));
    const size_t planes = (size_t)SS_LANES * e->samples->blocks * 2 * SS_GROUP_PLANES * SS_BLOCK;
    s->group->planes = ss_arena_alloc(arena, planes, sizeof(uint32_t));
    s->marks = ss_arena_alloc(arena, 2 * (size_t)e->samples->blocks * SS_BLOCK, sizeof *s->marks);
    s->group->list = ss_arena_alloc(arena, SS_GROUP_LIST + 1, sizeof *s->group->list);
    s->group->keys = ss_arena_alloc(arena, SS_GROUP_SLOTS, sizeof *s->group->keys);
    s->group->sums = ss_arena_alloc(arena, SS_GROUP_SLOTS, sizeof *s->group->sums);
    s->group->walk = ss_arena_alloc(arena, 1, SS_GROUP_WALK_BYTES);
    if (!s->group->covered || !s->group->planes || !s->marks || !s->group->list ||
        !s->group->keys || !s->group->sums || !s->group->walk) {
        return false;
    }
    memset(s->group->planes, 0, planes * sizeof(uint32_t));
    memset(s->group->keys, 0xff, SS_GROUP_SLOTS * sizeof *s->group->keys);
    return room_for(s, 512);
}

static softshadow_status exact_query(const ss_stage *stage, const void *state,
                                     const ss_point *points, size_t n, float *visibility,
                                     float *bound, ss_arena *arena, ss_counts *counts) {
    scratch s;
    if (!prepare(&s, stage, state, arena))
        return ss_fail(SOFTSHADOW_E_MEMORY, "exact: out of memory");
    const softshadow_status status = answer_run(&s, points, n, visibility, bound);
    if (status) return status;
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
    .needs = SS_NEEDS_BVH | SS_NEEDS_EDGES | SS_NEEDS_COMPONENTS,
    .bound_kind = SOFTSHADOW_BOUND_CERTIFIED,
    .lights_native = 1u << SOFTSHADOW_SPHERE | 1u << SOFTSHADOW_DISK | 1u << SOFTSHADOW_RECT |
                     1u << SOFTSHADOW_SUN,
    .weightings =
        1u << SOFTSHADOW_UNIFORM | 1u << SOFTSHADOW_SOLID_ANGLE | 1u << SOFTSHADOW_IRRADIANCE,
    .settles = true,
    .group = SS_LANES,
    .build = exact_build,
    .query = exact_query,
    .destroy = exact_destroy,
    .bytes = exact_bytes,
};
