/* What plates hide from sixteen points at once, for each instruction set: include lanes_*.h and
 * define RUNG first. Sums and products are rounded apart (f_fma is slow in plain C, and would not
 * be the same as both).
 *
 * Around the light's middle, in its own units, a plate is a polygon and the light a disk, say. An
 * edge is at distance h of the middle, along a line from s = a to b, of which the disk has the part
 * from c to d = a, b within +-sqrt(1 - h^2). To the polygon's area on the disk it adds
 *     h (d - c) / 2 + angle(a, c) / 2 + angle(d, b) / 2,
 * the triangle between the middle and that part, and sectors for what is outside. There, ends are
 * at 1 or farther from the middle: no angle is ever that of a short vector. All angles are summed
 * as one product of complex numbers, so that there is one arc tangent a polygon. Lines come from
 * the corners' homogeneous coordinates, so that a corner behind the point is no more than an edge's
 * end at infinity. For a square the area is an integral over rows, edge by edge. */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "coverage/plates.h"
#include "trace/contact.h"

#define LANES  16
/* Of the light's radius: drawing never sees what is that far beside it. A sixteenth of this would
 * make lit points a fifth cheaper, but views in floats are off by more than that where a corner is
 * near. */
#define SPARE  0x1p-5
#define FINE   0x1p-21f   /* of lengths: what floats and their sums are off by */
#define ROUND  0x1p-17f   /* of an area, likewise */
#define FARTHEST 0x1p+17f /* of the light's radii: as good as infinitely far */
#define GRAZING 0x1p-4f   /* sine at which a flat light may be seen */
#define LEAST_SINE 0.01f  /* of the light's height over a plate that points lie on */
#define LEAST_T 0x1p-20f  /* of the way to the light */

typedef struct eye {
    vf p[3], to[3];      /* the points; from them to the light's middle */
    vf length, inverse2; /* of `to`; one over its square */
    vf a[3], b[3], k[3], shift[2]; /* on the light: (y a / y k - shift); how far along: y k */
    vf t_end, cosine2, steep, slant, size; /* size: of p, as a sum */
    vf margin;           /* to planes, within which contact has to decide */
    vm fine;
} eye;

static inline vf dot(const vf a[3], const vf b[3]) {
    return f_add(f_add(f_mul(a[0], b[0]), f_mul(a[1], b[1])), f_mul(a[2], b[2]));
}

static inline void set_all(const float from[3], vf to[3]) {
    for (int k = 0; k < 3; k++) to[k] = f_set(from[k]);
}

/* [DBC17]: Duff et al., "Building an Orthonormal Basis, Revisited". */
static inline void set_basis(const vf n[3], vf scale, vf a[3], vf b[3]) {
    const vf one = f_set(1), minus = f_set(-1);
    const vf sign = f_blend(f_lt(n[2], f_set(0)), one, minus);
    const vf q = f_div(minus, f_add(sign, n[2])), m = f_mul(f_mul(n[0], n[1]), q);
    a[0] = f_mul(scale, f_add(one, f_mul(f_mul(sign, q), f_mul(n[0], n[0]))));
    a[1] = f_mul(scale, f_mul(sign, m));
    a[2] = f_mul(scale, f_mul(f_sub(f_set(0), sign), n[0]));
    b[0] = f_mul(scale, m);
    b[1] = f_mul(scale, f_add(sign, f_mul(f_mul(n[1], n[1]), q)));
    b[2] = f_mul(scale, f_sub(f_set(0), n[1]));
}

/* Only what telling lit points by balls needs. */
static inline void open_eye(const ss_plates *l, const double *const at[3], double ulp, eye *e) {
    _Alignas(64) float p[3][LANES];
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < LANES; i++) p[k][i] = (float)at[l->axis[k]][i];
        e->p[k] = f_load(p[k]);
        e->to[k] = l->sun ? f_set(l->normal[k]) : f_sub(f_set(l->centre[k]), e->p[k]);
    }
    const vf square = dot(e->to, e->to);
    e->inverse2 = f_invert(square);
    e->length = f_sqrt(square);
    e->cosine2 = f_sub(f_set(1), f_mul(f_mul(f_set(l->ball), f_set(l->ball)), e->inverse2));
    e->size = f_add(f_add(f_abs(e->p[0]), f_abs(e->p[1])), f_abs(e->p[2]));
    e->margin = f_add(f_set(2 * (float)SS_NEAR),
                      f_mul(f_set(16 * (float)ulp + 0x1p-22f),
                            f_add(f_set(l->size + 1), e->size)));
    e->fine = m_and(f_lt(f_set(0x1p-6f), e->cosine2), f_lt(e->size, f_set(0x1p+20f)));
}

/* The rest. */
static inline void set_view(const ss_plates *l, eye *e) {
    if (l->sphere) {
        const vf inverse = f_mul(e->length, e->inverse2);
        const vf sine = f_mul(f_set(l->radius), inverse);
        e->t_end = f_sub(f_set(1), f_mul(sine, sine));
        e->steep = f_div(f_sqrt(e->t_end), f_set(l->radius));
        vf n[3];
        for (int k = 0; k < 3; k++) {
            n[k] = f_mul(e->to[k], inverse), e->k[k] = f_mul(e->to[k], e->inverse2);
        }
        set_basis(n, e->steep, e->a, e->b);
        e->shift[0] = e->shift[1] = f_set(0), e->slant = f_set(1);
        return;
    }
    vf n[3];
    set_all(l->normal, n);
    set_all(l->a, e->a);
    set_all(l->b, e->b);
    e->steep = f_set(l->steep);
    if (l->sun) {
        for (int k = 0; k < 3; k++) e->k[k] = n[k];
        e->shift[0] = e->shift[1] = f_set(0), e->slant = f_set(1), e->t_end = f_set(1e30f);
        return;
    }
    const vf height = dot(n, e->to), turn = f_invert(height);
    for (int k = 0; k < 3; k++) e->k[k] = f_mul(n[k], turn);
    e->shift[0] = dot(e->a, e->to), e->shift[1] = dot(e->b, e->to);
    e->slant = f_abs(f_mul(e->length, turn)), e->t_end = f_set(1);
    e->fine = m_and(e->fine, f_lt(e->slant, f_set(1 / GRAZING)));
}

/* Over the plane, in double: whether a point touches it is decided by that. */
static inline vf height_over(const ss_plates *l, const ss_plate *plate, const double *const at[3]) {
    _Alignas(64) float height[LANES];
    const double *x = at[l->axis[0]], *y = at[l->axis[1]], *z = at[l->axis[2]];
    for (int i = 0; i < LANES; i++) {
        height[i] = (float)(plate->normal[0] * x[i] + plate->normal[1] * y[i] +
                            plate->normal[2] * z[i] - plate->offset);
    }
    return f_load(height);
}

/* Lanes from which the plate is in nobody's way, because point and light are on one side of it, the
 * point perhaps on it (floor.h). */
static inline vm is_over(const ss_plates *l, const ss_plate *plate, const eye *e, vf height,
                         double ulp) {
    const vf lowest = f_set(plate->lowest);
    const vf way = f_add(f_mul(e->length, f_set(l->finite * 1.001f)), f_set(l->reach));
    const vm high = f_le(f_mul(way, f_set(LEAST_SINE)), lowest);
    const vf least = f_mul(lowest, f_set(-1.99f * (float)ulp));
    return m_and(high, f_le(least, f_mul(height, f_add(way, lowest))));
}

/* Lanes from which a ball around the plate is beside the cone from the point to a ball around the
 * light: its middle is g of the way along, and farther from the axis than the cone there and the
 * ball reach. */
static inline vm is_beside(const ss_plates *l, const ss_plate *plate, const eye *e) {
    vf m[3];
    for (int k = 0; k < 3; k++) m[k] = f_sub(f_set(plate->middle[k]), e->p[k]);
    const vf along = dot(m, e->to), g = f_mul(along, e->inverse2), square = dot(m, m);
    const vf off = f_sub(square, f_mul(g, along));
    const vf reach = f_add(f_set(plate->radius + 0x1p-13f),
                           f_mul(f_set(l->ball), f_max(g, f_set(0))));
    const vf room = f_mul(f_add(square, f_mul(e->size, e->size)), f_set(0x1p-18f));
    return f_lt(f_mul(reach, reach), f_sub(f_mul(off, e->cosine2), room));
}

/* A plate's corners as seen on the light, times t: how far along the way they are. */
typedef struct outline {
    vf x[SS_PLATE_CORNERS], y[SS_PLATE_CORNERS], t[SS_PLATE_CORNERS], per[SS_PLATE_CORNERS]; /* 1 / t */
    vf most[SS_PLATE_CORNERS], off[SS_PLATE_CORNERS]; /* x, y, t: no more; what they are off by */
    vm behind[SS_PLATE_CORNERS]; /* the point: seen, if at all, infinitely far away */
    uint32_t corners;
    bool mixed; /* some are behind in some lane */
} outline;

/* From the points: subtracted in double, so that it is as precise for what is near. */
static inline void way_to(const ss_plates *l, const double corner[3], const double *const at[3],
                          vf way[3]) {
    for (int k = 0; k < 3; k++) {
        _Alignas(64) float to[LANES];
        const double *from = at[l->axis[k]];
        for (int i = 0; i < LANES; i++) to[i] = (float)(corner[k] - from[i]);
        way[k] = f_load(to);
    }
}

static inline vf sum_of(const vf a[3]) {
    return f_add(f_add(f_abs(a[0]), f_abs(a[1])), f_abs(a[2]));
}

/* between, away: all of it is, or none, between the points' planes and the light. */
static inline void see(const ss_plates *l, const ss_plate *plate, const double *const at[3],
                       const eye *e, uint32_t lanes, outline *o, vm *between, vm *away) {
    vf first = f_set(1e30f), last = f_set(-1e30f);
    vm any = m_from(0);
    const vf near = f_div(e->slant, e->length), fine = f_mul(f_set(FINE), e->slant);
    /* What y is off by, times the axes; and these, which are those of a light as far off as it
     * is. */
    const vf of_way = f_mul(fine, f_add(e->steep, near)),
             of_axes = f_mul(fine, f_add(f_mul(f_set(l->far), near), f_set(1)));
    o->corners = plate->corners;
    for (uint32_t c = 0; c < plate->corners; c++) {
        vf y[3];
        way_to(l, plate->corner[c], at, y);
        const vf t = dot(y, e->k);
        o->t[c] = t, o->per[c] = f_invert(t);
        o->x[c] = f_sub(dot(y, e->a), f_mul(t, e->shift[0]));
        o->y[c] = f_sub(dot(y, e->b), f_mul(t, e->shift[1]));
        o->behind[c] = f_lt(t, f_set(LEAST_T)), any = m_or(any, o->behind[c]);
        first = f_min(first, t), last = f_max(last, t);
        o->most[c] = f_max(f_max(f_abs(o->x[c]), f_abs(o->y[c])), f_abs(t));
        o->off[c] = f_add(f_mul(of_way, sum_of(y)), f_mul(of_axes, o->most[c]));
    }
    const vf room = f_mul(f_set(0x1p-16f), f_add(f_set(1), f_mul(near, f_add(e->size, f_set(2)))));
    *between = f_lt(last, f_sub(e->t_end, room));
    *away = m_or(f_lt(last, f_sub(f_set(0), room)), f_lt(f_add(e->t_end, room), first));
    o->mixed = m_bits(any) & lanes;
}

/* Lanes where all corners are beyond one side of a square around the light: whether they are behind
 * or not, whatever is between them is so, too. */
static inline vm is_aside(const outline *o, float reach) {
    vm left = m_from(0xffff), right = left, below = left, above = left;
    for (uint32_t c = 0; c < o->corners; c++) {
        const vf off = f_add(o->off[c], o->off[c]), side = f_mul(f_set(reach), o->t[c]);
        const vf far = f_add(side, off), near = f_sub(f_sub(f_set(0), side), off);
        left = m_and(left, f_lt(o->x[c], near)), right = m_and(right, f_lt(far, o->x[c]));
        below = m_and(below, f_lt(o->y[c], near)), above = m_and(above, f_lt(far, o->y[c]));
    }
    return m_or(m_or(left, right), m_or(below, above));
}

/* The edge from corner c on, as a line at distance h of the light's middle, on whose left the
 * middle is if h > 0, from `begin` to `end` along the unit vector (x, y), of which it is near from
 * `from` to `to`. */
typedef struct side {
    vf x, y, h, begin, end, from, to;
    vm none; /* both ends are behind */
} side;

static inline vf within(vf x, vf most) { return f_min(f_max(x, f_sub(f_set(0), most)), most); }

/* limit: the square of what is near. *error: of the edge where it is. */
static inline side side_of(const outline *o, uint32_t c, vf limit, vf *error) {
    const uint32_t n = c + 1 < o->corners ? c + 1 : 0;
    const vf zero = f_set(0), far = f_set(FARTHEST);
    const vf x = f_sub(f_mul(o->y[c], o->t[n]), f_mul(o->t[c], o->y[n]));
    const vf y = f_sub(f_mul(o->t[c], o->x[n]), f_mul(o->x[c], o->t[n]));
    const vf z = f_sub(f_mul(o->x[c], o->y[n]), f_mul(o->y[c], o->x[n]));
    const vf size = f_sqrt(f_add(f_mul(x, x), f_mul(y, y)));
    const vf least = f_max(f_mul(f_abs(z), f_set(1.0f / FARTHEST)), f_set(1e-18f));
    const vf per = f_invert(f_max(size, least));
    side s; /* 512 bytes that need no clearing */
    s.x = f_mul(y, per), s.y = f_mul(f_sub(zero, x), per), s.h = f_mul(z, per);
    s.begin = within(f_mul(f_add(f_mul(o->x[c], s.x), f_mul(o->y[c], s.y)), o->per[c]), far);
    s.end = within(f_mul(f_add(f_mul(o->x[n], s.x), f_mul(o->y[n], s.y)), o->per[n]), far);
    s.none = m_from(0);
    if (o->mixed) {
        s.begin = f_blend(o->behind[c], s.begin, f_sub(zero, far));
        s.end = f_blend(o->behind[n], s.end, far);
        s.none = m_and(o->behind[c], o->behind[n]);
        s.begin = f_blend(s.none, s.begin, zero), s.end = f_blend(s.none, s.end, zero);
    }
    const vf k = f_sqrt(f_max(f_sub(limit, f_mul(s.h, s.h)), zero));
    s.from = within(s.begin, k), s.to = within(s.end, k);
    const vf corner = f_max(f_blend(f_le(s.from, s.begin), f_mul(o->off[c], o->per[c]), zero),
                            f_blend(f_le(s.end, s.to), f_mul(o->off[n], o->per[n]), zero));
    const vf turned = f_add(f_mul(o->off[c], o->most[n]), f_mul(o->off[n], o->most[c]));
    const vf wrong = f_add(f_mul(f_mul(f_set(3), turned), per), corner);
    *error = f_max(*error, f_blend(f_lt(s.from, s.to), zero, wrong));
    return s;
}

/* Lanes that see the corners go clockwise. */
static inline vm faces_back(const outline *o) {
    const vf x[3] = {o->x[0], o->y[0], o->t[0]};
    const vf n[3] = {f_sub(f_mul(o->y[1], o->t[2]), f_mul(o->t[1], o->y[2])),
                     f_sub(f_mul(o->t[1], o->x[2]), f_mul(o->x[1], o->t[2])),
                     f_sub(f_mul(o->x[1], o->y[2]), f_mul(o->y[1], o->x[2]))};
    return f_lt(dot(x, n), f_set(0));
}

/* Lanes where the outline has the light's middle inside, and where something of it is near. */
static inline void place_outline(const outline *o, const side *sides, vm back, vm *inside,
                                 vm *near) {
    vm left = m_from(0xffff), right = left;
    const vf zero = f_set(0);
    *near = m_from(0);
    for (uint32_t c = 0; c < o->corners; c++) {
        const side *s = &sides[c];
        left = m_and(left, f_lt(zero, s->h)), right = m_and(right, f_lt(s->h, zero));
        *near = m_or(*near, m_andnot(f_lt(s->from, s->to), s->none));
    }
    *inside = m_or(m_and(right, back), m_andnot(left, back));
}

/* Of r in 0..1, to 2^-22; a minimax polynomial of its odd powers, good to 4e-8. */
static inline vf arc_tangent(vf r) {
    static const float of[] = {-0.00405456745f, 0.0218629587f, -0.0559123279f, 0.0964219741f,
                               -0.139086296f,   0.199465657f,  -0.333298608f,  0.999999336f};
    const vf square = f_mul(r, r);
    vf sum = f_set(of[0]);
    for (int i = 1; i < 8; i++) sum = f_add(f_mul(sum, square), f_set(of[i]));
    return f_mul(sum, r);
}

/* The angle of x + i y in -pi..pi. */
static inline vf angle_of(vf x, vf y) {
    const vf u = f_abs(x), v = f_abs(y), zero = f_set(0);
    const vf low = f_min(u, v), high = f_max(f_max(u, v), f_set(1e-30f));
    vf angle = arc_tangent(f_div(low, high));
    angle = f_blend(f_lt(u, v), angle, f_sub(f_set(1.57079633f), angle));
    angle = f_blend(f_lt(x, zero), angle, f_sub(f_set(3.14159265f), angle));
    return f_blend(f_lt(y, zero), angle, f_sub(zero, angle));
}

typedef struct turn {
    vf x, y;
} turn;

static inline turn times(turn a, turn b) {
    return (turn){f_sub(f_mul(a.x, b.x), f_mul(a.y, b.y)), f_add(f_mul(a.x, b.y), f_mul(a.y, b.x))};
}

/* Between two places on a line: outside the disk the product is 1 or more, and inside nothing is
 * asked. */
static inline turn turn_between(vf h, vf at, vf to) {
    const vf ahead = f_add(f_mul(h, h), f_mul(at, to));
    return (turn){f_max(ahead, f_set(0.5f)), f_mul(h, f_sub(to, at))};
}

static inline turn pick(vm which, turn a, turn b) {
    return (turn){f_blend(which, a.x, b.x), f_blend(which, a.y, b.y)};
}

/* The part of the rim that an edge passes. */
static inline turn turn_of(const outline *o, uint32_t c, const side *s) {
    turn before = turn_between(s->h, s->begin, s->from), after = turn_between(s->h, s->to, s->end);
    if (o->mixed) {
        const turn from = {f_sub(f_set(0), s->from), s->h}, to = {s->to, s->h};
        before = pick(o->behind[c], before, from);
        after = pick(o->behind[c + 1 < o->corners ? c + 1 : 0], after, to);
    }
    turn all = times(before, after);
    const vf per = f_invert(f_max(f_add(f_abs(all.x), f_abs(all.y)), f_set(1e-30f)));
    all.x = f_mul(all.x, per), all.y = f_mul(all.y, per);
    return o->mixed ? pick(s->none, all, (turn){f_set(1), f_set(0)}) : all;
}

/* Where an edge leaves for infinity and the next comes from there: the way between is as one that
 * leaves for the first axis, and one that comes from it. */
static inline turn turn_around(const outline *o, uint32_t c, const side *s) {
    const turn one = {f_set(1), f_set(0)};
    const vf zero = f_set(0);
    const vm from = m_andnot(o->behind[c], s->none),
             to = m_andnot(o->behind[c + 1 < o->corners ? c + 1 : 0], s->none);
    return times(pick(from, one, (turn){f_sub(zero, s->x), f_sub(zero, s->y)}),
                 pick(to, one, (turn){s->x, f_sub(zero, s->y)}));
}

/* The share of the disk that the outline covers. The angles' sum is how much of the rim is inside
 * the outline. That it is a whole turn or nearly, not none, shows by one of the edges around the
 * middle having more than 31 degrees of it. */
static inline vf disk_share(const outline *o, const side *sides, vm back, vm inside) {
    turn all = {f_set(1), f_set(0)};
    vf flat = f_set(0);
    vm wide = m_from(0);
    for (uint32_t c = 0; c < o->corners; c++) {
        const side *s = &sides[c];
        const turn here = turn_of(o, c, s);
        flat = f_add(flat, f_mul(s->h, f_sub(s->to, s->from)));
        wide = m_or(wide, f_lt(f_mul(here.x, f_set(0.6f)), f_abs(here.y)));
        all = times(all, here);
        if (o->mixed) all = times(all, turn_around(o, c, s));
    }
    flat = f_blend(back, flat, f_sub(f_set(0), flat));
    all.y = f_blend(back, all.y, f_sub(f_set(0), all.y));
    vf angle = angle_of(all.x, all.y);
    const vm beyond = m_or(m_and(m_and(inside, wide), f_lt(angle, f_set(0.25f))),
                           f_lt(angle, f_set(-1)));
    angle = f_blend(beyond, angle, f_add(angle, f_set(6.28318531f)));
    return f_mul(f_add(flat, angle), f_set(0.159154943f)); /* 1 / 2 pi */
}

static inline vf clamp(vf x) { return f_min(f_max(x, f_set(-1)), f_set(1)); }
static inline vf share_of(vf part, vf all) {
    return f_min(f_max(f_div(part, all), f_set(0)), f_set(1));
}

/* Likewise of the square [-1, 1]^2: each edge has what is to its right in its rows. */
static inline vf square_share(const outline *o) {
    const vf one = f_set(1), least = f_set(1e-12f);
    vf sum = f_set(0);
    for (uint32_t c = 0; c < o->corners; c++) {
        const uint32_t n = c + 1 < o->corners ? c + 1 : 0;
        const vf x = f_mul(o->x[c], o->per[c]), y = f_mul(o->y[c], o->per[c]),
                 next_x = f_mul(o->x[n], o->per[n]), next_y = f_mul(o->y[n], o->per[n]),
                 rise = f_sub(next_y, y);
        const vf steep = f_blend(f_lt(f_abs(rise), least), rise, least);
        const vf slope = f_div(f_sub(next_x, x), steep);
        const vf from = clamp(y), to = clamp(next_y);
        const vf left = f_min(x, next_x), right = f_max(x, next_x);
        const vf u = f_min(f_max(f_add(x, f_mul(f_sub(from, y), slope)), left), right);
        const vf v = f_min(f_max(f_add(x, f_mul(f_sub(to, y), slope)), left), right);
        const vf low = f_min(u, v), high = f_max(u, v), width = f_max(f_sub(high, low), least);
        const vf before = share_of(f_sub(f_set(-1), low), width),
                 after = share_of(f_sub(high, one), width);
        const vf middle = f_mul(f_set(0.5f), f_add(clamp(low), clamp(high)));
        const vf on = f_mul(f_sub(one, f_add(before, after)), f_sub(one, middle));
        sum = f_add(sum, f_mul(f_sub(to, from), f_add(f_add(before, before), on)));
    }
    return f_mul(f_abs(sum), f_set(0.25f));
}

typedef struct sums {
    vf hidden, error; /* of the light; by how much at most that is wrong */
    uint32_t open;    /* lanes that are not told */
} sums;

/* One plate more. Where two hide something nobody says how much both do, unless one hides all. */
static inline void add_plate(const ss_plates *l, const ss_plate *plate, const double *const at[3],
                             const eye *e, uint32_t lanes, vm clear, float most, sums *sum) {
    outline o;
    side sides[SS_PLATE_CORNERS];
    vm between, away, inside, touches;
    const vf one = f_set(1);
    const float spare = most > 0 ? 1 : 1 + SPARE;
    const vf limit = f_set(spare * spare * (l->square ? 2 : 1));
    vf wrong = f_set(0);
    see(l, plate, at, e, lanes, &o, &between, &away);
    lanes &= ~m_bits(m_and(clear, m_or(away, is_aside(&o, spare))));
    if (!lanes) return;
    for (uint32_t c = 0; c < o.corners; c++) sides[c] = side_of(&o, c, limit, &wrong);
    const vm back = faces_back(&o);
    place_outline(&o, sides, back, &inside, &touches);
    const uint32_t good = m_bits(m_and(clear, between));
    sum->open |= lanes & ~good;
    lanes &= good & m_bits(m_or(inside, touches));
    if (!lanes) return;
    if (!(most > 0)) {
        sum->open |= lanes;
        return;
    }
    vf share = one;
    uint32_t part = lanes & m_bits(touches);
    if (l->square && o.mixed) sum->open |= part, lanes &= ~part, part = 0;
    if (part) {
        share = l->square ? square_share(&o) : disk_share(&o, sides, back, inside);
        share = f_blend(f_lt(share, f_set(ROUND)), share, f_set(0));
        share = f_blend(f_lt(f_set(1 - ROUND), share), share, one);
        share = f_blend(touches, one, share);
    }
    const vm here = m_from(lanes);
    share = f_blend(here, f_set(0), share);
    const vm any = f_lt(f_set(0), share), both = m_and(any, f_lt(f_set(0), sum->hidden));
    const vf hidden = f_max(sum->hidden, share);
    sum->open |= m_bits(m_and(both, f_lt(hidden, one)));
    sum->hidden = hidden;
    const vf error = f_add(f_add(wrong, wrong), f_set(ROUND));
    sum->error = f_max(sum->error, f_blend(here, f_set(0), error));
}

static inline uint32_t tell_lanes(const ss_plates *l, const double *const at[3], double ulp,
                                  float most, float *visibility, float *bound) {
    eye e;
    sums sum = {f_set(0), f_set(0), 0};
    bool seen = false;
    open_eye(l, at, ulp, &e);
    for (uint32_t i = 0; i < l->count; i++) {
        const ss_plate *plate = &l->plate[i];
        uint32_t lanes = ~m_bits(is_beside(l, plate, &e)) & 0xffff;
        if (!lanes) continue;
        const vf height = height_over(l, plate, at);
        if (plate->beneath) lanes &= ~m_bits(is_over(l, plate, &e, height, ulp));
        if (!lanes) continue;
        if (!seen) set_view(l, &e);
        seen = true;
        add_plate(l, plate, at, &e, lanes, f_lt(e.margin, f_abs(height)), most, &sum);
    }
    f_store(visibility, f_sub(f_set(1), sum.hidden));
    f_store(bound, sum.error);
    const vm sure = m_or(f_le(sum.error, f_set(most)), f_le(f_set(1), f_set(0)));
    return m_bits(m_and(e.fine, sure)) & ~sum.open;
}

static inline void keep(const float *from, size_t count, float *to) {
    if (count == LANES) memcpy(to, from, LANES * sizeof *to);
    for (size_t j = 0; j < count && count < LANES; j++) to[j] = from[j];
}

void RUNG(ss_plates_tell)(const ss_plates *plates, const ss_places *places, size_t n, double ulp,
                          float most, float *visibility, float *bound, ss_plates_told *told) {
    *told = (ss_plates_told){0, 0, 0};
    for (size_t i = 0; i < n; i += LANES) {
        _Alignas(64) float answer[LANES], error[LANES];
        const double *at[3] = {places->at[0] + i, places->at[1] + i, places->at[2] + i};
        const size_t count = n - i < LANES ? n - i : LANES;
        double last[3][LANES];
        for (int k = 0; k < 3 && count < LANES; k++) { /* the last again */
            for (size_t j = 0; j < LANES; j++) last[k][j] = at[k][j < count ? j : count - 1];
            at[k] = last[k];
        }
        const uint32_t asked = 0xffffu >> (LANES - count);
        const uint64_t here = tell_lanes(plates, at, ulp, most, answer, error) & asked;
        const vf seen = f_load(answer);
        told->all |= here << i;
        told->lit |= (here & m_bits(f_le(f_set(1), seen))) << i;
        told->dark |= (here & m_bits(f_le(seen, f_set(0)))) << i;
        keep(answer, count, visibility + i);
        if (bound) keep(error, count, bound + i);
    }
}
