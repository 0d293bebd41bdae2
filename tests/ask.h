/* What every test of the library's answers does: hand it a scene, ask, compare. Uses the installed
 * header only, so that what is tested is what a host sees. */
#ifndef TESTS_ASK_H
#define TESTS_ASK_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* After the others: it uses their types. */
#include <cmocka.h>

#include "scenes.h"

#define COUNT(array) (sizeof(array) / sizeof *(array))
#define CHECK(condition, ...)                                                                      \
    do {                                                                                           \
        if (!(condition)) {                                                                        \
            print_error("%s:%d: %s: ", __FILE__, __LINE__, #condition);                            \
            print_error(__VA_ARGS__);                                                              \
            print_error("\n");                                                                     \
            fail();                                                                                \
        }                                                                                          \
    } while (0)
/* A call on `handle` that has to succeed. */
#define OK(handle, call)                                                                           \
    do {                                                                                           \
        const softshadow_status ok_ = (call);                                                      \
        CHECK(ok_ == SOFTSHADOW_OK, "%s: %s", softshadow_status_name(ok_),                         \
              softshadow_last_message(handle));                                                    \
    } while (0)

/* ---- The methods there are ------------------------------------------------------------------*/

/* Every method the library lists; a test runs once for each. */
const softshadow_method *ask_methods(size_t *count);
bool ask_certified(const char *method);  /* truth within error_bound, always */
bool ask_noise_free(const char *method); /* "exact", and whatever is certified */
bool ask_auto(const char *method);       /* answers may differ with the batch, within tolerance */
/* Noise-free, statistical or auto: claims the truth. Map methods do not. */
bool ask_truthful(const char *method);

typedef struct ask_test {
    const char *name;
    void (*run)(void **state); /* *state: the method's name */
    bool (*wanted)(const char *method);
} ask_test;
/* One cmocka group: each test with each method that it wants (wanted NULL: all). */
int ask_run(const char *group, const ask_test *tests, size_t count);

/* ---- One question ---------------------------------------------------------------------------*/

typedef struct ask {
    const char *method;
    const scene_mesh *mesh; /* added as F64; NULL or empty: a scene without casters */
    softshadow_light light;
    softshadow_build build; /* method is filled in */
    softshadow_options options;
    const double (*points)[3];
    size_t count;
    const float (*normals)[3];
    const uint64_t *primitives;
    float *visibility, *bound; /* allocated by ask_do(); bound: see softshadow_points */
    bool unbounded;             /* bounds are not asked for */
    softshadow_stats stats;
} ask;

/* How far the truth may be from answer i: its bound; without one 1/64, the most that a noise-free
 * method may be off by. */
double ask_claim(const ask *question, size_t i);

/* Defaults, and `samples` light samples (0: what the tolerance needs). */
ask ask_new(const char *method, const scene_mesh *mesh, softshadow_light light,
            const double (*points)[3], size_t count, uint32_t samples);
void ask_do(ask *question);
void ask_free(ask *question);

/* The steps of ask_do(), for tests that want the handle. */
softshadow *ask_handle(const ask *question);
void ask_query(softshadow *handle, ask *question);

softshadow_mesh ask_mesh(const scene_mesh *mesh);
softshadow_points ask_points(const double (*points)[3], size_t count);

/* ---- Comparing ------------------------------------------------------------------------------*/

/* The truths hold for every point: inside [0, 1], within the bound (certified: each; statistical:
 * all but one in a thousand), RMS over the points in penumbra and maximum within the tolerances.
 * Prints what was reached. slack: what the truth itself may be off by. */
void ask_compare(const ask *question, const double *truth, const char *what, double rms, double max,
                 double slack);
/* Two answers to what should be one question. Bits: every float the same. Samples: none differs by
 * more than two light samples and `same` of the points not at all. */
void ask_same_bits(const float *a, const float *b, size_t n, const char *what);
void ask_same_samples(const float *a, const float *b, size_t n, unsigned samples, double same,
                      const char *what);
/* Both truthful: they differ by no more than the two bounds say (statistical: 1 in 200 may). */
void ask_same_truth(const ask *a, const ask *b, const char *what);

#endif
