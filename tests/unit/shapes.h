/* Small meshes with known connectivity, and worlds made of them. */
#ifndef SS_TESTS_SHAPES_H
#define SS_TESTS_SHAPES_H

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/parallel.h"
#include "scene/scene.h"

typedef struct shape {
    double (*vertices)[3];
    uint32_t (*triangles)[3];
    size_t vertex_count, triangle_count;
} shape;

static inline shape shape_of(const double (*v)[3], size_t nv, const uint32_t (*t)[3], size_t nt) {
    shape s = {malloc((nv + 1) * sizeof *s.vertices), malloc((nt + 1) * sizeof *s.triangles), nv,
               nt};
    if (nv) memcpy(s.vertices, v, nv * sizeof *v);
    if (nt) memcpy(s.triangles, t, nt * sizeof *t);
    return s;
}
#define SHAPE(v, t) shape_of(v, sizeof(v) / sizeof *(v), t, sizeof(t) / sizeof *(t))

static inline void shape_free(shape *s) {
    free(s->vertices);
    free(s->triangles);
}

/* The cube [-1,1]^3, fronts outwards, eight vertices. */
static inline shape shape_cube(void) {
    double v[8][3];
    static const uint32_t t[12][3] = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5},
                                      {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                      {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
    for (int i = 0; i < 8; i++)
        v[i][0] = i & 1 ? 1 : -1, v[i][1] = i & 2 ? 1 : -1, v[i][2] = i & 4 ? 1 : -1;
    return SHAPE(v, t);
}

/* Every triangle with three vertices of its own. */
static inline shape shape_split(const shape *s) {
    shape out = {malloc(3 * s->triangle_count * sizeof *out.vertices),
                 malloc(s->triangle_count * sizeof *out.triangles), 3 * s->triangle_count,
                 s->triangle_count};
    for (size_t t = 0; t < s->triangle_count; t++) {
        for (size_t k = 0; k < 3; k++) {
            memcpy(out.vertices[3 * t + k], s->vertices[s->triangles[t][k]], sizeof *out.vertices);
            out.triangles[t][k] = (uint32_t)(3 * t + k);
        }
    }
    return out;
}

/* A bumpy sphere of about rings x 2 rings x 2 triangles, closed, seam vertices doubled. */
static inline shape shape_sphere(uint32_t rings, double bump) {
    const uint32_t around = 2 * rings, row = around + 1;
    shape s = {malloc((size_t)(rings + 1) * row * sizeof *s.vertices),
               malloc((size_t)2 * rings * around * sizeof *s.triangles), (size_t)(rings + 1) * row,
               0};
    for (uint32_t i = 0; i <= rings; i++) {
        for (uint32_t j = 0; j <= around; j++) {
            const double a = M_PI * i / rings, b = 2 * M_PI * (j % around) / around;
            const double x = i == 0 || i == rings ? 0 : sin(a) * cos(b);
            const double y = i == 0 || i == rings ? 0 : sin(a) * sin(b), z = cos(a);
            const double r = 1 + bump * (sin(11 * x + 3 * z) * sin(13 * y) +
                                         .3 * sin(31 * z + 17 * x) * cos(29 * y));
            double *v = s.vertices[(size_t)i * row + j];
            v[0] = r * x, v[1] = r * y, v[2] = r * z;
        }
    }
    for (uint32_t i = 0; i < rings; i++) {
        for (uint32_t j = 0; j < around; j++) {
            const uint32_t a = i * row + j, b = a + 1, c = a + row, d = c + 1;
            const uint32_t upper[3] = {a, c, b}, lower[3] = {b, c, d};
            if (i > 0) memcpy(s.triangles[s.triangle_count++], upper, sizeof upper);
            if (i + 1 < rings) memcpy(s.triangles[s.triangle_count++], lower, sizeof lower);
        }
    }
    return s;
}

static inline softshadow_mesh shape_mesh(const shape *s) {
    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    mesh.position_type = SOFTSHADOW_F64, mesh.positions = s->vertices;
    mesh.vertex_count = s->vertex_count, mesh.triangle_count = s->triangle_count;
    mesh.indices = &s->triangles[0][0];
    return mesh;
}

static inline ss_pool *test_pool(uint32_t threads) {
    softshadow_options options = SOFTSHADOW_OPTIONS_INIT;
    ss_pool *pool = NULL;
    options.threads = threads;
    if (ss_pool_create(&pool, &options) != SOFTSHADOW_OK) abort();
    return pool;
}

#endif
