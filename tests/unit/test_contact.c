/* Contact: what touches, what is tested in double, what is left to floats. */
#include "trace_scene.h"

static void open_stand(stand *s) {
    assert_int_equal(ss_world_create(&s->world, &s->scene), SOFTSHADOW_OK);
    assert_int_equal(ss_pool_create(&s->pool, NULL), SOFTSHADOW_OK);
    assert_int_equal(ss_bvh_build(&s->bvh, s->world, s->pool, NULL), SOFTSHADOW_OK);
}

/* Ground z = 0 over [-1,1]^2 (triangles 0, 1) and a wall x = 0, z in 0..1 (triangles 2, 3). */
static void ground_and_wall(stand *s) {
    const double corner[3] = {-1, -1, 0}, a[3] = {2, 0, 0}, b[3] = {0, 2, 0};
    const double foot[3] = {0, -1, 0}, up[3] = {0, 0, 1};
    add_quad(s, corner, a, b);
    add_quad(s, foot, b, up);
    open_stand(s);
}

static bool lists(const uint32_t *list, uint32_t count, uint32_t triangle) {
    for (uint32_t i = 0; i < count; i++) {
        if (list[i] == triangle) return true;
    }
    return false;
}

static void look_at(const stand *s, const double host[3], uint32_t triangle, float ulp,
                    ss_contact *out) {
    ss_point point = {.triangle = triangle, .ulp = ulp};
    ss_world_local(s->world, host, point.p);
    ss_contact_find(s->bvh, s->world, &point, NULL, out);
}

static void far_from_everything(void **unused) {
    (void)unused;
    stand s = {0};
    ss_contact contact;
    ground_and_wall(&s);
    const double air[3] = {0.3, 0.4, 0.5};
    look_at(&s, air, SS_NO_TRIANGLE, 0x1p-23f, &contact);
    assert_int_equal(contact.near_count, 0);
    assert_int_equal(contact.tested_count, 0);
    double local[3];
    ss_world_local(s.world, air, local);
    assert_memory_equal(contact.p, local, sizeof local);
    fold_stand(&s);
}

/* Through the diagonal of the ground: both halves are one surface. */
static void ignores_its_own_plane(void **unused) {
    (void)unused;
    stand s = {0};
    ss_contact contact;
    ground_and_wall(&s);
    const double at[3] = {0.5 + 1e-7, 0.5, 3e-8}; /* above triangle 0, beside the diagonal */
    look_at(&s, at, 0, 0, &contact);
    assert_true(lists(contact.near, contact.near_count, 0));
    assert_true(lists(contact.near, contact.near_count, 1));
    assert_int_equal(contact.tested_count, 0);
    double ground[3] = {0, 0, 0}, height[3];
    ss_world_local(s.world, ground, height);
    assert_true(contact.p[2] == height[2]); /* put onto its triangle */
    fold_stand(&s);
}

/* A wall at distance d: with a triangle given it counts from any d > 0; on the line it touches. */
static void a_wall_counts_at_any_distance(void **unused) {
    (void)unused;
    stand s = {0};
    ss_contact contact;
    ground_and_wall(&s);
    const double toward[3] = {-1, 0.01, 0.4}, away[3] = {1, 0.01, 0.4};
    for (int e = 6; e <= 13; e++) {
        const double at[3] = {pow(10, -e), 0.1, 0};
        look_at(&s, at, 1, 0, &contact);
        assert_int_equal(contact.tested_count, 1); /* the wall's lower half */
        assert_true(ss_contact_blocked(&contact, s.world, toward, 1));
        assert_false(ss_contact_blocked(&contact, s.world, away, 1));
        /* Segments that end before the wall do not reach it. */
        assert_false(ss_contact_blocked(&contact, s.world, toward, 0.5 * at[0] * s.world->scale));
    }
    const double line[3] = {0, 0.1, 0};
    look_at(&s, line, 1, 0, &contact);
    assert_int_equal(contact.tested_count, 0);
    assert_int_equal(contact.near_count, 2);
    fold_stand(&s);
}

/* Without a triangle: what is within the given rounding touches, the rest does not. */
static void rounding_decides_without_a_triangle(void **unused) {
    (void)unused;
    stand s = {0};
    ss_contact contact;
    ground_and_wall(&s);
    const float touch = 0x1p-23f; /* single precision: 2^-21 at coordinates of size 1 */
    const double on[3] = {0.25, 0.1, 0x1p-24}, over[3] = {0.25, 0.1, 0x1.8p-21};
    look_at(&s, on, SS_NO_TRIANGLE, touch, &contact);
    assert_int_equal(contact.tested_count, 0);
    double floor[3] = {0, 0, 0};
    ss_world_local(s.world, floor, floor);
    assert_true(contact.p[2] == floor[2]);
    look_at(&s, over, SS_NO_TRIANGLE, touch, &contact);
    assert_true(contact.p[2] > floor[2]);
    assert_true(contact.tested_count > 0);
    const double down[3] = {0.1, 0.1, -1}, up[3] = {0.1, 0.1, 1};
    assert_true(ss_contact_blocked(&contact, s.world, down, 1));
    assert_false(ss_contact_blocked(&contact, s.world, up, 1));
    fold_stand(&s);
}

/* A fan of slivers just above a point, in any winding: segments aimed at shared edges and at the
 * hub, and at random between them, never slip through. */
static void no_segment_slips_between_faces(void **unused) {
    (void)unused;
    enum { FAN = 12 };
    const double pi = 3.14159265358979323846, height = 0x1p-21;
    double at[FAN + 1][3] = {{0.013, -0.007, height}};
    uint32_t indices[FAN][3];
    for (uint32_t i = 0; i < FAN; i++) {
        at[1 + i][0] = cos(2 * pi * i / FAN), at[1 + i][1] = sin(2 * pi * i / FAN);
        at[1 + i][2] = height * (1 + i % 3);
        const uint32_t a = 1 + i, b = 1 + (i + 1) % FAN;
        indices[i][0] = 0, indices[i][1] = i & 1 ? a : b, indices[i][2] = i & 1 ? b : a;
    }
    stand s = {0};
    add_mesh(&s, SOFTSHADOW_F64, at, FAN + 1, &indices[0][0], FAN);
    open_stand(&s);
    ss_contact contact;
    const double below[3] = {0.013, -0.007, 0};
    look_at(&s, below, SS_NO_TRIANGLE, 0, &contact);
    assert_int_equal(contact.tested_count, FAN);
    uint64_t state = 5;
    for (int r = 0; r < 100000; r++) {
        double spot[3], d[3];
        const uint32_t i = (uint32_t)(chance(&state) * FAN);
        const double along = r % 3 == 0 ? 0 : chance(&state) * 0.9;
        const double across = r % 3 == 1 ? 0 : chance(&state);
        const double *a = at[1 + i], *b = at[1 + (i + 1) % FAN];
        for (int k = 0; k < 3; k++) {
            spot[k] = at[0][k] + along * ((1 - across) * a[k] + across * b[k] - at[0][k]);
        }
        ss_sub(spot, below, d);
        for (int k = 0; k < 3; k++) d[k] *= 1.5 * s.world->scale;
        assert_true(ss_contact_blocked(&contact, s.world, d, 1));
    }
    fold_stand(&s);
}

/* More faces than fit: the nearest are kept, and segments may begin beyond the rest. */
static void a_tangle_is_stepped_over(void **unused) {
    (void)unused;
    enum { LAYERS = 300 };
    stand s = {0};
    for (int i = 0; i < LAYERS; i++) {
        const double corner[3] = {-1, -1, i * 0x1p-30}, a[3] = {2, 0, 0}, b[3] = {0, 2, 0};
        add_quad(&s, corner, a, b);
    }
    open_stand(&s);
    ss_contact contact;
    const double at[3] = {0.5, 0.25, 10 * 0x1p-30};
    look_at(&s, at, SS_NO_TRIANGLE, 0x1p-20f, &contact);
    assert_int_equal(contact.near_count, SS_NEAR_MOST);
    assert_true(contact.clear >= 0x1p-18);
    assert_true(lists(contact.near, contact.near_count, 20) || /* the layer it lies on */
                lists(contact.near, contact.near_count, 21));
    fold_stand(&s);
}

static void a_hole_in_a_texture_lets_through(void **unused) {
    (void)unused;
    const float at[4][3] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    const float uvs[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    const uint32_t indices[6] = {0, 1, 2, 2, 3, 0};
    const uint8_t texels[2] = {255, 0};
    stand s = {0};
    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    uint32_t id;
    mesh.positions = at, mesh.vertex_count = 4, mesh.indices = indices, mesh.triangle_count = 2;
    mesh.uvs = &uvs[0][0];
    mesh.opacity = (softshadow_texture){2, 1, texels};
    mesh.opacity_threshold = 0.5f;
    assert_int_equal(ss_scene_add_mesh(&s.scene, &mesh, &id), SOFTSHADOW_OK);
    open_stand(&s);
    uint64_t state = 9;
    for (int i = 0; i < 1000; i++) {
        const double under[3] = {1.8 * chance(&state) - 0.9, 1.8 * chance(&state) - 0.9, -1e-7};
        const double up[3] = {0, 0, 1};
        ss_contact contact;
        look_at(&s, under, SS_NO_TRIANGLE, 0, &contact);
        assert_int_equal(ss_contact_blocked(&contact, s.world, up, 1), under[0] < 0);
    }
    fold_stand(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(far_from_everything),
        cmocka_unit_test(ignores_its_own_plane),
        cmocka_unit_test(a_wall_counts_at_any_distance),
        cmocka_unit_test(rounding_decides_without_a_triangle),
        cmocka_unit_test(no_segment_slips_between_faces),
        cmocka_unit_test(a_tangle_is_stepped_over),
        cmocka_unit_test(a_hole_in_a_texture_lets_through),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
