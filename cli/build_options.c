/* The options behind softshadow_build and softshadow_light. */
#include "build_options.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "input.h"
#include "light.h"
#include "number.h"

static const char *const backends[] = {"cpu", "egl", "any", NULL};
static const char *const weightings[] = {"uniform", "solid_angle", "irradiance", NULL};
static const char *const falloffs[] = {"disk", "linear", "paper", "profile", NULL};
static const char *const stats_forms[] = {"table", "json", NULL};

enum { MOST_PROFILE = 65536 };

static bool take_light(void *into, const char *value, cli_error *error) {
    cli_build_options *options = into;
    return cli_light_add(options->lights, &options->light_count, value, error);
}

void cli_build_options_tables(cli_build_options *o, cli_option build[CLI_BUILD_TABLE],
                              cli_option run[CLI_RUN_TABLE]) {
    softshadow_build *b = &o->build;
    const cli_option what[] = {
        {.name = "light",
         .letter = 'l',
         .kind = CLI_TAKE,
         .argument = "LIGHT",
         .into = o,
         .take = take_light,
         .help = "sphere:X,Y,Z,R  disk:X,Y,Z,NX,NY,NZ,R\n"
                 "rect:X,Y,Z,UX,UY,UZ,VX,VY,VZ (half axes)\n"
                 "sun:DX,DY,DZ,HALF_ANGLE_DEGREES (the way light travels)\n"
                 "may be repeated"},
        {.name = "profile",
         .kind = CLI_TEXT,
         .argument = "FILE",
         .into = &o->profile_path,
         .help = "brightness of the lights from centre to rim: numbers,\nevenly spaced (uniform)"},
        {.name = "method",
         .letter = 'm',
         .kind = CLI_TEXT,
         .argument = "NAME",
         .into = &b->method,
         .help = "one that 'softshadow methods' lists (auto)"},
        {.name = "tolerance",
         .kind = CLI_REAL,
         .argument = "E",
         .into = &b->tolerance,
         .low = 1e-6,
         .high = 1.0,
         .help = "wanted RMS error in penumbra (1/256)"},
        {.name = "weighting",
         .kind = CLI_CHOICE,
         .argument = "KIND",
         .into = &b->weighting,
         .choices = weightings,
         .help = "uniform, solid_angle or irradiance (uniform)"},
        {.name = "samples",
         .kind = CLI_UINT,
         .argument = "N",
         .into = &b->samples,
         .low = 1,
         .high = 1 << 24,
         .help = "light samples a point (what the tolerance needs)"},
        {.name = "resolution",
         .kind = CLI_UINT,
         .argument = "N",
         .into = &b->resolution,
         .low = 1,
         .high = 16384,
         .help = "side of a map in texels (1024)"},
        {.name = "layers",
         .kind = CLI_UINT,
         .argument = "N",
         .into = &b->layers,
         .low = 1,
         .high = 64,
         .help = "depth layers of backprojection (3)"},
        {.name = "max-samples",
         .kind = CLI_UINT,
         .argument = "N",
         .into = &b->max_samples,
         .low = 1,
         .high = 1 << 24,
         .help = "most texels a filter or back-projection visits (all)"},
        {.name = "falloff",
         .kind = CLI_CHOICE,
         .argument = "KIND",
         .into = &b->falloff,
         .choices = falloffs,
         .help = "of map methods: disk, linear, paper or profile (disk)"},
        {.name = "depth-bias",
         .kind = CLI_REAL,
         .argument = "LENGTH",
         .into = &b->depth_bias,
         .low = 0,
         .high = 1e15,
         .help = "where depths are compared (the method's own)"},
        {.name = "smoothie-width",
         .kind = CLI_REAL,
         .argument = "T",
         .into = &b->smoothie_width,
         .low = 0,
         .high = 1e6,
         .help = "of smoothie, as a tangent (R/b)"},
        {.name = "mask-taps",
         .kind = CLI_UINT,
         .argument = "N",
         .into = &b->mask_taps,
         .low = 1,
         .high = 64,
         .help = "of penumbra-mask, along a side (8)"},
        {.name = "blur",
         .kind = CLI_UINT,
         .argument = "N",
         .into = &b->blur,
         .low = 2,
         .high = 64,
         .given = &o->blur,
         .optional = true,
         .help = "penumbra-mask: over N pixels along image rows (12)"},
        {.name = "sub-lights",
         .kind = CLI_UINT,
         .argument = "N",
         .into = &b->sub_lights,
         .low = 1,
         .high = 8,
         .help = "penumbra-volume, -mask: N x N smaller lights (1)"},
        {.name = "propagate",
         .kind = CLI_FLAG,
         .into = &o->propagate,
         .help = "penumbra-limit: from the depth image, not from silhouettes"},
        {.name = "points-ahead",
         .kind = CLI_UINT64,
         .argument = "N",
         .into = &b->points_ahead,
         .low = 0,
         .high = 1e18,
         .help = "about how many points will be asked in all, for auto\n(0: who knows)"},
        {.name = "bounds",
         .kind = CLI_REALS,
         .argument = "X0,Y0,Z0,X1,Y1,Z1",
         .into = o->bounds,
         .length = 6,
         .given = &o->bounds_given,
         .help = "box that holds all points (anywhere)"},
        {0}};
    const cli_option how[] = {{.name = "backend",
                               .kind = CLI_CHOICE,
                               .argument = "WHERE",
                               .into = &b->backend,
                               .choices = backends,
                               .help = "cpu, egl or any (cpu)"},
                              {.name = "threads",
                               .letter = 'j',
                               .kind = CLI_UINT,
                               .argument = "N",
                               .into = &o->threads,
                               .low = 0,
                               .high = 4096,
                               .help = "0: one per processor (0)"},
                              {.name = "seed",
                               .kind = CLI_UINT,
                               .argument = "N",
                               .into = &b->seed,
                               .low = 0,
                               .high = UINT32_MAX,
                               .help = "turns the samples of raytrace and penumbra-mask (0)"},
                              {.name = "stats",
                               .kind = CLI_CHOICE,
                               .argument = "FORM",
                               .into = &o->stats_form,
                               .choices = stats_forms,
                               .given = &o->stats,
                               .optional = true,
                               .help = "what was done, on stderr: table or json (table)"},
                              {.name = "verify",
                               .kind = CLI_UINT64,
                               .argument = "N",
                               .into = &o->verify_points,
                               .low = 1,
                               .high = 1e7,
                               .given = &o->verify,
                               .optional = true,
                               .help = "measure the error on N of the points (1000) and print it"},
                              {.name = "quiet",
                               .letter = 'q',
                               .kind = CLI_FLAG,
                               .into = &o->quiet,
                               .help = "no progress bar, no notes; warnings and errors stay"},
                              {0}};
    _Static_assert(sizeof what == sizeof(cli_option[CLI_BUILD_TABLE]), "CLI_BUILD_TABLE");
    _Static_assert(sizeof how <= sizeof(cli_option[CLI_RUN_TABLE]), "CLI_RUN_TABLE");
    memcpy(build, what, sizeof what);
    memcpy(run, how, sizeof how);
}

/* Numbers between blanks, commas or new lines. Whether they make a profile the library decides. */
static bool read_profile(cli_build_options *o, const char *text, size_t size, cli_error *error) {
    const char *at = text, *end = text + size;
    uint32_t count = 0;
    char path[208];
    while (true) {
        while (at < end && strchr(" \t\r\n,;", *at)) at++;
        if (at == end) break;
        cli_shown shown;
        const char *begin = at;
        size_t length = 0;
        while (begin + length < end && !strchr(" \t\r\n,;", begin[length])) length++;
        float value;
        cli_number result = cli_number_float(&at, end, &value);
        if (result != CLI_NUMBER_OK || at != begin + length)
            return cli_fail(error, CLI_FAILED, "%s: weight %u, '%s': numbers are allowed",
                            cli_show_path(o->profile_path, path), count + 1,
                            cli_show(&shown, begin, length));
        if (count == MOST_PROFILE)
            return cli_fail(error, CLI_FAILED, "%s: more than %d weights",
                            cli_show_path(o->profile_path, path), MOST_PROFILE);
        o->profile[count++] = value;
    }
    for (uint32_t i = 0; i < o->light_count; i++) {
        o->lights[i].profile = o->profile;
        o->lights[i].profile_count = count;
    }
    if (count < 2)
        return cli_fail(error, CLI_FAILED, "%s: has %u weights, 2 or more are allowed",
                        cli_show_path(o->profile_path, path), count);
    return true;
}

static bool load_profile(cli_build_options *o, cli_error *error) {
    cli_input input;
    if (!cli_input_open(&input, o->profile_path, error)) return false;
    while (!input.ended && cli_input_waiting(&input) < (1u << 20))
        if (!cli_input_more(&input, error)) return cli_input_close(&input), false;
    o->profile = malloc(MOST_PROFILE * sizeof *o->profile);
    bool fine = o->profile ? read_profile(o, cli_input_at(&input), cli_input_waiting(&input), error)
                           : cli_fail(error, CLI_FAILED, "--profile: memory ran out");
    cli_input_close(&input);
    return fine;
}

static bool check_method(const char *name, cli_error *error) {
    const char *names[64] = {0}, *nearest;
    uint32_t count = 0;
    softshadow_method_count(&count);
    for (uint32_t i = 0; i < count && i < 63; i++) {
        softshadow_method method = SOFTSHADOW_METHOD_INIT;
        if (softshadow_method_info(i, &method) == SOFTSHADOW_OK) names[i] = method.name;
    }
    for (const char *const *n = names; *n; n++)
        if (strcmp(*n, name) == 0) return true;
    cli_shown shown;
    cli_show(&shown, name, strlen(name));
    nearest = cli_options_nearest(name, names);
    if (nearest)
        return cli_fail(error, CLI_USAGE, "--method %s: is no method, did you mean %s?", shown.text,
                        nearest);
    return cli_fail(error, CLI_USAGE,
                    "--method %s: what 'softshadow methods' lists is allowed",
                    shown.text);
}

bool cli_build_options_finish(cli_build_options *o, cli_error *error) {
    if (!o->light_count)
        return cli_fail(error, CLI_USAGE, "--light is missing, " CLI_LIGHT_FORMS " is allowed");
    if (o->build.method && !check_method(o->build.method, error)) return false;
    if (o->blur && !o->build.blur) o->build.blur = 1; /* over the library's own number of pixels */
    o->build.propagate = o->propagate;
    if (o->bounds_given) o->build.bounds = o->bounds;
    return !o->profile_path || load_profile(o, error);
}

void cli_build_options_free(cli_build_options *o) {
    free(o->profile);
    o->profile = NULL;
}
