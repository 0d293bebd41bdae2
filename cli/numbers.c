/* Strict numbers in, shortest numbers out. Nothing here looks at the locale: the program never
 * calls setlocale(), so printf() and strtod() keep the decimal point. */
#include "numbers.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "number.h"

bool cli_numbers_parse(const char *what, const char *form, const char *text, double *out,
                       size_t count, cli_error *error) {
    const char *at = text, *end = text + strlen(text);
    cli_shown all, part;
    cli_show(&all, text, strlen(text));
    for (size_t i = 0; i < count; i++) {
        const char *begin = at, *stop = memchr(at, ',', (size_t)(end - at));
        if (!stop) stop = end;
        cli_number result = cli_number_double(&at, end, &out[i]);
        if (result == CLI_NUMBER_OK && at == stop) {
            if (i + 1 < count && at == end)
                return cli_fail(error, CLI_USAGE, "%s %s: has %zu numbers, %s is allowed", what,
                                all.text, i + 1, form);
            at += i + 1 < count;
            continue;
        }
        cli_show(&part, begin, (size_t)(stop - begin));
        return cli_fail(
            error, CLI_USAGE, "%s %s: '%s' %s, %s is allowed", what, all.text, part.text,
            cli_number_problem(result == CLI_NUMBER_OK ? CLI_NUMBER_NONE : result), form);
    }
    if (at != end)
        return cli_fail(error, CLI_USAGE, "%s %s: has more than %zu numbers, %s is allowed", what,
                        all.text, count, form);
    return true;
}

bool cli_numbers_real(const char *what, const char *text, double low, double high, double *out,
                      cli_error *error) {
    const char *at = text, *end = text + strlen(text);
    cli_number result = cli_number_double(&at, end, out);
    if (result == CLI_NUMBER_OK && at == end && *out >= low && *out <= high) return true;
    cli_shown shown;
    return cli_fail(error, CLI_USAGE, "%s %s: a number from %g to %g is allowed", what,
                    cli_show(&shown, text, strlen(text)), low, high);
}

bool cli_numbers_whole(const char *what, const char *text, uint64_t low, uint64_t high,
                       uint64_t *out, cli_error *error) {
    const char *at = text, *end = text + strlen(text);
    int64_t value = 0;
    cli_number result = cli_number_int(&at, end, &value);
    *out = (uint64_t)value;
    if (result == CLI_NUMBER_OK && at == end && value >= 0 && *out >= low && *out <= high)
        return true;
    cli_shown shown;
    return cli_fail(error, CLI_USAGE, "%s %s: a whole number from %llu to %llu is allowed", what,
                    cli_show(&shown, text, strlen(text)), (unsigned long long)low,
                    (unsigned long long)high);
}

/* Fractions dominate the output, and printf() is ten times as slow as this: the fewest decimals d
 * for which round(value * 10^d) / 10^d is the same float. */
static size_t print_fraction(char *text, float value) {
    double scale = 1.0;
    for (int digits = 1; digits <= 9; digits++) {
        scale *= 10.0;
        double whole = nearbyint((double)value * scale);
        if (whole >= scale || (float)(whole / scale) != value) continue;
        uint32_t rest = (uint32_t)whole;
        text[0] = '0';
        text[1] = '.';
        for (int i = digits; i > 0; i--, rest /= 10) text[1 + i] = (char)('0' + rest % 10);
        text[2 + digits] = 0;
        return (size_t)(2 + digits);
    }
    return 0;
}

size_t cli_numbers_print_float(char *text, float value) {
    if (isnan(value)) return memcpy(text, "nan", 4), 3;
    if (value > 1e-4f && value < 1.0f) {
        size_t length = print_fraction(text, value);
        if (length) return length;
    }
    int length = 0;
    for (int digits = 6; digits <= 9; digits++) {
        length = snprintf(text, CLI_NUMBER_ROOM, "%.*g", digits, (double)value);
        if (strtof(text, NULL) == value) break;
    }
    return (size_t)length;
}

size_t cli_numbers_print_double(char *text, double value) {
    if (isnan(value)) return memcpy(text, "nan", 4), 3;
    int length = 0;
    for (int digits = 15; digits <= 17; digits++) {
        length = snprintf(text, CLI_NUMBER_ROOM, "%.*g", digits, value);
        if (strtod(text, NULL) == value) break;
    }
    return (size_t)length;
}
