/* PLY: the body, as text or bytes of either order. Elements come in any order; those that are
 * neither vertex nor face are passed over, by their types.
 * based on: Turk 1994, "The PLY polygon file format". In text every record has a line of its own:
 * a number too few or too many is seen in that line and cannot shift what follows. */
#include "mesh/ply.h"

#include "mesh/bytes.h"
#include "mesh/readers.h"
#include "number.h"
#include "softshadow.h"

#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct ply {
    cli_builder *builder;
    const cli_source *source;
    cli_error *error;
    ply_header header;
    cli_scan text;  /* the place in an ascii body */
    size_t at, end; /* the place in a binary body */
    bool big;
    const ply_element *vertex, *face;
    int position[3], uv[2], corners; /* properties' numbers */
    uint64_t record;                 /* of the element being read, from 0 */
    size_t vertex_number;
} ply;

static bool is_text(const ply *p) { return p->header.format == PLY_ASCII; }

static const ply_property *property_of(const ply *p, const ply_element *element, unsigned i) {
    return &p->header.property[element->first + i];
}

/* ---- What the header promises -----------------------------------------------------------------*/

static bool fail_header(const ply *p, const ply_element *element, const char *problem) {
    return cli_source_fail(p->source, element ? element->at : p->source->data, p->error, "%s",
                           problem);
}

static bool find_vertex(ply *p, bool uvs) {
    static const char *const names[] = {"x", "y", "z"};
    static const char *const pairs[][2] = {{"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}};
    p->vertex = ply_find_element(&p->header, "vertex");
    if (!p->vertex) return fail_header(p, NULL, "no element vertex in the header; a mesh has one");
    for (int k = 0; k < 3; k++) {
        p->position[k] = ply_find_property(&p->header, p->vertex, names[k]);
        if (p->position[k] < 0 || property_of(p, p->vertex, (unsigned) p->position[k])->list)
            return fail_header(p, p->vertex, "element vertex must have properties x, y and z that "
                                             "are no lists");
    }
    p->uv[0] = p->uv[1] = -1;
    for (int i = 0; uvs && i < 3; i++) {
        int u = ply_find_property(&p->header, p->vertex, pairs[i][0]);
        int v = ply_find_property(&p->header, p->vertex, pairs[i][1]);
        if (u < 0 || v < 0 || property_of(p, p->vertex, (unsigned) u)->list ||
            property_of(p, p->vertex, (unsigned) v)->list)
            continue;
        p->uv[0] = u;
        p->uv[1] = v;
        break;
    }
    return true;
}

static bool find_face(ply *p) {
    p->face = ply_find_element(&p->header, "face");
    if (!p->face || p->face->count == 0)
        return fail_header(p, p->face, "no faces in the header; a mesh has at least one");
    p->corners = ply_find_property(&p->header, p->face, "vertex_indices");
    if (p->corners < 0) p->corners = ply_find_property(&p->header, p->face, "vertex_index");
    if (p->corners >= 0) {
        const ply_property *list = property_of(p, p->face, (unsigned) p->corners);
        if (list->list && !ply_type_is_float(list->type)) return true;
    }
    return fail_header(p, p->face,
                       "element face must have a list of integers vertex_indices or vertex_index");
}

/* The least that a record takes: in text a digit and a blank or newline for each number. */
static uint64_t least_size(const ply *p, const ply_element *element) {
    uint64_t size = 0;
    for (unsigned i = 0; i < element->properties; i++) {
        const ply_property *property = property_of(p, element, i);
        unsigned items = element == p->face && (int) i == p->corners ? 3 : !property->list;
        if (is_text(p))
            size += 2 * (items + (property->list != PLY_NONE));
        else
            size += ply_type_size(property->list) + items * ply_type_size(property->type);
    }
    return size;
}

/* Counts against the file's size, before anything is allocated for them. */
static bool check_counts(const ply *p) {
    /* The last line of a text needs no newline. */
    uint64_t left = p->source->size - p->header.size + is_text(p);
    for (unsigned i = 0; i < p->header.elements; i++) {
        const ply_element *element = &p->header.element[i];
        uint64_t least = least_size(p, element), needed;
        if (least == 0 && element->count > 0)
            return fail_header(p, element, "an element without properties; records need some");
        if (__builtin_mul_overflow(least, element->count, &needed) || needed > left)
            return cli_source_fail(p->source, element->at, p->error,
                                   "%" PRIu64 " records %s are announced, of at least %" PRIu64
                                   " bytes each; the file has %" PRIu64 " bytes for them",
                                   element->count, element->name, least, left);
        left -= needed;
    }
    return true;
}

/* ---- Records as text --------------------------------------------------------------------------*/

static bool text_value(ply *p, const ply_property *property, double *value) {
    if (ply_type_is_float(property->type)) {
        float single;
        if (property->type == PLY_FLOAT64) return cli_scan_double(&p->text, property->name, value);
        if (!cli_scan_float(&p->text, property->name, &single)) return false;
        *value = single;
        return true;
    }
    static const double low[] = {0, -0x1p7, 0, -0x1p15, 0, -0x1p31, 0};
    static const double high[] = {0, 0x1p7, 0x1p8, 0x1p15, 0x1p16, 0x1p31, 0x1p32};
    cli_scan_blanks(&p->text);
    cli_scan before = p->text;
    if (!cli_scan_double(&p->text, property->name, value)) return false;
    if (*value >= low[property->type] && *value < high[property->type] && *value == floor(*value))
        return true;
    return cli_scan_fail_word(&before, "is no value of the integer type that the header gives");
}

static bool text_skip(ply *p, uint64_t items) {
    for (uint64_t i = 0; i < items; i++) {
        cli_scan_blanks(&p->text);
        if (cli_is_line_end(*p->text.at))
            return cli_scan_fail_word(&p->text, "numbers are missing in this record");
        p->text.at = cli_scan_word_end(&p->text);
    }
    return true;
}

/* ---- Records as bytes -------------------------------------------------------------------------*/

static bool fail_record(const ply *p, const ply_element *element, const char *problem) {
    return cli_source_fail_byte(p->source, p->at, p->error, "%s %" PRIu64 " of %" PRIu64 ": %s",
                                element->name, p->record + 1, element->count, problem);
}

static bool bytes_left(const ply *p, const ply_element *element, uint64_t items, unsigned size) {
    if (items <= (p->end - p->at) / size) return true;
    return fail_record(p, element, "the file ends in it");
}

static double bytes_value(const ply *p, ply_type type, size_t at) {
    const char *bytes = p->source->data + at;
    switch (type) {
    case PLY_FLOAT32: return cli_bytes_float(bytes, p->big);
    case PLY_FLOAT64: return cli_bytes_double(bytes, p->big);
    case PLY_INT8:
    case PLY_INT16:
    case PLY_INT32: return (double) cli_bytes_signed(bytes, ply_type_size(type), p->big);
    default: return (double) cli_bytes_unsigned(bytes, ply_type_size(type), p->big);
    }
}

/* ---- Either -----------------------------------------------------------------------------------*/

/* One number; in text anything that is not wanted need not be one. */
static bool read_value(ply *p, const ply_element *element, const ply_property *property,
                       double *value) {
    if (is_text(p)) return text_value(p, property, value);
    unsigned size = ply_type_size(property->type);
    if (!bytes_left(p, element, 1, size)) return false;
    *value = bytes_value(p, property->type, p->at);
    p->at += size;
    return true;
}

static bool skip_values(ply *p, const ply_element *element, ply_type type, uint64_t items) {
    if (is_text(p)) return text_skip(p, items);
    if (!bytes_left(p, element, items, ply_type_size(type))) return false;
    p->at += items * ply_type_size(type);
    return true;
}

static bool read_length(ply *p, const ply_element *element, const ply_property *property,
                        uint64_t *length) {
    ply_property count = {.name = "the length of a list", .type = property->list};
    double value;
    size_t begin = p->at;
    const char *text = p->text.at;
    if (!read_value(p, element, &count, &value)) return false;
    *length = value > 0 ? (uint64_t) value : 0;
    if (value >= 0) return true;
    p->at = begin;
    p->text.at = text;
    if (!is_text(p)) return fail_record(p, element, "the length of a list is negative");
    cli_scan_blanks(&p->text);
    return cli_scan_fail_word(&p->text, "is no length of a list; it must not be negative");
}

static bool skip_property(ply *p, const ply_element *element, const ply_property *property) {
    uint64_t items = 1;
    if (property->list && !read_length(p, element, property, &items)) return false;
    return skip_values(p, element, property->type, items);
}

static bool check_wanted(ply *p, const ply_property *property, double value, double limit,
                         size_t begin, cli_scan before) {
    if (fabs(value) <= limit) return true;
    char problem[120];
    if (is_text(p)) {
        snprintf(problem, sizeof problem, "is too large; %s must be within +-%g", property->name,
                 limit);
        return cli_scan_fail_word(&before, problem);
    }
    snprintf(problem, sizeof problem, "%s is %g; it must be finite and within +-%g", property->name,
             value, limit);
    p->at = begin;
    return fail_record(p, p->vertex, problem);
}

static bool read_vertex(ply *p) {
    double position[3] = {0, 0, 0}, uv[2] = {0, 0};
    for (unsigned i = 0; i < p->vertex->properties; i++) {
        const ply_property *property = property_of(p, p->vertex, i);
        double *wanted = NULL, limit = 1e15;
        for (int k = 0; k < 3; k++)
            if (p->position[k] == (int) i) wanted = &position[k];
        for (int k = 0; k < 2; k++)
            if (p->uv[k] == (int) i) wanted = &uv[k], limit = FLT_MAX;
        if (!wanted) {
            if (!skip_property(p, p->vertex, property)) return false;
            continue;
        }
        cli_scan_blanks(&p->text);
        cli_scan before = p->text;
        size_t begin = p->at;
        if (!read_value(p, p->vertex, property, wanted) ||
            !check_wanted(p, property, *wanted, limit, begin, before))
            return false;
    }
    if (p->builder->mesh.uvs) {
        float *to = p->builder->mesh.uvs + 2 * p->builder->mesh.vertex_count;
        to[0] = (float) uv[0];
        to[1] = (float) uv[1];
    }
    return cli_builder_vertex(p->builder, position);
}

static bool fail_corner(ply *p, size_t begin, cli_scan before, double value) {
    char problem[120];
    snprintf(problem, sizeof problem,
             "vertex %.0f (counted from 0) is named, but the file has %" PRIu64, value,
             p->vertex->count);
    if (is_text(p)) return cli_source_fail(p->source, before.at, p->error, "%s", problem);
    p->at = begin;
    return fail_record(p, p->face, problem);
}

static bool read_corners(ply *p, const ply_property *property, uint32_t *corners) {
    uint64_t length;
    cli_scan_blanks(&p->text);
    const char *at = p->text.at;
    if (!read_length(p, p->face, property, &length)) return false;
    if (length < 3 || length > CLI_POLYGON_CORNERS) {
        if (is_text(p))
            return cli_source_fail(p->source, at, p->error,
                                   "a face of %" PRIu64 " corners; 3 to 65536 are allowed", length);
        return fail_record(p, p->face, length < 3 ? "fewer than 3 corners; 3 to 65536 are allowed"
                                                  : "more corners than the 65536 allowed");
    }
    if (!cli_builder_face_room(p->builder, length)) return false;
    for (uint64_t i = 0; i < length; i++) {
        double value;
        cli_scan_blanks(&p->text);
        cli_scan before = p->text;
        size_t begin = p->at;
        if (!read_value(p, p->face, property, &value)) return false;
        if (!(value >= 0 && value < (double) p->vertex->count))
            return fail_corner(p, begin, before, value);
        p->builder->face[i] = (uint32_t) value;
    }
    *corners = (uint32_t) length;
    return true;
}

static bool read_face(ply *p) {
    uint32_t corners = 0;
    const char *at = is_text(p) ? p->text.at : p->source->data + p->at;
    for (unsigned i = 0; i < p->face->properties; i++) {
        const ply_property *property = property_of(p, p->face, i);
        if ((int) i == p->corners ? !read_corners(p, property, &corners)
                                  : !skip_property(p, p->face, property))
            return false;
    }
    return cli_builder_face(p->builder, corners, at);
}

static bool skip_record(ply *p, const ply_element *element) {
    for (unsigned i = 0; i < element->properties; i++)
        if (!skip_property(p, element, property_of(p, element, i))) return false;
    return true;
}

/* To the next line with something on it; PLY has no comments in its body. */
static bool begin_line(ply *p, const ply_element *element) {
    while (cli_scan_blanks(&p->text), *p->text.at && cli_is_line_end(*p->text.at))
        cli_scan_next_line(&p->text);
    if (*p->text.at) return true;
    return cli_source_fail(p->source, p->text.at, p->error,
                           "the file ends before %s %" PRIu64 " of %" PRIu64, element->name,
                           p->record + 1, element->count);
}

static bool end_line(ply *p) {
    cli_scan_blanks(&p->text);
    if (!cli_is_line_end(*p->text.at))
        return cli_scan_fail_word(&p->text, "is one too many; the record is complete");
    cli_scan_next_line(&p->text);
    return true;
}

static bool read_element(ply *p, const ply_element *element) {
    for (p->record = 0; p->record < element->count; p->record++) {
        if (is_text(p) && !begin_line(p, element)) return false;
        bool ok = element == p->vertex ? read_vertex(p)
                  : element == p->face ? read_face(p)
                                       : skip_record(p, element);
        if (!ok || (is_text(p) && !end_line(p))) return false;
    }
    return true;
}

static bool check_end(ply *p) {
    if (!is_text(p)) {
        if (p->at == p->end) return true;
        return cli_source_fail_byte(p->source, p->at, p->error,
                                    "%zu bytes follow the last record that the header announces; "
                                    "none may", p->end - p->at);
    }
    while (cli_scan_blanks(&p->text), *p->text.at && cli_is_line_end(*p->text.at))
        cli_scan_next_line(&p->text);
    if (!*p->text.at) return true;
    return cli_scan_fail_word(&p->text, "stands behind the last record that the header announces");
}

/* What fits a float exactly is kept as one. */
static uint32_t position_type(const ply *p) {
    for (int k = 0; k < 3; k++) {
        ply_type type = property_of(p, p->vertex, (unsigned) p->position[k])->type;
        if (type == PLY_FLOAT64 || type == PLY_INT32 || type == PLY_UINT32) return SOFTSHADOW_F64;
    }
    return SOFTSHADOW_F32;
}

static bool begin_body(ply *p) {
    cli_builder *builder = p->builder;
    p->big = p->header.format == PLY_BIG;
    p->at = p->header.size;
    p->end = p->source->size;
    p->text = (cli_scan){p->source, p->error, p->source->data + p->at, false};
    builder->mesh.format = is_text(p) ? "ascii PLY" : "binary PLY";
    if (is_text(p) && !cli_source_text(p->source, p->at, "0123456789", p->error)) return false;
    if (!cli_builder_begin(builder, position_type(p), p->vertex->count, p->face->count))
        return false;
    if (p->uv[0] >= 0 && p->vertex->count > 0 &&
        !(builder->mesh.uvs = calloc(p->vertex->count, 2 * sizeof(float))))
        return cli_builder_no_memory(builder);
    return true;
}

static bool read_body(ply *p) {
    if (!begin_body(p)) return false;
    for (unsigned i = 0; i < p->header.elements; i++)
        if (!read_element(p, &p->header.element[i])) return false;
    return check_end(p);
}

bool cli_read_ply(cli_builder *builder, bool uvs) {
    ply *p = calloc(1, sizeof *p);
    if (!p) return cli_builder_no_memory(builder);
    p->builder = builder;
    p->source = builder->source;
    p->error = builder->error;
    bool ok = ply_read_header(&p->header, p->source, p->error) && find_vertex(p, uvs) &&
              find_face(p) && check_counts(p) && read_body(p);
    free(p);
    return ok;
}
