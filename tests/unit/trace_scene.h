/* What the tests of rays, contact and ray tracing share: small scenes without the public ABI. */
#ifndef TESTS_TRACE_SCENE_H
#define TESTS_TRACE_SCENE_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/fpu.h"
#include "base/memory.h"
#include "base/status.h"
#include "base/vec.h"
#include "scene/scene.h"
#include "technique/raytrace.h"
#include "trace/bvh.h"
#include "trace/contact.h"
#include "trace/rays.h"

typedef struct stand {
    ss_scene scene;
    ss_world *world;
    ss_pool *pool;
    ss_bvh *bvh;
    ss_rays *rays;
} stand;

static inline void add_mesh(stand *s, uint32_t type, const void *positions, size_t vertices,
                            const uint32_t *indices, size_t triangles) {
    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    uint32_t id;
    mesh.position_type = type, mesh.positions = positions, mesh.vertex_count = vertices;
    mesh.indices = indices, mesh.triangle_count = triangles;
    assert_int_equal(ss_scene_add_mesh(&s->scene, &mesh, &id), SOFTSHADOW_OK);
}

/* A parallelogram: corner, two sides. */
static inline void add_quad(stand *s, const double corner[3], const double a[3],
                            const double b[3]) {
    double at[4][3];
    const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    for (int k = 0; k < 3; k++) {
        at[0][k] = corner[k], at[1][k] = corner[k] + a[k];
        at[2][k] = corner[k] + a[k] + b[k], at[3][k] = corner[k] + b[k];
    }
    add_mesh(s, SOFTSHADOW_F64, at, 4, indices, 2);
}

static inline void raise_stand(stand *s, const softshadow_options *options) {
    assert_int_equal(ss_world_create(&s->world, &s->scene), SOFTSHADOW_OK);
    assert_int_equal(ss_pool_create(&s->pool, options), SOFTSHADOW_OK);
    assert_int_equal(ss_bvh_build(&s->bvh, s->world, s->pool, NULL), SOFTSHADOW_OK);
    const softshadow_status status = ss_rays_create(&s->rays, s->world, s->pool);
    if (status) fail_msg("rays: %s", ss_message());
}

static inline void fold_stand(stand *s) {
    ss_rays_destroy(s->rays);
    ss_bvh_destroy(s->bvh);
    ss_pool_destroy(s->pool);
    ss_world_destroy(s->world);
    ss_scene_free(&s->scene);
    memset(s, 0, sizeof *s);
}

/* 0..1, the same on every run. */
static inline double chance(uint64_t *state) {
    *state = ss_hash(*state);
    return (double)(*state >> 11) * 0x1p-53;
}

/* As the engine makes it, from single or double precision. */
static inline ss_point make_point(const stand *s, const double host[3], bool single) {
    ss_point point = {.triangle = SS_NO_TRIANGLE};
    ss_world_local(s->world, host, point.p);
    point.ulp = single ? 0x1p-23f : 0x1p-52f;
    return point;
}

static inline ss_stage make_stage(const stand *s, const ss_light *light, const ss_params *params) {
    return (ss_stage){.world = s->world, .light = light, .params = params, .pool = s->pool,
                      .bvh = s->bvh, .rays = s->rays};
}

#endif
