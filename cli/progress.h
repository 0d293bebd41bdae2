/* One line on stderr that tells how far the work is: only on a terminal, only after a second. */
#ifndef CLI_PROGRESS_H
#define CLI_PROGRESS_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

typedef struct cli_progress {
    pthread_mutex_t lock; /* notes may come from any thread */
    const char *label;    /* static; what is being done */
    double from, to;      /* the part of the whole that calls of the library report as 0..1 */
    uint64_t points;      /* done so far, shown when the whole is not known (to is 0) */
    double started, drawn_at;
    bool shown, wanted, quiet;
    bool silent; /* not even warnings: stderr is not ours */
} cli_progress;

void cli_progress_init(cli_progress *progress, bool quiet);
void cli_progress_free(cli_progress *progress); /* takes the line away */

/* A new piece of work. */
void cli_progress_begin(cli_progress *progress, const char *label);
/* Which part of the whole, 0..1, the next calls of the library do; to 0: the whole is not known. */
void cli_progress_span(cli_progress *progress, double from, double to, uint64_t points);
/* How far the call is, 0..1; softshadow_options.progress. */
int cli_progress_step(void *progress, double done);
/* softshadow_options.log: the text above the line; information only when not quiet. */
void cli_progress_log(void *progress, int level, const char *text);

#endif
