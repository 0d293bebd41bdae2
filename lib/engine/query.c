/* The loop over a batch: check points, put them in an order that keeps neighbours together, hand
 * ranges of them to the technique on all threads, scatter the answers. */
#include <stdio.h>
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/cpu.h"
#include "base/status.h"
#include "base/vec.h"
#include "coverage/plates.h"
#include "coverage/sky.h"
#include "engine/device.h"
#include "engine/engine.h"
#include "engine/order.h"
#include "engine/places.h"
#include "engine/settle.h"

#define BLOCK ((size_t)1 << 18) /* points in flight: bounds the memory of a query of any size */
#define RANGE_LEAST 512         /* points handed to a worker at once, ... */
#define RANGE_MOST  2048        /* ... which costs it as much as a few dozen of them */
#define RANGES      32          /* of a batch that is between */

/* An arena that a worker uses for one range at a time. */
typedef struct ss_scratch {
    ss_arena arena;
    struct ss_scratch *next;
} ss_scratch;

static ss_scratch *take_scratch(softshadow *handle) {
    pthread_mutex_lock(&handle->scratch_lock);
    ss_scratch *scratch = handle->scratch;
    if (scratch) handle->scratch = scratch->next;
    pthread_mutex_unlock(&handle->scratch_lock);
    return scratch ? scratch : ss_alloc(1, sizeof *scratch);
}

static void give_scratch(softshadow *handle, ss_scratch *scratch) {
    ss_arena_reset(&scratch->arena);
    pthread_mutex_lock(&handle->scratch_lock);
    scratch->next = handle->scratch;
    handle->scratch = scratch;
    pthread_mutex_unlock(&handle->scratch_lock);
}

void ss_scratch_free(softshadow *handle) {
    while (handle->scratch) {
        ss_scratch *scratch = handle->scratch;
        handle->scratch = scratch->next;
        ss_arena_free(&scratch->arena);
        ss_free(scratch);
    }
}

/* ---- one point ------------------------------------------------------------------------------ */

static double ulp_of(const softshadow_points *points) {
    return points->position_type == SOFTSHADOW_F64 ? 0x1p-52 : 0x1p-23;
}

static void read_position(const softshadow_points *points, size_t i, double host[3]) {
    const char *at = (const char *)points->positions + i * points->position_stride;
    if (points->position_type == SOFTSHADOW_F64) {
        memcpy(host, at, 3 * sizeof(double));
    } else {
        float f[3];
        memcpy(f, at, sizeof f);
        for (int k = 0; k < 3; k++) host[k] = f[k];
    }
}

/* false: the normal is not finite */
static bool read_normal(const softshadow_points *points, size_t i, float out[3]) {
    out[0] = out[1] = out[2] = 0;
    if (!points->normals) return true;
    float f[3];
    memcpy(f, (const char *)points->normals + i * points->normal_stride, sizeof f);
    double n[3] = {f[0], f[1], f[2]};
    if (!ss_finite3(n)) return false;
    if (ss_normalize(n)) {
        for (int k = 0; k < 3; k++) out[k] = (float)n[k];
    }
    return true;
}

/* Onto the plane of a triangle that only receives; those that cast are trace/contact.h's. */
static void project(double p[3], double corner[3][3]) {
    double e[3], f[3], n[3], d[3];
    ss_sub(corner[1], corner[0], e);
    ss_sub(corner[2], corner[0], f);
    ss_cross(e, f, n);
    ss_sub(p, corner[0], d);
    if (ss_normalize(n)) ss_add_scaled(p, -ss_dot(n, d), n, p);
}

bool ss_engine_point(const ss_stage *stage, const softshadow_points *points, size_t i,
                     ss_point *out) {
    const ss_world *world = stage->world;
    double host[3];
    read_position(points, i, host);
    for (int k = 0; k < 3; k++) {
        if (!(fabs(host[k]) <= SS_COORDINATE_LIMIT)) return false;
    }
    ss_world_local(world, host, out->p);
    const double *bounds = stage->params->bounds;
    for (int k = 0; k < 3 && stage->params->bounded; k++) {
        if (out->p[k] < bounds[k] || out->p[k] > bounds[3 + k]) return false;
    }
    out->ulp = (float)ulp_of(points);
    out->triangle = SS_NO_TRIANGLE;
    out->place = (uint32_t)i;
    return read_normal(points, i, out->normal);
}

/* Is there such a triangle? */
static softshadow_status find_primitive(const ss_scene *scene, uint64_t primitive,
                                        uint32_t *triangle) {
    const uint32_t id = (uint32_t)(primitive >> 32);
    *triangle = (uint32_t)primitive;
    if (primitive == SOFTSHADOW_NO_PRIMITIVE) return SOFTSHADOW_OK;
    if (id < scene->mesh_count && scene->meshes[id].used &&
        *triangle < scene->meshes[id].triangle_count) {
        return SOFTSHADOW_OK;
    }
    return ss_fail(SOFTSHADOW_E_ARGUMENT,
                   "primitive: mesh %u triangle %u, must be in the scene or "
                   "SOFTSHADOW_NO_PRIMITIVE",
                   id, *triangle);
}

softshadow_status ss_engine_primitive(const ss_scene *scene, const ss_stage *stage,
                                      uint64_t primitive, ss_point *point) {
    uint32_t triangle;
    const softshadow_status status = find_primitive(scene, primitive, &triangle);
    if (status || primitive == SOFTSHADOW_NO_PRIMITIVE) return status;
    point->ulp = 0;
    point->triangle = ss_world_find(stage->world, primitive);
    if (point->triangle != SS_NO_TRIANGLE) return SOFTSHADOW_OK;
    const ss_mesh *mesh = &scene->meshes[primitive >> 32];
    double corner[3][3];
    for (int v = 0; v < 3; v++) {
        double host[3];
        ss_mesh_vertex(mesh, mesh->indices[3 * (size_t)triangle + (size_t)v], host);
        ss_world_local(stage->world, host, corner[v]);
    }
    project(point->p, corner);
    return SOFTSHADOW_OK;
}

/* ---- the batch ------------------------------------------------------------------------------ */

/* A query in flight. Points are counted from the block's first. */
typedef struct batch {
    softshadow *handle;
    const ss_asked *asked;
    const softshadow_points *points;
    float *visibility;
    size_t first, count; /* the block */
    ss_order order;
    bool sky;         /* lit and dark points are told first: the order is of the others */
    const ss_plates *plates; /* or by these, and not only lit ones; NULL without */
    float most;              /* see ss_plates_tell */
    uint32_t *left;   /* which those are; NULL without */
    size_t *counts;   /* of them, in each LOOK points */
    bool places;  /* of points are all that is asked for: see engine/places.h */
    bool settles; /* whole groups may be answered before the technique is asked */
    ss_progress *progress;
    pthread_mutex_t lock; /* guards totals */
    ss_totals *totals;
} batch;

static softshadow_status check_primitive(const batch *b, size_t i) {
    uint32_t triangle;
    if (!b->points->primitives) return SOFTSHADOW_OK;
    const softshadow_status status =
        find_primitive(&b->handle->scene, b->points->primitives[i], &triangle);
    return status ? ss_fail(status, "points[%zu]: %s", i, ss_message()) : SOFTSHADOW_OK;
}

static void answer_bad(const batch *b, size_t i) {
    b->visibility[i] = NAN;
    if (b->points->error_bound) b->points->error_bound[i] = NAN;
}

static softshadow_status add_bad(batch *b, uint64_t bad) {
    if (!bad) return SOFTSHADOW_OK;
    pthread_mutex_lock(&b->lock);
    b->totals->points_bad += bad;
    pthread_mutex_unlock(&b->lock);
    return ss_progress_add(b->progress, bad);
}

/* The usual batch needs no more than its floats: no bounds to keep, no normals, no primitives. */
static bool is_plain(const batch *b) {
    const softshadow_points *p = b->points;
    return p->position_type == SOFTSHADOW_F32 && !p->normals && !p->primitives &&
           !b->asked->stage->params->bounded;
}

/* A point that cannot be answered lies nowhere: what is not set here would turn the order. */
static void leave_out(const batch *b, size_t j) {
    for (int k = 0; k < 3; k++) b->order.at[j][k] = NAN;
}

/* Where they lie need not be precise for the order. Gives how many cannot be answered. */
static uint64_t look_at_plain(const batch *b, size_t begin, size_t end) {
    const ss_world *world = b->asked->stage->world;
    const float limit = (float)SS_COORDINATE_LIMIT;
    const float scale = (float)fmin(world->scale, 0x1p100); /* a finite one keeps 0 at 0 */
    float origin[3];
    uint64_t bad = 0;
    for (int k = 0; k < 3; k++) origin[k] = (float)(world->low[k] + world->half[k]);
    for (size_t j = begin; j < end; j++) {
        float f[3];
        memcpy(f, (const char *)b->points->positions + (b->first + j) * b->points->position_stride,
               sizeof f);
        const bool good = (fabsf(f[0]) <= limit) & (fabsf(f[1]) <= limit) & (fabsf(f[2]) <= limit);
        for (int k = 0; k < 3; k++) b->order.at[j][k] = (f[k] - origin[k]) * scale;
        if (good) continue;
        bad++;
        leave_out(b, j);
        answer_bad(b, b->first + j);
    }
    return bad;
}

/* Tells which points can be answered, and to the order where they lie. */
static softshadow_status look_at(void *ctx, uint64_t begin, uint64_t end) {
    batch *b = ctx;
    uint64_t bad = 0;
    if (is_plain(b)) return add_bad(b, look_at_plain(b, begin, end));
    for (uint64_t j = begin; j < end; j++) {
        const size_t i = b->first + j;
        ss_point point;
        if (ss_engine_point(b->asked->stage, b->points, i, &point)) {
            for (int k = 0; k < 3; k++) b->order.at[j][k] = (float)point.p[k];
            const softshadow_status status = check_primitive(b, i);
            if (status) return status;
        } else {
            leave_out(b, j);
            answer_bad(b, i);
            bad++;
        }
    }
    return add_bad(b, bad);
}

static void add_counts(batch *b, const ss_counts *counts) {
    pthread_mutex_lock(&b->lock);
    ss_counts *sum = &b->totals->counts;
    sum->lit += counts->lit, sum->umbra += counts->umbra, sum->penumbra += counts->penumbra;
    sum->traced += counts->traced, sum->settled += counts->settled, sum->rays += counts->rays;
    sum->spared += counts->spared, sum->up += counts->up, sum->down += counts->down;
    pthread_mutex_unlock(&b->lock);
}

/* ---- lit and dark points first --------------------------------------------------------------- */

#define LOOK ((size_t)4096) /* points that are looked at in one go */
#define WORD ((size_t)64)   /* that the sky or plates are asked of: a bit of an answer each */

static ss_sky_ask *const ask_sky[] = SS_RUNGS(ss_sky_ask);

static void leave(const batch *b, size_t j, const double p[3], size_t *to) {
    for (int k = 0; k < 3; k++) b->order.at[*to][k] = (float)p[k];
    b->left[(*to)++] = (uint32_t)j;
}

/* Points one by one: some of them cannot be answered. */
static uint64_t leave_good(const batch *b, size_t first, size_t n, size_t *to) {
    uint64_t bad = 0;
    for (size_t j = first; j < first + n; j++) {
        ss_point point;
        if (ss_engine_point(b->asked->stage, b->points, b->first + j, &point)) {
            leave(b, j, point.p, to);
        } else {
            answer_bad(b, b->first + j);
            bad++;
        }
    }
    return bad;
}

static ss_plates_tell *const tell_plates[] = SS_RUNGS(ss_plates_tell);

/* A bit for each point whose answer is told; those of the others are whatever they are. */
static uint64_t tell(const batch *b, const ss_places *places, size_t first, size_t n,
                     ss_counts *counts) {
    const ss_stage *stage = b->asked->stage;
    float *visibility = b->visibility + first;
    if (!b->plates) {
        uint64_t lit, dark;
        ask_sky[stage->rung](stage->sky, places, n, ulp_of(b->points), &lit, &dark);
        for (size_t i = 0; i < n; i++) visibility[i] = dark >> i & 1 ? 0 : 1;
        counts->lit += (uint64_t)__builtin_popcountll(lit);
        counts->umbra += (uint64_t)__builtin_popcountll(dark);
        return lit | dark;
    }
    ss_plates_told by;
    float *bound = b->points->error_bound ? b->points->error_bound + first : NULL;
    tell_plates[stage->rung](b->plates, places, n, ulp_of(b->points), b->most, visibility, bound,
                             &by);
    counts->lit += (uint64_t)__builtin_popcountll(by.lit);
    counts->umbra += (uint64_t)__builtin_popcountll(by.dark);
    return by.all;
}

/* Answers those that can be told; the others go to the front of the range. */
static softshadow_status answer_told(void *ctx, uint64_t begin, uint64_t end) {
    batch *b = ctx;
    const ss_stage *stage = b->asked->stage;
    size_t to = begin;
    uint64_t bad = 0;
    ss_counts counts = {0};
    for (size_t first = begin, n; first < end; first += n) {
        ss_places places;
        n = end - first < WORD ? end - first : WORD;
        if (!ss_places_read(stage, b->points, b->first + first, n, &places)) {
            bad += leave_good(b, first, n, &to);
            continue;
        }
        const uint64_t told = tell(b, &places, b->first + first, n, &counts);
        for (uint64_t m = n < WORD ? ~told & ((UINT64_C(1) << n) - 1) : ~told; m; m &= m - 1) {
            const size_t i = (size_t)__builtin_ctzll(m);
            leave(b, first + i, (double[]){places.at[0][i], places.at[1][i], places.at[2][i]}, &to);
        }
    }
    b->counts[begin / LOOK] = to - begin;
    const uint64_t told = end - to - bad;
    counts.settled = counts.lit + counts.umbra, counts.penumbra = told - counts.settled;
    add_counts(b, &counts);
    const softshadow_status status = ss_progress_add(b->progress, told);
    return status ? status : add_bad(b, bad);
}

/* The order's points, and which they are: those that are not told. Gives how many. */
static softshadow_status look_first(batch *b, ss_arena *arena, size_t *left) {
    const size_t ranges = (b->count + LOOK - 1) / LOOK;
    b->left = ss_arena_alloc(arena, b->count, sizeof *b->left);
    b->counts = ss_arena_alloc(arena, ranges, sizeof *b->counts);
    if (!b->left || !b->counts)
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu points", b->count);
    const softshadow_status status =
        ss_parallel_for(b->handle->pool, b->count, LOOK, answer_told, b);
    *left = 0;
    for (size_t i = 0; i < ranges && !status; i++) {
        memmove(b->order.at + *left, b->order.at + i * LOOK, b->counts[i] * sizeof *b->order.at);
        memmove(b->left + *left, b->left + i * LOOK, b->counts[i] * sizeof *b->left);
        *left += b->counts[i];
    }
    return status;
}

/* ---- the others ----------------------------------------------------------------------------- */

/* Points first .. first + n - 1 of the order's, which were looked at. */
static void read_points(const batch *b, bool plain, size_t first, size_t n, ss_point *points) {
    const ss_stage *stage = b->asked->stage;
    for (size_t j = 0; j < n; j++) {
        const size_t place = b->left ? b->left[first + j] : first + j, i = b->first + place;
        ss_point *point = &points[j];
        if (plain) {
            double host[3];
            float f[3];
            memcpy(f, (const char *)b->points->positions + i * b->points->position_stride,
                   sizeof f);
            for (int k = 0; k < 3; k++) host[k] = f[k], point->normal[k] = 0;
            ss_world_local(stage->world, host, point->p);
            point->ulp = 0x1p-23f, point->triangle = SS_NO_TRIANGLE;
        } else {
            ss_engine_point(stage, b->points, i, point);
        }
        point->place = (uint32_t)place;
        if (!b->points->primitives) continue;
        ss_engine_primitive(&b->handle->scene, stage, b->points->primitives[i], point);
    }
}

/* Answers n points, which it may move about, in this worker's scratch. */
static softshadow_status answer(batch *b, ss_point *points, size_t n, ss_arena *arena) {
    const size_t given = n;
    float *visibility = ss_arena_alloc(arena, 2 * n, sizeof *visibility);
    if (!visibility) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu points", n);
    float *bound = b->points->error_bound ? visibility + n : NULL;
    ss_counts counts = {0};
    const ss_asked *asked = b->asked;
    softshadow_status status = SOFTSHADOW_OK;
    if (b->settles) {
        const ss_answers answers = {b->visibility + b->first,
                                    bound ? b->points->error_bound + b->first : NULL};
        n = ss_settle(asked->stage, points, n, &answers);
        counts.lit = counts.settled = given - n;
    }
    if (n && asked->program) {
        status = ss_device_answer(asked, points, n, visibility, bound, arena, b->progress, &counts);
        if (counts.spared) ss_engine_tell(b->handle, ss_message()), ss_message_clear();
    } else if (n) {
        status = asked->technique->query(asked->stage, asked->state, points, n, visibility, bound,
                                         arena, &counts);
    }
    if (status) return status;
    for (size_t j = 0; j < n; j++) {
        const size_t i = b->first + points[j].place;
        b->visibility[i] = visibility[j];
        if (bound) b->points->error_bound[i] = bound[j];
    }
    add_counts(b, &counts);
    return ss_progress_add(b->progress, given);
}

/* Items begin..end of the order: points gathered, because neighbours there are not so in memory. */
static softshadow_status answer_ordered(batch *b, size_t begin, size_t end, ss_arena *arena) {
    const ss_order_item *item = b->order.item;
    ss_point *points = ss_arena_alloc(arena, (end - begin) * SS_ORDER_RUN, sizeof *points);
    size_t n = 0;
    if (!points) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for points");
    const bool plain = is_plain(b);
    for (size_t i = begin; i < end; i++) {
        const size_t first = ss_order_first(&item[i]), length = ss_order_length(&item[i]);
        read_points(b, plain, first, length, points + n);
        n += length;
    }
    return answer(b, points, n, arena);
}

/* Points as they come, less those that need no answer. */
static softshadow_status answer_given(batch *b, size_t begin, size_t end, ss_arena *arena) {
    ss_point *points = ss_arena_alloc(arena, end - begin, sizeof *points);
    size_t n = 0;
    if (!points) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for points");
    for (size_t j = begin; j < end; j++) {
        if (!ss_engine_point(b->asked->stage, b->points, b->first + j, &points[n])) {
            answer_bad(b, b->first + j);
            continue;
        }
        const softshadow_status status = check_primitive(b, b->first + j);
        if (status) return status;
        points[n].place = (uint32_t)j;
        n++;
    }
    const softshadow_status status = add_bad(b, end - begin - n);
    for (size_t j = 0; j < n && b->points->primitives && !status; j++) {
        const uint64_t primitive = b->points->primitives[b->first + points[j].place];
        ss_engine_primitive(&b->handle->scene, b->asked->stage, primitive, &points[j]);
    }
    return status ? status : answer(b, points, n, arena);
}

/* The usual batch of maps: blocks straight from the caller's numbers to his answers. */
static softshadow_status answer_places(batch *b, size_t begin, size_t end, ss_arena *arena) {
    const ss_asked *asked = b->asked;
    ss_counts counts = {0};
    size_t done = 0;
    for (size_t j = begin; j < end; j += SS_PLACES) {
        const size_t n = end - j < SS_PLACES ? end - j : SS_PLACES, first = b->first + j;
        ss_places places;
        if (!ss_places_read(asked->stage, b->points, first, n, &places)) {
            const softshadow_status status = answer_given(b, j, j + n, arena);
            if (status) return status;
            continue;
        }
        asked->technique->query_places(asked->state, &places, n, b->visibility + first, &counts);
        for (size_t i = first; i < first + n && b->points->error_bound; i++) {
            b->points->error_bound[i] = NAN;
        }
        done += n;
    }
    add_counts(b, &counts);
    return ss_progress_add(b->progress, done);
}

static softshadow_status answer_range(void *ctx, uint64_t begin, uint64_t end) {
    batch *b = ctx;
    ss_scratch *scratch = take_scratch(b->handle);
    if (!scratch) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for scratch");
    const softshadow_status status =
        (b->asked->technique->group ? answer_ordered : b->places ? answer_places : answer_given)(
            b, begin, end, &scratch->arena);
    give_scratch(b->handle, scratch);
    return status;
}

static size_t range_of(size_t points) {
    const size_t range = points / RANGES;
    return range < RANGE_LEAST ? RANGE_LEAST : range < RANGE_MOST ? range : RANGE_MOST;
}

static softshadow_status answer_block(batch *b, ss_arena *arena) {
    ss_pool *pool = b->handle->pool;
    const size_t range = b->asked->program ? SS_DEVICE_RANGE : range_of(b->count);
    if (!b->asked->technique->group) {
        return ss_parallel_for(pool, b->count, range, answer_range, b);
    }
    if (!ss_order_reserve(&b->order, b->count, arena)) {
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for %zu points", b->count);
    }
    size_t count = b->count;
    softshadow_status status = b->sky || b->plates ? look_first(b, arena, &count)
                                      : ss_parallel_for(pool, b->count, LOOK, look_at, b);
    if (status || !count) return status;
    status = ss_order_morton(&b->order, count, pool);
    if (status) return status;
    const size_t items = b->order.count, share = (range * items + count - 1) / count;
    return ss_parallel_for(pool, items, share ? share : 1, answer_range, b);
}

/* The whole image at once, because a pixel depends on its neighbours. */
static softshadow_status finish_image(batch *b) {
    const size_t width = b->points->width;
    const ss_image image = {.width = width,
                            .height = b->points->count / width,
                            .ids = b->points->ids,
                            .visibility = b->visibility};
    const ss_asked *asked = b->asked;
    ss_counts *counts = &b->totals->counts;
    softshadow_status status =
        asked->technique->finish(asked->stage, asked->state, &image, b->handle->pool, counts);
    if (status != SOFTSHADOW_E_BACKEND || !asked->any) return status;
    ss_stage spared = *asked->stage;
    spared.raster = &ss_raster_cpu;
    counts->spared = b->points->count;
    ss_engine_tell(b->handle, ss_message()), ss_message_clear();
    return asked->technique->finish(&spared, asked->state, &image, b->handle->pool, counts);
}

/* None, if the host does not ask for any. */
static softshadow_status make_progress(const softshadow *handle, uint64_t total,
                                       ss_progress **out) {
    *out = NULL;
    if (!handle->options.progress) return SOFTSHADOW_OK;
    *out = ss_progress_create(&handle->options, total);
    return *out ? SOFTSHADOW_OK : ss_fail(SOFTSHADOW_E_MEMORY, "out of memory");
}

/* They know of no horizons, and tell how wrong an answer is only where it may be. */
static const ss_plates *find_plates(const ss_asked *asked, const softshadow_points *points,
                                    float *most) {
    if (!asked->technique->plates || asked->program || points->normals || points->primitives)
        return NULL;
    const ss_plates *plates = asked->technique->plates(asked->state, most);
    return *most > 0 || !points->error_bound ? plates : NULL;
}

softshadow_status ss_engine_ask(softshadow *handle, const ss_asked *asked,
                                const softshadow_points *points, float *visibility,
                                ss_totals *totals) {
    batch b = {.handle = handle, .asked = asked, .points = points, .visibility = visibility,
               .totals = totals};
    b.settles = asked->technique->settles && asked->stage->bvh &&
                asked->stage->params->weighting == SOFTSHADOW_UNIFORM;
    b.places = asked->technique->query_places && !asked->program && !points->normals &&
               !points->primitives;
    b.plates = find_plates(asked, points, &b.most);
    b.sky = asked->stage->sky && asked->technique->group && !asked->program;
    softshadow_status status = SOFTSHADOW_OK;
    ss_scratch *scratch = take_scratch(handle);
    if (!scratch) return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for scratch");
    ss_progress *own = NULL;
    b.progress = asked->progress;
    if (!b.progress) status = make_progress(handle, points->count, &own), b.progress = own;
    pthread_mutex_init(&b.lock, NULL);
    while (!status && b.first < points->count) {
        b.count = points->count - b.first < BLOCK ? points->count - b.first : BLOCK;
        ss_arena_reset(&scratch->arena);
        status = answer_block(&b, &scratch->arena);
        b.first += b.count;
    }
    if (!status && asked->stage->rows) status = finish_image(&b);
    pthread_mutex_destroy(&b.lock);
    ss_progress_destroy(own);
    give_scratch(handle, scratch);
    totals->points += points->count;
    return status;
}

static void add_totals(softshadow *handle, const ss_totals *totals) {
    pthread_mutex_lock(&handle->totals_lock);
    ss_totals *sum = &handle->totals;
    const ss_counts *counts = &totals->counts;
    sum->query_seconds += totals->query_seconds;
    sum->points += totals->points, sum->points_bad += totals->points_bad;
    sum->counts.lit += counts->lit, sum->counts.umbra += counts->umbra;
    sum->counts.penumbra += counts->penumbra, sum->counts.traced += counts->traced;
    sum->counts.settled += counts->settled, sum->counts.rays += counts->rays;
    sum->counts.spared += counts->spared;
    sum->counts.up += counts->up, sum->counts.down += counts->down;
    pthread_mutex_unlock(&handle->totals_lock);
}

ss_asked ss_engine_asked(const softshadow *handle, const ss_stage *stage, uint32_t light) {
    const ss_built *built = &handle->built;
    return (ss_asked){.technique = built->plan.technique,
                      .stage = stage,
                      .state = built->states[light],
                      .program = built->programs ? built->programs[light] : NULL,
                      .any = built->plan.any};
}

void ss_engine_tell(softshadow *handle, const char *why) {
    char text[SS_MESSAGE_SIZE];
    pthread_mutex_lock(&handle->totals_lock);
    const bool told = handle->told;
    handle->told = true;
    pthread_mutex_unlock(&handle->totals_lock);
    if (told || !handle->options.log) return;
    snprintf(text, sizeof text, "SOFTSHADOW_ANY: on the CPU: %.400s", why);
    handle->options.log(handle->options.user, 2, text);
}

/* A map of lit and dark points knows of no horizons, and of no bounds. */
static bool sky_fits(const ss_sky *sky, const softshadow_points *points) {
    return !points->normals && !points->primitives && !points->error_bound &&
           ss_sky_holds(sky, ulp_of(points));
}

softshadow_status ss_engine_query(softshadow *handle, const softshadow_points *points,
                                  float *visibility) {
    const double start = ss_clock();
    const ss_built *built = &handle->built;
    ss_stage stage = built->stages[points->light];
    ss_asked asked = ss_engine_asked(handle, &stage, points->light);
    ss_totals totals = {0};
    stage.rows = points->width > 0 && asked.technique->finish;
    softshadow_status status = make_progress(handle, points->count, &asked.progress);
    if (!status)
        status = ss_engine_lend(handle, points->light, points->count, asked.progress, &stage);
    if (stage.sky && !sky_fits(stage.sky, points)) stage.sky = NULL;
    if (!status) status = ss_engine_ask(handle, &asked, points, visibility, &totals);
    ss_progress_destroy(asked.progress);
    totals.query_seconds = ss_clock() - start;
    if (!status) add_totals(handle, &totals);
    return status;
}
