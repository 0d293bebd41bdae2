/* The head of a PLY file: what its body is made of. Inside cli/mesh only. */
#ifndef CLI_MESH_PLY_H
#define CLI_MESH_PLY_H

#include "mesh/source.h"

enum { PLY_HEADER_LIMIT = 64 << 10, PLY_ELEMENTS = 64, PLY_PROPERTIES = 1024 };

typedef enum ply_type {
    PLY_NONE,
    PLY_INT8,
    PLY_UINT8,
    PLY_INT16,
    PLY_UINT16,
    PLY_INT32,
    PLY_UINT32,
    PLY_FLOAT32,
    PLY_FLOAT64
} ply_type;

typedef enum ply_format { PLY_ASCII, PLY_LITTLE, PLY_BIG } ply_format;

typedef struct ply_property {
    char name[32]; /* longer names are cut: none that is looked for is that long */
    ply_type type; /* of the value, or of a list's items */
    ply_type list; /* of a list's length; PLY_NONE: no list */
} ply_property;

typedef struct ply_element {
    char name[32];
    uint64_t count;
    unsigned first, properties; /* in ply_header.properties */
    const char *at;
} ply_element;

typedef struct ply_header {
    ply_format format;
    unsigned elements, properties;
    ply_element element[PLY_ELEMENTS];
    ply_property property[PLY_PROPERTIES];
    size_t size; /* bytes of the header: where the body begins */
} ply_header;

bool ply_read_header(ply_header *header, const cli_source *source, cli_error *error);

const ply_element *ply_find_element(const ply_header *header, const char *name);
/* Its number in the element; -1: there is none. */
int ply_find_property(const ply_header *header, const ply_element *element, const char *name);

unsigned ply_type_size(ply_type type);
static inline bool ply_type_is_float(ply_type type) { return type >= PLY_FLOAT32; }

#endif
