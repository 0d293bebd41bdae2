/* Lawlor's figure 10 against the paper's table: scene, calibration and rows are those of the bench
 * (figure10.h), so that both mean the same. */
#include "figure10.h"

#include "ask.h"

static void test_figure_10(void **state) {
    (void)state;
    figure10 f;
    const char *why = figure10_measure(&f, NULL, NULL);
    CHECK(!why, "%s", why);
    print_message("hard exact      %5.1f (33.5)\n16 samples      %5.1f (12.0)\n", f.hard_exact,
                  f.sixteen);
    CHECK(fabs(f.hard_exact - 33.5) <= .5, "hard exact %g", f.hard_exact);
    CHECK(fabs(f.sixteen - 12.0) <= .5, "16 samples %g", f.sixteen);
    CHECK(f.row_count >= FIGURE10_PRINTED, "%u rows", f.row_count);
    for (uint32_t r = 0; r < f.row_count; r++) {
        print_message("%-15s", f.rows[r].method);
        for (int s = 0; s < FIGURE10_SIDES; s++) {
            print_message(" %5.1f (%4.1f)", f.rows[r].ours[s], f.rows[r].paper[s]);
        }
        print_message("\n");
    }
    const figure10_row *rows = f.rows;
    for (int s = 0; s < FIGURE10_SIDES; s++) {
        const double hard = rows[FIGURE10_HARD].ours[s], limit = rows[FIGURE10_LIMIT].ours[s];
        CHECK(fabs(hard - rows[FIGURE10_HARD].paper[s]) <= 2, "hard %u: %g", 16u << s, hard);
        CHECK(limit <= rows[FIGURE10_LIMIT].paper[s], "penumbra-limit %u: %g", 16u << s, limit);
        /* The paper's order, column by column; what does better than printed may pass another. */
        for (size_t a = 0; a < FIGURE10_PRINTED; a++) {
            for (size_t b = 0; b < FIGURE10_PRINTED; b++) {
                if (!(rows[a].paper[s] < rows[b].paper[s])) continue;
                if (rows[b].ours[s] < rows[b].paper[s] && b != FIGURE10_HARD) continue;
                CHECK(rows[a].ours[s] < rows[b].ours[s], "%s and %s at %u", rows[a].method,
                      rows[b].method, 16u << s);
            }
        }
    }
    /* Reeves gets worse with more texels, the others do not. */
    const double *pcf = rows[FIGURE10_PCF].ours;
    CHECK(pcf[3] > pcf[1], "pcf %g after %g", pcf[3], pcf[1]);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_figure_10)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
