/* The tolerances the truth tests share. */
#ifndef TESTS_PROPERTY_TRUTH_H
#define TESTS_PROPERTY_TRUTH_H

#include "ask.h"
#include "oracle/oracle.h"

/* Noise-free methods are asked for 512 light samples, at which 1/256 RMS and 1/64 at most are
 * promised; the others for what their default tolerance, 1/256, needs. */
static inline uint32_t truth_samples(const char *method) {
    return ask_noise_free(method) ? 512 : 0;
}
static inline double truth_max(const char *method) {
    /* auto: no point wrong by more than 0.1. A statistical method promises nothing for its worst
     * point beyond the bound. */
    return ask_noise_free(method) ? 1.0 / 64 : ask_auto(method) ? 0.1 : 1;
}

/* Asks and compares; slack: what the truth may be off by, beside the rounding of a float. */
static inline void truth_judge(ask *question, const double *truth, const char *what, double slack) {
    ask_do(question);
    ask_compare(question, truth, what, 1.0 / 256, truth_max(question->method), slack + 1e-6);
    ask_free(question);
}

#endif
