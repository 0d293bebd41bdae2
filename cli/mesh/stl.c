/* STL: loose triangles, as text or as records of 50 bytes.
 * based on: 3D Systems, "Stereolithography Interface Specification", 1989.
 *
 * Every triangle keeps three vertices of its own, as in the file; the library joins those in one
 * place. Normals are not read (they are often zero or nan, and follow from the corners), nor are
 * the two spare bytes of a binary record. */
#include "mesh/bytes.h"
#include "mesh/readers.h"

#include "softshadow.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { HEAD = 84, RECORD = 50 };

/* ---- Binary -----------------------------------------------------------------------------------*/

static uint64_t announced(const cli_source *source) {
    return cli_bytes_unsigned(source->data + 80, 4, false);
}

bool cli_stl_is_binary(const cli_source *source) {
    return source->size >= HEAD && source->size == HEAD + RECORD * announced(source);
}

static bool check_size(const cli_source *source, cli_error *error) {
    if (source->size < HEAD)
        return cli_source_fail_byte(source, source->size, error,
                                    "the file ends; a binary STL has at least 84 bytes (and an "
                                    "ascii one begins with solid)");
    if (cli_stl_is_binary(source)) return true;
    return cli_source_fail_byte(source, 80, error,
                                "%" PRIu64 " triangles are announced, which take %" PRIu64
                                " bytes, but the file has %zu",
                                announced(source), HEAD + RECORD * announced(source), source->size);
}

bool cli_read_stl_binary(cli_builder *builder) {
    const cli_source *source = builder->source;
    builder->mesh.format = "binary STL";
    if (!check_size(source, builder->error)) return false;
    size_t count = announced(source);
    if (count > (UINT32_MAX - 1) / 3)
        return cli_source_fail_byte(source, 80, builder->error,
                                    "%zu triangles; at most %u fit 32-bit indices", count,
                                    (UINT32_MAX - 1) / 3);
    if (!cli_builder_begin(builder, SOFTSHADOW_F32, 3 * count, count) ||
        !cli_builder_face_room(builder, 3))
        return false;
    for (size_t i = 0; i < count; i++) {
        size_t record = HEAD + RECORD * i;
        for (int corner = 0; corner < 3; corner++) {
            double position[3];
            for (int k = 0; k < 3; k++) {
                size_t at = record + 12 + 12 * (size_t) corner + 4 * (size_t) k;
                position[k] = cli_bytes_float(source->data + at, false);
                if (!(fabs(position[k]) <= 1e15))
                    return cli_source_fail_byte(source, at, builder->error,
                                                "%c of corner %d of triangle %zu is %g; it must be "
                                                "finite and within +-1e15",
                                                "xyz"[k], corner + 1, i + 1, position[k]);
            }
            builder->face[corner] = (uint32_t) builder->mesh.vertex_count;
            if (!cli_builder_vertex(builder, position)) return false;
        }
        if (!cli_builder_face(builder, 3, NULL)) return false;
    }
    return true;
}

/* ---- Text -------------------------------------------------------------------------------------*/

static bool is_word(const cli_scan *text, const char *word) {
    size_t length = strlen(word);
    return (size_t) (cli_scan_word_end(text) - text->at) == length &&
           strncasecmp(text->at, word, length) == 0;
}

/* To the next word, on this line or a later one; false at the end of the file. */
static bool peek(cli_scan *text) {
    while (cli_scan_blanks(text), *text->at && cli_is_line_end(*text->at)) cli_scan_next_line(text);
    return *text->at != 0;
}

/* The next word must be this one; capitals will do. */
static bool expect(cli_scan *text, const char *word) {
    char problem[64];
    snprintf(problem, sizeof problem, "stands where '%s' must", word);
    peek(text);
    if (!is_word(text, word)) return cli_scan_fail_word(text, problem);
    text->at = cli_scan_word_end(text);
    return true;
}

static bool skip_normal(cli_scan *text) {
    if (!expect(text, "normal")) return false;
    for (int k = 0; k < 3; k++) {
        cli_scan_blanks(text);
        if (cli_is_line_end(*text->at)) return cli_scan_fail_word(text, "a normal has 3 numbers");
        text->at = cli_scan_word_end(text);
    }
    cli_scan_blanks(text);
    return cli_is_line_end(*text->at) || is_word(text, "outer") ||
           cli_scan_fail_word(text, "stands behind a normal; it has 3 numbers");
}

static bool read_facet(cli_builder *builder, cli_scan *text) {
    static const char *const names[] = {"x", "y", "z"};
    const char *begin = text->at;
    if (!expect(text, "facet") || !skip_normal(text) || !expect(text, "outer") ||
        !expect(text, "loop"))
        return false;
    for (int corner = 0; corner < 3; corner++) {
        double position[3];
        if (!expect(text, "vertex")) return false;
        for (int k = 0; k < 3; k++)
            if (!cli_scan_coordinate(text, names[k], &position[k])) return false;
        builder->face[corner] = (uint32_t) builder->mesh.vertex_count;
        if (!cli_builder_vertex(builder, position)) return false;
    }
    return expect(text, "endloop") && expect(text, "endfacet") &&
           cli_builder_face(builder, 3, begin);
}

/* solid NAME facets endsolid NAME; names are the rest of their line. */
static bool read_solid(cli_builder *builder, cli_scan *text) {
    if (!expect(text, "solid")) return false;
    cli_scan_next_line(text);
    for (;;) {
        if (!peek(text)) return cli_scan_fail_word(text, "'facet' or 'endsolid' must follow");
        if (is_word(text, "endsolid")) break;
        if (!read_facet(builder, text)) return false;
    }
    cli_scan_next_line(text);
    return true;
}

bool cli_read_stl_text(cli_builder *builder) {
    const cli_source *source = builder->source;
    cli_scan text = {source, builder->error, source->data, false};
    builder->mesh.format = "ascii STL";
    if (!cli_source_text(source, 0, "", builder->error) ||
        !cli_builder_begin(builder, SOFTSHADOW_F64, 0, 0) || !cli_builder_face_room(builder, 3))
        return false;
    while (peek(&text))
        if (!read_solid(builder, &text)) return false;
    return true;
}
