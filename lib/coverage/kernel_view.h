/* Sixteen points' views of a light as projective maps (group.h), in double. Plain loops that the
 * compiler turns into whatever registers there are: sums, products, quotients and roots only, in
 * one order, so that every instruction set gets the same bits. */
#ifndef SS_COVERAGE_KERNEL_VIEW_H
#define SS_COVERAGE_KERNEL_VIEW_H

/* Where floats' reach is more than this share of the way to the light, doubles do it. */
#define COARSE 0x1p-6

#define EACH_LANE for (int i = 0; i < SS_LANES; i++)

/* A sphere is seen as the disk through its centre that fills the tangent cone. The frame is that of
 * ss_basis() in closed form: with n's least, middle and most component l, m, o and w^2 = 1 - l^2 it
 * is (w, -l m / w, -l o / w) and (0, |o| / w, -+m / w). */
static inline void rows_of_sphere(const ss_group *g, const ss_light *light, ss_group_views *v) {
    const double *px = v->at[g->axis[0]], *py = v->at[g->axis[1]], *pz = v->at[g->axis[2]];
    const double cx = light->centre[0], cy = light->centre[1], cz = light->centre[2];
    const double radius = light->radius, inverse = 1 / radius, inside = radius * SS_LIGHT_INSIDE;
    _Alignas(64) double within[SS_LANES];
    EACH_LANE {
        const double x = cx - px[i], y = cy - py[i], z = cz - pz[i];
        const double distance = sqrt(x * x + y * y + z * z), near = 1 / distance;
        const double n[3] = {x * near, y * near, z * near};
        const double sine = radius * near, cosine2 = (1 - sine) * (1 + sine);
        const double s0 = fabs(n[0]), s1 = fabs(n[1]), s2 = fabs(n[2]);
        const bool l0 = (s0 <= s1) & (s0 <= s2), l1 = !l0 & (s1 <= s2), l2 = !l0 & !l1;
        const bool o2 = (s2 >= s0) & (s2 >= s1), o1 = !o2 & (s1 >= s0), o0 = !o2 & !o1;
        const double l = l0 ? n[0] : l1 ? n[1] : n[2], o = o0 ? n[0] : o1 ? n[1] : n[2];
        const double m = !(l0 | o0) ? n[0] : !(l1 | o1) ? n[1] : n[2];
        const double w2 = 1 - l * l, scale = sqrt(cosine2 / w2) * inverse;
        const double over = o > 0 ? m : -m;
        v->row[0][0][i] = (l0 ? w2 : -l * n[0]) * scale;
        v->row[0][1][i] = (l1 ? w2 : -l * n[1]) * scale;
        v->row[0][2][i] = (l2 ? w2 : -l * n[2]) * scale;
        v->row[1][0][i] = (l0 ? 0 : o0 ? -over : fabs(o)) * scale;
        v->row[1][1][i] = (l1 ? 0 : o1 ? -over : fabs(o)) * scale;
        v->row[1][2][i] = (l2 ? 0 : o2 ? -over : fabs(o)) * scale;
        v->row[2][0][i] = n[0] * near, v->row[2][1][i] = n[1] * near, v->row[2][2][i] = n[2] * near;
        v->t_end[i] = cosine2;
        within[i] = inside - distance;
    }
    for (int i = 0; i < SS_LANES; i++) v->inside |= (uint32_t)(within[i] >= 0) << i;
}

/* Any light whose half axes are the same for all points: the inverse of (a, b, centre). */
static inline void rows_of_flat(const ss_group *g, const ss_light *light, ss_group_views *v) {
    const double *px = v->at[g->axis[0]], *py = v->at[g->axis[1]], *pz = v->at[g->axis[2]];
    const double *a = light->u, *b = light->v, *n = light->normal, *c = light->centre;
    const bool sun = light->type == SOFTSHADOW_SUN;
    const double across[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                              a[0] * b[1] - a[1] * b[0]};
    _Alignas(64) double above[SS_LANES];
    EACH_LANE {
        const double x = sun ? n[0] : c[0] - px[i], y = sun ? n[1] : c[1] - py[i],
                     z = sun ? n[2] : c[2] - pz[i];
        const double turn = 1 / (x * across[0] + y * across[1] + z * across[2]);
        v->row[0][0][i] = (b[1] * z - b[2] * y) * turn;
        v->row[0][1][i] = (b[2] * x - b[0] * z) * turn;
        v->row[0][2][i] = (b[0] * y - b[1] * x) * turn;
        v->row[1][0][i] = (y * a[2] - z * a[1]) * turn;
        v->row[1][1][i] = (z * a[0] - x * a[2]) * turn;
        v->row[1][2][i] = (x * a[1] - y * a[0]) * turn;
        v->row[2][0][i] = across[0] * turn, v->row[2][1][i] = across[1] * turn;
        v->row[2][2][i] = across[2] * turn;
        v->t_end[i] = sun ? INFINITY : 1;
        above[i] = fabs(n[0] * x + n[1] * y + n[2] * z) -
                   SS_LIGHT_EDGE_ON * (sqrt(x * x + y * y + z * z) + light->radius);
    }
    for (int i = 0; i < SS_LANES && !sun; i++) v->edge_on |= (uint32_t)!(above[i] > 0) << i;
}

/* From the light's coordinates to the grid's, and to float. Gives the lanes where floats will
 * do. */
static inline uint32_t set_maps(ss_group *g, const ss_group_views *v) {
    const double(*grid)[3] = (const double(*)[3])g->lattice->grid;
    _Alignas(64) double spare[SS_LANES];
    for (int r = 0; r < 3; r++) {
        _Alignas(64) double shift[SS_LANES];
        const double gs = r < 2 ? grid[r][0] : 0, gt = r < 2 ? grid[r][1] : 0,
                     gc = r < 2 ? grid[r][2] : 1;
        EACH_LANE shift[i] = 0;
        for (int k = 0; k < 3; k++) {
            const double *p = v->at[g->axis[k]];
            EACH_LANE {
                const double m = gs * v->row[0][k][i] + gt * v->row[1][k][i] + gc * v->row[2][k][i];
                shift[i] -= m * p[i];
                g->matrix[r][k][i] = (float)m;
            }
        }
        EACH_LANE g->shift[r][i] = (float)shift[i];
    }
    EACH_LANE {
        const double reach =
            fabs(v->row[2][0][i]) + fabs(v->row[2][1][i]) + fabs(v->row[2][2][i]);
        const double end = v->t_end[i], near = SS_FLOAT_REACH * reach;
        g->t_near[i] = (float)near;
        g->t_far[i] = (float)(end - SS_FLOAT_REACH * (reach + fabs((double)g->shift[2][i])));
        spare[i] = COARSE * (end < 1 ? end : 1) - near;
    }
    for (int k = 0; k < 3; k++) {
        EACH_LANE g->apart[k][i] = (float)(v->at[k][i] - (double)g->middle[k]);
    }
    uint32_t lanes = 0;
    for (int i = 0; i < SS_LANES; i++) lanes |= (uint32_t)(spare[i] > 0) << i;
    return lanes;
}

static void view_light(ss_group *g, const ss_light *light, ss_group_views *v) {
    v->inside = v->edge_on = 0;
    if (light->type == SOFTSHADOW_SPHERE)
        rows_of_sphere(g, light, v);
    else
        rows_of_flat(g, light, v);
    g->lanes = set_maps(g, v) & ~v->inside & ~v->edge_on;
}

/* The range of t over group->lanes. */
static void enclose_depths(ss_group *g, double reach) {
    const uint32_t lanes = g->lanes;
    const double x = g->middle[g->axis[0]], y = g->middle[g->axis[1]], z = g->middle[g->axis[2]];
    const float(*n)[SS_LANES] = (const float(*)[SS_LANES])g->matrix[2];
    double safe = 0, beyond = INFINITY, least = INFINITY, most = -INFINITY;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    _Alignas(64) double at[SS_LANES], keep[SS_LANES];
    EACH_LANE {
        const double size = fabs((double)n[0][i]) + fabs((double)n[1][i]) + fabs((double)n[2][i]);
        const double one = 4 * (double)g->t_near[i], two = 2 * reach * size;
        at[i] = g->shift[2][i] + n[0][i] * x + n[1][i] * y + n[2][i] * z;
        keep[i] = one > two ? one : two;
    }
    for (uint32_t m = lanes; m; m &= m - 1) {
        const int i = __builtin_ctz(m);
        const double end = (double)g->t_far[i] - 4 * (double)g->t_near[i];
        least = at[i] < least ? at[i] : least, most = at[i] > most ? at[i] : most;
        safe = keep[i] > safe ? keep[i] : safe, beyond = end < beyond ? end : beyond;
        for (int k = 0; k < 3; k++) {
            low[k] = n[k][i] < low[k] ? n[k][i] : low[k];
            high[k] = n[k][i] > high[k] ? n[k][i] : high[k];
        }
    }
    g->t_least = (float)least, g->t_most = (float)most;
    g->t_safe = (float)safe, g->t_beyond = (float)beyond;
    for (int k = 0; k < 3; k++) {
        g->t_axis[g->axis[k]] = (float)((low[k] + high[k]) / 2);
        g->t_spread[g->axis[k]] = (float)((high[k] - low[k]) * 0.5000001);
    }
}

#endif
