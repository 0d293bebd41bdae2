/* The parser and the help of option tables. */
#include "options.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "numbers.h"

/* ---- Names that are nearly right ----------------------------------------------------------- */

/* Edits (insert, drop, replace) that make one word of the other; beyond 31 letters all is far. */
static int distance(const char *a, const char *b) {
    int row[32], n = (int)strlen(b), previous, above;
    if (strlen(a) > 31 || n > 31) return 99;
    for (int j = 0; j <= n; j++) row[j] = j;
    for (int i = 1; a[i - 1]; i++) {
        previous = row[0];
        row[0] = i;
        for (int j = 1; j <= n; j++) {
            above = row[j];
            int best = previous + (a[i - 1] != b[j - 1]);
            if (above + 1 < best) best = above + 1;
            if (row[j - 1] + 1 < best) best = row[j - 1] + 1;
            previous = above;
            row[j] = best;
        }
    }
    return row[n];
}

const char *cli_options_nearest(const char *word, const char *const *candidates) {
    const char *nearest = NULL;
    int least = 1 + (int)strlen(word) / 3; /* a third of the letters may be wrong */
    for (; *candidates; candidates++) {
        int d = distance(word, *candidates);
        if (d <= least && (!nearest || d < least)) nearest = *candidates, least = d;
    }
    return nearest;
}

static const cli_option *find(const cli_command *command, const char *name, size_t length,
                              char letter) {
    for (int t = 0; t < CLI_TABLES && command->tables[t]; t++)
        for (const cli_option *o = command->tables[t]; o->name; o++)
            if (letter ? o->letter == letter
                       : strlen(o->name) == length && memcmp(o->name, name, length) == 0)
                return o;
    return NULL;
}

static bool unknown(const cli_command *command, const char *name, size_t length, cli_error *error) {
    const char *names[128], *nearest;
    char word[32];
    size_t count = 0;
    snprintf(word, sizeof word, "%.*s", (int)(length < 31 ? length : 31), name);
    for (int t = 0; t < CLI_TABLES && command->tables[t]; t++)
        for (const cli_option *o = command->tables[t]; o->name && count < 126; o++)
            names[count++] = o->name;
    names[count++] = "help";
    names[count] = NULL;
    nearest = cli_options_nearest(word, names);
    cli_shown shown;
    cli_show(&shown, name, length);
    if (nearest)
        return cli_fail(error, CLI_USAGE, "--%s is no option, did you mean --%s?", shown.text,
                        nearest);
    return cli_fail(error, CLI_USAGE,
                    "--%s is no option, 'softshadow %s --help' lists what is allowed", shown.text,
                    command->name);
}

/* ---- Values -------------------------------------------------------------------------------- */

static bool choose(const cli_option *option, const char *what, const char *value,
                   cli_error *error) {
    char allowed[200] = "";
    size_t used = 0;
    for (uint32_t i = 0; option->choices[i]; i++) {
        if (strcmp(option->choices[i], value) == 0) {
            *(uint32_t *)option->into = i;
            return true;
        }
        int n = snprintf(allowed + used, sizeof allowed - used, "%s%s", i ? ", " : "",
                         option->choices[i]);
        if (n > 0 && used + (size_t)n < sizeof allowed) used += (size_t)n;
    }
    cli_shown shown;
    return cli_fail(error, CLI_USAGE, "%s %s: one of %s is allowed", what,
                    cli_show(&shown, value, strlen(value)), allowed);
}

static bool take_value(const cli_option *option, const char *value, cli_error *error) {
    char what[64];
    uint64_t whole;
    snprintf(what, sizeof what, "--%s", option->name);
    if (!*value && option->kind != CLI_TAKE)
        return cli_fail(error, CLI_USAGE, "%s: its value is empty, %s is allowed", what,
                        option->argument);
    switch (option->kind) {
    case CLI_FLAG:
        return true;
    case CLI_TEXT:
        return *(const char **)option->into = value, true;
    case CLI_REAL:
        return cli_numbers_real(what, value, option->low, option->high, option->into, error);
    case CLI_UINT:
        if (!cli_numbers_whole(what, value, (uint64_t)option->low, (uint64_t)option->high, &whole,
                               error))
            return false;
        *(uint32_t *)option->into = (uint32_t)whole;
        return true;
    case CLI_UINT64:
        return cli_numbers_whole(what, value, (uint64_t)option->low, (uint64_t)option->high,
                                 option->into, error);
    case CLI_REALS:
        return cli_numbers_parse(what, option->argument, value, option->into, option->length,
                                 error);
    case CLI_CHOICE:
        return choose(option, what, value, error);
    case CLI_TAKE:
        return option->take(option->into, value, error);
    }
    return false;
}

const cli_option *cli_options_find(const cli_command *command, const char *name) {
    return find(command, name, strlen(name), 0);
}

void cli_options_drop(cli_option *table, const char *name) {
    cli_option *kept = table;
    for (const cli_option *o = table; o->name; o++)
        if (strcmp(o->name, name) != 0) *kept++ = *o;
    *kept = (cli_option){0};
}

bool cli_options_set(const cli_option *option, const char *value, cli_error *error) {
    if (option->given) *option->given = true;
    if (option->kind == CLI_FLAG) {
        if (value && *value)
            return cli_fail(error, CLI_USAGE, "--%s: takes no value", option->name);
        *(bool *)option->into = true;
        return true;
    }
    if (option->optional && !(value && *value)) return true;
    return take_value(option, value ? value : "", error);
}

/* One option at argv[*at]; *at is moved to the last argument used. */
static bool take_option(const cli_command *command, int argc, char **argv, int *at,
                        cli_error *error) {
    const char *text = argv[*at], *value = NULL;
    bool is_long = text[1] == '-';
    const char *name = text + (is_long ? 2 : 1);
    size_t length = is_long ? strcspn(name, "=") : 1;
    const cli_option *option = find(command, name, length, is_long ? 0 : *name);
    if (!option && !is_long) {
        cli_shown shown;
        return cli_fail(error, CLI_USAGE,
                        "%s is no option, 'softshadow %s --help' lists what is allowed",
                        cli_show(&shown, text, strlen(text)), command->name);
    }
    if (!option) return unknown(command, name, length, error);
    if (name[length]) value = name + length + is_long;
    if (option->given) *option->given = true;
    if (option->kind == CLI_FLAG) {
        if (value) return cli_fail(error, CLI_USAGE, "--%s: takes no value", option->name);
        *(bool *)option->into = true;
        return true;
    }
    if (!value && option->optional) return true;
    if (!value) {
        if (*at + 1 >= argc)
            return cli_fail(error, CLI_USAGE, "--%s: its value is missing, --%s %s is allowed",
                            option->name, option->name, option->argument);
        value = argv[++*at];
    }
    return take_value(option, value, error);
}

/* ---- Help ---------------------------------------------------------------------------------- */

static void help_option(const cli_option *o) {
    char left[64];
    int n = o->letter ? snprintf(left, sizeof left, "  -%c, --%s", o->letter, o->name)
                      : snprintf(left, sizeof left, "      --%s", o->name);
    if (o->kind != CLI_FLAG && n > 0 && n < (int)sizeof left)
        snprintf(left + n, sizeof left - (size_t)n, o->optional ? "[=%s]" : " %s", o->argument);
    if (strlen(left) > 32)
        printf("%s\n%34s", left, "");
    else
        printf("%-34s", left);
    for (const char *c = o->help; *c; c++) {
        putchar(*c);
        if (*c == '\n') printf("%34s", "");
    }
    putchar('\n');
}

int cli_options_complain(const char *command, const cli_error *error) {
    fprintf(stderr, "softshadow%s%s: %s\n", *command ? " " : "", command, error->text);
    return error->status;
}

int cli_options_flush(const char *command) {
    /* What overflowed the buffer has failed already, and the last flush may succeed. */
    bool fine = fflush(stdout) == 0 && !ferror(stdout);
    if (fine && fclose(stdout) == 0) return 0;
    cli_error error;
    cli_fail(&error, CLI_FAILED, "standard output: %s", strerror(errno));
    return cli_options_complain(command, &error);
}

static int help(const cli_command *command) {
    printf("Usage: softshadow %s %s\n\n%s\n", command->name, command->usage, command->about);
    for (int t = 0; t < CLI_TABLES && command->tables[t]; t++) {
        printf("\n%s:\n", command->table_names ? command->table_names[t] : "Options");
        for (const cli_option *o = command->tables[t]; o->name; o++) help_option(o);
    }
    if (command->more) printf("\n%s", command->more);
    return cli_options_flush(command->name);
}

bool cli_options_parse(const cli_command *command, int argc, char **argv, char ***operands,
                       int *count, int *status) {
    cli_error error = {{0}, 0};
    bool only_operands = false;
    int found = 0;
    *operands = argv + 1;
    *count = 0;
    for (int i = 1; i < argc; i++) {
        const char *text = argv[i];
        if (only_operands || text[0] != '-' || !text[1]) {
            argv[1 + found++] = argv[i];
        } else if (strcmp(text, "--") == 0) {
            only_operands = true;
        } else if (strcmp(text, "--help") == 0 || strcmp(text, "-h") == 0) {
            *status = help(command);
            return false;
        } else if (!take_option(command, argc, argv, &i, &error)) {
            *status = cli_options_complain(command->name, &error);
            return false;
        }
    }
    *count = found;
    return true;
}
