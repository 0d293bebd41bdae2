/* softshadow bench --pictures DIR: what the camera sees, and how far each method is from it there.
 * Where there is no error a picture is the shadow in dark grey; blue: too dark, orange: too
 * light. */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "../image/image.h"
#include "../render/shade.h"
#include "matrix.h"
#include "report.h"

enum { PATH_ROOM = 4096, RGB = 3 };

struct pictures {
    const bench_cell *cell;
    const bench_truth *truth;
    const char *folder;
    const image_module *module;
    uint32_t side;
    float *pixels;
};

static bool save(pictures *p, const char *name, cli_error *error) {
    static const char *const metadata[] = {"Software", "softshadow bench --pictures", NULL};
    const image_plane planes[] = {
        {"R", p->pixels, RGB}, {"G", p->pixels + 1, RGB}, {"B", p->pixels + 2, RGB}};
    const image_picture picture = {.width = p->side,
                                   .height = p->side,
                                   .planes = planes,
                                   .plane_count = RGB,
                                   .srgb = true,
                                   .metadata = metadata};
    char path[PATH_ROOM], message[IMAGE_WHY] = "";
    void *bytes = NULL;
    size_t size = 0;
    if (snprintf(path, sizeof path, "%s/%s-%s-%s.png", p->folder, p->cell->scene->name,
                 p->cell->light_name, name) >= PATH_ROOM)
        return cli_fail(error, CLI_FAILED, "--pictures: the name is too long");
    if (!p->module->encode(&picture, IMAGE_PNG, &bytes, &size, message))
        return cli_fail(error, CLI_FAILED, "%.200s: %.200s", path, message);
    const cli_text text = {.begin = bytes, .length = size};
    const bool fine = report_save(&text, path, error);
    p->module->free_bytes(bytes);
    return fine;
}

static float *pixel_of(const pictures *p, size_t i) {
    return p->pixels + RGB * (size_t)p->cell->points.pixels[p->truth->index[i]];
}

static void show_truth(pictures *p) {
    for (size_t i = 0; i < p->truth->count; i++)
        for (int k = 0; k < RGB; k++) pixel_of(p, i)[k] = shade_srgb(p->truth->value[i]);
}

/* The root makes an error of 1/256 visible beside one of 1. */
static void show_error(pictures *p, const float *answer) {
    static const float dark[RGB] = {.2f, .6f, 1}, light[RGB] = {1, .55f, .1f};
    for (size_t i = 0; i < p->truth->count; i++) {
        const float by = answer[i] - p->truth->value[i], part = fminf(1, sqrtf(fabsf(by)));
        const float ground = .1f + .15f * p->truth->value[i];
        const float *hue = by < 0 ? dark : light;
        for (int k = 0; k < RGB; k++) pixel_of(p, i)[k] = ground + part * (hue[k] - ground);
    }
}

bool pictures_open(pictures **out, const char *folder, const bench_cell *cell,
                   const bench_truth *truth, cli_error *error) {
    *out = NULL;
    const image_module *module = image_load(error);
    if (!module) return false;
    if (mkdir(folder, 0777) != 0 && errno != EEXIST)
        return cli_fail(error, CLI_FAILED, "--pictures %.200s: cannot be made: %s", folder,
                        strerror(errno));
    pictures *p = malloc(sizeof *p);
    if (!p) return cli_fail(error, CLI_FAILED, "memory ran out");
    *p = (pictures){cell, truth, folder, module, cell->points.side, NULL};
    p->pixels = calloc((size_t)p->side * p->side, RGB * sizeof *p->pixels);
    *out = p;
    if (!p->pixels) return cli_fail(error, CLI_FAILED, "memory ran out");
    show_truth(p);
    return save(p, "truth", error);
}

bool pictures_add(pictures *p, const matrix_way *way, const float *answer, cli_error *error) {
    char name[80];
    snprintf(name, sizeof name, "%s%s", way->method,
             strcmp(way->backend, "egl") == 0 ? " egl" : "");
    char *to = name;
    for (const char *from = name; *from; from++) /* "penumbra-limit (propagated)" */
        if (*from != '(' && *from != ')') *to++ = *from == ' ' ? '-' : *from;
    *to = 0;
    show_error(p, answer);
    return save(p, name, error);
}

void pictures_close(pictures *p) {
    if (!p) return;
    free(p->pixels);
    free(p);
}
