/* Whole files or none: temporary file, fsync, rename, fsync of the folder. */
#include "output.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { ROOM = 1 << 20, MOST_OPEN = 8 };

/* What a signal handler has to remove: it may only read these. */
static char *volatile pending[MOST_OPEN];

static void remove_pending(int signal_number) {
    for (int i = 0; i < MOST_OPEN; i++)
        if (pending[i]) unlink(pending[i]);
    signal(signal_number, SIG_DFL);
    raise(signal_number);
}

void cli_output_prepare(void) {
    static const int fatal[] = {SIGINT, SIGTERM, SIGHUP};
    struct sigaction act = {.sa_handler = SIG_IGN}, old;
    sigemptyset(&act.sa_mask);
    sigaction(SIGPIPE, &act, NULL);
    sigaction(SIGXFSZ, &act, NULL);
    act.sa_handler = remove_pending;
    for (size_t i = 0; i < sizeof fatal / sizeof *fatal; i++) {
        /* nohup and shells' background jobs ignore some on purpose. */
        if (sigaction(fatal[i], NULL, &old) == 0 && old.sa_handler == SIG_IGN) continue;
        sigaction(fatal[i], &act, NULL);
    }
}

static bool remember(char *path) {
    for (int i = 0; i < MOST_OPEN; i++)
        if (!pending[i]) return pending[i] = path, true;
    return false;
}

static void forget(const char *path) {
    for (int i = 0; i < MOST_OPEN; i++)
        if (pending[i] == path) pending[i] = NULL;
}

static bool problem(cli_output *output, cli_error *error) {
    const char *why = errno == EPIPE ? "the reader has gone (broken pipe)" : strerror(errno);
    return cli_fail(error, CLI_FAILED, "%s: %s", output->name, why);
}

/* A name beside the place: .NAME.PID-N.tmp */
static bool open_temporary(cli_output *output, mode_t mode) {
    static unsigned number;
    const char *slash = strrchr(output->path, '/');
    size_t folder = slash ? (size_t)(slash - output->path) + 1 : 0;
    size_t room = strlen(output->path) + 48;
    output->temporary = malloc(room);
    if (!output->temporary) return false;
    for (int tries = 0; tries < 100; tries++) {
        snprintf(output->temporary, room, "%.*s.%.200s.%ld-%u.tmp", (int)folder, output->path,
                 output->path + folder, (long)getpid(), number++);
        /* Remembered first: a signal between the two would leave it behind. */
        if (!remember(output->temporary)) return errno = EMFILE, false;
        output->fd = open(output->temporary, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, mode);
        if (output->fd >= 0) return true;
        int why = errno;
        forget(output->temporary);
        errno = why;
        if (why != EEXIST) break;
    }
    return false;
}

static bool open_file(cli_output *output, const char *path) {
    struct stat about;
    bool there = stat(path, &about) == 0;
    if (there && S_ISDIR(about.st_mode)) return errno = EISDIR, false;
    if (there && !S_ISREG(about.st_mode)) {
        output->fd = open(path, O_WRONLY | O_CLOEXEC);
        return output->fd >= 0;
    }
    output->path = there ? realpath(path, NULL) : strdup(path);
    if (!output->path) return false;
    if (!open_temporary(output, there ? about.st_mode & 0777 : 0666)) return false;
    output->origin = 0;
    return true;
}

bool cli_output_open(cli_output *output, const char *path, cli_error *error) {
    bool standard = strcmp(path, "-") == 0;
    *output = (cli_output){.fd = STDOUT_FILENO, .origin = -1};
    cli_show_path(standard ? "standard output" : path, output->name);
    output->buffer = malloc(ROOM);
    if (!output->buffer) return cli_fail(error, CLI_FAILED, "%s: memory ran out", output->name);
    if (!standard) output->fd = -1;
    if (!standard && !open_file(output, path)) {
        problem(output, error);
        cli_output_abandon(output);
        return false;
    }
    if (standard) {
        struct stat about;
        int flags = fcntl(STDOUT_FILENO, F_GETFL);
        /* With O_APPEND a rewrite would land at the end. */
        if (fstat(STDOUT_FILENO, &about) == 0 && S_ISREG(about.st_mode) && !(flags & O_APPEND))
            output->origin = (int64_t)lseek(STDOUT_FILENO, 0, SEEK_CUR);
    }
    return true;
}

bool cli_output_open_part(cli_output *output, const char *path, uint64_t size, uint64_t offset,
                          cli_error *error) {
    struct stat about;
    *output = (cli_output){.fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666)};
    cli_show_path(path, output->name);
    output->buffer = malloc(ROOM);
    bool fine = output->fd >= 0 && output->buffer && fstat(output->fd, &about) == 0;
    if (fine && !S_ISREG(about.st_mode))
        cli_fail(error, CLI_USAGE, "%s: a part is written into a regular file only", output->name);
    else if (fine && about.st_size != 0 && (uint64_t)about.st_size != size)
        cli_fail(error, CLI_FAILED,
                 "%s: has %llu bytes, a part of %llu bytes was to be written: remove it first",
                 output->name, (unsigned long long)about.st_size, (unsigned long long)size);
    /* Of several that begin at once each sets the same size. */
    else if (fine && ftruncate(output->fd, (off_t)size) == 0 &&
             lseek(output->fd, (off_t)offset, SEEK_SET) >= 0)
        return true;
    else
        problem(output, error);
    cli_output_abandon(output);
    return false;
}

static bool write_all(cli_output *output, const char *data, size_t bytes, cli_error *error) {
    while (bytes) {
        ssize_t put = write(output->fd, data, bytes);
        if (put < 0 && errno == EINTR) continue;
        if (put < 0) return problem(output, error);
        data += put;
        bytes -= (size_t)put;
    }
    return true;
}

bool cli_output_flush(cli_output *output, cli_error *error) {
    size_t held = output->held;
    output->held = 0;
    return write_all(output, output->buffer, held, error);
}

bool cli_output_write(cli_output *output, const void *data, size_t bytes, cli_error *error) {
    if (!bytes) return true; /* data may be NULL then, which memcpy() must not see */
    output->written += bytes;
    if (bytes > ROOM - output->held && !cli_output_flush(output, error)) return false;
    if (bytes >= ROOM) return write_all(output, data, bytes, error);
    memcpy(output->buffer + output->held, data, bytes);
    output->held += bytes;
    return true;
}

bool cli_output_rewrite(cli_output *output, uint64_t offset, const void *data, size_t bytes,
                        cli_error *error) {
    if (!cli_output_flush(output, error)) return false;
    const char *from = data;
    off_t at = (off_t)(output->origin + (int64_t)offset);
    while (bytes) {
        ssize_t put = pwrite(output->fd, from, bytes, at);
        if (put < 0 && errno == EINTR) continue;
        if (put < 0) return problem(output, error);
        from += put;
        at += put;
        bytes -= (size_t)put;
    }
    return true;
}

/* A crash of the machine must not undo a rename that was reported as done. */
static void sync_folder(const char *path) {
    char folder[PATH_MAX];
    const char *slash = strrchr(path, '/');
    snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash - path) + 1 : 1,
             slash ? path : ".");
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return;
    fsync(fd); /* some file systems cannot: the rename is done all the same */
    close(fd);
}

static bool close_checked(cli_output *output, cli_error *error) {
    /* A pipe or a device cannot be synchronised and says EINVAL; a full disk shows here. */
    if (fsync(output->fd) != 0 && errno != EINVAL && errno != EROFS && errno != ENOTSUP)
        return problem(output, error);
    int fd = output->fd;
    output->fd = -1;
    return close(fd) == 0 || problem(output, error);
}

bool cli_output_commit(cli_output *output, cli_error *error) {
    bool fine = cli_output_flush(output, error) && close_checked(output, error);
    if (fine && output->path) {
        if (rename(output->temporary, output->path) != 0) {
            fine = problem(output, error);
        } else {
            forget(output->temporary);
            free(output->temporary);
            output->temporary = NULL;
            sync_folder(output->path);
        }
    }
    cli_output_abandon(output);
    return fine;
}

void cli_output_abandon(cli_output *output) {
    if (output->fd > STDERR_FILENO) close(output->fd);
    if (output->temporary) {
        unlink(output->temporary);
        forget(output->temporary);
    }
    free(output->temporary);
    free(output->path);
    free(output->buffer);
    *output = (cli_output){.fd = -1};
}
