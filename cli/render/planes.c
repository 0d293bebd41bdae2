/* planes.c */
#include "planes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "shade.h"

void planes_add(planes *out, const float *values, size_t stride, uint32_t count,
                const char *const *names) {
    for (uint32_t i = 0; i < count; i++) {
        char *name = out->name[out->count];
        snprintf(name, PLANES_NAME, "%s", names[i]);
        out->plane[out->count++] = (image_plane){name, values ? values + i : NULL, stride};
    }
}

/* "visibility" for the first light, "visibility.2" for the second ...; behind them axes, if any. */
static void add_lights(planes *out, const request *r, const char *stem, const char *axes,
                       const float *values) {
    const uint32_t lights = r->build.light_count, axis_count = *axes ? 3 : 1;
    char number[16] = "", name[3][PLANES_NAME];
    const char *const names[] = {name[0], name[1], name[2]};
    for (uint32_t l = 0; l < lights; l++) {
        if (l) snprintf(number, sizeof number, ".%u", l + 1);
        for (uint32_t a = 0; a < axis_count; a++)
            snprintf(name[a], PLANES_NAME, *axes ? "%s%s.%c" : "%s%s", stem, number, axes[a]);
        planes_add(out, values ? values + (size_t)axis_count * l : NULL,
                   (size_t)axis_count * lights, axis_count, names);
    }
}

void planes_list(planes *out, const request *r) {
    static const char *const beauty[] = {"R", "G", "B", "A"}, *const depth[] = {"Z"};
    static const char *const position[] = {"P.X", "P.Y", "P.Z"};
    static const char *const normal[] = {"N.X", "N.Y", "N.Z"};
    static const char *const unlit[] = {"ambient.R", "ambient.G", "ambient.B"};
    const picture *p = &r->picture;
    out->count = 0;
    planes_add(out, p->beauty, 4, 4, beauty);
    if (r->aov & AOV_VISIBILITY) add_lights(out, r, "visibility", "", p->visibility);
    if (r->aov & AOV_POSITION) planes_add(out, p->position, 3, 3, position);
    if (r->aov & AOV_NORMAL) planes_add(out, p->normal, 3, 3, normal);
    if (r->aov & AOV_DEPTH) planes_add(out, p->depth, 1, 1, depth);
    if (!(r->aov & AOV_UNSHADOWED)) return;
    planes_add(out, p->unlit, 3, 3, unlit);
    add_lights(out, r, "unshadowed", "RGB", p->unshadowed);
}

float *planes_screen(const request *r) {
    const picture *p = &r->picture;
    const float gain = (float)exp2(r->exposure);
    float *screen = malloc((size_t)p->width * p->height * 3 * sizeof *screen);
    if (!screen) return NULL;
    for (uint32_t y = 0; y < p->height; y++) {
        const float behind = 0.05f + 0.10f * ((float)y + 0.5f) / (float)p->height;
        for (uint32_t x = 0; x < p->width; x++) {
            const size_t i = (size_t)y * p->width + x;
            const float *rgba = p->beauty + 4 * i;
            for (size_t c = 0; c < 3; c++)
                screen[3 * i + c] = shade_srgb(gain * rgba[c] + (1 - rgba[3]) * behind);
        }
    }
    return screen;
}
