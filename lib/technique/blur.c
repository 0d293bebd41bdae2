#include "technique/blur.h"

#include <math.h>
#include <pthread.h>

#include "raster/raster.h"

#define REACH   (SS_MOST_BLUR / 2)
#define COLUMNS 16 /* to one thread: those that share their cache lines */

typedef struct blur {
    const ss_image *image;
    size_t reach;
    uint64_t step;        /* of count_rows() */
    pthread_mutex_t lock; /* guards counts */
    ss_counts *counts;
} blur;

/* A line of pixels through the image, which is written over while it is read: what was there before
 * the pixels already written is kept in a ring. */
typedef struct line {
    float *value;
    const uint32_t *id; /* NULL: all of one object */
    size_t stride, length;
} line;

typedef struct window {
    double sum;
    uint32_t count;
} window;

static void take(window *w, float value, bool same) {
    if (!same || isnan(value)) return;
    w->sum += fabsf(value), w->count++;
}

static bool same_id(const line *l, size_t a, size_t b) {
    return !l->id || l->id[a * l->stride] == l->id[b * l->stride];
}

/* The mean around pixel i; the order of the sum is that of the line. */
static float mean_around(const line *l, size_t i, size_t reach, const float ring[REACH]) {
    window w = {0, 0};
    const size_t first = i < reach ? 0 : i - reach;
    const size_t last = l->length - i > reach ? i + reach : l->length - 1;
    for (size_t j = first; j < i; j++) take(&w, ring[j % REACH], same_id(l, i, j));
    for (size_t j = i; j <= last; j++) take(&w, l->value[j * l->stride], same_id(l, i, j));
    return (float)(w.sum / w.count);
}

static void blur_line(const line *l, size_t reach, bool keep_marks) {
    float ring[REACH];
    for (size_t i = 0; i < l->length; i++) {
        float *at = &l->value[i * l->stride];
        const float before = *at;
        if (signbit(before) && !isnan(before)) {
            const float mean = mean_around(l, i, reach, ring);
            *at = keep_marks ? -mean : mean;
        }
        ring[i % REACH] = before;
    }
}

static void count(ss_counts *counts, const float *value, size_t n, size_t stride, uint64_t step) {
    for (size_t i = 0; i < n; i++) {
        const float v = fabsf(value[i * stride]);
        if (isnan(v)) continue;
        if (v == 0) counts->umbra += step;
        else if (v == 1) counts->lit += step;
        else counts->penumbra += step;
    }
}

static void add_counts(blur *b, const ss_counts *changed) {
    pthread_mutex_lock(&b->lock);
    b->counts->lit += changed->lit, b->counts->umbra += changed->umbra;
    b->counts->penumbra += changed->penumbra;
    pthread_mutex_unlock(&b->lock);
}

/* Numbers below zero and sums with them come out right: they wrap. */
static softshadow_status rows(void *ctx, uint64_t begin, uint64_t end) {
    blur *b = ctx;
    const ss_image *image = b->image;
    ss_counts changed = {0};
    for (size_t y = begin; y < end; y++) {
        const size_t first = y * image->width;
        const line l = {image->visibility + first, image->ids ? image->ids + first : NULL, 1,
                        image->width};
        count(&changed, l.value, l.length, 1, (uint64_t)-1);
        blur_line(&l, b->reach, true);
    }
    add_counts(b, &changed);
    return SOFTSHADOW_OK;
}

static softshadow_status columns(void *ctx, uint64_t begin, uint64_t end) {
    blur *b = ctx;
    const ss_image *image = b->image;
    ss_counts changed = {0};
    for (size_t x = begin; x < end; x++) {
        const line l = {image->visibility + x, image->ids ? image->ids + x : NULL, image->width,
                        image->height};
        blur_line(&l, b->reach, false);
        count(&changed, l.value, l.length, l.stride, 1);
    }
    add_counts(b, &changed);
    return SOFTSHADOW_OK;
}

/* ---- on a GPU -------------------------------------------------------------------------------- */

static softshadow_status count_rows(void *ctx, uint64_t begin, uint64_t end) {
    blur *b = ctx;
    const size_t width = b->image->width;
    ss_counts changed = {0};
    count(&changed, b->image->visibility + begin * width, (end - begin) * width, 1, b->step);
    add_counts(b, &changed);
    return SOFTSHADOW_OK;
}

/* number: the reach. Above 0x7f800000 are NaN, the sign bit apart. */
static const char glsl[] =
    "uint pixel(uvec2 at, uint pass) {\n"
    "    uint i = at.y * width + at.x, own = before[i], id = id_of(i);\n"
    "    if (own < 0x80000000u || own > 0xff800000u) return own;\n"
    "    uint place = pass == 0u ? at.x : at.y, stride = pass == 0u ? 1u : width;\n"
    "    uint first = place < number ? 0u : place - number;\n"
    "    uint last = min(place + number, (pass == 0u ? width : height) - 1u);\n"
    "    float sum = 0.0, n = 0.0;\n"
    "    for (uint j = first; j <= last; j++) {\n"
    "        uint k = i - (place - j) * stride, bits = before[k] & 0x7fffffffu;\n"
    "        if (bits <= 0x7f800000u && id_of(k) == id) sum += uintBitsToFloat(bits), n += 1.0;\n"
    "    }\n"
    "    uint mean = floatBitsToUint(sum / n);\n"
    "    return pass == 0u ? mean | 0x80000000u : mean;\n"
    "}\n";

static softshadow_status blur_there(blur *b, const ss_raster *raster, ss_pool *pool) {
    const ss_image *image = b->image;
    const ss_raster_image there = {.glsl = glsl,
                                   .values = image->visibility,
                                   .ids = image->ids,
                                   .width = (uint32_t)image->width,
                                   .height = (uint32_t)image->height,
                                   .passes = 2,
                                   .number = (uint32_t)b->reach};
    ss_counts before = *b->counts;
    b->step = (uint64_t)-1;
    softshadow_status status = ss_parallel_for(pool, image->height, 64, count_rows, b);
    if (!status) status = raster->work(&there);
    const ss_raster_spent spent = raster->spent();
    before.up += spent.up, before.down += spent.down;
    if (status) return *b->counts = before, status;
    b->counts->up = before.up, b->counts->down = before.down;
    b->step = 1;
    return ss_parallel_for(pool, image->height, 64, count_rows, b);
}

softshadow_status ss_blur(const ss_image *image, uint32_t across, const ss_raster *raster,
                          ss_pool *pool, ss_counts *counts) {
    blur b = {.image = image, .reach = across / 2, .counts = counts};
    if (b.reach > REACH) b.reach = REACH;
    pthread_mutex_init(&b.lock, NULL);
    softshadow_status status = SOFTSHADOW_OK;
    if (raster->work) {
        status = blur_there(&b, raster, pool);
    } else {
        status = ss_parallel_for(pool, image->height, 16, rows, &b);
        if (!status) status = ss_parallel_for(pool, image->width, COLUMNS, columns, &b);
    }
    pthread_mutex_destroy(&b.lock);
    return status;
}
