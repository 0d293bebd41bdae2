/* The progress line and the messages that must not run into it. */
#include "progress.h"

#include <stdio.h>
#include <time.h>
#include <unistd.h>

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void cli_progress_init(cli_progress *progress, bool quiet) {
    *progress = (cli_progress){.quiet = quiet, .wanted = !quiet && isatty(STDERR_FILENO)};
    pthread_mutex_init(&progress->lock, NULL);
}

static void clear(cli_progress *progress) {
    if (progress->shown) fputs("\r\033[K", stderr);
    progress->shown = false;
}

void cli_progress_free(cli_progress *progress) {
    clear(progress);
    pthread_mutex_destroy(&progress->lock);
}

void cli_progress_begin(cli_progress *progress, const char *label) {
    pthread_mutex_lock(&progress->lock);
    clear(progress);
    progress->label = label;
    progress->from = 0;
    progress->to = 1;
    progress->started = now();
    pthread_mutex_unlock(&progress->lock);
}

void cli_progress_span(cli_progress *progress, double from, double to, uint64_t points) {
    pthread_mutex_lock(&progress->lock);
    progress->from = from;
    progress->to = to;
    progress->points = points;
    pthread_mutex_unlock(&progress->lock);
}

static void draw(cli_progress *progress, double done) {
    enum { WIDTH = 30 };
    double whole = progress->from + (progress->to - progress->from) * done;
    if (progress->to <= 0) {
        fprintf(stderr, "\r%s: %llu points\033[K", progress->label,
                (unsigned long long)progress->points);
        return;
    }
    char bar[WIDTH + 1];
    for (int i = 0; i < WIDTH; i++) bar[i] = i < whole * WIDTH ? '#' : '.';
    bar[WIDTH] = 0;
    fprintf(stderr, "\r%s [%s] %3.0f%%\033[K", progress->label, bar, 100 * whole);
}

int cli_progress_step(void *opaque, double done) {
    cli_progress *progress = opaque;
    if (!progress->wanted) return 0;
    pthread_mutex_lock(&progress->lock);
    double t = now();
    if (t - progress->started > 1.0 && t - progress->drawn_at > 0.1) {
        draw(progress, done);
        progress->shown = true;
        progress->drawn_at = t;
    }
    pthread_mutex_unlock(&progress->lock);
    return 0;
}

void cli_progress_log(void *opaque, int level, const char *text) {
    cli_progress *progress = opaque;
    /* An error is also what the call that failed returns, and is said there. */
    if (level == 0 || progress->silent || (progress->quiet && level >= 2)) return;
    pthread_mutex_lock(&progress->lock);
    clear(progress);
    fprintf(stderr, "softshadow: %s%s\n", level == 1 ? "warning: " : "", text);
    pthread_mutex_unlock(&progress->lock);
}
