/* Options as tables: a command lists what it takes, one parser reads them and writes their help.
 *
 *     uint32_t size = 512;
 *     const cli_option own[] = {
 *         {.name = "size", .kind = CLI_UINT, .argument = "N", .into = &size,
 *          .low = 1, .high = 4096, .help = "side of the image (512)"},
 *         {0}};
 *     const cli_command command = {.name = "explain", .usage = "MESH... --light L --at X,Y,Z",
 *                                  .about = "...", .tables = {own}};
 *     int count, status;
 *     char **files;  // operands, at the front of argv
 *     if (!cli_options_parse(&command, argc, argv, &files, &count, &status)) return status;
 *
 * Forms taken: --name VALUE, --name=VALUE, -o VALUE, -oVALUE, -- (what follows are operands), - (an
 * operand). An option whose value is optional takes it only with =. Names are not abbreviated. */
#ifndef CLI_OPTIONS_H
#define CLI_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "error.h"

typedef enum cli_option_kind {
    CLI_FLAG,   /* bool *into: set to true */
    CLI_TEXT,   /* const char **into */
    CLI_REAL,   /* double *into, low..high */
    CLI_UINT,   /* uint32_t *into, low..high */
    CLI_UINT64, /* uint64_t *into, low..high */
    CLI_REALS,  /* double into[length], separated by commas */
    CLI_CHOICE, /* uint32_t *into: the index in choices, a NULL-terminated list */
    CLI_TAKE    /* take(into, value, error) */
} cli_option_kind;

typedef struct cli_option {
    const char *name; /* without its --; NULL ends a table */
    char letter;      /* a short form, or 0 */
    cli_option_kind kind;
    const char *argument; /* how the help names the value: "N", "X,Y,Z" */
    const char *help;     /* a line; its default in parentheses at the end */
    void *into;
    double low, high;
    uint32_t length;
    const char *const *choices;
    bool (*take)(void *into, const char *value, cli_error *error);
    bool *given;   /* set to true when the option is there; may be NULL */
    bool optional; /* without =VALUE it only sets *given */
} cli_option;

enum { CLI_TABLES = 4 };

typedef struct cli_command {
    const char *name;               /* "query" */
    const char *usage;              /* what follows the name in the usage line */
    const char *about;              /* paragraphs before the options */
    const char *const *table_names; /* headings; NULL: "Options" for the first */
    const cli_option *tables[CLI_TABLES];
    const char *more; /* examples after the options, or NULL */
} cli_command;

/* Reads argv[1..]; argv[0] is the command's name. Operands are moved to argv[1...]: *operands and
 * *count. Returns false with *status to return when the help was shown or an error was said. */
bool cli_options_parse(const cli_command *command, int argc, char **argv, char ***operands,
                       int *count, int *status);

/* For files that hold options, a line each: the option of that name (no dashes), or NULL; and its
 * value, as --name=VALUE would set it (a flag takes NULL or ""). */
const cli_option *cli_options_find(const cli_command *command, const char *name);
bool cli_options_set(const cli_option *option, const char *value, cli_error *error);

/* Takes an option out of a table that commands share: one that this command has no use for. */
void cli_options_drop(cli_option *table, const char *name);

/* "softshadow query: TEXT" on stderr; returns error->status. */
int cli_options_complain(const char *command, const cli_error *error);

/* The last thing done with stdout when it was written by printf(): the exit status, 1 and a line on
 * stderr when any of it was lost. */
int cli_options_flush(const char *command);

/* The candidate that differs least from word, or NULL when none is near. */
const char *cli_options_nearest(const char *word, const char *const *candidates);

#endif
