/* How much of a lamp do three points on the floor see, past one triangle? */
#include <softshadow.h>
#include <stdio.h>

int main(void) {
    const float corners[] = {-1, 1, -1, 1, 1, -1, 0, 1, 1},
                floor[] = {0, 0, 0, 0.6f, 0, 0, 3, 0, 0};
    const uint32_t indices[] = {0, 1, 2};
    float visibility[3];

    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    mesh.positions = corners;
    mesh.vertex_count = 3;
    mesh.indices = indices;
    mesh.triangle_count = 1;
    softshadow_light lamp = SOFTSHADOW_LIGHT_INIT;
    lamp.type = SOFTSHADOW_SPHERE;
    lamp.position[1] = 4;
    lamp.radius = 0.5;
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    points.positions = floor;
    points.count = 3;

    softshadow *s;
    if (softshadow_create(&s, NULL) || softshadow_add_mesh(s, &mesh, NULL) ||
        softshadow_set_light(s, &lamp) || softshadow_build_maps(s, NULL) ||
        softshadow_query_visibility(s, &points, visibility)) {
        fprintf(stderr, "%s\n", softshadow_last_message(s));
        return 1;
    }
    for (int i = 0; i < 3; i++)
        printf("x = %.1f sees %.3f of the lamp\n", floor[3 * i], visibility[i]);
    softshadow_destroy(s);
}
