/* The head of a PLY file, line by line; it ends within 64 KiB.
 * based on: Turk 1994, "The PLY polygon file format". */
#include "mesh/ply.h"

#include <inttypes.h>
#include <string.h>

static const struct type_name {
    const char *name;
    ply_type type;
} type_names[] = {
    {"char", PLY_INT8},       {"int8", PLY_INT8},     {"uchar", PLY_UINT8},
    {"uint8", PLY_UINT8},     {"short", PLY_INT16},   {"int16", PLY_INT16},
    {"ushort", PLY_UINT16},   {"uint16", PLY_UINT16}, {"int", PLY_INT32},
    {"int32", PLY_INT32},     {"uint", PLY_UINT32},   {"uint32", PLY_UINT32},
    {"float", PLY_FLOAT32},   {"float32", PLY_FLOAT32}, {"double", PLY_FLOAT64},
    {"float64", PLY_FLOAT64},
};

unsigned ply_type_size(ply_type type) {
    static const unsigned char sizes[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};
    return sizes[type];
}

static bool read_word(cli_scan *text, char word[32], const char *missing) {
    cli_scan_blanks(text);
    const char *end = cli_scan_word_end(text);
    size_t length = (size_t) (end - text->at);
    if (length == 0) return cli_scan_fail_word(text, missing);
    if (length > 31) length = 31;
    memcpy(word, text->at, length);
    word[length] = 0;
    text->at = end;
    return true;
}

/* Names that were cut may differ in what was cut off. */
static bool is_whole(const char *name) { return strlen(name) < 31; }

static bool read_type(cli_scan *text, ply_type *type) {
    cli_scan_blanks(text);
    for (size_t i = 0; i < sizeof type_names / sizeof *type_names; i++)
        if (cli_scan_word_is(text, type_names[i].name)) {
            *type = type_names[i].type;
            text->at = cli_scan_word_end(text);
            return true;
        }
    return cli_scan_fail_word(text, "is no type of a property; char uchar short ushort int uint "
                                    "float double (and int8 .. float64) are allowed");
}

static bool read_format(ply_header *header, cli_scan *text) {
    static const char *const names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    cli_scan_blanks(text);
    int found = -1;
    for (int i = 0; i < 3; i++)
        if (cli_scan_word_is(text, names[i])) found = i;
    if (found < 0)
        return cli_scan_fail_word(text, "is no format; ascii, binary_little_endian and "
                                        "binary_big_endian are allowed");
    header->format = (ply_format) found;
    text->at = cli_scan_word_end(text);
    cli_scan_blanks(text);
    if (!cli_scan_word_is(text, "1.0")) return cli_scan_fail_word(text, "is no version; 1.0 is");
    text->at = cli_scan_word_end(text);
    return true;
}

static bool read_element(ply_header *header, cli_scan *text) {
    cli_scan_blanks(text);
    cli_scan before = *text;
    ply_element element = {.first = header->properties, .at = text->at};
    if (header->elements == PLY_ELEMENTS)
        return cli_scan_fail_word(text, "is an element too many; 64 are allowed");
    if (!read_word(text, element.name, "an element has a name and a count") ||
        !cli_scan_count(text, "count of an element", &element.count))
        return false;
    if (is_whole(element.name) && ply_find_element(header, element.name))
        return cli_scan_fail_word(&before, "is announced twice; elements have different names");
    header->element[header->elements++] = element;
    return true;
}

static bool read_property(ply_header *header, cli_scan *text) {
    ply_property property = {.list = PLY_NONE};
    cli_scan_blanks(text);
    if (header->elements == 0)
        return cli_scan_fail_word(text, "a property before any element; element must come first");
    if (header->properties == PLY_PROPERTIES)
        return cli_scan_fail_word(text, "is a property too many; 1024 are allowed");
    if (cli_scan_word_is(text, "list")) {
        text->at += 4;
        cli_scan_blanks(text);
        cli_scan before = *text;
        if (!read_type(text, &property.list)) return false;
        if (ply_type_is_float(property.list))
            return cli_scan_fail_word(&before, "is no type of a list's length; integers are");
    }
    if (!read_type(text, &property.type)) return false;
    cli_scan_blanks(text);
    cli_scan before = *text;
    if (!read_word(text, property.name, "a property has a type and a name")) return false;
    ply_element *element = &header->element[header->elements - 1];
    if (is_whole(property.name) && ply_find_property(header, element, property.name) >= 0)
        return cli_scan_fail_word(&before, "is a property of this element twice");
    header->property[header->properties++] = property;
    element->properties++;
    return true;
}

/* One line of the header; `*over` at the last. */
static bool read_line(ply_header *header, cli_scan *text, bool *has_format, bool *over) {
    char word[32];
    cli_scan before = *text;
    if (!read_word(text, word, "the header goes on until end_header")) return false;
    if (strcmp(word, "comment") == 0 || strcmp(word, "obj_info") == 0) {
        while (!cli_is_line_end(*text->at)) text->at++;
        return true;
    }
    if (strcmp(word, "format") == 0 && !*has_format) {
        *has_format = true;
        return read_format(header, text);
    }
    if (!*has_format)
        return cli_scan_fail_word(&before, "stands where 'format' must: behind ply");
    if (strcmp(word, "element") == 0) return read_element(header, text);
    if (strcmp(word, "property") == 0) return read_property(header, text);
    *over = strcmp(word, "end_header") == 0;
    return *over || cli_scan_fail_word(&before, "is no keyword of a header; element, property, "
                                                "comment, obj_info and end_header are allowed");
}

/* The line must end here, with a newline within the header's limit. */
static bool end_line(cli_scan *text) {
    cli_scan_blanks(text);
    if (*text->at == '\r' && text->at[1] == '\n') text->at++;
    if (*text->at == '\n') {
        text->at++;
        if ((size_t) (text->at - text->source->data) <= PLY_HEADER_LIMIT) return true;
        return cli_source_fail(text->source, text->at - 1, text->error,
                               "no end_header; it must come within 64 KiB");
    }
    if (*text->at == 0 && text->at == text->source->data + text->source->size)
        return cli_source_fail(text->source, text->at, text->error,
                               "the file ends in the header; end_header must close it");
    return cli_scan_fail_word(text, "is not allowed here; the line of the header is complete");
}

bool ply_read_header(ply_header *header, const cli_source *source, cli_error *error) {
    cli_scan text = {source, error, source->data, false};
    bool has_format = false, over = false;
    text.at += 3; /* ply: cli_mesh_read() has seen it */
    if (!end_line(&text)) return false;
    while (!over)
        if (!read_line(header, &text, &has_format, &over) || !end_line(&text)) return false;
    header->size = (size_t) (text.at - source->data);
    return true;
}

const ply_element *ply_find_element(const ply_header *header, const char *name) {
    for (unsigned i = 0; i < header->elements; i++)
        if (strcmp(header->element[i].name, name) == 0) return &header->element[i];
    return NULL;
}

int ply_find_property(const ply_header *header, const ply_element *element, const char *name) {
    for (unsigned i = 0; i < element->properties; i++)
        if (strcmp(header->property[element->first + i].name, name) == 0) return (int) i;
    return -1;
}
