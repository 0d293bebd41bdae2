/* topology: the world's tables, and the report on one mesh. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "base/memory.h"
#include "base/status.h"
#include "shapes.h"
#include "topology/openmesh.h"
#include "topology/topology.h"

typedef struct built {
    ss_scene scene;
    ss_world *world;
    ss_topology *topology;
} built;

static void add(built *b, const softshadow_mesh *mesh) {
    uint32_t id;
    assert_int_equal(ss_scene_add_mesh(&b->scene, mesh, &id), SOFTSHADOW_OK);
}

static void build(built *b, uint32_t threads) {
    ss_pool *pool = test_pool(threads);
    assert_int_equal(ss_world_create(&b->world, &b->scene), SOFTSHADOW_OK);
    assert_int_equal(ss_topology_build(&b->topology, b->world, pool), SOFTSHADOW_OK);
    ss_pool_destroy(pool);
}

static void drop(built *b) {
    ss_topology_destroy(b->topology);
    ss_world_destroy(b->world);
    ss_scene_free(&b->scene);
}

static built build_shape(const shape *s) {
    built b = {0};
    const softshadow_mesh mesh = shape_mesh(s);
    add(&b, &mesh);
    build(&b, 1);
    return b;
}

/* The tables against their definition, by brute force over all pairs of uses. */
static void check_tables(const built *b) {
    const ss_topology *o = b->topology;
    const ss_world *w = b->world;
    for (uint32_t v = 0; v < w->vertex_count; v++) {
        assert_true(o->weld[v] <= v && o->weld[o->weld[v]] == o->weld[v]);
        for (int k = 0; k < 3; k++) {
            assert_true(w->vertices[3 * v + k] == w->vertices[3 * o->weld[v] + k]);
        }
    }
    size_t uses = 0;
    for (uint32_t t = 0; t < w->triangle_count; t++) {
        uint32_t c[3];
        for (int k = 0; k < 3; k++) c[k] = o->weld[w->indices[3 * t + k]];
        const bool degenerate = c[0] == c[1] || c[1] == c[2] || c[2] == c[0];
        assert_int_equal(degenerate, o->triangle_component[t] == SS_NO_COMPONENT);
        for (int k = 0; k < 3; k++) {
            const uint32_t e = o->triangle_edges[3 * t + k], from = c[k], to = c[(k + 1) % 3];
            assert_int_equal(degenerate, e == SS_NO_EDGE);
            if (degenerate) continue;
            uses++;
            const ss_edge *edge = &o->edges[e];
            assert_int_equal(edge->vertex[0], from < to ? from : to);
            assert_int_equal(edge->vertex[1], from < to ? to : from);
            int found = 0;
            for (uint32_t i = 0; i < ss_edge_uses(edge); i++) {
                const uint32_t use = o->uses[edge->first_use + i];
                assert_int_equal(o->triangle_component[ss_use_triangle(use)],
                                 o->triangle_component[t]);
                if (i) assert_true(o->uses[edge->first_use + i - 1] < use);
                found += ss_use_triangle(use) == t && ss_use_sign(use) == (from < to ? 1 : -1);
            }
            assert_int_equal(found, 1);
        }
    }
    assert_int_equal(uses, o->use_count);
    for (size_t e = 1; e < o->edge_count; e++) {
        const ss_edge *a = &o->edges[e - 1], *c = &o->edges[e];
        assert_true(a->vertex[0] < c->vertex[0] ||
                    (a->vertex[0] == c->vertex[0] && a->vertex[1] < c->vertex[1]));
    }
}

static void cube_is_solid(void **unused) {
    (void)unused;
    shape cube = shape_cube(), split = shape_split(&cube);
    for (int i = 0; i < 2; i++) {
        built b = build_shape(i ? &split : &cube);
        check_tables(&b);
        assert_int_equal(b.topology->edge_count, 18);
        assert_int_equal(b.topology->component_count, 1);
        const ss_component *c = &b.topology->components[0];
        assert_true(c->closed);
        assert_int_equal(c->triangle_count, 12);
        const double side = 2 * (double)c->high[0];
        assert_true(fabs(c->volume - side * side * side) < 1e-6 * side * side * side);
        for (int k = 0; k < 3; k++) {
            assert_true(c->low[k] == b.world->bounds[k] && c->high[k] == b.world->bounds[3 + k]);
        }
        drop(&b);
    }
    shape_free(&cube), shape_free(&split);
}

static void turned_inside_out(void **unused) {
    (void)unused;
    shape cube = shape_cube();
    for (size_t t = 0; t < 12; t++) {
        const uint32_t c = cube.triangles[t][1];
        cube.triangles[t][1] = cube.triangles[t][2], cube.triangles[t][2] = c;
    }
    built b = build_shape(&cube);
    assert_true(b.topology->components[0].closed && b.topology->components[0].volume < 0);
    drop(&b);
    const uint32_t c = cube.triangles[5][1]; /* one face the other way round: no longer solid */
    cube.triangles[5][1] = cube.triangles[5][2], cube.triangles[5][2] = c;
    b = build_shape(&cube);
    assert_false(b.topology->components[0].closed);
    drop(&b);
    shape_free(&cube);
}

static void meshes_stay_apart(void **unused) {
    (void)unused;
    built b = {0};
    shape cube = shape_cube();
    softshadow_mesh mesh = shape_mesh(&cube);
    add(&b, &mesh);
    const double move[12] = {1, 0, 0, 2, 0, 1, 0, 0, 0, 0, 1, 0}; /* shares a face's corners */
    mesh.transform = move;
    add(&b, &mesh);
    static const uint8_t texel = 255;
    static const float uvs[16];
    mesh.transform = NULL, mesh.uvs = uvs;
    mesh.opacity = (softshadow_texture){1, 1, &texel}, mesh.opacity_threshold = .5f;
    add(&b, &mesh);
    build(&b, 2);
    check_tables(&b);
    assert_int_equal(b.topology->component_count, 3);
    assert_int_equal(b.topology->edge_count, 3 * 18);
    assert_true(b.topology->components[0].closed && b.topology->components[1].closed);
    assert_false(b.topology->components[2].closed); /* its texture may make holes */
    assert_int_equal(b.topology->components[1].first_triangle, 12);
    drop(&b);
    shape_free(&cube);
}

/* A cube, and what touches it along the edge x = y = 1: its triangles' corners in `more`, numbered
 * from the cube's eight on. */
static built build_touched(const double (*v)[3], size_t nv, const uint32_t (*t)[3], size_t nt) {
    shape cube = shape_cube();
    double vertices[16][3];
    uint32_t triangles[24][3];
    memcpy(vertices, cube.vertices, 8 * sizeof *v), memcpy(vertices + 8, v, nv * sizeof *v);
    memcpy(triangles, cube.triangles, 12 * sizeof *t), memcpy(triangles + 12, t, nt * sizeof *t);
    shape both = shape_of(vertices, 8 + nv, triangles, 12 + nt);
    built b = build_shape(&both);
    check_tables(&b);
    shape_free(&cube);
    shape_free(&both);
    return b;
}

/* A second cube beside the first: closed by sums as one, whichever way its faces look. */
static void cubes_that_touch_come_apart(void **unused) {
    (void)unused;
    for (int inverted = 0; inverted < 2; inverted++) {
        shape other = shape_cube();
        for (size_t i = 0; i < 8; i++) other.vertices[i][0] += 2, other.vertices[i][1] += 2;
        for (size_t i = 0; i < 12; i++) {
            for (int k = 0; k < 3; k++) other.triangles[i][k] += 8;
            const uint32_t first = other.triangles[i][0];
            if (!inverted) continue;
            other.triangles[i][0] = other.triangles[i][1], other.triangles[i][1] = first;
        }
        built b = build_touched((const double(*)[3])other.vertices, 8,
                                (const uint32_t(*)[3])other.triangles, 12);
        const ss_topology *o = b.topology;
        assert_int_equal(o->component_count, 1);
        assert_true(o->components[0].closed);
        assert_int_equal(o->solid_count, 2);
        for (uint32_t t = 0; t < 24; t++) assert_int_equal(o->triangle_solid[t], t / 12);
        assert_true(o->solids[0].closed && o->solids[1].closed);
        assert_true(o->solids[0].volume > 0);
        const double sign = inverted ? -1 : 1;
        assert_true(fabs(o->solids[1].volume - sign * o->solids[0].volume) < 1e-12);
        drop(&b);
        shape_free(&other);
    }
}

/* A fin is a solid of its own; a flap of one triangle leaves its neighbours open. */
static void fins_come_off(void **unused) {
    (void)unused;
    static const double tip[][3] = {{2, 2, 0}};
    static const uint32_t fin[][3] = {{3, 7, 8}, {7, 3, 8}};
    built b = build_touched(tip, 1, fin, 2);
    assert_int_equal(b.topology->solid_count, 2);
    assert_true(b.topology->solids[0].closed && b.topology->solids[1].closed);
    assert_int_equal(b.topology->solids[1].triangle_count, 2);
    drop(&b);
    b = build_touched(tip, 1, fin, 1);
    for (uint32_t i = 0; i < b.topology->solid_count; i++) {
        assert_false(b.topology->solids[i].closed);
    }
    drop(&b);
}

/* Negative zero, corners that fall together only as floats, and unused vertices. */
static void degenerate_triangles(void **unused) {
    (void)unused;
    static const double v[][3] = {{0, 0, 0},     {4, 0, 0}, {0, 4, 0}, {-0.0, 4, -0.0},
                                  {4, 1e-12, 0}, {9, 9, 9}, {4, 4, 0}};
    static const uint32_t t[][3] = {{0, 1, 2}, {0, 1, 4}, {2, 3, 1}, {3, 4, 6}, {5, 5, 5}};
    shape s = SHAPE(v, t);
    built b = build_shape(&s);
    check_tables(&b);
    assert_int_equal(b.topology->use_count, 6);
    assert_int_equal(b.topology->edge_count, 5);
    assert_int_equal(b.topology->component_count, 1);
    assert_int_equal(b.topology->weld[3], 2);
    drop(&b);
    shape_free(&s);
}

static void empty_world(void **unused) {
    (void)unused;
    built b = {0};
    build(&b, 1);
    assert_int_equal(b.topology->edge_count, 0);
    assert_int_equal(b.topology->component_count, 0);
    drop(&b);
}

static void assert_same_bytes(const void *a, const void *b, size_t count, size_t size) {
    assert_memory_equal(a, b, count * size);
}

/* A large split sphere, a fan with one hub of 5,000 triangles, a soup: the same on any threads. */
static void same_on_any_threads(void **unused) {
    (void)unused;
    shape sphere = shape_sphere(150, .1), split = shape_split(&sphere);
    shape fan = {malloc(5002 * sizeof *fan.vertices), malloc(5000 * sizeof *fan.triangles), 5002,
                 5000};
    for (uint32_t i = 0; i < 5002; i++) {
        fan.vertices[i][0] = i ? cos(i) : 0, fan.vertices[i][1] = i ? sin(i) : 0,
        fan.vertices[i][2] = i;
    }
    for (uint32_t i = 0; i < 5000; i++) {
        fan.triangles[i][0] = i + 1, fan.triangles[i][1] = i + 2, fan.triangles[i][2] = 0;
    }
    built b[3];
    memset(b, 0, sizeof b);
    for (int i = 0; i < 3; i++) {
        const softshadow_mesh one = shape_mesh(&split), two = shape_mesh(&fan);
        add(&b[i], &one), add(&b[i], &two);
        build(&b[i], (uint32_t[]){1, 2, 7}[i]);
        const ss_topology *x = b[0].topology, *y = b[i].topology;
        assert_int_equal(x->edge_count, y->edge_count);
        assert_same_bytes(x->weld, y->weld, x->vertex_count, sizeof *x->weld);
        assert_same_bytes(x->edges, y->edges, x->edge_count + 1, sizeof *x->edges);
        assert_same_bytes(x->uses, y->uses, x->use_count, sizeof *x->uses);
        assert_same_bytes(x->triangle_edges, y->triangle_edges, 3 * x->triangle_count,
                          sizeof(uint32_t));
        assert_same_bytes(x->components, y->components, x->component_count, sizeof *x->components);
    }
    check_tables(&b[0]);
    assert_true(b[0].topology->components[0].closed);
    assert_false(b[0].topology->components[1].closed);
    assert_true(ss_topology_bytes(b[0].topology) <= 300 * b[0].world->triangle_count);
    for (int i = 0; i < 3; i++) drop(&b[i]);
    shape_free(&sphere), shape_free(&split), shape_free(&fan);
}

/* ---- the report ---- */

static softshadow_mesh_report report(const shape *s, const softshadow_light *light) {
    built b = {0};
    const softshadow_mesh mesh = shape_mesh(s);
    add(&b, &mesh);
    softshadow_mesh_report out = SOFTSHADOW_MESH_REPORT_INIT;
    assert_int_equal(ss_topology_report(&b.scene.meshes[0], light, &out), SOFTSHADOW_OK);
    assert_int_equal(out.struct_size, sizeof out);
    assert_int_equal(out.vertices, s->vertex_count);
    assert_int_equal(out.triangles, s->triangle_count);
    drop(&b);
    return out;
}

#define EXPECT(r, p, deg, dup, e, bound, nme, flip, nmv, comp, closed)                             \
    do {                                                                                           \
        assert_int_equal((r).positions, p), assert_int_equal((r).degenerate_triangles, deg);       \
        assert_int_equal((r).duplicate_triangles, dup), assert_int_equal((r).edges, e);            \
        assert_int_equal((r).boundary_edges, bound), assert_int_equal((r).nonmanifold_edges, nme); \
        assert_int_equal((r).flipped_edges, flip),                                                 \
            assert_int_equal((r).nonmanifold_vertices, nmv);                                       \
        assert_int_equal((r).components, comp), assert_int_equal((r).closed_components, closed);   \
    } while (0)

static void report_cube(void **unused) {
    (void)unused;
    shape cube = shape_cube(), split = shape_split(&cube);
    softshadow_light light = SOFTSHADOW_LIGHT_INIT;
    for (int i = 0; i < 2; i++) {
        light.type = SOFTSHADOW_SPHERE, light.radius = .1;
        light.position[0] = 0, light.position[1] = 0, light.position[2] = 5; /* one face is lit */
        softshadow_mesh_report r = report(i ? &split : &cube, &light);
        EXPECT(r, 8, 0, 0, 18, 0, 0, 0, 0, 1, 1);
        assert_int_equal(r.silhouette_edges, 4);
        light.position[0] = 5, light.position[1] = 5; /* three: a hexagon */
        assert_int_equal(report(i ? &split : &cube, &light).silhouette_edges, 6);
        light.position[0] = 1, light.position[1] = 1; /* in the planes of two: they are backs */
        assert_int_equal(report(i ? &split : &cube, &light).silhouette_edges, 4);
        light.type = SOFTSHADOW_SUN, light.direction[0] = 0, light.direction[1] = -1;
        light.direction[2] = -1; /* two faces: an outline of six edges */
        assert_int_equal(report(i ? &split : &cube, &light).silhouette_edges, 6);
        assert_int_equal(report(i ? &split : &cube, NULL).silhouette_edges, 0);
        assert_true(r.bounds[0] == -1 && r.bounds[2] == -1 && r.bounds[3] == 1 && r.bounds[5] == 1);
    }
    shape_free(&cube), shape_free(&split);
}

static void report_open_and_complex(void **unused) {
    (void)unused;
    static const double v[][3] = {{0, 0, 0},   {1, 0, 0},   {1, 1, 0}, {0, 1, 0},
                                  {.5, .5, 1}, {-1, -1, 0}, {-1, 0, 0}};
    softshadow_light light = SOFTSHADOW_LIGHT_INIT;
    light.type = SOFTSHADOW_SPHERE, light.position[2] = 5;

    static const uint32_t quad[][3] = {{0, 1, 2}, {0, 2, 3}};
    shape s = shape_of(v, 4, quad, 2);
    softshadow_mesh_report r = report(&s, &light);
    EXPECT(r, 4, 0, 0, 5, 4, 0, 0, 0, 1, 0);
    assert_int_equal(r.silhouette_edges, 4);
    shape_free(&s);

    static const uint32_t flipped[][3] = {{0, 1, 2}, {0, 3, 2}};
    s = shape_of(v, 4, flipped, 2);
    r = report(&s, &light);
    EXPECT(r, 4, 0, 0, 5, 4, 0, 1, 0, 1, 0);
    assert_int_equal(r.silhouette_edges, 3); /* of the one that looks at the light */
    shape_free(&s);

    static const uint32_t edge3[][3] = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
    s = shape_of(v, 5, edge3, 3);
    r = report(&s, NULL);
    EXPECT(r, 5, 0, 0, 7, 6, 1, 0, 0, 1, 0);
    shape_free(&s);

    static const uint32_t bowtie[][3] = {{0, 1, 2}, {0, 5, 6}};
    s = shape_of(v, 7, bowtie, 2);
    r = report(&s, &light);
    EXPECT(r, 7, 0, 0, 6, 6, 0, 0, 1, 2, 0);
    shape_free(&s);

    static const uint32_t twice[][3] = {{0, 1, 2}, {1, 2, 0}, {2, 1, 0}, {0, 2, 3}};
    s = shape_of(v, 4, twice, 4);
    r = report(&s, NULL);
    EXPECT(r, 4, 0, 2, 5, 2, 3, 0, 0, 1, 0);
    shape_free(&s);

    static const double line[][3] = {{0, 0, 0}, {1, 2, 3}, {2, 4, 6}, {5, 0, 0}, {-0.0, 0, 0}};
    static const uint32_t thin[][3] = {{0, 1, 2}, {0, 1, 4}, {3, 3, 3}, {0, 2, 3}};
    s = SHAPE(line, thin); /* a sliver has edges; what has two corners in one place has none */
    r = report(&s, NULL);
    EXPECT(r, 4, 3, 0, 5, 4, 0, 0, 0, 1, 0);
    shape_free(&s);
}

/* Two closed cones at one apex: half-edges refuse the second, the edge table does not. */
static void report_refused(void **unused) {
    (void)unused;
    static const double v[][3] = {{0, 0, 0},  {1, 0, 1},   {-1, 1, 1},  {-1, -1, 1},
                                  {1, 0, -1}, {-1, 1, -1}, {-1, -1, -1}};
    static const uint32_t t[][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {0, 5, 4},
                                    {0, 6, 5}, {0, 4, 6}, {1, 3, 2}, {4, 5, 6}};
    ss_halfedges halfedges;
    assert_int_equal(ss_openmesh_count(&halfedges, &t[0][0], 8, 7), SOFTSHADOW_OK);
    assert_true(halfedges.refused > 0);
    shape s = SHAPE(v, t);
    softshadow_mesh_report r = report(&s, NULL);
    EXPECT(r, 7, 0, 0, 12, 0, 0, 0, 1, 2, 2);
    shape_free(&s);
}

/* Where half-edges take all, both ways of counting must agree. */
static void halfedges_agree(void **unused) {
    (void)unused;
    shape sphere = shape_sphere(40, .1), split = shape_split(&sphere);
    for (size_t holes = 0; holes < 3; holes++) {
        split.triangle_count = sphere.triangle_count - 7 * holes;
        built b = build_shape(&split);
        uint32_t *corners = malloc(split.triangle_count * sizeof(uint32_t[3]));
        for (size_t i = 0; i < 3 * split.triangle_count; i++) {
            corners[i] = b.topology->weld[b.world->indices[i]];
        }
        ss_halfedges h;
        assert_int_equal(ss_openmesh_count(&h, corners, split.triangle_count, split.vertex_count),
                         SOFTSHADOW_OK);
        assert_int_equal(h.refused, 0);
        assert_int_equal(h.edges, b.topology->edge_count);
        assert_int_equal(h.components, b.topology->component_count);
        uint64_t boundary = 0;
        for (size_t e = 0; e < b.topology->edge_count; e++) {
            boundary += ss_edge_uses(&b.topology->edges[e]) == 1;
        }
        assert_int_equal(h.boundary_edges, boundary);
        assert_int_equal(boundary == 0, b.topology->components[0].closed);
        softshadow_mesh_report r = report(&split, NULL);
        assert_int_equal(r.boundary_edges, boundary);
        assert_int_equal(r.nonmanifold_vertices, h.nonmanifold_vertices);
        free(corners);
        drop(&b);
    }
    shape_free(&sphere), shape_free(&split);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cube_is_solid),     cmocka_unit_test(turned_inside_out),
        cmocka_unit_test(meshes_stay_apart), cmocka_unit_test(degenerate_triangles),
        cmocka_unit_test(cubes_that_touch_come_apart), cmocka_unit_test(fins_come_off),
        cmocka_unit_test(empty_world),       cmocka_unit_test(same_on_any_threads),
        cmocka_unit_test(report_cube),       cmocka_unit_test(report_open_and_complex),
        cmocka_unit_test(report_refused),    cmocka_unit_test(halfedges_agree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
