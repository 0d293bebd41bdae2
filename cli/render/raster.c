/* raster.c
 *
 * For corners a, b, c in the camera's frame and a ray d, the edge function d . (b x c) is the
 * volume that d spans with the edge b c: its sign tells the side. Two triangles that share an edge
 * compute the very same number with opposite signs, so no ray slips between them. */
#include "raster.h"

#include <stdlib.h>

typedef struct triangle {
    vector edge[3]; /* b x c, c x a, a x b */
    double volume;  /* a . (b x c) */
} triangle;

bool raster_see(raster_surface *surface, const viewpoint *camera) {
    surface->seen = malloc((surface->vertex_count + 1) * sizeof *surface->seen);
    if (!surface->seen) return false;
    for (size_t i = 0; i < surface->vertex_count; i++)
        surface->seen[i] = camera_see(camera, vector_of(surface->positions + 3 * i));
    return true;
}

static void corners(const raster_surface *surface, size_t number, vector corner[3]) {
    for (int i = 0; i < 3; i++) corner[i] = surface->seen[surface->indices[3 * number + (size_t)i]];
}

static triangle setup(const vector corner[3]) {
    triangle t;
    for (int i = 0; i < 3; i++) t.edge[i] = vector_cross(corner[(i + 1) % 3], corner[(i + 2) % 3]);
    t.volume = vector_dot(corner[0], t.edge[0]);
    return t;
}

/* A pixel coordinate as a row or column number in low..high; what is far away must not overflow. */
static int64_t cell(double at, int64_t low, int64_t high) {
    if (!(at > (double)low)) return low;
    return at < (double)high ? (int64_t)at : high;
}

/* The columns and rows that may meet the triangle: all of them when it reaches behind the eye. */
static bool box(const vector corner[3], const raster_band *band, const viewpoint *camera,
                int64_t x[2], int64_t y[2]) {
    double low_x = INFINITY, high_x = -INFINITY, low_y = INFINITY, high_y = -INFINITY;
    int behind = 0;
    for (int i = 0; i < 3; i++) {
        if (corner[i].z <= 0) {
            behind++;
            continue;
        }
        const double u = (corner[i].x / corner[i].z / camera->tan_x + 1) / 2 * band->width;
        const double v = (1 - corner[i].y / corner[i].z / camera->tan_y) / 2 * band->height;
        low_x = fmin(low_x, u), high_x = fmax(high_x, u);
        low_y = fmin(low_y, v), high_y = fmax(high_y, v);
    }
    if (behind == 3) return false;
    const int64_t first = band->first_row, last = first + band->rows - 1, right = band->width - 1;
    x[0] = 0, x[1] = right, y[0] = first, y[1] = last;
    if (behind) return true;
    /* Cells whose middle may be inside, and one more on each side for rounding. */
    if (high_x < -1 || low_x > (double)right + 1 || high_y < (double)first - 1 ||
        low_y > (double)last + 2)
        return false;
    x[0] = cell(low_x - 1, 0, right), x[1] = cell(high_x + 1, 0, right);
    y[0] = cell(low_y - 1, first, last), y[1] = cell(high_y + 1, first, last);
    return true;
}

static void fill_row(raster_hit *hits, const triangle *t, const viewpoint *camera, uint32_t width,
                     double ray_y, const int64_t x[2], uint32_t surface, uint32_t number) {
    double at[3];
    for (int i = 0; i < 3; i++) at[i] = t->edge[i].y * ray_y + t->edge[i].z;
    for (int64_t column = x[0]; column <= x[1]; column++) {
        const double ray_x = (2 * ((double)column + 0.5) / width - 1) * camera->tan_x;
        const double a = t->edge[0].x * ray_x + at[0], b = t->edge[1].x * ray_x + at[1],
                     c = t->edge[2].x * ray_x + at[2];
        if (!((a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0))) continue;
        const double depth = t->volume / (a + b + c);
        if (!(depth > 0 && depth < hits[column].depth)) continue;
        hits[column] = (raster_hit){depth, surface, number};
    }
}

static void fill_triangle(raster_band *band, const viewpoint *camera, const raster_surface *surface,
                          uint32_t surface_number, uint32_t number) {
    vector corner[3];
    int64_t x[2], y[2];
    corners(surface, number, corner);
    if (!box(corner, band, camera, x, y)) return;
    const triangle t = setup(corner);
    if (t.volume == 0) return; /* seen from its edge, or without area */
    for (int64_t row = y[0]; row <= y[1]; row++) {
        const vector ray = raster_ray(camera, band->width, band->height, 0, (uint32_t)row);
        raster_hit *hits = band->hits + (size_t)(row - band->first_row) * band->width;
        fill_row(hits, &t, camera, band->width, ray.y, x, surface_number, number);
    }
}

void raster_fill(raster_band *band, const viewpoint *camera, const raster_surface *surfaces,
                 uint32_t surface_count) {
    const size_t count = (size_t)band->width * band->rows;
    for (size_t i = 0; i < count; i++)
        band->hits[i] = (raster_hit){INFINITY, RASTER_NONE, RASTER_NONE};
    for (uint32_t s = 0; s < surface_count; s++)
        for (size_t t = 0; t < surfaces[s].triangle_count; t++)
            fill_triangle(band, camera, &surfaces[s], s, (uint32_t)t);
}

void raster_weights(const raster_surface *surface, uint32_t number, vector ray, double weight[3]) {
    vector corner[3];
    corners(surface, number, corner);
    const triangle t = setup(corner);
    double sum = 0;
    for (int i = 0; i < 3; i++) sum += weight[i] = vector_dot(t.edge[i], ray);
    for (int i = 0; i < 3; i++) weight[i] = sum != 0 ? weight[i] / sum : 1.0 / 3;
}
