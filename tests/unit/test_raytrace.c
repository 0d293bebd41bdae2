/* Ray tracing against closed forms, within its own error bound; contact and acne at any scale. */
#include "trace_scene.h"

#define PI 3.14159265358979323846

static void ask(const stand *s, const softshadow_light *given, uint32_t samples, uint32_t weighting,
                const ss_point *points, size_t n, float *visibility, float *bound) {
    ss_light light;
    ss_world_light(s->world, given, &light);
    const ss_params params = {.samples = samples, .tolerance = 1.0 / 256, .weighting = weighting};
    const ss_stage stage = make_stage(s, &light, &params);
    void *state;
    ss_counts counts = {0};
    ss_arena arena = {0};
    assert_int_equal(ss_raytrace.build(&stage, &state), SOFTSHADOW_OK);
    assert_int_equal(
        ss_raytrace.query(&stage, state, points, n, visibility, bound, &arena, &counts),
        SOFTSHADOW_OK);
    assert_int_equal(counts.lit + counts.umbra + counts.penumbra, n);
    ss_raytrace.destroy(state);
    ss_arena_free(&arena);
}

static softshadow_light light_at(uint32_t type, double x, double y, double z, double radius) {
    softshadow_light light = SOFTSHADOW_LIGHT_INIT;
    light.type = type, light.radius = radius;
    light.position[0] = x, light.position[1] = y, light.position[2] = z;
    light.direction[2] = -1;
    light.u[0] = radius, light.v[1] = radius;
    return light;
}

/* Errors of a batch against the truth; the bound is meant for 999 points in 1000. */
typedef struct score {
    size_t points, outside;
    double squares, worst;
} score;

static void mark(score *sum, double truth, float visibility, float bound) {
    const double error = fabs(visibility - truth);
    sum->points++, sum->outside += error > bound + 1e-6; /* rounding of the answer to float */
    sum->squares += error * error, sum->worst = fmax(sum->worst, error);
}

static void check(const char *name, const score *sum, double rms) {
    const double got = sqrt(sum->squares / (double)sum->points);
    print_message("%s: %zu points, rms %.5f, worst %.4f, %zu outside their bound\n", name,
                  sum->points, got, sum->worst, sum->outside);
    assert_true(got <= rms);
    assert_true((double)sum->outside <= 0.001 * (double)sum->points);
}

/* Closed form 1: a half plane at height 1 below a disk light at height 3, seen from the ground. */
static void a_straight_edge_before_a_disk(void **unused) {
    (void)unused;
    enum { N = 4000 };
    stand s = {0};
    const double corner[3] = {0, -50, 1}, a[3] = {50, 0, 0}, b[3] = {0, 100, 0};
    add_quad(&s, corner, a, b);
    raise_stand(&s, NULL);
    const double radius = 0.5;
    const softshadow_light light = light_at(SOFTSHADOW_DISK, 0.1, 0.2, 3, radius);
    static ss_point points[N];
    static float visibility[N], bound[N];
    double truth[N];
    uint64_t state = 1;
    for (int i = 0; i < N; i++) {
        const double x = 0.9 * chance(&state) - 0.4, host[3] = {x, chance(&state), 0};
        /* The edge x = 0 at height 1 is seen at height 3 at x - 3 x = -2 x; hidden beyond it. */
        const double t = fmin(fmax((-2 * x - 0.1) / radius, -1), 1);
        truth[i] = 0.5 + (t * sqrt(1 - t * t) + asin(t)) / PI;
        points[i] = make_point(&s, host, false);
    }
    const uint32_t counts[] = {16, 64, 256, 1000};
    for (int c = 0; c < 4; c++) {
        score sum = {0};
        ask(&s, &light, counts[c], SOFTSHADOW_UNIFORM, points, N, visibility, bound);
        for (int i = 0; i < N; i++) mark(&sum, truth[i], visibility[i], bound[i]);
        /* the spiral's error on edges, test_samples.c: .33 N^-.78 over the penumbra */
        check("edge before disk", &sum, 0.40 * pow(counts[c], -0.78));
    }
    fold_stand(&s);
}

static double overlap(double a, double b, double c, double d) {
    return fmax(0, fmin(b, d) - fmax(a, c));
}

/* Closed form 4: a rectangle before a parallel rectangle. */
static void a_rectangle_before_a_rectangle(void **unused) {
    (void)unused;
    enum { N = 4000 };
    stand s = {0};
    const double corner[3] = {-0.2, -0.3, 1}, a[3] = {0.4, 0, 0}, b[3] = {0, 0.5, 0};
    add_quad(&s, corner, a, b);
    raise_stand(&s, NULL);
    softshadow_light light = light_at(SOFTSHADOW_RECT, 0, 0, 2, 0.5);
    light.direction[2] = 0;
    static ss_point points[N];
    static float visibility[N], bound[N];
    double truth[N];
    uint64_t state = 2;
    for (int i = 0; i < N; i++) {
        const double host[3] = {1.6 * chance(&state) - 0.8, 1.6 * chance(&state) - 0.8, 0};
        /* Points of height 1 are seen at height 2 twice as far from the point. */
        const double x = host[0], y = host[1];
        const double w = overlap(x + 2 * (-0.2 - x), x + 2 * (0.2 - x), -0.5, 0.5);
        const double h = overlap(y + 2 * (-0.3 - y), y + 2 * (0.2 - y), -0.5, 0.5);
        truth[i] = 1 - w * h;
        points[i] = make_point(&s, host, false);
    }
    score sum = {0};
    ask(&s, &light, 256, SOFTSHADOW_UNIFORM, points, N, visibility, bound);
    for (int i = 0; i < N; i++) mark(&sum, truth[i], visibility[i], bound[i]);
    check("rectangle before rectangle", &sum, 0.006); /* random samples: .02 */
    fold_stand(&s);
}

static double lens(double a, double b, double c) {
    if (c >= a + b) return 1;
    if (c <= fabs(a - b)) return a <= b ? 0 : 1 - b * b / (a * a);
    const double x = (c * c + a * a - b * b) / (2 * c), y = sqrt(a * a - x * x);
    const double area = a * a * acos(x / a) + b * b * acos((c - x) / b) - c * y;
    return 1 - area / (PI * a * a);
}

/* Closed form 3: a disk of 720 sides behind which a disk hides; the bound must hold. */
static void a_disk_before_a_disk(void **unused) {
    (void)unused;
    enum { N = 10000, SIDES = 720 };
    double at[SIDES + 1][3] = {{0, 0, 1}};
    uint32_t indices[SIDES][3];
    /* the polygon of the same area as a circle of radius .3 */
    const double radius = 0.3, r = radius * sqrt(2 * PI / (SIDES * sin(2 * PI / SIDES)));
    for (uint32_t i = 0; i < SIDES; i++) {
        at[1 + i][0] = r * cos(2 * PI * i / SIDES), at[1 + i][1] = r * sin(2 * PI * i / SIDES);
        at[1 + i][2] = 1;
        indices[i][0] = 0, indices[i][1] = 1 + i, indices[i][2] = 1 + (i + 1) % SIDES;
    }
    stand s = {0};
    add_mesh(&s, SOFTSHADOW_F64, at, SIDES + 1, &indices[0][0], SIDES);
    raise_stand(&s, NULL);
    const softshadow_light light = light_at(SOFTSHADOW_DISK, 0, 0, 2, 0.5);
    static ss_point points[N];
    static float visibility[N], bound[N];
    static double truth[N];
    uint64_t state = 3;
    for (int i = 0; i < N; i++) {
        const double host[3] = {1.3 * chance(&state), 1.3 * (chance(&state) - 0.5), 0};
        truth[i] = lens(0.5, 2 * radius, hypot(host[0], host[1])); /* centre: p + 2 (0 - p) = -p */
        points[i] = make_point(&s, host, false);
    }
    const uint32_t counts[] = {16, 61, 256};
    for (int c = 0; c < 3; c++) {
        score sum = {0};
        ask(&s, &light, counts[c], SOFTSHADOW_UNIFORM, points, N, visibility, bound);
        for (int i = 0; i < N; i++) mark(&sum, truth[i], visibility[i], bound[i]);
        check("disk before disk", &sum, 0.5 * pow(counts[c], -0.75));
    }
    fold_stand(&s);
}

/* Closed form 6: slats that the light spans a whole number of periods of hide the same
 * everywhere. */
static void a_screen_hides_its_share(void **unused) {
    (void)unused;
    enum { N = 2000, SLATS = 60 };
    stand s = {0};
    const double period = 0.05, width = 0.02;
    for (int i = 0; i < SLATS; i++) {
        const double corner[3] = {(i - SLATS / 2) * period, -2, 1}, a[3] = {width, 0, 0},
                     b[3] = {0, 4, 0};
        add_quad(&s, corner, a, b);
    }
    raise_stand(&s, NULL);
    /* Seen from the ground the period is 0.1 at height 2: the light is 10 periods wide. */
    softshadow_light light = light_at(SOFTSHADOW_RECT, 0, 0, 2, 0.5);
    light.direction[2] = 0;
    static ss_point points[N];
    static float visibility[N], bound[N];
    uint64_t state = 4;
    for (int i = 0; i < N; i++) {
        const double host[3] = {chance(&state) - 0.5, chance(&state) - 0.5, 0};
        points[i] = make_point(&s, host, false);
    }
    score sum = {0};
    ask(&s, &light, 256, SOFTSHADOW_UNIFORM, points, N, visibility, bound);
    for (int i = 0; i < N; i++) mark(&sum, 1 - width / period, visibility[i], bound[i]);
    check("screen", &sum, 0.015); /* random samples: .031 */
    fold_stand(&s);
}

/* Closed form 7: a wall standing on the ground, the light centred over the line of contact. */
static void a_wall_touches_the_ground(void **unused) {
    (void)unused;
    double worst = 0;
    for (int scale = -6; scale <= 6; scale += 3) {
        const double k = pow(10, scale);
        stand s = {0};
        const double corner[3] = {-2 * k, -2 * k, 0}, a[3] = {4 * k, 0, 0}, b[3] = {0, 4 * k, 0};
        const double foot[3] = {0, -2 * k, 0}, up[3] = {0, 0, 1.5 * k};
        add_quad(&s, corner, a, b);
        add_quad(&s, foot, b, up);
        raise_stand(&s, NULL);
        const softshadow_light light = light_at(SOFTSHADOW_SPHERE, 0, 0, 2 * k, 0.5 * k);
        for (int given = 0; given < 2; given++) {
            for (int e = 1; e <= 9; e++) {
                ss_point points[2];
                float visibility[2], bound[2];
                for (int side = 0; side < 2; side++) {
                    const double d = (side ? 1 : -1) * pow(10, -e) * k, host[3] = {d, 0.01 * k, 0};
                    points[side] = make_point(&s, host, false);
                    if (given) points[side].ulp = 0, points[side].triangle = d > host[1] ? 0 : 1;
                }
                ask(&s, &light, 4096, SOFTSHADOW_UNIFORM, points, 2, visibility, bound);
                for (int side = 0; side < 2; side++) {
                    /* The wall's plane x = 0 cuts the disk that faces the point at 2 d / (2 k) of
                     * its centre to first order: V = 1/2 + that much of a chord. */
                    const double off = pow(10, -e) / 0.5 * (2 / PI) * 1.05 + 0.001;
                    worst = fmax(worst, fabs(visibility[side] - 0.5));
                    if (!(fabs(visibility[side] - 0.5) <= off)) {
                        fail_msg("scale 1e%d, d 1e-%d, side %d, %s: V = %g", scale, e, side,
                                 given ? "triangle given" : "not given", visibility[side]);
                    }
                }
            }
        }
        fold_stand(&s);
    }
    print_message("wall: furthest from 1/2 at d = 0.1: %.4f\n", worst);
}

/* A closed ball in single precision: 2 x rings x sides triangles. */
typedef struct ball {
    float at[25][48][3];
    uint32_t indices[24 * 48 * 2][3];
} ball;

static void make_ball(ball *out, double radius, double offset) {
    for (int i = 0; i <= 24; i++) {
        for (int j = 0; j < 48; j++) {
            const double polar = PI * i / 24, around = 2 * PI * j / 48;
            out->at[i][j][0] = (float)(offset + radius * sin(polar) * cos(around));
            out->at[i][j][1] = (float)(offset + radius * sin(polar) * sin(around));
            out->at[i][j][2] = (float)(offset + radius * cos(polar));
            if (i == 24) continue;
            const uint32_t a = (uint32_t)(i * 48 + j), b = (uint32_t)(i * 48 + (j + 1) % 48);
            const uint32_t six[2][3] = {{a, a + 48, b}, {b, a + 48, b + 48}};
            memcpy(out->indices[2 * (i * 48 + j)], six, sizeof six);
        }
    }
}

#define MOST_POINTS 12000

/* Points on faces that look at the light, rounded to single precision: a convex body never shadows
 * itself. `lumps`: how rough rounding has made the ball, as a sine. */
static void no_acne_at(double scale, double offset, double lumps, size_t n) {
    static ball mesh;
    make_ball(&mesh, scale, offset * scale);
    stand s = {0};
    add_mesh(&s, SOFTSHADOW_F32, mesh.at, 25 * 48, &mesh.indices[0][0], 24 * 48 * 2);
    raise_stand(&s, NULL);
    const double middle = offset * scale, to[3] = {0.36, 0.48, 0.8};
    const softshadow_light light = light_at(SOFTSHADOW_SPHERE, middle + 5 * scale * to[0],
                                            middle + 5 * scale * to[1], middle + 5 * scale * to[2],
                                            0.2 * scale);
    uint64_t state = 11;
    size_t asked = 0, dark[4] = {0};
    static ss_point points[4][MOST_POINTS];
    static float visibility[MOST_POINTS];
    assert_true(n <= MOST_POINTS);
    while (asked < n) {
        const uint32_t t = (uint32_t)(chance(&state) * 24 * 48 * 2);
        double v[3][3], one[3], two[3], normal[3], host[3], radial[3], toward[3];
        double u = chance(&state), w = chance(&state);
        if (u + w > 1) u = 1 - u, w = 1 - w;
        for (int i = 0; i < 3; i++) {
            const float *at = (const float *)mesh.at + 3 * (size_t)mesh.indices[t][i];
            for (int k = 0; k < 3; k++) v[i][k] = at[k];
        }
        for (int k = 0; k < 3; k++) {
            host[k] = (float)(v[0][k] + u * (v[1][k] - v[0][k]) + w * (v[2][k] - v[0][k]));
            radial[k] = host[k] - middle, toward[k] = light.position[k] - host[k];
        }
        ss_sub(v[1], v[0], one);
        ss_sub(v[2], v[0], two);
        ss_cross(one, two, normal);
        if (!ss_normalize(normal) || !ss_normalize(radial) || !ss_normalize(toward)) continue;
        if (ss_dot(normal, radial) < 0) { /* winding */
            for (int k = 0; k < 3; k++) normal[k] = -normal[k];
        }
        /* the light's own half angle is .04; facing by face and by ball */
        if (ss_dot(normal, toward) < 0.1 + lumps || ss_dot(radial, toward) < 0.1 + lumps) continue;
        for (int way = 0; way < 4; way++) {
            ss_point *point = &points[way][asked];
            *point = make_point(&s, host, true);
            if (way & 1) point->triangle = t, point->ulp = 0;
            for (int k = 0; k < 3 && (way & 2); k++) point->normal[k] = (float)normal[k];
        }
        asked++;
    }
    for (int way = 0; way < 4; way++) {
        /* Groups of points from all over the ball: rays. Points alone: mostly none. */
        ask(&s, &light, 16, SOFTSHADOW_UNIFORM, points[way], n, visibility, NULL);
        for (size_t i = 0; i < n; i++) dark[way] += visibility[i] < 1;
        for (size_t i = 0; i < 500; i++) {
            ask(&s, &light, 16, SOFTSHADOW_UNIFORM, &points[way][i], 1, visibility, NULL);
            dark[way] += visibility[0] < 1;
        }
    }
    print_message(
        "ball of size %g at %g sizes: %zu points, dark %zu, with triangles %zu, with normals "
        "%zu, with both %zu\n",
        scale, offset, n, dark[0], dark[1], dark[2], dark[3]);
    for (int way = 0; way < 4; way++) assert_int_equal(dark[way], 0);
    fold_stand(&s);
}

static void no_acne_on_a_convex_body(void **unused) {
    (void)unused;
    const double scale[] = {1e-6, 1, 1e6};
    for (int i = 0; i < 3; i++) {
        no_acne_at(scale[i], 0, 0, MOST_POINTS);
        no_acne_at(scale[i], 100, 0, MOST_POINTS);
        no_acne_at(scale[i], 1e4, 0.1, MOST_POINTS);
    }
}

/* Splitting, order and company change nothing, bit for bit. */
static void a_point_is_answered_alone(void **unused) {
    (void)unused;
    enum { N = 100 };
    stand s = {0};
    const double corner[3] = {-0.2, -0.3, 1}, a[3] = {0.4, 0, 0.1}, b[3] = {0, 0.5, 0.2};
    add_quad(&s, corner, a, b);
    raise_stand(&s, NULL);
    const softshadow_light light = light_at(SOFTSHADOW_SPHERE, 0.1, 0, 3, 0.5);
    ss_point points[N], backwards[N];
    float together[N], alone, turned[N], bound[N], lone;
    uint64_t state = 6;
    for (int i = 0; i < N; i++) {
        const double host[3] = {chance(&state) - 0.5, chance(&state) - 0.5, 0};
        points[i] = make_point(&s, host, false);
        backwards[N - 1 - i] = points[i];
    }
    ask(&s, &light, 40, SOFTSHADOW_IRRADIANCE, points, N, together, bound);
    ask(&s, &light, 40, SOFTSHADOW_IRRADIANCE, backwards, N, turned, NULL);
    for (int i = 0; i < N; i++) {
        ask(&s, &light, 40, SOFTSHADOW_IRRADIANCE, &points[i], 1, &alone, &lone);
        assert_memory_equal(&alone, &together[i], sizeof alone);
        assert_memory_equal(&turned[N - 1 - i], &together[i], sizeof alone);
    }
    fold_stand(&s);
}

/* A point far away sees a small caster before a light as far on the other side. */
static void far_points_see_small_casters(void **unused) {
    (void)unused;
    stand s = {0};
    const double corner[3] = {-0.5, -0.5, 0}, a[3] = {1, 0, 0}, b[3] = {0, 1, 0};
    add_quad(&s, corner, a, b);
    raise_stand(&s, NULL);
    for (int e = 1; e <= 9; e++) {
        const double away = pow(10, e), host[3] = {0.1, 0.2, -away};
        /* The square is seen twice as large: a light of half axis 2 beyond it is a quarter
         * hidden. */
        softshadow_light light = light_at(SOFTSHADOW_RECT, 0.1, 0.2, away, 2);
        light.direction[2] = 0;
        const ss_point point = make_point(&s, host, false);
        float visibility, bound;
        ask(&s, &light, 1024, SOFTSHADOW_UNIFORM, &point, 1, &visibility, &bound);
        assert_true(fabsf(visibility - 0.75f) < 0.004f);
        light.radius = 0;
        light.type = SOFTSHADOW_SPHERE;
        ask(&s, &light, 1024, SOFTSHADOW_UNIFORM, &point, 1, &visibility, &bound);
        assert_true(visibility == 0 && bound == 0);
    }
    fold_stand(&s);
}

static void special_places(void **unused) {
    (void)unused;
    stand s = {0};
    const double corner[3] = {-5, -5, 0}, a[3] = {10, 0, 0}, b[3] = {0, 10, 0};
    add_quad(&s, corner, a, b);
    raise_stand(&s, NULL);
    float visibility, bound;
    const double on[3] = {0.3, 0.1, 0}, inside[3] = {0, 0, 1}, level[3] = {2, 0, 2};
    softshadow_light light = light_at(SOFTSHADOW_SPHERE, 0, 0, 1, 0.5);
    ss_point point = make_point(&s, inside, false);
    ask(&s, &light, 16, SOFTSHADOW_UNIFORM, &point, 1, &visibility, &bound);
    assert_true(visibility == 1 && bound == 0);
    /* On the ground, lit; facing away from the light: hidden below its own horizon. */
    point = make_point(&s, on, false);
    ask(&s, &light, 64, SOFTSHADOW_UNIFORM, &point, 1, &visibility, &bound);
    assert_true(visibility == 1);
    point.normal[2] = -1;
    ask(&s, &light, 64, SOFTSHADOW_UNIFORM, &point, 1, &visibility, &bound);
    assert_true(visibility == 0 && bound == 0);
    /* The horizon cuts the light in two. */
    point.normal[0] = 1, point.normal[2] = 0.3f;
    ask(&s, &light, 1024, SOFTSHADOW_UNIFORM, &point, 1, &visibility, &bound);
    assert_true(fabsf(visibility - 0.5f) < 0.004f);
    /* In the plane of a flat light: uniform sees its segments, the others have no light to
     * share. */
    light = light_at(SOFTSHADOW_DISK, 0, 0, 2, 0.5);
    point = make_point(&s, level, false);
    ask(&s, &light, 64, SOFTSHADOW_UNIFORM, &point, 1, &visibility, &bound);
    assert_true(visibility == 1);
    ask(&s, &light, 64, SOFTSHADOW_SOLID_ANGLE, &point, 1, &visibility, &bound);
    assert_true(visibility == 0);
    /* Under irradiance a disk shines to its normal's side only. */
    point = make_point(&s, on, false);
    point.normal[2] = 1;
    ask(&s, &light, 64, SOFTSHADOW_IRRADIANCE, &point, 1, &visibility, &bound);
    assert_true(visibility == 1);
    light.direction[2] = 1;
    ask(&s, &light, 64, SOFTSHADOW_IRRADIANCE, &point, 1, &visibility, &bound);
    assert_true(visibility == 0 && bound == 0);
    /* A sliver of a disk is above the horizon, less than samples can find: all of that is seen. */
    light.direction[2] = -1;
    point.normal[0] = 10.001f, point.normal[2] = -1;
    ask(&s, &light, 64, SOFTSHADOW_IRRADIANCE, &point, 1, &visibility, &bound);
    assert_true(visibility == 1 && bound > 0);
    /* From below the ground the sun above it is hidden, from above it is not. */
    softshadow_light sun = SOFTSHADOW_LIGHT_INIT;
    sun.type = SOFTSHADOW_SUN, sun.direction[2] = -1, sun.radius = 0.01;
    const double below[3] = {0.3, 0.1, -1e-9}, above[3] = {0.3, 0.1, 1e-9};
    point = make_point(&s, below, false);
    ask(&s, &sun, 64, SOFTSHADOW_UNIFORM, &point, 1, &visibility, &bound);
    assert_true(visibility == 0);
    point = make_point(&s, above, false);
    ask(&s, &sun, 64, SOFTSHADOW_UNIFORM, &point, 1, &visibility, &bound);
    assert_true(visibility == 1);
    fold_stand(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_straight_edge_before_a_disk),
        cmocka_unit_test(a_rectangle_before_a_rectangle),
        cmocka_unit_test(a_disk_before_a_disk),
        cmocka_unit_test(a_screen_hides_its_share),
        cmocka_unit_test(a_wall_touches_the_ground),
        cmocka_unit_test(no_acne_on_a_convex_body),
        cmocka_unit_test(a_point_is_answered_alone),
        cmocka_unit_test(far_points_see_small_casters),
        cmocka_unit_test(special_places),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
