/* render.c - softshadow render: a preview of a scene with its soft shadows. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "../commands.h"
#include "../image/image.h"
#include "../options.h"
#include "../output.h"
#include "planes.h"
#include "request.h"

enum { MOST_FILES = 8 };

/* The request, and where it is written. */
typedef struct job {
    request request;
    const char *files[MOST_FILES];
    image_format formats[MOST_FILES];
    uint32_t file_count;
} job;

/* ---- Options --------------------------------------------------------------------------------*/

static bool take_file(void *into, const char *value, cli_error *error) {
    job *j = into;
    char shown[208];
    if (j->file_count == MOST_FILES)
        return cli_fail(error, CLI_USAGE, "-o: at most %d files are allowed", MOST_FILES);
    if (!image_format_of(value, &j->formats[j->file_count]))
        return cli_fail(error, CLI_USAGE,
                        "-o %s: a name that ends in .exr, .png or .tif is allowed",
                        cli_show_path(value, shown));
    j->files[j->file_count++] = value;
    return true;
}

static bool parse(job *j, int argc, char **argv, int *status) {
    static const char *const headings[] = {"Files", "Picture", "Lights and method", "Running"};
    cli_option own[REQUEST_TABLE], build[CLI_BUILD_TABLE], run[CLI_RUN_TABLE];
    const cli_option files[] = {
        {.name = "output",
         .letter = 'o',
         .kind = CLI_TAKE,
         .argument = "FILE",
         .into = j,
         .take = take_file,
         .help = "FILE.exr: linear floats, RGBA and --aov; FILE.png: 8 bits,\n"
                 "sRGB, over a grey background; FILE.tif: as EXR. May be repeated"},
        {0}};
    const cli_command command = {
        .name = "render",
        .usage = "SCENE.softshadow|MESH... --light LIGHT -o FILE [OPTION...]",
        .about =
            "Renders a preview: the meshes on a ground, diffuse, under the lights with their soft\n"
            "shadows. What was made, and in what time, is told on stderr.\n\n"
            "A scene file holds meshes and options, one a line without dashes, below the line\n"
            "'softshadow 1'; options of the command line go before its own, meshes and lights are\n"
            "added to its own.",
        .table_names = headings,
        .tables = {files, own, build, run},
        .more = "--tolerance is N/128 with --aa N unless it or --samples is given: a pixel is the "
                "mean of its\n"
                "rays.\n\nExamples:\n"
                "  softshadow render bunny.obj --light sphere:3,4,2,0.5 -o bunny.png\n"
                "  softshadow render a.ply b.ply --up z --light sun:1,1,-2,0.27 --aa 1 \\\n"
                "      --aov position,normal,visibility -o passes.exr\n"
                "  softshadow render bunny.softshadow --size 320x240 -o small.png\n"};
    request_table(&j->request, own);
    cli_build_options_tables(&j->request.build, build, run);
    return request_arguments(&j->request, j, sizeof *j, &command, argc, argv, status);
}

static bool check(job *j, cli_error *error) {
    if (!j->request.mesh_count)
        return cli_fail(error, CLI_USAGE,
                        "a mesh is missing, OBJ, PLY, STL and OFF files are allowed");
    if (!j->file_count) return cli_fail(error, CLI_USAGE, "-o FILE.exr or FILE.png is missing");
    bool room = false;
    for (uint32_t i = 0; i < j->file_count; i++) room |= j->formats[i] != IMAGE_PNG;
    if ((j->request.aov & ~j->request.scene_aov) && !room)
        return cli_fail(error, CLI_USAGE,
                        "--aov: a PNG has no room for it, -o FILE.exr is allowed");
    return request_finish(&j->request, error);
}

/* ---- Files ----------------------------------------------------------------------------------*/

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

static bool write_planes(const job *j, bool screen, image_format format, const image_module *module,
                         const char *const *metadata, cli_output *output, cli_error *error) {
    static const char *const names[] = {"R", "G", "B"};
    float *pixels = screen ? planes_screen(&j->request) : NULL;
    planes *list = calloc(1, sizeof *list);
    bool done = false;
    if (!list || (screen && !pixels)) {
        cli_fail(error, CLI_FAILED, "memory ran out");
    } else {
        screen ? planes_add(list, pixels, 3, 3, names) : planes_list(list, &j->request);
        const image_picture image = {.width = j->request.picture.width,
                                     .height = j->request.picture.height,
                                     .planes = list->plane,
                                     .plane_count = list->count,
                                     .srgb = screen,
                                     .metadata = metadata};
        done = write_file(module, &image, format, output, error);
    }
    free(list);
    free(pixels);
    return done;
}

static bool write_all(const job *j, const cli_scene *scene, const image_module *module,
                      cli_output *outputs, cli_error *error) {
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    if (softshadow_get_stats(scene->handle, &stats) != SOFTSHADOW_OK || !stats.method_used)
        stats.method_used = "unknown";
    char software[40];
    snprintf(software, sizeof software, "softshadow %s", softshadow_version_string());
    const char *const metadata[] = {"Software", software, "softshadow.method", stats.method_used,
                                    NULL};
    for (uint32_t i = 0; i < j->file_count; i++) {
        const image_format format = j->formats[i];
        if (!write_planes(j, format == IMAGE_PNG, format, module, metadata, &outputs[i], error))
            return false;
    }
    return true;
}

/* ---- The command ----------------------------------------------------------------------------*/

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void tell(const job *j, const cli_scene *scene, double seconds) {
    const picture *p = &j->request.picture;
    softshadow_stats s = SOFTSHADOW_STATS_INIT;
    if (j->request.build.quiet || softshadow_get_stats(scene->handle, &s) != SOFTSHADOW_OK) return;
    fprintf(stderr,
            "%ux%u pixels, %llu points, %s: %llu rays; building %.2f s, visibility %.2f s, all "
            "%.2f s\n",
            p->width, p->height, (unsigned long long)p->points, s.method_used ? s.method_used : "?",
            (unsigned long long)s.rays, s.build_seconds, s.query_seconds, seconds);
    for (uint32_t i = 0; i < j->file_count; i++) fprintf(stderr, "wrote %s\n", j->files[i]);
}

static bool make(job *j, cli_scene *scene, const image_module *module, cli_output *outputs,
                 cli_error *error) {
    const cli_build_options *options = &j->request.build;
    picture *p = &j->request.picture;
    p->verify = options->verify ? options->verify_points : 0;
    return picture_prepare(p, scene, j->request.ground, error) && picture_begin(p, error) &&
           picture_rows(p, scene, 0, p->height, error) &&
           write_all(j, scene, module, outputs, error) &&
           (!options->verify || picture_verify(p, scene, error)) &&
           (!options->stats || cli_scene_print_stats(scene, options->stats_form == 1, error));
}

/* Files are opened first: that a folder cannot be written is best known before the work. */
static bool run(job *j, cli_error *error) {
    const double begin = now();
    cli_output outputs[MOST_FILES] = {{0}};
    cli_scene scene;
    const image_module *module = image_load(error);
    bool done = module != NULL;
    for (uint32_t i = 0; done && i < j->file_count; i++)
        done = cli_output_open(&outputs[i], j->files[i], error);
    if (done && (done = cli_scene_open(&scene, &j->request.build, j->request.meshes,
                                       (int)j->request.mesh_count, error))) {
        done = make(j, &scene, module, outputs, error);
        if (done) tell(j, &scene, now() - begin);
        cli_scene_close(&scene);
    }
    for (uint32_t i = 0; i < j->file_count; i++) cli_output_abandon(&outputs[i]);
    return done;
}

int cli_render(int argc, char **argv) {
    job *j = calloc(1, sizeof *j);
    if (!j) return fprintf(stderr, "softshadow render: memory ran out\n"), CLI_FAILED;
    request_init(&j->request);
    int status = 0;
    cli_error error;
    if (parse(j, argc, argv, &status) && !(check(j, &error) && run(j, &error)))
        status = cli_options_complain("render", &error);
    request_free(&j->request);
    free(j);
    return status;
}
