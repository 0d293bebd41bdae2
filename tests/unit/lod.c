/* Coarser scenes (trace/lod), and the depths where they stand for the casters (coverage/slab). */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/vec.h"
#include "coverage/slab.h"
#include "coverage/view.h"
#include "shapes.h"
#include "topology/levels.h"
#include "topology/topology.h"
#include "trace/lod.h"

#define STRAY 0.1 /* half-widths of the light */

typedef struct stand {
    ss_scene scene;
    ss_world *world;
    ss_pool *pool;
    ss_levels *levels;
    ss_lod *lod;
    ss_topology *topology[SS_LEVELS_MOST];
    ss_light light;
    ss_lod_light *lent;
} stand;

/* A bumpy sphere that has levels, and a cube that has none. */
static stand raise_stand(void) {
    stand s = {.light = {.type = SOFTSHADOW_RECT,
                         .centre = {0.2, 0.3, 4},
                         .normal = {0, 0, -1},
                         .u = {0.5, 0, 0},
                         .v = {0, 0.8, 0},
                         .radius = 1}};
    shape ball = shape_sphere(96, 0.1), cube = shape_cube();
    const softshadow_mesh meshes[] = {shape_mesh(&ball), shape_mesh(&cube)};
    uint32_t id;
    s.pool = test_pool(1);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(ss_scene_add_mesh(&s.scene, &meshes[i], &id), SOFTSHADOW_OK);
    }
    assert_int_equal(ss_world_create(&s.world, &s.scene), SOFTSHADOW_OK);
    assert_int_equal(ss_levels_build(s.world, s.pool, NULL, &s.levels), SOFTSHADOW_OK);
    assert_int_equal(ss_lod_create(&s.lod, s.world, s.levels, s.pool), SOFTSHADOW_OK);
    for (uint32_t k = 0; k < s.lod->count; k++) {
        assert_int_equal(ss_topology_build(&s.topology[k], s.lod->level[k].world, s.pool),
                         SOFTSHADOW_OK);
    }
    assert_int_equal(ss_lod_light_create(&s.lent, s.lod, s.topology, &s.light, s.pool),
                     SOFTSHADOW_OK);
    shape_free(&ball);
    shape_free(&cube);
    return s;
}

static void fold_stand(stand *s) {
    ss_lod_light_destroy(s->lent);
    for (uint32_t k = 0; k < SS_LEVELS_MOST; k++) ss_topology_destroy(s->topology[k]);
    ss_lod_destroy(s->lod);
    ss_levels_destroy(s->levels);
    ss_world_destroy(s->world);
    ss_pool_destroy(s->pool);
    ss_scene_free(&s->scene);
}

static void every_level_is_a_scene(void **unused) {
    (void)unused;
    stand s = raise_stand();
    uint64_t triangles = 0;
    size_t last = s.world->triangle_count;
    assert_int_equal(s.levels->meshes[0].count, 3);
    assert_int_equal(s.lod->count, 2); /* the third, of 576 triangles, would save nothing */
    for (uint32_t k = 0; k < s.lod->count; k++) {
        const ss_lod_level *level = &s.lod->level[k];
        const ss_level *ball = &s.levels->meshes[0].level[k];
        const ss_world *w = level->world;
        /* The cube is in it as it is. */
        assert_int_equal(w->triangle_count, ball->triangle_count + 12);
        assert_int_equal(w->meshes[1].first_triangle, ball->triangle_count);
        const ss_world_mesh *cube = &s.world->meshes[1];
        for (size_t i = 0; i < 36; i++) {
            const float *a = w->vertices + 3 * (size_t)w->indices[3 * ball->triangle_count + i],
                        *b = s.world->vertices +
                             3 * (size_t)s.world->indices[3 * (size_t)cube->first_triangle + i];
            assert_memory_equal(a, b, 3 * sizeof *a);
        }
        for (size_t i = 0; i < 3 * w->triangle_count; i++) {
            assert_true(w->indices[i] < w->vertex_count);
        }
        assert_true(w->triangle_count < last && level->bvh != NULL);
        assert_true(level->deviation == 4 * ball->deviation_rms);
        assert_true(level->deviation_max == ball->deviation_max);
        for (int i = 0; i < 6; i++) {
            assert_true(fabsf(w->bounds[i] - s.world->bounds[i]) <=
                        2 * level->deviation_max + 1e-6);
        }
        /* The sphere is a solid to the outlines, too: its faces towards points need no drawing. */
        const ss_outline *outline = s.lent->outline[k];
        bool dropped = false;
        for (uint32_t l = 0; l < outline->leaf_count; l++) dropped |= outline->leaf_drop[l][0] > 0;
        assert_true(dropped);
        last = w->triangle_count, triangles += w->triangle_count;
    }
    assert_int_equal(ss_lod_triangles(s.lod), triangles);
    assert_true(ss_lod_light_bytes(s.lent) > triangles);
    fold_stand(&s);
}

static void place_of(unsigned lane, double p[3]) {
    p[0] = 0.3 * lane / SS_LANES - 0.9, p[1] = 0.8, p[2] = -0.9 + 0.1 * (lane % 4);
}

static void set_lanes(ss_group *g, const stand *s, const ss_lattice *lattice) {
    const ss_group_kernel *kernel = ss_group_kernels_here();
    static ss_group_views views;
    memset(g, 0, sizeof *g);
    g->lattice = lattice;
    for (uint8_t k = 0; k < 3; k++) g->axis[k] = k;
    for (unsigned lane = 0; lane < SS_LANES; lane++) {
        double p[3];
        place_of(lane, p);
        for (int k = 0; k < 3; k++) views.at[k][lane] = p[k];
    }
    kernel->view(g, &s->light, &views);
    assert_int_equal(g->lanes, 0xffff);
    kernel->depths(g, 0x1p-17);
}

static void to_grid(const ss_group *g, unsigned lane, const double x[3], double out[3]) {
    double h[3];
    for (int i = 0; i < 3; i++) {
        h[i] = g->shift[i][lane];
        for (int k = 0; k < 3; k++) h[i] += g->matrix[i][k][lane] * x[k];
    }
    out[0] = h[0] / h[2], out[1] = h[1] / h[2], out[2] = h[2];
}

/* Somewhere on the way from the lane's point to its light, at t, moved by `by` any way. */
static double moves(const ss_group *g, const stand *s, unsigned lane, double t, double by) {
    double p[3], most = 0;
    place_of(lane, p);
    for (int i = 0; i < 64; i++) {
        const double u = (i & 1) * 2 - 1, v = (i & 2) - 1, turn = 0.1 * i;
        const double way[3] = {cos(turn) * cos(3 * turn), sin(turn) * cos(3 * turn), sin(3 * turn)};
        double x[3], at[3], off[3];
        for (int k = 0; k < 3; k++) {
            x[k] = p[k] + t * (s->light.centre[k] + u * s->light.u[k] + v * s->light.v[k] - p[k]);
        }
        to_grid(g, lane, x, at);
        ss_add_scaled(x, by, way, x);
        to_grid(g, lane, x, off);
        assert_true(fabs(at[2] - t) < 1e-5);
        most = fmax(most, hypot(off[0] - at[0], off[1] - at[1]));
    }
    return most;
}

static void slabs_begin_where_a_level_is_good_enough(void **unused) {
    (void)unused;
    stand s = raise_stand();
    ss_lattice *lattice;
    assert_int_equal(ss_lattice_create(&lattice, &s.light, 768), SOFTSHADOW_OK);
    static ss_group group; /* aligned as vectors need it */
    ss_group *g = &group;
    set_lanes(g, &s, lattice);
    const double strays = ss_group_set_slabs(g, s.lent, STRAY);
    const double cells = STRAY * sqrt(768 / 4.0); /* the light is a square of two half-widths */
    assert_true(g->slab_count > 1 && strays > 0 && g->blur > 0);
    for (uint32_t i = 1; i < g->slab_count; i++) {
        const ss_lod_level *level = &s.lod->level[i - 1];
        const ss_slab *slab = &g->slabs[i];
        assert_ptr_equal(slab->bvh, level->bvh);
        assert_int_equal(slab->skip_count, 0);
        for (unsigned lane = 0; lane < SS_LANES; lane++) {
            const double t = slab->t_near[lane];
            /* By its deviation within so many cells along each axis of the grid; by the largest
             * within the blur. Depth changes with the place, too: of second order. */
            assert_true(moves(g, &s, lane, t, level->deviation) < 1.1 * sqrt(2) * cells);
            assert_true(moves(g, &s, lane, t, level->deviation_max) < 1.1 * (double)g->blur);
            /* No gap to the next finer, nor to the light. */
            assert_true(g->slabs[i - 1].t_until > slab->t_near[lane]);
            assert_true(slab->t_far[lane] > g->slabs[0].t_again);
            assert_true(slab->t_floor < slab->t_near[lane] && slab->t_near[lane] < slab->t_safe);
        }
    }
    ss_lattice_destroy(lattice);
    fold_stand(&s);
}

static void no_slab_where_no_level_is(void **unused) {
    (void)unused;
    stand s = raise_stand();
    ss_lattice *lattice;
    assert_int_equal(ss_lattice_create(&lattice, &s.light, 768), SOFTSHADOW_OK);
    static ss_group group; /* aligned as vectors need it */
    ss_group *g = &group;
    set_lanes(g, &s, lattice);
    assert_true(ss_group_set_slabs(g, s.lent, 1e-6) == 0);
    assert_int_equal(g->slab_count, 1);
    assert_true(g->blur == 0);
    ss_lattice_destroy(lattice);
    fold_stand(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_level_is_a_scene),
        cmocka_unit_test(slabs_begin_where_a_level_is_good_enough),
        cmocka_unit_test(no_slab_where_no_level_is),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
