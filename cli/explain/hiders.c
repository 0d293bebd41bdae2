/* hiders.c */
#include "hiders.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int by_number(const void *a, const void *b) {
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

static int by_pixels(const void *a, const void *b) {
    const hider *x = a, *y = b;
    if (x->pixels != y->pixels) return x->pixels < y->pixels ? 1 : -1;
    return by_number(&x->primitive, &y->primitive);
}

/* Runs of equal numbers become entries. */
static void count_runs(hiders *out, const uint64_t *sorted, uint64_t count) {
    for (uint64_t i = 0; i < count; i++) {
        if (i == 0 || sorted[i] != sorted[i - 1]) out->list[out->count++].primitive = sorted[i];
        out->list[out->count - 1].pixels++;
    }
    qsort(out->list, out->count, sizeof *out->list, by_pixels);
}

bool hiders_count(hiders *out, const softshadow_explanation *e) {
    const size_t pixels = (size_t)e->size * e->size;
    *out = (hiders){0};
    uint64_t *sorted = malloc(pixels * sizeof *sorted);
    out->list = calloc(pixels, sizeof *out->list);
    if (!sorted || !out->list) return free(sorted), false;
    uint64_t named = 0;
    for (size_t i = 0; i < pixels; i++) {
        if (isnan(e->image[i])) continue;
        out->pixels++;
        out->hidden += e->image[i] < 0.5f;
        if (e->hider[i] != SOFTSHADOW_NO_PRIMITIVE) sorted[named++] = e->hider[i];
    }
    qsort(sorted, named, sizeof *sorted, by_number);
    count_runs(out, sorted, named);
    free(sorted);
    return true;
}

void hiders_free(hiders *h) {
    free(h->list);
    h->list = NULL;
}

/* Neighbouring triangles have neighbouring numbers: golden-angle steps around the colour circle
 * keep those apart. A triangle has the same colour from every point. */
void hiders_colour(uint64_t primitive, float rgb[3]) {
    static const double offset[3] = {0, 2 * M_PI / 3, 4 * M_PI / 3};
    const double golden = 2.399963229728653; /* pi (3 - sqrt 5) */
    const double hue =
        fmod(golden * (double)(primitive & UINT32_MAX), 2 * M_PI) + (double)(primitive >> 32);
    for (int c = 0; c < 3; c++) rgb[c] = (float)(0.45 + 0.35 * cos(hue - offset[c]));
}
