/* passes.c - positions and normals out of images that POV-Ray rendered with softshadow.inc. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "povray.h"

typedef struct pass {
    uint32_t width, height;
    float *pixels; /* r g b */
} pass;

static bool read_channels(const image_module *module, image_file *file, const image_info *info,
                          pass *out, const char *path, cli_error *error) {
    char why[IMAGE_WHY] = "", shown[208];
    if (info->channel_count < 3 || info->channels[0].type != IMAGE_INTEGER)
        return cli_fail(error, CLI_FAILED, "%s: is no PNG of 16 bits in red, green and blue",
                        cli_show_path(path, shown));
    out->pixels = malloc((size_t)info->width * info->height * 3 * sizeof(float));
    if (!out->pixels) return cli_fail(error, CLI_FAILED, "memory ran out");
    for (uint32_t c = 0; c < 3; c++)
        if (!module->read(file, c, out->pixels + c, 3, why))
            return cli_fail(error, CLI_FAILED, "%s", why);
    return true;
}

static bool read_pass(const image_module *module, const char *path, pass *out, cli_error *error) {
    char why[IMAGE_WHY] = "";
    image_info info;
    image_file *file = module->open(path, why);
    if (!file) return cli_fail(error, CLI_FAILED, "%s", why);
    module->about(file, &info);
    *out = (pass){info.width, info.height, NULL};
    const bool fine = read_channels(module, file, &info, out, path, error);
    module->close(file);
    return fine;
}

static bool same_size(const pass *a, const pass *b, const char *what, cli_error *error) {
    return (a->width == b->width && a->height == b->height) ||
           cli_fail(error, CLI_FAILED, "%s: is %ux%u, the first of --positions %ux%u", what,
                    b->width, b->height, a->width, a->height);
}

/* The picture as render has it: alpha, positions, normals; zero where there is nothing. */
typedef struct found {
    float *alpha, *position, *normal;
} found;

static void decode(const povray_job *job, const pass *coarse, const pass *fine, const pass *normals,
                   found *out) {
    const size_t pixels = (size_t)coarse->width * coarse->height;
    for (size_t i = 0; i < pixels; i++) {
        const float *high = coarse->pixels + 3 * i, *low = fine->pixels + 3 * i;
        out->alpha[i] = high[0] > 0 || high[1] > 0 || high[2] > 0;
        for (size_t a = 0; out->alpha[i] > 0 && a < 3; a++) {
            /* The first image holds whole steps, which rounding gives back exactly. */
            const double steps = nearbyint(65535.0 * (double)high[a]) + (double)low[a];
            out->position[3 * i + a] =
                (float)(job->box[a] + (job->box[3 + a] - job->box[a]) * steps / 65535.0);
        }
        if (!normals || out->alpha[i] <= 0) continue;
        const float *turn = normals->pixels + 3 * i;
        const vector n = vector_unit(
            (vector){cos(M_PI * (1 - (double)turn[0])), cos(M_PI * (1 - (double)turn[1])),
                     cos(M_PI * (1 - (double)turn[2]))});
        out->normal[3 * i] = (float)n.x;
        out->normal[3 * i + 1] = (float)n.y;
        out->normal[3 * i + 2] = (float)n.z;
    }
}

static bool make(const povray_job *job, const pass *coarse, const pass *fine, const pass *normals,
                 cli_error *error) {
    static const char *const alpha[] = {"A"}, *const position[] = {"P.X", "P.Y", "P.Z"},
                             *const normal[] = {"N.X", "N.Y", "N.Z"};
    const size_t pixels = (size_t)coarse->width * coarse->height;
    found f = {calloc(pixels, sizeof(float)), calloc(3 * pixels, sizeof(float)),
               calloc(3 * pixels, sizeof(float))};
    planes *list = calloc(1, sizeof *list);
    bool done = false;
    if (f.alpha && f.position && f.normal && list) {
        decode(job, coarse, fine, normals, &f);
        planes_add(list, f.alpha, 1, 1, alpha);
        planes_add(list, f.position, 3, 3, position);
        if (normals) planes_add(list, f.normal, 3, 3, normal);
        done = povray_write_exr(job->output, list, coarse->width, coarse->height, error);
    } else {
        cli_fail(error, CLI_FAILED, "memory ran out");
    }
    free(f.alpha);
    free(f.position);
    free(f.normal);
    free(list);
    return done;
}

static bool read_all(const povray_job *job, const image_module *module, const char *first,
                     const char *second, pass passes[3], cli_error *error) {
    const pass *normals = job->normals ? &passes[2] : NULL;
    return read_pass(module, first, &passes[0], error) &&
           read_pass(module, second, &passes[1], error) &&
           same_size(&passes[0], &passes[1], second, error) &&
           (!normals || (read_pass(module, job->normals, &passes[2], error) &&
                         same_size(&passes[0], &passes[2], job->normals, error))) &&
           make(job, &passes[0], &passes[1], normals, error);
}

bool povray_read_passes(const povray_job *job, cli_error *error) {
    const char *comma = strchr(job->positions, ',');
    const image_module *module = image_load(error);
    if (!module) return false;
    if (!comma || comma == job->positions || !comma[1])
        return cli_fail(error, CLI_USAGE, "--positions %s: COARSE.png,FINE.png is allowed",
                        job->positions);
    char *first = strndup(job->positions, (size_t)(comma - job->positions));
    if (!first) return cli_fail(error, CLI_FAILED, "memory ran out");
    pass passes[3] = {{0}};
    const bool fine = read_all(job, module, first, comma + 1, passes, error);
    for (int i = 0; i < 3; i++) free(passes[i].pixels);
    free(first);
    return fine;
}

bool povray_write_exr(const char *path, const planes *list, uint32_t width, uint32_t height,
                      cli_error *error) {
    const image_module *module = image_load(error);
    const image_picture image = {
        .width = width, .height = height, .planes = list->plane, .plane_count = list->count};
    cli_output output = {.fd = -1};
    char why[IMAGE_WHY] = "";
    void *bytes = NULL;
    size_t size = 0;
    if (!module || !cli_output_open(&output, path, error)) return false;
    bool fine = module->encode(&image, IMAGE_EXR, &bytes, &size, why) ||
                cli_fail(error, CLI_FAILED, "%s: %s", output.name, why);
    fine = fine && cli_output_write(&output, bytes, size, error) &&
           cli_output_commit(&output, error);
    module->free_bytes(bytes);
    cli_output_abandon(&output);
    return fine;
}
