/* command.c - softshadow povray: scenes for POV-Ray, and positions that it rendered. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../commands.h"
#include "povray.h"

/* clang-format off */
static const char about[] =
"Writes what render would show as a scene of POV-Ray 3.7: meshes, ground, camera and lights, with\n"
"shadows that are\n"
"    area       POV-Ray's own, area lights of --area x --area points\n"
"    projected  what the camera's pixels see, beside FILE.pov as FILE.visibility.exr; with --aa N\n"
"               that image is N times as large, for POV-Ray's +A\n"
"    baked      what each vertex sees, triangles split where that needs it: for any camera\n"
"    none       none: for composites\n"
"Or, with --positions, makes an image of positions out of two that POV-Ray rendered (Pass=1 and 2 of\n"
"such a scene, or Softshadow_Positions of softshadow.inc in one of yours), for query --from.";

static const char more[] =
"Examples:\n"
"  softshadow povray bunny.obj --light sphere:3,4,2,0.5 --shadows projected --aa 1 -o bunny.pov\n"
"  povray +Ibunny.pov +W800 +H600 -A +L" SOFTSHADOW_POVRAY_DIR "\n"
"  softshadow povray --positions 1.png,2.png --normals 3.png --box -4,-1,-4,4,3,4 -o p.exr\n";
/* clang-format on */

static bool parse(povray_job *j, int argc, char **argv, int *status) {
    static const char *const kinds[] = {"area", "projected", "baked", "none", NULL};
    static const char *const headings[] = {"POV-Ray", "Picture", "Lights and method", "Running"};
    cli_option seen[REQUEST_TABLE], build[CLI_BUILD_TABLE], run[CLI_RUN_TABLE];
    const cli_option own[] = {{.name = "output",
                               .letter = 'o',
                               .kind = CLI_TEXT,
                               .argument = "FILE",
                               .into = &j->output,
                               .help = "FILE.pov, or FILE.exr with --positions"},
                              {.name = "shadows",
                               .kind = CLI_CHOICE,
                               .argument = "KIND",
                               .into = &j->shadows,
                               .choices = kinds,
                               .help = "area, projected, baked or none (area)"},
                              {.name = "area",
                               .kind = CLI_UINT,
                               .argument = "N",
                               .into = &j->area,
                               .low = 2,
                               .high = 1000,
                               .help = "area: N x N points a light (17)"},
                              {.name = "most",
                               .kind = CLI_UINT,
                               .argument = "N",
                               .into = &j->most,
                               .low = 0,
                               .high = 1e8,
                               .help = "baked: triangles that splitting may add (400000)"},
                              {.name = "positions",
                               .kind = CLI_TEXT,
                               .argument = "A.png,B.png",
                               .into = &j->positions,
                               .help = "16-bit images of Pass=1 and Pass=2"},
                              {.name = "normals",
                               .kind = CLI_TEXT,
                               .argument = "C.png",
                               .into = &j->normals,
                               .help = "the image of Pass=3"},
                              {.name = "box",
                               .kind = CLI_REALS,
                               .argument = "X0,Y0,Z0,X1,Y1,Z1",
                               .into = j->box,
                               .length = 6,
                               .given = &j->box_given,
                               .help = "of the positions: Box_Low and Box_High of the scene"},
                              {0}};
    const cli_command command = {
        .name = "povray",
        .usage = "SCENE.softshadow|MESH... --light LIGHT -o FILE.pov [OPTION...]",
        .about = about,
        .table_names = headings,
        .tables = {own, seen, build, run},
        .more = more};
    request_table(&j->request, seen);
    cli_build_options_tables(&j->request.build, build, run);
    /* A scene file may have them, for render. */
    cli_options_drop(seen, "aov");
    cli_options_drop(seen, "exposure");
    cli_options_drop(run, "stats");
    cli_options_drop(run, "verify");
    return request_arguments(&j->request, j, sizeof *j, &command, argc, argv, status);
}

static bool ends_with(const char *text, const char *end) {
    const size_t length = strlen(text), most = strlen(end);
    return length > most && strcmp(text + length - most, end) == 0;
}

static bool check_passes(const povray_job *j, cli_error *error) {
    char shown[208];
    if (!ends_with(j->output, ".exr"))
        return cli_fail(error, CLI_USAGE,
                        "-o %s: --positions makes an image, a name that ends in .exr is allowed",
                        cli_show_path(j->output, shown));
    if (j->request.mesh_count)
        return cli_fail(error, CLI_USAGE, "--positions: goes without meshes");
    bool fine = j->box_given;
    for (int a = 0; a < 3; a++) fine = fine && j->box[3 + a] > j->box[a];
    return fine || cli_fail(error, CLI_USAGE,
                            "--box: X0,Y0,Z0,X1,Y1,Z1 is wanted beside --positions, each end "
                            "beyond its beginning");
}

static bool check_scene(povray_job *j, cli_error *error) {
    request *r = &j->request;
    char shown[208];
    if (!ends_with(j->output, ".pov"))
        return cli_fail(error, CLI_USAGE, "-o %s: a name that ends in .pov is allowed",
                        cli_show_path(j->output, shown));
    if (strpbrk(j->output, "\"\\"))
        return cli_fail(error, CLI_USAGE, "-o %s: a name without quotes and backslashes is allowed",
                        cli_show_path(j->output, shown));
    /* Each pixel of the visibility image and each vertex stands alone. */
    if (r->build.build.tolerance == 0 && r->build.build.samples == 0)
        r->build.build.tolerance = 1.0 / 256;
    if (!request_finish(r, error)) return false;
    r->build.unbuilt = j->shadows == POVRAY_AREA || j->shadows == POVRAY_NONE;
    if (j->shadows == POVRAY_BAKED && r->build.light_count > 1)
        return cli_fail(error, CLI_USAGE, "--shadows baked: has room for one --light");
    if (j->shadows == POVRAY_AREA && r->build.profile)
        return cli_fail(error, CLI_USAGE,
                        "--profile: area lights of POV-Ray have none, --shadows projected or baked "
                        "is allowed");
    return true;
}

static bool write_scene(povray_job *j, cli_error *error) {
    cli_scene scene;
    request *r = &j->request;
    if (!check_scene(j, error) ||
        !cli_scene_open(&scene, &r->build, r->meshes, (int)r->mesh_count, error))
        return false;
    const bool fine = povray_write_scene(j, &scene, error);
    if (fine && !r->build.quiet)
        fprintf(stderr, "wrote %s; povray +I%s +W%u +H%u %s\n", j->output, j->output,
                r->picture.width, r->picture.height, "+L" SOFTSHADOW_POVRAY_DIR);
    cli_scene_close(&scene);
    return fine;
}

int cli_povray(int argc, char **argv) {
    povray_job *j = calloc(1, sizeof *j);
    if (!j) return fprintf(stderr, "softshadow povray: memory ran out\n"), CLI_FAILED;
    request_init(&j->request);
    j->area = 17;
    j->most = 400000;
    int status = 0;
    cli_error error;
    if (parse(j, argc, argv, &status)) {
        bool fine;
        if (!j->output)
            fine = cli_fail(&error, CLI_USAGE, "-o FILE.pov is missing");
        else if (j->positions)
            fine = check_passes(j, &error) && povray_read_passes(j, &error);
        else
            fine = write_scene(j, &error);
        if (!fine) status = cli_options_complain("povray", &error);
    }
    request_free(&j->request);
    free(j);
    return status;
}
