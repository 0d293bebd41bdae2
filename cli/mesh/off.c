/* OFF: counts, vertices, polygons, as text.
 * based on: Geomview's manual, "OFF: indexed polygon files". Its header is a sum of letters: ST
 * texture coordinates, C colours, N normals stand at every vertex; 4 and n change the dimension and
 * are refused. A vertex and a face have a line each; what a line may hold besides is checked, and
 * only texture coordinates are kept. */
#include "mesh/readers.h"

#include "softshadow.h"

#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct off {
    cli_builder *builder;
    cli_scan text;
    bool uvs, has_uvs, has_colours, has_normals;
    uint64_t vertices, faces;
} off;

/* [ST][C][N][4][n]OFF; some writers put N before C, which changes nothing in the lines. */
static bool read_keyword(off *o) {
    const char *at = o->text.at, *end = cli_scan_word_end(&o->text);
    bool dimension = false;
    for (; end - at > 3; at++) {
        if (at[0] == 'S' && at[1] == 'T' && !o->has_uvs) {
            o->has_uvs = true;
            at++;
        } else if (*at == 'C' && !o->has_colours) {
            o->has_colours = true;
        } else if (*at == 'N' && !o->has_normals) {
            o->has_normals = true;
        } else if (*at == '4' || *at == 'n') {
            dimension = true;
        } else {
            break;
        }
    }
    if (end - at != 3 || memcmp(at, "OFF", 3))
        return cli_scan_fail_word(&o->text, "is no OFF header; OFF, with ST, C, N before it");
    if (dimension)
        return cli_scan_fail_word(&o->text, "has vertices of another dimension; 3 are allowed");
    o->text.at = end;
    cli_scan_blanks(&o->text);
    if (cli_scan_word_is(&o->text, "BINARY"))
        return cli_scan_fail_word(&o->text,
                                  "OFF is not read; ascii OFF is, and binary PLY and STL");
    return true;
}

static bool expect_line_over(off *o, const char *problem) {
    if (!cli_scan_line_over(&o->text)) return cli_scan_fail_word(&o->text, problem);
    cli_scan_next_line(&o->text);
    return true;
}

/* How many numbers more the line has; -1: something that is none, the error is set. */
static int read_numbers(off *o, const char *what, int most, double *last) {
    int count = 0;
    for (; count < most && !cli_scan_line_over(&o->text); count++) {
        last[0] = last[1];
        if (!cli_scan_double(&o->text, what, &last[1])) return -1;
    }
    return count;
}

static bool read_counts(off *o) {
    uint64_t edges;
    cli_scan_next_record(&o->text);
    const char *at = o->text.at;
    if (!cli_scan_count(&o->text, "number of vertices", &o->vertices) ||
        !cli_scan_count(&o->text, "number of faces", &o->faces))
        return false;
    if (!cli_scan_line_over(&o->text) &&
        !cli_scan_count(&o->text, "number of edges", &edges))
        return false;
    if (!expect_line_over(o, "is one too many; vertices, faces and edges are counted"))
        return false;
    /* The shortest vertex is "0 0 0", the shortest face "3 0 0 0", and a newline each. */
    const cli_source *source = o->text.source;
    uint64_t left = (uint64_t) (source->data + source->size - o->text.at) + 1;
    if (o->vertices > left / 6 || o->faces > left / 8 || 6 * o->vertices + 8 * o->faces > left)
        return cli_source_fail(source, at, o->text.error,
                               "%" PRIu64 " vertices and %" PRIu64 " faces are announced; the "
                               "%" PRIu64 " bytes that follow cannot hold them",
                               o->vertices, o->faces, left - 1);
    return true;
}

static bool fail_end(off *o, const char *what, uint64_t number, uint64_t count) {
    return cli_source_fail(o->text.source, o->text.at, o->text.error,
                           "the file ends before %s %" PRIu64 " of %" PRIu64, what, number, count);
}

/* x y z, then 3 numbers for N, 1 to 4 for C, 2 for ST. */
static bool read_vertex(off *o, uint64_t number) {
    static const char *const names[] = {"x", "y", "z"};
    double position[3], last[2] = {0, 0};
    for (int k = 0; k < 3; k++)
        if (!cli_scan_coordinate(&o->text, names[k], &position[k])) return false;
    int low = 3 * o->has_normals + 1 * o->has_colours + 2 * o->has_uvs;
    int high = 3 * o->has_normals + 4 * o->has_colours + 2 * o->has_uvs;
    int count = read_numbers(o, "a normal, colour or texture coordinate", high, last);
    if (count < 0) return false;
    if (count < low)
        return cli_scan_fail_word(&o->text,
                                  "the header's letters ask for more numbers at a vertex");
    if (o->uvs && o->has_uvs) {
        float *uv = o->builder->mesh.uvs + 2 * number;
        if (fabs(last[0]) > FLT_MAX || fabs(last[1]) > FLT_MAX)
            return cli_scan_fail_word(&o->text, "a texture coordinate is too large for a float");
        uv[0] = (float) last[0];
        uv[1] = (float) last[1];
    }
    return expect_line_over(o, "is one too many; a vertex has x y z and what the header's letters "
                               "say") &&
           cli_builder_vertex(o->builder, position);
}

static bool read_face(off *o) {
    cli_builder *builder = o->builder;
    const char *face = o->text.at;
    uint64_t corners, vertex;
    double last[2];
    if (!cli_scan_count(&o->text, "number of corners", &corners)) return false;
    if (corners < 3 || corners > CLI_POLYGON_CORNERS)
        return cli_source_fail(o->text.source, face, o->text.error,
                               "a face of %" PRIu64 " corners; 3 to 65536 are allowed", corners);
    if (!cli_builder_face_room(builder, corners)) return false;
    for (uint64_t i = 0; i < corners; i++) {
        cli_scan_blanks(&o->text);
        cli_scan before = o->text;
        if (!cli_scan_count(&o->text, "index of a vertex", &vertex)) return false;
        if (vertex >= o->vertices)
            return cli_source_fail(before.source, before.at, before.error,
                                   "vertex %" PRIu64 " (counted from 0) is named, but the file has "
                                   "%" PRIu64, vertex, o->vertices);
        builder->face[i] = (uint32_t) vertex;
    }
    return read_numbers(o, "a face's colour", 4, last) >= 0 &&
           expect_line_over(o, "is one too many; behind its corners a face has at most the 4 "
                               "numbers of a colour") &&
           cli_builder_face(builder, (uint32_t) corners, face);
}

bool cli_read_off(cli_builder *builder, bool uvs) {
    off o = {.builder = builder, .uvs = uvs};
    o.text = (cli_scan){builder->source, builder->error, builder->source->data, false};
    builder->mesh.format = "OFF";
    cli_scan_next_record(&o.text);
    if (!read_keyword(&o) ||
        !cli_source_text(builder->source, 0, "0123456789", builder->error) || !read_counts(&o) ||
        !cli_builder_begin(builder, SOFTSHADOW_F64, o.vertices, o.faces))
        return false;
    if (uvs && o.has_uvs && o.vertices > 0 &&
        !(builder->mesh.uvs = calloc(o.vertices, 2 * sizeof(float))))
        return cli_builder_no_memory(builder);
    for (uint64_t i = 0; i < o.vertices; i++)
        if (!cli_scan_next_record(&o.text)) return fail_end(&o, "vertex", i + 1, o.vertices);
        else if (!read_vertex(&o, i)) return false;
    for (uint64_t i = 0; i < o.faces; i++)
        if (!cli_scan_next_record(&o.text)) return fail_end(&o, "face", i + 1, o.faces);
        else if (!read_face(&o)) return false;
    if (cli_scan_next_record(&o.text))
        return cli_scan_fail_word(&o.text, "stands behind the last face that the counts announce");
    return true;
}
