/* Closed meshes do not leak: from points within to lamps without every sample is hidden, whatever
 * it passes. Each point lies behind a vertex or a spot of an edge, on the line from the lamp's
 * centre: of a lamp of no size that is the one sample there is. On the lattice nothing is rounded:
 * points, vertices and lamps are whole numbers of eighths, so vertices and edges are met exactly.
 *
 * based on: the tests of watertight intersection of pbrt and Embree (rays at vertices; far from the
 * origin, at 148376, 1234, -223423).
 *
 * leaks [POINTS [SEED]]: that many with each method. */
#include <inttypes.h>

#include "ask.h"

enum { BATCH = 1 << 12, LAMPS = 3 };

/* A closed convex mesh, and the ball in which points are sure to be inside. */
typedef struct shell {
    const char *name;
    scene_mesh mesh;
    double centre[3], inside;
    bool lattice;
} shell;

static const double far_away[3] = {148376, 1234, -223423};

static shell ball(const char *name, const double centre[3], unsigned levels) {
    shell s = {.name = name, .inside = .9};
    memcpy(s.centre, centre, sizeof s.centre);
    scene_icosphere(&s.mesh, centre, 1, levels, 0);
    return s;
}

/* A cube of half side 8 whose faces are cut at every whole number, each vertex used by all that
 * meet. */
static shell lattice(const char *name, const double centre[3]) {
    enum { HALF = 8, SIDE = 2 * HALF + 1 };
    shell s = {.name = name, .inside = HALF - .5, .lattice = true};
    memcpy(s.centre, centre, sizeof s.centre);
    static uint32_t number[6][SIDE][SIDE];
    for (int face = 0; face < 6; face++) {
        const int axis = face / 2, a = (axis + 1) % 3, b = (axis + 2) % 3;
        for (int i = 0; i < SIDE; i++) {
            for (int k = 0; k < SIDE; k++) {
                double at[3];
                at[axis] = centre[axis] + (face % 2 ? HALF : -HALF);
                at[a] = centre[a] + i - HALF, at[b] = centre[b] + k - HALF;
                number[face][i][k] = scene_vertex(&s.mesh, at[0], at[1], at[2]);
            }
        }
        for (int i = 0; i + 1 < SIDE; i++) {
            for (int k = 0; k + 1 < SIDE; k++) {
                uint32_t (*n)[SIDE] = number[face] + i;
                scene_triangle(&s.mesh, n[0][k], n[1][k], n[1][k + 1]);
                scene_triangle(&s.mesh, n[0][k], n[1][k + 1], n[0][k + 1]);
            }
        }
    }
    return s;
}

/* ---- Points -------------------------------------------------------------------------------------- */

static void corner(const shell *s, uint64_t t, int which, double at[3]) {
    memcpy(at, s->mesh.xyz + 3 * s->mesh.indices[3 * t + which % 3], 3 * sizeof *at);
}

/* What is aimed at: a vertex, or a spot of an edge: on a lattice one that floats know. */
static void aim(const shell *s, bool at_edges, uint64_t *random, double at[3]) {
    const uint64_t t = scene_random(random) % s->mesh.triangles;
    const int which = (int)(scene_random(random) % 3);
    double end[3];
    corner(s, t, which, at);
    if (!at_edges) return;
    corner(s, t, which + 1, end);
    double along = scene_uniform(random, 0, 1);
    if (s->lattice) along = rint(4 * along) / 4;
    for (int k = 0; k < 3; k++) at[k] += along * (end[k] - at[k]);
}

static bool is_inside(const shell *s, const double p[3]) {
    double square = 0, most = 0;
    for (int k = 0; k < 3; k++) {
        const double d = fabs(p[k] - s->centre[k]);
        square += d * d;
        if (d > most) most = d;
    }
    return s->lattice ? most <= s->inside : square <= s->inside * s->inside;
}

/* Behind a vertex or an edge as seen from the lamp, and inside. */
static void hidden_points(const shell *s, const double lamp[3], bool at_edges, uint64_t *random,
                          double (*points)[3]) {
    for (size_t i = 0; i < BATCH;) {
        double at[3];
        aim(s, at_edges, random, at);
        /* Powers of two lose nothing on the lattice. */
        const double behind =
            s->lattice ? ldexp(1, -(int)(scene_random(random) % 4)) : scene_uniform(random, .05, .7);
        for (int k = 0; k < 3; k++) points[i][k] = at[k] + behind * (at[k] - lamp[k]);
        i += is_inside(s, points[i]);
    }
}

static softshadow_light lamp_at(const shell *s, int which, double radius) {
    static const double round[LAMPS][3] = {{0, 0, 3}, {1.3, -2.1, .4}, {-1.5, .2, -1.1}},
                        whole[LAMPS][3] = {{0, 0, 16}, {12, -4, 8}, {-9, -9, -9}};
    const double *at = s->lattice ? whole[which] : round[which];
    const double size = s->lattice ? 4 * radius : radius;
    return scene_sphere_light(s->centre[0] + at[0], s->centre[1] + at[1], s->centre[2] + at[2], size);
}

/* ---- Asking -------------------------------------------------------------------------------------- */

typedef struct tally {
    uint64_t points, rays, leaks;
} tally;

/* One shell, one lamp, one method: every point is dark. */
static void ask_hidden(const shell *s, const char *method, softshadow_light light, bool at_edges,
                       uint64_t *random, tally *sum) {
    static double points[BATCH][3];
    hidden_points(s, light.position, at_edges, random, points);
    ask q = ask_new(method, &s->mesh, light, (const double(*)[3])points, BATCH, 64);
    q.unbounded = true;
    ask_do(&q);
    size_t leaks = 0;
    for (size_t i = 0; i < BATCH; i++) {
        if (q.visibility[i] == 0) continue;
        if (leaks++ || sum->leaks > 9) continue;
        print_error("%s, %s: %.17g %.17g %.17g sees %g of the lamp of radius %g at %.17g %.17g "
                    "%.17g\n", s->name, method, points[i][0], points[i][1], points[i][2],
                    (double)q.visibility[i], light.radius, light.position[0], light.position[1],
                    light.position[2]);
    }
    sum->points += BATCH, sum->rays += q.stats.rays, sum->leaks += leaks;
    ask_free(&q);
}

static uint64_t points_wanted = 100000, seed = 1;

/* Vertices and edges of every shell from every lamp, three quarters of them without size. */
static void nothing_leaks(void **state) {
    const double origin[3] = {0, 0, 0}, near[3] = {1000.5, -20.25, 3};
    shell shells[] = {ball("ball", origin, 3),         ball("coarse ball", near, 1),
                      ball("far ball", far_away, 4),   lattice("lattice", origin),
                      lattice("far lattice", far_away)};
    uint64_t random = seed;
    tally sum = {0};
    for (uint64_t round = 0; sum.points < points_wanted; round++) {
        const shell *s = &shells[round % COUNT(shells)];
        const int lamp = (int)(round / COUNT(shells) % LAMPS);
        const double radius = round / 2 % 4 == 3 ? .25 : 0;
        ask_hidden(s, *state, lamp_at(s, lamp, radius), round % 2, &random, &sum);
    }
    for (size_t i = 0; i < COUNT(shells); i++) scene_free(&shells[i].mesh);
    print_message("%s: %" PRIu64 " points, %" PRIu64 " rays, %" PRIu64 " leaks\n",
                  (const char *)*state, sum.points, sum.rays, sum.leaks);
    CHECK(sum.leaks == 0, "%" PRIu64 " of %" PRIu64 " points see a lamp through a closed mesh",
          sum.leaks, sum.points);
}

int main(int argc, char **argv) {
    if (argc > 1) points_wanted = strtoull(argv[1], NULL, 10);
    if (argc > 2) seed = strtoull(argv[2], NULL, 10);
    const ask_test tests[] = {{"nothing leaks", nothing_leaks, ask_truthful}};
    return ask_run("leaks", tests, COUNT(tests));
}
