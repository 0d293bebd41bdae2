/* map and raster: frames, the fill rule, depth against rays cast one by one, any number of
 * threads. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/vec.h"
#include "map/frame.h"
#include "raster/raster.h"
#include "shapes.h"

typedef struct scene {
    ss_scene scene;
    ss_world *world;
    ss_light light;
} scene;

static scene make(const shape *s, const softshadow_light *light) {
    scene b = {0};
    uint32_t id;
    const softshadow_mesh mesh = shape_mesh(s);
    assert_int_equal(ss_scene_add_mesh(&b.scene, &mesh, &id), SOFTSHADOW_OK);
    assert_int_equal(ss_scene_add_light(&b.scene, light, true, &id), SOFTSHADOW_OK);
    assert_int_equal(ss_world_create(&b.world, &b.scene), SOFTSHADOW_OK);
    ss_world_light(b.world, &b.scene.lights[0], &b.light);
    return b;
}

static void drop(scene *b) {
    ss_world_destroy(b->world);
    ss_scene_free(&b->scene);
}

static softshadow_light sphere_at(double x, double y, double z, double radius) {
    softshadow_light light = SOFTSHADOW_LIGHT_INIT;
    light.position[0] = x, light.position[1] = y, light.position[2] = z, light.radius = radius;
    return light;
}

static softshadow_light sun_along(double x, double y, double z, double angle) {
    softshadow_light light = SOFTSHADOW_LIGHT_INIT;
    light.type = SOFTSHADOW_SUN;
    light.direction[0] = x, light.direction[1] = y, light.direction[2] = z, light.radius = angle;
    return light;
}

static ss_frames fit(const scene *b, uint32_t resolution, const double *host_bounds, bool margin) {
    ss_frames frames;
    ss_pool *pool = test_pool(2);
    ss_fit f = {.world = b->world, .light = &b->light, .resolution = resolution, .margin = margin};
    if (host_bounds) {
        f.bounded = true;
        ss_world_local(b->world, host_bounds, f.bounds);
        ss_world_local(b->world, host_bounds + 3, f.bounds + 3);
    }
    assert_int_equal(ss_frames_fit(&frames, &f, pool), SOFTSHADOW_OK);
    ss_pool_destroy(pool);
    return frames;
}

/* ---- the fill rule -------------------------------------------------------------------------- */

typedef struct tally {
    uint32_t resolution;
    uint8_t *count;
    float *sum; /* attribute 0 */
} tally;

static void count_run(void *ctx, const ss_raster_run *run) {
    tally *t = ctx;
    for (uint32_t i = 0; i < run->n; i++) {
        const size_t at = (size_t)run->y * t->resolution + run->x + i;
        t->count[at]++;
        t->sum[at] += run->attribute[0][i];
    }
}

static uint64_t random_state = 7;
static double uniform(void) {
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) * 0x1p-53;
}

static bool convex(const double *const c[4]) {
    bool left = false, right = false;
    for (int i = 0; i < 4; i++) {
        const double *p = c[i], *q = c[(i + 1) % 4], *r = c[(i + 2) % 4];
        const double turn = (q[0] - p[0]) * (r[1] - q[1]) - (q[1] - p[1]) * (r[0] - q[0]);
        left |= turn > 0, right |= turn < 0;
    }
    return left != right;
}

static void put(ss_raster_polygon *t, const double *const c[4], const int *order,
                uint32_t corners) {
    t->corners = corners;
    for (uint32_t k = 0; k < corners; k++) {
        const double *p = c[order[k]];
        t->corner[k][0] = p[0], t->corner[k][1] = p[1];
        t->attribute[k][0] = 3 + .25 * p[0] - .5 * p[1];
    }
}

/* An ink with these draws by other code: near things first. */
static float nearest(const void *ctx, uint32_t tag, const float *low, const float *high,
                     int *kind) {
    (void)ctx, (void)tag, (void)low, (void)high, (void)kind;
    return 0;
}

/* A jittered grid of quads over the map and beyond, whole or in halves: every texel exactly once,
 * in whatever winding. */
static void check_watertight(bool near_first) {
    enum { SIDE = 40, RES = 101 };
    static double v[SIDE + 1][SIDE + 1][2];
    static ss_raster_polygon t[2 * SIDE * SIDE];
    for (int kind = 0; kind < 4; kind++) {
        size_t n = 0;
        for (int i = 0; i <= SIDE; i++) {
            for (int j = 0; j <= SIDE; j++) {
                /* kind 1: corners on centres and edges on centre lines; 2: far out of the guard
                 * band */
                const double step = kind == 1 ? 3 : kind == 2 ? 4000 : 130.0 / SIDE;
                const double jitter = kind == 1 ? 0 : kind == 3 ? 0 : .45 * step;
                v[i][j][0] = -10.5 * (kind == 2 ? 7000 : 1) + j * step + jitter * (uniform() - .5);
                v[i][j][1] = -10.5 * (kind == 2 ? 7000 : 1) + i * step + jitter * (uniform() - .5);
            }
        }
        for (int i = 0; i < SIDE; i++) {
            for (int j = 0; j < SIDE; j++) {
                const double *c[4] = {v[i][j], v[i][j + 1], v[i + 1][j + 1], v[i + 1][j]};
                const int flip = (i + j) & 1;
                const int order[2][3] = {{0, 1 + flip, 2 - flip}, {0, 2 + flip, 3 - flip}};
                const int around[2][4] = {{1, 2, 3, 0}, {3, 2, 1, 0}};
                if (i % 3 && convex(c)) {
                    put(&t[n++], c, around[flip], 4);
                    continue;
                }
                for (int h = 0; h < 2; h++) put(&t[n++], c, order[h], 3);
            }
        }
        for (uint32_t threads = 1; threads <= 7; threads += 3) {
            ss_pool *pool = test_pool(threads);
            uint8_t *count = calloc(RES * RES, 1);
            float *sum = calloc(RES * RES, sizeof *sum);
            tally tl = {RES, count, sum};
            const ss_raster_ink ink = {.shade = count_run, .ctx = &tl,
                                       .least = near_first ? nearest : NULL};
            assert_int_equal(ss_raster_cpu.keep(t, n, RES, &ink, pool), SOFTSHADOW_OK);
            for (int y = 0; y < RES; y++) {
                for (int x = 0; x < RES; x++) {
                    assert_int_equal(count[y * RES + x], 1);
                    if (kind == 2) continue; /* its numbers are as large as its corners */
                    assert_true(fabs(sum[y * RES + x] - (3 + .25 * (x + .5) - .5 * (y + .5))) <
                                1e-3);
                }
            }
            free(count), free(sum);
            ss_pool_destroy(pool);
        }
    }
}

static void test_watertight(void **state) {
    (void)state;
    check_watertight(false);
    check_watertight(true);
}

/* ---- depth ---------------------------------------------------------------------------------- */

/* The nearest h below `above` along the ray through a map position, one triangle after the
 * other. */
static double cast(const ss_world *w, const ss_frame *f, double column, double row, double above) {
    const double X = f->low[0] + column * f->texel, Y = f->low[1] + row * f->texel;
    double best = SS_MAP_FAR;
    for (size_t t = 0; t < w->triangle_count; t++) {
        double c[3][3];
        bool seen = true;
        for (int i = 0; i < 3; i++) {
            const float *p = w->vertices + 3 * (size_t)w->indices[3 * t + (size_t)i];
            const double d[3] = {p[0] - f->origin[0], p[1] - f->origin[1], p[2] - f->origin[2]};
            c[i][0] = ss_dot(d, f->x), c[i][1] = ss_dot(d, f->y), c[i][2] = ss_dot(d, f->z);
            seen &= c[i][2] > f->nearest;
        }
        if (!seen) continue;
        double weight[3], area = 0;
        for (int i = 0; i < 3; i++) {
            const double *a = c[(i + 1) % 3], *b = c[(i + 2) % 3];
            const double sa = 1 / (1 + a[2] * f->inverse), sb = 1 / (1 + b[2] * f->inverse);
            weight[i] = (a[0] * sa - X) * (b[1] * sb - Y) - (a[1] * sa - Y) * (b[0] * sb - X);
            area += weight[i];
        }
        if (area == 0) continue;
        double h = 0;
        for (int i = 0; i < 3; i++) {
            if (weight[i] / area < 0) seen = false;
            h += weight[i] / area * c[i][2] / (1 + c[i][2] * f->inverse);
        }
        if (seen && h > above) best = fmin(best, h);
    }
    return best;
}

enum { LAYERS = 3 };

/* Layers as they are, drawn one after the other: each below the one before. */
static void check_layers(const ss_raster_casters *casters, float *const layer[LAYERS],
                         ss_pool *pool) {
    const size_t texels = (size_t)casters->resolution * casters->resolution;
    float *above = ss_alloc(texels, sizeof *above), *next = ss_alloc(texels, sizeof *next);
    for (size_t i = 0; i < texels; i++) above[i] = -SS_MAP_FAR;
    for (int l = 0; l < LAYERS; l++) {
        assert_int_equal(ss_raster_cpu.peel(casters, above, next, pool), SOFTSHADOW_OK);
        assert_memory_equal(next, layer[l], texels * sizeof *next);
        for (size_t i = 0; i < texels; i++) above[i] = ss_map_below(next[i]);
    }
    ss_free(above), ss_free(next);
}

/* Gives how many texels have a second layer. */
static size_t check_depth(const scene *b, uint32_t resolution) {
    const ss_frames frames = fit(b, resolution, NULL, false);
    assert_true(frames.count > 0);
    const size_t texels = (size_t)resolution * resolution;
    float *planes = ss_alloc(2 * LAYERS * texels, sizeof *planes), *layer[LAYERS], *other[LAYERS];
    for (size_t l = 0; l < LAYERS; l++)
        layer[l] = planes + l * texels, other[l] = planes + (LAYERS + l) * texels;
    size_t off[2] = {0}, covered[2] = {0};
    for (uint32_t face = 0; face < frames.count; face++) {
        const ss_raster_casters casters = {.world = b->world, .frame = &frames.face[face],
                                           .resolution = resolution, .deepest = SS_MAP_FAR};
        for (uint32_t threads = 1; threads <= 7; threads += 3) {
            ss_pool *pool = test_pool(threads);
            float *const *into = threads == 1 ? layer : other;
            for (uint32_t count = 1; count <= LAYERS; count++) {
                assert_int_equal(ss_raster_cpu.depth(&casters, into, count, pool), SOFTSHADOW_OK);
                assert_memory_equal(into[0], layer[0], count * texels * sizeof *planes);
            }
            check_layers(&casters, into, pool);
            ss_pool_destroy(pool);
        }
        for (size_t i = 0; i < texels; i++) {
            double above = -INFINITY;
            for (int l = 0; l < 2 && above < SS_MAP_FAR; l++) {
                const double truth = cast(b->world, &frames.face[face], i % resolution + .5,
                                          i / resolution + .5, above);
                covered[l] += layer[l][i] < SS_MAP_FAR;
                /* steep faces move by their slope times the snapping of 1/512 texel */
                if (fabs(truth - layer[l][i]) > 1e-3 * (1 + fabs(truth))) off[l]++;
                above = truth + 1e-6 * (1 + fabs(truth));
            }
        }
    }
    assert_true(covered[0] > 100);
    for (int l = 0; l < 2; l++) /* but a rim of texels whose centre is within the snapping */
        assert_true(off[l] * 200 <= covered[l]);
    ss_free(planes);
    return covered[1];
}

static void test_depth(void **state) {
    (void)state;
    shape s = shape_sphere(12, .2);
    const softshadow_light lights[] = {sphere_at(.5, -1, 4, .1), sun_along(.3, -.2, -1, .02),
                                       sphere_at(1e7, 2e7, 3e7, 1e5), sphere_at(.1, .2, .1, .1)};
    size_t second = 0;
    for (size_t i = 0; i < sizeof lights / sizeof *lights; i++) {
        scene b = make(&s, &lights[i]);
        second += check_depth(&b, 33);
        drop(&b);
    }
    assert_true(second > 1000);
    shape_free(&s);
}

/* Sheets so near to each other that floats hardly tell, in any order: what counts as one layer
 * depends on depths alone. */
static void test_alike(void **state) {
    (void)state;
    enum { SHEETS = 7, SIDE = 16 };
    const softshadow_light light = sphere_at(0, 0, 9, .1);
    ss_pool *pool = test_pool(1);
    size_t alike = 0;
    for (int trial = 0; trial < 300; trial++) {
        double corner[3 * SHEETS + 3][3] = {{-3, -3, -3}, {-3.1, -3, -3}, {-3, -3.1, -3}};
        uint32_t index[SHEETS + 1][3] = {{0, 1, 2}};
        float planes[LAYERS][SIDE * SIDE], *layer[LAYERS];
        for (uint32_t i = 0; i < SHEETS; i++) {
            const double z = 2 + floor(12 * uniform()) * 0x1p-22;
            for (uint32_t k = 0; k < 3; k++) {
                const uint32_t at = 3 * i + 3 + k;
                index[i + 1][k] = at, corner[at][2] = z;
                corner[at][0] = k == 1 ? 3 : -3, corner[at][1] = k == 2 ? 3 : -3;
            }
        }
        shape s = shape_of((const double(*)[3])corner, 3 * SHEETS + 3,
                           (const uint32_t(*)[3])index, SHEETS + 1);
        scene b = make(&s, &light);
        const ss_frames frames = fit(&b, SIDE, NULL, false);
        const ss_raster_casters casters = {.world = b.world, .frame = &frames.face[0],
                                           .resolution = SIDE, .deepest = SS_MAP_FAR};
        for (int l = 0; l < LAYERS; l++) layer[l] = planes[l];
        assert_int_equal(ss_raster_cpu.depth(&casters, layer, LAYERS, pool), SOFTSHADOW_OK);
        check_layers(&casters, layer, pool);
        bool three = false;
        for (int i = 0; i < SIDE * SIDE; i++) three |= planes[2][i] < SS_MAP_FAR;
        alike += !three;
        drop(&b);
        shape_free(&s);
    }
    assert_true(alike > 30 && alike < 270); /* it is a test of both */
    ss_pool_destroy(pool);
}

/* ---- holes ---------------------------------------------------------------------------------- */

/* Where the ray through a map position meets triangle 0: its weights of the 2nd and 3rd vertex. */
static bool meet(const ss_world *w, const ss_frame *f, double column, double row, double uv[2]) {
    double from[3], along[3], e[2][3], s[3], p[3], q[3];
    const float *v[3];
    for (int i = 0; i < 3; i++) v[i] = w->vertices + 3 * (size_t)w->indices[i];
    for (int k = 0; k < 3; k++) {
        from[k] = f->origin[k] - f->z[k] / f->inverse;
        along[k] = f->z[k] / f->inverse + (f->low[0] + column * f->texel) * f->x[k] +
                   (f->low[1] + row * f->texel) * f->y[k];
        for (int i = 0; i < 2; i++) e[i][k] = (double)v[i + 1][k] - v[0][k];
        s[k] = from[k] - v[0][k];
    }
    ss_cross(along, e[1], p);
    ss_cross(s, e[0], q);
    const double determinant = ss_dot(e[0], p);
    uv[0] = ss_dot(s, p) / determinant, uv[1] = ss_dot(along, q) / determinant;
    return uv[0] >= 0 && uv[1] >= 0 && uv[0] + uv[1] <= 1 && ss_dot(e[1], q) / determinant > 0;
}

/* One triangle with a chequered texture, drawn against rays cast one by one. */
static void check_holes(const double corner[3][3]) {
    enum { SIDE = 128 };
    static uint8_t chequers[8 * 8];
    static const float uvs[3][2] = {{0, 0}, {1, 0}, {0, 1}};
    static float plane[SIDE * SIDE];
    for (int i = 0; i < 64; i++) chequers[i] = (i + i / 8) % 2 ? 255 : 0;
    const uint32_t index[1][3] = {{0, 1, 2}};
    const double below[6] = {-4, -4, -3, 4, 4, -2};
    const softshadow_light light = sphere_at(0, 1, 3, 0);
    shape s = shape_of(corner, 3, index, 1);
    scene b = {0};
    uint32_t id;
    softshadow_mesh mesh = shape_mesh(&s);
    mesh.uvs = &uvs[0][0], mesh.opacity = (softshadow_texture){8, 8, chequers};
    mesh.opacity_threshold = .5f;
    assert_int_equal(ss_scene_add_mesh(&b.scene, &mesh, &id), SOFTSHADOW_OK);
    assert_int_equal(ss_scene_add_light(&b.scene, &light, true, &id), SOFTSHADOW_OK);
    assert_int_equal(ss_world_create(&b.world, &b.scene), SOFTSHADOW_OK);
    ss_world_light(b.world, &b.scene.lights[0], &b.light);
    const ss_frames frames = fit(&b, SIDE, below, false);
    assert_int_equal(frames.count, 1);
    const ss_raster_casters casters = {.world = b.world, .frame = &frames.face[0],
                                       .resolution = SIDE, .deepest = SS_MAP_FAR};
    ss_pool *pool = test_pool(2);
    assert_int_equal(ss_raster_cpu.depth(&casters, (float *[]){plane}, 1, pool), SOFTSHADOW_OK);
    ss_pool_destroy(pool);
    int dark = 0, holes = 0, off = 0;
    for (int i = 0; i < SIDE * SIDE; i++) {
        double uv[2];
        const bool met = meet(b.world, &frames.face[0], i % SIDE + .5, i / SIDE + .5, uv);
        const bool opaque = met && ss_world_opaque_at(b.world, 0, uv[0], uv[1]);
        dark += opaque, holes += met && !opaque;
        off += opaque != (plane[i] < SS_MAP_FAR);
    }
    assert_true(dark > 1000 && holes > 1000);
    assert_true(off * 200 < dark + holes); /* centres within the snapping of a chequer's rim */
    drop(&b);
    shape_free(&s);
}

/* Chequered sheets one behind the other: below a hole lies what is seen through it. */
static void test_holes_in_layers(void **state) {
    (void)state;
    enum { SHEETS = 5, SIDE = 96 };
    static uint8_t chequers[8 * 8];
    double corner[3 * SHEETS][3];
    float uvs[3 * SHEETS][2], planes[LAYERS][SIDE * SIDE], *layer[LAYERS];
    uint32_t index[SHEETS][3], id;
    for (int i = 0; i < 64; i++) chequers[i] = (i + i / 8) % 2 ? 255 : 0;
    for (uint32_t i = 0; i < 3 * SHEETS; i++) {
        corner[i][0] = i % 3 == 1 ? 3 : -3, corner[i][1] = i % 3 == 2 ? 3 : -3;
        corner[i][2] = uniform() - i / 3;
        uvs[i][0] = i % 3 == 1, uvs[i][1] = i % 3 == 2;
        index[i / 3][i % 3] = i;
    }
    shape s = shape_of((const double(*)[3])corner, 3 * SHEETS, (const uint32_t(*)[3])index, SHEETS);
    const softshadow_light light = sphere_at(0, 0, 9, .1);
    scene b = {0};
    softshadow_mesh mesh = shape_mesh(&s);
    mesh.uvs = &uvs[0][0], mesh.opacity = (softshadow_texture){8, 8, chequers};
    mesh.opacity_threshold = .5f;
    assert_int_equal(ss_scene_add_mesh(&b.scene, &mesh, &id), SOFTSHADOW_OK);
    assert_int_equal(ss_scene_add_light(&b.scene, &light, true, &id), SOFTSHADOW_OK);
    assert_int_equal(ss_world_create(&b.world, &b.scene), SOFTSHADOW_OK);
    ss_world_light(b.world, &b.scene.lights[0], &b.light);
    const ss_frames frames = fit(&b, SIDE, NULL, false);
    const ss_raster_casters casters = {.world = b.world, .frame = &frames.face[0],
                                       .resolution = SIDE, .deepest = SS_MAP_FAR};
    ss_pool *pool = test_pool(2);
    for (int l = 0; l < LAYERS; l++) layer[l] = planes[l];
    assert_int_equal(ss_raster_cpu.depth(&casters, layer, LAYERS, pool), SOFTSHADOW_OK);
    check_layers(&casters, layer, pool);
    size_t third = 0;
    for (int i = 0; i < SIDE * SIDE; i++) third += planes[2][i] < SS_MAP_FAR;
    assert_true(third > 100);
    ss_pool_destroy(pool);
    drop(&b);
    shape_free(&s);
}

/* All in front of the light; one corner behind it; two. */
static void test_holes(void **state) {
    (void)state;
    check_holes((const double[3][3]){{-2, -2, 1}, {2.5, -1, 0}, {0, 4, 1.5}});
    check_holes((const double[3][3]){{-2, -4, 0}, {2, -4, 0}, {0, 6, 5}});
    check_holes((const double[3][3]){{0, -2.5, 0}, {-5, 7, 5}, {5, 7, 5}});
}

/* A body all around the light: a cube of six faces; one to the side: one frame. */
static void test_faces(void **state) {
    (void)state;
    shape s = shape_sphere(12, 0);
    const softshadow_light in = sphere_at(.1, .2, .1, .05), out = sphere_at(0, 0, 3, .05),
                           beside = sphere_at(0, 0, 1.05, .05);
    const double below[6] = {-1, -1, -5, 1, 1, -4}, above[6] = {-1, -1, 4, 1, 1, 5};
    scene b = make(&s, &in);
    ss_frames frames = fit(&b, 32, NULL, false);
    assert_true(frames.cube && frames.count == 6);
    frames = fit(&b, 32, below, false); /* one frame sees all that is asked */
    assert_true(!frames.cube && frames.count == 1);
    drop(&b);
    b = make(&s, &out);
    frames = fit(&b, 32, NULL, false);
    assert_true(!frames.cube && frames.count == 1);
    frames = fit(&b, 32, above, false); /* nothing between those points and the light */
    assert_int_equal(frames.count, 0);
    drop(&b);
    b = make(&s, &beside);
    frames = fit(&b, 32, NULL, false);
    assert_true(frames.count >= 1 && frames.count < 6); /* no face for the empty side */
    drop(&b);
    shape_free(&s);
}

/* Points go where the pixels are: the matrix, the projection and the looks agree. */
static void test_looks(void **state) {
    (void)state;
    shape s = shape_sphere(12, 0);
    const softshadow_light lights[] = {sphere_at(.5, -1, 4, .1), sun_along(.3, -.2, -1, .02),
                                       sphere_at(.1, .2, .1, .1)};
    for (size_t l = 0; l < sizeof lights / sizeof *lights; l++) {
        scene b = make(&s, &lights[l]);
        const ss_frames frames = fit(&b, 64, NULL, false);
        for (int i = 0; i < 200; i++) {
            ss_point point = {.p = {3 * uniform() - 1.5, 3 * uniform() - 1.5, 3 * uniform() - 1.5}};
            ss_places places;
            ss_looks looks;
            for (int k = 0; k < 3; k++) {
                for (int j = 0; j < 8; j++) places.at[k][j] = point.p[k];
            }
            ss_frames_look(&frames, &places, 1, &looks);
            if (looks.h[0] == -SS_MAP_FAR) continue;
            const ss_frame *f = &frames.face[looks.face[0]];
            double at[3] = {0}, matrix[16], host[3], clip[4];
            assert_true(ss_frame_project(f, point.p, at));
            assert_true(fabs(at[0] - looks.x[0]) < 1e-4 && fabs(at[1] - looks.y[0]) < 1e-4);
            ss_frame_matrix(f, b.world, 64, matrix);
            for (int k = 0; k < 3; k++) {
                host[k] = point.p[k] / b.world->scale + b.world->half[k] + b.world->low[k];
            }
            for (int r = 0; r < 4; r++) {
                clip[r] = matrix[4 * r + 3];
                for (int k = 0; k < 3; k++) clip[r] += matrix[4 * r + k] * host[k];
            }
            for (int k = 0; k < 2; k++) {
                assert_true(fabs((clip[k] / clip[3] + 1) * 32 - at[k]) < 1e-9 * 64);
            }
            assert_true((clip[2] / clip[3] <= 1) == (at[2] <= f->far_h * (1 + 1e-12)));
        }
        drop(&b);
    }
    shape_free(&s);
}

static void test_speed(void **state) {
    (void)state;
    shape s = shape_sphere(132, .1);
    const softshadow_light light = sphere_at(2, 1, 4, .1);
    scene b = make(&s, &light);
    const ss_frames frames = fit(&b, 1024, NULL, false);
    float *plane = ss_alloc(1024 * 1024, sizeof *plane);
    const ss_raster_casters casters = {
        .world = b.world, .frame = &frames.face[0], .resolution = 1024, .deepest = SS_MAP_FAR};
    for (uint32_t threads = 1; threads <= 2; threads++) {
        ss_pool *pool = test_pool(threads);
        double best = 1e9;
        for (int i = 0; i < 5; i++) {
            const double start = ss_clock();
            assert_int_equal(ss_raster_cpu.depth(&casters, &plane, 1, pool), SOFTSHADOW_OK);
            best = fmin(best, ss_clock() - start);
        }
        print_message("%zu triangles at 1024^2 on %u threads: %.1f ms\n", s.triangle_count, threads,
                      best * 1e3);
        ss_pool_destroy(pool);
    }
    ss_free(plane);
    drop(&b);
    shape_free(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_watertight), cmocka_unit_test(test_depth),
        cmocka_unit_test(test_alike),      cmocka_unit_test(test_holes_in_layers),
        cmocka_unit_test(test_faces),      cmocka_unit_test(test_looks),
        cmocka_unit_test(test_speed),      cmocka_unit_test(test_holes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
