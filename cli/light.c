/* Lights out of command-line text. */
#include "light.h"

#include <string.h>

#include "numbers.h"

static const struct form {
    const char *name, *numbers;
    size_t count;
} forms[] = {
    [SOFTSHADOW_SPHERE] = {"sphere", "X,Y,Z,R", 4},
    [SOFTSHADOW_DISK] = {"disk", "X,Y,Z,NX,NY,NZ,R", 7},
    [SOFTSHADOW_RECT] = {"rect", "X,Y,Z,UX,UY,UZ,VX,VY,VZ", 9},
    [SOFTSHADOW_SUN] = {"sun", "DX,DY,DZ,HALF_ANGLE_DEGREES", 4},
};
enum { FORMS = sizeof forms / sizeof *forms };

static void fill(softshadow_light *light, const double *n) {
    const double to_radians = 3.14159265358979323846 / 180.0;
    size_t axis = sizeof light->position;
    memcpy(light->type == SOFTSHADOW_SUN ? light->direction : light->position, n, axis);
    switch (light->type) {
    case SOFTSHADOW_SPHERE:
        light->radius = n[3];
        break;
    case SOFTSHADOW_DISK:
        memcpy(light->direction, n + 3, axis);
        light->radius = n[6];
        break;
    case SOFTSHADOW_RECT:
        memcpy(light->u, n + 3, axis);
        memcpy(light->v, n + 6, axis);
        break;
    default:
        light->radius = n[3] * to_radians;
        break;
    }
}

bool cli_light_parse(const char *text, softshadow_light *out, cli_error *error) {
    const char *colon = strchr(text, ':');
    size_t length = colon ? (size_t)(colon - text) : strlen(text);
    *out = (softshadow_light)SOFTSHADOW_LIGHT_INIT;
    for (uint32_t type = 0; colon && type < FORMS; type++) {
        const struct form *form = &forms[type];
        if (strlen(form->name) != length || memcmp(form->name, text, length) != 0) continue;
        char what[32] = "--light ";
        double numbers[9];
        strcat(strcat(what, form->name), ":");
        if (!cli_numbers_parse(what, form->numbers, colon + 1, numbers, form->count, error))
            return false;
        out->type = type;
        fill(out, numbers);
        return true;
    }
    cli_shown shown;
    return cli_fail(error, CLI_USAGE, "--light %s: is no light, " CLI_LIGHT_FORMS " is allowed",
                    cli_show(&shown, text, strlen(text)));
}

bool cli_light_add(softshadow_light *lights, uint32_t *count, const char *text, cli_error *error) {
    if (*count == CLI_MOST_LIGHTS)
        return cli_fail(error, CLI_USAGE, "--light: at most %d lights are allowed",
                        CLI_MOST_LIGHTS);
    return cli_light_parse(text, &lights[(*count)++], error);
}

const char *cli_light_type_name(uint32_t type) { return type < FORMS ? forms[type].name : "?"; }
