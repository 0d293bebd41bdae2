/* From a point, a surface that is off by d at t along the segments is seen d / t beside its place, on
 * the light's own plane: in cells of the lattice that is d / t times how fast the grid's coordinates
 * change with a place at t = 1. So a level may stand for everything beyond one t, and segments that
 * leave a surface at a grazing angle are no exception: there the light is cut by that surface's own
 * rim, which moves no farther than any other.
 *
 * based on: depth slabs of levels of detail, ORed into one mask, each cut off where it begins. */
#include "coverage/slab.h"

#include <math.h>
#include <string.h>

/* How a place at t = 1 moves things, for one lane. */
typedef struct rates {
    double least, most; /* cells a unit of length, at the grid's middle or corners: about, and surely */
    double depth;       /* t a unit of length */
} rates;

static rates rates_of(const ss_group *g, unsigned lane) {
    const double size[2] = {32.0 * g->lattice->words,
                            (double)SS_BLOCK * g->lattice->row_blocks};
    double row[3][3], largest[2] = {0, 0}, depth = 0;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) row[i][k] = g->matrix[i][k][lane];
    }
    for (int k = 0; k < 3; k++) depth += row[2][k] * row[2][k];
    for (int i = 0; i < 2; i++) {
        for (int end = 0; end < 2; end++) {
            double square = 0;
            for (int k = 0; k < 3; k++) {
                const double slope = row[i][k] - (end ? size[i] : 0) * row[2][k];
                square += slope * slope;
            }
            largest[i] = fmax(largest[i], sqrt(square));
        }
    }
    return (rates){fmax(largest[0], largest[1]), hypot(largest[0], largest[1]), sqrt(depth)};
}

/* Fills the slab for a level; false if it would be empty. `room`: by how much, along every axis,
 * anything may be off. */
static bool fill(ss_group *g, ss_slab *slab, const ss_lod_light *lod, uint32_t k, double cells,
                 double room) {
    const ss_lod_level *level = &lod->lod->level[k];
    float first = INFINITY, last = 0, end = INFINITY;
    bool any = false;
    for (uint32_t m = g->lanes; m; m &= m - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(m);
        const rates r = rates_of(g, lane);
        const double from = r.least * level->deviation / cells;
        slab->t_near[lane] = fmaxf((float)from, g->t_safe);
        slab->t_far[lane] = (float)(g->t_far[lane] - r.depth * room);
        any |= slab->t_near[lane] < slab->t_far[lane];
        first = fminf(first, slab->t_near[lane]), last = fmaxf(last, slab->t_near[lane]);
        end = fminf(end, slab->t_far[lane]);
    }
    slab->t_floor = first - g->t_safe, slab->t_safe = last + g->t_safe;
    slab->t_beyond = end - g->t_safe;
    slab->t_until = slab->t_again = INFINITY;
    slab->bvh = level->bvh, slab->outline = lod->outline[k], slab->skip_count = 0;
    return any;
}

/* Finer slabs go on into coarser ones by what both may be off, so that nothing falls between. */
static void join(ss_group *g, double room) {
    double depth = 0;
    for (uint32_t m = g->lanes; m; m &= m - 1) {
        depth = fmax(depth, rates_of(g, (unsigned)__builtin_ctz(m)).depth);
    }
    const float more = (float)(2 * depth * room);
    for (uint32_t i = 0; i + 1 < g->slab_count; i++) {
        g->slabs[i].t_until = g->slabs[i + 1].t_safe + more;
    }
    /* What is so near the light that a level could put it behind is the casters' own business. */
    g->slabs[0].t_again = g->slabs[1].t_beyond - more;
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

double ss_group_set_slabs(ss_group *g, const ss_lod_light *lod, double cells) {
    double room = 0, worst = 0, used = 0;
    set_full(g);
    if (!lod) return 0;
    for (uint32_t k = 0; k < lod->lod->count; k++) {
        room = fmax(room, lod->lod->level[k].deviation_max);
    }
    for (uint32_t k = 0; k < lod->lod->count; k++) {
        const ss_lod_level *level = &lod->lod->level[k];
        if (!fill(g, &g->slabs[g->slab_count], lod, k, cells, room)) break;
        worst = fmax(worst, level->deviation_max / fmax(level->deviation, 1e-300));
        used = fmax(used, level->deviation_max);
        g->slab_count++;
    }
    if (g->slab_count == 1) return 0;
    join(g, room);
    const rates r = rates_of(g, (unsigned)__builtin_ctz(g->lanes));
    g->blur_from = g->slabs[1].t_floor;
    g->blur = (float)(cells * worst * r.most / r.least);
    return used;
}
