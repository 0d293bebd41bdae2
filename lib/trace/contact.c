/* Which faces touch a point, and exact-enough tests against those that nearly do. based on: [WBW13]
 * for edge functions (here in double, and signs that are never wrong); [Eri05, 5.1.5] for the
 * regions of a triangle.
 *
 * With a known triangle the point is put onto it, and what is within SS_TOUCH of that place
 * touches. Without, what is within the rounding of point and face (point->ulp) touches, and the
 * point is put onto the nearest of them. Either way a face whose plane holds the point cannot
 * block: a segment meets that plane at t = 0, or runs inside it. */
#include "trace/contact.h"

#include <math.h>
#include <string.h>

#include "base/predicate.h"
#include "base/vec.h"

#define ROOM 128 /* near boxes looked at */

#define ULPS 4   /* that the distance of a face touched may be: three roundings each of point and face */

typedef struct candidate {
    uint32_t triangle;
    double distance, reach; /* touches if distance <= reach */
    double place[3];        /* the nearest place on the triangle */
} candidate;

/* The largest coordinate as the host gave it, in local units. */
static double host_size(const ss_world *world, const double local[3]) {
    double most = 0;
    for (int k = 0; k < 3; k++) {
        most = ss_max(most, fabs(local[k] + (world->low[k] + world->half[k]) * world->scale));
    }
    return most;
}

static double reach_of(const ss_world *world, double ulp, double size, const double corner[3][3]) {
    for (int i = 0; i < 3 && ulp > 0; i++) size = ss_max(size, host_size(world, corner[i]));
    return ss_max(ULPS * ulp * size, SS_TOUCH);
}

/* No face's reach is longer. */
static double longest_reach(const ss_world *world, double ulp, double size) {
    for (int i = 0; i < 2; i++) {
        const double corner[3] = {world->bounds[3 * i], world->bounds[3 * i + 1],
                                  world->bounds[3 * i + 2]};
        size = ss_max(size, host_size(world, corner) + 0x1p-24); /* bounds are floats */
    }
    return ss_max(ULPS * ulp * size, SS_TOUCH);
}

/* The place on segment a..b nearest to p. */
static double nearest_on_edge(const double p[3], const double a[3], const double b[3],
                              double place[3]) {
    double along[3], to[3], gap[3];
    ss_sub(b, a, along);
    ss_sub(p, a, to);
    const double square = ss_dot(along, along);
    const double t = square > 0 ? ss_min(ss_max(ss_dot(to, along) / square, 0), 1) : 0;
    for (int k = 0; k < 3; k++) place[k] = t == 1 ? b[k] : a[k] + t * along[k];
    ss_sub(p, place, gap);
    return ss_length(gap);
}

/* Fills in a face: its corners, its unit normal (0 0 0 without area), and whether the shape is good
 * enough to trust that. */
static void read_face(const ss_world *world, uint32_t triangle, ss_contact_face *face) {
    double one[3], two[3], three[3];
    ss_world_triangle(world, triangle, face->corner);
    ss_sub(face->corner[1], face->corner[0], one);
    ss_sub(face->corner[2], face->corner[0], two);
    ss_sub(face->corner[2], face->corner[1], three);
    ss_cross(one, two, face->normal);
    const double longest = ss_max(ss_dot(one, one), ss_max(ss_dot(two, two), ss_dot(three, three)));
    face->sound = ss_dot(face->normal, face->normal) >= longest * longest / 64;
    if (!ss_normalize(face->normal)) memset(face->normal, 0, sizeof face->normal);
    for (int c = 0; c < 3; c++) {
        const float *v =
            world->vertices + 3 * (size_t)world->indices[3 * (size_t)triangle + (size_t)c];
        for (int k = 0; k < 3; k++) {
            face->low[k] = c && face->low[k] < v[k] ? face->low[k] : v[k];
            face->high[k] = c && face->high[k] > v[k] ? face->high[k] : v[k];
        }
    }
    face->triangle = triangle;
    face->filled = true;
}

/* From the cache, or into it; without one, into `own`. */
static const ss_contact_face *face_of(const ss_world *world, uint32_t triangle,
                                      ss_contact_face *cache, ss_contact_face *own) {
    ss_contact_face *face = cache ? &cache[triangle % SS_CONTACT_CACHE] : own;
    if (!cache || !face->filled || face->triangle != triangle) read_face(world, triangle, face);
    return face;
}

/* Does p lie beside the triangle's inside, in the direction of its normal? */
static bool over_inside(const double p[3], const double corner[3][3], const double normal[3]) {
    for (int i = 0; i < 3; i++) {
        double along[3], inward[3], to[3];
        ss_sub(corner[(i + 1) % 3], corner[i], along);
        ss_sub(p, corner[i], to);
        ss_cross(normal, along, inward);
        if (ss_dot(inward, to) < 0) return false;
    }
    return true;
}

/* The distance, or some distance beyond `radius` if it is that. A sliver's normal is unsure by its
 * own length: there the edges count, too. */
static double nearest_on_triangle(const double p[3], const ss_contact_face *face, double radius,
                                  double place[3]) {
    double best = INFINITY, to[3];
    const double *normal = face->normal;
    if (normal[0] != 0 || normal[1] != 0 || normal[2] != 0) {
        ss_sub(p, face->corner[0], to);
        const double height = ss_dot(normal, to);
        if (face->sound && fabs(height) > radius) return fabs(height);
        if (over_inside(p, face->corner, normal)) {
            best = fabs(height);
            ss_add_scaled(p, -height, normal, place);
            if (face->sound) return best;
        }
    }
    for (int i = 0; i < 3; i++) {
        double at[3];
        const double distance = nearest_on_edge(p, face->corner[i], face->corner[(i + 1) % 3], at);
        if (distance < best) best = distance, memcpy(place, at, sizeof at);
    }
    return best;
}

double ss_contact_distance(const ss_world *world, uint32_t triangle, const double p[3],
                           ss_contact_face *cache) {
    ss_contact_face own;
    double place[3];
    return nearest_on_triangle(p, face_of(world, triangle, cache, &own), INFINITY, place);
}

/* Keeps the nearest SS_NEAR_MOST, the farthest of them last. */
static void keep(candidate *list, uint32_t *count, const candidate *found) {
    if (*count == SS_NEAR_MOST && found->distance >= list[*count - 1].distance) return;
    uint32_t i = *count < SS_NEAR_MOST ? (*count)++ : *count - 1;
    for (; i > 0 && list[i - 1].distance > found->distance; i--) list[i] = list[i - 1];
    list[i] = *found;
}

/* What was found near a point, nearest first. */
typedef struct nearby {
    candidate list[SS_NEAR_MOST];
    uint32_t count;
    double clear; /* see contact.h */
} nearby;

/* Those of the faces in `box` that could touch p or mislead floats. */
static void sift(const ss_world *world, const double p[3], double ulp, double radius,
                 uint32_t known, const uint32_t *box, size_t found, ss_contact_face *cache,
                 nearby *near) {
    const double size = host_size(world, p);
    const bool tangle = found > ROOM;
    size_t kept = 0;
    near->count = 0;
    for (size_t i = 0; i < found && i < ROOM; i++) {
        ss_contact_face own;
        candidate face = {.triangle = box[i]};
        const ss_contact_face *from = face_of(world, box[i], cache, &own);
        if (box[i] != known) face.distance = nearest_on_triangle(p, from, radius, face.place);
        if (face.distance > radius) continue;
        face.reach = reach_of(world, ulp, size, from->corner);
        kept++;
        keep(near->list, &near->count, &face);
    }
    const bool all = !tangle && kept <= SS_NEAR_MOST;
    /* The point moves by as much as it reaches, too. */
    near->clear = all ? SS_NEAR : SS_NEAR + 2 * longest_reach(world, ulp, size);
}

static double radius_of(const ss_world *world, const double p[3], double ulp) {
    return SS_NEAR + longest_reach(world, ulp, host_size(world, p));
}

/* p lies on `known`. */
static void gather(const ss_bvh *bvh, const ss_world *world, const double p[3], double ulp,
                   uint32_t known, ss_contact_face *cache, nearby *near) {
    uint32_t box[ROOM];
    double radius = radius_of(world, p, ulp);
    size_t found = ss_bvh_near(bvh, p, radius + 0x1p-24, box, ROOM); /* its boxes are floats */
    const bool tangle = found > ROOM;
    if (tangle) { /* only the nearest, then */
        radius = SS_NEAR;
        found = ss_bvh_near(bvh, p, radius + 0x1p-24, box, ROOM);
    }
    sift(world, p, ulp, radius, known, box, found, cache, near);
    if (tangle) near->clear = SS_NEAR + 2 * longest_reach(world, ulp, host_size(world, p));
}

/* Lists the face as tested, with its corners relative to p; false where its plane holds p. */
static bool add_tested(const ss_world *world, ss_contact *contact, uint32_t triangle) {
    double corner[3][3], one[3], two[3], normal[3];
    ss_world_triangle(world, triangle, corner);
    for (int i = 0; i < 3; i++) ss_sub(corner[i], contact->p, corner[i]);
    ss_sub(corner[1], corner[0], one);
    ss_sub(corner[2], corner[0], two);
    ss_cross(one, two, normal);
    if (!ss_normalize(normal) || fabs(ss_dot(normal, corner[0])) <= SS_TOUCH) return false;
    memcpy(contact->tested[contact->tested_count++], corner, sizeof corner);
    return true;
}

/* Puts the point onto the nearest face it touches, unless it is `known` to lie on one, and lists
 * the faces. */
static void settle(const ss_world *world, const nearby *near, uint32_t known,
                   ss_contact *contact) {
    uint32_t tested[SS_NEAR_MOST];
    contact->near_count = contact->tested_count = 0;
    contact->clear = near->clear;
    if (known == SS_NO_TRIANGLE && near->count > 0 &&
        near->list[0].distance <= near->list[0].reach) {
        memcpy(contact->p, near->list[0].place, sizeof contact->p);
    }
    for (uint32_t i = 0; i < near->count; i++) {
        const uint32_t triangle = near->list[i].triangle;
        const bool own = triangle == known; /* whatever its rounding */
        const bool touches = own || near->list[i].distance <= near->list[i].reach;
        const uint32_t place = contact->tested_count;
        if (!touches && add_tested(world, contact, triangle)) tested[place] = triangle;
        else contact->near[contact->near_count++] = triangle;
    }
    memcpy(contact->near + contact->near_count, tested, contact->tested_count * sizeof *tested);
    contact->near_count += contact->tested_count;
}

void ss_contact_find(const ss_bvh *bvh, const ss_world *world, const ss_point *point,
                     ss_contact_face *cache, ss_contact *contact) {
    nearby near;
    const bool on = point->triangle != SS_NO_TRIANGLE && point->ulp == 0;
    const uint32_t known = on ? point->triangle : SS_NO_TRIANGLE;
    memcpy(contact->p, point->p, sizeof contact->p);
    if (on) {
        ss_contact_face own;
        nearest_on_triangle(point->p, face_of(world, known, cache, &own), INFINITY, contact->p);
    }
    gather(bvh, world, contact->p, point->ulp, known, cache, &near);
    settle(world, &near, known, contact);
}

/* Which of them are within the radius of the face's box, and not farther than that from its
 * plane? */
static uint16_t near_face(const ss_contact_face *face, const ss_contact_crowd *crowd,
                          double radius) {
    const double *n = face->normal, *x = crowd->at[0], *y = crowd->at[1], *z = crowd->at[2];
    const double place = ss_dot(n, face->corner[0]);
    const double reach = face->sound ? radius * 1.0001 : INFINITY;
    double low[3], high[3], away[SS_CROWD];
    uint64_t in[SS_CROWD], any = 0;
    uint32_t out = 0;
    for (int i = 0; i < SS_CROWD; i++) {
        away[i] = fabs(n[0] * x[i] + n[1] * y[i] + n[2] * z[i] - place);
        any |= (uint64_t)(away[i] <= reach);
    }
    if (!any) return 0; /* most: a group's box on a slanted surface holds many faces of it */
    for (int k = 0; k < 3; k++) {
        low[k] = face->low[k], high[k] = face->high[k];
    }
    for (int i = 0; i < SS_CROWD; i++) {
        in[i] = (uint64_t)((low[0] - x[i] <= radius) & (x[i] - high[0] <= radius) &
                           (low[1] - y[i] <= radius) & (y[i] - high[1] <= radius) &
                           (low[2] - z[i] <= radius) & (z[i] - high[2] <= radius) &
                           (away[i] <= reach));
    }
    for (int i = 0; i < SS_CROWD; i++) out |= (uint32_t)in[i] << i;
    return (uint16_t)out;
}

/* In ascending order. */
static void add_face(ss_contact_crowd *crowd, uint32_t face, uint16_t of) {
    uint32_t i = crowd->face_count++;
    for (; i > 0 && crowd->face[i - 1] > face; i--) {
        crowd->face[i] = crowd->face[i - 1], crowd->of[i] = crowd->of[i - 1];
    }
    crowd->face[i] = face, crowd->of[i] = of;
}

bool ss_contact_gather(const ss_bvh *bvh, const ss_world *world, ss_contact_crowd *crowd,
                       ss_contact_face *cache) {
    uint32_t box[SS_CROWD_MOST];
    const double size = ss_max(host_size(world, crowd->low), host_size(world, crowd->high));
    const double radius = SS_NEAR + longest_reach(world, crowd->ulp, size) + 0x1p-24;
    const size_t found =
        ss_bvh_near_box(bvh, crowd->low, crowd->high, radius, box, SS_CROWD_MOST);
    crowd->face_count = 0;
    if (found > SS_CROWD_MOST) return false;
    for (size_t i = 0; i < found; i++) {
        ss_contact_face own;
        const uint16_t of = near_face(face_of(world, box[i], cache, &own), crowd, radius);
        if (of) add_face(crowd, box[i], of);
    }
    return true;
}

void ss_contact_find_in(const ss_contact_crowd *crowd, unsigned i, const ss_world *world,
                        const ss_point *point, ss_contact_face *cache, ss_contact *contact) {
    uint32_t box[SS_CROWD_MOST];
    size_t found = 0;
    nearby near;
    for (uint32_t j = 0; j < crowd->face_count; j++) {
        box[found] = crowd->face[j];
        found += crowd->of[j] >> i & 1;
    }
    memcpy(contact->p, point->p, sizeof contact->p);
    if (!found) {
        contact->near_count = contact->tested_count = 0, contact->clear = SS_NEAR;
        return;
    }
    sift(world, contact->p, point->ulp, radius_of(world, contact->p, point->ulp), SS_NO_TRIANGLE,
         box, found, cache, &near);
    settle(world, &near, SS_NO_TRIANGLE, contact);
}

static bool blocks(const double v[3][3], const ss_world *world, uint32_t triangle,
                   const double d[3], double t_end) {
    double size = 0;
    for (int i = 0; i < 9; i++) size = fmax(size, fabs(v[i / 3][i % 3]));
    const double limit = ss_side_limit(size, d);
    const double w = ss_side(d, v[0], v[1], limit), a = ss_side(d, v[1], v[2], limit),
                 b = ss_side(d, v[2], v[0], limit);
    const bool inside = (w >= 0 && a >= 0 && b >= 0) || (w <= 0 && a <= 0 && b <= 0);
    if (!inside) return false;
    double one[3], two[3], normal[3];
    ss_sub(v[1], v[0], one);
    ss_sub(v[2], v[0], two);
    ss_cross(one, two, normal);
    const double height = ss_dot(normal, v[0]), closing = ss_dot(normal, d);
    const double t = height / closing; /* a segment in the plane: infinite or NaN, blocks nothing */
    if (!(t > 0 && t < t_end && !isinf(t))) return false;
    const double sum = w + a + b;
    return sum == 0 || ss_world_opaque_at(world, triangle, b / sum, w / sum);
}

bool ss_contact_blocked(const ss_contact *contact, const ss_world *world, const double d[3],
                        double t_end) {
    for (uint32_t i = 0; i < contact->tested_count; i++) {
        if (blocks((const double(*)[3])contact->tested[i], world,
                   contact->near[ss_contact_touched(contact) + i], d, t_end)) {
            return true;
        }
    }
    return false;
}
