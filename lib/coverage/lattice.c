/* Laying the lattice over the light's shape. */
#include "coverage/lattice.h"

#include <math.h>
#include <string.h>

#include "base/memory.h"
#include "base/status.h"

#define FINE         512 /* the shape is measured on a grid of this many squared places */
#define CELL         16  /* weight of a whole cell */
#define PROFILE_UNIT 64  /* a profile's largest weight multiplies by this */

/* The golden ratio's slope, and an origin with no symmetry of the lattice. */
static const double turn[2] = {0.85065080835203993, 0.52573111211913359};
static const double origin[2] = {0.4142135623730951, 0.2679491924311227};

static bool on_shape(bool disk, double s, double t) {
    return disk ? s * s + t * t <= 1 : fabs(s) <= 1 && fabs(t) <= 1;
}

/* Position on the light of lattice point (i, j) when cells have this size. */
static void lattice_point(double size, int i, int j, double *s, double *t) {
    const double x = (i + origin[0]) * size, y = (j + origin[1]) * size;
    *s = turn[0] * x + turn[1] * y;
    *t = -turn[1] * x + turn[0] * y;
}

/* How many lattice points are on the shape, and the range of their indices. */
static uint32_t count_points(bool disk, double size, int low[2], int high[2]) {
    const int reach = (int)(1.5 / size) + 2;
    uint32_t count = 0;
    low[0] = low[1] = reach, high[0] = high[1] = -reach;
    for (int j = -reach; j <= reach; j++) {
        for (int i = -reach; i <= reach; i++) {
            double s, t;
            lattice_point(size, i, j, &s, &t);
            if (!on_shape(disk, s, t)) continue;
            count++;
            if (i < low[0]) low[0] = i;
            if (i > high[0]) high[0] = i;
            if (j < low[1]) low[1] = j;
            if (j > high[1]) high[1] = j;
        }
    }
    return count;
}

/* The cell size that gives exactly `count`: points enter one by one as the lattice shrinks. */
static double fit(bool disk, uint32_t count, int low[2], int high[2]) {
    const double even = sqrt((disk ? M_PI : 4) / count);
    double coarse = even * 1.2, fine = even * 0.8, size = even;
    for (int round = 0; round < 60; round++) {
        const uint32_t found = count_points(disk, size, low, high);
        if (found == count) break;
        if (found < count)
            coarse = size;
        else
            fine = size;
        size = (coarse + fine) / 2;
    }
    return size;
}

static uint32_t word_of(const ss_lattice *samples, int column, int row) {
    const uint32_t block = (uint32_t)(row / SS_BLOCK) * samples->words + (uint32_t)(column / 32);
    return block * SS_BLOCK + (uint32_t)(row % SS_BLOCK);
}

static inline bool is_sample(const ss_lattice *samples, int column, int row) {
    if (column < 0 || row < 0 || column >= (int)samples->words * 32 ||
        row >= (int)samples->row_blocks * SS_BLOCK) {
        return false;
    }
    return !(samples->outside[word_of(samples, column, row)] >> (column % 32) & 1);
}

static void place_samples(ss_lattice *samples, bool disk, double size, const int low[2],
                          const int high[2]) {
    memset(samples->outside, 0xff, (size_t)samples->blocks * SS_BLOCK * sizeof(uint32_t));
    samples->count = 0;
    for (int j = low[1]; j <= high[1]; j++) {
        for (int i = low[0]; i <= high[0]; i++) {
            double s, t;
            lattice_point(size, i, j, &s, &t);
            if (!on_shape(disk, s, t)) continue;
            const int column = i - low[0], row = j - low[1];
            const uint32_t word = word_of(samples, column, row);
            samples->outside[word] &= ~(1u << (column % 32));
            samples->s[word * 32 + (uint32_t)column % 32] = (float)s;
            samples->t[word * 32 + (uint32_t)column % 32] = (float)t;
            samples->count++;
        }
    }
    for (int k = 0; k < 2; k++) {
        /* The inverse of lattice_point(): columns and rows begin at 1. */
        samples->grid[k][0] = (k ? turn[1] : turn[0]) / size;
        samples->grid[k][1] = (k ? turn[0] : -turn[1]) / size;
        samples->grid[k][2] = 1 - low[k] - origin[k];
    }
}

/* The sample nearest to a place of the shape. */
static uint32_t nearest(const ss_lattice *samples, double x, double y) {
    const int column = (int)floor(x - 0.5), row = (int)floor(y - 0.5);
    if (is_sample(samples, column, row)) {
        return word_of(samples, column, row) * 32 + (uint32_t)column % 32;
    }
    double best = INFINITY;
    uint32_t found = UINT32_MAX;
    for (int j = row - 2; j <= row + 2; j++) {
        for (int i = column - 2; i <= column + 2; i++) {
            const double dx = x - (i + 1), dy = y - (j + 1), d = dx * dx + dy * dy;
            if (d >= best || !is_sample(samples, i, j)) continue;
            best = d, found = word_of(samples, i, j) * 32 + (uint32_t)i % 32;
        }
    }
    return found;
}

/* What each sample stands for, in whole cells, and with the profile. */
static void measure(const ss_lattice *lattice, const ss_light *light, bool disk, double *area,
                    double *content) {
    const double cell = lattice->grid[0][0] * lattice->grid[0][0] +
                        lattice->grid[0][1] * lattice->grid[0][1]; /* cells a unit of area */
    const uint32_t fine = (uint32_t)fmax(FINE, ceil(16 * sqrt(lattice->count)));
    const double part = 4 * cell / ((double)fine * fine);
    for (uint32_t i = 0; i < fine * fine; i++) {
        const double s = (2 * (i % fine) + 1.0) / fine - 1, t = (2 * (i / fine) + 1.0) / fine - 1;
        if (!on_shape(disk, s, t)) continue;
        const double(*g)[3] = (const double(*)[3])lattice->grid;
        const uint32_t at = nearest(lattice, g[0][0] * s + g[0][1] * t + g[0][2],
                                    g[1][0] * s + g[1][1] * t + g[1][2]);
        if (at == UINT32_MAX) continue;
        area[at] += part;
        content[at] += part * (light->profile_count ? ss_light_profile(light, hypot(s, t)) : 1);
    }
}

/* Is everything around the sample's cell on the shape, too? Then it stands for just that cell. */
static bool is_inner(const ss_lattice *lattice, uint32_t word, uint32_t bit) {
    const int column = (int)(word / SS_BLOCK % lattice->words * 32 + bit);
    const int row = (int)(word / SS_BLOCK / lattice->words * SS_BLOCK + word % SS_BLOCK);
    for (int i = 0; i < 9; i++) {
        if (!is_sample(lattice, column + i % 3 - 1, row + i / 3 - 1)) return false;
    }
    return true;
}

static void set_weights(ss_lattice *lattice, const double *area, double *content, double most) {
    const size_t places = (size_t)lattice->blocks * SS_BLOCK * 32;
    const double unit = most > 0 ? CELL * PROFILE_UNIT / most : CELL;
    double sum = 0, error = 0;
    for (size_t i = 0; i < places; i++) {
        if (lattice->outside[i / 32] >> (i % 32) & 1) continue;
        if (is_inner(lattice, (uint32_t)(i / 32), i % 32))
            content[i] /= area[i]; /* measured with noise */
        else
            lattice->rim[i / 32] |= 1u << (i % 32);
        const double weight = unit * content[i];
        lattice->weight[i] = (uint32_t)lrint(most > 0 ? weight : fmax(weight, 1));
        lattice->total += lattice->weight[i];
        sum += weight;
        /* The fine grid measures a cell's area to a few of its own places along the rim. */
        error += fabs(lattice->weight[i] - weight);
        if (lattice->rim[i / 32] >> (i % 32) & 1) error += 0.025 * unit * (most > 0 ? most : 1);
    }
    /* Half of what is too much here is too little there. */
    lattice->weight_error = sum > 0 ? error / sum : 1;
}

static softshadow_status weigh(ss_lattice *lattice, const ss_light *light, bool disk) {
    const size_t places = (size_t)lattice->blocks * SS_BLOCK * 32;
    double *area = ss_alloc(2 * places, sizeof *area), most = 0;
    if (!area) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for light samples");
    measure(lattice, light, disk, area, area + places);
    for (uint32_t i = 0; i < light->profile_count; i++) most = fmax(most, light->profile[i]);
    set_weights(lattice, area, area + places, most);
    if (!lattice->total && most > 0) { /* a spike between all places: no sample tells where it is */
        ss_light even = *light;
        even.profile_count = 0;
        memset(area, 0, 2 * places * sizeof *area);
        measure(lattice, &even, disk, area, area + places);
        set_weights(lattice, area, area + places, 0);
        lattice->weight_error = 1;
    }
    ss_free(area);
    return SOFTSHADOW_OK;
}

static softshadow_status make_planes(ss_lattice *samples) {
    const size_t words = (size_t)samples->blocks * SS_BLOCK;
    uint32_t most = 0;
    for (size_t i = 0; i < words * 32; i++) most |= samples->weight[i];
    samples->planes = most ? 32 - (uint32_t)__builtin_clz(most) : 1;
    samples->plane = ss_alloc(samples->planes * words, sizeof *samples->plane);
    if (!samples->plane) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for light samples");
    for (uint32_t p = 0; p < samples->planes; p++) {
        for (size_t i = 0; i < words * 32; i++) {
            samples->plane[p * words + i / 32] |= (samples->weight[i] >> p & 1) << (i % 32);
        }
    }
    return SOFTSHADOW_OK;
}

softshadow_status ss_lattice_create(ss_lattice **out, const ss_light *light, uint32_t count) {
    *out = NULL;
    if (count < SS_LATTICE_LEAST) count = SS_LATTICE_LEAST;
    if (count > SS_LATTICE_MOST) count = SS_LATTICE_MOST;
    const bool disk = light->type != SOFTSHADOW_RECT;
    int low[2], high[2];
    const double size = fit(disk, count, low, high);
    ss_lattice *samples = ss_alloc(1, sizeof *samples);
    if (!samples) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for light samples");
    samples->words = (uint32_t)(high[0] - low[0]) / 32 + 1;
    samples->row_blocks = (uint32_t)(high[1] - low[1]) / SS_BLOCK + 1;
    samples->blocks = samples->words * samples->row_blocks;
    const size_t words = (size_t)samples->blocks * SS_BLOCK;
    samples->outside = ss_alloc(words, sizeof *samples->outside);
    samples->rim = ss_alloc(words, sizeof *samples->rim);
    samples->weight = ss_alloc(words * 32, sizeof *samples->weight);
    samples->s = ss_alloc(words * 32, sizeof *samples->s);
    samples->t = ss_alloc(words * 32, sizeof *samples->t);
    softshadow_status status = SOFTSHADOW_E_MEMORY;
    if (!samples->outside || !samples->rim || !samples->weight || !samples->s || !samples->t) {
        ss_fail(status, "out of memory for %u light samples", count);
    } else {
        place_samples(samples, disk, size, low, high);
        status = weigh(samples, light, disk);
        if (!status) status = make_planes(samples);
    }
    if (!status)
        *out = samples;
    else
        ss_lattice_destroy(samples);
    return status;
}

void ss_lattice_destroy(ss_lattice *samples) {
    if (!samples) return;
    ss_free(samples->outside);
    ss_free(samples->rim);
    ss_free(samples->weight);
    ss_free(samples->s);
    ss_free(samples->t);
    ss_free(samples->plane);
    ss_free(samples);
}

size_t ss_lattice_bytes(const ss_lattice *samples) {
    const size_t words = (size_t)samples->blocks * SS_BLOCK;
    return sizeof *samples + words * 4 * (2 + 3 * 32 + samples->planes);
}

uint64_t ss_lattice_visible(const ss_lattice *samples, const uint32_t *covered) {
    const size_t words = (size_t)samples->blocks * SS_BLOCK;
    uint64_t sum = 0;
    for (uint32_t p = 0; p < samples->planes; p++) {
        const uint32_t *plane = samples->plane + p * words;
        uint64_t bits = 0;
        for (size_t i = 0; i < words; i += 2) {
            uint64_t mask, seen;
            memcpy(&mask, plane + i, sizeof mask);
            memcpy(&seen, covered + i, sizeof seen);
            bits += (uint64_t)__builtin_popcountll(mask & ~seen);
        }
        sum += bits << p;
    }
    return sum;
}
