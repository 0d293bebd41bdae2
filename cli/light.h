/* A light as the command line writes it:
 *   sphere:X,Y,Z,R   disk:X,Y,Z,NX,NY,NZ,R   rect:X,Y,Z,UX,UY,UZ,VX,VY,VZ (half axes)
 *   sun:DX,DY,DZ,HALF_ANGLE_DEGREES (the way the light travels) */
#ifndef CLI_LIGHT_H
#define CLI_LIGHT_H

#include <softshadow.h>
#include <stdbool.h>

#include "error.h"

#define CLI_LIGHT_FORMS                                                                            \
    "sphere:X,Y,Z,R, disk:X,Y,Z,NX,NY,NZ,R, rect:X,Y,Z,UX,UY,UZ,VX,VY,VZ or sun:DX,DY,DZ,DEGREES"

/* Whether the numbers make a light (a radius below zero, skewed axes) is for the library to say. */
bool cli_light_parse(const char *text, softshadow_light *out, cli_error *error);

/* The next of a list with room for CLI_MOST_LIGHTS, for options that may be repeated. */
enum { CLI_MOST_LIGHTS = 64 };
bool cli_light_add(softshadow_light *lights, uint32_t *count, const char *text, cli_error *error);

/* "sphere", "disk", "rect", "sun"; "?" for a type that is none. */
const char *cli_light_type_name(uint32_t type);

#endif
