/* Points told by closed forms: far nearer to the truth than they say at most, on every rung with
 * the same bits; and what is told to be lit is so with room to spare. The truth: rows of the light,
 * in each of which what a triangle hides is an interval, in double. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/cpu.h"
#include "base/memory.h"
#include "base/vec.h"
#include "coverage/plates.h"
#include "shapes.h"

enum { SCENES = 240, N = 64, ROWS = 2000, MOST_TRIANGLES = 4 };
/* What the rows leave: where an outline is level with them, half of one, 2 / ROWS high and 2 long,
 * of pi. */
#define TRUTH_ERROR (0.64 / ROWS)
#define ULP         0x1p-23
#define MOST        0x1p-6f
/* exact_build.c counts on errors being a fraction of what is said: this, by how many roundings
 * agree. */
#define USUAL       32

static uint64_t state;
static double uniform(double low, double high) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(state >> 11) * 0x1p-53;
}

static void set(double out[3], double x, double y, double z) {
    out[0] = x, out[1] = y, out[2] = z;
}

/* ---- scenes --------------------------------------------------------------------------------- */

typedef struct setting {
    shape mesh;
    ss_scene scene;
    ss_world *world;
    ss_light light;
    ss_places places;
    uint8_t axis[3];
} setting;

static void add_triangle(shape *s, const double a[3], const double b[3], const double c[3]) {
    const double *corner[3] = {a, b, c};
    for (uint32_t k = 0; k < 3; k++) {
        memcpy(s->vertices[s->vertex_count], corner[k], sizeof *s->vertices);
        s->triangles[s->triangle_count][k] = (uint32_t)s->vertex_count++;
    }
    s->triangle_count++;
}

/* A skewed triangle; or a slanted rectangle of two; or two apart; or a rectangle as a floor and
 * another over it. */
static shape make_mesh(int scene) {
    shape s = {calloc(3 * MOST_TRIANGLES, sizeof *s.vertices),
               calloc(MOST_TRIANGLES, sizeof *s.triangles), 0, 0};
    const int kind = scene % 4;
    for (int part = 0; part < (kind < 2 ? 1 : 2); part++) {
        double v[4][3];
        for (int c = 0; c < 3; c++) {
            set(v[c], uniform(-1, 1), uniform(-1, 1), uniform(-.3, .3) + (part ? -.9 : .4));
        }
        if (kind == 3 && part) {
            for (int c = 0; c < 3; c++) set(v[c], c == 0 ? 1 : -1, c == 2 ? 1 : -1, -.9);
        }
        if (kind == 1 || kind == 3) { /* on a grid: the rectangle's plane is one */
            for (int k = 0; k < 3; k++) {
                for (int c = 0; c < 3; c++) v[c][k] = round(v[c][k] * 1024) / 1024;
                v[3][k] = v[0][k] + v[2][k] - v[1][k];
            }
            add_triangle(&s, v[0], v[1], v[2]);
            add_triangle(&s, v[0], v[2], v[3]);
        } else {
            add_triangle(&s, v[0], v[1], v[2]);
        }
    }
    return s;
}

static ss_light make_light(int scene) {
    ss_light l = {.type = (const uint32_t[]){SOFTSHADOW_SPHERE, SOFTSHADOW_DISK, SOFTSHADOW_RECT,
                                             SOFTSHADOW_SUN}[scene / 4 % 4]};
    const double size = (const double[]){.05, .4, 1}[scene / 16 % 3];
    double n[3] = {uniform(-.5, .5), uniform(-.5, .5), 1}, a[3], b[3];
    ss_normalize(n);
    ss_basis(n, a, b);
    for (int k = 0; k < 3; k++) {
        l.centre[k] = uniform(2.5, 6) * n[k];
        if (l.type == SOFTSHADOW_SUN) l.centre[k] = 0;
        l.normal[k] = l.type == SOFTSHADOW_SUN ? n[k] : -n[k];
        l.u[k] = size * a[k] * (l.type == SOFTSHADOW_RECT ? 1.25 : 1), l.v[k] = size * b[k];
        if (l.type == SOFTSHADOW_SPHERE) l.normal[k] = l.u[k] = l.v[k] = 0;
    }
    l.radius = l.type == SOFTSHADOW_RECT ? size * hypot(1.25, 1) : size;
    l.ellipse = false;
    return l;
}

/* Behind an edge as the light, or a place near it, sees it. */
static void put_behind(const ss_light *light, double corner[3][3], double p[3]) {
    const double along = uniform(0, 1), far = uniform(0, 1);
    for (int k = 0; k < 3; k++) {
        const double at = corner[0][k] + along * (corner[1][k] - corner[0][k]);
        const double off = light->radius * uniform(-.7, .7);
        const double away = light->type == SOFTSHADOW_SUN ? -light->normal[k] - off
                                                          : at - light->centre[k] - off;
        p[k] = at + far * away;
    }
}

/* Behind the casters; anywhere; and close to them, on both sides and in their planes. */
static void make_places(setting *s) {
    for (int i = 0; i < N; i++) {
        double p[3] = {uniform(-2, 2), uniform(-2, 2), uniform(-1.5, 1.5)}, corner[3][3];
        if (i % 16 == 1) p[0] *= 10, p[1] *= 10;
        ss_world_triangle(s->world, (uint32_t)uniform(0, (double)s->world->triangle_count), corner);
        const double u = uniform(0, 1), v = uniform(0, 1 - u),
                     up = (const double[]){0, 1e-3, -1e-3, -.05}[i / 4 % 4];
        for (int k = 0; k < 3 && i % 4 == 3; k++) {
            p[k] = corner[0][k] + u * (corner[1][k] - corner[0][k]) +
                   v * (corner[2][k] - corner[0][k]) + (k == 2) * up;
        }
        if (i % 2 == 0) put_behind(&s->light, corner, p);
        for (int k = 0; k < 3; k++) s->places.at[k][i] = (float)p[k];
    }
}

static void make_world(setting *s) {
    softshadow_mesh given = SOFTSHADOW_MESH_INIT;
    given.positions = s->mesh.vertices, given.vertex_count = s->mesh.vertex_count;
    given.position_type = SOFTSHADOW_F64, given.position_stride = 3 * sizeof(double);
    given.indices = (const uint32_t *)s->mesh.triangles;
    given.triangle_count = s->mesh.triangle_count;
    uint32_t id;
    assert_int_equal(ss_scene_add_mesh(&s->scene, &given, &id), SOFTSHADOW_OK);
    assert_int_equal(ss_world_create(&s->world, &s->scene), SOFTSHADOW_OK);
}

static setting make_setting(int scene) {
    setting s = {.axis = {0, 1, 2}};
    state = (uint64_t)scene * 977 + 5;
    s.mesh = make_mesh(scene);
    make_world(&s);
    s.light = make_light(scene);
    make_places(&s);
    return s;
}

static void free_setting(setting *s) {
    ss_world_destroy(s->world);
    ss_scene_free(&s->scene);
    shape_free(&s->mesh);
}

/* ---- the truth ------------------------------------------------------------------------------ */

/* Cuts what has  value + slope x <= 0  off an interval. */
static void cut(double value, double slope, double range[2]) {
    const double at = -value / slope;
    if (slope > 0) range[0] = fmax(range[0], at);
    else if (slope < 0) range[1] = fmin(range[1], at);
    else if (value <= 0) range[1] = range[0];
}

/* Where in row t of the light the triangle hides it. A direction d is in the triangle's cone if it
 * is on one side of the planes through its edges, and meets its plane before the light if n d > n x
 * / t_end. */
static void hidden_in_row(const double corner[3][3], const ss_view *view, double t, double range[2]) {
    double e[3], f[3], n[3], base[3], sign = 1;
    for (int k = 0; k < 3; k++) base[k] = view->centre[k] + t * view->b[k];
    ss_sub(corner[1], corner[0], e);
    ss_sub(corner[2], corner[0], f);
    ss_cross(e, f, n);
    const double height = ss_dot(n, corner[0]);
    if (height < 0) sign = -1;
    for (int i = 0; i < 3; i++) {
        double m[3];
        ss_cross(corner[i], corner[(i + 1) % 3], m);
        cut(sign * ss_dot(m, base), sign * ss_dot(m, view->a), range);
    }
    const double end = isinf(view->t_end) ? 0 : height / view->t_end;
    cut(sign * (ss_dot(n, base) - end), sign * ss_dot(n, view->a), range);
}

static double union_of(double (*range)[2], size_t count) {
    double sum = 0, until = -INFINITY;
    for (size_t done = 0; done < count; done++) {
        size_t least = done;
        for (size_t i = done; i < count; i++) least = range[i][0] < range[least][0] ? i : least;
        const double low = fmax(range[least][0], until), high = range[least][1];
        if (high > low) sum += high - low, until = high;
        memcpy(range[least], range[done], sizeof *range);
    }
    return sum;
}

static double truth(const setting *s, const double p[3]) {
    ss_view view;
    ss_light_view(&s->light, p, &view);
    double hidden = 0, all = 0;
    for (int row = 0; row < ROWS; row++) {
        const double t = 2 * (row + .5) / ROWS - 1, reach = view.disk ? sqrt(1 - t * t) : 1;
        double range[MOST_TRIANGLES][2];
        for (uint32_t i = 0; i < s->world->triangle_count; i++) {
            double corner[3][3];
            ss_world_triangle(s->world, i, corner);
            for (int c = 0; c < 3; c++) ss_sub(corner[c], p, corner[c]);
            range[i][0] = -reach, range[i][1] = reach;
            hidden_in_row((const double(*)[3])corner, &view, t, range[i]);
        }
        hidden += union_of(range, s->world->triangle_count), all += 2 * reach;
    }
    return 1 - hidden / all;
}

/* Such a face is in nobody's way, on whichever side of it floats have put the point. */
static bool is_on_a_face(const setting *s, const double p[3]) {
    for (uint32_t t = 0; t < s->world->triangle_count; t++) {
        double corner[3][3], e[3], f[3], n[3], d[3];
        ss_world_triangle(s->world, t, corner);
        ss_sub(corner[1], corner[0], e);
        ss_sub(corner[2], corner[0], f);
        ss_cross(e, f, n);
        ss_sub(p, corner[0], d);
        if (ss_normalize(n) && fabs(ss_dot(n, d)) < 4 * ULP) return true;
    }
    return false;
}

/* ---- what is told --------------------------------------------------------------------------- */

typedef struct answers {
    float visibility[N], bound[N];
    ss_plates_told told;
} answers;

static void ask(const setting *s, size_t n, float most, ss_rung rung, answers *out) {
    static ss_plates_tell *const tell[] = SS_RUNGS(ss_plates_tell);
    ss_plates *plates;
    assert_int_equal(ss_plates_create(&plates, s->world, &s->light, s->axis), SOFTSHADOW_OK);
    *out = (answers){0};
    if (plates) tell[rung](plates, &s->places, n, ULP, most, out->visibility, out->bound, &out->told);
    ss_free(plates);
}

static void is_as_wrong_as_it_says(void **unused) {
    (void)unused;
    size_t told = 0, partly = 0;
    for (int scene = 0; scene < SCENES; scene++) {
        setting s = make_setting(scene);
        answers a;
        ask(&s, N, MOST, ss_cpu_rung(), &a);
        for (int i = 0; i < N; i++) {
            if (!(a.told.all >> i & 1)) continue;
            const double p[3] = {s.places.at[0][i], s.places.at[1][i], s.places.at[2][i]};
            const double right = truth(&s, p), wrong = fabs((double)a.visibility[i] - right);
            told++, partly += right > .01 && right < .99;
            assert_int_equal(a.told.lit >> i & 1, a.visibility[i] == 1);
            assert_int_equal(a.told.dark >> i & 1, a.visibility[i] == 0);
            assert_true(a.bound[i] >= 0 && a.bound[i] <= MOST);
            if (wrong > (double)a.bound[i] / USUAL + TRUTH_ERROR && !is_on_a_face(&s, p)) {
                fail_msg("scene %d, point %d: %g, truth %g, bound %g", scene, i,
                         (double)a.visibility[i], right, (double)a.bound[i]);
            }
        }
        free_setting(&s);
    }
    /* Most points can be told, and many of them see a part of the light. */
    assert_true(told > (size_t)SCENES * N * 2 / 3 && partly > (size_t)SCENES * N / 8);
}

/* A light a little larger is all seen, too. */
static void tells_the_lit_with_room_to_spare(void **unused) {
    (void)unused;
    size_t told = 0;
    for (int scene = 0; scene < SCENES; scene++) {
        setting s = make_setting(scene);
        answers a;
        ask(&s, N, 0, ss_cpu_rung(), &a);
        for (int k = 0; k < 3; k++) s.light.u[k] *= 1.03, s.light.v[k] *= 1.03;
        s.light.radius *= 1.03;
        for (int i = 0; i < N; i++) {
            if (!(a.told.all >> i & 1)) continue;
            const double p[3] = {s.places.at[0][i], s.places.at[1][i], s.places.at[2][i]};
            assert_true(a.visibility[i] == 1);
            if (!is_on_a_face(&s, p)) assert_true(truth(&s, p) == 1);
            told++;
        }
        free_setting(&s);
    }
    assert_true(told > (size_t)SCENES * N / 4);
}

static void gives_the_same_bits_on_every_rung(void **unused) {
    (void)unused;
    for (int scene = 0; scene < SCENES; scene++) {
        setting s = make_setting(scene);
        const size_t n = scene % 3 ? N : 1 + (size_t)scene % N;
        for (int mode = 0; mode < 2; mode++) {
            answers first, other;
            ask(&s, n, mode ? 1e-3f : 0, SS_SCALAR, &first);
            for (ss_rung rung = SS_AVX2; rung <= ss_cpu_rung(); rung++) {
                ask(&s, n, mode ? 1e-3f : 0, rung, &other);
                assert_memory_equal(&first.told, &other.told, sizeof first.told);
                assert_memory_equal(first.visibility, other.visibility, n * sizeof(float));
                assert_memory_equal(first.bound, other.bound, n * sizeof(float));
            }
        }
        free_setting(&s);
    }
}

/* Not flat, too thin, or too many: there are no plates of these. */
static void knows_what_it_cannot_do(void **unused) {
    (void)unused;
    for (int kind = 0; kind < 3; kind++) {
        setting s = {.light = make_light(0), .axis = {0, 1, 2}};
        ss_plates *plates;
        s.mesh = kind == 0 ? shape_sphere(6, 0) : shape_cube();
        if (kind == 2) { /* a corner that is next to another */
            double *corner = s.mesh.vertices[s.mesh.triangles[0][2]];
            memcpy(corner, s.mesh.vertices[s.mesh.triangles[0][1]], sizeof *s.mesh.vertices);
            corner[0] += 1e-4;
            s.mesh.triangle_count = 1;
        }
        make_world(&s);
        assert_int_equal(ss_plates_create(&plates, s.world, &s.light, s.axis), SOFTSHADOW_OK);
        assert_true((plates != NULL) == (kind == 1));
        if (plates) assert_int_equal(plates->count, 6); /* a cube's sides */
        ss_free(plates);
        free_setting(&s);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(is_as_wrong_as_it_says),
        cmocka_unit_test(tells_the_lit_with_room_to_spare),
        cmocka_unit_test(gives_the_same_bits_on_every_rung),
        cmocka_unit_test(knows_what_it_cannot_do),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
