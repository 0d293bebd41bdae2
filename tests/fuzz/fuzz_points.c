/* libFuzzer on the readers of point lists and the writers that give them back: no crash, no leak,
 * no block larger than asked for, every refusal one plain line; and what is read does not depend on
 * whether it comes from a file or in pieces through a pipe. The first byte chooses the format. */
#define _GNU_SOURCE /* memfd_create */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "points/points.h"

enum { PIPE_HOLDS = 60000, BLOCK_MOST = 64, POINTS_MOST = 100000 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void must(bool holds) {
    if (!holds) abort();
}

static void check_error(const cli_error *error) {
    must(error->status == CLI_FAILED || error->status == CLI_USAGE);
    must(error->text[0] != 0);
    for (const char *c = error->text; *c; c++) must(*c >= 0x20 && *c < 0x7f);
}

/* A checksum of all positions, or of the message. */
static uint64_t mix(uint64_t hash, const void *data, size_t size) {
    const uint8_t *bytes = data;
    for (size_t i = 0; i < size; i++) hash = (hash ^ bytes[i]) * 0x100000001b3;
    return hash;
}

static bool write_block(points_sink *sink, const points_block *block, cli_error *error) {
    static float zero[BLOCK_MOST];
    float *columns[1] = {zero};
    return points_sink_write(sink, block, columns, error);
}

/* Everything the source has, handed to a sink of the same format on /dev/null. */
static bool copy(points_source *source, points_block *block, uint64_t *hash, cli_error *error) {
    cli_output output = {0};
    points_sink sink = {.format = source->format, .source = source, .output = &output, .lights = 1,
                        .count = source->count};
    uint64_t total = 0;
    bool good = points_block_reserve(block, source, BLOCK_MOST, error) &&
                cli_output_open(&output, "/dev/null", error);
    const bool writes = good && points_sink_check(&sink, error);
    if (writes) good = points_sink_begin(&sink, error);
    while (good && !source->ended && total < POINTS_MOST) {
        good = points_source_read(source, block, BLOCK_MOST, error);
        if (!good) break;
        must(block->count <= BLOCK_MOST);
        const size_t each = block->type == SOFTSHADOW_F64 ? 24 : 12;
        *hash = mix(*hash, block->positions, block->count * each);
        total += block->count;
        if (writes) good = write_block(&sink, block, error);
    }
    if (good && writes && source->ended && (sink.count == POINTS_UNKNOWN || sink.count == total)) {
        good = points_sink_end(&sink, error);
    }
    points_sink_free(&sink);
    cli_output_abandon(&output);
    return good;
}

static bool read_all(const char *path, points_format format, uint64_t *hash) {
    points_source source = {0};
    points_block block = {0};
    cli_error error = {.status = 0};
    *hash = 0xcbf29ce484222325;
    bool good = points_source_open(&source, path, format, NULL, &error);
    if (good) {
        good = copy(&source, &block, hash, &error);
        points_block_free(&block);
        points_source_close(&source);
    }
    if (!good) check_error(&error);
    return good;
}

static int file_of(const uint8_t *data, size_t size) {
    const int fd = memfd_create("points", MFD_CLOEXEC);
    must(fd >= 0 && write(fd, data, size) == (ssize_t)size);
    return fd;
}

static int pipe_of(const uint8_t *data, size_t size) {
    int ends[2];
    must(pipe(ends) == 0 && write(ends[1], data, size) == (ssize_t)size);
    close(ends[1]);
    return ends[0];
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    char path[32];
    uint64_t from_file, from_pipe;
    if (size < 1 || size > PIPE_HOLDS) return 0;
    const points_format format = (points_format)(data[0] % POINTS_IMAGE);
    int fd = file_of(data + 1, size - 1);
    snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
    const bool file = read_all(path, format, &from_file);
    close(fd);
    fd = pipe_of(data + 1, size - 1);
    snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
    const bool stream = read_all(path, format, &from_pipe);
    close(fd);
    /* A file whose size contradicts its header is refused before its points are read. */
    if (file && stream) must(from_file == from_pipe);
    return 0;
}
