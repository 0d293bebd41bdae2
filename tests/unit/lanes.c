/* The lanes of x86-64's plainest kernel against plain C, which other machines run. The faster
 * kernels are held against this one by property/bits. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

/* After the others: it uses their types. */
#include <cmocka.h>

#include "unit/lanes_results.h"

static void same_bits(void **state) {
    (void)state;
    lanes_results plain, sse2;
    lanes_plain(&plain);
    lanes_sse2(&sse2);
    for (int op = 0; op < LANES_OPS; op++) {
        if (plain.digest[op] != sse2.digest[op]) fail_msg("operation %d differs", op);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(same_bits)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
