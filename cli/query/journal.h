/* What --resume goes by: a file of lines beside the output that tells which bytes of it were
 * written and how they hash, for one job. What does not hash as told is done again. */
#ifndef CLI_QUERY_JOURNAL_H
#define CLI_QUERY_JOURNAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "../error.h"

typedef struct query_journal {
    int fd; /* -1: none is kept */
    char *path;
    bool whole;     /* the last run came to its end */
    uint64_t begin; /* of the output's bytes that the job writes */
    uint64_t done;  /* bytes from begin on that are there and hash as told */
} query_journal;

/* A running hash of 64 bits (FNV-1a); begins with QUERY_HASH. */
#define QUERY_HASH 0xcbf29ce484222325u
uint64_t query_hash(uint64_t hash, const void *data, size_t bytes);
uint64_t query_hash_text(uint64_t hash, const char *text);
/* A file's size and time of change stand for its content. */
bool query_hash_file(uint64_t *hash, const char *path, cli_error *error);

/* Opens or begins the journal at path of a job with that identity. final is the output, unfinished
 * the file that holds it until it is whole (the same path for parts). A journal of another job is
 * an error. */
bool query_journal_open(query_journal *journal, const char *path, uint64_t identity,
                        const char *final, const char *unfinished, uint64_t begin,
                        cli_error *error);
/* Notes that bytes up to end are written; they are read back from fd. */
bool query_journal_add(query_journal *journal, int fd, uint64_t end, cli_error *error);
bool query_journal_finish(query_journal *journal, cli_error *error);
void query_journal_close(query_journal *journal);

#endif
