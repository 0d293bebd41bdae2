/* From a point, a surface that is off by d at t along the segments is seen d / t beside its place,
 * on the light's own plane: in cells of the lattice that is d / t times how fast the grid's
 * coordinates change with a place at t = 1. So a level may stand for everything beyond one t, and
 * segments that leave a surface at a grazing angle are no exception: there the light is cut by that
 * surface's own rim, which moves no farther than any other.
 *
 * based on: depth slabs of levels of detail, ORed into one mask, each cut off where it begins. */
#include "coverage/slab.h"

#include <math.h>
#include <string.h>

/* How much a unit of length does at t = 1, for every lane. */
typedef struct rates {
    float cells[SS_LANES]; /* along the one of the grid's axes along which it is more */
    float t[SS_LANES];
    float most_t; /* of the lanes asked */
} rates;

static inline float larger(float a, float b) { return a > b ? a : b; }
static inline float smaller(float a, float b) { return a < b ? a : b; }

/* The squares of how fast a coordinate of the grid changes where it is `at`, or t does (row 2). */
static void add_slopes(const ss_group *g, int row, float at, float square[SS_LANES]) {
    for (int i = 0; i < SS_LANES; i++) {
        float sum = 0;
        for (int k = 0; k < 3; k++) {
            const float n = g->matrix[row][k][i] - at * g->matrix[2][k][i];
            sum += n * n;
        }
        square[i] = larger(square[i], sum);
    }
}

static void find_rates(const ss_group *g, rates *r) {
    memset(r, 0, sizeof *r);
    add_slopes(g, 2, 0, r->t);
    add_slopes(g, 0, 0, r->cells);
    add_slopes(g, 0, (float)(32 * g->lattice->words), r->cells);
    add_slopes(g, 1, 0, r->cells);
    add_slopes(g, 1, (float)(SS_BLOCK * g->lattice->row_blocks), r->cells);
    for (int i = 0; i < SS_LANES; i++) {
        r->cells[i] = sqrtf(r->cells[i]), r->t[i] = sqrtf(r->t[i]);
    }
    for (uint32_t m = g->lanes; m; m &= m - 1) {
        r->most_t = larger(r->most_t, r->t[__builtin_ctz(m)]);
    }
}

/* Fills the slab of a level; false if it would be empty. `room`: by how much, along every axis,
 * anything may be off. */
static bool fill(const ss_group *g, const rates *r, ss_slab *slab, const ss_lod_level *level,
                 float cells, float room) {
    const float off = (float)level->deviation / cells;
    float first = INFINITY, last = 0, end = INFINITY;
    bool any = false;
    for (int i = 0; i < SS_LANES; i++) {
        slab->t_near[i] = larger(r->cells[i] * off, g->t_safe);
        slab->t_far[i] = g->t_far[i] - r->t[i] * room;
    }
    for (uint32_t m = g->lanes; m; m &= m - 1) {
        const int i = __builtin_ctz(m);
        any |= slab->t_near[i] < slab->t_far[i];
        first = smaller(first, slab->t_near[i]), last = larger(last, slab->t_near[i]);
        end = smaller(end, slab->t_far[i]);
    }
    slab->t_floor = first - g->t_safe, slab->t_safe = last + g->t_safe;
    slab->t_beyond = end - g->t_safe;
    slab->t_until = slab->t_again = INFINITY;
    slab->bvh = level->bvh, slab->skip_count = 0;
    return any;
}

/* A finer slab goes on into the next coarser one by what these two may be off, so that nothing
 * falls between; by what the coarsest is off, it would draw all of its faces there in vain. What is
 * so near the light that a level could put it behind is the casters' own business. */
static void join(ss_group *g, const ss_lod *lod, float rate, float room) {
    for (uint32_t i = 0; i + 1 < g->slab_count; i++) {
        const double finer = i ? lod->level[i - 1].deviation_max : 0;
        const float off = (float)fmax(finer, lod->level[i].deviation_max);
        g->slabs[i].t_until = g->slabs[i + 1].t_safe + 2 * rate * off;
    }
    g->slabs[0].t_again = g->slabs[1].t_beyond - 2 * rate * room;
}

static void set_full(ss_group *g) {
    ss_slab *slab = &g->slabs[0];
    memcpy(slab->t_near, g->t_near, sizeof slab->t_near);
    memcpy(slab->t_far, g->t_far, sizeof slab->t_far);
    slab->t_safe = g->t_safe, slab->t_beyond = g->t_beyond;
    slab->t_floor = -INFINITY, slab->t_until = slab->t_again = INFINITY;
    slab->bvh = g->bvh, slab->outline = g->outline, slab->skip_count = g->skip_count;
    g->slab_count = 1, g->blur = 0, g->blur_from = INFINITY;
}

double ss_group_set_slabs(ss_group *g, const ss_lod_light *lod, double stray) {
    const double(*grid)[3] = (const double(*)[3])g->lattice->grid;
    const double half = sqrt(fabs(grid[0][0] * grid[1][1] - grid[0][1] * grid[1][0]));
    double room = 0, worst = 0, used = 0;
    rates r;
    set_full(g);
    if (!lod) return 0;
    find_rates(g, &r);
    for (uint32_t k = 0; k < lod->lod->count; k++) {
        room = larger((float)room, (float)lod->lod->level[k].deviation_max);
    }
    for (uint32_t k = 0; k < lod->lod->count; k++) {
        const ss_lod_level *level = &lod->lod->level[k];
        ss_slab *slab = &g->slabs[g->slab_count];
        if (!fill(g, &r, slab, level, (float)(stray * half), (float)room)) break;
        slab->outline = lod->outline[k];
        worst = fmax(worst, level->deviation_max / fmax(level->deviation, 1e-300));
        used = fmax(used, level->deviation_max);
        g->slab_count++;
    }
    if (g->slab_count == 1) return 0;
    join(g, lod->lod, r.most_t, (float)room);
    g->blur_from = g->slabs[1].t_floor;
    for (uint32_t k = 2; k < g->slab_count; k++) { /* a finer level may stray more */
        g->blur_from = fminf(g->blur_from, g->slabs[k].t_floor);
    }
    g->blur = (float)(sqrt(2) * stray * half * worst); /* both axes of the grid */
    return used;
}
