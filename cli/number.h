/* Numbers out of text: a decimal point whatever the locale, no copy, no terminating zero needed.
 *
 * Each call reads one number that begins at *at and lies before end. With CLI_NUMBER_OK *at is
 * moved behind it; what follows (a blank, a comma, a letter) is the caller's to judge: "0x10" is a
 * 0 and then an x, "1,5" a 1 and then a comma. Otherwise *at stays and *value is 0. A leading + is
 * taken. */
#ifndef CLI_NUMBER_H
#define CLI_NUMBER_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum cli_number {
    CLI_NUMBER_OK = 0,
    CLI_NUMBER_NONE,       /* there is no number here */
    CLI_NUMBER_NOT_FINITE, /* nan, inf, infinity in any case */
    CLI_NUMBER_OVERFLOW    /* too large for the type; what is too small becomes 0 */
} cli_number;

cli_number cli_number_double(const char **at, const char *end, double *value);
cli_number cli_number_float(const char **at, const char *end, float *value);
/* Digits with an optional sign, nothing else: "1.0" is a 1 and then a point. */
cli_number cli_number_int(const char **at, const char *end, int64_t *value);

/* For a message: "is not a number", "is not finite", "is too large". */
const char *cli_number_problem(cli_number result);

#ifdef __cplusplus
}
#endif
#endif
