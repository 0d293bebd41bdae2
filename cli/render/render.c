/* render.c - softshadow render: a preview of a scene with its soft shadows. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "../commands.h"
#include "../image/image.h"
#include "../number.h"
#include "../options.h"
#include "../output.h"
#include "picture.h"
#include "shade.h"

enum { MOST_FILES = 8, MOST_PLANES = 16 + CLI_MOST_LIGHTS, MOST_SIDE = 16384 };

enum { AOV_VISIBILITY = 1, AOV_POSITION = 2, AOV_NORMAL = 4, AOV_DEPTH = 8 };

typedef struct request {
    picture picture;
    cli_build_options build;
    double ground; /* NAN: none, INFINITY: under the meshes */
    uint32_t aov, shading, up;
    double exposure;
    const char *files[MOST_FILES];
    image_format formats[MOST_FILES];
    uint32_t file_count;
} request;

/* ---- Options --------------------------------------------------------------------------------*/

static bool take_camera(void *into, const char *value, cli_error *error) {
    return camera_parse(&((request *)into)->picture.camera, value, error);
}

static bool take_size(void *into, const char *value, cli_error *error) {
    picture *p = &((request *)into)->picture;
    const char *at = value, *end = value + strlen(value);
    int64_t width, height;
    cli_shown shown;
    if (cli_number_int(&at, end, &width) != CLI_NUMBER_OK || at == end || *at++ != 'x' ||
        cli_number_int(&at, end, &height) != CLI_NUMBER_OK || at != end || width < 1 ||
        height < 1 || width > MOST_SIDE || height > MOST_SIDE)
        return cli_fail(error, CLI_USAGE, "--size %s: WxH is allowed, both 1 to %d",
                        cli_show(&shown, value, strlen(value)), MOST_SIDE);
    p->width = (uint32_t)width;
    p->height = (uint32_t)height;
    return true;
}

static bool take_ground(void *into, const char *value, cli_error *error) {
    request *r = into;
    const char *at = value, *end = value + strlen(value);
    cli_shown shown;
    if (strcmp(value, "on") == 0) return r->ground = INFINITY, true;
    if (strcmp(value, "off") == 0) return r->ground = NAN, true;
    if (cli_number_double(&at, end, &r->ground) == CLI_NUMBER_OK && at == end &&
        fabs(r->ground) <= 1e15)
        return true;
    return cli_fail(error, CLI_USAGE, "--ground %s: on, off or a height within +-1e15 is allowed",
                    cli_show(&shown, value, strlen(value)));
}

static bool take_aov(void *into, const char *value, cli_error *error) {
    static const char *const names[] = {"visibility", "position", "normal", "depth"};
    request *r = into;
    cli_shown shown;
    for (const char *at = value;; at++) {
        const size_t length = strcspn(at, ",");
        int which = 0;
        while (which < 4 &&
               !(strlen(names[which]) == length && memcmp(at, names[which], length) == 0))
            which++;
        if (which == 4)
            return cli_fail(
                error, CLI_USAGE,
                "--aov %s: visibility, position, normal, depth are allowed, with commas",
                cli_show(&shown, at, length));
        r->aov |= 1u << which;
        at += length;
        if (!*at) return true;
    }
}

static bool take_file(void *into, const char *value, cli_error *error) {
    request *r = into;
    char shown[208];
    if (r->file_count == MOST_FILES)
        return cli_fail(error, CLI_USAGE, "-o: at most %d files are allowed", MOST_FILES);
    if (!image_format_of(value, &r->formats[r->file_count]))
        return cli_fail(error, CLI_USAGE,
                        "-o %s: a name that ends in .exr, .png or .tif is allowed",
                        cli_show_path(value, shown));
    r->files[r->file_count++] = value;
    return true;
}

static bool parse(request *r, int argc, char **argv, char ***meshes, int *mesh_count, int *status) {
    static const char *const shadings[] = {"smooth", "flat", NULL}, *const ups[] = {"y", "z", NULL};
    static const char *const headings[] = {"Picture", "Lights and method", "Running", NULL};
    picture *p = &r->picture;
    cli_option build[CLI_BUILD_TABLE], run[CLI_RUN_TABLE];
    const cli_option own[] = {
        {.name = "output",
         .letter = 'o',
         .kind = CLI_TAKE,
         .argument = "FILE",
         .into = r,
         .take = take_file,
         .help = "FILE.exr: linear floats, RGBA and --aov; FILE.png: 8 bits,\n"
                 "sRGB, over a grey background; FILE.tif: as EXR. May be repeated"},
        {.name = "size",
         .letter = 's',
         .kind = CLI_TAKE,
         .argument = "WxH",
         .into = r,
         .take = take_size,
         .help = "in pixels (800x600)"},
        {.name = "camera",
         .letter = 'c',
         .kind = CLI_TAKE,
         .argument = "EX,EY,EZ/TX,TY,TZ/FOV",
         .into = r,
         .take = take_camera,
         .help = "eye, target, and the field of view across the shorter\nside in degrees (frames "
                 "the meshes)"},
        {.name = "up",
         .kind = CLI_CHOICE,
         .argument = "y|z",
         .into = &r->up,
         .choices = ups,
         .help = "the axis that points to the sky (y)"},
        {.name = "ground",
         .kind = CLI_TAKE,
         .argument = "on|off|HEIGHT",
         .into = r,
         .take = take_ground,
         .help = "a floor that receives shadows and casts none (on: just\nunder the meshes)"},
        {.name = "shading",
         .kind = CLI_CHOICE,
         .argument = "KIND",
         .into = &r->shading,
         .choices = shadings,
         .help = "smooth: creases of 40 degrees and more stay; flat (smooth)"},
        {.name = "aa",
         .kind = CLI_UINT,
         .argument = "N",
         .into = &p->aa,
         .low = 1,
         .high = 16,
         .help = "N x N rays a pixel (2)"},
        {.name = "albedo",
         .kind = CLI_REALS,
         .argument = "R,G,B",
         .into = p->albedo,
         .length = 3,
         .help = "of the meshes (0.7,0.66,0.6)"},
        {.name = "ground-albedo",
         .kind = CLI_REALS,
         .argument = "R,G,B",
         .into = p->ground_albedo,
         .length = 3,
         .help = "(0.55,0.55,0.55)"},
        {.name = "ambient",
         .kind = CLI_REAL,
         .argument = "A",
         .into = &p->ambient,
         .low = 0,
         .high = 1e6,
         .help = "light that no shadow takes away (0.06)"},
        {.name = "exposure",
         .kind = CLI_REAL,
         .argument = "EV",
         .into = &r->exposure,
         .low = -32,
         .high = 32,
         .help = "of a PNG, in stops (0: what the lights, all together,\n"
                 "give at the meshes' centre is 1)"},
        {.name = "aov",
         .kind = CLI_TAKE,
         .argument = "LIST",
         .into = r,
         .take = take_aov,
         .help = "further channels of an EXR or TIFF: visibility,position,\nnormal,depth"},
        {0}};
    const cli_command command = {
        .name = "render",
        .usage = "MESH... --light LIGHT -o FILE [OPTION...]",
        .about =
            "Renders a preview: the meshes on a ground, diffuse, under the lights with their soft\n"
            "shadows. What was made, and in what time, is told on stderr.",
        .table_names = headings,
        .tables = {own, build, run},
        .more = "--tolerance is N/128 with --aa N unless it or --samples is given: a pixel is the "
                "mean of its\n"
                "rays.\n\nExamples:\n"
                "  softshadow render bunny.obj --light sphere:3,4,2,0.5 -o bunny.png\n"
                "  softshadow render a.ply b.ply --up z --light sun:1,1,-2,0.27 --aa 1 \\\n"
                "      --aov position,normal,visibility -o passes.exr\n"};
    cli_build_options_tables(&r->build, build, run);
    if (!cli_options_parse(&command, argc, argv, meshes, mesh_count, status)) return false;
    p->smooth = r->shading == 0;
    p->up = "yz"[r->up];
    return true;
}

/* A pixel is the mean of aa x aa points whose errors are independent: 1/128 a
 * pixel is what a preview needs. */
static void choose_tolerance(request *r) {
    softshadow_build *b = &r->build.build;
    if (b->tolerance == 0 && b->samples == 0) b->tolerance = fmin(r->picture.aa / 128.0, 1);
}

static bool check(request *r, int mesh_count, cli_error *error) {
    if (!mesh_count)
        return cli_fail(error, CLI_USAGE,
                        "a mesh is missing, OBJ, PLY, STL and OFF files are allowed");
    if (!r->file_count) return cli_fail(error, CLI_USAGE, "-o FILE.exr or FILE.png is missing");
    bool room = false;
    for (uint32_t i = 0; i < r->file_count; i++) room |= r->formats[i] != IMAGE_PNG;
    if (r->aov && !room)
        return cli_fail(error, CLI_USAGE,
                        "--aov: a PNG has no room for it, -o FILE.exr is allowed");
    for (int c = 0; c < 3; c++)
        if (r->picture.albedo[c] < 0 || r->picture.ground_albedo[c] < 0)
            return cli_fail(error, CLI_USAGE, "--albedo: 0 and more is allowed");
    choose_tolerance(r);
    return cli_build_options_finish(&r->build, error);
}

/* ---- Files ----------------------------------------------------------------------------------*/

static void add_plane(image_picture *out, image_plane *planes, const char *name,
                      const float *values, size_t stride) {
    planes[out->plane_count++] = (image_plane){name, values, stride};
}

static void add_three(image_picture *out, image_plane *planes, const char *const names[3],
                      const float *values) {
    for (size_t i = 0; i < 3; i++) add_plane(out, planes, names[i], values + i, 3);
}

/* "visibility" for the first light, "visibility.2" for the second ... */
static void add_visibility(image_picture *out, image_plane *planes, const picture *p,
                           char names[CLI_MOST_LIGHTS][24]) {
    const uint32_t lights = p->build->light_count;
    for (uint32_t l = 0; l < lights; l++) {
        snprintf(names[l], sizeof names[l], l ? "visibility.%u" : "visibility", l + 1);
        add_plane(out, planes, names[l], p->visibility + l, lights);
    }
}

/* What a PNG shows: the picture over a grey that is lighter below, exposed, encoded for a screen.
 */
static float *develop(const request *r) {
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

static bool write_file(const image_module *module, const image_picture *image, image_format format,
                       cli_output *output, cli_error *error) {
    void *bytes = NULL;
    size_t size = 0;
    char why[IMAGE_WHY] = "";
    if (!module->encode(image, format, &bytes, &size, why))
        return cli_fail(error, CLI_FAILED, "%s: %s", output->name, why);
    const bool done =
        cli_output_write(output, bytes, size, error) && cli_output_commit(output, error);
    module->free_bytes(bytes);
    return done;
}

static bool write_linear(const request *r, image_format format, const image_module *module,
                         const char *const *metadata, cli_output *output, cli_error *error) {
    static const char *const position[3] = {"P.X", "P.Y", "P.Z"}, *const normal[3] = {"N.X", "N.Y",
                                                                                      "N.Z"};
    static const char *const beauty[4] = {"R", "G", "B", "A"};
    const picture *p = &r->picture;
    image_plane planes[MOST_PLANES];
    char names[CLI_MOST_LIGHTS][24];
    image_picture image = {
        .width = p->width, .height = p->height, .planes = planes, .metadata = metadata};
    for (size_t c = 0; c < 4; c++) add_plane(&image, planes, beauty[c], p->beauty + c, 4);
    if (r->aov & AOV_VISIBILITY) add_visibility(&image, planes, p, names);
    if (r->aov & AOV_POSITION) add_three(&image, planes, position, p->position);
    if (r->aov & AOV_NORMAL) add_three(&image, planes, normal, p->normal);
    if (r->aov & AOV_DEPTH) add_plane(&image, planes, "Z", p->depth, 1);
    return write_file(module, &image, format, output, error);
}

static bool write_screen(const request *r, const image_module *module, const char *const *metadata,
                         cli_output *output, cli_error *error) {
    static const char *const names[3] = {"R", "G", "B"};
    const picture *p = &r->picture;
    float *screen = develop(r);
    if (!screen) return cli_fail(error, CLI_FAILED, "memory ran out");
    image_plane planes[3];
    image_picture image = {.width = p->width,
                           .height = p->height,
                           .planes = planes,
                           .srgb = true,
                           .metadata = metadata};
    add_three(&image, planes, names, screen);
    const bool done = write_file(module, &image, IMAGE_PNG, output, error);
    free(screen);
    return done;
}

static bool write_all(const request *r, const cli_scene *scene, const image_module *module,
                      cli_output *outputs, cli_error *error) {
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    if (softshadow_get_stats(scene->handle, &stats) != SOFTSHADOW_OK || !stats.method_used)
        stats.method_used = "unknown";
    char software[40];
    snprintf(software, sizeof software, "softshadow %s", softshadow_version_string());
    const char *const metadata[] = {"Software", software, "softshadow:method", stats.method_used,
                                    NULL};
    for (uint32_t i = 0; i < r->file_count; i++) {
        const bool done =
            r->formats[i] == IMAGE_PNG
                ? write_screen(r, module, metadata, &outputs[i], error)
                : write_linear(r, r->formats[i], module, metadata, &outputs[i], error);
        if (!done) return false;
    }
    return true;
}

/* ---- The command ----------------------------------------------------------------------------*/

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void tell(const request *r, const cli_scene *scene, double seconds) {
    const picture *p = &r->picture;
    softshadow_stats s = SOFTSHADOW_STATS_INIT;
    if (r->build.quiet || softshadow_get_stats(scene->handle, &s) != SOFTSHADOW_OK) return;
    fprintf(stderr,
            "%ux%u pixels, %llu points, %s: %llu rays; building %.2f s, visibility %.2f s, all "
            "%.2f s\n",
            p->width, p->height, (unsigned long long)p->points, s.method_used ? s.method_used : "?",
            (unsigned long long)s.rays, s.build_seconds, s.query_seconds, seconds);
    for (uint32_t i = 0; i < r->file_count; i++) fprintf(stderr, "wrote %s\n", r->files[i]);
}

static bool make(request *r, cli_scene *scene, const image_module *module, cli_output *outputs,
                 cli_error *error) {
    picture *p = &r->picture;
    p->build = &r->build;
    p->verify = r->build.verify ? r->build.verify_points : 0;
    return picture_prepare(p, scene, r->ground, error) && picture_render(p, scene, error) &&
           write_all(r, scene, module, outputs, error) &&
           (!r->build.verify || picture_verify(p, scene, error)) &&
           (!r->build.stats || cli_scene_print_stats(scene, r->build.stats_form == 1, error));
}

/* Files are opened first: that a folder cannot be written is best known before the work. */
static bool run(request *r, char *const *meshes, int mesh_count, cli_error *error) {
    const double begin = now();
    cli_output outputs[MOST_FILES] = {{0}};
    cli_scene scene;
    const image_module *module = image_load(error);
    bool done = module != NULL;
    for (uint32_t i = 0; done && i < r->file_count; i++)
        done = cli_output_open(&outputs[i], r->files[i], error);
    if (done && (done = cli_scene_open(&scene, &r->build, meshes, mesh_count, error))) {
        done = make(r, &scene, module, outputs, error);
        if (done) tell(r, &scene, now() - begin);
        cli_scene_close(&scene);
    }
    for (uint32_t i = 0; i < r->file_count; i++) cli_output_abandon(&outputs[i]);
    return done;
}

int cli_render(int argc, char **argv) {
    request *r = calloc(1, sizeof *r);
    if (!r) return fprintf(stderr, "softshadow render: memory ran out\n"), CLI_FAILED;
    r->build = (cli_build_options)CLI_BUILD_OPTIONS_INIT;
    r->picture = (picture){.width = 800,
                           .height = 600,
                           .aa = 2,
                           .albedo = {0.7, 0.66, 0.6},
                           .ground_albedo = {0.55, 0.55, 0.55},
                           .ambient = 0.06};
    r->ground = INFINITY;
    char **meshes;
    int mesh_count, status = 0;
    cli_error error;
    if (parse(r, argc, argv, &meshes, &mesh_count, &status) &&
        !(check(r, mesh_count, &error) && run(r, meshes, mesh_count, &error)))
        status = cli_options_complain("render", &error);
    picture_free(&r->picture);
    cli_build_options_free(&r->build);
    free(r);
    return status;
}
