/* What query, render, explain and maps have in common: lights, what to build, how to run. */
#ifndef CLI_BUILD_OPTIONS_H
#define CLI_BUILD_OPTIONS_H

#include <softshadow.h>

#include "light.h"
#include "options.h"

enum { CLI_BUILD_TABLE = 19, CLI_RUN_TABLE = 8 };

typedef struct cli_build_options {
    softshadow_build build;
    softshadow_light lights[CLI_MOST_LIGHTS];
    uint32_t light_count;
    uint32_t threads;
    const char *profile_path;
    float *profile; /* of all lights; owned */
    double bounds[6];
    bool quiet, bounds_given, blur, propagate;
    bool unbuilt;        /* meshes and lights only: nothing will be asked */
    bool silent;         /* not even warnings on stderr: a host owns it */
    bool stats;          /* print softshadow_stats ... */
    uint32_t stats_form; /* ... 0: as a table, 1: as json */
    bool verify;         /* measure the error on ... */
    uint64_t verify_points;
} cli_build_options;

#define CLI_BUILD_OPTIONS_INIT                                                                     \
    { .build = SOFTSHADOW_BUILD_INIT, .verify_points = 1000 }

/* Fills the two tables that a command hands to the parser. */
void cli_build_options_tables(cli_build_options *options, cli_option build[CLI_BUILD_TABLE],
                              cli_option run[CLI_RUN_TABLE]);

/* After parsing: reads the profile, hands bounds on; there must be a light. */
bool cli_build_options_finish(cli_build_options *options, cli_error *error);
void cli_build_options_free(cli_build_options *options);

#endif
