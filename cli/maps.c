/* softshadow maps: the planes that a map method built, as channels of an EXR, or as an EXR each in
 * a folder. The light-space matrices are in the metadata: a channel can be used without us. */
#include <errno.h>
#include <softshadow.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "commands.h"
#include "image/image.h"
#include "options.h"
#include "output.h"
#include "scene.h"

enum { NUMBERS = 3, NUMBERS_TEXT = 16 * 26, NAME = 160, PATH_ROOM = 4096 };

typedef struct request {
    cli_build_options build;
    const char *out;
    bool folder, made; /* -o is a folder; one that was made for this */
    const image_module *module;
} request;

/* One plane, and what of its place must be told apart from the others'. */
typedef struct plane {
    softshadow_map map;
    char prefix[40]; /* "light1.face2.", each part only where there is more than one */
} plane;

typedef struct planes {
    plane *list;
    uint32_t count;
} planes;

/* An image on its way into a file. */
typedef struct sheet {
    image_plane *channels;
    char (*names)[NAME];
    float *values; /* of all channels; images begin at the top, so rows are turned */
    char (*numbers)[NUMBERS][2][NUMBERS_TEXT]; /* attribute, numbers; of each face */
    const char **metadata;
    image_picture picture;
} sheet;

/* ---- Options --------------------------------------------------------------------------------*/

/* As it is shown: a line of it is a line here. */
/* clang-format off */
static const char about[] =
"Writes the planes that a map method builds, as 32-bit floats. A channel is named after\n"
"its plane and what it holds: depth, penumbra-limit.c; with several lights or faces of a\n"
"cube light1.face2.depth. The attribute softshadow.matrix (with the same prefix) has 16\n"
"numbers, row by row: from the scene to clip space, y up. A depth of 1e30 holds nothing;\n"
"others compare with d0 + d1 z/w of clip space, softshadow.depth being d0 d1. Positions\n"
"(.x .y .z) are o + u times the value, softshadow.origin being ox oy oz u.";
/* clang-format on */

static bool parse(request *r, int argc, char **argv, char ***meshes, int *count, int *status) {
    static const char *const headings[] = {"Maps", "Lights and method", "Running", NULL};
    cli_option build[CLI_BUILD_TABLE], run[CLI_RUN_TABLE];
    const cli_option own[] = {
        {.name = "output",
         .letter = 'o',
         .kind = CLI_TEXT,
         .argument = "DIR|FILE.exr",
         .into = &r->out,
         .help = "all planes as channels of one image, or an image each in a folder,\n"
                 "which is made if it is not there; - is stdout"},
        {0}};
    const cli_command command = {
        .name = "maps",
        .usage = "MESH... --light LIGHT --method METHOD -o DIR|FILE.exr [OPTION...]",
        .about = about,
        .table_names = headings,
        .tables = {own, build, run},
        .more =
            "Example:\n"
            "  softshadow maps bunny.obj --light sphere:3,4,2,0.5 -m penumbra-limit -o maps.exr\n"};
    cli_build_options_tables(&r->build, build, run);
    cli_options_drop(run, "verify"); /* no point is asked */
    return cli_options_parse(&command, argc, argv, meshes, count, status);
}

static const char *end_of(const char *path) {
    const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.');
    return dot ? dot : "";
}

/* A folder that is there, or a name without an end; all else must say .exr. */
static bool place(request *r, cli_error *error) {
    struct stat there;
    char shown[208];
    const bool exists = stat(r->out, &there) == 0;
    image_format format;
    if (strcmp(r->out, "-") == 0) return true;
    r->folder = exists ? S_ISDIR(there.st_mode) : !*end_of(r->out);
    if (r->folder || (exists && !S_ISREG(there.st_mode))) return true;
    if (image_format_of(r->out, &format) && format == IMAGE_EXR) return true;
    return cli_fail(error, CLI_USAGE, "-o %s: a folder or a name that ends in .exr is allowed",
                    cli_show_path(r->out, shown));
}

static bool check(request *r, int mesh_count, cli_error *error) {
    const char *method = r->build.build.method;
    if (!mesh_count)
        return cli_fail(error, CLI_USAGE,
                        "a mesh is missing, OBJ, PLY, STL and OFF files are allowed");
    if (!r->out) return cli_fail(error, CLI_USAGE, "-o DIR or -o FILE.exr is missing");
    if (!method || strcmp(method, "auto") == 0)
        return cli_fail(error, CLI_USAGE,
                        "--method: auto builds no maps; one that 'softshadow methods' lists is "
                        "allowed, such as penumbra-limit");
    return cli_build_options_finish(&r->build, error) && place(r, error);
}

/* ---- Planes ---------------------------------------------------------------------------------*/

/* Faces are told apart where a light has more than one. */
static bool has_faces(const planes *p, uint32_t light) {
    for (uint32_t i = 0; i < p->count; i++)
        if (p->list[i].map.light == light && p->list[i].map.face > 0) return true;
    return false;
}

static void name_plane(const planes *p, plane *one, uint32_t lights) {
    char light[20] = "", face[20] = "";
    if (lights > 1) snprintf(light, sizeof light, "light%u.", one->map.light);
    if (has_faces(p, one->map.light)) snprintf(face, sizeof face, "face%u.", one->map.face);
    snprintf(one->prefix, sizeof one->prefix, "%s%s", light, face);
}

static bool get_planes(planes *p, const cli_scene *scene, cli_error *error) {
    softshadow_status status = softshadow_map_count(scene->handle, &p->count);
    if (status != SOFTSHADOW_OK) return cli_scene_fail(scene, status, NULL, error);
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    softshadow_get_stats(scene->handle, &stats);
    if (!p->count)
        return cli_fail(error, CLI_FAILED,
                        "--method %s: there are no maps to write: the method has none, or nothing "
                        "casts a shadow",
                        stats.method_used ? stats.method_used : "?");
    p->list = calloc(p->count, sizeof *p->list);
    if (!p->list) return cli_fail(error, CLI_FAILED, "memory ran out");
    for (uint32_t i = 0; i < p->count; i++) {
        p->list[i].map = (softshadow_map)SOFTSHADOW_MAP_INIT;
        status = softshadow_get_map(scene->handle, i, &p->list[i].map);
        if (status != SOFTSHADOW_OK) return cli_scene_fail(scene, status, NULL, error);
    }
    for (uint32_t i = 0; i < p->count; i++) name_plane(p, &p->list[i], scene->light_count);
    return true;
}

/* "penumbra-limit.c"; the k-th of the names between commas, its number without names. */
static void name_channel(const plane *one, uint32_t k, char name[NAME]) {
    const softshadow_map *map = &one->map;
    const char *at = map->channel_names;
    for (uint32_t i = 0; at && i < k; i++) {
        at = strchr(at, ',');
        if (at) at++;
    }
    if (map->channels == 1)
        snprintf(name, NAME, "%s%s", one->prefix, map->name);
    else if (at)
        snprintf(name, NAME, "%s%s.%.*s", one->prefix, map->name, (int)strcspn(at, ","), at);
    else
        snprintf(name, NAME, "%s%s.%u", one->prefix, map->name, k);
}

/* ---- Sheets ---------------------------------------------------------------------------------*/

static void sheet_free(sheet *s) {
    free(s->channels);
    free(s->names);
    free(s->values);
    free(s->numbers);
    free(s->metadata);
}

static void print_numbers(const double *number, int count, char text[NUMBERS_TEXT]) {
    int used = 0;
    for (int i = 0; i < count; i++)
        used += snprintf(text + used, (size_t)(NUMBERS_TEXT - used), "%s%.17g", i ? " " : "",
                         number[i]);
}

/* Each channel apart, the top row first. */
static void add_channels(sheet *s, const plane *one) {
    const softshadow_map *map = &one->map;
    const size_t width = map->width, height = map->height, pixels = width * height;
    for (uint32_t k = 0; k < map->channels; k++) {
        const uint32_t number = s->picture.plane_count++;
        float *to = s->values + number * pixels;
        name_channel(one, k, s->names[number]);
        s->channels[number] = (image_plane){s->names[number], to, 1};
        for (size_t y = 0; y < height; y++) {
            const float *row = map->pixels + (height - 1 - y) * width * map->channels + k;
            for (size_t x = 0; x < width; x++) to[y * width + x] = row[x * map->channels];
        }
    }
}

/* A plane's matrix and units under its prefix; planes of one face share theirs. */
static void add_numbers(sheet *s, const plane *one, uint32_t *used, uint32_t *faces) {
    static const char *const name[NUMBERS] = {"matrix", "depth", "origin"};
    const softshadow_map *map = &one->map;
    const double origin[4] = {map->origin[0], map->origin[1], map->origin[2], map->unit};
    const double *const value[NUMBERS] = {map->matrix, map->depth, origin};
    const int count[NUMBERS] = {16, 2, 4};
    char(*text)[2][NUMBERS_TEXT] = s->numbers[*faces];
    for (int k = 0; k < NUMBERS; k++) {
        snprintf(text[k][0], NUMBERS_TEXT, "softshadow.%s%s", one->prefix, name[k]);
        print_numbers(value[k], count[k], text[k][1]);
    }
    for (uint32_t i = 0; i < *faces; i++)
        if (strcmp(s->numbers[i][0][0], text[0][0]) == 0) return;
    for (int k = 0; k < NUMBERS; k++) {
        s->metadata[(*used)++] = text[k][0], s->metadata[(*used)++] = text[k][1];
    }
    (*faces)++;
}

static bool sheet_room(sheet *s, uint32_t count, size_t channels, size_t pixels) {
    s->channels = calloc(channels, sizeof *s->channels);
    s->names = calloc(channels, sizeof *s->names);
    s->values = pixels <= SIZE_MAX / sizeof(float) / channels
                    ? malloc(pixels * channels * sizeof *s->values)
                    : NULL;
    s->numbers = calloc(count, sizeof *s->numbers);
    s->metadata = calloc(2 * NUMBERS * (size_t)count + 5, sizeof *s->metadata);
    return s->channels && s->names && s->values && s->numbers && s->metadata;
}

/* `count` planes from `list` on as one image. */
static bool sheet_make(sheet *s, const plane *list, uint32_t count, const char *method,
                       cli_error *error) {
    static char software[40];
    const softshadow_map *first = &list[0].map;
    size_t channels = 0;
    *s = (sheet){0};
    for (uint32_t i = 0; i < count; i++) {
        channels += list[i].map.channels;
        if (list[i].map.width == first->width && list[i].map.height == first->height) continue;
        return cli_fail(error, CLI_FAILED, "-o: planes of different sizes need a folder");
    }
    if (channels > IMAGE_MAX_CHANNELS)
        return cli_fail(error, CLI_FAILED, "-o: %zu channels, %d are allowed: give a folder",
                        channels, IMAGE_MAX_CHANNELS);
    if (!sheet_room(s, count, channels, (size_t)first->width * first->height))
        return cli_fail(error, CLI_FAILED, "memory ran out");
    uint32_t used = 0, faces = 0;
    snprintf(software, sizeof software, "softshadow %s", softshadow_version_string());
    s->metadata[used++] = "Software", s->metadata[used++] = software;
    s->metadata[used++] = "softshadow.method", s->metadata[used++] = method;
    s->picture = (image_picture){.width = first->width,
                                 .height = first->height,
                                 .planes = s->channels,
                                 .metadata = s->metadata};
    for (uint32_t i = 0; i < count; i++) {
        add_channels(s, &list[i]);
        add_numbers(s, &list[i], &used, &faces);
    }
    if (faces == 1) s->picture.world_to_ndc = first->matrix;
    return true;
}

static bool write_sheet(const request *r, const sheet *s, cli_output *output, cli_error *error) {
    void *bytes = NULL;
    size_t size = 0;
    char why[IMAGE_WHY] = "", name[sizeof output->name];
    memcpy(name, output->name, sizeof name);
    if (!r->module->encode(&s->picture, IMAGE_EXR, &bytes, &size, why))
        return cli_fail(error, CLI_FAILED, "%s: %s", name, why);
    const bool done =
        cli_output_write(output, bytes, size, error) && cli_output_commit(output, error);
    r->module->free_bytes(bytes);
    if (done && !r->build.quiet)
        fprintf(stderr, "wrote %s: %u x %u, %u channel%s\n", name, s->picture.width,
                s->picture.height, s->picture.plane_count, s->picture.plane_count == 1 ? "" : "s");
    return done;
}

/* ---- The command ----------------------------------------------------------------------------*/

/* "light1.face2.depth" becomes DIR/light1-face2-depth.exr. */
static bool path_of(const request *r, const plane *one, char path[PATH_ROOM], cli_error *error) {
    const size_t length = strlen(r->out);
    const bool slash = length && r->out[length - 1] == '/';
    const int full = snprintf(path, PATH_ROOM, "%s%s%s%s.exr", r->out, slash ? "" : "/",
                              one->prefix, one->map.name);
    if (full >= PATH_ROOM) return cli_fail(error, CLI_FAILED, "-o: the name is too long");
    for (char *c = path + length + !slash; c < path + full - 4; c++)
        if (*c == '.') *c = '-';
    return true;
}

static bool write_folder(const request *r, const planes *p, const char *method, cli_error *error) {
    bool done = true;
    for (uint32_t i = 0; done && i < p->count; i++) {
        char path[PATH_ROOM];
        cli_output output = {0};
        sheet s = {0};
        done = path_of(r, &p->list[i], path, error) && cli_output_open(&output, path, error);
        if (!done) break;
        done = sheet_make(&s, &p->list[i], 1, method, error) && write_sheet(r, &s, &output, error);
        sheet_free(&s);
        cli_output_abandon(&output);
    }
    return done;
}

static bool write_file(const request *r, const planes *p, const char *method, cli_output *output,
                       cli_error *error) {
    sheet s = {0};
    const bool done =
        sheet_make(&s, p->list, p->count, method, error) && write_sheet(r, &s, output, error);
    sheet_free(&s);
    return done;
}

/* What is written into is opened first: that it cannot be is best known before the work. */
static bool open_place(request *r, cli_output *output, cli_error *error) {
    char shown[208];
    if (!r->folder) return cli_output_open(output, r->out, error);
    r->made = mkdir(r->out, 0777) == 0;
    return r->made || errno == EEXIST ||
           cli_fail(error, CLI_FAILED, "%s: cannot be made: %s", cli_show_path(r->out, shown),
                    strerror(errno));
}

static bool run(request *r, char *const *meshes, int mesh_count, cli_error *error) {
    cli_output output = {0};
    cli_scene scene;
    if (!(r->module = image_load(error)) || !open_place(r, &output, error)) return false;
    bool done = cli_scene_open(&scene, &r->build, meshes, mesh_count, error);
    if (done) {
        planes p = {0};
        const char *method = r->build.build.method;
        done = get_planes(&p, &scene, error) &&
               (r->folder ? write_folder(r, &p, method, error)
                          : write_file(r, &p, method, &output, error)) &&
               (!r->build.stats || cli_scene_print_stats(&scene, r->build.stats_form == 1, error));
        free(p.list);
        cli_scene_close(&scene);
    }
    if (!r->folder) cli_output_abandon(&output);
    if (!done && r->made) rmdir(r->out); /* stays where something was written */
    return done;
}

int cli_maps(int argc, char **argv) {
    request r = {.build = CLI_BUILD_OPTIONS_INIT};
    char **meshes;
    int mesh_count, status = 0;
    cli_error error;
    if (parse(&r, argc, argv, &meshes, &mesh_count, &status) &&
        !(check(&r, mesh_count, &error) && run(&r, meshes, mesh_count, &error)))
        status = cli_options_complain("maps", &error);
    cli_build_options_free(&r.build);
    return status;
}
