/* hiders.h - which triangles hide a light, and how much of it each: counted from the picture of the
 * light that softshadow_explain() draws. */
#ifndef CLI_EXPLAIN_HIDERS_H
#define CLI_EXPLAIN_HIDERS_H

#include <softshadow.h>
#include <stdbool.h>
#include <stddef.h>

typedef struct hider {
    uint64_t primitive; /* mesh << 32 | triangle */
    uint64_t pixels;
} hider;

typedef struct hiders {
    hider *list; /* most first; of equal ones the lower number */
    size_t count;
    uint64_t pixels; /* that are part of the light */
    uint64_t hidden; /* of these */
} hiders;

/* False when memory runs out. */
bool hiders_count(hiders *out, const softshadow_explanation *explanation);
void hiders_free(hiders *h);

/* Red, green, blue 0..1, as for a screen. */
void hiders_colour(uint64_t primitive, float rgb[3]);

#endif
