/* Buffered input over read(2): stdio would hide whether a read has to wait. */
#include "input.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { ROOM = 1 << 20 };

bool cli_input_open(cli_input *input, const char *path, cli_error *error) {
    bool standard = strcmp(path, "-") == 0;
    struct stat about;
    *input = (cli_input){.fd = standard ? STDIN_FILENO : open(path, O_RDONLY | O_CLOEXEC)};
    cli_show_path(standard ? "standard input" : path, input->name);
    if (input->fd < 0 || fstat(input->fd, &about) != 0) {
        cli_fail(error, CLI_FAILED, "%s: %s", input->name, strerror(errno));
        return cli_input_close(input), false;
    }
    if (S_ISDIR(about.st_mode)) {
        cli_fail(error, CLI_FAILED, "%s: is a directory, a file is allowed", input->name);
        return cli_input_close(input), false;
    }
    off_t from = lseek(input->fd, 0, SEEK_CUR);
    input->regular = S_ISREG(about.st_mode) && from >= 0;
    if (input->regular) input->size = about.st_size > from ? (uint64_t)(about.st_size - from) : 0;
    input->buffer = malloc(ROOM);
    input->room = ROOM;
    if (input->buffer) return true;
    cli_input_close(input);
    return cli_fail(error, CLI_FAILED, "%s: memory ran out", input->name);
}

void cli_input_close(cli_input *input) {
    if (input->fd > STDERR_FILENO) close(input->fd);
    free(input->buffer);
    input->fd = -1;
    input->buffer = NULL;
}

bool cli_input_more(cli_input *input, cli_error *error) {
    size_t waiting = cli_input_waiting(input);
    if (input->begin) {
        memmove(input->buffer, input->buffer + input->begin, waiting);
        input->begin = 0;
        input->end = waiting;
    }
    if (input->end == input->room) {
        char *larger = realloc(input->buffer, input->room * 2);
        if (!larger) return cli_fail(error, CLI_FAILED, "%s: memory ran out", input->name);
        input->buffer = larger;
        input->room *= 2;
    }
    ssize_t got;
    do got = read(input->fd, input->buffer + input->end, input->room - input->end);
    while (got < 0 && errno == EINTR);
    if (got < 0) return cli_fail(error, CLI_FAILED, "%s: %s", input->name, strerror(errno));
    if (got == 0) input->ended = true;
    input->end += (size_t)got;
    return true;
}

bool cli_input_need(cli_input *input, size_t bytes, cli_error *error) {
    while (cli_input_waiting(input) < bytes && !input->ended)
        if (!cli_input_more(input, error)) return false;
    return true;
}

bool cli_input_ready(const cli_input *input) {
    struct pollfd ask = {.fd = input->fd, .events = POLLIN};
    return input->ended || poll(&ask, 1, 0) != 0;
}

bool cli_input_seek(cli_input *input, uint64_t offset, cli_error *error) {
    off_t here = lseek(input->fd, 0, SEEK_CUR);
    uint64_t read_so_far = input->taken + cli_input_waiting(input);
    off_t target = here - (off_t)read_so_far + (off_t)offset;
    if (here < 0 || lseek(input->fd, target, SEEK_SET) < 0)
        return cli_fail(error, CLI_FAILED, "%s: %s", input->name, strerror(errno));
    input->begin = input->end = 0;
    input->taken = offset;
    input->ended = false;
    return true;
}
