/* A hundred small scenes of everything a mesh may do wrong - open, non-manifold, flipped,
 * duplicated, degenerate, needles - against the exact area of the union, and in the other
 * weightings against brute force in double; horizons, all lights, and lights that touch the
 * casters. */
#include "property/truth.h"

enum { SCENES = 100, POINTS = 40 };

static softshadow_light light_of(int scene) {
    const softshadow_light lights[] = {
        scene_sphere_light(0.3, -0.2, 6, 1.2),
        scene_disk_light(0, 0, 6, 0.2, 0.1, -1, 1.5),
        scene_sun_light(-0.1, 0.2, -1, 0.25),
        scene_rect_light(0.2, 0, 5.5, 1.5, 0.7),
        scene_sphere_light(0.5, 0.5, 3.5, 0.9), /* among the casters */
        scene_disk_light(0, 0.4, 2.5, 1, 0.2, -0.7, 0.8),
        scene_rect_light(-0.5, 0, 3, 1, 1),
        scene_sun_light(1, 0, -0.7, 0.6),
    };
    return lights[(size_t)scene % COUNT(lights)];
}

/* Points below the casters and, of every fourth scene, among them. */
static void points_of(int scene, double (*points)[3]) {
    uint64_t s = (uint64_t)scene + 1000;
    for (int i = 0; i < POINTS; i++) {
        points[i][0] = scene_uniform(&s, -2, 2);
        points[i][1] = scene_uniform(&s, -2, 2);
        points[i][2] = scene % 4 == 3 ? scene_uniform(&s, 0, 4) : 0;
    }
}

/* All scenes at once: a truth's RMS over four thousand points instead of forty. */
static void pool(ask *all, double *truth, ask *one, const double *one_truth, int scene) {
    const size_t at = (size_t)scene * POINTS;
    memcpy((double *)(uintptr_t)all->points[at], one->points, POINTS * sizeof *one->points);
    memcpy(all->visibility + at, one->visibility, POINTS * sizeof(float));
    memcpy(all->bound + at, one->bound, POINTS * sizeof(float));
    memcpy(truth + at, one_truth, POINTS * sizeof(double));
}

/* A truth costs more than an answer: computed for the first method, kept for the others. */
enum { UNIFORM, HORIZON, WEIGHTED, KINDS };
static double kept[KINDS][SCENES * POINTS];
static bool known[KINDS];

static bool recall(int kind, int scene, double *one) {
    if (known[kind]) memcpy(one, kept[kind] + (size_t)scene * POINTS, POINTS * sizeof *one);
    return known[kind];
}

static void keep(int kind, const double *truth, size_t count) {
    memcpy(kept[kind], truth, count * sizeof *truth);
    known[kind] = true;
}

static ask new_pool(const char *method, size_t scenes, double **truth) {
    ask all = ask_new(method, NULL, light_of(0), calloc(scenes * POINTS, 3 * sizeof(double)),
                      scenes * POINTS, 0);
    all.visibility = calloc(all.count, sizeof(float));
    all.bound = calloc(all.count, sizeof(float));
    *truth = calloc(all.count, sizeof(double));
    return all;
}

static void free_pool(ask *all, double *truth) {
    free((void *)(uintptr_t)all->points);
    free(truth);
    ask_free(all);
}

static void judge_pool(ask *all, double *truth, const char *what, double slack) {
    /* The worst of thousands of points of scenes with a dozen edges before the light at once: twice
     * the 1/64 of a single edge. The certified bound holds at every one of them. */
    const double max = ask_noise_free(all->method) ? 2.0 / 64 : truth_max(all->method);
    ask_compare(all, truth, what, 1.0 / 256, max, slack + 1e-6);
    free_pool(all, truth);
}

static void uniform_against_exact_areas(void **state) {
    double *truth, points[POINTS][3], one[POINTS];
    ask all = new_pool(*state, SCENES, &truth);
    for (int scene = 0; scene < SCENES; scene++) {
        scene_mesh mesh = {0};
        scene_garbage(&mesh, (uint64_t)scene);
        points_of(scene, points);
        ask q = ask_new(*state, &mesh, light_of(scene), (const double(*)[3])points, POINTS,
                        truth_samples(*state));
        ask_do(&q);
        const bool had = recall(UNIFORM, scene, one);
        for (int i = 0; i < POINTS && !had; i++) {
            one[i] = oracle_union(&mesh, &q.light, points[i], NULL);
        }
        pool(&all, truth, &q, one, scene);
        ask_free(&q);
        scene_free(&mesh);
    }
    keep(UNIFORM, truth, all.count);
    judge_pool(&all, truth, "100 scenes", 0);
}

static void horizons_against_exact_areas(void **state) {
    double *truth, points[POINTS][3], one[POINTS];
    float normals[POINTS][3];
    ask all = new_pool(*state, SCENES / 4, &truth);
    for (int scene = 0; scene < SCENES / 4; scene++) {
        scene_mesh mesh = {0};
        scene_garbage(&mesh, (uint64_t)scene + 500);
        points_of(scene, points);
        uint64_t s = (uint64_t)scene;
        ask q = ask_new(*state, &mesh, light_of(scene), (const double(*)[3])points, POINTS,
                        truth_samples(*state));
        const bool had = recall(HORIZON, scene, one);
        for (int i = 0; i < POINTS; i++) {
            double n[3];
            scene_direction(&s, n);
            for (int k = 0; k < 3; k++)
                normals[i][k] = (float)(n[k] * (i % 3 + 0.5)); /* any length */
            for (int k = 0; k < 3; k++) n[k] = normals[i][k];
            if (!had) one[i] = oracle_union(&mesh, &q.light, points[i], n);
        }
        q.normals = (const float(*)[3])normals;
        ask_do(&q);
        pool(&all, truth, &q, one, scene);
        ask_free(&q);
        scene_free(&mesh);
    }
    keep(HORIZON, truth, all.count);
    judge_pool(&all, truth, "25 scenes with horizons", 0);
}

static void weightings_against_brute_force(void **state) {
    static const float profile[] = {1, 0.9f, 0.7f, 0.3f};
    double *truth, points[POINTS][3], one[POINTS];
    float normals[POINTS][3];
    ask all = new_pool(*state, SCENES / 5, &truth);
    for (int scene = 0; scene < SCENES / 5; scene++) {
        scene_mesh mesh = {0};
        scene_garbage(&mesh, (uint64_t)scene + 900);
        points_of(scene, points);
        uint64_t s = (uint64_t)scene;
        ask q = ask_new(*state, &mesh, light_of(scene), (const double(*)[3])points, POINTS,
                        truth_samples(*state));
        q.build.weighting = scene % 2 ? SOFTSHADOW_IRRADIANCE : SOFTSHADOW_SOLID_ANGLE;
        if (scene % 3 == 0 && q.light.type != SOFTSHADOW_RECT) {
            q.light.profile = profile, q.light.profile_count = 4;
        }
        const bool had = recall(WEIGHTED, scene, one);
        for (int i = 0; i < POINTS; i++) {
            double n[3] = {scene_uniform(&s, -0.4, 0.4), scene_uniform(&s, -0.4, 0.4), 1};
            for (int k = 0; k < 3; k++) normals[i][k] = (float)n[k];
            for (int k = 0; k < 3; k++) n[k] = normals[i][k];
            if (had) continue;
            one[i] = oracle_brute(&mesh, &q.light, points[i], n, q.build.weighting, 16384);
        }
        q.normals = (const float(*)[3])normals;
        ask_do(&q);
        pool(&all, truth, &q, one, scene);
        ask_free(&q);
        scene_free(&mesh);
    }
    /* Brute force with 128 x 128 cells: the oracles' own test finds 2e-4 RMS, at most ten times
     * that. */
    keep(WEIGHTED, truth, all.count);
    judge_pool(&all, truth, "20 scenes, weighted", 2e-3);
}

int main(void) {
    const ask_test tests[] = {
        {"uniform, against exact areas", uniform_against_exact_areas, ask_truthful},
        {"horizons, against exact areas", horizons_against_exact_areas, ask_truthful},
        {"weightings and profiles, against brute force", weightings_against_brute_force,
         ask_truthful},
    };
    return ask_run("random scenes", tests, COUNT(tests));
}
