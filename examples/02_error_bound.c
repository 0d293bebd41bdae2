/* A line of points through a penumbra: the fraction, how far the truth may be, and what it is. The
 * caster is a half-plane, for all that the points can tell, so the truth has a closed form. */
#include <math.h>
#include <softshadow.h>
#include <stdio.h>

enum { POINTS = 11 };

/* The part of a unit disk that lies beyond a line at distance x from its centre. */
static double disk_beyond(double x) {
    if (x <= -1 || x >= 1) return x < 0 ? 1 : 0;
    return 0.5 - (asin(x) + x * sqrt(1 - x * x)) / acos(-1);
}

int main(void) {
    /* Everything with x < 0 at height 1; the light is a disk of radius 0.25 at height 2. */
    const double half = 1000, plane[] = {-half, 1, -half, 0, 1, -half, 0, 1, half, -half, 1, half};
    const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    mesh.position_type = SOFTSHADOW_F64;
    mesh.positions = plane;
    mesh.vertex_count = 4;
    mesh.indices = indices;
    mesh.triangle_count = 2;
    softshadow_light light = SOFTSHADOW_LIGHT_INIT;
    light.type = SOFTSHADOW_DISK;
    light.position[1] = 2;
    light.direction[1] = -1;
    light.radius = 0.25;

    double positions[POINTS][3] = {{0}};
    float visibility[POINTS], bound[POINTS];
    for (int i = 0; i < POINTS; i++) positions[i][0] = -0.3 + 0.06 * i;
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    points.position_type = SOFTSHADOW_F64;
    points.positions = positions;
    points.count = POINTS;
    points.error_bound = bound;

    softshadow_build build = SOFTSHADOW_BUILD_INIT;
    build.tolerance = 0.002;
    softshadow *s;
    if (softshadow_create(&s, NULL) || softshadow_add_mesh(s, &mesh, NULL) ||
        softshadow_set_light(s, &light) || softshadow_build_maps(s, &build) ||
        softshadow_query_visibility(s, &points, visibility)) {
        fprintf(stderr, "%s\n", softshadow_last_message(s));
        return 1;
    }
    puts("      x  fraction  +-bound     truth");
    for (int i = 0; i < POINTS; i++) /* half-way up: the edge's shadow moves as the point does */
        printf("%7.2f  %8.5f  %.5f  %8.5f\n", positions[i][0], (double)visibility[i],
               (double)bound[i], disk_beyond(-positions[i][0] / light.radius));
    softshadow_destroy(s);
    return 0;
}
