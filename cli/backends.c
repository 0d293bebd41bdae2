/* softshadow info --backends: what builds and answers here, and why not. */
#include "backends.h"

#include <softshadow.h>
#include <string.h>

static void methods_of(cli_text *out, uint32_t backend, bool json) {
    uint32_t count = 0, shown = 0;
    if (softshadow_method_count(&count) != SOFTSHADOW_OK) return;
    for (uint32_t i = 0; i < count; i++) {
        softshadow_method method = SOFTSHADOW_METHOD_INIT;
        if (softshadow_method_info(i, &method) != SOFTSHADOW_OK) continue;
        if (!(method.backends & 1u << backend)) continue;
        cli_text_printf(out, shown++ ? ", " : "");
        if (json)
            cli_text_json(out, method.name);
        else
            cli_text_printf(out, "%s", method.name);
    }
}

static void as_text(cli_text *out, uint32_t backend, const softshadow_backend *info) {
    cli_text_printf(out, "%s%s\n", backend ? "\n" : "", info->name);
    if (info->status != SOFTSHADOW_OK) {
        cli_text_printf(out, "  not here   %s\n", info->why);
    } else {
        cli_text_printf(out, "  device     %s\n", info->device);
        if (*info->version) cli_text_printf(out, "  version    %s\n", info->version);
    }
    cli_text_printf(out, "  methods    ");
    methods_of(out, backend, false);
    cli_text_printf(out, "\n");
}

static void as_json(cli_text *out, uint32_t backend, const softshadow_backend *info) {
    cli_text_printf(out, "%s\n  {\"name\": ", backend ? "," : "");
    cli_text_json(out, info->name);
    cli_text_printf(
        out, ", \"available\": %s, \"device\": ", info->status == SOFTSHADOW_OK ? "true" : "false");
    cli_text_json(out, info->device);
    cli_text_printf(out, ", \"version\": ");
    cli_text_json(out, info->version);
    cli_text_printf(out, ", \"why\": ");
    cli_text_json(out, info->why);
    cli_text_printf(out, ", \"methods\": [");
    methods_of(out, backend, true);
    cli_text_printf(out, "]}");
}

void cli_backends(cli_text *out, bool json) {
    softshadow_backend info = SOFTSHADOW_BACKEND_INIT;
    if (json) cli_text_printf(out, "[");
    for (uint32_t i = 0; softshadow_backend_info(i, &info) == SOFTSHADOW_OK; i++) {
        (json ? as_json : as_text)(out, i, &info);
        info = (softshadow_backend)SOFTSHADOW_BACKEND_INIT;
    }
    if (json) cli_text_printf(out, "\n]\n");
}
