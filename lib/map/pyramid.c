#include "map/pyramid.h"

#include "base/memory.h"
#include "base/status.h"

#define ROWS 64 /* of a level that one thread halves at a time */

static float less(float a, float b) { return a < b ? a : b; }

typedef struct halving {
    const float *from;
    float *to;
    uint32_t side, half;
} halving;

/* Sides need not be powers of two: the last square of a row may have one half only. */
static softshadow_status halve(void *ctx, uint64_t begin, uint64_t end) {
    const halving *h = ctx;
    for (uint64_t y = begin; y < end; y++) {
        const float *below = h->from + 2 * y * h->side;
        const float *above = 2 * y + 1 < h->side ? below + h->side : below;
        float *to = h->to + y * h->half;
        for (uint32_t x = 0; x < h->half; x++) {
            const uint32_t left = 2 * x, right = left + 1 < h->side ? left + 1 : left;
            to[x] = less(less(below[left], below[right]), less(above[left], above[right]));
        }
    }
    return SOFTSHADOW_OK;
}

softshadow_status ss_pyramid_build(ss_pyramid *out, const float *plane, uint32_t side,
                                   ss_pool *pool) {
    *out = (ss_pyramid){.level = {plane}, .side = {side}, .levels = 1};
    for (uint32_t s = side; s > 1; out->levels++) {
        s = (s + 1) / 2;
        out->side[out->levels] = s;
        out->count += (size_t)s * s;
    }
    out->own = ss_alloc(out->count, sizeof *out->own);
    if (!out->own)
        return ss_fail(SOFTSHADOW_E_MEMORY, "build.resolution: out of memory at %u", side);
    float *at = out->own;
    for (uint32_t l = 1; l < out->levels; l++) {
        halving h = {out->level[l - 1], at, out->side[l - 1], out->side[l]};
        const softshadow_status status = ss_parallel_for(pool, h.half, ROWS, halve, &h);
        if (status) {
            ss_pyramid_free(out);
            return status;
        }
        out->level[l] = at;
        at += (size_t)out->side[l] * out->side[l];
    }
    return SOFTSHADOW_OK;
}

void ss_pyramid_free(ss_pyramid *pyramid) {
    ss_free(pyramid->own);
    *pyramid = (ss_pyramid){0};
}

float ss_pyramid_least(const ss_pyramid *pyramid, const int32_t low[2], const int32_t high[2]) {
    const int32_t wide = high[0] - low[0], tall = high[1] - low[1],
                  most = wide > tall ? wide : tall;
    uint32_t l = 0; /* where the box has at most four squares along each side */
    while (l + 1 < pyramid->levels && most >> l > 2) l++;
    float least =
        pyramid->level[l][(size_t)(low[1] >> l) * pyramid->side[l] + (size_t)(low[0] >> l)];
    for (int32_t y = low[1] >> l; y <= high[1] >> l; y++) {
        const float *row = pyramid->level[l] + (size_t)y * pyramid->side[l];
        for (int32_t x = low[0] >> l; x <= high[0] >> l; x++) least = less(least, row[x]);
    }
    return least;
}
