/* What exact.c does before anything is drawn: scratch, and telling which points are lit for
 * sure. */
#include <math.h>
#include <string.h>

#include "base/vec.h"
#include "coverage/floor.h"
#include "coverage/view.h"
#include "technique/exact_parts.h"

/* ---- scratch -----------------------------------------------------------------------------------*/

bool ss_exact_room(scratch *s, size_t count) {
    if (count <= s->direct_room) return true;
    s->direct_room = count * 2;
    s->direct = ss_arena_alloc(s->arena, s->direct_room, sizeof *s->direct);
    s->triangles = ss_arena_alloc(s->arena, s->direct_room, sizeof *s->triangles);
    return s->direct && s->triangles;
}

/* The largest coordinate in a box as the host gave it, in local units. */
static double host_size(const ss_world *world, const double low[3], const double high[3]) {
    double size = 0;
    for (int k = 0; k < 3; k++) {
        const double origin = (world->low[k] + world->half[k]) * world->scale;
        size = ss_max(size, ss_max(fabs(low[k] + origin), fabs(high[k] + origin)));
    }
    return size;
}

/* How far beside the casters a coarser scene may be seen, in half-widths of the light over the
 * tolerance: a thirteenth of one at 1/256, where the RMS error is .0022 in all (bunny, medium
 * light). Twice that saves a tenth of the time and makes it .0049, more than the tolerance
 * allows. */
#define STRAY 20.0
/* At a tolerance of 1/64 that would be .31, and of 262,144 points thirteen would be more than .1
 * off, up to .13 (spheres of a million triangles, medium light); so none is more than .093, for 5 %
 * of the time. */
#define MOST_STRAY 0.25

static size_t planes_of(size_t blocks) {
    return SS_LANES * blocks * 2 * SS_GROUP_PLANES * SS_BLOCK;
}

void ss_exact_clear_planes(scratch *s) {
    const size_t wanted = planes_of(s->group->lattice->blocks);
    if (wanted <= s->clear) return;
    memset(s->group->planes + s->clear, 0, (wanted - s->clear) * sizeof *s->group->planes);
    s->clear = wanted;
}

bool ss_exact_prepare(scratch *s, const ss_stage *stage, const exact *e, ss_arena *arena) {
    double bounds[6];
    for (int k = 0; k < 6; k++) bounds[k] = stage->world->bounds[k];
    *s = (scratch){.stage = stage, .state = e, .arena = arena};
    s->stray = ss_min(STRAY * stage->params->tolerance, MOST_STRAY);
    s->may_settle = stage->params->weighting == SOFTSHADOW_UNIFORM && ss_exact_usual(e)->total > 0;
    s->group = ss_arena_alloc(arena, 1, sizeof *s->group);
    s->contact = ss_arena_alloc(arena, SS_LANES, sizeof *s->contact);
    s->faces = ss_arena_alloc(arena, SS_CONTACT_CACHE, sizeof *s->faces);
    s->view = ss_arena_alloc(arena, SS_LANES, sizeof *s->view);
    s->views = ss_arena_alloc(arena, 1, sizeof *s->views);
    s->skip = ss_arena_alloc(arena, SS_LANES * SS_NEAR_MOST, sizeof *s->skip);
    s->skip_lanes = ss_arena_alloc(arena, SS_LANES * SS_NEAR_MOST, sizeof *s->skip_lanes);
    if (!s->group || !s->contact || !s->faces || !s->view || !s->views || !s->skip ||
        !s->skip_lanes) {
        return false;
    }
    s->size = host_size(stage->world, bounds, bounds + 3);
    for (int i = 0; i < SS_CONTACT_CACHE; i++) s->faces[i].filled = false;
    memset(s->group, 0, sizeof *s->group);
    s->group->bvh = stage->bvh, s->group->lattice = ss_exact_usual(e), s->group->tested = e->tested;
    s->group->outline = e->outline;
    s->group->skip = s->skip, s->group->skip_lanes = s->skip_lanes;
    memcpy(s->group->axis, e->axis, sizeof e->axis);
    s->group->covered =
        ss_arena_alloc(arena, SS_LANES * ss_exact_blocks(e) * SS_BLOCK, sizeof(uint32_t));
    s->group->planes = ss_arena_alloc(arena, planes_of(ss_exact_blocks(e)), sizeof(uint32_t));
    s->together = stage->params->few > 0;
    const size_t marks = 2 * ss_exact_blocks(e) * SS_BLOCK;
    s->marks = ss_arena_alloc(arena, s->together ? SS_LANES * marks : marks, sizeof *s->marks);
    s->group->list = ss_arena_alloc(arena, SS_GROUP_LIST + 1, sizeof *s->group->list);
    s->group->keys = ss_arena_alloc(arena, SS_GROUP_SLOTS, sizeof *s->group->keys);
    s->group->sums = ss_arena_alloc(arena, SS_GROUP_SLOTS, sizeof *s->group->sums);
    s->group->walk = ss_arena_alloc(arena, 1, SS_GROUP_WALK_BYTES);
    if (!s->group->covered || !s->group->planes || !s->marks || !s->group->list ||
        !s->group->keys || !s->group->sums || !s->group->walk) {
        return false;
    }
    memset(s->group->keys, 0xff, SS_GROUP_SLOTS * sizeof *s->group->keys);
    return ss_exact_room(s, 512);
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

static void box_of(const ss_point *points, size_t n, double low[3], double high[3]) {
    double from[3] = {INFINITY, INFINITY, INFINITY}, to[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < n; i++) {
        for (int k = 0; k < 3; k++) {
            from[k] = ss_min(points[i].p[k], from[k]), to[k] = ss_max(points[i].p[k], to[k]);
        }
    }
    memcpy(low, from, sizeof from), memcpy(high, to, sizeof to);
}

/* Does a group's shaft in that frame come out as tight as in its own? */
static bool is_near(const ss_shaft_frame *frame) {
    double size = 0;
    for (int k = 0; k < 3; k++) size = ss_max(size, frame->high[k] - frame->low[k]);
    return size * 8 <= frame->depth;
}

bool ss_exact_measure(scratch *s, const ss_point *points, size_t n) {
    const size_t groups = (n + SS_LANES - 1) / SS_LANES;
    s->points = points;
    s->boxes = ss_arena_alloc(s->arena, groups, sizeof *s->boxes);
    for (size_t i = 0; i < groups && s->boxes; i++) {
        const size_t first = i * SS_LANES, size = n - first < SS_LANES ? n - first : SS_LANES;
        box_of(points + first, size, s->boxes[i], s->boxes[i] + 3);
    }
    return s->boxes != NULL;
}

/* The box of points that begin with a group. */
static void join_boxes(const scratch *s, const ss_point *points, size_t n, double low[3],
                       double high[3]) {
    const size_t first = (size_t)(points - s->points) / SS_LANES;
    memcpy(low, s->boxes[first], 3 * sizeof *low);
    memcpy(high, s->boxes[first] + 3, 3 * sizeof *high);
    for (size_t i = 1; i * SS_LANES < n; i++) {
        const double *box = s->boxes[first + i];
        for (int k = 0; k < 3; k++) {
            low[k] = ss_min(box[k], low[k]), high[k] = ss_max(box[3 + k], high[k]);
        }
    }
}

static void enclose(scratch *s, const ss_point *points, size_t n, ss_shaft_frame *own,
                    const ss_shaft_frame **frame, double low[3], double high[3]) {
    const bool group = n <= SS_LANES;
    if (n == 1)
        box_of(points, n, low, high);
    else
        join_boxes(s, points, n, low, high);
    for (size_t i = 0; i < SS_LANES && group; i++) {
        for (int k = 0; k < 3; k++) s->views->at[k][i] = points[i < n ? i : 0].p[k];
    }
    if (!group || !*frame || !is_near(*frame)) {
        ss_shaft_frame_make(own, s->stage->light, low, high);
        *frame = own;
    }
    ss_group_enclose(s->group, s->stage->light, *frame, low, high, group ? s->views : NULL);
}

/* Where a map, or plates, have told most of the lit points groups are seldom lit, and mostly where
 * the last was. */
#define VAIN 2 /* groups in a row */
static bool is_vain(scratch *s) {
    if ((!s->stage->sky && !s->state->plates) || s->unlit < VAIN) return false;
    return ++s->unlit % 4 != 0;
}

static bool nothing_hides(const scratch *s, const ss_point *points, size_t n, const double low[3],
                          const double high[3]) {
    const ss_group *g = s->group;
    const ss_world *world = s->stage->world;
    ss_floor face;
    if (g->listed_count > SURVIVORS) return false;
    for (uint32_t i = 0; i < g->listed_count; i++) {
        if (ss_floor_beside(world, s->stage->light, s->triangles[i], low, high)) continue;
        if (!ss_floor_make(&face, world, s->stage->light, s->triangles[i], low, high)) return false;
        for (size_t j = 0; j < n; j++) {
            if (!ss_floor_holds(&face, world, &points[j])) return false;
        }
    }
    return all_above(s, points, n);
}

bool ss_exact_settles(scratch *s, const ss_point *points, size_t n, ss_shaft_frame *own,
                      const ss_shaft_frame **frame) {
    ss_group *g = s->group;
    double low[3], high[3];
    enclose(s, points, n, own, frame, low, high);
    if (!s->may_settle || (n <= SS_LANES && is_vain(s))) return false;
    g->listed = s->triangles, g->listed_room = SURVIVORS;
    s->state->kernel->survey(g);
    const bool lit = nothing_hides(s, points, n, low, high);
    if (n <= SS_LANES) s->unlit = lit ? 0 : s->unlit + 1;
    return lit;
}

/* ---- groups ------------------------------------------------------------------------------------*/

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

static void find_contacts(scratch *s, const ss_point *points, unsigned n, double ulp,
                          const double low[3], const double high[3]) {
    const ss_stage *stage = s->stage;
    bool known = false;
    double moved = 0;
    for (unsigned lane = 0; lane < n; lane++) known |= points[lane].triangle != SS_NO_TRIANGLE;
    ss_contact_crowd crowd = {.ulp = ulp};
    for (int k = 0; k < 3; k++) {
        crowd.at[k] = s->views->at[k], crowd.low[k] = low[k], crowd.high[k] = high[k];
    }
    const bool together = !known && ss_contact_gather(stage->bvh, stage->world, &crowd, s->faces);
    for (unsigned lane = 0; lane < n; lane++) {
        ss_contact *contact = &s->contact[lane];
        double gap[3];
        if (together)
            ss_contact_find_in(&crowd, lane, stage->world, &points[lane], s->faces, contact);
        else
            ss_contact_find(stage->bvh, stage->world, &points[lane], s->faces, contact);
        for (int k = 0; k < 3; k++) s->views->at[k][lane] = contact->p[k];
        if (!contact->near_count) continue;
        ss_sub(contact->p, points[lane].p, gap);
        moved = ss_max(moved, ss_length(gap));
        skip_near(s, lane);
    }
    ss_group_widen(s->group, moved);
}

/* ---- what floats are blind for ------------------------------------------------------------------
 *
 * Floats see nothing before t_near, which is along the light's axis. A segment that leaves at a
 * shallow angle to its plane is longer by then than SS_NEAR, within which faces are contact's
 * business: points with another face so near are left to doubles. */

/* The longest such segment. */
static double blind_reach(const scratch *s, unsigned lane) {
    const ss_light *light = &s->state->light;
    const double near = (double)s->group->t_near[lane], radius = light->radius;
    double to[3];
    if (light->type == SOFTSHADOW_SUN) return near * hypot(1, radius);
    ss_sub(light->centre, s->contact[lane].p, to);
    const double distance = ss_length(to);
    if (light->type != SOFTSHADOW_SPHERE) return near * (distance + radius);
    const double tangent = (distance - radius) * (distance + radius);
    return near * distance * distance / sqrt(ss_max(tangent, 0)); /* on the sphere: infinite */
}

/* Is a face within `reach` that contact does not list? Yes, too, where that takes too long to
 * tell. */
static bool is_blind(const scratch *s, unsigned lane, double reach) {
    const ss_stage *stage = s->stage;
    const ss_contact *contact = &s->contact[lane];
    uint32_t face[SS_CROWD_MOST];
    const double radius = reach * 1.0001 + 0x1p-24;
    const size_t found = ss_bvh_near(stage->bvh, contact->p, radius, face, SS_CROWD_MOST);
    if (found > SS_CROWD_MOST) return true;
    for (size_t i = 0; i < found; i++) {
        if (ss_contact_lists(contact, face[i])) continue;
        if (ss_contact_distance(stage->world, face[i], contact->p, s->faces) <= radius) return true;
    }
    return false;
}

static void leave_blind(scratch *s) {
    for (uint32_t m = s->group->lanes; m; m &= m - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(m);
        const double reach = blind_reach(s, lane);
        if (reach > SS_NEAR && is_blind(s, lane, reach)) s->group->lanes &= ~(1u << lane);
    }
}

void ss_exact_view(scratch *s, unsigned lane) {
    ss_group_view_of(s->group, s->views, lane, &s->state->light, &s->view[lane]);
}

void ss_exact_set_up(scratch *s, const ss_point *points, unsigned n) {
    double low[3], high[3], ulp = 0;
    if (n == 1)
        box_of(points, n, low, high);
    else
        join_boxes(s, points, n, low, high);
    for (unsigned lane = 0; lane < n; lane++) ulp = ss_max(ulp, points[lane].ulp);
    s->reach = SS_NEAR + 8 * ulp * (ss_max(s->size, host_size(s->stage->world, low, high)) + 1) +
             2 * SS_TOUCH;
    s->group->skip_count = 0;
    find_contacts(s, points, n, ulp, low, high);
    s->state->kernel->view(s->group, &s->state->light, s->views);
    s->group->lanes &= (1u << n) - 1;
    leave_blind(s);
}
