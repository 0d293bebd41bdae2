/* Making plates of triangles. */
#include "coverage/plates.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/vec.h"

#define FLAT  0x1p-21 /* local units: what floats of the host's round corners of a plane by */
#define THIN  0x1p-8  /* a height over the longest edge: thinner ones are drawn as they were */
#define SPARE (1 + 0x1p-5)

typedef struct piece {
    double corner[SS_PLATE_CORNERS][3];
    uint32_t corners;
} piece;

static bool is_same(const double a[3], const double b[3]) {
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* Twice the area along the normal; its plane. false: thin, or not convex, or not flat. */
static bool find_plane(const piece *p, double normal[3], double *offset) {
    double e[3], f[3], longest = 0, area;
    ss_sub(p->corner[1], p->corner[0], e);
    ss_sub(p->corner[p->corners - 1], p->corner[0], f);
    ss_cross(e, f, normal);
    area = ss_length(normal);
    if (!ss_normalize(normal)) return false;
    *offset = ss_dot(normal, p->corner[0]);
    for (uint32_t i = 0; i < p->corners; i++) {
        const double *at = p->corner[i], *next = p->corner[(i + 1) % p->corners],
                     *last = p->corner[(i + p->corners - 1) % p->corners];
        double one[3], two[3], turn[3];
        ss_sub(next, at, one);
        ss_sub(last, at, two);
        ss_cross(one, two, turn);
        longest = ss_max(longest, ss_length(one));
        area = ss_min(area, ss_dot(turn, normal));
        if (fabs(ss_dot(normal, at) - *offset) > FLAT) return false;
    }
    return area > THIN * longest * longest;
}

/* Joins two triangles at an edge that they share, if that makes a plate. */
static bool join(const piece *a, const piece *b, piece *out) {
    double normal[3], offset;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            const double *from = a->corner[i], *to = a->corner[(i + 1) % 3];
            const bool along = is_same(from, b->corner[j]) && is_same(to, b->corner[(j + 1) % 3]);
            const bool against = is_same(to, b->corner[j]) && is_same(from, b->corner[(j + 1) % 3]);
            if (!along && !against) continue;
            const double *const all[4] = {to, a->corner[(i + 2) % 3], from, b->corner[(j + 2) % 3]};
            for (int c = 0; c < 4; c++) memcpy(out->corner[c], all[c], sizeof out->corner[c]);
            out->corners = 4;
            if (find_plane(out, normal, &offset)) return true;
        }
    }
    return false;
}

/* Triangles, joined as they come. 0: there are too many. */
static uint32_t find_pieces(const ss_world *world, const uint8_t axis[3], piece *pieces) {
    uint32_t count = 0;
    for (size_t t = 0; t < world->triangle_count; t++) {
        piece here = {.corners = 3}, joined;
        double corner[3][3];
        ss_world_triangle(world, (uint32_t)t, corner);
        for (int c = 0; c < 3; c++) {
            for (int k = 0; k < 3; k++) here.corner[c][k] = corner[c][axis[k]];
        }
        uint32_t i = 0;
        while (i < count && !(pieces[i].corners == 3 && join(&pieces[i], &here, &joined))) i++;
        if (i < count) {
            pieces[i] = joined;
        } else {
            if (count == SS_PLATES_MOST) return 0;
            pieces[count++] = here;
        }
    }
    return count;
}

/* Where the light is to the plate's plane. */
static void set_side(ss_plate *plate, const ss_light *light) {
    const bool sun = light->type == SOFTSHADOW_SUN;
    const double side =
        ss_dot(plate->normal, sun ? light->normal : light->centre) - (sun ? 0 : plate->offset);
    for (int k = 0; k < 3 && side < 0; k++) plate->normal[k] = -plate->normal[k];
    if (side < 0) plate->offset = -plate->offset;
    const double spread = hypot(ss_dot(plate->normal, light->u), ss_dot(plate->normal, light->v));
    const double ball = light->type == SOFTSHADOW_RECT || light->type == SOFTSHADOW_SPHERE
                            ? light->radius
                            : spread;
    const double lowest = (fabs(side) - ball * SPARE) * (1 - 0x1p-20);
    plate->beneath = lowest > 0, plate->lowest = (float)lowest;
}

static bool set_plate(ss_plate *plate, const piece *p, const ss_light *light) {
    double middle[3] = {0}, radius = 0;
    if (!find_plane(p, plate->normal, &plate->offset)) return false;
    plate->corners = p->corners;
    for (uint32_t c = 0; c < p->corners; c++) {
        for (int k = 0; k < 3; k++) {
            plate->corner[c][k] = p->corner[c][k];
            middle[k] += p->corner[c][k] / p->corners;
        }
    }
    for (uint32_t c = 0; c < p->corners; c++) {
        double way[3];
        ss_sub(p->corner[c], middle, way);
        radius = ss_max(radius, ss_length(way));
    }
    for (int k = 0; k < 3; k++) plate->middle[k] = (float)middle[k];
    plate->radius = (float)(radius + FLAT);
    set_side(plate, light);
    return true;
}

static void set_light(ss_plates *out, const ss_light *light, const ss_world *world) {
    const double uu = ss_dot(light->u, light->u), vv = ss_dot(light->v, light->v);
    out->sphere = light->type == SOFTSHADOW_SPHERE, out->sun = light->type == SOFTSHADOW_SUN;
    out->square = light->type == SOFTSHADOW_RECT;
    for (int k = 0; k < 3; k++) {
        out->centre[k] = out->sun ? 0 : (float)light->centre[k];
        out->normal[k] = out->sphere ? 0 : (float)light->normal[k];
        out->a[k] = out->sphere ? 0 : (float)(light->u[k] / uu);
        out->b[k] = out->sphere ? 0 : (float)(light->v[k] / vv);
        out->far += fabsf(out->centre[k]);
        const double origin = (world->low[k] + world->half[k]) * world->scale;
        for (int side = 0; side < 2; side++) {
            const double host = fabs((double)world->bounds[k + 3 * side] + origin);
            out->size = (float)ss_max(out->size, host * (1 + 0x1p-20));
        }
    }
    const double r = light->radius;
    out->radius = (float)r, out->ball = (float)((out->sun ? r / sqrt(1 + r * r) : r) * SPARE);
    out->steep = out->sphere ? 0 : (float)(1 / sqrt(ss_min(uu, vv)));
    out->finite = out->sun ? 0 : 1;
    out->reach = (float)((out->sun ? sqrt(1 + r * r) : 2 * r) * SPARE);
}

softshadow_status ss_plates_create(ss_plates **out, const ss_world *world, const ss_light *light,
                                   const uint8_t axis[3]) {
    piece pieces[SS_PLATES_MOST];
    *out = NULL;
    if (!world->triangle_count || world->triangle_count > 2 * SS_PLATES_MOST || light->point ||
        light->profile_count || world->any_opacity) {
        return SOFTSHADOW_OK;
    }
    const uint32_t count = find_pieces(world, axis, pieces);
    if (!count) return SOFTSHADOW_OK;
    ss_plates *made = ss_alloc(1, sizeof *made);
    if (!made) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory");
    memcpy(made->axis, axis, sizeof made->axis);
    made->count = count;
    set_light(made, light, world);
    for (uint32_t i = 0; i < count; i++) {
        if (set_plate(&made->plate[i], &pieces[i], light)) continue;
        ss_free(made);
        return SOFTSHADOW_OK;
    }
    *out = made;
    return SOFTSHADOW_OK;
}
