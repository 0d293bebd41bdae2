#include "map/pyramid.h"

#include "base/memory.h"
#include "base/status.h"

static float less(float a, float b) { return a < b ? a : b; }

/* Sides need not be powers of two: the last square of a row may have one half only. */
static void halve(const float *from, uint32_t side, float *to, uint32_t half) {
    for (uint32_t y = 0; y < half; y++) {
        const float *below = from + (size_t)(2 * y) * side;
        const float *above = 2 * y + 1 < side ? below + side : below;
        for (uint32_t x = 0; x < half; x++) {
            const uint32_t left = 2 * x, right = left + 1 < side ? left + 1 : left;
            to[(size_t)y * half + x] =
                less(less(below[left], below[right]), less(above[left], above[right]));
        }
    }
}

softshadow_status ss_pyramid_build(ss_pyramid *out, const float *plane, uint32_t side) {
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
        halve(out->level[l - 1], out->side[l - 1], at, out->side[l]);
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
