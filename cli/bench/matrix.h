/* The matrix: every method at every setting on every backend, and the peer, for a cell. */
#ifndef CLI_BENCH_MATRIX_H
#define CLI_BENCH_MATRIX_H

#include "../text_buffer.h"
#include "bench.h"

enum { MATRIX_WAYS = 256 };

/* A row: a method with a setting, measured. */
typedef struct matrix_way {
    char method[40], setting[16]; /* "penumbra-limit (propagated)", "1024" */
    const char *unit;             /* what the setting counts: texels, samples, rays, tolerance */
    const char *backend;          /* cpu, egl, embree */
    bool ours;
    double prepare; /* seconds, once for the meshes: what the next light does without */
    double build;   /* seconds, after the light moved */
    uint64_t bytes; /* held by what was built */
    bench_way way;  /* its time a point, its errors */
    /* Its time over the least of all others that err no more, and over the least of the library's
     * own; at most 1: it is on the front. 0: no other errs so little. */
    double behind, behind_ours;
    uint32_t ahead, ahead_ours; /* which row that other is */
} matrix_way;

typedef struct matrix_cell {
    const bench_cell *cell;
    const char *sweep; /* "" or what varies: triangles, points, light, threads */
    double value;      /* of what varies */
    double penumbra, truth_error;
    bool brute;
    uint32_t threads;
    bool wall; /* times are wall times */
    matrix_way ways[MATRIX_WAYS];
    uint32_t count;
} matrix_cell;

/* What is wanted of it. */
typedef struct matrix_request {
    uint64_t methods;     /* bit i: the library's method i; */
    bool peer;            /* and Embree */
    bool one_setting;     /* each method's usual one only */
    uint32_t texels;      /* which that is for maps; 0: 1024 */
    bool egl;             /* on the GPU, too, where there is one */
    bool wall;            /* wall time instead of processor time; no peer */
    const char *pictures; /* a folder for pictures of the errors, or NULL */
} matrix_request;

/* The methods and "peer" of a list between commas into wanted. */
bool matrix_choose(matrix_request *wanted, const char *name, size_t length, cli_error *error);

bool matrix_measure(matrix_cell *out, const bench_cell *cell, const bench_options *options,
                    const matrix_request *wanted, cli_error *error);

/* ---- rows.c */
typedef struct rows {
    cli_text csv, json;
    const char *csv_path, *json_path;
    uint32_t cells, must, beyond; /* of auto: rows that must be on the front; those behind it */
    uint32_t beyond_ours;         /* likewise among the library's methods */
    cli_text behind;              /* a line for each of these */
} rows;
/* Prints a cell's table, and writes the files anew. */
bool rows_add(rows *r, const matrix_cell *cell, cli_error *error);
/* Prints how auto stands to the front. */
void rows_conclude(const rows *r);
void rows_free(rows *r);

/* ---- sweep.c */
extern const char *const sweep_names[]; /* ends with NULL */
/* Cells that differ in one thing. scene: what is swept over, but for triangles. */
bool sweep_run(const char *name, const bench_scene *scene, const bench_options *options,
               const matrix_request *wanted, rows *into, cli_error *error);

/* ---- front.c */
/* Errors that matter: where auto must be on the front. */
#define FRONT_ERROR (1.0 / 64)
/* What two timings of the same work in turns differ by at most on a busy machine. */
#define FRONT_NOISE 1.1
void front_mark(matrix_cell *cell);
/* Whether a row is one that must be on the front: auto with a small enough error. */
bool front_must(const matrix_way *way);

/* ---- pictures.c */
typedef struct pictures pictures;
/* The truth of a cell whose truth is known at every point, then one way's errors at a time. */
bool pictures_open(pictures **out, const char *folder, const bench_cell *cell,
                   const bench_truth *truth, cli_error *error);
bool pictures_add(pictures *p, const matrix_way *way, const float *answer, cli_error *error);
void pictures_close(pictures *p);

#endif
