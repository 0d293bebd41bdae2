/* request.c - the options of a picture, and scene files. */
#include "request.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "../input.h"
#include "../number.h"

enum { MOST_SIDE = 16384, MOST_MESHES = 1 << 20, MOST_TEXT = 1 << 24, MOST_LINE = 1 << 16 };

static const char signature[] = "softshadow 1";

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
    static const char *const names[] = {"visibility", "position", "normal", "depth", "unshadowed"};
    enum { COUNT = sizeof names / sizeof *names };
    request *r = into;
    cli_shown shown;
    for (const char *at = value;; at++) {
        const size_t length = strcspn(at, ",");
        int which = 0;
        while (which < COUNT &&
               !(strlen(names[which]) == length && memcmp(at, names[which], length) == 0))
            which++;
        if (which == COUNT)
            return cli_fail(error, CLI_USAGE,
                            "--aov %s: visibility, position, normal, depth, unshadowed are "
                            "allowed, with commas",
                            cli_show(&shown, at, length));
        r->aov |= 1u << which;
        at += length;
        if (!*at) return true;
    }
}

void request_table(request *r, cli_option table[REQUEST_TABLE]) {
    static const char *const shadings[] = {"smooth", "flat", NULL}, *const ups[] = {"y", "z", NULL};
    picture *p = &r->picture;
    const cli_option own[] = {
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
         .help = "further channels of an EXR or TIFF: visibility,position,\n"
                 "normal,depth,unshadowed"},
        {0}};
    _Static_assert(sizeof own == sizeof(cli_option[REQUEST_TABLE]), "REQUEST_TABLE");
    memcpy(table, own, sizeof own);
}

void request_init(request *r) {
    *r = (request){.build = CLI_BUILD_OPTIONS_INIT, .ground = INFINITY};
    r->picture = (picture){.width = 800,
                           .height = 600,
                           .aa = 2,
                           .albedo = {0.7, 0.66, 0.6},
                           .ground_albedo = {0.55, 0.55, 0.55},
                           .ambient = 0.06};
}

static void free_texts(char **texts, uint32_t count) {
    for (uint32_t i = 0; i < count; i++) free(texts[i]);
    free(texts);
}

void request_free(request *r) {
    picture_free(&r->picture);
    cli_build_options_free(&r->build);
    free_texts(r->meshes, r->mesh_count);
    free_texts(r->texts, r->text_count);
    *r = (request){.ground = 0};
}

/* A pixel is the mean of aa x aa points whose errors are independent: 1/128 a
 * pixel is what a preview needs. */
static void choose_tolerance(request *r) {
    softshadow_build *b = &r->build.build;
    if (b->tolerance == 0 && b->samples == 0) b->tolerance = fmin(r->picture.aa / 128.0, 1);
}

bool request_finish(request *r, cli_error *error) {
    if (!r->mesh_count)
        return cli_fail(error, CLI_USAGE,
                        "a mesh is missing, OBJ, PLY, STL and OFF files are allowed");
    for (int c = 0; c < 3; c++)
        if (r->picture.albedo[c] < 0 || r->picture.ground_albedo[c] < 0)
            return cli_fail(error, CLI_USAGE, "--albedo: 0 and more is allowed");
    choose_tolerance(r);
    r->picture.smooth = r->shading == 0;
    r->picture.up = "yz"[r->up];
    r->picture.split = r->aov & AOV_UNSHADOWED;
    r->picture.build = &r->build;
    return cli_build_options_finish(&r->build, error);
}

/* ---- Scene files ----------------------------------------------------------------------------*/

/* Appends folder + text to a list whose room doubles. */
static char *keep(char ***list, uint32_t *count, const char *folder, const char *text) {
    if ((*count & (*count - 1)) == 0) { /* 0, 1, 2, 4, 8 ... are full */
        char **larger = realloc(*list, (*count ? 2 * (size_t)*count : 1) * sizeof *larger);
        if (!larger) return NULL;
        *list = larger;
    }
    const size_t room = strlen(folder) + strlen(text) + 1;
    char *kept = malloc(room);
    if (kept) snprintf((*list)[(*count)++] = kept, room, "%s%s", folder, text);
    return kept;
}

bool request_add_mesh(request *r, const char *folder, const char *path, cli_error *error) {
    if (r->mesh_count == MOST_MESHES)
        return cli_fail(error, CLI_USAGE, "mesh: at most %d are allowed", MOST_MESHES);
    if (!*path) return cli_fail(error, CLI_USAGE, "mesh: its name is missing");
    return keep(&r->meshes, &r->mesh_count, *path == '/' ? "" : folder, path) ||
           cli_fail(error, CLI_FAILED, "memory ran out");
}

/* What a scene is made of; not how its picture is to be run or what is told of that. */
static bool is_of_a_scene(const char *name) {
    static const char *const others[] = {"stats", "verify", "quiet", NULL};
    for (const char *const *o = others; *o; o++)
        if (strcmp(name, *o) == 0) return false;
    return true;
}

static bool no_such_name(const cli_command *command, const char *name, cli_error *error) {
    const char *names[96] = {"mesh"}, *nearest;
    size_t count = 1;
    for (int t = 0; t < CLI_TABLES && command->tables[t]; t++)
        for (const cli_option *o = command->tables[t]; o->name && count < 95; o++)
            if (is_of_a_scene(o->name)) names[count++] = o->name;
    names[count] = NULL;
    nearest = cli_options_nearest(name, names);
    cli_shown shown;
    cli_show(&shown, name, strlen(name));
    if (nearest)
        return cli_fail(error, CLI_USAGE, "%s is none of a scene's names, did you mean %s?",
                        shown.text, nearest);
    return cli_fail(error, CLI_USAGE,
                    "%s is none of a scene's names, mesh and render's options are allowed",
                    shown.text);
}

bool request_set(request *r, const char *folder, const char *name, const char *value,
                 cli_error *error) {
    cli_option own[REQUEST_TABLE], build[CLI_BUILD_TABLE], run[CLI_RUN_TABLE];
    const cli_command command = {.tables = {own, build, run}};
    if (strcmp(name, "mesh") == 0) return request_add_mesh(r, folder, value, error);
    request_table(r, own);
    cli_build_options_tables(&r->build, build, run);
    const cli_option *option = is_of_a_scene(name) ? cli_options_find(&command, name) : NULL;
    if (!option) return no_such_name(&command, name, error);
    if (option->kind == CLI_TEXT) { /* it will be pointed to */
        const bool path = option->into == &r->build.profile_path;
        value = keep(&r->texts, &r->text_count, path && *value != '/' ? folder : "", value);
        if (!value) return cli_fail(error, CLI_FAILED, "memory ran out");
    }
    if (cli_options_set(option, value, error)) return true;
    if (strncmp(error->text, "--", 2) == 0) /* a scene writes its names without dashes */
        memmove(error->text, error->text + 2, strlen(error->text + 2) + 1);
    return false;
}

bool request_is_scene(const char *path) {
    const char *dot = strrchr(path, '.');
    return dot && strcasecmp(dot, ".softshadow") == 0;
}

bool request_begins_scene(const char bytes[16]) {
    const size_t length = sizeof signature - 1;
    return memcmp(bytes, signature, length) == 0 && strchr(" \t\r\n", bytes[length]);
}

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/* One line, which is changed: blanks around it go, a name ends with a zero. */
static bool take_line(request *r, const char *folder, char *line, char *end, cli_error *error) {
    while (line < end && is_blank(*line)) line++;
    while (end > line && is_blank(end[-1])) end--;
    *end = '\0';
    if (line == end || *line == '#') return true;
    if (strlen(line) != (size_t)(end - line))
        return cli_fail(error, CLI_FAILED, "holds a zero byte, text is allowed");
    if (end - line > MOST_LINE)
        return cli_fail(error, CLI_FAILED, "is longer than %d bytes", MOST_LINE);
    char *value = line;
    while (*value && !is_blank(*value)) value++;
    if (*value) *value++ = '\0';
    while (is_blank(*value)) value++;
    return request_set(r, folder, line, value, error);
}

/* size bytes and room for one more. */
static bool take_text(request *r, const char *path, const char *folder, char *text, size_t size,
                      cli_error *error) {
    char shown[208];
    char head[16] = {0};
    memcpy(head, text, size < sizeof head ? size : sizeof head);
    if (!request_begins_scene(head))
        return cli_fail(error, CLI_FAILED, "%s:1: is no scene file, its first line is '%s'",
                        cli_show_path(path, shown), signature);
    text[size] = '\n';
    uint64_t number = 1;
    char *line = memchr(text, '\n', size + 1);
    for (char *c = text + sizeof signature - 1; c < line; c++)
        if (!is_blank(*c))
            return cli_fail(error, CLI_FAILED, "%s:1: '%s' and nothing else is allowed",
                            cli_show_path(path, shown), signature);
    for (line++; line < text + size; number++) {
        char *end = memchr(line, '\n', (size_t)(text + size - line) + 1);
        cli_error wrong;
        if (!take_line(r, folder, line, end, &wrong))
            return cli_fail(error, CLI_FAILED, "%s:%llu: %s", cli_show_path(path, shown),
                            (unsigned long long)number + 1, wrong.text);
        line = end + 1;
    }
    return true;
}

static bool read_text(request *r, cli_input *input, const char *path, cli_error *error) {
    while (!input->ended && cli_input_waiting(input) <= MOST_TEXT)
        if (!cli_input_more(input, error)) return false;
    const size_t size = cli_input_waiting(input);
    if (size > MOST_TEXT)
        return cli_fail(error, CLI_FAILED, "%s: is longer than %d bytes", input->name, MOST_TEXT);
    char *text = malloc(size + 1), *folder = strdup(path);
    bool done = false;
    if (text && folder) {
        char *slash = strrchr(folder, '/');
        slash ? (slash[1] = '\0') : (folder[0] = '\0');
        memcpy(text, cli_input_at(input), size);
        done = take_text(r, path, folder, text, size, error);
    } else {
        cli_fail(error, CLI_FAILED, "%s: memory ran out", input->name);
    }
    free(text);
    free(folder);
    return done;
}

bool request_read(request *r, const char *path, cli_error *error) {
    cli_input input;
    if (!cli_input_open(&input, path, error)) return false;
    const bool done = read_text(r, &input, path, error);
    cli_input_close(&input);
    return done;
}

/* ---- Arguments ------------------------------------------------------------------------------*/

typedef struct reading { /* of one command line, which reading changes */
    void *job, *job_before;
    size_t job_size;
    const cli_command *command;
    char **argv, **argv_before, **operands;
    int argc, count;
} reading;

/* A scene's own options must be there before those that win over them, so the command line is read
 * again when it names a scene. */
static bool read_scenes(request *r, reading *in, int *status) {
    bool any = false;
    cli_error error;
    for (int i = 0; i < in->count; i++) any = any || request_is_scene(in->operands[i]);
    if (!any) return true;
    request_free(r);
    memcpy(in->job, in->job_before, in->job_size);
    for (int i = 0; i < in->count; i++)
        if (request_is_scene(in->operands[i]) && !request_read(r, in->operands[i], &error)) {
            *status = cli_options_complain(in->command->name, &error);
            return false;
        }
    r->scene_aov = r->aov;
    memcpy(in->argv, in->argv_before, (size_t)in->argc * sizeof *in->argv);
    return cli_options_parse(in->command, in->argc, in->argv, &in->operands, &in->count, status);
}

static bool read_all(request *r, reading *in, int *status) {
    cli_error error;
    if (!in->job_before || !in->argv_before) {
        cli_fail(&error, CLI_FAILED, "memory ran out");
        *status = cli_options_complain(in->command->name, &error);
        return false;
    }
    memcpy(in->job_before, in->job, in->job_size);
    memcpy(in->argv_before, in->argv, (size_t)in->argc * sizeof *in->argv);
    if (!cli_options_parse(in->command, in->argc, in->argv, &in->operands, &in->count, status) ||
        !read_scenes(r, in, status))
        return false;
    for (int i = 0; i < in->count; i++)
        if (!request_is_scene(in->operands[i]) &&
            !request_add_mesh(r, "", in->operands[i], &error)) {
            *status = cli_options_complain(in->command->name, &error);
            return false;
        }
    return true;
}

bool request_arguments(request *r, void *job, size_t job_size, const cli_command *command, int argc,
                       char **argv, int *status) {
    reading in = {.job = job,
                  .job_before = malloc(job_size),
                  .job_size = job_size,
                  .command = command,
                  .argv = argv,
                  .argv_before = malloc((size_t)argc * sizeof *argv),
                  .argc = argc};
    const bool fine = read_all(r, &in, status);
    free(in.job_before);
    free(in.argv_before);
    return fine;
}
