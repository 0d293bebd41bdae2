/* A triangle hides the samples (s, t) of the light where four linear functions are positive: one
 * for each edge as the point sees it, one for what lies before the light's surface. Blocks of
 * samples that lie together are left out where one of the four is negative on their whole box. */
#include "brute.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 64 };

struct brute {
    const peer_mesh *mesh;
    const softshadow_light *light;
    uint32_t count, blocks;
    double *s, *t;  /* count: as the light has them, block after block along a curve */
    double *u, *v;  /* count: shifted for the point at hand (a rectangle) */
    double *box;    /* blocks x 4: middle s, t; half s, t */
    double *hidden; /* count: positive where something is before the sample */
};

typedef struct place {
    double s, t;
    uint64_t key;
} place;

static int by_key(const void *a, const void *b) {
    const uint64_t x = ((const place *)a)->key, y = ((const place *)b)->key;
    return (x > y) - (x < y);
}

static uint64_t interleave(double s, double t) {
    const uint32_t x = (uint32_t)(s * 65535), y = (uint32_t)(t * 65535);
    uint64_t key = 0;
    for (int bit = 0; bit < 16; bit++)
        key |= (uint64_t)(x >> bit & 1) << (2 * bit) | (uint64_t)(y >> bit & 1) << (2 * bit + 1);
    return key;
}

/* The lattice of the plastic number, as the truth by rays has it. */
static bool fill(brute *b) {
    place *all = malloc(b->count * sizeof *all);
    if (!all) return false;
    for (uint32_t i = 0; i < b->count; i++) {
        const double u = fmod(0.5 + i * 0.75487766624669276, 1),
                     v = fmod(i * 0.56984029099805327, 1);
        const double r = sqrt(u), turn = 6.28318530717958647693 * v;
        const bool disk = b->light->type != SOFTSHADOW_RECT;
        all[i].s = disk ? r * cos(turn) : 2 * u - 1, all[i].t = disk ? r * sin(turn) : 2 * v - 1;
        all[i].key = interleave(all[i].s / 2 + 0.5, all[i].t / 2 + 0.5);
    }
    qsort(all, b->count, sizeof *all, by_key);
    for (uint32_t i = 0; i < b->count; i++) b->s[i] = all[i].s, b->t[i] = all[i].t;
    free(all);
    return true;
}

static void bound(const brute *b, const double *s, const double *t) {
    for (uint32_t k = 0; k < b->blocks; k++) {
        double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
        for (uint32_t i = k * BLOCK; i < (k + 1) * BLOCK; i++) {
            low[0] = fmin(low[0], s[i]), high[0] = fmax(high[0], s[i]);
            low[1] = fmin(low[1], t[i]), high[1] = fmax(high[1], t[i]);
        }
        for (int a = 0; a < 2; a++) {
            b->box[4 * k + (uint32_t)a] = (low[a] + high[a]) / 2;
            b->box[4 * k + 2 + (uint32_t)a] = (high[a] - low[a]) / 2 + 1e-12;
        }
    }
}

brute *brute_create(const peer_mesh *mesh, const softshadow_light *light, uint32_t samples) {
    brute *b = calloc(1, sizeof *b);
    if (!b) return NULL;
    b->mesh = mesh, b->light = light;
    b->count = samples / BLOCK * BLOCK, b->blocks = samples / BLOCK;
    double **const arrays[] = {&b->s, &b->t, &b->u, &b->v, &b->box, &b->hidden};
    bool fine = true;
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
        fine = (*arrays[i] = calloc(b->count, sizeof(double))) && fine;
    if (fine && fill(b)) {
        bound(b, b->s, b->t);
        return b;
    }
    brute_destroy(b);
    return NULL;
}

void brute_destroy(brute *b) {
    if (!b) return;
    free(b->s), free(b->t), free(b->u), free(b->v);
    free(b->box), free(b->hidden);
    free(b);
}

/* ---- What a point sees ----------------------------------------------------------------------*/

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Two axes of that length across n. */
static void across(const double n[3], double length, double a[3], double b[3]) {
    const double size = sqrt(dot(n, n));
    const double least[3] = {fabs(n[0]) < 0.6 * size, fabs(n[0]) >= 0.6 * size, 0};
    cross(n, least, a);
    const double k = length / sqrt(dot(a, a));
    for (int i = 0; i < 3; i++) a[i] *= k;
    cross(n, a, b);
    for (int i = 0; i < 3; i++) b[i] /= size;
}

typedef struct outlook {
    double centre[3], a[3], b[3], end;
} outlook;

static void see(const softshadow_light *light, const double p[3], outlook *o) {
    o->end = 1;
    for (int k = 0; k < 3; k++) o->centre[k] = light->position[k] - p[k];
    if (light->type == SOFTSHADOW_RECT) {
        memcpy(o->a, light->u, sizeof o->a), memcpy(o->b, light->v, sizeof o->b);
    } else if (light->type == SOFTSHADOW_DISK) {
        across(light->direction, light->radius, o->a, o->b);
    } else if (light->type == SOFTSHADOW_SPHERE) {
        const double square = dot(o->centre, o->centre), r = light->radius;
        o->end = 1 - r * r / square;
        across(o->centre, r / sqrt(o->end), o->a, o->b);
    } else {
        const double size = sqrt(dot(light->direction, light->direction));
        for (int k = 0; k < 3; k++) o->centre[k] = -light->direction[k] / size;
        across(o->centre, tan(light->radius), o->a, o->b);
        o->end = INFINITY;
    }
}

/* f = value + s along_s + t along_t */
typedef struct linear {
    double value, s, t;
} linear;

static linear project(const double n[3], double factor, const outlook *o) {
    return (linear){factor * dot(n, o->centre), factor * dot(n, o->a), factor * dot(n, o->b)};
}

/* false: it is beside the light, behind it, or edge on. */
static bool prepare(const peer_mesh *mesh, size_t triangle, const double p[3], const outlook *o,
                    bool disk, linear f[4]) {
    double v[3][3], n[3], e[3], g[3];
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 3; k++)
            v[c][k] =
                (double)mesh
                    ->positions[3 * (size_t)mesh->indices[3 * triangle + (size_t)c] + (size_t)k] -
                p[k];
    for (int k = 0; k < 3; k++) e[k] = v[1][k] - v[0][k], g[k] = v[2][k] - v[0][k];
    cross(e, g, n);
    const double volume = dot(v[0], n), sign = volume < 0 ? -1 : 1;
    if (volume == 0) return false;
    f[3] = project(n, sign, o);
    if (isfinite(o->end)) {
        f[3].value *= o->end, f[3].s *= o->end, f[3].t *= o->end;
        f[3].value -= fabs(volume);
    }
    for (int c = 0; c < 3; c++) {
        cross(v[c], v[(c + 1) % 3], n);
        f[c] = project(n, sign, o);
    }
    for (int c = 0; c < 4; c++) {
        const double most = disk ? hypot(f[c].s, f[c].t) : fabs(f[c].s) + fabs(f[c].t);
        if (f[c].value + most < 0) return false;
    }
    return true;
}

static double at(const linear *f, double s, double t) { return f->value + s * f->s + t * f->t; }

static void hide(brute *b, const double *s, const double *t, const linear f[4]) {
    for (uint32_t k = 0; k < b->blocks; k++) {
        const double *box = b->box + 4 * k;
        bool beside = false;
        for (int c = 0; c < 4; c++)
            beside |= at(&f[c], box[0], box[1]) + fabs(f[c].s) * box[2] + fabs(f[c].t) * box[3] < 0;
        if (beside) continue;
        for (uint32_t i = k * BLOCK; i < (k + 1) * BLOCK; i++) {
            const double x = at(&f[0], s[i], t[i]), y = at(&f[1], s[i], t[i]);
            const double z = at(&f[2], s[i], t[i]), w = at(&f[3], s[i], t[i]);
            const double least = fmin(fmin(x, y), fmin(z, w));
            b->hidden[i] = fmax(b->hidden[i], least);
        }
    }
}

double brute_visible(brute *b, const float point[3], double turn) {
    const double p[3] = {(double)point[0], (double)point[1], (double)point[2]};
    const bool disk = b->light->type != SOFTSHADOW_RECT;
    const double *s = b->s, *t = b->t;
    outlook o;
    see(b->light, p, &o);
    if (disk) {
        const double c = cos(6.28318530717958647693 * turn), d = sin(6.28318530717958647693 * turn);
        for (int k = 0; k < 3; k++) {
            const double a = o.a[k], e = o.b[k];
            o.a[k] = c * a + d * e, o.b[k] = c * e - d * a;
        }
    } else {
        for (uint32_t i = 0; i < b->count; i++) {
            b->u[i] = 2 * fmod(b->s[i] / 2 + 0.5 + turn, 1) - 1;
            b->v[i] = 2 * fmod(b->t[i] / 2 + 0.5 + 7 * turn, 1) - 1;
        }
        s = b->u, t = b->v;
        bound(b, s, t);
    }
    for (uint32_t i = 0; i < b->count; i++) b->hidden[i] = -1;
    for (size_t i = 0; i < b->mesh->triangle_count; i++) {
        linear f[4];
        if (prepare(b->mesh, i, p, &o, disk, f)) hide(b, s, t, f);
    }
    uint32_t hidden = 0;
    for (uint32_t i = 0; i < b->count; i++) hidden += b->hidden[i] > 0;
    return 1 - (double)hidden / b->count;
}
