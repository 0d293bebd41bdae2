/* libFuzzer on what a user types: light specifications, numbers, options. Nothing crashes, a
 * refusal is one plain line, and a light that is taken has finite numbers, or the library refuses
 * it. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "light.h"
#include "numbers.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void must(bool holds) {
    if (!holds) abort();
}

static void check_error(const cli_error *error) {
    must(error->status == CLI_USAGE && error->text[0] != 0);
    for (const char *c = error->text; *c; c++) must(*c >= 0x20 && *c < 0x7f);
}

static void try_light(const char *text) {
    softshadow_light light;
    cli_error error = {.status = 0};
    if (!cli_light_parse(text, &light, &error)) {
        check_error(&error);
        return;
    }
    softshadow *handle;
    must(softshadow_create(&handle, NULL) == SOFTSHADOW_OK);
    const softshadow_status status = softshadow_set_light(handle, &light);
    must(status == SOFTSHADOW_OK || status == SOFTSHADOW_E_LIGHT ||
         status == SOFTSHADOW_E_ARGUMENT);
    if (status == SOFTSHADOW_OK) must(isfinite(light.radius) && light.radius >= 0);
    softshadow_destroy(handle);
}

/* What a number prints as reads back as the same. */
static void try_number(const char *text) {
    double value, again;
    char printed[CLI_NUMBER_ROOM];
    cli_error error = {.status = 0};
    if (!cli_numbers_real("n", text, -INFINITY, INFINITY, &value, &error)) {
        check_error(&error);
        return;
    }
    must(cli_numbers_print_double(printed, value) < CLI_NUMBER_ROOM);
    must(cli_numbers_real("n", printed, -INFINITY, INFINITY, &again, &error));
    must(memcmp(&value, &again, sizeof value) == 0);
}

static void try_list(const char *text) {
    double values[3];
    uint64_t whole;
    cli_error error = {.status = 0};
    if (!cli_numbers_parse("--at", "X,Y,Z", text, values, 3, &error)) check_error(&error);
    error = (cli_error){.status = 0};
    if (cli_numbers_whole("--size", text, 1, 16384, &whole, &error))
        must(whole >= 1 && whole <= 16384);
    else
        check_error(&error);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    char *text = malloc(size + 1);
    if (!text) return 0;
    memcpy(text, data, size);
    text[size] = 0;
    try_light(text);
    try_number(text);
    try_list(text);
    free(text);
    return 0;
}
