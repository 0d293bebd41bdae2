/* A small path tracer of another make, which asks softshadow for its direct light when the library
 * is there and shoots shadow rays when it is not. Its spheres are spheres, its boxes triangles, and
 * it knows nothing of the library but the header; link with -ldl -lm.
 *
 *     ./06_tinytracer OUT.ppm [SAMPLES [WIDTH [LIBRARY]]]
 *
 * What the eye sees first is one batch of points for each sample of the picture. The unshadowed
 * light of the rectangle is Lambert's formula; times the visible fraction weighted by irradiance it
 * is the direct light, without noise. Light from further bounces keeps its shadow rays. */
#include <dlfcn.h>
#include <math.h>
#include <softshadow.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define PI      3.14159265358979323846
#define BOUNCES 3

typedef struct vec {
    double x, y, z;
} vec;
static vec v(double x, double y, double z) { return (vec){x, y, z}; }
static vec add(vec a, vec b) { return v(a.x + b.x, a.y + b.y, a.z + b.z); }
static vec sub(vec a, vec b) { return v(a.x - b.x, a.y - b.y, a.z - b.z); }
static vec mul(vec a, double s) { return v(a.x * s, a.y * s, a.z * s); }
static vec each(vec a, vec b) { return v(a.x * b.x, a.y * b.y, a.z * b.z); }
static double dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static vec cross(vec a, vec b) {
    return v(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static vec unit(vec a) { return mul(a, 1 / sqrt(dot(a, a))); }

static uint64_t state = 0x853c49e6748fea9bu;
static double chance(void) { /* xorshift64*, 0 <= x < 1 */
    state ^= state >> 12, state ^= state << 25, state ^= state >> 27;
    return (double)((state * 0x2545f4914f6cdd1du) >> 11) * 0x1p-53;
}

/* ---- the scene, as this tracer has it -------------------------------------------------------- */

static const struct ball {
    vec centre;
    double radius;
    vec colour;
} balls[] = {
    {{-1.5, 0.7, 0.3}, 0.7, {0.85, 0.35, 0.25}},
    {{0.1, 0.45, 1.3}, 0.45, {0.9, 0.8, 0.55}},
    {{1.35, 1.75, -0.2}, 0.4, {0.35, 0.55, 0.85}},
};
static const struct box {
    vec low, high, colour;
} boxes[] = {
    {{-60, -1, -60}, {60, 0, 60}, {0.75, 0.75, 0.75}}, /* the floor */
    {{0.8, 0, -0.8}, {1.9, 1.35, 0.3}, {0.5, 0.7, 0.45}},
    {{-0.9, 0, -1.6}, {-0.65, 2.2, -0.2}, {0.7, 0.7, 0.7}},
    {{-0.25, 0, -1.6}, {0, 2.2, -0.2}, {0.7, 0.7, 0.7}},
};
enum { BALLS = sizeof balls / sizeof *balls, BOXES = sizeof boxes / sizeof *boxes };
enum { TRIANGLES = 12 * BOXES };

/* The lamp: centre and half axes; it shines along u x v, down. */
static const vec lamp = {-2.6, 4.2, 1.8}, lamp_u = {0.75, 0, 0.2}, lamp_v = {-0.2, 0, 0.75};
static const vec shine = {34, 31, 27}, sky = {0.10, 0.13, 0.18};

static vec corner[8 * BOXES];
static uint32_t triangle[TRIANGLES][3];

static void make_triangles(void) {
    static const int face[12][3] = {{0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5},
                                    {0, 4, 5}, {0, 5, 1}, {2, 3, 7}, {2, 7, 6},
                                    {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
    for (int b = 0; b < BOXES; b++) {
        const vec l = boxes[b].low, h = boxes[b].high;
        for (int i = 0; i < 8; i++)
            corner[8 * b + i] = v(i & 4 ? h.x : l.x, i & 2 ? h.y : l.y, i & 1 ? h.z : l.z);
        for (int i = 0; i < 36; i++)
            triangle[12 * b + i / 3][i % 3] = (uint32_t)(8 * b + face[i / 3][i % 3]);
    }
}

typedef struct hit {
    double t;
    vec normal, colour;
    int triangle; /* -1: a ball; -2: the lamp */
} hit;

static void meet_ball(const struct ball *ball, vec from, vec way, hit *best) {
    const vec to = sub(ball->centre, from);
    const double b = dot(to, way), root = b * b - dot(to, to) + ball->radius * ball->radius;
    if (root <= 0) return;
    const double t = b - sqrt(root); /* no path begins inside a ball */
    if (t <= 1e-6 || t >= best->t) return;
    *best = (hit){t, unit(sub(mul(way, t), to)), ball->colour, -1};
}

static void meet_triangle(int i, vec from, vec way, hit *best) {
    const vec a = corner[triangle[i][0]];
    const vec p = sub(corner[triangle[i][1]], a), q = sub(corner[triangle[i][2]], a);
    const vec n = cross(p, q), to = sub(a, from), side = cross(way, to);
    const double along = dot(way, n), r = -dot(side, q) / along, s = dot(side, p) / along;
    const double t = dot(to, n) / along;
    if (!(r >= 0 && s >= 0 && r + s <= 1 && t > 1e-6 && t < best->t)) return;
    *best = (hit){t, mul(unit(n), along > 0 ? -1 : 1), boxes[i / 12].colour, i};
}

static hit meet(vec from, vec way, double farthest) {
    hit best = {.t = farthest};
    for (int i = 0; i < BALLS; i++) meet_ball(&balls[i], from, way, &best);
    for (int i = 0; i < TRIANGLES; i++) meet_triangle(i, from, way, &best);
    return best;
}

/* ---- the same for softshadow ----------------------------------------------------------------- */

static struct {
    uint32_t (*version)(void);
    softshadow_status (*create)(softshadow **, const softshadow_options *);
    softshadow_status (*add_mesh)(softshadow *, const softshadow_mesh *, uint32_t *);
    softshadow_status (*set_light)(softshadow *, const softshadow_light *);
    softshadow_status (*build_maps)(softshadow *, const softshadow_build *);
    softshadow_status (*query_visibility)(softshadow *, const softshadow_points *, float *);
    const char *(*last_message)(const softshadow *);
    void (*destroy)(softshadow *);
} ss;

static int load(const char *path) {
    static const struct {
        const char *name;
        void *into;
    } calls[] = {
        {"softshadow_version", &ss.version},
        {"softshadow_create", &ss.create},
        {"softshadow_add_mesh", &ss.add_mesh},
        {"softshadow_set_light", &ss.set_light},
        {"softshadow_build_maps", &ss.build_maps},
        {"softshadow_query_visibility", &ss.query_visibility},
        {"softshadow_last_message", &ss.last_message},
        {"softshadow_destroy", &ss.destroy},
    };
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) return 0;
    for (size_t i = 0; i < sizeof calls / sizeof *calls; i++) {
        void *call = dlsym(library, calls[i].name);
        if (!call) return 0;
        *(void **)calls[i].into = call;
    }
    return ss.version() >= SOFTSHADOW_VERSION && ss.version() / 10000 == SOFTSHADOW_VERSION_MAJOR;
}

/* A ball as triangles inside it: what lies on the ball then lies outside them, never in their
 * shadow by mistake. */
enum { ROUND = 64, RINGS = 32 };
static softshadow_status add_ball(softshadow *s, const struct ball *ball) {
    static vec point[(RINGS + 1) * ROUND];
    static uint32_t index[RINGS * ROUND][2][3];
    for (int j = 0; j <= RINGS; j++) {
        for (int i = 0; i < ROUND; i++) {
            const double a = 2 * PI * i / ROUND, b = PI * j / RINGS;
            const vec out = v(sin(b) * cos(a), cos(b), sin(b) * sin(a));
            const uint32_t here = (uint32_t)(j * ROUND + i),
                           next = (uint32_t)(j * ROUND + (i + 1) % ROUND);
            point[here] = add(ball->centre, mul(out, ball->radius));
            if (j == RINGS) continue;
            const uint32_t both[2][3] = {{here, next, here + ROUND},
                                         {next, next + ROUND, here + ROUND}};
            memcpy(index[here], both, sizeof both);
        }
    }
    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    mesh.position_type = SOFTSHADOW_F64;
    mesh.positions = point;
    mesh.vertex_count = sizeof point / sizeof *point;
    mesh.indices = index[0][0];
    mesh.triangle_count = 2 * RINGS * ROUND;
    return ss.add_mesh(s, &mesh, NULL);
}

static softshadow *hand_over(void) {
    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT; /* id 0: a triangle's number is its primitive */
    mesh.position_type = SOFTSHADOW_F64;
    mesh.positions = corner;
    mesh.vertex_count = 8 * BOXES;
    mesh.indices = triangle[0];
    mesh.triangle_count = TRIANGLES;
    softshadow_light light = SOFTSHADOW_LIGHT_INIT;
    light.type = SOFTSHADOW_RECT;
    memcpy(light.position, &lamp, sizeof lamp);
    memcpy(light.u, &lamp_u, sizeof lamp_u);
    memcpy(light.v, &lamp_v, sizeof lamp_v);
    softshadow_build build = SOFTSHADOW_BUILD_INIT;
    build.weighting = SOFTSHADOW_IRRADIANCE;
    build.tolerance = 1.0 / 64; /* a pixel is the mean of several samples */
    softshadow *s;
    softshadow_status status = ss.create(&s, NULL);
    if (!status) status = ss.add_mesh(s, &mesh, NULL);
    for (int i = 0; i < BALLS && !status; i++) status = add_ball(s, &balls[i]);
    if (!status) status = ss.set_light(s, &light);
    if (!status) status = ss.build_maps(s, &build);
    if (!status) return s;
    fprintf(stderr, "%s\n", ss.last_message(s));
    exit(1);
}

/* ---- direct light ---------------------------------------------------------------------------- */

/* The irradiance of the unshadowed lamp over pi, for radiance 1: Lambert's sum over the edges of
 * what is left of the rectangle above the horizon. */
static double unshadowed(vec at, vec normal) {
    static const int sign[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    if (dot(sub(at, lamp), cross(lamp_u, lamp_v)) <= 0) return 0;
    vec edge[8];
    int n = 0;
    for (int i = 0; i < 4; i++) {
        const int *a = sign[i], *b = sign[(i + 1) % 4];
        const vec p = sub(add(lamp, add(mul(lamp_u, a[0]), mul(lamp_v, a[1]))), at);
        const vec q = sub(add(lamp, add(mul(lamp_u, b[0]), mul(lamp_v, b[1]))), at);
        const double hp = dot(p, normal), hq = dot(q, normal);
        if (hp > 0) edge[n++] = unit(p);
        if ((hp > 0) != (hq > 0)) edge[n++] = unit(add(p, mul(sub(q, p), hp / (hp - hq))));
    }
    double sum = 0;
    for (int i = 0; i < n; i++) {
        const vec a = edge[i], b = edge[(i + 1) % n], c = cross(a, b);
        const double size = sqrt(dot(c, c));
        if (size > 0) sum += atan2(size, dot(a, b)) * dot(c, normal) / size;
    }
    return fabs(sum) / (2 * PI);
}

/* What one shadow ray to a random point of the lamp says of the same, shadows included. */
static double one_ray(vec at, vec normal) {
    const vec on = add(lamp, add(mul(lamp_u, 2 * chance() - 1), mul(lamp_v, 2 * chance() - 1)));
    const vec to = sub(on, at), area = cross(lamp_u, lamp_v);
    const double distance = sqrt(dot(to, to));
    const vec way = mul(to, 1 / distance);
    const double cosines = dot(way, normal) * -dot(way, area) * 4; /* of its area, 4 |u x v| */
    if (dot(way, normal) <= 0 || dot(way, area) >= 0) return 0;
    return meet(at, way, distance).t < distance ? 0 : cosines / (distance * distance * PI);
}

/* ---- paths ----------------------------------------------------------------------------------- */

typedef struct path {
    vec from, way, share; /* of what comes along it, how much reaches the pixel */
    uint32_t pixel;
} path;

typedef struct wave {
    path *paths;
    size_t count;
    vec *at;
    float (*normal)[3], *seen;
    uint64_t *primitive;
} wave;

/* Finds what paths meet: those that leave the scene add the sky, others stand at `at`. */
static void advance(wave *w, int bounce, vec *picture) {
    const vec area = cross(lamp_u, lamp_v);
    size_t kept = 0;
    for (size_t i = 0; i < w->count; i++) {
        path p = w->paths[i];
        const hit h = meet(p.from, p.way, INFINITY);
        const vec to = sub(lamp, p.from);
        const double t = dot(to, area) / dot(p.way, area);
        const vec on = sub(mul(p.way, t), to);
        const int lit = t > 0 && t < h.t && dot(p.way, area) < 0 &&
                        fabs(dot(on, lamp_u)) < dot(lamp_u, lamp_u) &&
                        fabs(dot(on, lamp_v)) < dot(lamp_v, lamp_v);
        if (lit || isinf(h.t)) { /* later bounces have the lamp's light already */
            const vec light = lit ? bounce ? v(0, 0, 0) : shine : sky;
            picture[p.pixel] = add(picture[p.pixel], each(p.share, light));
            continue;
        }
        w->at[kept] = add(p.from, mul(p.way, h.t));
        w->normal[kept][0] = (float)h.normal.x, w->normal[kept][1] = (float)h.normal.y;
        w->normal[kept][2] = (float)h.normal.z;
        w->primitive[kept] = h.triangle >= 0 ? (uint64_t)h.triangle : SOFTSHADOW_NO_PRIMITIVE;
        p.share = each(p.share, h.colour);
        w->paths[kept++] = p;
    }
    w->count = kept;
}

/* Adds the lamp's light where the paths stand. */
static void add_light(wave *w, softshadow *s, vec *picture) {
    if (s) {
        softshadow_points points = SOFTSHADOW_POINTS_INIT;
        points.position_type = SOFTSHADOW_F64;
        points.positions = w->at;
        points.normals = w->normal[0];
        points.primitives = w->primitive;
        points.count = w->count;
        if (ss.query_visibility(s, &points, w->seen)) {
            fprintf(stderr, "%s\n", ss.last_message(s));
            exit(1);
        }
    }
    for (size_t i = 0; i < w->count; i++) {
        const vec normal = v(w->normal[i][0], w->normal[i][1], w->normal[i][2]);
        const double light =
            s ? unshadowed(w->at[i], normal) * (double)w->seen[i] : one_ray(w->at[i], normal);
        vec *pixel = &picture[w->paths[i].pixel];
        *pixel = add(*pixel, mul(each(w->paths[i].share, shine), light));
    }
}

/* Sends each path on, in a direction as likely as its cosine. */
static void scatter(wave *w) {
    for (size_t i = 0; i < w->count; i++) {
        const vec n = v(w->normal[i][0], w->normal[i][1], w->normal[i][2]);
        const double height = 2 * chance() - 1, turn = 2 * PI * chance(),
                     r = sqrt(1 - height * height);
        w->paths[i].way = unit(add(mul(n, 1 + 1e-9), v(r * cos(turn), r * sin(turn), height)));
        w->paths[i].from = w->at[i];
    }
}

static void start(wave *w, int width, int height) {
    const vec eye = v(1.2, 2.9, 7), ahead = unit(sub(v(-0.15, 0.75, 0), eye));
    const vec right = unit(cross(ahead, v(0, 1, 0))), up = cross(right, ahead);
    w->count = (size_t)width * height;
    for (uint32_t i = 0; i < w->count; i++) {
        const double x = (i % (uint32_t)width + chance()) / width - 0.5;
        const double y = 0.5 * height / width - (i / (uint32_t)width + chance()) / width;
        const vec way = unit(add(ahead, mul(add(mul(right, x), mul(up, y)), 0.72)));
        w->paths[i] = (path){eye, way, {1, 1, 1}, i};
    }
}

static int write_picture(const char *name, const vec *picture, int width, int height, int samples) {
    FILE *file = fopen(name, "wb");
    if (!file) return 0;
    fprintf(file, "P6\n%d %d\n255\n", width, height);
    for (int i = 0; i < width * height; i++) {
        const double rgb[3] = {picture[i].x, picture[i].y, picture[i].z};
        for (int k = 0; k < 3; k++) /* brightness as screens take it, about */
            putc((int)(255 * pow(fmin(1, rgb[k] / samples), 1 / 2.2) + 0.5), file);
    }
    return fclose(file) == 0;
}

int main(int argc, char **argv) {
    const int samples = argc > 2 ? atoi(argv[2]) : 16, width = argc > 3 ? atoi(argv[3]) : 480;
    const int height = width * 2 / 3;
    if (argc < 2 || samples < 1 || width < 3 || width > 8192)
        return fprintf(stderr, "usage: %s OUT.ppm [SAMPLES [WIDTH [LIBRARY]]]\n", argv[0]), 2;
    const int there = load(argc > 4 ? argv[4] : "libsoftshadow.so.1");
    const size_t n = (size_t)width * height;
    wave w = {malloc(n * sizeof *w.paths), 0,
              malloc(n * sizeof *w.at),    malloc(n * sizeof *w.normal),
              malloc(n * sizeof *w.seen),  malloc(n * sizeof *w.primitive)};
    vec *picture = calloc(n, sizeof *picture);
    if (!w.paths || !w.at || !w.normal || !w.seen || !w.primitive || !picture) return 1;
    make_triangles();
    softshadow *s = there ? hand_over() : NULL;
    const clock_t begin = clock();
    for (int i = 0; i < samples; i++) {
        start(&w, width, height);
        for (int bounce = 0; bounce < BOUNCES && w.count; bounce++) {
            if (bounce) scatter(&w);
            advance(&w, bounce, picture);
            add_light(&w, bounce ? NULL : s, picture);
        }
    }
    const double seconds = (double)(clock() - begin) / CLOCKS_PER_SEC;
    const int written = write_picture(argv[1], picture, width, height, samples);
    printf("%s: %d samples, direct light from %s, %.2f s of processor time\n", argv[1], samples,
           s ? "softshadow" : "shadow rays", seconds);
    if (s) ss.destroy(s);
    free(w.paths), free(w.at), free(w.normal), free(w.seen), free(w.primitive), free(picture);
    return written ? 0 : 1;
}
