/* picture.c - the bands: rays, visibility, shading. */
#include "picture.h"

#include <stdlib.h>
#include <string.h>

#include "shade.h"

enum {
    BAND_RAYS = 1 << 20, /* rays in flight: some 60 MB */
    TILE = 8             /* points of one tile are near each other, which rays like */
};

/* In radii of the scene from its centre: where the ground begins to fade, and is gone. */
static const double fade_from = 1.5, fade_to = 9;

/* What the rays of a band met. */
typedef struct band {
    raster_band rays;
    size_t count;
    uint32_t *ray; /* number of the ray within the band */
    double *position;
    float *normal;
    uint64_t *primitive;
    float *visibility; /* light after light */
} band;

static bool no_memory(cli_error *error) { return cli_fail(error, CLI_FAILED, "memory ran out"); }

static bool band_make(band *b, const picture *p) {
    const uint32_t rows = p->band_rows;
    const size_t room = (size_t)p->width * p->aa * rows * p->aa;
    *b = (band){
        .rays = {.width = p->width * p->aa, .height = p->height * p->aa, .rows = rows * p->aa}};
    b->rays.hits = malloc(room * sizeof *b->rays.hits);
    b->ray = malloc(room * sizeof *b->ray);
    b->position = malloc(room * 3 * sizeof *b->position);
    b->normal = malloc(room * 3 * sizeof *b->normal);
    b->primitive = malloc(room * sizeof *b->primitive);
    b->visibility = malloc(room * p->build->light_count * sizeof *b->visibility);
    return b->rays.hits && b->ray && b->position && b->normal && b->primitive && b->visibility;
}

static void band_free(band *b) {
    void *const owned[] = {b->rays.hits, b->ray,       b->position,
                           b->normal,    b->primitive, b->visibility};
    for (size_t i = 0; i < sizeof owned / sizeof *owned; i++) free(owned[i]);
}

/* Where a ray meets its triangle, and which way that faces: towards the eye, as both sides are. */
static void take_hit(band *b, const picture *p, uint32_t column, uint32_t row) {
    const uint32_t number = row * b->rays.width + column;
    const raster_hit hit = b->rays.hits[number];
    if (hit.surface == RASTER_NONE) return;
    const raster_surface *surface = &p->surfaces[hit.surface];
    const vector ray =
        raster_ray(&p->camera, b->rays.width, b->rays.height, column, b->rays.first_row + row);
    double weight[3];
    raster_weights(surface, hit.triangle, ray, weight);
    vector at = {0, 0, 0};
    for (int i = 0; i < 3; i++) {
        const uint32_t corner = surface->indices[3 * (size_t)hit.triangle + (size_t)i];
        at = vector_add(
            at, vector_scale(vector_of(surface->positions + 3 * (size_t)corner), weight[i]));
    }
    const facing *n = &p->normals[hit.surface];
    const vector face = normals_flat(n, hit.triangle);
    vector normal = n->around ? normals_smooth(n, surface, hit.triangle, weight) : face;
    if (vector_dot(face, vector_sub(p->camera.eye, at)) < 0) normal = vector_scale(normal, -1);
    const size_t i = b->count++;
    b->ray[i] = number;
    memcpy(b->position + 3 * i, (double[]){at.x, at.y, at.z}, 3 * sizeof(double));
    memcpy(b->normal + 3 * i, (float[]){(float)normal.x, (float)normal.y, (float)normal.z},
           3 * sizeof(float));
    b->primitive[i] = hit.surface == p->ground ? SOFTSHADOW_NO_PRIMITIVE
                                               : (uint64_t)hit.surface << 32 | hit.triangle;
}

static void gather(band *b, const picture *p) {
    const uint32_t width = b->rays.width, rows = b->rays.rows;
    b->count = 0;
    for (uint32_t y = 0; y < rows; y += TILE)
        for (uint32_t x = 0; x < width; x += TILE)
            for (uint32_t row = y; row < y + TILE && row < rows; row++)
                for (uint32_t column = x; column < x + TILE && column < width; column++)
                    take_hit(b, p, column, row);
}

static softshadow_points points_of(const double *positions, const float *normals,
                                   const uint64_t *primitives, size_t count) {
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    points.position_type = SOFTSHADOW_F64;
    points.positions = positions;
    points.normals = normals;
    points.primitives = primitives;
    points.count = count;
    return points;
}

static bool ask(band *b, cli_scene *scene, cli_error *error) {
    softshadow_points points = points_of(b->position, b->normal, b->primitive, b->count);
    for (uint32_t light = 0; light < scene->light_count; light++) {
        points.light = light;
        const softshadow_status status =
            softshadow_query_visibility(scene->handle, &points, b->visibility + light * b->count);
        if (status != SOFTSHADOW_OK) return cli_scene_fail(scene, status, NULL, error);
    }
    return true;
}

/* How much of the ground is left so far out. */
static double ground_left(const picture *p, vector at) {
    const double t =
        (vector_length(vector_sub(at, p->centre)) / p->radius - fade_from) / (fade_to - fade_from);
    if (t <= 0) return 1;
    return t >= 1 ? 0 : (1 - t) * (1 - t) * (1 + 2 * t);
}

/* Adds one ray's light to its pixel. */
static void shade(const band *b, picture *p, size_t i, size_t pixel) {
    const uint32_t lights = p->build->light_count;
    const vector at = vector_of(b->position + 3 * i);
    const vector normal = {b->normal[3 * i], b->normal[3 * i + 1], b->normal[3 * i + 2]};
    const bool is_ground = b->primitive[i] == SOFTSHADOW_NO_PRIMITIVE;
    const double part = 1.0 / (p->aa * p->aa), alpha = is_ground ? ground_left(p, at) : 1;
    const double *albedo = is_ground ? p->ground_albedo : p->albedo;
    /* From a sky: what faces up gets twice of what looks down. */
    const double sky = p->ambient * (0.75 + 0.25 * (p->up == 'z' ? normal.z : normal.y));
    double light = sky;
    for (uint32_t l = 0; l < lights; l++) {
        const float seen = b->visibility[l * b->count + i];
        const double whole = shade_irradiance(&p->build->lights[l], p->build->build.weighting,
                                              p->centre, at, normal, 1) /
                             lights;
        /* A point the library has no answer for (outside --bounds) is shown as not lit. */
        if (seen > 0) light += whole * seen;
        p->visibility[lights * pixel + l] += (float)part * (seen - 1);
        for (size_t c = 0; p->split && c < 3; c++)
            p->unshadowed[3 * (lights * pixel + l) + c] +=
                (float)(part * alpha * albedo[c] * whole);
    }
    for (size_t c = 0; c < 3; c++) {
        p->beauty[4 * pixel + c] += (float)(part * alpha * albedo[c] * light);
        if (p->split) p->unlit[3 * pixel + c] += (float)(part * alpha * albedo[c] * sky);
    }
    p->beauty[4 * pixel + 3] += (float)(part * alpha);
}

/* The ray in the pixel's middle (of an even number: the one right of and below it) gives what must
 * not be averaged. */
static void note_middle(const band *b, picture *p, size_t i, size_t pixel) {
    for (int c = 0; c < 3; c++) {
        p->position[3 * pixel + (size_t)c] = (float)b->position[3 * i + (size_t)c];
        p->normal[3 * pixel + (size_t)c] = b->normal[3 * i + (size_t)c];
    }
    p->depth[pixel] = (float)b->rays.hits[b->ray[i]].depth;
}

static void paint(const band *b, picture *p) {
    for (size_t i = 0; i < b->count; i++) {
        const uint32_t column = b->ray[i] % b->rays.width;
        const uint32_t row = b->rays.first_row + b->ray[i] / b->rays.width;
        const size_t pixel = (size_t)(row / p->aa) * p->width + column / p->aa;
        shade(b, p, i, pixel);
        if (row % p->aa == p->aa / 2 && column % p->aa == p->aa / 2) note_middle(b, p, i, pixel);
    }
}

/* Keeps every n-th point, n such that a picture full of points gives what is wanted. */
static void keep(const band *b, picture *p) {
    const uint64_t rays = (uint64_t)p->width * p->height * p->aa * p->aa;
    const uint64_t step = rays / p->verify + 1;
    for (size_t i = 0; i < b->count; i++) {
        if ((p->points + i) % step) continue;
        const uint64_t k = p->kept_count++;
        memcpy(p->kept_positions + 3 * k, b->position + 3 * i, 3 * sizeof(double));
        memcpy(p->kept_normals + 3 * k, b->normal + 3 * i, 3 * sizeof(float));
        p->kept_primitives[k] = b->primitive[i];
    }
}

static bool make_planes(picture *p) {
    const size_t pixels = (size_t)p->width * p->height, lights = p->build->light_count;
    const uint64_t kept = p->verify ? p->verify + 1 : 0;
    p->beauty = calloc(pixels, 4 * sizeof(float));
    p->visibility = malloc(pixels * lights * sizeof(float));
    p->position = calloc(pixels, 3 * sizeof(float));
    p->normal = calloc(pixels, 3 * sizeof(float));
    p->depth = calloc(pixels, sizeof(float));
    p->bands_done = calloc(p->height / p->band_rows + 1, sizeof(bool));
    if (kept) {
        p->kept_positions = malloc(kept * 3 * sizeof(double));
        p->kept_normals = malloc(kept * 3 * sizeof(float));
        p->kept_primitives = malloc(kept * sizeof(uint64_t));
        if (!p->kept_positions || !p->kept_normals || !p->kept_primitives) return false;
    }
    if (p->split) {
        p->unlit = calloc(pixels, 3 * sizeof(float));
        p->unshadowed = calloc(pixels * lights, 3 * sizeof(float));
        if (!p->unlit || !p->unshadowed) return false;
    }
    if (!p->beauty || !p->visibility || !p->position || !p->normal || !p->depth || !p->bands_done)
        return false;
    for (size_t i = 0; i < pixels * lights; i++) p->visibility[i] = 1;
    return true;
}

bool picture_begin(picture *p, cli_error *error) {
    p->band_rows = BAND_RAYS / (p->width * p->aa * p->aa);
    if (p->band_rows < 1) p->band_rows = 1;
    if (p->band_rows > p->height) p->band_rows = p->height;
    return make_planes(p) || no_memory(error);
}

/* Everything that can fail comes before anything is painted. */
static bool render_band(picture *p, band *b, cli_scene *scene, uint32_t number, cli_error *error) {
    const uint32_t height = b->rays.height, most = p->band_rows * p->aa, first = number * most;
    b->rays.first_row = first;
    b->rays.rows = height - first < most ? height - first : most;
    cli_progress_span(&scene->progress, (double)first / height,
                      (double)(first + b->rays.rows) / height, 0);
    raster_fill(&b->rays, &p->camera, p->surfaces, p->surface_count);
    gather(b, p);
    if (!ask(b, scene, error)) return false;
    paint(b, p);
    if (p->verify) keep(b, p);
    p->points += b->count;
    p->rays += (uint64_t)b->rays.width * b->rays.rows;
    return p->bands_done[number] = true;
}

bool picture_rows(picture *p, cli_scene *scene, uint32_t first, uint32_t count, cli_error *error) {
    uint32_t number = first / p->band_rows;
    const uint32_t end = count ? (first + count - 1) / p->band_rows + 1 : number;
    while (number < end && p->bands_done[number]) number++;
    if (number == end) return true;
    band b = {0};
    bool done = band_make(&b, p) || no_memory(error);
    cli_progress_begin(&scene->progress, "rendering");
    for (; done && number < end; number++)
        if (!p->bands_done[number]) done = render_band(p, &b, scene, number, error);
    band_free(&b);
    return done;
}

bool picture_verify(const picture *p, cli_scene *scene, cli_error *error) {
    const softshadow_points points =
        points_of(p->kept_positions, p->kept_normals, p->kept_primitives, p->kept_count);
    return cli_scene_print_error(scene, &points, error);
}
