/* Numbers on the command line and in text output: read strictly, written so that they come back the
 * same. */
#ifndef CLI_NUMBERS_H
#define CLI_NUMBERS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "error.h"

/* Reads exactly count numbers separated by commas.
 *   what  how a message names it: "--at", "--light sphere"
 *   form  what is allowed: "X,Y,Z" */
bool cli_numbers_parse(const char *what, const char *form, const char *text, double *out,
                       size_t count, cli_error *error);

/* One number in low..high, or a whole number in low..high. */
bool cli_numbers_real(const char *what, const char *text, double low, double high, double *out,
                      cli_error *error);
bool cli_numbers_whole(const char *what, const char *text, uint64_t low, uint64_t high,
                       uint64_t *out, cli_error *error);

enum { CLI_NUMBER_ROOM = 32 };

/* Writes the shortest text that reads back as the same float or double ("nan" for a NaN), with a
 * zero behind it, into room for CLI_NUMBER_ROOM characters. Returns its length. */
size_t cli_numbers_print_float(char *text, float value);
size_t cli_numbers_print_double(char *text, double value);

#endif
