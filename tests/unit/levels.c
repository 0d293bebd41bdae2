/* topology/levels: coarser stand-ins, how far they stray, and their cache on disk. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/memory.h"
#include "base/vec.h"
#include "shapes.h"
#include "topology/cache.h"
#include "topology/decimate.h"
#include "topology/edges.h"
#include "topology/levels.h"
#include "topology/simplify.h"

static int log_lines;
static char last_line[8192];

static void count_line(void *user, int level, const char *text) {
    (void)user;
    assert_int_equal(level, 1);
    snprintf(last_line, sizeof last_line, "%s", text);
    log_lines++;
}

static ss_pool *logging_pool(uint32_t threads) {
    softshadow_options options = SOFTSHADOW_OPTIONS_INIT;
    ss_pool *pool;
    options.threads = threads, options.log = count_line;
    assert_int_equal(ss_pool_create(&pool, &options), SOFTSHADOW_OK);
    return pool;
}

typedef struct built {
    ss_scene scene;
    ss_world *world;
    ss_levels *levels;
} built;

static built build_meshes(const softshadow_mesh *meshes, size_t count, uint32_t threads) {
    built b = {0};
    ss_pool *pool = logging_pool(threads);
    uint32_t id;
    for (size_t i = 0; i < count; i++) {
        assert_int_equal(ss_scene_add_mesh(&b.scene, &meshes[i], &id), SOFTSHADOW_OK);
    }
    assert_int_equal(ss_world_create(&b.world, &b.scene), SOFTSHADOW_OK);
    assert_int_equal(ss_levels_build(b.world, pool, NULL, &b.levels), SOFTSHADOW_OK);
    assert_int_equal(b.levels->mesh_count, count);
    ss_pool_destroy(pool);
    return b;
}

static built build_shape(const shape *s) {
    const softshadow_mesh mesh = shape_mesh(s);
    return build_meshes(&mesh, 1, 1);
}

static void drop(built *b) {
    ss_levels_destroy(b->levels);
    ss_world_destroy(b->world);
    ss_scene_free(&b->scene);
}

static void assert_same(const ss_mesh_levels *x, const ss_mesh_levels *y) {
    assert_int_equal(x->count, y->count);
    for (uint32_t i = 0; i < x->count; i++) {
        const ss_level *a = &x->level[i], *b = &y->level[i];
        assert_int_equal(a->vertex_count, b->vertex_count);
        assert_int_equal(a->triangle_count, b->triangle_count);
        assert_memory_equal(a->vertices, b->vertices, a->vertex_count * sizeof(float[3]));
        assert_memory_equal(a->indices, b->indices, a->triangle_count * sizeof(uint32_t[3]));
        assert_true(a->deviation_rms == b->deviation_rms && a->deviation_max == b->deviation_max);
    }
}

/* ---- The levels ---- */

/* Squared distance to a triangle, another way than the library's: Lagrange by cases on
 * barycentrics, edges by clamping. */
static double distance2(const double p[3], const float *x, const float *y, const float *z) {
    double corner[3][3], best = INFINITY;
    for (int k = 0; k < 3; k++) corner[0][k] = x[k], corner[1][k] = y[k], corner[2][k] = z[k];
    for (int i = 0; i < 3; i++) {
        double along[3], to[3], q[3];
        ss_sub(corner[(i + 1) % 3], corner[i], along), ss_sub(p, corner[i], to);
        const double s = fmin(1, fmax(0, ss_dot(to, along) / fmax(ss_dot(along, along), 1e-300)));
        ss_add_scaled(to, -s, along, q);
        best = fmin(best, ss_dot(q, q));
    }
    double u[3], v[3], w[3];
    ss_sub(corner[1], corner[0], u), ss_sub(corner[2], corner[0], v), ss_sub(p, corner[0], w);
    const double uu = ss_dot(u, u), uv = ss_dot(u, v), vv = ss_dot(v, v), wu = ss_dot(w, u),
                 wv = ss_dot(w, v), d = uu * vv - uv * uv;
    const double s = (wu * vv - wv * uv) / d, t = (wv * uu - wu * uv) / d;
    if (d > 0 && s >= 0 && t >= 0 && s + t <= 1) {
        ss_add_scaled(w, -s, u, w), ss_add_scaled(w, -t, v, w);
        best = fmin(best, ss_dot(w, w));
    }
    return best;
}

/* Over the places of the mesh, each counted once. */
static void check_deviation(const shape *s, const built *b, const ss_level *level) {
    double sum = 0, most = 0;
    size_t count = 0;
    for (size_t i = 0; i < s->vertex_count; i++) {
        bool seen = false;
        for (size_t j = 0; j < i && !seen; j++) {
            seen = memcmp(s->vertices[i], s->vertices[j], sizeof *s->vertices) == 0;
        }
        if (seen) continue;
        double p[3], best = INFINITY;
        ss_world_local(b->world, s->vertices[i], p);
        for (size_t t = 0; t < level->triangle_count; t++) {
            const uint32_t *c = level->indices + 3 * t;
            best = fmin(best, distance2(p, level->vertices + 3 * c[0], level->vertices + 3 * c[1],
                                        level->vertices + 3 * c[2]));
        }
        sum += best, most = fmax(most, best), count++;
    }
    /* Both sides round positions to float: 2^-24 of the size, a few times. */
    assert_true(fabs(sqrt(sum / (double)count) - level->deviation_rms) < 1e-6);
    assert_true(fabs(sqrt(most) - level->deviation_max) < 1e-6);
}

static bool is_closed(const ss_level *level) {
    uint32_t *same = malloc(level->vertex_count * sizeof *same);
    for (uint32_t v = 0; v < level->vertex_count; v++) same[v] = v;
    const ss_corners corners = {level->indices, same, level->triangle_count, level->vertex_count};
    ss_topology table = {0};
    assert_int_equal(ss_edges_build(&table, &corners, NULL), SOFTSHADOW_OK);
    assert_int_equal(ss_components_build(&table), SOFTSHADOW_OK);
    bool closed = true;
    for (uint32_t c = 0; c < table.component_count; c++) closed &= table.components[c].closed;
    ss_edges_free(&table);
    free(same);
    return closed;
}

static void sphere_has_three(void **unused) {
    (void)unused;
    shape sphere = shape_sphere(36, .05); /* seam and pole vertices are doubled */
    built b = build_shape(&sphere);
    const ss_mesh_levels *levels = &b.levels->meshes[0];
    assert_int_equal(levels->count, 3);
    size_t before = sphere.triangle_count;
    double strays = 0;
    for (int i = 0; i < 3; i++) {
        const ss_level *level = &levels->level[i];
        assert_true(level->triangle_count <= before / 4 + 1 && level->triangle_count >= before / 5);
        assert_true(is_closed(level));
        assert_int_equal(2 * level->vertex_count, level->triangle_count + 4); /* still a sphere */
        assert_true(level->deviation_rms > strays && level->deviation_max > level->deviation_rms);
        if (i > 0)
            check_deviation(&sphere, &b, level); /* by brute force: the fine one takes long */
        before = level->triangle_count, strays = level->deviation_rms;
    }
    /* Chords of a unit sphere with n even triangles stray by 4.8 / n / 3; bumps add .05. */
    assert_true(levels->level[0].deviation_rms < 3e-3);
    assert_true(levels->level[2].deviation_rms < 3e-2);
    assert_int_equal(b.levels->cached, 0);
    assert_true(ss_levels_bytes(b.levels) < 36 * sphere.triangle_count);
    drop(&b);
    shape_free(&sphere);
}

static size_t count_corners_at(const ss_level *level, const double place[3]) {
    size_t count = 0;
    for (size_t i = 0; i < 3 * level->triangle_count; i++) {
        const float *v = level->vertices + 3 * (size_t)level->indices[i];
        double d[3];
        for (int k = 0; k < 3; k++) d[k] = v[k] - place[k];
        count += ss_length(d) < 1e-6;
    }
    return count;
}

/* A sphere on which fins stand, two triangles each: 200 low ones, which the levels do without, and
 * a high one, which they all have. */
static void fins_hold_nothing(void **unused) {
    (void)unused;
    enum { FINS = 200 };
    shape plain = shape_sphere(48, .05), s = plain;
    s.vertices = malloc((plain.vertex_count + FINS) * sizeof *s.vertices);
    s.triangles = malloc((plain.triangle_count + 2 * FINS) * sizeof *s.triangles);
    memcpy(s.vertices, plain.vertices, plain.vertex_count * sizeof *s.vertices);
    memcpy(s.triangles, plain.triangles, plain.triangle_count * sizeof *s.triangles);
    for (uint32_t i = 0; i < FINS; i++) {
        const uint32_t *c = plain.triangles[(plain.triangle_count / FINS) * i + 7];
        const double height = i == FINS / 2 ? 1.5 : 1.0001;
        double *tip = s.vertices[s.vertex_count];
        for (int k = 0; k < 3; k++) {
            tip[k] = height * (s.vertices[c[0]][k] + s.vertices[c[1]][k]) / 2;
        }
        const uint32_t at = (uint32_t)s.vertex_count++;
        const uint32_t fin[2][3] = {{c[0], c[1], at}, {c[1], c[0], at}};
        memcpy(s.triangles[s.triangle_count], fin, sizeof fin);
        s.triangle_count += 2;
    }
    built b = build_shape(&s);
    const ss_mesh_levels *levels = &b.levels->meshes[0];
    size_t most = plain.triangle_count;
    double tip[3];
    ss_world_local(b.world, s.vertices[plain.vertex_count + FINS / 2], tip);
    assert_int_equal(levels->count, 3);
    for (int i = 0; i < 3; i++) {
        const ss_level *level = &levels->level[i];
        most /= 4;
        assert_true(level->triangle_count <= most + 1 + 2);
        assert_true(is_closed(level));
        assert_int_equal(count_corners_at(level, tip), 2);
        assert_true(level->deviation_max < .1);
    }
    drop(&b);
    free(s.vertices);
    free(s.triangles);
    shape_free(&plain);
}

static void a_dense_mesh_has_four(void **unused) {
    (void)unused;
    shape sphere = shape_sphere(260, .05);
    built b = build_shape(&sphere);
    const ss_mesh_levels *levels = &b.levels->meshes[0];
    assert_int_equal(levels->count, 4);
    assert_true(levels->level[3].triangle_count <= sphere.triangle_count / 256 + 1);
    assert_true(levels->level[3].triangle_count >= 1000);
    assert_true(is_closed(&levels->level[3]));
    assert_true(levels->level[3].deviation_rms > levels->level[2].deviation_rms);
    drop(&b);
    shape_free(&sphere);
}

/* A wavy sheet of n x n squares. */
static shape shape_sheet(uint32_t n) {
    shape s = {malloc((n + 1) * (n + 1) * sizeof *s.vertices),
               malloc(2 * n * n * sizeof *s.triangles), (n + 1) * (n + 1), 0};
    for (uint32_t i = 0; i <= n; i++) {
        for (uint32_t j = 0; j <= n; j++) {
            double *v = s.vertices[i * (n + 1) + j];
            v[0] = i, v[1] = j, v[2] = 3 * sin(i * 6.0 / n) * cos(j * 5.0 / n);
            if (i == n || j == n) continue;
            const uint32_t a = i * (n + 1) + j, c = a + n + 1;
            const uint32_t t[2][3] = {{a, c, a + 1}, {a + 1, c, c + 1}};
            memcpy(s.triangles[s.triangle_count], t, sizeof t), s.triangle_count += 2;
        }
    }
    return s;
}

static void sheet_keeps_its_rim(void **unused) {
    (void)unused;
    shape sheet = shape_sheet(44);
    built b = build_shape(&sheet);
    assert_int_equal(b.levels->meshes[0].count, 3);
    for (int i = 0; i < 3; i++) {
        const ss_level *level = &b.levels->meshes[0].level[i];
        float low[2] = {9, 9}, high[2] = {-9, -9};
        for (size_t v = 0; v < level->vertex_count; v++) {
            for (int k = 0; k < 2; k++) {
                low[k] = fminf(low[k], level->vertices[3 * v + k]);
                high[k] = fmaxf(high[k], level->vertices[3 * v + k]);
            }
        }
        const double slack = 2 * level->deviation_max;
        for (int k = 0; k < 2; k++) {
            assert_true(fabs((double)low[k] - (double)b.world->bounds[k]) <= slack);
            assert_true(fabs((double)high[k] - (double)b.world->bounds[3 + k]) <= slack);
        }
        assert_true(level->deviation_max < .05);
        if (i > 0) check_deviation(&sheet, &b, level);
    }
    drop(&b);
    shape_free(&sheet);
}

static void none_for_soup_and_small(void **unused) {
    (void)unused;
    shape cube = shape_cube(), sphere = shape_sphere(40, 0), soup = shape_split(&sphere);
    for (size_t v = 0; v < soup.vertex_count; v++) soup.vertices[v][0] += 3.0 * (double)(v / 3);
    static const uint8_t texel = 9;
    float *uvs = calloc(sphere.vertex_count, sizeof(float[2]));
    softshadow_mesh meshes[4] = {shape_mesh(&cube), shape_mesh(&soup), shape_mesh(&sphere),
                                 shape_mesh(&sphere)};
    meshes[2].uvs = uvs, meshes[2].opacity = (softshadow_texture){1, 1, &texel};
    built b = build_meshes(meshes, 4, 2);
    for (int m = 0; m < 3; m++) assert_int_equal(b.levels->meshes[m].count, 0);
    assert_int_equal(b.levels->meshes[3].count, 3);
    assert_int_equal(ss_levels_work(b.world), soup.triangle_count + sphere.triangle_count);
    uint64_t triangles = 0;
    for (int i = 0; i < 3; i++) triangles += b.levels->meshes[3].level[i].triangle_count;
    assert_int_equal(b.levels->triangle_count, triangles);
    drop(&b);
    free(uvs);
    shape_free(&cube), shape_free(&sphere), shape_free(&soup);
}

/* All its vertices in one place; a tangle of 5,000 triangles between 300 random vertices. */
static void hostile_meshes(void **unused) {
    (void)unused;
    shape s = shape_sphere(40, 0);
    for (size_t v = 0; v < s.vertex_count; v++) memset(s.vertices[v], 0, sizeof *s.vertices);
    built b = build_shape(&s);
    assert_int_equal(b.levels->meshes[0].count, 0);
    drop(&b);
    shape_free(&s);
    s = shape_sphere(50, 0);
    uint32_t state = 1;
    for (size_t i = 0; i < 3 * s.triangle_count; i++) {
        state = state * 1664525 + 1013904223;
        s.triangles[i / 3][i % 3] = (state >> 8) % 300;
    }
    b = build_shape(&s);
    assert_true(b.levels->meshes[0].count <= 3);
    drop(&b);
    shape_free(&s);
}

/* Two spheres that touch in a pole, at every size on the way down: what is closed stays closed. */
static void closed_stays_closed(void **unused) {
    (void)unused;
    shape sphere = shape_sphere(40, 0);
    const size_t v = sphere.vertex_count, t = sphere.triangle_count;
    shape two = {malloc(2 * v * sizeof *two.vertices), malloc(2 * t * sizeof *two.triangles), 2 * v,
                 2 * t};
    for (size_t i = 0; i < 2 * v; i++) {
        memcpy(two.vertices[i], sphere.vertices[i % v], sizeof *two.vertices);
        two.vertices[i][2] += i < v ? 0 : 2;
    }
    for (size_t i = 0; i < 6 * t; i++) {
        two.triangles[i / 3][i % 3] =
            (uint32_t)(sphere.triangles[i / 3 % t][i % 3] + (i < 3 * t ? 0 : v));
    }
    built b = build_shape(&two);
    assert_int_equal(b.levels->meshes[0].count, 3);
    ss_pool *pool = test_pool(2);
    ss_simplifier *s;
    const ss_level *first = &b.levels->meshes[0].level[0];
    assert_true(is_closed(first));
    assert_int_equal(ss_simplifier_create(&s, first->vertices, first->vertex_count, first->indices,
                                          first->triangle_count, pool),
                     SOFTSHADOW_OK);
    size_t steps = 0;
    for (size_t target = first->triangle_count; target > 10; target -= 1 + target / 9, steps++) {
        assert_int_equal(ss_simplify(s, target, NULL), SOFTSHADOW_OK);
        ss_level level = {0};
        assert_true(
            ss_level_allocate(&level, ss_simplifier_vertices(s), ss_simplifier_triangles(s)));
        ss_simplifier_read(s, level.vertices, level.indices);
        assert_true(is_closed(&level));
        for (size_t i = 0; i < first->vertex_count; i++) {
            assert_true(ss_simplifier_where(s, i) < level.vertex_count);
        }
        ss_free(level.vertices), ss_free(level.indices);
    }
    assert_true(steps > 30 && ss_simplifier_triangles(s) < 40);
    ss_simplifier_destroy(s);
    ss_pool_destroy(pool);
    drop(&b);
    shape_free(&sphere), shape_free(&two);
}

static void moves_with_its_mesh(void **unused) {
    (void)unused;
    shape sphere = shape_sphere(40, .1);
    /* A quarter turn, eight times as large, far away. */
    const double turned[12] = {0, -8, 0, 1024, 8, 0, 0, -512, 0, 0, 8, 64};
    softshadow_mesh mesh = shape_mesh(&sphere);
    built a = build_meshes(&mesh, 1, 1);
    mesh.transform = turned;
    built b = build_meshes(&mesh, 1, 1);
    for (int i = 0; i < 3; i++) {
        const ss_level *x = &a.levels->meshes[0].level[i], *y = &b.levels->meshes[0].level[i];
        assert_int_equal(x->triangle_count, y->triangle_count);
        assert_memory_equal(x->indices, y->indices, x->triangle_count * sizeof(uint32_t[3]));
        const double grown = 8 * b.world->scale / a.world->scale;
        assert_true(fabs(y->deviation_rms / (x->deviation_rms * grown) - 1) < 1e-12);
        for (size_t v = 0; v < x->vertex_count; v++) {
            double host[3], local[3], p[3];
            for (int k = 0; k < 3; k++) {
                p[k] = (double)x->vertices[3 * v + k] / a.world->scale + a.world->half[k] +
                       a.world->low[k];
            }
            for (int k = 0; k < 3; k++) {
                const double *row = turned + 4 * k;
                host[k] = row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3];
            }
            ss_world_local(b.world, host, local);
            for (int k = 0; k < 3; k++)
                assert_true(fabs(local[k] - (double)y->vertices[3 * v + k]) < 3e-7);
        }
    }
    drop(&a), drop(&b);
    shape_free(&sphere);
}

static void same_on_any_threads(void **unused) {
    (void)unused;
    shape big = shape_sphere(90, .05), small = shape_sphere(40, .1), sheet = shape_sheet(50);
    const softshadow_mesh meshes[3] = {shape_mesh(&big), shape_mesh(&small), shape_mesh(&sheet)};
    for (size_t count = 1; count <= 3; count += 2) {
        built b[3];
        for (int i = 0; i < 3; i++) {
            b[i] = build_meshes(meshes, count, (uint32_t[]){1, 2, 7}[i]);
            for (size_t m = 0; m < count; m++) {
                assert_int_equal(b[i].levels->meshes[m].count, 3);
                assert_same(&b[0].levels->meshes[m], &b[i].levels->meshes[m]);
            }
        }
        for (int i = 0; i < 3; i++) drop(&b[i]);
    }
    shape_free(&big), shape_free(&small), shape_free(&sheet);
}

static int stop(void *user, double done) {
    (void)user;
    (void)done;
    return 1;
}

static void can_be_cancelled(void **unused) {
    (void)unused;
    shape sphere = shape_sphere(40, .1);
    built b = build_shape(&sphere);
    softshadow_options options = SOFTSHADOW_OPTIONS_INIT;
    options.progress = stop;
    ss_progress *progress = ss_progress_create(&options, ss_levels_work(b.world));
    ss_pool *pool = test_pool(2);
    ss_levels *levels = b.levels;
    assert_int_equal(ss_levels_build(b.world, pool, progress, &levels), SOFTSHADOW_E_CANCELLED);
    assert_null(levels);
    ss_progress_destroy(progress);
    ss_pool_destroy(pool);
    drop(&b);
    shape_free(&sphere);
}

/* ---- The cache ---- */

static char directory[] = "/tmp/softshadow-levels-XXXXXX";

static int make_directory(void **unused) {
    (void)unused;
    unsetenv("SOFTSHADOW_CACHE");
    return mkdtemp(directory) ? 0 : -1;
}

static size_t files(bool remove_them) {
    size_t count = 0;
    DIR *open = opendir(directory);
    char path[512];
    for (struct dirent *entry; open && (entry = readdir(open));) {
        if (entry->d_name[0] == '.') continue;
        snprintf(path, sizeof path, "%s/%s", directory, entry->d_name);
        if (remove_them && unlink(path) != 0) rmdir(path);
        count++;
    }
    if (open) closedir(open);
    return count;
}

static int remove_directory(void **unused) {
    (void)unused;
    files(true);
    return rmdir(directory);
}

static void second_build_is_read(void **unused) {
    (void)unused;
    shape sphere = shape_sphere(40, .1), sheet = shape_sheet(40);
    const softshadow_mesh meshes[2] = {shape_mesh(&sphere), shape_mesh(&sheet)};
    const double moved[12] = {1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0};
    log_lines = 0;
    built made = build_meshes(meshes, 2, 2);
    setenv("SOFTSHADOW_CACHE", directory, 1);
    built b[3];
    b[0] = build_meshes(meshes, 2, 1), b[1] = build_meshes(meshes, 2, 2);
    softshadow_mesh other = meshes[0];
    other.transform = moved;
    b[2] = build_meshes(&other, 1, 1);
    assert_int_equal(b[0].levels->cached, 0);
    assert_int_equal(b[1].levels->cached, 2);
    assert_int_equal(b[2].levels->cached, 1);
    for (int i = 0; i < 2; i++) {
        for (int m = 0; m < 2; m++) assert_same(&made.levels->meshes[m], &b[i].levels->meshes[m]);
    }
    sphere.vertices[700][1] += 1e-3; /* another mesh now */
    built changed = build_meshes(meshes, 1, 1);
    assert_int_equal(changed.levels->cached, 0);
    assert_int_equal(files(false), 3);
    assert_int_equal(log_lines, 0);
    unsetenv("SOFTSHADOW_CACHE");
    drop(&made), drop(&changed);
    for (int i = 0; i < 3; i++) drop(&b[i]);
    shape_free(&sphere), shape_free(&sheet);
    files(true);
}

/* Two levels by hand: four triangles, one. */
static const ss_cache_key key = {{0x1234, 0x9876543210abcdef}, 9, 20};
static const softshadow_options host = {.struct_size = sizeof host, .log = count_line};

static ss_mesh_levels levels_by_hand(void) {
    ss_mesh_levels levels = {.count = 2};
    static const uint32_t indices[2][12] = {{0, 1, 2, 1, 2, 3, 0, 2, 3, 4, 0, 1}, {0, 2, 1}};
    for (int i = 0; i < 2; i++) {
        ss_level *level = &levels.level[i];
        assert_true(ss_level_allocate(level, i ? 3 : 5, i ? 1 : 4));
        for (size_t v = 0; v < 3 * level->vertex_count; v++) level->vertices[v] = (float)v / 16;
        memcpy(level->indices, indices[i], level->triangle_count * sizeof(uint32_t[3]));
        level->deviation_rms = .01 * (i + 1), level->deviation_max = .02 * (i + 1);
    }
    return levels;
}

static void file_name(char path[256]) {
    snprintf(path, 256, "%s/%016llx%016llx.levels", directory, (unsigned long long)key.hash.a,
             (unsigned long long)key.hash.b);
}

static unsigned char *read_all(size_t *size) {
    char path[256];
    static unsigned char bytes[4096];
    file_name(path);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    *size = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    return bytes;
}

static void write_all(const void *bytes, size_t size) {
    char path[256];
    file_name(path);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

static void assert_refused(void) {
    ss_mesh_levels read;
    log_lines = 0;
    assert_false(ss_cache_load(directory, &key, &read, &host));
    assert_int_equal(read.count, 0);
    assert_null(read.level[0].vertices);
    assert_int_equal(log_lines, 1);
}

static void damage_is_noticed(void **unused) {
    (void)unused;
    ss_mesh_levels made = levels_by_hand(), read;
    log_lines = 0;
    assert_false(ss_cache_load(directory, &key, &read, &host)); /* no file: nothing to say */
    assert_int_equal(log_lines, 0);
    ss_cache_save(directory, &key, &made, &host);
    assert_true(ss_cache_load(directory, &key, &read, &host));
    assert_int_equal(log_lines, 0);
    assert_same(&made, &read);
    ss_mesh_levels_free(&read);

    size_t size;
    unsigned char good[4096], *bytes = read_all(&size);
    memcpy(good, bytes, size);
    for (size_t i = 0; i < size; i++) { /* every bit of every byte */
        for (int bit = 0; bit < 8; bit++) {
            memcpy(bytes, good, size);
            bytes[i] ^= (unsigned char)(1 << bit);
            write_all(bytes, size);
            assert_refused();
        }
    }
    for (size_t length = 0; length < size; length++) {
        write_all(good, length);
        assert_refused();
    }
    memcpy(bytes, good, size), memset(bytes + size, 0, 16);
    write_all(bytes, size + 1);
    assert_refused();
    write_all(bytes, size + 16);
    assert_refused();
    memset(bytes, 0, size);
    write_all(bytes, size);
    assert_refused();
    write_all(good, size);
    assert_true(ss_cache_load(directory, &key, &read, &host));
    ss_mesh_levels_free(&read);
    ss_mesh_levels_free(&made);
    files(true);
}

/* A forged file: the hash is right, the content is not. */
static void forge(const unsigned char *good, size_t size, size_t at, const void *value, size_t n) {
    unsigned char bytes[4096];
    ss_hash hash = {0};
    memcpy(bytes, good, size);
    memcpy(bytes + at, value, n);
    ss_hash_add(&hash, bytes, size - sizeof hash);
    memcpy(bytes + size - sizeof hash, &hash, sizeof hash);
    write_all(bytes, size);
}

static void content_is_checked(void **unused) {
    (void)unused;
    ss_mesh_levels made = levels_by_hand(), read;
    ss_cache_save(directory, &key, &made, &host);
    size_t size;
    unsigned char good[4096];
    memcpy(good, read_all(&size), sizeof good);
    const size_t counts = 48, vertices = counts + SS_LEVELS_MOST * 32, indices = vertices + 5 * 12;
    const uint32_t five = 5, two = 2, four = 4, many = SS_LEVELS_MOST + 1;
    const float nan = NAN, large = 1e20f;
    const double bad = NAN, negative = -1, rms = .5;
    const uint64_t huge = UINT64_MAX / 12, none = 0;
    forge(good, size, indices + 4, &four, 4); /* allowed: proves that forging works */
    assert_true(ss_cache_load(directory, &key, &read, &host));
    ss_mesh_levels_free(&read);
    forge(good, size, indices, &five, 4), assert_refused(); /* out of range */
    forge(good, size, indices, &two, 4), assert_refused();  /* a corner twice */
    forge(good, size, vertices, &nan, 4), assert_refused();
    forge(good, size, vertices + 8, &large, 4), assert_refused();
    forge(good, size, counts, &huge, 8), assert_refused();
    forge(good, size, counts, &none, 8), assert_refused();
    forge(good, size, counts + 8, &huge, 8), assert_refused();
    forge(good, size, counts + 8, &none, 8), assert_refused();
    forge(good, size, counts + 16, &bad, 8), assert_refused();
    forge(good, size, counts + 16, &negative, 8), assert_refused();
    forge(good, size, counts + 16, &rms, 8), assert_refused(); /* above the largest */
    forge(good, size, counts + 24, &bad, 8), assert_refused();
    forge(good, size, 12, &many, 4), assert_refused(); /* levels */
    ss_mesh_levels_free(&made);
    files(true);
}

static void odd_files(void **unused) {
    (void)unused;
    char path[256];
    file_name(path);
    assert_int_equal(mkdir(path, 0700), 0);
    assert_refused();
    rmdir(path);
    assert_int_equal(mkfifo(path, 0600), 0); /* opening it must not wait for a writer */
    assert_refused();
    unlink(path);
    ss_mesh_levels made = levels_by_hand(), read;
    log_lines = 0;
    ss_cache_save("/dev/null/nowhere", &key, &made, &host);
    assert_int_equal(log_lines, 1);
    assert_non_null(strstr(last_line, "/dev/null/nowhere"));
    assert_false(ss_cache_load("/dev/null/nowhere", &key, &read, &host));
    ss_mesh_levels_free(&made);
    assert_int_equal(files(true), 0);
}

/* A build heals what is damaged. */
static void damaged_is_made_again(void **unused) {
    (void)unused;
    shape sphere = shape_sphere(40, .1);
    setenv("SOFTSHADOW_CACHE", directory, 1);
    built a = build_shape(&sphere);
    DIR *open = opendir(directory);
    char path[512] = "";
    for (struct dirent *entry; (entry = readdir(open));) {
        if (entry->d_name[0] != '.') snprintf(path, sizeof path, "%s/%s", directory, entry->d_name);
    }
    closedir(open);
    assert_int_equal(truncate(path, 1000), 0);
    log_lines = 0;
    built b = build_shape(&sphere);
    assert_int_equal(log_lines, 1);
    assert_int_equal(b.levels->cached, 0);
    built c = build_shape(&sphere);
    assert_int_equal(log_lines, 1);
    assert_int_equal(c.levels->cached, 1);
    assert_same(&a.levels->meshes[0], &b.levels->meshes[0]);
    assert_same(&a.levels->meshes[0], &c.levels->meshes[0]);
    unsetenv("SOFTSHADOW_CACHE");
    drop(&a), drop(&b), drop(&c);
    shape_free(&sphere);
    files(true);
}

static int write_and_read(void) {
    ss_mesh_levels made = levels_by_hand();
    for (int i = 0; i < 300; i++) {
        ss_mesh_levels read;
        ss_cache_save(directory, &key, &made, &host);
        if (!ss_cache_load(directory, &key, &read, &host) || log_lines) return 1;
        ss_mesh_levels_free(&read);
    }
    ss_mesh_levels_free(&made);
    return 0;
}

static void writers_at_once(void **unused) {
    (void)unused;
    pid_t child[4];
    log_lines = 0;
    for (int i = 0; i < 4; i++) {
        child[i] = fork();
        if (child[i] == 0) _exit(write_and_read());
        assert_true(child[i] > 0);
    }
    for (int i = 0; i < 4; i++) {
        int status;
        assert_int_equal(waitpid(child[i], &status, 0), child[i]);
        assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    }
    assert_int_equal(files(true), 1);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sphere_has_three),        cmocka_unit_test(fins_hold_nothing),
        cmocka_unit_test(a_dense_mesh_has_four),
        cmocka_unit_test(sheet_keeps_its_rim),     cmocka_unit_test(none_for_soup_and_small),
        cmocka_unit_test(hostile_meshes),
        cmocka_unit_test(closed_stays_closed),     cmocka_unit_test(moves_with_its_mesh),
        cmocka_unit_test(same_on_any_threads),     cmocka_unit_test(can_be_cancelled),
        cmocka_unit_test(second_build_is_read),    cmocka_unit_test(damage_is_noticed),
        cmocka_unit_test(content_is_checked),      cmocka_unit_test(odd_files),
        cmocka_unit_test(damaged_is_made_again),   cmocka_unit_test(writers_at_once),
    };
    return cmocka_run_group_tests(tests, make_directory, remove_directory);
}
