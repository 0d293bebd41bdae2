/* softshadow: the command line. One table of commands; each lives in a file of its own. */
#include <softshadow.h>
#include <stdio.h>
#include <string.h>

#include "commands.h"
#include "options.h"
#include "output.h"

static const struct command {
    const char *name;
    int (*run)(int argc, char **argv);
    const char *about;
} commands[] = {
    {"query", cli_query, "how much of the light each point of a list or an image sees"},
    {"render", cli_render, "a preview with soft shadows, as a picture"},
    {"maps", cli_maps, "the planes that a map method builds, as an EXR to look at"},
    {"explain", cli_explain, "which triangles hide the light from one point"},
    {"povray", cli_povray, "a scene for POV-Ray with soft shadows; positions out of its images"},
    {"bench", cli_bench, "run time against error of every method, and of Embree"},
    {"methods", cli_methods, "the methods there are, and which lights each supports"},
    {"info", cli_info, "what meshes are made of: bounds, closed or open, silhouette edges"},
};
enum { COMMANDS = sizeof commands / sizeof *commands };

static int help(void) {
    printf(
        "Usage: softshadow COMMAND ...\n\n"
        "How much of an area light does a point see? 1 is lit, 0 is umbra, between them penumbra.\n"
        "Meshes are OBJ, PLY, STL or OFF; points are text, CSV, PLY, NPY, raw floats or images.\n\n"
        "Commands:\n");
    for (size_t i = 0; i < COMMANDS; i++)
        printf("  %-9s %s\n", commands[i].name, commands[i].about);
    printf("\n'softshadow COMMAND --help' tells the rest; --version tells the version.\n\n"
           "Examples:\n"
           "  softshadow query scene.obj --light sphere:0,0,8,0.5 points.csv -o lit.csv\n"
           "  echo 1 2 0 | softshadow query scene.obj --light sun:0,0,-1,0.27\n");
    return cli_options_flush("");
}

static int version(void) {
    printf("softshadow %s\n", softshadow_version_string());
    return cli_options_flush("");
}

static int unknown(const char *word) {
    const char *names[COMMANDS + 1] = {NULL}, *nearest;
    cli_shown shown;
    for (size_t i = 0; i < COMMANDS; i++) names[i] = commands[i].name;
    nearest = cli_options_nearest(word, names);
    cli_show(&shown, word, strlen(word));
    if (nearest)
        fprintf(stderr, "softshadow: %s is no command, did you mean %s?\n", shown.text, nearest);
    else
        fprintf(stderr, "softshadow: %s is no command, 'softshadow --help' lists what is allowed\n",
                shown.text);
    return CLI_USAGE;
}

int main(int argc, char **argv) {
    cli_output_prepare();
    if (argc < 2) {
        fprintf(stderr, "softshadow: a command is missing, 'softshadow --help' lists them\n");
        return CLI_USAGE;
    }
    const char *word = argv[1];
    if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0 || strcmp(word, "help") == 0)
        return help();
    if (strcmp(word, "--version") == 0 || strcmp(word, "-V") == 0) return version();
    for (size_t i = 0; i < COMMANDS; i++)
        if (strcmp(word, commands[i].name) == 0) return commands[i].run(argc - 1, argv + 1);
    return unknown(word);
}
