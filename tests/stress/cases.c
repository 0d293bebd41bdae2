/* The sweeps. A truth is computed for the coordinates that the library is given; where a motion of
 * the whole scene would make the oracle itself lose digits, the scene at rest has the same
 * truth. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "stress/stress.h"

#define SIDE 10 /* points are a square of SIDE x SIDE */

typedef struct sweep {
    stress_each *each;
    void *user;
} sweep;

static stress_case start(const char *name, const char *cell) {
    stress_case one = {.count = SIDE * SIDE, .maps_too = true};
    snprintf(one.sweep, sizeof one.sweep, "%s", name);
    snprintf(one.cell, sizeof one.cell, "%s", cell);
    one.points = calloc(one.count, sizeof *one.points);
    one.truth = calloc(one.count, sizeof *one.truth);
    if (!one.points || !one.truth) abort();
    return one;
}

/* A box, a leaning quad and a triangle between the ground z = 0 and a lamp. */
static void base_mesh(scene_mesh *mesh) {
    const double low[3] = {-.6, -.5, .4}, high[3] = {.1, .3, .9};
    const double quad[4][3] = {{.2, -.7, .3}, {.9, -.6, .5}, {.8, .2, 1.1}, {.1, .1, .8}};
    scene_box(mesh, low, high);
    scene_quad(mesh, quad);
    const uint32_t a = scene_vertex(mesh, -.9, .5, .6), b = scene_vertex(mesh, .4, .4, 1.3);
    scene_triangle(mesh, a, b, scene_vertex(mesh, -.2, 1.1, .5));
}

static stress_case start_base(const char *name, const char *cell) {
    stress_case one = start(name, cell);
    base_mesh(&one.mesh);
    scene_grid(one.points, SIDE, -1.3, 1.3, -1.3, 1.3, 0);
    one.light = scene_sphere_light(.3, -.2, 4, .6);
    return one;
}

static void find_truth(stress_case *one) {
    for (size_t i = 0; i < one->count; i++) {
        one->truth[i] = oracle_union(&one->mesh, &one->light, one->points[i], NULL);
    }
}

static void finish(const sweep *s, stress_case *one) {
    s->each(one, s->user);
    scene_free(&one->mesh);
    free(one->points), free(one->truth), free(one->primitives);
}

static void finish_with_truth(const sweep *s, stress_case *one) {
    find_truth(one);
    finish(s, one);
}

/* A point light hides or is seen: its truth is that of a lamp so small that only points in the
 * plane of an edge see part of it. Those are either; they go. */
static void finish_hard(const sweep *s, stress_case *one) {
    const softshadow_light light = one->light;
    size_t kept = 0;
    one->light.radius = 1e-7;
    find_truth(one);
    one->light = light;
    for (size_t i = 0; i < one->count; i++) {
        if (one->truth[i] > 1e-9 && one->truth[i] < 1 - 1e-9) continue;
        memcpy(one->points[kept], one->points[i], sizeof one->points[i]);
        one->truth[kept++] = one->truth[i] > .5;
    }
    one->count = kept;
    finish(s, one);
}

/* ---- Motions of the whole scene ----------------------------------------------------------------- */

static void move_vector(const double m[12], const double in[3], double out[3], double w) {
    double moved[3];
    for (int r = 0; r < 3; r++) {
        moved[r] =
            m[4 * r] * in[0] + m[4 * r + 1] * in[1] + m[4 * r + 2] * in[2] + w * m[4 * r + 3];
    }
    memcpy(out, moved, sizeof moved);
}

/* scale: the length of m's columns. */
static void move_all(stress_case *one, const double m[12], double scale) {
    scene_transform(&one->mesh, m);
    for (size_t i = 0; i < one->count; i++) move_vector(m, one->points[i], one->points[i], 1);
    softshadow_light *light = &one->light;
    move_vector(m, light->position, light->position, 1);
    move_vector(m, light->direction, light->direction, 0);
    move_vector(m, light->u, light->u, 0), move_vector(m, light->v, light->v, 0);
    if (light->type != SOFTSHADOW_SUN) light->radius *= scale;
}

static void round_all(stress_case *one) {
    for (size_t i = 0; i < 3 * one->mesh.vertices; i++) one->mesh.xyz[i] = (float)one->mesh.xyz[i];
    for (size_t i = 0; i < 3 * one->count; i++) one->points[0][i] = (float)one->points[0][i];
    one->single = true;
}

static void scales(const sweep *s) {
    static const double scale[] = {1e-40, 1e-20, 1e-6, 1e-3, 1, 1e3, 1e6, 1e12};
    for (size_t i = 0; i < sizeof scale / sizeof *scale; i++) {
        char cell[32];
        snprintf(cell, sizeof cell, "%g", scale[i]);
        stress_case one = start_base("scale", cell);
        find_truth(&one);
        const double k = scale[i], m[12] = {k, 0, 0, 0, 0, k, 0, 0, 0, 0, k, 0};
        move_all(&one, m, k);
        one.in_modes = k == 1;
        finish(s, &one);
    }
}

/* Numbers below what floats, or doubles, have all digits of: there they are multiples of 2^-149, or
 * of 2^-1074, and the scene is made of few of them or of many. */
static void denormals(const sweep *s) {
    static const double unit[] = {0x1p-149, 0x1p-1074};
    static const char *const names[] = {"float, %g units", "double, %g units"};
    static const double units[] = {1e2, 1e4, 1e6};
    for (int single = 1; single >= 0; single--) {
        for (size_t i = 0; i < sizeof units / sizeof *units; i++) {
            char cell[32];
            snprintf(cell, sizeof cell, names[!single], units[i]);
            stress_case one = start_base("denormals", cell);
            const double k = units[i], m[12] = {k, 0, 0, 0, 0, k, 0, 0, 0, 0, k, 0};
            move_all(&one, m, k);
            for (size_t v = 0; v < 3 * one.mesh.vertices; v++)
                one.mesh.xyz[v] = rint(one.mesh.xyz[v]);
            for (size_t v = 0; v < 3 * one.count; v++) one.points[0][v] = rint(one.points[0][v]);
            for (int v = 0; v < 3; v++) one.light.position[v] = rint(one.light.position[v]);
            one.light.radius = rint(one.light.radius);
            one.in_modes = units[i] == 1e4;
            find_truth(&one); /* in whole units; now smaller by a power of two, which is exact */
            const double u = unit[!single], down[12] = {u, 0, 0, 0, 0, u, 0, 0, 0, 0, u, 0};
            move_all(&one, down, u);
            one.single = single, one.no_rays = !single;
            one.maps_too = false;
            finish(s, &one);
        }
    }
}

static void offsets(const sweep *s) {
    static const double by[] = {1e2, 1e3, 1e4, 1e5, 1e6, 1e7};
    for (size_t i = 0; i < sizeof by / sizeof *by; i++) {
        const double m[12] = {1, 0, 0, by[i], 0, 1, 0, -.7 * by[i], 0, 0, 1, .3 * by[i]};
        char cell[32];
        snprintf(cell, sizeof cell, "%g", by[i]);
        stress_case one = start_base("offset, double", cell);
        find_truth(&one);
        move_all(&one, m, 1);
        one.in_modes = by[i] == 1e6;
        finish(s, &one);
        /* From 1e6 on floats are a part of a caster apart: a larger scene then. */
        const double k = by[i] > 1e5 ? 1e3 : 1;
        const double scaled[12] = {k, 0, 0, m[3], 0, k, 0, m[7], 0, 0, k, m[11]};
        one = start_base("offset, float", k > 1 ? strcat(cell, ", 1000 wide") : cell);
        move_all(&one, scaled, k);
        round_all(&one);
        finish_with_truth(s, &one);
    }
}

static void rotations(const sweep *s) {
    uint64_t random = 5;
    for (int i = 0; i < 6; i++) {
        double r[9];
        char cell[32];
        snprintf(cell, sizeof cell, "%d", i);
        scene_rotation(&random, r);
        const double m[12] = {r[0], r[1], r[2], 0, r[3], r[4], r[5], 0, r[6], r[7], r[8], 0};
        stress_case one = start_base("rotation", cell);
        find_truth(&one);
        move_all(&one, m, 1);
        finish(s, &one);
    }
}

/* ---- Lights ---------------------------------------------------------------------------------------- */

static void radii(const sweep *s) {
    static const double radius[] = {0, 1e-12, 1e-6, 1e-3, .1, 1, 3, 10, 1e3};
    for (size_t i = 0; i < sizeof radius / sizeof *radius; i++) {
        char cell[32];
        snprintf(cell, sizeof cell, "%g", radius[i]);
        stress_case one = start_base("radius", cell);
        one.light.radius = radius[i];
        /* Large lamps hold the casters, or the points. */
        one.maps_too = radius[i] < 3;
        (radius[i] > 0 ? finish_with_truth : finish_hard)(s, &one);
        one = start_base("disk radius", cell);
        one.light = scene_disk_light(.3, -.2, 4, .1, .2, -1, radius[i]);
        one.maps_too = radius[i] < 3;
        (radius[i] > 0 ? finish_with_truth : finish_hard)(s, &one);
    }
}

static void distances(const sweep *s) {
    static const double far[] = {1.5, 1e1, 1e3, 1e5, 1e7, 1e9};
    for (size_t i = 0; i < sizeof far / sizeof *far; i++) {
        char cell[32];
        snprintf(cell, sizeof cell, "%g", far[i]);
        stress_case one = start_base("distance", cell);
        const double d = far[i];
        one.light = scene_sphere_light(.1 * d, -.05 * d, d, .15 * d);
        if (d > 1e3) { /* what is left of the parallax is below 1e-3: the sun's truth, but for it */
            one.light = scene_sun_light(-.1, .05, -1, asin(.15 / sqrt(1 + .01 + .0025)));
            find_truth(&one);
            one.light = scene_sphere_light(.1 * d, -.05 * d, d, .15 * d);
            if (d > 1e6) {
                finish(s, &one);
                continue;
            }
        }
        finish_with_truth(s, &one);
    }
}

static void suns(const sweep *s) {
    static const double degrees[] = {0, 1e-6, .01, .265, 5, 20, 45, 60};
    for (size_t i = 0; i < sizeof degrees / sizeof *degrees; i++) {
        char cell[32];
        snprintf(cell, sizeof cell, "%g deg", degrees[i]);
        stress_case one = start_base("sun", cell);
        one.light = scene_sun_light(-.2, .1, -1, degrees[i] * SCENE_PI / 180);
        /* The contract takes tiny angles for a point light, too. */
        (degrees[i] > 1e-5 ? finish_with_truth : finish_hard)(s, &one);
    }
}

/* A lamp the size of a grain just above the ground: most points see it level. */
static void grains(const sweep *s) {
    static const double height[] = {1e-1, 1e-2, 1e-3};
    for (size_t i = 0; i < sizeof height / sizeof *height; i++) {
        char cell[32];
        snprintf(cell, sizeof cell, "%g above ground", height[i]);
        stress_case one = start_base("distance", cell);
        one.light = scene_sphere_light(.05, -.03, height[i], height[i] / 2);
        one.maps_too = false;
        const double wall[4][3] = {{-.5, .2, 0}, {.4, .3, 0}, {.4, .3, 1e-3}, {-.5, .2, 1e-3}};
        scene_quad(&one.mesh, wall);
        finish_with_truth(s, &one);
    }
}

/* The box reaches from z = .4 to .9. */
static void touching(const sweep *s) {
    static const struct {
        const char *cell;
        double z, radius;
    } at[] = {{"inside a box", .65, .05}, {"touching a face", 1.0, .1}, {"piercing it", .9, .1},
              {"over a face", 1.0 + 1e-9, .1}, {"larger than it", .65, 2}};
    for (size_t i = 0; i < sizeof at / sizeof *at; i++) {
        stress_case one = start_base("sphere and mesh", at[i].cell);
        one.light = scene_sphere_light(-.25, -.1, at[i].z, at[i].radius);
        one.maps_too = false;
        finish_with_truth(s, &one);
    }
    static const double z[] = {.65, .9, .9 + 1e-12, 1};
    for (size_t i = 0; i < sizeof z / sizeof *z; i++) {
        char cell[32];
        snprintf(cell, sizeof cell, "z %.12g", z[i]);
        stress_case one = start_base("rect and mesh", cell);
        one.light = scene_rect_light(-.25, -.1, z[i], .2, .1);
        one.maps_too = false;
        finish_with_truth(s, &one);
    }
}

/* ---- Meshes ------------------------------------------------------------------------------------------- */

static void slivers(const sweep *s) {
    static const double width[] = {1e-2, 1e-4, 1e-6, 1e-8, 1e-12};
    for (size_t i = 0; i < sizeof width / sizeof *width; i++) {
        char cell[32];
        snprintf(cell, sizeof cell, "%g", width[i]);
        stress_case one = start_base("slivers", cell);
        for (int k = 0; k < 40; k++) {
            const double x = -1 + .05 * k, w = width[i];
            const double quad[4][3] = {
                {x, -2, .8}, {x + w, -2, .8}, {x + .4 + w, 2, .8}, {x + .4, 2, .8}};
            scene_quad(&one.mesh, quad);
        }
        one.in_modes = width[i] == 1e-8;
        finish_with_truth(s, &one);
    }
}

static void repeat(scene_mesh *mesh, size_t times, uint64_t seed) {
    scene_mesh once = scene_copy(mesh);
    for (size_t i = 1; i < times; i++) scene_append(mesh, &once);
    if (seed) scene_shuffle(mesh, seed);
    scene_free(&once);
}

static void soups(const sweep *s) {
    stress_case one = start_base("mesh", "every face 7 times");
    find_truth(&one);
    repeat(&one.mesh, 7, 0);
    finish(s, &one);
    one = start_base("mesh", "every face 1000 times");
    find_truth(&one);
    repeat(&one.mesh, 1000, 0);
    finish(s, &one);
    one = start_base("mesh", "shuffled and flipped");
    find_truth(&one);
    scene_shuffle(&one.mesh, 3);
    finish(s, &one);
    one = start_base("mesh", "twice, flipped");
    find_truth(&one);
    repeat(&one.mesh, 2, 9);
    finish(s, &one);
    one = start_base("mesh", "self-intersecting");
    const double a[3] = {0, 0, 1}, b[3] = {.35, .1, 1.2};
    scene_icosphere(&one.mesh, a, .4, 1, 0), scene_icosphere(&one.mesh, b, .4, 1, 0);
    finish_with_truth(s, &one);
    for (uint64_t seed = 0; seed < 8; seed++) {
        char cell[32];
        snprintf(cell, sizeof cell, "garbage %d", (int)seed);
        one = start("mesh", cell);
        scene_garbage(&one.mesh, seed);
        scene_grid(one.points, SIDE, -2, 2, -2, 2, 0);
        one.light = scene_sphere_light(.3, -.2, 8, 1.2);
        finish_with_truth(s, &one);
    }
}

/* Where layers are counted, a million of them may wrap a counter. */
static void coincident(const sweep *s) {
    stress_case one = start("coincident", "1e6 triangles");
    const uint32_t a = scene_vertex(&one.mesh, -1, -1, 1), b = scene_vertex(&one.mesh, 1, -1, 1),
                   c = scene_vertex(&one.mesh, 0, 1, 1);
    scene_grid(one.points, SIDE, -1.5, 1.5, -1.5, 1.5, 0);
    one.light = scene_sphere_light(0, 0, 3, .3);
    scene_triangle(&one.mesh, a, b, c);
    find_truth(&one);
    for (int i = 1; i < 1000000; i++) scene_triangle(&one.mesh, a, b, c);
    finish(s, &one);
}

/* Far more faces touch each of these points than a contact lists: none of them hides anything. */
static void on_coincident(const sweep *s) {
    stress_case one = start("on coincident", "1e6 triangles");
    const uint32_t a = scene_vertex(&one.mesh, -1, -1, 1), b = scene_vertex(&one.mesh, 1, -1, 1),
                   c = scene_vertex(&one.mesh, 0, 1, 1);
    for (int i = 0; i < 1000000; i++) scene_triangle(&one.mesh, a, b, c);
    one.count = 16; /* each of them looks at all faces */
    for (size_t i = 0; i < one.count; i++) {
        const double x = (double)(i % 4) / 8 - .1875, y = (double)(i / 4) / 4 - .75;
        const double at[4][3] = {{x, y, 1}, {x, -1, 1}, {-1, -1, 1}, {0, 1, 1}};
        memcpy(one.points[i], at[i % 5 < 2 ? 0 : i % 5 - 1], sizeof at[0]);
        one.truth[i] = 1;
    }
    one.light = scene_sphere_light(0, 0, 3, .3);
    one.no_maps = true;
    finish(s, &one);
}

/* ---- Points on and by casters -------------------------------------------------------------------------- */

static void stand_on(stress_case *one, uint64_t triangle, const double at[3], size_t i) {
    memcpy(one->points[i], at, 3 * sizeof *at);
    one->primitives[i] = triangle;
}

/* Points of every face of a scene: inside it, on its edges, at its vertices. All numbers are such
 * that a point on a face is there to the last bit, for the oracle too. */
static void on_faces_of(const sweep *s, const char *cell, bool primitives) {
    static const double weights[][3] = {
        {.25, .25, .5}, {.5, .5, 0}, {0, .25, .75}, {1, 0, 0}, {0, 0, 1}};
    const double low[3] = {-.5, -.5, .5}, high[3] = {0, .25, 1}, roof[3] = {.25, .25, 1.5},
                 eaves[3] = {-.75, -.75, 1.25};
    stress_case one = start("points on faces", cell);
    scene_box(&one.mesh, low, high), scene_box(&one.mesh, eaves, roof);
    one.light = scene_sphere_light(.25, -.25, 4, .5);
    one.primitives = calloc(one.count, sizeof *one.primitives);
    if (!one.primitives) abort();
    size_t n = 0;
    for (uint32_t t = 0; t < one.mesh.triangles && n + 5 <= one.count; t++) {
        const uint32_t *index = one.mesh.indices + 3 * (size_t)t;
        for (int w = 0; w < 5; w++) {
            double at[3] = {0, 0, 0};
            for (int v = 0; v < 3; v++) {
                for (int k = 0; k < 3; k++) at[k] += weights[w][v] * one.mesh.xyz[3 * index[v] + k];
            }
            stand_on(&one, t, at, n++);
        }
    }
    one.count = n;
    one.maps_too = false; /* bias and resolution decide there */
    if (!primitives) {
        free(one.primitives);
        one.primitives = NULL;
    }
    finish_with_truth(s, &one);
}

static void on_faces(const sweep *s) {
    on_faces_of(s, "with primitives", true), on_faces_of(s, "positions alone", false);
}

/* Points on slivers that lie askew, each on its own and in nobody's shadow but that of the base's
 * casters. Numbers of few bits: the points are on the slivers exactly. */
static void on_slivers(const sweep *s) {
    static const int bits[] = {8, 16, 20, 22, 24, 26, 30};
    for (size_t i = 0; i < 3 * sizeof bits / sizeof *bits; i++) {
        const double height = i % 3 == 0 ? 4 : i % 3 == 1 ? .2 : .01; /* of the lamp, above them */
        char cell[32];
        snprintf(cell, sizeof cell, "2^-%d, lamp %g above", bits[i / 3], height);
        stress_case one = start_base("points on slivers", cell);
        const double w = ldexp(1, -bits[i / 3]);
        one.primitives = calloc(one.count, sizeof *one.primitives);
        if (!one.primitives) abort();
        for (size_t k = 0; k < one.count; k++) { /* z = 2 + y/4 + x/2: above the base */
            const double x = -1 + (double)k / 64, y = -1 + (double)(k * 37 % 128) / 64;
            const uint32_t a = scene_vertex(&one.mesh, x, -2, 1.5 + x / 2),
                           b = scene_vertex(&one.mesh, x + w, -2, 1.5 + x / 2 + w / 2);
            const double at[3] = {x + w / 16, y, 2 + y / 4 + (x + w / 16) / 2};
            scene_triangle(&one.mesh, a, b, scene_vertex(&one.mesh, x, 2, 2.5 + x / 2));
            stand_on(&one, one.mesh.triangles - 1, at, k);
            one.truth[k] = 1; /* all slivers lie in one plane, the lamp above it */
        }
        one.light = scene_sphere_light(.5, 6, 3.75 + height, .3 * height);
        one.maps_too = false;
        finish(s, &one);
    }
}

/* A little above and below a plate that casts: below it is dark, above it is not. */
static void ulps_of(const sweep *s, bool single) {
    for (int n = -4; n <= 4; n++) {
        char cell[32];
        snprintf(cell, sizeof cell, "%+d ulp, %s", n, single ? "float" : "double");
        stress_case one = start("points by a face", cell);
        scene_rect(&one.mesh, -1, 1, -1, 1, .7f);
        scene_grid(one.points, SIDE, -.9, .9, -.9, .9, 0);
        double z = .7f;
        for (int k = 0; k < abs(n); k++) {
            z = single ? nextafterf((float)z, n > 0 ? 9 : -9) : nextafter(z, n > 0 ? 9 : -9);
        }
        for (size_t i = 0; i < one.count; i++) {
            one.points[i][2] = z;
            /* Within 4 ulp of the largest coordinate a face is touched: it hides nothing. */
            one.truth[i] = 1;
        }
        one.light = scene_sphere_light(.2, .1, 3, .5);
        if (single) round_all(&one);
        one.maps_too = false;
        finish(s, &one);
    }
}

static void ulps(const sweep *s) { ulps_of(s, false), ulps_of(s, true); }

/* Coplanar with the ground: hides nothing, whatever side the points are on. */
static void coplanar(const sweep *s) {
    stress_case one = start_base("coplanar", "caster in the ground");
    find_truth(&one);
    scene_rect(&one.mesh, -.5, .5, -.5, .5, 0);
    one.maps_too = false;
    finish(s, &one);
}

void stress_cases(stress_each *each, void *user) {
    const sweep s = {each, user};
    scales(&s), denormals(&s), offsets(&s), rotations(&s);
    radii(&s), distances(&s), grains(&s), suns(&s), touching(&s);
    slivers(&s), soups(&s), on_faces(&s), on_slivers(&s), ulps(&s), coplanar(&s);
    coincident(&s), on_coincident(&s);
}
