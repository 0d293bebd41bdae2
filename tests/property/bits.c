/* What must not change a single bit: how a scene is scaled (by powers of two), moved (exactly),
 * named (axes) or stored, and how a batch is split, ordered and shared out among threads. Holds for
 * every method; `auto` may answer otherwise where the batch itself is another (ABI, promise 2). */
#include <pthread.h>

#include "property/truth.h"

enum { SIDE = 32, N = SIDE * SIDE, SAMPLES = 256 };

/* Coordinates of 14 bits, so that every move below is exact in double and in float. */
typedef struct setting {
    scene_mesh mesh;
    double (*points)[3];
    float (*normals)[3];
    softshadow_light lights[4];
} setting;

static setting new_setting(void) {
    setting out = {.points = malloc(N * sizeof *out.points),
                   .normals = malloc(N * sizeof *out.normals)};
    scene_garbage(&out.mesh, 31);
    scene_box(&out.mesh, (const double[3]){-1, -1, 1}, (const double[3]){0.5, 0.25, 2});
    for (size_t i = 0; i < 3 * out.mesh.vertices; i++) {
        out.mesh.xyz[i] = round(out.mesh.xyz[i] * 1024) / 1024;
    }
    scene_grid(out.points, SIDE, -2, 2, -2, 2, 0);
    uint64_t s = 9;
    for (int i = 0; i < N; i++) {
        out.points[i][2] = round(scene_uniform(&s, -0.5, 0.25) * 1024) / 1024;
        for (int k = 0; k < 3; k++) out.normals[i][k] = k == 2 ? 1 : (float)(i % (k + 3)) / 8;
    }
    /* Off the grid: where two components of a direction are equal, exchanging the axes leaves it as
     * it is but turns any sample set over, and no choice of frame can be the same. */
    const double x = 0.25 + 0x3p-10, y = 0.5 + 0x7p-11;
    out.lights[0] = scene_rect_light(x, y, 8, 1.5, 1);
    out.lights[1] = scene_disk_light(x, y, 8, 0.125, 0.25, -1, 1.25);
    out.lights[2] = scene_sphere_light(x, y, 8, 1.25);
    out.lights[3] = scene_sun_light(0.125, 0.0625, -1, 0.15);
    return out;
}

static void free_setting(setting *s) {
    scene_free(&s->mesh);
    free(s->points);
    free(s->normals);
}

static ask answer(const char *method, const setting *s, int light, const double (*points)[3],
                  size_t n) {
    ask q = ask_new(method, &s->mesh, s->lights[light], points, n, SAMPLES);
    q.normals = (const float(*)[3])s->normals;
    return q;
}

/* Everything x -> scale x[axis] + move, into a new setting. */
static setting moved(const setting *s, double scale, const double move[3], const int axis[3]) {
    setting out = {.mesh = scene_copy(&s->mesh),
                   .points = malloc(N * sizeof *out.points),
                   .normals = malloc(N * sizeof *out.normals)};
    double m[12] = {0};
    for (int k = 0; k < 3; k++) m[4 * k + axis[k]] = scale, m[4 * k + 3] = move[k];
    scene_transform(&out.mesh, m);
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < 3; k++) {
            out.points[i][k] = scale * s->points[i][axis[k]] + move[k];
            out.normals[i][k] = s->normals[i][axis[k]];
        }
    }
    for (int i = 0; i < 4; i++) {
        softshadow_light *l = &out.lights[i];
        *l = s->lights[i];
        for (int k = 0; k < 3; k++) {
            l->position[k] = scale * s->lights[i].position[axis[k]] + move[k];
            l->direction[k] = s->lights[i].direction[axis[k]];
            l->u[k] = scale * s->lights[i].u[axis[k]];
            l->v[k] = scale * s->lights[i].v[axis[k]];
        }
        if (l->type != SOFTSHADOW_SUN) l->radius *= scale;
    }
    return out;
}

static void check_moved(const char *method, double scale, const double move[3], const int axis[3],
                        const char *what) {
    setting s = new_setting(), t = moved(&s, scale, move, axis);
    for (int light = 0; light < 4; light++) {
        ask a = answer(method, &s, light, (const double(*)[3])s.points, N);
        ask b = answer(method, &t, light, (const double(*)[3])t.points, N);
        ask_do(&a), ask_do(&b);
        char label[96];
        snprintf(label, sizeof label, "%s, light %d", what, light);
        ask_same_bits(a.visibility, b.visibility, N, label);
        if (axis[0] == 0 && axis[1] == 1) ask_same_bits(a.bound, b.bound, N, label);
        ask_free(&a), ask_free(&b);
    }
    free_setting(&s), free_setting(&t);
}

static const int same_axes[3] = {0, 1, 2};
static const double nowhere[3] = {0, 0, 0};

static void powers_of_two(void **state) {
    static const int k[] = {-20, -19, -13, -7, -1, 1, 2, 10, 20};
    for (size_t i = 0; i < COUNT(k); i++) {
        char what[32];
        snprintf(what, sizeof what, "scale 2^%d", k[i]);
        check_moved(*state, ldexp(1, k[i]), nowhere, same_axes, what);
    }
}

static void exact_translations(void **state) {
    static const double move[][3] = {
        {0.5, -0.25, 0.125}, {1024, -4096, 512}, {1e6, 1e6, -1e6}, {123456.5, -7, 1e9}};
    for (size_t i = 0; i < COUNT(move); i++) {
        char what[64];
        snprintf(what, sizeof what, "moved by %g %g %g", move[i][0], move[i][1], move[i][2]);
        check_moved(*state, 1, move[i], same_axes, what);
    }
}

static void axes(void **state) {
    static const int axis[][3] = {{1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {1, 0, 2}, {2, 1, 0}};
    for (size_t i = 0; i < COUNT(axis); i++) {
        char what[32];
        snprintf(what, sizeof what, "axes %d %d %d", axis[i][0], axis[i][1], axis[i][2]);
        check_moved(*state, 1, nowhere, axis[i], what);
    }
}

/* ---- Batches
 * ------------------------------------------------------------------------------------*/

static void point_order(void **state) {
    setting s = new_setting();
    setting t = moved(&s, 1, nowhere, same_axes);
    size_t *place = malloc(N * sizeof *place);
    uint64_t random = 4;
    for (size_t i = 0; i < N; i++) place[i] = i;
    for (size_t i = N; i-- > 1;) {
        const size_t k = scene_random(&random) % (i + 1), kept = place[i];
        place[i] = place[k], place[k] = kept;
    }
    for (size_t i = 0; i < N; i++) {
        memcpy(t.points[i], s.points[place[i]], sizeof *t.points);
        memcpy(t.normals[i], s.normals[place[i]], sizeof *t.normals);
    }
    ask a = answer(*state, &s, 2, (const double(*)[3])s.points, N);
    ask b = answer(*state, &t, 2, (const double(*)[3])t.points, N);
    ask_do(&a), ask_do(&b);
    ask back = answer(*state, &s, 2, (const double(*)[3])s.points, N);
    back.visibility = calloc(N, sizeof(float)), back.bound = calloc(N, sizeof(float));
    for (size_t i = 0; i < N; i++) {
        back.visibility[place[i]] = b.visibility[i], back.bound[place[i]] = b.bound[i];
    }
    if (ask_auto(*state))
        ask_same_truth(&a, &back, "point order");
    else
        ask_same_bits(a.visibility, back.visibility, N, "point order");
    ask_free(&a), ask_free(&b), ask_free(&back);
    free(place);
    free_setting(&s), free_setting(&t);
}

static void batch_splits(void **state) {
    setting s = new_setting();
    ask whole = answer(*state, &s, 1, (const double(*)[3])s.points, N);
    softshadow *handle = ask_handle(&whole);
    ask_query(handle, &whole);
    static const size_t size[] = {1, 7, 64, 333};
    for (size_t k = 0; k < COUNT(size); k++) {
        ask parts = whole;
        parts.visibility = calloc(N, sizeof(float)), parts.bound = calloc(N, sizeof(float));
        for (size_t at = 0; at < N; at += size[k]) {
            ask part = whole;
            part.points += at, part.normals += at;
            part.count = N - at < size[k] ? N - at : size[k];
            part.visibility = parts.visibility + at, part.bound = parts.bound + at;
            ask_query(handle, &part);
        }
        char what[32];
        snprintf(what, sizeof what, "batches of %zu", size[k]);
        if (ask_auto(*state))
            ask_same_truth(&whole, &parts, what);
        else
            ask_same_bits(whole.visibility, parts.visibility, N, what);
        ask_free(&parts);
    }
    softshadow_destroy(handle);
    ask_free(&whole);
    free_setting(&s);
}

/* A place on a face or, for every seventh, its edge, moved by `lift` along the normal. */
static void place_on(const scene_mesh *mesh, size_t face, double lift, uint64_t *random,
                     double p[3]) {
    const uint32_t *v = mesh->indices + 3 * face;
    const double *a = mesh->xyz + 3 * (size_t)v[0];
    const double u = face % 7 ? scene_uniform(random, 0, 1) : 0;
    const double w = scene_uniform(random, 0, 1 - u);
    double e[3], f[3], n[3], square = 0;
    for (int k = 0; k < 3; k++) {
        e[k] = mesh->xyz[3 * (size_t)v[1] + (size_t)k] - a[k];
        f[k] = mesh->xyz[3 * (size_t)v[2] + (size_t)k] - a[k];
    }
    for (int k = 0; k < 3; k++) {
        n[k] = e[(k + 1) % 3] * f[(k + 2) % 3] - e[(k + 2) % 3] * f[(k + 1) % 3];
        square += n[k] * n[k];
    }
    for (int k = 0; k < 3; k++) p[k] = a[k] + u * e[k] + w * f[k] + lift * n[k] / sqrt(square);
}

/* Points on solids, where many in a row see nothing: what has told one of them may be tried on the
 * next, which must not show. A point that is asked alone has none before it. */
static void points_on_solids(void **state) {
    static const double lift[] = {0, 1e-6, 4e-4, 1e-2, -1e-5};
    const softshadow_light lights[] = {scene_sphere_light(2, 1, 6, 0.75),
                                       scene_rect_light(-1, 0.5, 5, 1.5, 1)};
    scene_mesh mesh = {0};
    scene_spheres(&mesh, 3);
    scene_box(&mesh, (const double[3]){-3, -3, -2}, (const double[3]){3, 3, -1.5});
    const size_t n = mesh.triangles;
    double(*points)[3] = malloc(n * sizeof *points);
    uint64_t random = 11;
    for (size_t i = 0; i < n; i++) place_on(&mesh, i, lift[i % COUNT(lift)], &random, points[i]);
    for (size_t l = 0; l < COUNT(lights); l++) {
        ask all = ask_new(*state, &mesh, lights[l], (const double(*)[3])points, n, SAMPLES);
        all.unbounded = true; /* bounds need all of the faces */
        softshadow *handle = ask_handle(&all);
        ask_query(handle, &all);
        ask alone = all;
        alone.visibility = calloc(n, sizeof(float)), alone.bound = calloc(n, sizeof(float));
        size_t dark = 0;
        for (size_t i = 0; i < n; i++) {
            ask one = alone;
            one.points += i, one.count = 1, one.visibility += i, one.bound += i;
            ask_query(handle, &one);
            dark += alone.visibility[i] == 0;
        }
        CHECK(4 * dark > n, "%zu of %zu points see nothing", dark, n);
        ask_same_bits(all.visibility, alone.visibility, n, "points on solids");
        softshadow_destroy(handle);
        ask_free(&all), ask_free(&alone);
    }
    free(points);
    scene_free(&mesh);
}

/* A host's scheduler: on one thread backwards, or on three threads. */
typedef struct range {
    void (*body)(void *ctx, uint64_t begin, uint64_t end);
    void *ctx;
    uint64_t begin, end;
} range;

static void *run_range(void *argument) {
    range *r = argument;
    for (uint64_t i = r->begin; i < r->end; i++) r->body(r->ctx, i, i + 1);
    return NULL;
}

static void backwards(void *user, uint64_t n, void (*body)(void *, uint64_t, uint64_t), void *ctx) {
    ++*(int *)user;
    for (uint64_t i = n; i-- > 0;) body(ctx, i, i + 1);
}

static void on_three(void *user, uint64_t n, void (*body)(void *, uint64_t, uint64_t), void *ctx) {
    __atomic_add_fetch((int *)user, 1, __ATOMIC_RELAXED);
    range r[3];
    pthread_t thread[3];
    for (uint64_t i = 0; i < 3; i++) {
        r[i] = (range){body, ctx, n * i / 3, n * (i + 1) / 3};
        if (pthread_create(&thread[i], NULL, run_range, &r[i]) != 0) abort();
    }
    for (int i = 0; i < 3; i++) pthread_join(thread[i], NULL);
}

static void threads_and_schedulers(void **state) {
    setting s = new_setting();
    for (int light = 0; light < 4; light++) {
        ask one = answer(*state, &s, light, (const double(*)[3])s.points, N);
        one.options.threads = 1;
        ask_do(&one);
        for (int i = 0; i < 5; i++) {
            int calls = 0;
            ask other = answer(*state, &s, light, (const double(*)[3])s.points, N);
            other.options.user = &calls;
            if (i < 3)
                other.options.threads = (const uint32_t[]){0, 2, 7}[i];
            else
                other.options.parallel = i == 3 ? backwards : on_three;
            if (i >= 3) other.options.threads = 3;
            ask_do(&other);
            char what[64];
            snprintf(what, sizeof what, "light %d, schedule %d", light, i);
            ask_same_bits(one.visibility, other.visibility, N, what);
            ask_same_bits(one.bound, other.bound, N, what);
            CHECK(i < 3 || calls > 0, "%s: the host's scheduler was never called", what);
            ask_free(&other);
        }
        ask_free(&one);
    }
    free_setting(&s);
}

/* ---- Storage
 * ------------------------------------------------------------------------------------*/

typedef struct fat {
    float before[2], xyz[3], after;
} fat;

static void types_and_strides(void **state) {
    setting s = new_setting();
    ask a = answer(*state, &s, 3, (const double(*)[3])s.points, N);
    ask_do(&a);
    fat *vertices = calloc(s.mesh.vertices, sizeof *vertices), *points = calloc(N, sizeof *points);
    for (size_t i = 0; i < 3 * s.mesh.vertices; i++) {
        vertices[i / 3].xyz[i % 3] = (float)s.mesh.xyz[i];
    }
    for (size_t i = 0; i < N; i++) {
        for (int k = 0; k < 3; k++) points[i].xyz[k] = (float)s.points[i][k];
    }
    softshadow *handle = NULL;
    OK(NULL, softshadow_create(&handle, NULL));
    softshadow_mesh mesh = ask_mesh(&s.mesh);
    mesh.position_type = SOFTSHADOW_F32;
    mesh.positions = vertices->xyz, mesh.position_stride = sizeof(fat);
    mesh.flags = SOFTSHADOW_BORROW;
    OK(handle, softshadow_add_mesh(handle, &mesh, NULL));
    OK(handle, softshadow_set_light(handle, &s.lights[3]));
    softshadow_build build = a.build;
    build.method = *state;
    OK(handle, softshadow_build_maps(handle, &build));
    softshadow_points batch = SOFTSHADOW_POINTS_INIT;
    batch.positions = points->xyz, batch.position_stride = sizeof(fat), batch.count = N;
    float(*normals)[5] = calloc(N, sizeof *normals);
    for (size_t i = 0; i < N; i++) memcpy(normals[i], s.normals[i], sizeof *s.normals);
    batch.normals = (const float *)normals, batch.normal_stride = sizeof *normals;
    float *v = calloc(N, sizeof *v);
    OK(handle, softshadow_query_visibility(handle, &batch, v));
    ask_same_bits(a.visibility, v, N, "floats with strides, borrowed");
    softshadow_destroy(handle);
    free(normals), free(v), free(vertices), free(points);
    ask_free(&a);
    free_setting(&s);
}

/* Every light of a handle answers as it does alone. */
static void several_lights(void **state) {
    setting s = new_setting();
    ask all = answer(*state, &s, 0, (const double(*)[3])s.points, N);
    softshadow *handle = ask_handle(&all);
    for (int i = 1; i < 4; i++) {
        uint32_t id = 0;
        OK(handle, softshadow_add_light(handle, &s.lights[i], &id));
        CHECK(id == (uint32_t)i, "light %d got id %u", i, id);
    }
    softshadow_build build = all.build;
    build.method = *state;
    OK(handle, softshadow_build_maps(handle, &build));
    float *v = calloc(N, sizeof *v);
    for (uint32_t i = 0; i < 4; i++) {
        ask alone = answer(*state, &s, (int)i, (const double(*)[3])s.points, N);
        ask_do(&alone);
        softshadow_points points = ask_points((const double(*)[3])s.points, N);
        points.normals = (const float *)s.normals;
        points.light = i;
        OK(handle, softshadow_query_visibility(handle, &points, v));
        char what[32];
        snprintf(what, sizeof what, "light %u of 4", i);
        ask_same_bits(alone.visibility, v, N, what);
        ask_free(&alone);
    }
    free(v);
    softshadow_destroy(handle);
    free_setting(&s);
}

/* A matrix of few bits and the mesh it makes; the same mesh in two parts. */
static void transforms_and_parts(void **state) {
    setting s = new_setting();
    ask a = answer(*state, &s, 2, (const double(*)[3])s.points, N);
    ask_do(&a);
    scene_mesh before = scene_copy(&s.mesh); /* x' = 2 y + 1, y' = -4 x, z' = z/2 undone */
    for (size_t i = 0; i < before.vertices; i++) {
        const double *v = s.mesh.xyz + 3 * i;
        double *w = before.xyz + 3 * i;
        w[0] = v[1] / -4, w[1] = (v[0] - 1) / 2, w[2] = v[2] * 2;
    }
    const double matrix[12] = {0, 2, 0, 1, -4, 0, 0, 0, 0, 0, 0.5, 0};
    softshadow *handle = NULL;
    OK(NULL, softshadow_create(&handle, NULL));
    softshadow_mesh mesh = ask_mesh(&before);
    mesh.transform = matrix;
    mesh.triangle_count /= 2;
    OK(handle, softshadow_add_mesh(handle, &mesh, NULL));
    mesh.indices += 3 * mesh.triangle_count;
    mesh.triangle_count = before.triangles - mesh.triangle_count;
    mesh.flags = SOFTSHADOW_CASTS;
    OK(handle, softshadow_add_mesh(handle, &mesh, NULL));
    OK(handle, softshadow_set_light(handle, &s.lights[2]));
    softshadow_build build = a.build;
    build.method = *state;
    OK(handle, softshadow_build_maps(handle, &build));
    ask b = answer(*state, &s, 2, (const double(*)[3])s.points, N);
    ask_query(handle, &b);
    if (ask_auto(*state))
        ask_same_truth(&a, &b, "transformed, in two parts");
    else
        ask_same_bits(a.visibility, b.visibility, N, "transformed, in two parts");
    softshadow_destroy(handle);
    scene_free(&before);
    ask_free(&a), ask_free(&b);
    free_setting(&s);
}

int main(void) {
    const ask_test tests[] = {
        {"scale by powers of two", powers_of_two, NULL},
        {"exact translations", exact_translations, NULL},
        {"permuted axes", axes, ask_truthful},
        {"order of points", point_order, NULL},
        {"splits of a batch", batch_splits, NULL},
        {"points on solids", points_on_solids, ask_noise_free},
        {"threads and the host's scheduler", threads_and_schedulers, NULL},
        {"types, strides, borrowed arrays", types_and_strides, NULL},
        {"several lights", several_lights, NULL},
        {"transforms, meshes in parts", transforms_and_parts, NULL},
    };
    return ask_run("bits", tests, COUNT(tests));
}
