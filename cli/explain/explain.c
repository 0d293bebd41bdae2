/* explain.c - softshadow explain: why a point sees as much of a light as it does. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../commands.h"
#include "../image/image.h"
#include "../number.h"
#include "../options.h"
#include "../output.h"
#include "../scene.h"
#include "hiders.h"

typedef struct request {
    cli_build_options build;
    double at[3], normal[3];
    bool at_given, normal_given, primitive_given;
    uint64_t primitive;
    uint32_t size, top;
    const char *file;
    image_format format;
} request;

/* ---- Options --------------------------------------------------------------------------------*/

static bool take_primitive(void *into, const char *value, cli_error *error) {
    request *r = into;
    const char *at = value, *end = value + strlen(value);
    int64_t mesh, triangle;
    cli_shown shown;
    if (cli_number_int(&at, end, &mesh) != CLI_NUMBER_OK || at == end || *at++ != ':' ||
        cli_number_int(&at, end, &triangle) != CLI_NUMBER_OK || at != end || mesh < 0 ||
        triangle < 0 || mesh >= UINT32_MAX || triangle >= UINT32_MAX)
        return cli_fail(error, CLI_USAGE, "--primitive %s: MESH:TRIANGLE is allowed, both from 0",
                        cli_show(&shown, value, strlen(value)));
    r->primitive = (uint64_t)mesh << 32 | (uint64_t)triangle;
    r->primitive_given = true;
    return true;
}

static bool take_file(void *into, const char *value, cli_error *error) {
    request *r = into;
    char shown[208];
    r->file = value;
    return image_format_of(value, &r->format) ||
           cli_fail(error, CLI_USAGE, "-o %s: a name that ends in .png, .exr or .tif is allowed",
                    cli_show_path(value, shown));
}

static bool parse(request *r, int argc, char **argv, char ***meshes, int *mesh_count, int *status) {
    static const char *const headings[] = {"Point", "Lights and method", "Running", NULL};
    cli_option build[CLI_BUILD_TABLE], run[CLI_RUN_TABLE];
    const cli_option own[] = {{.name = "at",
                               .kind = CLI_REALS,
                               .argument = "X,Y,Z",
                               .into = r->at,
                               .length = 3,
                               .given = &r->at_given,
                               .help = "the point"},
                              {.name = "normal",
                               .kind = CLI_REALS,
                               .argument = "X,Y,Z",
                               .into = r->normal,
                               .length = 3,
                               .given = &r->normal_given,
                               .help = "what lies below its horizon is hidden (none)"},
                              {.name = "primitive",
                               .kind = CLI_TAKE,
                               .argument = "MESH:TRIANGLE",
                               .into = r,
                               .take = take_primitive,
                               .help = "what the point lies on, counted from 0 (what touches it)"},
                              {.name = "output",
                               .letter = 'o',
                               .kind = CLI_TAKE,
                               .argument = "FILE",
                               .into = r,
                               .take = take_file,
                               .help =
                                   "picture of the light as the point sees it (.png .exr .tif):\n"
                                   "white is seen, each triangle that hides has a colour"},
                              {.name = "size",
                               .letter = 's',
                               .kind = CLI_UINT,
                               .argument = "N",
                               .into = &r->size,
                               .low = 1,
                               .high = 4096,
                               .help = "side of that picture; more tells finer fractions (512)"},
                              {.name = "top",
                               .kind = CLI_UINT,
                               .argument = "N",
                               .into = &r->top,
                               .low = 0,
                               .high = UINT32_MAX,
                               .help = "list at most so many triangles (20)"},
                              {0}};
    const cli_command command = {
        .name = "explain",
        .usage = "MESH... --light LIGHT --at X,Y,Z [OPTION...]",
        .about = "Tells which triangles hide how much of a light from one point, and draws the "
                 "light as\n"
                 "that point sees it. Every light is told, one after the other.",
        .table_names = headings,
        .tables = {own, build, run},
        .more = "Example:\n"
                "  softshadow explain bunny.obj --light sphere:3,4,2,0.5 --at -1,-0.99,-0.4 -o "
                "light.png\n"};
    cli_build_options_tables(&r->build, build, run);
    cli_options_drop(run, "verify"); /* it measures batches of points */
    return cli_options_parse(&command, argc, argv, meshes, mesh_count, status);
}

static bool check(request *r, int mesh_count, cli_error *error) {
    if (!mesh_count)
        return cli_fail(error, CLI_USAGE,
                        "a mesh is missing, OBJ, PLY, STL and OFF files are allowed");
    if (!r->at_given) return cli_fail(error, CLI_USAGE, "--at X,Y,Z is missing");
    if (r->file && r->build.light_count > 1)
        return cli_fail(error, CLI_USAGE, "-o: one --light is allowed, there are %u",
                        r->build.light_count);
    return cli_build_options_finish(&r->build, error);
}

/* ---- Words ----------------------------------------------------------------------------------*/

static void tell_hiders(const request *r, const hiders *h) {
    const double whole = h->pixels ? (double)h->pixels : 1;
    uint64_t rest = 0;
    if (h->count && r->top) printf("mesh  triangle    hides\n");
    for (size_t i = 0; i < h->count; i++) {
        const hider *one = &h->list[i];
        if (i >= r->top)
            rest += one->pixels;
        else
            printf("%4u  %8u  %.5f\n", (unsigned)(one->primitive >> 32), (unsigned)one->primitive,
                   (double)one->pixels / whole);
    }
    if (rest) printf("      %zu more  %.5f\n", h->count - r->top, (double)rest / whole);
}

static bool tell(const request *r, const softshadow_explanation *e, const hiders *h,
                 cli_error *error) {
    printf("light %u at %.9g %.9g %.9g\n", e->light, e->centre[0], e->centre[1], e->centre[2]);
    printf("visibility %.6f, hidden by %llu triangle%s\n", (double)e->visibility,
           (unsigned long long)e->triangles, e->triangles == 1 ? "" : "s");
    tell_hiders(r, h);
    if (fflush(stdout) != 0) return cli_fail(error, CLI_FAILED, "stdout: cannot be written");
    return true;
}

/* ---- The picture ----------------------------------------------------------------------------*/

static void colour(const softshadow_explanation *e, size_t i, float rgb[3]) {
    if (!isnan(e->image[i]) && e->image[i] < 0.5f && e->hider[i] != SOFTSHADOW_NO_PRIMITIVE) {
        hiders_colour(e->hider[i], rgb);
        return;
    }
    /* Around the light it is dark; what the horizon hides is a little less so. */
    const float grey = isnan(e->image[i]) ? 0.06f : e->image[i] < 0.5f ? 0.18f : 1;
    rgb[0] = rgb[1] = rgb[2] = grey;
}

static bool write_picture(const request *r, const softshadow_explanation *e, const float *rgb,
                          const image_module *module, cli_output *output, cli_error *error) {
    const char *const metadata[] = {"Software", "softshadow explain", NULL};
    const image_plane planes[] = {
        {"R", rgb, 3}, {"G", rgb + 1, 3}, {"B", rgb + 2, 3}, {"visibility", e->image, 1}};
    const image_picture picture = {.width = e->size,
                                   .height = e->size,
                                   .planes = planes,
                                   .plane_count = r->format == IMAGE_PNG ? 3 : 4,
                                   .srgb = true,
                                   .metadata = metadata};
    void *bytes = NULL;
    size_t size = 0;
    char why[IMAGE_WHY] = "";
    if (!module->encode(&picture, r->format, &bytes, &size, why))
        return cli_fail(error, CLI_FAILED, "%s: %s", output->name, why);
    const bool done =
        cli_output_write(output, bytes, size, error) && cli_output_commit(output, error);
    module->free_bytes(bytes);
    if (done && !r->build.quiet) fprintf(stderr, "wrote %s\n", r->file);
    return done;
}

static bool draw(const request *r, const softshadow_explanation *e, const image_module *module,
                 cli_output *output, cli_error *error) {
    const size_t pixels = (size_t)e->size * e->size;
    float *rgb = malloc(pixels * 3 * sizeof *rgb);
    if (!rgb) return cli_fail(error, CLI_FAILED, "memory ran out");
    for (size_t i = 0; i < pixels; i++) colour(e, i, rgb + 3 * i);
    const bool done = write_picture(r, e, rgb, module, output, error);
    free(rgb);
    return done;
}

/* ---- The command ----------------------------------------------------------------------------*/

static bool explain_light(const request *r, cli_scene *scene, uint32_t light, float *image,
                          uint64_t *hider_of, const image_module *module, cli_output *output,
                          cli_error *error) {
    const float normal[3] = {(float)r->normal[0], (float)r->normal[1], (float)r->normal[2]};
    softshadow_explanation e = SOFTSHADOW_EXPLANATION_INIT;
    memcpy(e.point, r->at, sizeof e.point);
    e.normal = r->normal_given ? normal : NULL;
    e.primitive = r->primitive_given ? &r->primitive : NULL;
    e.light = light;
    e.size = r->size;
    e.image = image;
    e.hider = hider_of;
    const softshadow_status status = softshadow_explain(scene->handle, &e);
    if (status != SOFTSHADOW_OK) return cli_scene_fail(scene, status, NULL, error);
    hiders h;
    bool done = hiders_count(&h, &e) || cli_fail(error, CLI_FAILED, "memory ran out");
    done = done && tell(r, &e, &h, error) && (!module || draw(r, &e, module, output, error));
    hiders_free(&h);
    return done;
}

static bool explain_all(const request *r, cli_scene *scene, const image_module *module,
                        cli_output *output, cli_error *error) {
    const size_t pixels = (size_t)r->size * r->size;
    float *image = malloc(pixels * sizeof *image);
    uint64_t *hider_of = malloc(pixels * sizeof *hider_of);
    bool done = (image && hider_of) || cli_fail(error, CLI_FAILED, "memory ran out");
    for (uint32_t light = 0; done && light < scene->light_count; light++)
        done = explain_light(r, scene, light, image, hider_of, module, output, error);
    free(image);
    free(hider_of);
    return done;
}

static bool run(const request *r, char *const *meshes, int mesh_count, cli_error *error) {
    const image_module *module = NULL;
    cli_output output = {0};
    cli_scene scene;
    if (r->file && (!(module = image_load(error)) || !cli_output_open(&output, r->file, error)))
        return false;
    bool done = cli_scene_open(&scene, &r->build, meshes, mesh_count, error);
    if (done) {
        done = explain_all(r, &scene, module, &output, error) &&
               (!r->build.stats || cli_scene_print_stats(&scene, r->build.stats_form == 1, error));
        cli_scene_close(&scene);
    }
    if (r->file) cli_output_abandon(&output);
    return done;
}

int cli_explain(int argc, char **argv) {
    request *r = calloc(1, sizeof *r);
    if (!r) return fprintf(stderr, "softshadow explain: memory ran out\n"), CLI_FAILED;
    r->build = (cli_build_options)CLI_BUILD_OPTIONS_INIT;
    r->size = 512;
    r->top = 20;
    char **meshes;
    int mesh_count, status = 0;
    cli_error error;
    if (parse(r, argc, argv, &meshes, &mesh_count, &status) &&
        !(check(r, mesh_count, &error) && run(r, meshes, mesh_count, &error)))
        status = cli_options_complain("explain", &error);
    cli_build_options_free(&r->build);
    free(r);
    return status;
}
