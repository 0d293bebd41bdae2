/* What the files of `softshadow query` share: what was asked for, and the job it becomes. */
#ifndef CLI_QUERY_H
#define CLI_QUERY_H

#include "../build_options.h"
#include "../points/points.h"
#include "../scene.h"
#include "journal.h"
#include "sample.h"

typedef struct query_request {
    cli_build_options common;
    char **meshes;
    int mesh_count;
    const char *points, *output, *channels;
    uint32_t input_format, output_format; /* POINTS_NO_FORMAT: told by the name */
    bool no_normals, bounds, resume, sharded;
    uint64_t shard, shards;
} query_request;

/* Reads, asks, writes. */
bool query_run(query_request *request, cli_error *error);

/* Where the answers go. */
typedef struct query_target {
    points_format format;
    cli_output output;
    bool placed;     /* records of equal size, in the middle of a file */
    char *path;      /* of the file that is written or made; NULL: stdout */
    char *part_path; /* placed, and whole only at the end: written here, then renamed */
    uint64_t header; /* placed: bytes before the first record */
    query_journal journal;
} query_target;

/* The range of points to do, and how many there are. */
typedef struct query_range {
    uint64_t first, last, total; /* last and total: POINTS_UNKNOWN when they are */
} query_range;

/* Format and manner of the output; nothing is opened yet. */
bool query_target_choose(query_target *target, const query_request *request,
                         const points_source *source, cli_error *error);
/* Opens it. With --resume range->first moves past what is there already; *whole: all is. */
bool query_target_open(query_target *target, const query_request *request, query_range *range,
                       uint32_t columns, bool *whole, cli_error *error);
bool query_target_commit(query_target *target, cli_error *error);
void query_target_free(query_target *target);

#endif
