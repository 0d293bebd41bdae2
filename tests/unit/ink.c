/* Inks on the CPU and on a GPU: the same triangles cover the same texels and say the same about
 * them, the least key wins, the first of those that are alike, to the bit. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdio.h>

#include "base/status.h"
#include "raster/raster.h"
#include "shapes.h"

enum { RES = 193, MOST = 6000, VALUES = RES * RES * 5 };

static ss_raster_polygon triangle[MOST];
static float plane[2][VALUES]; /* key and four values a texel; the key is 1e30 where nothing is */

/* Steps in the key: whole areas where many triangles are alike. Numbers of the ink's own, and
 * texels that refuse. */
static const float steps[] = {4, 3};

static float key_of(float varied) { return floorf(varied * steps[0]) / steps[0]; }

static void keep(void *ctx, uint32_t x, uint32_t y, float key, const float value[4]) {
    float *texel = (float *)ctx + ((size_t)y * RES + x) * 5;
    texel[0] = key;
    memcpy(texel + 1, value, 4 * sizeof *value);
}

static void shade(void *ctx, const ss_raster_run *run) {
    const float *texel = (float *)ctx + ((size_t)run->y * RES + run->x) * 5;
    for (uint32_t i = 0; i < run->n; i++, texel += 5) {
        const float key = key_of(run->attribute[0][i]);
        if ((run->x + i + run->y) % (uint32_t)steps[1] == 0 || !(key < texel[0])) continue;
        const float value[4] = {(float)run->tag, run->attribute[1][i], run->attribute[2][i],
                                run->attribute[3][i]};
        keep(ctx, run->x + i, run->y, key, value);
    }
}

static const char glsl[] =
    "layout(std430, binding = 4) readonly buffer Unused { float unused[]; };\n"
    "layout(std430, binding = 6) readonly buffer Steps { float steps[]; };\n"
    "bool offer(uint tag, ivec2 texel, vec4 varied, precise out float key, out vec4 value) {\n"
    "    key = floor(varied.x * steps[0]) / steps[0];\n"
    "    value = vec4(float(tag), varied.yzw);\n"
    "    return uint(texel.x + texel.y) % uint(steps[1]) != 0u;\n"
    "}\n";

static void draw(const ss_raster *raster, size_t count, float first, float *out, ss_pool *pool) {
    const ss_raster_ink ink = {
        .shade = shade,
        .ctx = out,
        .offer_glsl = glsl,
        .table = {{steps, sizeof steps}, {steps, sizeof steps}, {steps, sizeof steps}},
        .tables = 3,
        .first_key = first,
        .keep = keep,
        .keep_ctx = out};
    for (size_t i = 0; i < VALUES; i++) out[i] = i % 5 ? 0 : first;
    if (raster->keep(triangle, count, RES, &ink, pool))
        fail_msg("%s: %s", raster->name, ss_message());
}

static uint64_t random_state = 11;
static double uniform(double low, double high) {
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(random_state >> 11) * 0x1p-53;
}

/* kind 0: of all sizes, all over; 1: corners on centres and on texel's edges; 2: far out of the
 * map; 3: slivers, and such without any area. Keys below zero, too. */
static void make(int kind, size_t count) {
    const double far = kind == 2 ? 90000 : 1.2 * RES;
    for (size_t t = 0; t < count; t++) {
        double size = kind == 2 ? 60000 : exp(uniform(0, 5)), at[2] = {uniform(-far, far), 0};
        at[1] = uniform(-far, far);
        for (int k = 0; k < 3; k++) {
            double *p = triangle[t].corner[k];
            for (int a = 0; a < 2; a++) p[a] = at[a] + uniform(-size, size);
            if (kind == 1) p[0] = floor(p[0]) + .5 * (k & 1), p[1] = floor(p[1]) + .5;
            if (kind == 3) p[1] = at[1] + (p[0] - at[0]) * .7 + (t % 3 ? uniform(-.2, .2) : 0);
            for (int a = 0; a < SS_RASTER_ATTRIBUTES; a++)
                triangle[t].attribute[k][a] = uniform(-3, 3);
        }
        triangle[t].corners = 3, triangle[t].tag = (uint32_t)(t * 7);
    }
}

static void test_alike(void **state) {
    (void)state;
    ss_pool *pool = test_pool(2);
    for (int kind = 0; kind < 4; kind++) {
        for (float first = 1; first < 2e30f; first *= 1e30f) {
            make(kind, MOST);
            draw(&ss_raster_cpu, MOST, first, plane[0], pool);
            draw(&ss_raster_egl, MOST, first, plane[1], pool);
            size_t other = 0, some = 0;
            for (size_t i = 0; i < VALUES; i += 5) {
                other += memcmp(plane[0] + i, plane[1] + i, 5 * sizeof(float)) != 0;
                some += plane[0][i] != first;
            }
            print_message("kind %d: %zu of %d texels taken\n", kind, some, RES * RES);
            assert_int_equal(other, 0);
            assert_true(some > RES * RES / 100 && some < RES * RES);
        }
    }
    draw(&ss_raster_egl, 0, 1, plane[1], pool);
    for (size_t i = 0; i < VALUES; i++) assert_true(plane[1][i] == (i % 5 ? 0 : 1));
    ss_pool_destroy(pool);
}

int main(void) {
    ss_raster_device device;
    if (ss_raster_egl.open(&device)) {
        printf("%s\n", ss_message());
        return 77;
    }
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_alike)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
