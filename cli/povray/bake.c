/* bake.c - visibility at the vertices of a surface that is split where it is not linear.
 *
 * Triangles of the mesh are split each by itself, because visibility jumps where two meet: each has
 * a horizon of its own. Rounds: every edge that is new is looked at; first it is split when it is
 * long, then, some times, when the visibility at its middle is off the mean of its ends. */
#include <stdlib.h>
#include <string.h>

#include "povray.h"

/* In radii of the scene: no edge is longer (farther out than two radii: in proportion to the
 * distance), none shorter is split for its visibility. */
static const double longest = 1.0 / 16, shortest = 1.0 / 256;

/* Rounds for visibility: longest / shortest is 2^4. Without a limit triangles beside an edge that a
 * shadow's rim runs along would be split for ever: that edge stays, and so do long ones to it. */
enum { ROUNDS = 4 };

/* Visibility is written with 8 bits: what is off by less than four steps of it is hardly seen. */
static const float straight = 4.0f / 255;

enum { KEPT = UINT32_MAX, PENDING = UINT32_MAX - 1 };

typedef struct edge {
    uint64_t ends; /* smaller << 32 | larger; 0: a free place, as no edge joins 0 and 0 */
    uint32_t middle; /* a vertex, or KEPT */
} edge;

typedef struct edges {
    edge *places;
    size_t count, room; /* room is a power of two */
} edges;

typedef struct front {
    povray_surface *surface;
    const picture *picture;
    cli_scene *scene;
    uint32_t number; /* of the surface */
    edges edges;
    size_t active; /* triangles from this one on are new */
    /* the middles that are asked for, and which edges they are of */
    povray_vertex *middles;
    uint64_t *ends;
    size_t count, room;
} front;

static bool no_memory(cli_error *error) { return cli_fail(error, CLI_FAILED, "memory ran out"); }

static edge *place_of(const edges *all, uint64_t ends) {
    size_t at = (size_t)((ends * 0x9e3779b97f4a7c15u) >> 20) & (all->room - 1);
    while (all->places[at].ends && all->places[at].ends != ends) at = (at + 1) & (all->room - 1);
    return &all->places[at];
}

static bool more_edges(edges *all) {
    edges larger = {.count = all->count, .room = all->room ? 2 * all->room : 4096};
    larger.places = calloc(larger.room, sizeof *larger.places);
    if (!larger.places) return false;
    for (size_t i = 0; i < all->room; i++)
        if (all->places[i].ends) *place_of(&larger, all->places[i].ends) = all->places[i];
    free(all->places);
    *all = larger;
    return true;
}

static uint64_t ends_of(uint32_t a, uint32_t b) {
    return a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
}

/* ---- Asking ---------------------------------------------------------------------------------*/

/* Which side of a triangle the light is on: that of a solid is its outside, or all is hidden. */
static vector lit_side(const front *f, const povray_vertex *v) {
    const softshadow_light *light = &f->picture->build->lights[0];
    const vector side = normals_flat(&f->picture->normals[f->number], v->triangle);
    const vector to = light->type == SOFTSHADOW_SUN
                          ? vector_scale(vector_of(light->direction), -1)
                          : vector_sub(vector_of(light->position), vector_of(v->position));
    return vector_dot(side, to) < 0 ? vector_scale(side, -1) : side;
}

static bool ask(const front *f, povray_vertex *vertices, size_t count, cli_error *error) {
    float *seen = malloc((count + 1) * sizeof *seen);
    float *normals = malloc((count + 1) * 3 * sizeof *normals);
    uint64_t *primitives = malloc((count + 1) * sizeof *primitives);
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    points.position_type = SOFTSHADOW_F64;
    points.positions = vertices->position;
    points.position_stride = sizeof *vertices;
    points.normals = normals;
    points.primitives = primitives;
    points.count = count;
    bool fine = (seen && normals && primitives) || no_memory(error);
    for (size_t i = 0; fine && i < count; i++) {
        const vector side = lit_side(f, &vertices[i]);
        memcpy(normals + 3 * i, (float[]){(float)side.x, (float)side.y, (float)side.z},
               3 * sizeof(float));
        primitives[i] = f->number == f->picture->ground
                            ? SOFTSHADOW_NO_PRIMITIVE
                            : (uint64_t)f->number << 32 | vertices[i].triangle;
    }
    if (fine && count) {
        const softshadow_status status =
            softshadow_query_visibility(f->scene->handle, &points, seen);
        fine = status == SOFTSHADOW_OK || cli_scene_fail(f->scene, status, NULL, error);
    }
    /* What the library has no answer for (outside --bounds) is dark, as in render. */
    for (size_t i = 0; fine && i < count; i++) vertices[i].seen = seen[i] > 0 ? seen[i] : 0;
    free(primitives);
    free(normals);
    free(seen);
    return fine;
}

static povray_vertex middle_of(const povray_vertex *a, const povray_vertex *b) {
    povray_vertex m = {.triangle = a->triangle};
    vector n = {0, 0, 0};
    for (int i = 0; i < 3; i++) m.position[i] = 0.5 * (a->position[i] + b->position[i]);
    n = vector_unit((vector){(double)a->normal[0] + b->normal[0],
                             (double)a->normal[1] + b->normal[1],
                             (double)a->normal[2] + b->normal[2]});
    m.normal[0] = (float)n.x, m.normal[1] = (float)n.y, m.normal[2] = (float)n.z;
    return m;
}

static bool make_room(front *r) {
    if (r->count < r->room) return true;
    const size_t room = r->room ? 2 * r->room : 4096;
    povray_vertex *middles = realloc(r->middles, room * sizeof *middles);
    if (middles) r->middles = middles;
    uint64_t *ends = realloc(r->ends, room * sizeof *ends);
    if (ends) r->ends = ends;
    if (!middles || !ends) return false;
    r->room = room;
    return true;
}

/* The middles of all edges of new triangles that were not there before. */
static bool gather(front *r) {
    const povray_surface *s = r->surface;
    r->count = 0;
    for (size_t t = r->active; t < s->triangle_count; t++)
        for (int c = 0; c < 3; c++) {
            const uint32_t a = s->corners[3 * t + (size_t)c],
                           b = s->corners[3 * t + (size_t)((c + 1) % 3)];
            if (2 * r->edges.count >= r->edges.room && !more_edges(&r->edges)) return false;
            edge *e = place_of(&r->edges, ends_of(a, b));
            if (e->ends) continue;
            *e = (edge){ends_of(a, b), PENDING};
            r->edges.count++;
            if (!make_room(r)) return false;
            r->ends[r->count] = e->ends;
            r->middles[r->count++] = middle_of(&s->vertices[a], &s->vertices[b]);
        }
    return true;
}

/* ---- Splitting ------------------------------------------------------------------------------*/

static bool is_split(const povray_vertex *a, const povray_vertex *b, const povray_vertex *middle,
                     const picture *p, bool by_length) {
    const double away =
        vector_length(vector_sub(vector_of(middle->position), p->centre)) / p->radius;
    const double length =
        vector_length(vector_sub(vector_of(a->position), vector_of(b->position))) /
        (p->radius * fmax(1, away / 2));
    if (by_length) return length > longest;
    return length > shortest && fabsf(middle->seen - 0.5f * (a->seen + b->seen)) > straight;
}

/* Vertices for the edges that are split; how many triangles that adds is at most twice that. */
static bool choose(front *r, bool by_length, size_t *room, size_t *split) {
    povray_surface *s = r->surface;
    *split = 0;
    for (size_t i = 0; i < r->count; i++) {
        const povray_vertex *a = &s->vertices[r->ends[i] >> 32],
                            *b = &s->vertices[(uint32_t)r->ends[i]];
        edge *e = place_of(&r->edges, r->ends[i]);
        e->middle = KEPT;
        if (*room < 2 || !is_split(a, b, &r->middles[i], r->picture, by_length)) continue;
        *room -= 2;
        if (s->vertex_count == s->vertex_room) {
            const size_t larger = 2 * s->vertex_room + 64;
            povray_vertex *vertices = realloc(s->vertices, larger * sizeof *vertices);
            if (!vertices) return false;
            s->vertices = vertices;
            s->vertex_room = larger;
        }
        e->middle = (uint32_t)s->vertex_count;
        s->vertices[s->vertex_count++] = r->middles[i];
        ++*split;
    }
    return true;
}

static size_t cut(const uint32_t corner[3], const uint32_t middle[3], uint32_t out[4][3]) {
    int marked = 0, first = 0;
    for (int i = 0; i < 3; i++) marked += middle[i] != KEPT;
    /* turned so that the split edges come first */
    while (marked == 1 && middle[first] == KEPT) first++;
    while (marked == 2 && (middle[first] == KEPT || middle[(first + 1) % 3] == KEPT)) first++;
    const uint32_t a = corner[first % 3], b = corner[(first + 1) % 3], c = corner[(first + 2) % 3];
    const uint32_t ab = middle[first % 3], bc = middle[(first + 1) % 3],
                   ca = middle[(first + 2) % 3];
    const uint32_t one[2][3] = {{a, ab, c}, {ab, b, c}};
    const uint32_t two[3][3] = {{ab, b, bc}, {a, ab, bc}, {a, bc, c}};
    const uint32_t three[4][3] = {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}};
    if (marked == 1) memcpy(out, one, sizeof one);
    if (marked == 2) memcpy(out, two, sizeof two);
    if (marked == 3) memcpy(out, three, sizeof three);
    return marked ? (size_t)marked + 1 : 0;
}

/* Triangles that are cut leave; what they are cut into comes to the end, the new active part. */
static bool split_all(front *r) {
    povray_surface *s = r->surface;
    const size_t end = s->triangle_count, most = 4 * (end - r->active);
    uint32_t *corners = realloc(s->corners, (end + most + 1) * 3 * sizeof *corners);
    uint32_t *fresh = malloc((most + 1) * 3 * sizeof *fresh);
    if (corners) s->corners = corners;
    size_t kept = r->active, made = 0;
    for (size_t t = r->active; corners && fresh && t < end; t++) {
        uint32_t corner[3], middle[3], pieces[4][3];
        memcpy(corner, corners + 3 * t, sizeof corner);
        for (int i = 0; i < 3; i++) {
            const uint32_t a = corner[i], b = corner[(i + 1) % 3];
            middle[i] = place_of(&r->edges, ends_of(a, b))->middle;
        }
        const size_t count = cut(corner, middle, pieces);
        if (!count) memcpy(corners + 3 * kept++, corner, sizeof corner);
        memcpy(fresh + 3 * made, pieces, count * sizeof *pieces);
        made += count;
    }
    if (corners && fresh) {
        memcpy(corners + 3 * kept, fresh, made * 3 * sizeof *fresh);
        r->active = kept;
        s->triangle_count = kept + made;
    }
    free(fresh);
    return corners && fresh;
}

static bool one_round(front *r, bool by_length, size_t *room, size_t *split, cli_error *error) {
    if (!gather(r)) return no_memory(error);
    if (!by_length && !ask(r, r->middles, r->count, error)) return false;
    return (choose(r, by_length, room, split) && split_all(r)) || no_memory(error);
}

static bool refine(front *r, size_t *room, cli_error *error) {
    povray_surface *s = r->surface;
    size_t split = 1;
    while (split)
        if (!one_round(r, true, room, &split, error)) return false;
    if (r->edges.room) memset(r->edges.places, 0, r->edges.room * sizeof *r->edges.places);
    r->edges.count = r->active = 0;
    if (!ask(r, s->vertices, s->vertex_count, error)) return false;
    for (int i = 0; i < ROUNDS; i++)
        if (!one_round(r, false, room, &split, error)) return false;
    return true;
}

bool povray_bake(povray_surface *surface, const picture *p, uint32_t number, cli_scene *scene,
                 size_t *room, cli_error *error) {
    front r = {.surface = surface, .picture = p, .scene = scene, .number = number};
    const bool fine = refine(&r, room, error);
    free(r.edges.places);
    free(r.middles);
    free(r.ends);
    return fine;
}
