/* What exact.c does before anything is drawn: scratch, and telling which points are lit for sure. */
#include <math.h>
#include <string.h>

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

bool ss_exact_prepare(scratch *s, const ss_stage *stage, const exact *e, ss_arena *arena) {
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
    return ss_exact_room(s, 512);
}

static void enclose_group(scratch *s, const ss_point *points, size_t n, double low[3],
                          double high[3]) {
    double at[SS_LANES][3];
    for (size_t i = 0; i < n; i++) memcpy(at[i], points[i].p, sizeof at[i]);
    ss_group_enclose(s->group, s->stage->light, (const double(*)[3])at, n, low, high);
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

bool ss_exact_settles(scratch *s, const ss_point *points, size_t n) {
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
