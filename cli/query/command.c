/* softshadow query: its options. */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "../commands.h"
#include "query.h"

/* As it is shown: a line of it is a line here. */
/* clang-format off */
static const char about[] =
"For each point the fraction of each light that it sees: 1 lit, 0 umbra, nan for a point that is\n"
"not finite. The last operand holds the points when there are two or more; else they come from\n"
"standard input, as -, too. They stream: memory stays bounded, answers leave as points arrive.\n"
"\n"
"Points in   csv   text: x y z [nx ny nz] between blanks, commas or semicolons; # comments; a\n"
"                  line of names may come first (x y z nx ny nz in any order, other columns are\n"
"                  kept)\n"
"            ply   vertices: x y z [nx ny nz]; ascii or binary; everything else is kept\n"
"            npy   N x 3 or N x 6, '<f4' or '<f8', C order\n"
"            raw   little-endian float32, x y z a point; raw6: x y z nx ny nz\n"
"            image channels P.X P.Y P.Z (or R G B), N.X N.Y N.Z if there\n"
"Answers     csv   a column visibility (several lights: visibility_0 ...) at the end of each line\n"
"            ply   a float property scalar_visibility      npy   N x lights float32\n"
"            raw   float32, light after light a point      image a channel visibility (EXR)\n"
"            with --error error_bound follows, after all visibilities\n"
"\n"
"Formats are told by the file's name, else by --input-format and --output-format; standard input\n"
"is csv, standard output has the format of the points, unless told otherwise.";

static const char more[] =
"Examples:\n"
"  softshadow query city.obj --light sun:1,0,-2,0.27 roofs.csv -o lit.csv\n"
"  softshadow query a.ply b.stl --light disk:0,0,9,0,0,-1,1 --error points.npy -o lit.npy\n"
"  for i in 0 1 2 3; do\n"
"    softshadow query a.obj --light sphere:0,0,9,1 --shard $i/4 --resume p.npy -o lit.npy &\n"
"  done; wait\n";
/* clang-format on */

static bool take_shard(void *into, const char *value, cli_error *error) {
    query_request *request = into;
    unsigned long long i, n;
    int used = 0;
    cli_shown shown;
    bool digits = strspn(value, "0123456789/") == strlen(value) && strlen(value) < 40;
    if (!digits || sscanf(value, "%18llu/%18llu%n", &i, &n, &used) != 2 || value[used] || n == 0)
        return cli_fail(error, CLI_USAGE,
                        "--shard %s: I/N is allowed, the I-th of N parts, I from 0",
                        cli_show(&shown, value, strlen(value)));
    request->shard = i;
    request->shards = n;
    return true;
}

/* Which operand is what. */
static bool assign(query_request *request, char **operands, int count, cli_error *error) {
    request->meshes = operands;
    request->mesh_count = count;
    if (!request->points && count > 1) {
        request->points = operands[count - 1];
        request->mesh_count--;
    }
    if (!request->points) request->points = "-";
    if (!request->output) request->output = "-";
    if (request->mesh_count == 0 || strcmp(operands[0], "-") == 0)
        return cli_fail(error, CLI_USAGE,
                        "a mesh is missing, MESH... --light L [POINTS|-] is allowed");
    if (strcmp(request->points, "-") == 0 && isatty(STDIN_FILENO))
        return cli_fail(
            error, CLI_USAGE,
            "points are missing: standard input is a terminal, POINTS is allowed after the "
            "meshes");
    return true;
}

int cli_query(int argc, char **argv) {
    query_request request = {.common = CLI_BUILD_OPTIONS_INIT,
                             .input_format = POINTS_NO_FORMAT,
                             .output_format = POINTS_NO_FORMAT};
    cli_option build[CLI_BUILD_TABLE], run[CLI_RUN_TABLE];
    cli_build_options_tables(&request.common, build, run);
    const cli_option own[] = {
        {.name = "points",
         .kind = CLI_TEXT,
         .argument = "FILE",
         .into = &request.points,
         .help = "the points; all operands are meshes then"},
        {.name = "from",
         .kind = CLI_TEXT,
         .argument = "FILE",
         .into = &request.points,
         .help = "the same: --from gbuffer.exr"},
        {.name = "output",
         .letter = 'o',
         .kind = CLI_TEXT,
         .argument = "FILE",
         .into = &request.output,
         .help = "where answers go (-: standard output)"},
        {.name = "input-format",
         .kind = CLI_CHOICE,
         .argument = "FORMAT",
         .into = &request.input_format,
         .choices = points_format_names,
         .help = "csv, ply, npy, raw, raw6 or image (by the name)"},
        {.name = "output-format",
         .kind = CLI_CHOICE,
         .argument = "FORMAT",
         .into = &request.output_format,
         .choices = points_format_names,
         .help = "csv, ply, npy, raw or image (by the name)"},
        {.name = "error",
         .kind = CLI_FLAG,
         .into = &request.bounds,
         .help = "add the bound of the error that the method gives"},
        {.name = "no-normals",
         .kind = CLI_FLAG,
         .into = &request.no_normals,
         .help = "do not use the points' normals"},
        {.name = "channels",
         .kind = CLI_TEXT,
         .argument = "NAME",
         .into = &request.channels,
         .help = "images: positions are NAME.X NAME.Y NAME.Z (P, RGB)"},
        {.name = "shard",
         .kind = CLI_TAKE,
         .argument = "I/N",
         .into = &request,
         .take = take_shard,
         .given = &request.sharded,
         .help = "the I-th of N parts only, I from 0; npy and raw files\n"
                 "are written in place, by all shards at once; together\n"
                 "they are the whole bit for bit (auto: within tolerance)"},
        {.name = "resume",
         .kind = CLI_FLAG,
         .into = &request.resume,
         .help = "keep FILE.resume beside the output, and skip what it\nsays is whole"},
        {0}};
    static const char *const names[] = {"Points", "Light and method", "Running"};
    const cli_command command = {.name = "query",
                                 .usage = "MESH... --light LIGHT [POINTS|-] [-o OUT|-]",
                                 .about = about,
                                 .more = more,
                                 .table_names = names,
                                 .tables = {own, build, run}};
    char **operands;
    int count, status;
    cli_error error;
    if (!cli_options_parse(&command, argc, argv, &operands, &count, &status)) return status;
    bool fine = assign(&request, operands, count, &error) &&
                cli_build_options_finish(&request.common, &error) && query_run(&request, &error);
    cli_build_options_free(&request.common);
    return fine ? 0 : cli_options_complain("query", &error);
}
