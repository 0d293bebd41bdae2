/* A fused multiplication and addition without the instruction, for lanes_scalar.h and
 * lanes_sse2.h. */
#ifndef SS_COVERAGE_FMA_ONCE_H
#define SS_COVERAGE_FMA_ONCE_H

#include <stdint.h>
#include <string.h>

/* a b + c rounded once. The product is exact in double; the sum may be rounded there and then again
 * to float, which differs from one rounding only if it lands on the middle between two floats. Then
 * it is rounded to odd first (Boldo & Melquiond 2008). */
static inline float round_by_odd(double product, double addend, double sum) {
    const double other = sum - product;
    const double error = (product - (sum - other)) + (addend - other);
    uint64_t bits;
    memcpy(&bits, &sum, sizeof bits);
    if ((error < 0 || error > 0) && !(bits & 1))
        bits += (error > 0) == (sum > 0) ? 1 : (uint64_t)-1;
    memcpy(&sum, &bits, sizeof bits);
    return (float)sum;
}
static inline float fma_once(float a, float b, float c) {
    const double product = (double)a * b, sum = product + c;
    uint64_t bits;
    memcpy(&bits, &sum, sizeof bits);
    const int middle = (bits & 0x1fffffff) == 0x10000000;
    const int small = __builtin_fabs(sum) < 0x1p-120; /* denormal floats have other middles */
    return __builtin_expect(middle | small, 0) ? round_by_odd(product, c, sum) : (float)sum;
}
#endif
