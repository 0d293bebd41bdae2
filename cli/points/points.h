/* Points as streams: a source hands out blocks, a sink takes them with what was answered.
 *
 * A block never waits for points that are not there yet: it ends when POINTS_BLOCK are read, or
 * when some are and the next would have to be waited for. What a source kept of its records (other
 * columns, comments, properties) travels in the block, so that a sink of the same kind gives it
 * back. */
#ifndef CLI_POINTS_H
#define CLI_POINTS_H

#include <softshadow.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "../input.h"
#include "../output.h"
#include "../text_buffer.h"

typedef enum points_format {
    POINTS_TEXT,
    POINTS_PLY,
    POINTS_NPY,
    POINTS_RAW,  /* float32, little endian: x y z */
    POINTS_RAW6, /* x y z nx ny nz */
    POINTS_IMAGE,
    POINTS_NO_FORMAT
} points_format;

enum { POINTS_BLOCK = 262144, POINTS_CARRY = 32 << 20 };
#define POINTS_UNKNOWN UINT64_MAX

typedef struct points_block {
    size_t count, room;
    uint32_t type;    /* SOFTSHADOW_F32 or _F64 */
    void *positions;  /* count x 3 */
    float *normals;   /* count x 3, or NULL */
    uint32_t width;   /* of an image, else 0 */
    cli_text carried; /* records as they were */
    size_t *ends;     /* lines: where record i ends in carried, */
    size_t *cuts;     /* and where its data ends; NULL: records of equal size */
} points_block;

typedef struct points_source points_source;

typedef struct points_reader {
    bool (*open)(points_source *source, cli_error *error);
    /* Adds up to most points to an empty block, waiting for the first; sets ended at the end. */
    bool (*read)(points_source *source, points_block *block, size_t most, cli_error *error);
    /* Continues at that point; regular files only. */
    bool (*seek)(points_source *source, uint64_t first, cli_error *error);
    /* Fills count of a regular file, where open() did not; NULL: it did. */
    bool (*tally)(points_source *source, cli_error *error);
    void (*close)(points_source *source);
    bool (*big_endian)(const points_source *source); /* its carried records; NULL: no */
} points_reader;

struct points_source {
    const points_reader *reader;
    points_format format;
    cli_input input;
    const char *path;     /* as given */
    const char *channels; /* images: which hold positions, or NULL */
    uint32_t type;
    bool normals;      /* the file has them */
    uint64_t count;    /* POINTS_UNKNOWN: to be seen */
    uint64_t given;    /* so far */
    bool ended;        /* nothing comes any more */
    uint64_t line;     /* of text: the last one read */
    cli_text header;   /* text, PLY: up to the first record */
    size_t header_cut; /* where further names or properties belong */
    char separator;    /* text: ' ' for any blanks */
    bool lines;        /* blocks carry lines, not records of equal size */
    size_t record;     /* bytes of such a record */
    void *state;       /* the reader's own */
};

/* "csv", "ply" ...: what --input-format and --output-format take, in the order of points_format. */
extern const char *const points_format_names[];
/* By the end of a name; POINTS_NO_FORMAT for one that tells nothing. */
points_format points_format_of(const char *path);

/* format POINTS_NO_FORMAT: told by the name; "-" is text then. */
bool points_source_open(points_source *source, const char *path, points_format format,
                        const char *channels, cli_error *error);
bool points_source_read(points_source *source, points_block *block, size_t most, cli_error *error);
bool points_source_seek(points_source *source, uint64_t first, cli_error *error);
bool points_source_tally(points_source *source, cli_error *error);
void points_source_close(points_source *source);

/* Room for that many points, and their records, in a block of the source's kind. */
bool points_block_reserve(points_block *block, const points_source *source, size_t count,
                          cli_error *error);
void points_block_free(points_block *block);

extern const points_reader points_text_reader, points_ply_reader, points_npy_reader,
    points_raw_reader, points_image_reader;

/* ---- Sinks --------------------------------------------------------------------------------- */

typedef struct points_sink {
    points_format format;
    points_source *source;
    cli_output *output;
    uint32_t lights;
    bool bounds;    /* a column of error bounds for each light, after all visibilities */
    bool commas;    /* text that was none before: CSV, else blanks */
    bool part;      /* a shard: what follows the points is left out */
    bool placed;    /* records go into a file whose header is there already */
    uint64_t count; /* how many will come, or POINTS_UNKNOWN */
    uint64_t written;
    cli_text scratch;
    float *kept; /* images: all values, column after column */
} points_sink;

/* Whether the sink can do it at all: asked before any work. */
bool points_sink_check(const points_sink *sink, cli_error *error);
bool points_sink_begin(points_sink *sink, cli_error *error);
/* columns: lights (or 2 x lights with bounds) arrays of block->count floats. */
bool points_sink_write(points_sink *sink, const points_block *block, float *const *columns,
                       cli_error *error);
bool points_sink_end(points_sink *sink, cli_error *error);
void points_sink_free(points_sink *sink);

static inline uint32_t points_sink_columns(const points_sink *sink) {
    return sink->lights * (sink->bounds ? 2 : 1);
}
/* "visibility", "visibility_1", "error_bound" ... */
const char *points_sink_column_name(const points_sink *sink, uint32_t column, char name[32]);
/* The header that an NPY file of count x columns has: always POINTS_NPY_HEADER bytes. */
enum { POINTS_NPY_HEADER = 128 };
void points_npy_header(char header[POINTS_NPY_HEADER], uint64_t count, uint32_t columns);

bool points_ply_begin(points_sink *sink, cli_error *error);
bool points_ply_write(points_sink *sink, const points_block *block, float *const *columns,
                      cli_error *error);
bool points_ply_end(points_sink *sink, cli_error *error);
/* For sinks: the part of a PLY file behind its vertices, a piece at a time; *size 0 at the end. */
bool points_ply_rest(points_source *source, const char **data, size_t *size, cli_error *error);
bool points_image_end(points_sink *sink, cli_error *error);

/* Little-endian numbers of records. */
float points_le_float(const void *from);
double points_le_double(const void *from);
void points_put_le_float(void *to, float value);
void points_put_le_double(void *to, double value);

#endif
