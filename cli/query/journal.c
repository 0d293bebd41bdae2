/* The journal: "softshadow-resume 1 IDENTITY", "bytes BEGIN END HASH" ..., "whole". */
#include "journal.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PIECE = 1 << 16 };

uint64_t query_hash(uint64_t hash, const void *data, size_t bytes) {
    const unsigned char *from = data;
    for (size_t i = 0; i < bytes; i++) hash = (hash ^ from[i]) * 0x100000001b3u;
    return hash;
}

uint64_t query_hash_text(uint64_t hash, const char *text) {
    return text ? query_hash(hash, text, strlen(text) + 1) : query_hash(hash, "\x01", 2);
}

bool query_hash_file(uint64_t *hash, const char *path, cli_error *error) {
    struct stat about;
    char shown[208];
    if (stat(path, &about) != 0)
        return cli_fail(error, CLI_FAILED, "%s: %s", cli_show_path(path, shown), strerror(errno));
    int64_t facts[3] = {(int64_t)about.st_size, (int64_t)about.st_mtim.tv_sec,
                        (int64_t)about.st_mtim.tv_nsec};
    *hash = query_hash(*hash, facts, sizeof facts);
    return true;
}

static bool problem(const query_journal *journal, cli_error *error) {
    char shown[208];
    return cli_fail(error, CLI_FAILED, "%s: %s", cli_show_path(journal->path, shown),
                    strerror(errno));
}

/* False where the file ends before the range does. */
static bool hash_range(int fd, uint64_t begin, uint64_t end, uint64_t *hash) {
    char piece[PIECE];
    *hash = QUERY_HASH;
    while (begin < end) {
        size_t size = end - begin < PIECE ? (size_t)(end - begin) : PIECE;
        ssize_t got = pread(fd, piece, size, (off_t)begin);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        *hash = query_hash(*hash, piece, (size_t)got);
        begin += (uint64_t)got;
    }
    return true;
}

static int open_output(const char *final, const char *unfinished, bool whole) {
    return open(whole ? final : unfinished, O_RDONLY | O_CLOEXEC);
}

/* Follows the lines as long as they are sound; what comes after is cut off. */
static bool replay(query_journal *journal, FILE *lines, const char *final, const char *unfinished,
                   bool whole, off_t keep) {
    char line[128];
    int output = open_output(final, unfinished, whole);
    while (output >= 0 && fgets(line, sizeof line, lines)) {
        unsigned long long begin, end, told;
        uint64_t hash;
        if (strcmp(line, "whole\n") == 0) {
            journal->whole = true;
            keep = ftello(lines);
            break;
        }
        if (sscanf(line, "bytes %llu %llu %llx", &begin, &end, &told) != 3 || !strchr(line, '\n') ||
            begin != journal->begin + journal->done || end < begin ||
            !hash_range(output, begin, end, &hash) || hash != told)
            break;
        journal->done = end - journal->begin;
        keep = ftello(lines);
    }
    if (output >= 0) close(output);
    return ftruncate(journal->fd, keep) == 0 && lseek(journal->fd, keep, SEEK_SET) >= 0;
}

static bool says_whole(FILE *lines) {
    char line[128];
    bool whole = false;
    off_t here = ftello(lines);
    while (fgets(line, sizeof line, lines)) whole = strcmp(line, "whole\n") == 0;
    fseeko(lines, here, SEEK_SET);
    return whole;
}

static bool read_back(query_journal *journal, const char *head, const char *final,
                      const char *unfinished, cli_error *error) {
    char line[128], shown[208];
    FILE *lines = fopen(journal->path, "re");
    if (!lines) return problem(journal, error);
    bool fine;
    if (!fgets(line, sizeof line, lines)) {
        ssize_t length = (ssize_t)strlen(head);
        fine = write(journal->fd, head, (size_t)length) == length || problem(journal, error);
    } else if (strcmp(line, head) != 0) {
        fine =
            cli_fail(error, CLI_FAILED,
                     "%s: belongs to another job (other options, meshes or points): remove it, or "
                     "leave --resume out",
                     cli_show_path(journal->path, shown));
    } else {
        bool whole = says_whole(lines);
        fine = replay(journal, lines, final, unfinished, whole, ftello(lines)) ||
               problem(journal, error);
        /* "whole" behind a piece that does not hash any more was cut off. */
        if (fine && whole && !journal->whole) journal->done = 0;
        if (fine && whole && !journal->whole)
            fine = ftruncate(journal->fd, (off_t)strlen(head)) == 0 || problem(journal, error);
        if (fine && lseek(journal->fd, 0, SEEK_END) < 0) fine = problem(journal, error);
    }
    fclose(lines);
    return fine;
}

bool query_journal_open(query_journal *journal, const char *path, uint64_t identity,
                        const char *final, const char *unfinished, uint64_t begin,
                        cli_error *error) {
    char head[64];
    snprintf(head, sizeof head, "softshadow-resume 1 %016llx\n", (unsigned long long)identity);
    *journal = (query_journal){.begin = begin, .path = strdup(path)};
    journal->fd = journal->path ? open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666) : -1;
    if (!journal->path) return cli_fail(error, CLI_FAILED, "memory ran out");
    if (journal->fd < 0) return problem(journal, error);
    return read_back(journal, head, final, unfinished, error);
}

static bool put(const query_journal *journal, const char *line, cli_error *error) {
    ssize_t length = (ssize_t)strlen(line);
    errno = ENOSPC; /* what a short write means */
    return write(journal->fd, line, (size_t)length) == length || problem(journal, error);
}

bool query_journal_add(query_journal *journal, int fd, uint64_t end, cli_error *error) {
    uint64_t begin = journal->begin + journal->done, hash;
    char line[128];
    if (end == begin) return true;
    if (!hash_range(fd, begin, end, &hash)) return problem(journal, error);
    snprintf(line, sizeof line, "bytes %llu %llu %016llx\n", (unsigned long long)begin,
             (unsigned long long)end, (unsigned long long)hash);
    journal->done = end - journal->begin;
    return put(journal, line, error);
}

bool query_journal_finish(query_journal *journal, cli_error *error) {
    if (!put(journal, "whole\n", error)) return false;
    return fsync(journal->fd) == 0 || problem(journal, error);
}

void query_journal_close(query_journal *journal) {
    if (journal->path && journal->fd >= 0) close(journal->fd);
    free(journal->path);
    *journal = (query_journal){.fd = -1};
}
