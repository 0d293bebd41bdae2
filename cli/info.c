/* softshadow info: what a mesh is made of, and how much of it can cast an edge of shadow. */
#include <inttypes.h>
#include <softshadow.h>
#include <string.h>

#include "backends.h"
#include "commands.h"
#include "light.h"
#include "mesh/mesh.h"
#include "options.h"
#include "output.h"
#include "text_buffer.h"

typedef struct info {
    bool json, backends;
    const char *light_texts[CLI_MOST_LIGHTS];
    softshadow_light lights[CLI_MOST_LIGHTS];
    uint32_t light_count;
    softshadow *handle;
    cli_text text;
    bool first; /* of the meshes in the list */
} info;

typedef struct findings {
    const char *path;
    const cli_mesh *mesh;
    softshadow_mesh_report report;
    uint64_t silhouettes[CLI_MOST_LIGHTS];
} findings;

static bool take_light(void *into, const char *value, cli_error *error) {
    info *in = into;
    if (in->light_count < CLI_MOST_LIGHTS) in->light_texts[in->light_count] = value;
    return cli_light_add(in->lights, &in->light_count, value, error);
}

/* ---- What is found ----------------------------------------------------------------------------*/

static bool library_fails(const info *in, const char *path, cli_error *error) {
    return cli_fail(error, CLI_FAILED, "%s: %s", path, softshadow_last_message(in->handle));
}

/* The library counts silhouettes for one light at a time, the first. */
static bool ask(info *in, uint32_t id, findings *found, cli_error *error) {
    found->report = (softshadow_mesh_report) SOFTSHADOW_MESH_REPORT_INIT;
    if (softshadow_mesh_info(in->handle, id, &found->report) != SOFTSHADOW_OK)
        return library_fails(in, found->path, error);
    for (uint32_t i = 0; i < in->light_count; i++) {
        softshadow_mesh_report report = SOFTSHADOW_MESH_REPORT_INIT;
        if (softshadow_set_light(in->handle, &in->lights[i]) != SOFTSHADOW_OK)
            return library_fails(in, in->light_texts[i], error);
        if (softshadow_mesh_info(in->handle, id, &report) != SOFTSHADOW_OK)
            return library_fails(in, found->path, error);
        found->silhouettes[i] = report.silhouette_edges;
    }
    return true;
}

static bool examine(info *in, findings *found, cli_error *error) {
    const softshadow_mesh mesh = cli_mesh_given(found->mesh);
    uint32_t id;
    if (softshadow_add_mesh(in->handle, &mesh, &id) != SOFTSHADOW_OK)
        return library_fails(in, found->path, error);
    bool fine = ask(in, id, found, error);
    if (softshadow_remove_mesh(in->handle, id) != SOFTSHADOW_OK && fine)
        return library_fails(in, found->path, error);
    return fine;
}

/* ---- How it is told ---------------------------------------------------------------------------*/

static const struct count {
    const char *words, *name;
    size_t offset;
} counts[] = {
    {"components", "components", offsetof(softshadow_mesh_report, components)},
    {"closed components", "closed_components",
     offsetof(softshadow_mesh_report, closed_components)},
    {"edges", "edges", offsetof(softshadow_mesh_report, edges)},
    {"boundary edges", "boundary_edges", offsetof(softshadow_mesh_report, boundary_edges)},
    {"non-manifold edges", "nonmanifold_edges",
     offsetof(softshadow_mesh_report, nonmanifold_edges)},
    {"flipped edges", "flipped_edges", offsetof(softshadow_mesh_report, flipped_edges)},
    {"non-manifold vertices", "nonmanifold_vertices",
     offsetof(softshadow_mesh_report, nonmanifold_vertices)},
    {"degenerate triangles", "degenerate_triangles",
     offsetof(softshadow_mesh_report, degenerate_triangles)},
    {"duplicate triangles", "duplicate_triangles",
     offsetof(softshadow_mesh_report, duplicate_triangles)},
};
enum { COUNTS = sizeof counts / sizeof *counts };

static uint64_t value_of(const findings *found, const struct count *count) {
    uint64_t value;
    memcpy(&value, (const char *) &found->report + count->offset, sizeof value);
    return value;
}

static bool is_closed(const findings *found) {
    return found->report.closed_components == found->report.components;
}

static const char *shell(const findings *found) {
    if (is_closed(found)) return "closed";
    return found->report.closed_components ? "partly closed" : "open";
}

static void line(cli_text *out, const char *words, uint64_t value) {
    cli_text_printf(out, "  %-22s %12" PRIu64 "\n", words, value);
}

static void as_text(info *in, const findings *found) {
    cli_text *out = &in->text;
    cli_error shown; /* a path may hold what a terminal would obey */
    cli_fail(&shown, 0, "%s", found->path);
    cli_text_printf(out, "%s%s\n  %-22s %12s\n", in->first ? "" : "\n", shown.text, "format",
                    found->mesh->format);
    line(out, "triangles", found->report.triangles);
    if (found->mesh->faces != found->report.triangles) line(out, "faces", found->mesh->faces);
    if (found->mesh->unclean_faces) line(out, "self-crossing faces", found->mesh->unclean_faces);
    line(out, "vertices", found->report.vertices);
    line(out, "different positions", found->report.positions);
    for (int k = 0; k < 3; k++)
        cli_text_printf(out, "  bounds %c               %12.7g .. %.7g\n", "xyz"[k],
                        found->report.bounds[k], found->report.bounds[k + 3]);
    cli_text_printf(out, "  %-22s %12s\n", "surface", shell(found));
    for (int i = 0; i < COUNTS; i++) line(out, counts[i].words, value_of(found, &counts[i]));
    for (uint32_t i = 0; i < in->light_count; i++)
        cli_text_printf(out, "  %-22s %12" PRIu64 "  from %s\n", "silhouette edges",
                        found->silhouettes[i], in->light_texts[i]);
}

static void as_json(info *in, const findings *found) {
    cli_text *out = &in->text;
    const double *b = found->report.bounds;
    cli_text_printf(out, "%s\n  {\"file\": ", in->first ? "" : ",");
    cli_text_json(out, found->path);
    cli_text_printf(out, ", \"format\": \"%s\", \"triangles\": %" PRIu64 ", \"faces\": %" PRIu64
                         ", \"self_crossing_faces\": %" PRIu64 ", \"vertices\": %" PRIu64
                         ", \"positions\": %" PRIu64,
                    found->mesh->format, found->report.triangles, found->mesh->faces,
                    found->mesh->unclean_faces, found->report.vertices, found->report.positions);
    cli_text_printf(out, ",\n   \"bounds\": [%.17g, %.17g, %.17g, %.17g, %.17g, %.17g]", b[0], b[1],
                    b[2], b[3], b[4], b[5]);
    cli_text_printf(out, ", \"closed\": %s", is_closed(found) ? "true" : "false");
    for (int i = 0; i < COUNTS; i++)
        cli_text_printf(out, ", \"%s\": %" PRIu64, counts[i].name, value_of(found, &counts[i]));
    cli_text_printf(out, ",\n   \"silhouettes\": [");
    for (uint32_t i = 0; i < in->light_count; i++) {
        cli_text_printf(out, "%s{\"light\": ", i ? ", " : "");
        cli_text_json(out, in->light_texts[i]);
        cli_text_printf(out, ", \"edges\": %" PRIu64 "}", found->silhouettes[i]);
    }
    cli_text_printf(out, "]}");
}

/* ---- The command ------------------------------------------------------------------------------*/

static bool one_mesh(info *in, const char *path, cli_error *error) {
    cli_mesh mesh;
    findings found = {.path = path, .mesh = &mesh};
    if (!cli_mesh_read(path, &mesh, error)) return false;
    bool fine = examine(in, &found, error);
    if (fine) {
        (in->json ? as_json : as_text)(in, &found);
        in->first = false;
    }
    cli_mesh_free(&mesh);
    return fine;
}

/* A light that is none is wrong for every mesh: said once, before any is read. */
static bool open_handle(info *in, cli_error *error) {
    if (softshadow_create(&in->handle, NULL) != SOFTSHADOW_OK)
        return cli_fail(error, CLI_FAILED, "%s", softshadow_last_message(NULL));
    for (uint32_t i = 0; i < in->light_count; i++)
        if (softshadow_set_light(in->handle, &in->lights[i]) != SOFTSHADOW_OK)
            return cli_fail(error, CLI_USAGE, "--light %s: %s", in->light_texts[i],
                            softshadow_last_message(in->handle));
    return true;
}

/* A mesh that fails is told and does not keep the others from being looked at. */
static int all_meshes(info *in, char **paths, int count) {
    cli_error error;
    int status = 0;
    if (in->json) cli_text_printf(&in->text, "[");
    for (int i = 0; i < count; i++)
        if (!one_mesh(in, paths[i], &error)) status = cli_options_complain("info", &error);
    if (in->json) cli_text_printf(&in->text, "%s]\n", in->first ? "" : "\n");
    return status;
}

static int print(info *in, int status) {
    cli_error error;
    cli_output output = {.fd = -1};
    bool fine = in->text.failed ? cli_fail(&error, CLI_FAILED, "memory ran out")
                                : cli_output_open(&output, "-", &error) &&
                                      cli_output_write(&output, in->text.begin, in->text.length,
                                                       &error) &&
                                      cli_output_commit(&output, &error);
    if (!fine) status = cli_options_complain("info", &error);
    cli_output_abandon(&output);
    return status;
}

int cli_info(int argc, char **argv) {
    info in = {.first = true};
    const cli_option own[] = {
        {.name = "light", .letter = 'l', .kind = CLI_TAKE, .argument = "L", .into = &in,
         .take = take_light,
         .help = "silhouette edges seen from the centre of this light; repeatable"},
        {.name = "backends", .kind = CLI_FLAG, .into = &in.backends,
         .help = "what builds and answers here: the CPU, a GPU, or why not; no mesh"},
        {.name = "json", .kind = CLI_FLAG, .into = &in.json, .help = "as JSON, for programs"},
        {0}};
    const cli_command command = {
        .name = "info",
        .usage = "MESH... [--light L] [--json] | --backends",
        .about = "Counts what meshes (OBJ, PLY, STL, OFF) are made of, after vertices in the same\n"
                 "place were taken as one, and whether they are closed. L is\n" CLI_LIGHT_FORMS ".",
        .tables = {own},
        .more = "  softshadow info bunny.obj --light sphere:0,0,8,0.5\n"};
    char **paths;
    int count, status;
    cli_error error;
    if (!cli_options_parse(&command, argc, argv, &paths, &count, &status)) return status;
    if (in.backends) {
        if (count) {
            cli_fail(&error, CLI_USAGE, "--backends: no mesh is allowed beside it");
            return cli_options_complain("info", &error);
        }
        cli_backends(&in.text, in.json);
        status = print(&in, 0);
        cli_text_free(&in.text);
        return status;
    }
    if (count == 0) {
        cli_fail(&error, CLI_USAGE, "a mesh is missing; OBJ, PLY, STL and OFF files are allowed");
        return cli_options_complain("info", &error);
    }
    status = open_handle(&in, &error) ? print(&in, all_meshes(&in, paths, count))
                                      : cli_options_complain("info", &error);
    softshadow_destroy(in.handle);
    cli_text_free(&in.text);
    return status;
}
