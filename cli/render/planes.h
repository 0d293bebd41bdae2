/* planes.h - a picture's planes under the names that files and hosts know them by. */
#ifndef CLI_RENDER_PLANES_H
#define CLI_RENDER_PLANES_H

#include "../image/image.h"
#include "request.h"

enum { PLANES_MOST = 16 + 4 * CLI_MOST_LIGHTS, PLANES_NAME = 32 };

typedef struct planes {
    image_plane plane[PLANES_MOST];
    uint32_t count;
    char name[PLANES_MOST][PLANES_NAME];
} planes;

/* R G B A, then what request->aov has. Before picture_begin() there are names without values. */
void planes_list(planes *out, const request *r);

/* Further names; name[i] for values + i, stride floats from pixel to pixel. */
void planes_add(planes *out, const float *values, size_t stride, uint32_t count,
                const char *const *names);

/* What a screen shows: r g b a pixel over a grey that is lighter below, exposed, encoded (sRGB).
 * To be freed; NULL when memory ran out. */
float *planes_screen(const request *r);

#endif
