/* softshadow methods: what the library has, as a table for people or as JSON for programs. */
#include <softshadow.h>
#include <stdio.h>
#include <string.h>

#include "commands.h"
#include "light.h"
#include "options.h"
#include "output.h"
#include "text_buffer.h"

static const char *const bounds[] = {"none", "certified", "statistical"};

static const char *bound_name(uint32_t kind) {
    return kind < sizeof bounds / sizeof *bounds ? bounds[kind] : "unknown";
}

static const struct {
    uint32_t backend;
    const char *name;
} backends[] = {{SOFTSHADOW_CPU, "cpu"}, {SOFTSHADOW_EGL, "egl"}};

static void backends_list(cli_text *out, uint32_t bits, const char *between, const char *quote) {
    bool first = true;
    for (size_t i = 0; i < sizeof backends / sizeof *backends; i++) {
        if (!(bits >> backends[i].backend & 1)) continue;
        cli_text_printf(out, "%s%s%s%s", first ? "" : between, quote, backends[i].name, quote);
        first = false;
    }
}

static const char *or_empty(const char *text) { return text ? text : ""; }

static void lights_text(cli_text *out, uint32_t bits, const char *otherwise) {
    const char *between = "";
    for (uint32_t type = SOFTSHADOW_SPHERE; type <= SOFTSHADOW_SUN; type++) {
        if (!(bits & 1u << type)) continue;
        cli_text_printf(out, "%s%s", between, cli_light_type_name(type));
        between = " ";
    }
    if (!bits) cli_text_printf(out, "%s", otherwise);
}

static void lights_json(cli_text *out, const char *name, uint32_t bits) {
    const char *between = "";
    cli_text_printf(out, "\"%s\": [", name);
    for (uint32_t type = SOFTSHADOW_SPHERE; type <= SOFTSHADOW_SUN; type++) {
        if (!(bits & 1u << type)) continue;
        cli_text_printf(out, "%s\"%s\"", between, cli_light_type_name(type));
        between = ", ";
    }
    cli_text_printf(out, "]");
}

static void as_text(cli_text *out, const softshadow_method *method) {
    cli_text_printf(out, "%s\n  %s\n  lights        ", method->name, or_empty(method->title));
    lights_text(out, method->lights_native, "none");
    if (method->lights_approximated) {
        cli_text_printf(out, "\n  approximated  ");
        lights_text(out, method->lights_approximated, "none");
    }
    cli_text_printf(out, "\n  backends      ");
    backends_list(out, method->backends, " ", "");
    cli_text_printf(out, "\n  error bound   %s\n", bound_name(method->bound_kind));
    if (*or_empty(method->citation)) cli_text_printf(out, "  after         %s\n", method->citation);
    if (*or_empty(method->notes)) cli_text_printf(out, "  notes         %s\n", method->notes);
}

static void as_json(cli_text *out, const softshadow_method *method) {
    cli_text_printf(out, "  {\"name\": ");
    cli_text_json(out, or_empty(method->name));
    cli_text_printf(out, ", \"title\": ");
    cli_text_json(out, or_empty(method->title));
    cli_text_printf(out, ", ");
    lights_json(out, "lights_native", method->lights_native);
    cli_text_printf(out, ", ");
    lights_json(out, "lights_approximated", method->lights_approximated);
    cli_text_printf(out, ", \"backends\": [");
    backends_list(out, method->backends, ", ", "\"");
    cli_text_printf(out, "], \"bound\": \"%s\", \"citation\": ", bound_name(method->bound_kind));
    cli_text_json(out, or_empty(method->citation));
    cli_text_printf(out, ", \"notes\": ");
    cli_text_json(out, or_empty(method->notes));
    cli_text_printf(out, "}");
}

static bool list(cli_text *out, bool json, cli_error *error) {
    uint32_t count;
    if (softshadow_method_count(&count) != SOFTSHADOW_OK)
        return cli_fail(error, CLI_FAILED, "the library lists no methods");
    if (json) cli_text_printf(out, "[\n");
    for (uint32_t i = 0; i < count; i++) {
        softshadow_method method = SOFTSHADOW_METHOD_INIT;
        softshadow_status status = softshadow_method_info(i, &method);
        if (status != SOFTSHADOW_OK)
            return cli_fail(error, CLI_FAILED, "method %u: %s", i, softshadow_status_name(status));
        if (json) {
            as_json(out, &method);
            cli_text_printf(out, i + 1 < count ? ",\n" : "\n");
        } else {
            as_text(out, &method);
            if (i + 1 < count) cli_text_printf(out, "\n");
        }
    }
    if (json) cli_text_printf(out, "]\n");
    return out->failed ? cli_fail(error, CLI_FAILED, "memory ran out") : true;
}

int cli_methods(int argc, char **argv) {
    bool json = false;
    const cli_option own[] = {
        {.name = "json", .kind = CLI_FLAG, .into = &json, .help = "as JSON, for programs"}, {0}};
    const cli_command command = {
        .name = "methods",
        .usage = "[--json]",
        .about = "Lists the methods: which lights each takes as they are, "
                 "which by a stand-in, where\n"
                 "it runs, what its error bound means, and the paper it is after.",
        .tables = {own}};
    char **operands;
    int count, status;
    cli_error error;
    if (!cli_options_parse(&command, argc, argv, &operands, &count, &status)) return status;
    if (count) {
        cli_fail(&error, CLI_USAGE, "%s: takes no files, options only", operands[0]);
        return cli_options_complain("methods", &error);
    }
    cli_text text = {0};
    cli_output output = {.fd = -1};
    bool fine = list(&text, json, &error) && cli_output_open(&output, "-", &error) &&
                cli_output_write(&output, text.begin, text.length, &error) &&
                cli_output_commit(&output, &error);
    cli_output_abandon(&output);
    cli_text_free(&text);
    return fine ? 0 : cli_options_complain("methods", &error);
}
