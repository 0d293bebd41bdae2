/* The bench: the library and the peer side by side, as ratios of time at equal error. Inside
 * cli/bench only. */
#ifndef CLI_BENCH_BENCH_H
#define CLI_BENCH_BENCH_H

#include "peer.h"
#include "scenes.h"

enum { BENCH_TOLERANCES = 8, BENCH_COUNTS = 9, BENCH_REPEATS = 32 };

typedef struct bench_options {
    double tolerances[BENCH_TOLERANCES];
    uint32_t tolerance_count;
    uint32_t repeat;       /* times each side is timed, in turns; the median counts */
    uint32_t threads;      /* of the library; times are processor time, or wall time if not 1 */
    uint32_t side;         /* of the camera's picture, in pixels */
    uint32_t truth_points; /* of those asked, that the truth is known for */
    uint32_t truth_samples;
    bool primitives, automatic;
    uint32_t rays; /* a point, for bench_rays(); 0: the rest of the bench */
    bool quick;
} bench_options;

/* One way to ask, measured. Errors are root mean squares against the truth. */
typedef struct bench_way {
    char name[24];  /* "exact 512" */
    double seconds; /* a point */
    double penumbra_rms, rms, max, p99, bias;
    double same; /* share of points that no 8-bit picture tells from the truth: within 1/512 */
} bench_way;

/* A scene, a light, a set of points. */
typedef struct bench_cell {
    const bench_scene *scene;
    const char *light_name, *points_name;
    softshadow_light light;
    bench_points points;
} bench_cell;

typedef enum bench_reached {
    BENCH_BETWEEN, /* two counts */
    BENCH_LEAST,   /* its cheapest way is better than asked: that one's time */
    BENCH_BEYOND,  /* at most at half the error of its best way: the last two ways' line goes on */
    BENCH_NOT
} bench_reached;

typedef struct bench_at {
    double ours, peer; /* seconds a point; NAN: far from reached */
    bench_reached ours_is, peer_is;
    double automatic; /* likewise for the method "auto" asked for this tolerance */
    bench_way automatic_way;
} bench_at;

typedef struct bench_result {
    double penumbra, lit; /* shares of the truth's points */
    double truth_error;   /* of the truth itself, from its two halves, over penumbrae */
    bench_way ours[BENCH_COUNTS], fixed[BENCH_COUNTS], rim[BENCH_COUNTS];
    uint32_t ours_count, fixed_count, rim_count;
    peer_style style; /* flag and order that were faster */
    bench_at at[BENCH_TOLERANCES];
    double ours_build, peer_build; /* seconds, the first time */
    /* Seconds a point that is wholly lit: exact at 512, auto at 1/256 (0: not asked), the peer. */
    double ours_lit, automatic_lit, peer_lit;
    double settled; /* share of points that the library answers before it draws anything */
    double scaling; /* of options->threads over one, in wall time; 0: not measured */
    bool brute;     /* the truth's kind */
} bench_result;

/* ---- truth.c */
typedef struct bench_truth {
    uint32_t *index; /* into the cell's points */
    float (*at)[3];
    float *value;
    double *apart; /* room for the errors of a way */
    size_t count, penumbrae;
    double error;
    bool brute; /* found in double, without Embree */
} bench_truth;

/* A random subset of the points, each with so many samples of a sequence neither side uses. */
bool bench_truth_find(bench_truth *truth, const bench_cell *cell, const bench_options *options,
                      cli_error *error);
void bench_truth_free(bench_truth *truth);
/* Fills the errors of a way; value[i] is the answer for truth point i. */
void bench_truth_judge(const bench_truth *truth, const float *value, bench_way *way);

/* ---- measure.c */
/* A handle with the cell's mesh and light; the caller's even on an error, to be destroyed. */
bool bench_open(const bench_cell *cell, uint32_t threads, softshadow **handle, cli_error *error);
/* Sorts the values. */
double bench_median(double *values, uint32_t count);
bool bench_measure(const bench_cell *cell, const bench_options *options, bench_result *result,
                   cli_error *error);
/* The seconds a point at which a side reaches an error, between its counts as straight lines of
 * logarithms; NAN where it does not. */
double bench_reach(const bench_way *ways, uint32_t count, double tolerance, bench_reached *how);
/* The radius of the light at which a quarter of the camera's points are in penumbra. */
bool bench_calibrate(const bench_cell *cell, const bench_options *options, double *radius,
                     double *share, cli_error *error);

/* ---- rays.c */
/* "raytrace" against the peer at equal rays: prints the ratios. */
bool bench_rays(const bench_cell *cell, const bench_options *options, cli_error *error);

#endif
