/* Scenes whose answer is a formula (design/accuracy.md, 1 to 8 and 11), with every method that
 * claims the truth. */
#include "property/truth.h"

/* ---- 1 and 2: straight edges ------------------------------------------------------------------*/

typedef struct half_plane {
    double edge[2][3], seen[3]; /* a world point just beyond the edge */
    scene_mesh mesh;
} half_plane;

/* The edge passes (0, 0, 2) at that turn about z and slope; the plate leaves it with a slope. */
static half_plane make_half_plane(double turn, double slope, double plate_slope) {
    half_plane out = {0};
    const double d[3] = {cos(turn), sin(turn), slope}, g[3] = {sin(turn), -cos(turn), plate_slope};
    double corner[4][3];
    for (int k = 0; k < 3; k++) {
        const double at = k == 2 ? 2 : 0;
        out.edge[0][k] = corner[0][k] = at - 60 * d[k];
        out.edge[1][k] = corner[1][k] = at + 60 * d[k];
        corner[2][k] = at + 60 * d[k] + 60 * g[k];
        corner[3][k] = at - 60 * d[k] + 60 * g[k];
        out.seen[k] = at - 1e-3 * g[k];
    }
    scene_quad(&out.mesh, (const double(*)[3])corner);
    return out;
}

enum { SIDE = 40, POINTS = SIDE * SIDE };

/* A disk of radius 0 that has half axes; u x v points down. */
static softshadow_light ellipse_light(void) {
    softshadow_light light = scene_disk_light(0.2, 0, 6, 0, 0, 0, 0);
    const double c = cos(0.6), s = sin(0.6);
    const double u[3] = {1.1 * c, 1.1 * s, 0.3}, down[3] = {0, 0, -1};
    light.v[0] = down[1] * u[2] - down[2] * u[1], light.v[1] = down[2] * u[0] - down[0] * u[2];
    for (int k = 0; k < 3; k++) light.u[k] = u[k], light.v[k] *= 0.3;
    return light;
}

static void straight_edges(void **state) {
    const softshadow_light lights[] = {
        scene_sphere_light(0.3, -0.2, 6, 0.8),
        scene_disk_light(0, 0, 6, 0.2, 0.1, -1, 0.9),
        scene_disk_light(0, 0, 6, 0, 0, 1, 0.9),
        scene_sun_light(-0.1, 0.2, -1, 0.15),
        ellipse_light(),
    };
    static const double plate[3][3] = {{0, 0, 0}, {0.7, 0.2, 0.1}, {2.0, -0.1, 0.3}};
    double(*points)[3] = malloc(POINTS * sizeof *points), truth[POINTS];
    scene_grid(points, SIDE, -1, 1, -1, 1, 0);
    for (size_t i = 0; i < COUNT(lights) * 3; i++) {
        const double *h = plate[i % 3];
        half_plane half = make_half_plane(h[0], h[1], h[2]);
        const softshadow_light *light = &lights[i / 3];
        for (size_t k = 0; k < POINTS; k++) {
            const oracle_view view = oracle_see(light, points[k]);
            truth[k] = oracle_edge_before(&view, points[k], half.edge[0], half.edge[1], half.seen);
        }
        ask q = ask_new(*state, &half.mesh, *light, (const double(*)[3])points, POINTS,
                        truth_samples(*state));
        truth_judge(&q, truth, "straight edge", 0);
        scene_free(&half.mesh);
    }
    free(points);
}

static void limb_darkened_edge(void **state) {
    enum { ENTRIES = 1025 };
    static float profile[ENTRIES];
    const double u1 = 0.4, u2 = 0.3;
    for (int i = 0; i < ENTRIES; i++) profile[i] = (float)oracle_limb(i / (ENTRIES - 1.0), u1, u2);
    softshadow_light light = scene_disk_light(0, 0, 6, 0, 0, -1, 0.9);
    light.profile = profile, light.profile_count = ENTRIES;
    double points[101][3], truth[101];
    scene_mesh mesh = {0};
    scene_rect(&mesh, 0, 60, -60, 60, 2); /* seen from x: the edge lies at -2 x */
    for (int i = 0; i < 101; i++) {
        points[i][0] = (i - 50) / 100.0, points[i][1] = 0.3, points[i][2] = 0;
        truth[i] = oracle_limb_edge(-2 * points[i][0] / 0.9, u1, u2);
    }
    ask q = ask_new(*state, &mesh, light, (const double(*)[3])points, 101, truth_samples(*state));
    /* The table's straight pieces leave out the root at the limb: below .001 of the last ring. */
    truth_judge(&q, truth, "limb-darkened edge", 1e-4);
    scene_free(&mesh);
}

/* ---- 3: disks and caps ------------------------------------------------------------------------*/

static void disk_behind_disk(void **state) {
    enum { EDGES = 720 };
    double(*points)[3] = malloc(POINTS * sizeof *points), truth[POINTS];
    scene_grid(points, SIDE, -2.5, 2.5, -2.5, 2.5, 0);
    for (int i = 0; i < 3; i++) {
        const double radius = i == 0 ? 0.3 : i == 1 ? 0.5 : 0.8; /* seen twice as large */
        scene_mesh mesh = {0};
        scene_disk(&mesh, 0, 0, 4, radius, EDGES);
        for (size_t k = 0; k < POINTS; k++) {
            truth[k] = oracle_disks(1, 2 * radius, hypot(points[k][0], points[k][1]));
        }
        ask q = ask_new(*state, &mesh, scene_disk_light(0, 0, 8, 0, 0, -1, 1),
                        (const double(*)[3])points, POINTS, truth_samples(*state));
        /* The polygon lacks (2 pi / n)^2 / 6 of its disk's area. */
        truth_judge(&q, truth, "disk behind disk", 4 * radius * radius * 1.3e-5);
        scene_free(&mesh);
    }
    free(points);
}

/* Weighted by solid angle, sphere behind sphere is two caps at any size. */
static void sphere_behind_sphere(void **state) {
    const double R = 2, r = 0.6, light_at[3] = {0.5, 0, 9}, ball_at[3] = {0, 0, 3};
    scene_mesh mesh = {0};
    scene_icosphere(&mesh, ball_at, r, 5, 0);
    double(*points)[3] = malloc(POINTS * sizeof *points), truth[POINTS];
    scene_grid(points, SIDE, -2, 2, -2, 2, 0);
    for (size_t i = 0; i < POINTS; i++) {
        double dot = 0, d2 = 0, h2 = 0;
        for (int k = 0; k < 3; k++) {
            const double a = light_at[k] - points[i][k], b = ball_at[k] - points[i][k];
            dot += a * b, d2 += a * a, h2 += b * b;
        }
        truth[i] = oracle_caps(asin(R / sqrt(d2)), asin(r / sqrt(h2)), acos(dot / sqrt(d2 * h2)));
    }
    ask q = ask_new(*state, &mesh, scene_sphere_light(0.5, 0, 9, R), (const double(*)[3])points,
                    POINTS, truth_samples(*state));
    q.build.weighting = SOFTSHADOW_SOLID_ANGLE;
    /* 20480 facets: their outline lies up to 1 - cos(.02) = 2e-4 inside the sphere's. */
    truth_judge(&q, truth, "sphere behind sphere", 3e-4);
    scene_free(&mesh);
    free(points);
}

/* ---- 4 and 11: polygons -----------------------------------------------------------------------*/

static void rectangle_behind_rectangle(void **state) {
    const softshadow_light light = scene_rect_light(0.1, 0.2, 9, 3, 2);
    scene_mesh mesh = {0};
    scene_rect(&mesh, -1.1, 0.7, -0.4, 0.6, 3);
    double(*points)[3] = malloc(POINTS * sizeof *points), truth[POINTS];
    scene_grid(points, SIDE, -3, 3, -2.5, 2.5, 0);
    for (size_t i = 0; i < POINTS; i++) {
        const double x = points[i][0], y = points[i][1];
        truth[i] =
            1 - oracle_overlap((x + 3 * (-1.1 - x) - 0.1) / 3, (x + 3 * (0.7 - x) - 0.1) / 3) *
                    oracle_overlap((y + 3 * (-0.4 - y) - 0.2) / 2, (y + 3 * (0.6 - y) - 0.2) / 2);
    }
    ask q =
        ask_new(*state, &mesh, light, (const double(*)[3])points, POINTS, truth_samples(*state));
    truth_judge(&q, truth, "rectangle behind rectangle", 0);
    scene_free(&mesh);
    free(points);
}

/* What is seen of a rectangle beyond a straight edge is a rectangle: irradiance has a formula. */
static void irradiance_of_a_polygon(void **state) {
    const softshadow_light light = scene_rect_light(1, 0, 3, 2, 1);
    scene_mesh mesh = {0};
    scene_rect(&mesh, 0.5, 60, -60, 60, 1.5);
    double points[400][3], truth[400];
    float normals[400][3];
    scene_grid(points, 20, -1.5, 1.8, -1, 1, 0);
    for (size_t i = 0; i < 400; i++) {
        const double n[3] = {0.3, i % 3 ? -0.2 : 0.1, 0.9}, x = points[i][0], y = points[i][1];
        const double end = fmin(3, fmax(-1, x + 2 * (0.5 - x))); /* where the edge is seen */
        const double whole[4][3] = {
            {-1 - x, -1 - y, 3}, {3 - x, -1 - y, 3}, {3 - x, 1 - y, 3}, {-1 - x, 1 - y, 3}};
        const double seen[4][3] = {
            {-1 - x, -1 - y, 3}, {end - x, -1 - y, 3}, {end - x, 1 - y, 3}, {-1 - x, 1 - y, 3}};
        truth[i] = oracle_polygon_irradiance(seen, 4, n) / oracle_polygon_irradiance(whole, 4, n);
        for (int k = 0; k < 3; k++) normals[i][k] = (float)n[k];
    }
    ask q = ask_new(*state, &mesh, light, (const double(*)[3])points, 400, truth_samples(*state));
    q.build.weighting = SOFTSHADOW_IRRADIANCE;
    q.normals = (const float(*)[3])normals;
    truth_judge(&q, truth, "irradiance of a polygon", 0);
    scene_free(&mesh);
}

/* ---- 5: the fusion triad ----------------------------------------------------------------------*/

/* Seen from the origin under the square light |x|, |y| <= 1 at z = 8: hides s < where (sign -1) or
 * s > where (+1) along that axis. */
static void add_half(scene_mesh *mesh, double where, int sign, int axis, double height) {
    const double edge = where * height / 8, end = 20.0 * sign;
    const double a = fmin(edge, end), b = fmax(edge, end);
    if (axis == 0)
        scene_rect(mesh, a, b, -20, 20, height);
    else
        scene_rect(mesh, -20, 20, a, b, height);
}

static void fusion_triad(void **state) {
    const double point[1][3] = {{0, 0, 0}};
    enum { COINCIDENT, COMPLEMENTARY, ORTHOGONAL, KINDS };
    for (int i = 0; i < 7 * KINDS; i++) {
        const double s = -0.75 + 0.25 * (i / KINDS), visible = (1 - s) / 2;
        scene_mesh mesh = {0};
        add_half(&mesh, s, -1, 0, 2);
        double truth[1] = {visible};
        if (i % KINDS == COINCIDENT) add_half(&mesh, s, -1, 0, 4);
        if (i % KINDS == COMPLEMENTARY) add_half(&mesh, s, 1, 0, 4), truth[0] = 0;
        if (i % KINDS == ORTHOGONAL) add_half(&mesh, s, -1, 1, 4), truth[0] = visible * visible;
        ask q = ask_new(*state, &mesh, scene_rect_light(0, 0, 8, 1, 1), point, 1,
                        truth_samples(*state));
        ask_do(&q);
        /* One point and no statistics: its own bound, or three times the tolerance. */
        const double most = ask_noise_free(*state) ? 1.0 / 64 : 3.0 / 256;
        CHECK(fabs(q.visibility[0] - truth[0]) <= most, "kind %d, s = %g: %g, truth %g", i % KINDS,
              s, q.visibility[0], truth[0]);
        CHECK(!ask_certified(*state) || fabs(q.visibility[0] - truth[0]) <= q.bound[0] + 1e-6,
              "kind %d, s = %g: %g +- %g, truth %g", i % KINDS, s, q.visibility[0], q.bound[0],
              truth[0]);
        ask_free(&q);
        scene_free(&mesh);
    }
}

/* ---- 6: periodic screens ----------------------------------------------------------------------*/

static void judge_constant(const char *method, const scene_mesh *mesh, double v, const char *what) {
    double(*points)[3] = malloc(POINTS * sizeof *points), truth[POINTS];
    scene_grid(points, SIDE, -1.2, 1.3, -1.1, 1.2, 0);
    for (size_t i = 0; i < POINTS; i++) truth[i] = v;
    ask q = ask_new(method, mesh, scene_rect_light(0, 0, 8, 2, 2), (const double(*)[3])points,
                    POINTS, truth_samples(method));
    truth_judge(&q, truth, what, 0);
    free(points);
}

/* The light's side, 4, is seen as 2 on the screen halfway: whole periods of 1 and of 1/2. */
static void screens(void **state) {
    scene_mesh slats = {0}, fine = {0}, lattice = {0}, filters = {0};
    scene_slats(&slats, -5, 1, 0.375, 10, 5, 4);
    judge_constant(*state, &slats, 1 - 0.375, "slats");
    scene_slats(&fine, -5, 0.5, 0.125, 20, 5, 4);
    judge_constant(*state, &fine, 0.75, "fine slats");
    scene_lattice(&lattice, -5, 1, 0.75, 10, 4);
    judge_constant(*state, &lattice, 0.75 * 0.75, "square holes");
    scene_slats(&filters, -5, 1, 0.5, 10, 5, 4);
    scene_mesh turned = scene_copy(&filters); /* two filters of one half, across each other */
    /* At z = 2 the light's side is seen as 1, one period. */
    scene_transform(&turned, (const double[12]){0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0.5, 0});
    scene_append(&filters, &turned);
    judge_constant(*state, &filters, 0.25, "two filters of one half");
    scene_free(&slats), scene_free(&fine), scene_free(&lattice), scene_free(&filters);
    scene_free(&turned);
}

/* ---- 7: contact -------------------------------------------------------------------------------*/

/* The wall's foot is under the light's centre. As d falls the wall hides half, on both sides. */
static void contact_with_a_wall(void **state) {
    enum { STEPS = 9, N = 2 * STEPS };
    double points[N][3], truth[N];
    float normals[N][3];
    uint64_t primitives[N];
    scene_mesh mesh = {0};
    scene_wall(&mesh, 40, 4);
    for (int i = 0; i < N; i++) {
        const double d = pow(10, -1 - i / 2) * (i % 2 ? 1 : -1);
        points[i][0] = d, points[i][1] = 0.25, points[i][2] = 0;
        /* The wall's top, z = 4, is seen at d (1 - 8/4) in the plane of the light, z = 8. */
        truth[i] = oracle_edge(fabs(d) / 1.5);
        normals[i][0] = normals[i][1] = 0, normals[i][2] = 1;
        primitives[i] = SOFTSHADOW_NO_PRIMITIVE;
    }
    const softshadow_light light = scene_disk_light(0, 0, 8, 0, 0, -1, 1.5);
    for (int i = 0; i < 3;
         i++) { /* nothing known; normals; on a ground that casts, triangle known */
        ask q = ask_new(*state, &mesh, light, (const double(*)[3])points, N, truth_samples(*state));
        if (i > 0) q.normals = (const float(*)[3])normals;
        if (i == 2) {
            scene_rect(&mesh, -40, 40, -40, 40, 0); /* its triangles are 2 and 3 */
            for (int k = 0; k < N; k++) primitives[k] = points[k][1] <= points[k][0] ? 2 : 3;
            q.primitives = primitives;
        }
        truth_judge(&q, truth, "contact", 0);
    }
    scene_free(&mesh);
}

/* ---- 8: what adaptive samplers miss -----------------------------------------------------------*/

static void small_blocker_and_keyhole(void **state) {
    enum { EDGES = 256 };
    const softshadow_light light = scene_rect_light(0, 0, 8, 1, 1);
    /* Seen from the origin the disk at z = 4 has radius 0.8, .4 widths of the light. */
    const double share = scene_polygon_area(0.8, EDGES) / 4;
    double points[400][3], truth[400];
    scene_grid(points, 20, -0.19, 0.19, -0.19, 0.19, 0); /* it stays inside the light's outline */
    for (int dual = 0; dual < 2; dual++) {
        scene_mesh mesh = {0};
        if (dual)
            scene_holed_square(&mesh, 9, 4, 0.4, EDGES);
        else
            scene_disk(&mesh, 0, 0, 4, 0.4, EDGES);
        for (int i = 0; i < 400; i++) truth[i] = dual ? share : 1 - share;
        ask q =
            ask_new(*state, &mesh, light, (const double(*)[3])points, 400, truth_samples(*state));
        truth_judge(&q, truth, dual ? "keyhole" : "small blocker", 0);
        scene_free(&mesh);
    }
}

/* Slivers of 1e-6, before the light and beside it, alone and in a fan. */
static void slivers(void **state) {
    scene_mesh mesh = {0};
    for (int i = 0; i < 20; i++) {
        const double x = -0.5 + 0.05 * i;
        const uint32_t a = scene_vertex(&mesh, x, -3, 3), b = scene_vertex(&mesh, x + 1e-6, -3, 3);
        scene_triangle(&mesh, a, b, scene_vertex(&mesh, x + 0.01, 3, 3.5));
    }
    double points[100][3], truth[100];
    const softshadow_light light = scene_disk_light(0, 0, 8, 0, 0, -1, 1);
    scene_grid(points, 10, -1, 1, -1, 1, 0);
    for (int i = 0; i < 100; i++) truth[i] = oracle_union(&mesh, &light, points[i], NULL);
    ask q = ask_new(*state, &mesh, light, (const double(*)[3])points, 100, truth_samples(*state));
    truth_judge(&q, truth, "slivers", 0);
    scene_free(&mesh);
}

int main(void) {
    const ask_test tests[] = {
        {"1 straight edges", straight_edges, ask_truthful},
        {"2 limb-darkened edge", limb_darkened_edge, ask_truthful},
        {"3 disk behind disk", disk_behind_disk, ask_truthful},
        {"3 sphere behind sphere by solid angle", sphere_behind_sphere, ask_truthful},
        {"4 rectangle behind rectangle", rectangle_behind_rectangle, ask_truthful},
        {"5 fusion triad", fusion_triad, ask_truthful},
        {"6 screens", screens, ask_truthful},
        {"7 contact with a wall", contact_with_a_wall, ask_truthful},
        {"8 small blocker and keyhole", small_blocker_and_keyhole, ask_truthful},
        {"8 slivers", slivers, ask_truthful},
        {"11 irradiance of a polygon", irradiance_of_a_polygon, ask_truthful},
    };
    return ask_run("closed forms", tests, COUNT(tests));
}
