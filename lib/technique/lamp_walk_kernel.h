/* Compiled once for each rung: eight texels of a row at a time, whatever a register holds, so that
 * sums are the same for all. Texels that surely miss the lamp or lie wholly before it are settled
 * by their distance from its centre; only those at its rim are clipped one by one. Squares of the
 * pyramid that hold nothing before the lamp are passed over. */
#include <math.h>
#include <string.h>

#include "base/wide.h"
#include "technique/lamp_walk.h"

#define INLINE static inline __attribute__((always_inline))
#define EIGHT  8
#define SQUARE 3 /* level of the pyramid: eight texels along a side */

typedef double doubles __attribute__((vector_size(8 * EIGHT)));
typedef int64_t longs __attribute__((vector_size(8 * EIGHT)));

#define ALL(x)              ((x) - (doubles){0})
#define PICK(mask, yes, no) ((doubles)(((mask) & (longs)(yes)) | (~(mask) & (longs)(no))))

/* A bit for each lane of a mask. */
INLINE uint32_t bits_of(const longs *mask) {
#if SS_FOURS == 4
    return _mm512_movepi64_mask((__m512i)*mask);
#elif SS_FOURS == 2
    const __m256d *half = (const __m256d *)mask;
    return (uint32_t)(_mm256_movemask_pd(half[0]) | _mm256_movemask_pd(half[1]) << 4);
#else
    uint32_t bits = 0;
    for (int i = 0; i < EIGHT; i++) bits |= ((uint32_t)(*mask)[i] & 1u) << i;
    return bits;
#endif
}

/* Eight samples of a row: their centres seen from the point and, of what is there, how far it is
 * from the lamp's centre for a gap of 1, squared. */
typedef struct group {
    int32_t column, row; /* of the first sample's lower left corner; they go on by the step */
    longs in;            /* the kernel's */
    size_t first;        /* texels before their row */
    ss_eight_ints x;     /* their texels' columns */
    bool beside;         /* are those eight beside each other? */
    double dx, dy;       /* of that corner */
    doubles square;
} group;

typedef void group_visit(const ss_lamp_asked *a, const group *g, void *ctx);
typedef bool group_full(const void *ctx);

/* Distances as the lamp measures them: across a disk, or along the sides of a square. */
INLINE void find_square(const ss_lamp_view *v, const doubles *dx, double dy, doubles *out) {
    const doubles s = v->to_light[0][0] * *dx + v->to_light[0][1] * dy;
    const doubles t = v->to_light[1][0] * *dx + v->to_light[1][1] * dy;
    const doubles ss = s * s, tt = t * t;
    *out = v->lamp->disk ? ss + tt : PICK(ss > tt, ss, tt);
}

INLINE void visit_group(const ss_lamp_asked *a, int32_t column, int32_t row, group_visit *visit,
                        void *ctx) {
    static const doubles number = {0, 1, 2, 3, 4, 5, 6, 7};
    static const ss_eight_ints whole = {0, 1, 2, 3, 4, 5, 6, 7};
    const int32_t step = a->kernel->step, last = (int32_t)a->pyramid->side[0] - 1;
    const int32_t my = row + step / 2, y = my < last ? my : last;
    const double half = step / 2.0;
    group g = {.column = column, .row = row, .dx = column - a->x, .dy = row - a->y};
    const doubles columns = column + step * number, dx = g.dx + half + step * number;
    g.in = (columns >= (double)a->kernel->low[0]) & (columns <= (double)a->kernel->high[0]);
    const ss_eight_ints middle = column + step / 2 + step * whole, beyond = middle > last;
    g.first = (size_t)y * a->pyramid->side[0];
    g.x = (beyond & last) | (~beyond & middle);
    g.beside = step == 1 && column + EIGHT <= last;
    find_square(a->view, &dx, g.dy + half, &g.square);
    visit(a, &g, ctx);
}

/* Is there anything in a square of the pyramid that stands before some of the lamp? */
INLINE bool square_matters(const ss_lamp_asked *a, int32_t x, int32_t y, double most) {
    const float least = a->pyramid->level[SQUARE][(size_t)y * a->pyramid->side[SQUARE] + (size_t)x];
    const double half = EIGHT / 2.0;
    if (!(least < a->h)) return false;
    const double own = (double)a->h - least, gap = own < most ? own : most;
    return !ss_lamp_misses(a->view, x * EIGHT + half - a->x, y * EIGHT + half - a->y,
                           gap > a->view->least ? gap : a->view->least, EIGHT);
}

/* The texels of a kernel square by square; none that only stands before the lamp as gaps above
 * `most` make it. */
INLINE void walk_squares(const ss_lamp_asked *a, double most, group_visit *visit, group_full *full,
                         void *ctx) {
    const ss_lamp_kernel *k = a->kernel;
    for (int32_t y = k->low[1] / EIGHT; y <= k->high[1] / EIGHT; y++) {
        const int32_t low = k->low[1] > y * EIGHT ? k->low[1] : y * EIGHT;
        const int32_t end = (y + 1) * EIGHT, high = k->high[1] < end ? k->high[1] : end - 1;
        for (int32_t x = k->low[0] / EIGHT; x <= k->high[0] / EIGHT; x++) {
            if (!square_matters(a, x, y, most)) continue;
            for (int32_t row = low; row <= high; row++) visit_group(a, x * EIGHT, row, visit, ctx);
        }
        if (full && full(ctx)) return;
    }
}

INLINE void walk(const ss_lamp_asked *a, double most, group_visit *visit, group_full *full,
                 void *ctx) {
    const ss_lamp_kernel *k = a->kernel;
    if (k->step == 1 && a->pyramid->levels > SQUARE) {
        walk_squares(a, most, visit, full, ctx);
        return;
    }
    for (int32_t j = 0; j < k->count[1]; j++) {
        for (int32_t i = 0; i < k->count[0]; i += EIGHT) {
            visit_group(a, k->low[0] + i * k->step, k->low[1] + j * k->step, visit, ctx);
        }
        if (full && full(ctx)) return;
    }
}

/* What the group says of gaps: does a sample miss the lamp, does it lie wholly before it? */
INLINE void compare(const ss_lamp_asked *a, const group *g, const doubles *gap, longs *hit,
                    longs *inside) {
    const double size = a->kernel->step * a->view->texel;
    const doubles most = *gap + size, least = *gap - size;
    *hit = g->in & ~(g->square >= most * most);
    *inside = *hit & (least > 0) & (g->square <= least * least);
    if (a->view->lamp->rings > 1) *inside = (longs){0};
}

/* What one sample hides, clipped. */
INLINE double clipped(const ss_lamp_asked *a, const group *g, int k, double gap) {
    const double step = a->kernel->step, x = g->dx + k * step;
    const double low[2] = {x / gap, g->dy / gap};
    const double high[2] = {(x + step) / gap, (g->dy + step) / gap};
    return ss_lamp_hidden(a->view, low, high);
}

INLINE double sum_of(const doubles *v) {
    double sum = 0;
    for (int i = 0; i < EIGHT; i++) sum += (*v)[i];
    return sum;
}

/* Floats of a row, so many to a texel. */
INLINE void load(const group *g, const float *row, int32_t channels, ss_eight *out) {
    if (channels == 1 && g->beside) {
        *out = *(const ss_eight_there *)(row + g->x[0]);
        return;
    }
#if SS_FOURS > 1
    const ss_eight_ints at = g->x * channels;
    *out = (ss_eight)_mm256_i32gather_ps(row, (__m256i)at, 4);
#else
    for (int k = 0; k < EIGHT; k++) (*out)[k] = row[g->x[k] * channels];
#endif
}

/* Depths of the samples, and which block some of the light: nearer ones that stand before it. */
INLINE void blocking(const ss_lamp_asked *a, const group *g, doubles *gap, longs *hit) {
    longs unused;
    ss_eight depth;
    load(g, a->pyramid->level[0] + g->first, 1, &depth);
    *gap = (double)a->h - __builtin_convertvector(depth, doubles);
    const doubles most = PICK(*gap > a->view->least, *gap, ALL(a->view->least));
    compare(a, g, &most, hit, &unused);
    *hit &= *gap > 0;
}

/* ---- pcss ------------------------------------------------------------------------------------ */

typedef struct blockers {
    doubles sum;
    longs count;
} blockers;

INLINE void add_blockers(const ss_lamp_asked *a, const group *g, void *ctx) {
    blockers *b = ctx;
    doubles gap;
    longs hit;
    blocking(a, g, &gap, &hit);
    b->sum += (doubles)(hit & (longs)gap), b->count -= hit; /* a mask is -1 */
}

bool RUNG(ss_lamp_blockers)(const ss_lamp_asked *a, double *mean) {
    blockers b = {{0}, {0}};
    int64_t n = 0;
    walk(a, INFINITY, add_blockers, NULL, &b);
    for (int i = 0; i < EIGHT; i++) n += b.count[i];
    *mean = n ? sum_of(&b.sum) / (double)n : 0;
    return n > 0;
}

typedef struct filter {
    doubles sum;
    double gap, whole; /* whole: of a sample wholly before the lamp */
} filter;

INLINE void add_filtered(const ss_lamp_asked *a, const group *g, void *ctx) {
    filter *f = ctx;
    const doubles gap = ALL(f->gap);
    doubles own;
    longs blocks, hit, inside;
    blocking(a, g, &own, &blocks);
    compare(a, g, &gap, &hit, &inside);
    inside &= blocks, hit &= blocks & ~inside;
    f->sum += (doubles)(inside & (longs)ALL(f->whole));
    for (uint32_t left = bits_of(&hit); left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        f->sum[k] += clipped(a, g, k, f->gap);
    }
}

double RUNG(ss_lamp_filter)(const ss_lamp_asked *a, double gap) {
    const double side = a->kernel->step / gap;
    filter f = {{0}, gap, side * side * a->view->area};
    walk(a, INFINITY, add_filtered, NULL, &f);
    const double sum = sum_of(&f.sum);
    return sum < 1 - SS_LAMP_NOTHING ? sum : 1;
}

/* ---- backprojection -------------------------------------------------------------------------- */

/* One layer of samples that are still open. */
INLINE void add_layer(const ss_lamp_asked *a, const group *g, uint32_t layer, longs *open,
                      doubles *sum) {
    const int32_t channels = 2 * (int32_t)a->layers;
    const float *row = a->texels + g->first * (size_t)channels;
    const float step = (float)a->kernel->step;
    ss_eight depth, compared;
    load(g, row + layer, channels, &depth), load(g, row + a->layers + layer, channels, &compared);
    /* a patch of step x step texels needs as many times the bias */
    const ss_eight_ints above = depth + (compared - depth) * step < a->h;
    const longs below = *open & __builtin_convertvector(above, longs);
    if (!bits_of(&below)) return;
    const doubles own = (double)a->h - __builtin_convertvector(depth, doubles);
    const doubles gap = PICK(own > a->view->least, own, ALL(a->view->least));
    longs hit, inside;
    compare(a, g, &gap, &hit, &inside);
    const double size = (double)a->kernel->step * a->kernel->step * a->view->area;
    const doubles whole = size / (gap * gap);
    inside &= below & (whole > SS_LAMP_NOTHING), hit &= below & ~inside;
    *sum += (doubles)(inside & (longs)whole);
    *open &= ~inside;
    for (uint32_t left = bits_of(&hit); left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        const double hidden = clipped(a, g, k, gap[k]);
        if (hidden > SS_LAMP_NOTHING) (*sum)[k] += hidden, (*open)[k] = 0;
    }
}

INLINE void add_patches(const ss_lamp_asked *a, const group *g, void *ctx) {
    longs open = g->in;
    for (uint32_t l = a->layers; l-- > 0;) add_layer(a, g, l, &open, ctx);
}

INLINE bool all_hidden(const void *ctx) { return sum_of(ctx) >= 1 - SS_LAMP_NOTHING; }

double RUNG(ss_lamp_patches)(const ss_lamp_asked *a) {
    doubles sum = {0};
    walk(a, INFINITY, add_patches, all_hidden, &sum);
    const double all = sum_of(&sum);
    return all < 1 - SS_LAMP_NOTHING ? all : 1;
}
