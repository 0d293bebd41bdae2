/* softshadow bench --map-times: what maps cost, part by part, and against what it is to be
 * judged. */
#include "map_times.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"

enum { SIDE = 1024, MOST_REPEATS = BENCH_REPEATS };
#define PATIENCE 1.0 /* seconds: what takes longer is timed once */

/* One of two handles: with one thread, and with the threads asked for. */
enum { ALONE, THREADED, HANDLES };

typedef struct timing {
    const bench_cell *cell;
    const bench_options *options;
    double bounds[6];
    softshadow *handle[HANDLES];
    uint32_t handles;
    peer *peer;
    float *answer;
    cli_error *error;
} timing;

static bool fails(timing *t, int h, const char *method) {
    return cli_fail(t->error, CLI_FAILED, "%s: %s: %s", t->cell->scene->name, method,
                    softshadow_last_message(t->handle[h]));
}

/* Processor time where all is on one processor, what a clock on the wall says where not. */
static double now(const timing *t) { return t->handles == 1 ? bench_clock() : bench_wall(); }

/* After a light that has changed: connectivity is kept, every map is made anew. */
static bool build(timing *t, int h, const char *method, double *seconds) {
    softshadow_build wanted = SOFTSHADOW_BUILD_INIT;
    wanted.method = method, wanted.resolution = SIDE, wanted.bounds = t->bounds;
    if (softshadow_set_light(t->handle[h], &t->cell->light) != SOFTSHADOW_OK)
        return fails(t, h, method);
    const double start = now(t);
    if (softshadow_build_maps(t->handle[h], &wanted) != SOFTSHADOW_OK) return fails(t, h, method);
    *seconds = now(t) - start;
    return true;
}

/* The median of three: maps that have just been built are in no cache. */
static bool ask(timing *t, int h, double *seconds) {
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    double each[3] = {0, 0, 0};
    uint32_t done = 0;
    points.positions = t->cell->points.at, points.count = t->cell->points.count;
    while (done < 3 && each[0] < PATIENCE) {
        const double start = now(t);
        if (softshadow_query_visibility(t->handle[h], &points, t->answer) != SOFTSHADOW_OK)
            return fails(t, h, "query");
        each[done++] = now(t) - start;
    }
    *seconds = bench_median(each, done) / (double)points.count;
    return true;
}

/* ---- One method -----------------------------------------------------------------------------*/

typedef struct turns {
    double build[HANDLES][MOST_REPEATS], query[HANDLES][MOST_REPEATS];
    double depth[MOST_REPEATS], ratio[MOST_REPEATS]; /* of hard's build; of both builds */
    double build_gain[MOST_REPEATS], query_gain[MOST_REPEATS];
} turns;

static bool build_all(timing *t, const char *method, turns *to, uint32_t i) {
    for (uint32_t h = 0; h < t->handles; h++) {
        if (h == ALONE && !build(t, ALONE, "hard", &to->depth[i])) return false;
        if (!build(t, (int)h, method, &to->build[h][i])) return false;
    }
    to->ratio[i] = to->build[ALONE][i] / to->depth[i];
    to->build_gain[i] = to->build[ALONE][i] / to->build[t->handles - 1][i];
    return true;
}

static bool ask_all(timing *t, turns *to, uint32_t i) {
    for (uint32_t h = 0; h < t->handles; h++)
        if (!ask(t, (int)h, &to->query[h][i])) return false;
    to->query_gain[i] = to->query[ALONE][i] / to->query[t->handles - 1][i];
    return true;
}

static bool one_method(timing *t, const char *method) {
    turns all;
    uint32_t n = 0, asked = 0;
    double spent = 0; /* on queries */
    /* once more than is told: the first build finds no memory of its size that is free */
    if (!build_all(t, method, &all, 0)) return false;
    while (n < t->options->repeat && (!n || all.build[ALONE][0] < PATIENCE)) {
        if (!build_all(t, method, &all, n++)) return false;
        if (spent > PATIENCE) continue;
        if (!ask_all(t, &all, asked)) return false;
        spent += all.query[ALONE][asked++] * (double)t->cell->points.count;
    }
    printf("  %-16s %9.2f  %9.2f  %9.2f", method, 1e9 * bench_median(all.query[ALONE], asked),
           1e3 * bench_median(all.build[ALONE], n), bench_median(all.ratio, n));
    if (t->handles > 1) {
        printf("  %8.2f", bench_median(all.query_gain, asked));
        printf(" %5.2f", all.query_gain[asked - 1]);
        printf("  %8.2f", bench_median(all.build_gain, n));
        printf(" %5.2f", all.build_gain[n - 1]);
    }
    printf("\n");
    fflush(stdout);
    return true;
}

static bool listed(const char *list, const char *name) {
    for (const char *at = list; at; at = strchr(at, ',') ? strchr(at, ',') + 1 : NULL)
        if (strcspn(at, ",") == strlen(name) && strncmp(at, name, strlen(name)) == 0) return true;
    return !list;
}

static bool all_methods(timing *t, const char *list) {
    uint32_t count = 0;
    softshadow_method_count(&count);
    printf("  %-16s  ns a point   build ms  x depth map", "method");
    if (t->handles > 1)
        printf("  %u threads: query, best; build, best", t->options->threads);
    printf("\n");
    for (uint32_t i = 0; i < count; i++) {
        softshadow_method method = SOFTSHADOW_METHOD_INIT;
        if (softshadow_method_info(i, &method) != SOFTSHADOW_OK) continue;
        if (method.bound_kind != SOFTSHADOW_BOUND_NONE || !listed(list, method.name)) continue;
        if (!one_method(t, method.name)) return false;
    }
    return true;
}

/* ---- The parts ------------------------------------------------------------------------------*/

/* The directions of the depth map's texels from the light's centre: map[0] - x map[3] and map[1] -
 * y map[3] are planes through it, and the direction is along both. */
static void find_rays(const softshadow_map *map, peer_rays *rays) {
    const double *m = map->matrix;
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        rays->middle[k] = m[i] * m[4 + j] - m[j] * m[4 + i];
        rays->x[k] = m[4 + i] * m[12 + j] - m[4 + j] * m[12 + i];
        rays->y[k] = m[12 + i] * m[j] - m[12 + j] * m[i];
    }
    double ahead = 0;
    for (int k = 0; k < 3; k++) ahead += rays->middle[k] * m[12 + k];
    for (int k = 0; k < 3 && ahead < 0; k++) {
        rays->middle[k] = -rays->middle[k], rays->x[k] = -rays->x[k], rays->y[k] = -rays->y[k];
    }
}

static size_t covered(const float *depth) {
    size_t sum = 0;
    for (size_t i = 0; i < (size_t)SIDE * SIDE; i++) sum += depth[i] < 1e30f;
    return sum;
}

static bool depth_stats(timing *t, double *depth, double *silhouettes, uint64_t *edges) {
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    if (softshadow_get_stats(t->handle[ALONE], &stats) != SOFTSHADOW_OK)
        return fails(t, ALONE, "statistics");
    *depth = stats.depth_seconds, *silhouettes = stats.silhouette_seconds;
    *edges = stats.silhouette_edges;
    return true;
}

/* What the library itself measures is time on the wall: the best is what it takes undisturbed. */
static double least(const double *values, uint32_t n) {
    double best = values[0];
    for (uint32_t i = 1; i < n; i++) best = fmin(best, values[i]);
    return best;
}

/* What a depth map costs whoever draws it: all vertices by the map's matrix, as the library takes
 * them, in double. */
static double transform(const softshadow_map *map, const peer_mesh *mesh, float (*out)[3]) {
    const double *m = map->matrix, start = bench_clock();
    for (size_t v = 0; v < mesh->vertex_count; v++) {
        const float *p = mesh->positions + 3 * v;
        double c[4];
        for (int i = 0; i < 4; i++)
            c[i] = m[4 * i] * p[0] + m[4 * i + 1] * p[1] + m[4 * i + 2] * p[2] + m[4 * i + 3];
        for (int i = 0; i < 3; i++) out[v][i] = (float)(c[i] / c[3]);
    }
    return bench_clock() - start;
}

/* In turns: the library's depth map, and the same picture by packets of Embree's rays. */
static bool depth_map(timing *t) {
    const uint32_t n = t->options->repeat;
    const peer_mesh *mesh = &t->cell->scene->mesh;
    double ours[MOST_REPEATS], all[MOST_REPEATS], theirs[MOST_REPEATS], ratio[MOST_REPEATS], unused;
    double moved[MOST_REPEATS];
    uint64_t edges;
    size_t mine = 0, other = 0;
    peer_rays rays = {.side = SIDE};
    softshadow_map map = SOFTSHADOW_MAP_INIT;
    float *picture = malloc((size_t)SIDE * SIDE * sizeof *picture);
    float(*vertices)[3] = malloc(mesh->vertex_count * sizeof *vertices);
    bool fine = (picture && vertices) || cli_fail(t->error, CLI_FAILED, "memory ran out");
    memcpy(rays.origin, t->cell->light.position, sizeof rays.origin);
    for (uint32_t i = 0; i < n && fine; i++) {
        fine = build(t, ALONE, "hard", &all[i]) && depth_stats(t, &ours[i], &unused, &edges) &&
               (softshadow_get_map(t->handle[ALONE], 0, &map) == SOFTSHADOW_OK ||
                fails(t, ALONE, "hard"));
        if (!fine) break;
        mine = covered(map.pixels);
        moved[i] = transform(&map, mesh, vertices);
        find_rays(&map, &rays);
        const double start = bench_clock();
        peer_depth(t->peer, &rays, picture);
        theirs[i] = bench_clock() - start, ratio[i] = all[i] / theirs[i];
        other = covered(picture);
    }
    if (fine) {
        const double best = 1e3 * least(ours, n), turned = 1e3 * least(moved, n);
        printf("  depth map       %8.2f ms at best: %.2f to take vertices there, %.2f to draw\n", best,
               turned, best - turned);
        printf(
            "  hard            %8.2f ms for all of its build, Embree's packets %.2f for the same "
            "picture: %.2f of that; texels covered: %zu, %zu\n",
            1e3 * bench_median(all, n), 1e3 * bench_median(theirs, n), bench_median(ratio, n), mine,
            other);
    }
    free(picture), free(vertices);
    return fine;
}

static bool silhouettes(timing *t) {
    const uint32_t n = t->options->repeat;
    double seconds[MOST_REPEATS] = {0}, unused;
    uint64_t edges = 0;
    for (uint32_t i = 0; i < n; i++) {
        if (!build(t, ALONE, "penumbra-map", &unused) ||
            !depth_stats(t, &unused, &seconds[i], &edges))
            return false;
    }
    printf("  silhouettes     %8.2f ms at best after connectivity: %llu edges\n",
           1e3 * least(seconds, n), (unsigned long long)edges);
    return true;
}

bool bench_map_times(const bench_cell *cell, const bench_options *options, const char *methods,
                     cli_error *error) {
    timing t = {.cell = cell, .options = options, .error = error};
    t.handles = options->threads > 1 ? 2 : 1;
    bench_points_box(&cell->points, t.bounds);
    printf("\n%s: %zu triangles, %s light, maps of %d x %d, %zu points\n", cell->scene->name,
           cell->scene->mesh.triangle_count, cell->light_name, SIDE, SIDE, cell->points.count);
    t.answer = malloc(cell->points.count * sizeof *t.answer);
    bool fine = t.answer || cli_fail(error, CLI_FAILED, "memory ran out");
    for (uint32_t h = 0; h < t.handles && fine; h++) {
        double unused;
        fine = bench_open(cell, h ? options->threads : 1, &t.handle[h], error) &&
               build(&t, (int)h, "penumbra-limit", &unused); /* connectivity, once */
    }
    fine = fine && peer_create(&t.peer, &cell->scene->mesh, false, error);
    const bool placed = cell->light.type != SOFTSHADOW_SUN;
    fine = fine && (!placed || depth_map(&t)) && silhouettes(&t) && all_methods(&t, methods);
    for (uint32_t h = 0; h < t.handles; h++) softshadow_destroy(t.handle[h]);
    peer_destroy(t.peer);
    free(t.answer);
    return fine;
}
