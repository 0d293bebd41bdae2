/* Several lights, and one that moves: after a change only what became stale is built again. */
#include <softshadow.h>
#include <stdio.h>
#include <string.h>

static softshadow_status ask(softshadow *s, uint32_t light, float *visibility) {
    static const float floor[] = {-1, 0, 0, 0, 0, 0, 1, 0, 0};
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    points.positions = floor;
    points.count = 3;
    points.light = light;
    return softshadow_query_visibility(s, &points, visibility);
}

static int failed(softshadow *s) {
    fprintf(stderr, "%s\n", softshadow_last_message(s));
    softshadow_destroy(s);
    return 1;
}

int main(void) {
    const float quad[] = {-1, 1, -1, 1, 1, -1, 1, 1, 1, -1, 1, 1};
    const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    float seen[3];
    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    mesh.positions = quad;
    mesh.vertex_count = 4;
    mesh.indices = indices;
    mesh.triangle_count = 2;
    softshadow_light window = SOFTSHADOW_LIGHT_INIT, sun = SOFTSHADOW_LIGHT_INIT;
    window.type = SOFTSHADOW_RECT; /* half axes: 1 wide, 0.5 high, above */
    window.position[1] = 4;
    window.u[0] = 0.5;
    window.v[2] = 0.25;
    sun.type = SOFTSHADOW_SUN; /* the way its light travels; half of 0.53 degrees */
    sun.direction[0] = 1;
    sun.direction[1] = -1;
    sun.radius = 0.00463;

    softshadow *s;
    uint32_t sun_id;
    if (softshadow_create(&s, NULL) || softshadow_add_mesh(s, &mesh, NULL) ||
        softshadow_set_light(s, &window) || softshadow_add_light(s, &sun, &sun_id) ||
        softshadow_build_maps(s, NULL))
        return failed(s);
    for (uint32_t light = 0; light <= sun_id; light++) {
        if (ask(s, light, seen)) return failed(s);
        printf("light %u: %.3f %.3f %.3f\n", light, seen[0], seen[1], seen[2]);
    }
    for (int frame = 0; frame < 3; frame++) {
        window.position[0] = frame; /* set_light() leaves this one light, number 0 */
        if (softshadow_set_light(s, &window) || softshadow_build_maps(s, NULL) || ask(s, 0, seen))
            return failed(s);
        printf("window at %d: %.3f %.3f %.3f\n", frame, seen[0], seen[1], seen[2]);
    }
    softshadow_destroy(s);
    return 0;
}
