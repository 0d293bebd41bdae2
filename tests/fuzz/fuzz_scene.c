/* libFuzzer on scene files, as "softshadow render" and OpenImageIO's plugin read them: no crash, no
 * leak, a refusal is one plain line that begins with the file's name, and what is taken is within
 * what the options allow. The first byte says how many lines at the end are a host's hints, which
 * follow the file's own. What follows the first byte 0xff is another file, that a scene may name as
 * its profile: 99. No mesh is read: opening a scene never does. */
#define _GNU_SOURCE /* memfd_create */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "render/request.h"
#include "render/still.h"

enum { HINTS = 4, PROFILE = 99 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void must(bool holds) {
    if (!holds) abort();
}

static void check_error(const cli_error *error, const char *path) {
    must(error->status == CLI_FAILED);
    must(strncmp(error->text, path, strlen(path)) == 0 && error->text[strlen(path)] == ':');
    for (const char *c = error->text; *c; c++) /* paths may be in any script */
        must((unsigned char)*c >= 0x20 && *c != 0x7f);
}

/* A file that has a name: readers open it like any other. */
static int file_of(const uint8_t *data, size_t size, char path[32]) {
    const int fd = memfd_create("scene", MFD_CLOEXEC);
    must(fd >= 0 && write(fd, data, size) == (ssize_t)size);
    if (path) snprintf(path, 32, "/proc/self/fd/%d", fd);
    return fd;
}

static void check_lights(const cli_build_options *options) {
    softshadow *handle;
    must(options->light_count <= CLI_MOST_LIGHTS);
    must(softshadow_create(&handle, NULL) == SOFTSHADOW_OK);
    for (uint32_t i = 0; i < options->light_count; i++) {
        const softshadow_status status = softshadow_add_light(handle, &options->lights[i], NULL);
        must(status == SOFTSHADOW_OK || status == SOFTSHADOW_E_LIGHT);
        if (status != SOFTSHADOW_OK) must(*softshadow_last_message(handle));
    }
    softshadow_destroy(handle);
}

static void check_request(const request *r, const char *path) {
    const picture *p = &r->picture;
    const char *folder_end = strrchr(path, '/') + 1;
    const size_t folder = (size_t)(folder_end - path);
    for (uint32_t i = 0; i < r->mesh_count; i++) {
        const char *mesh = r->meshes[i];
        must(mesh[0] == '/');
        if (strncmp(mesh, path, folder) == 0) must(mesh[folder] != 0);
    }
    must(p->width >= 1 && p->width <= 16384 && p->height >= 1 && p->height <= 16384);
    must(p->aa >= 1 && p->aa <= 16 && p->ambient >= 0 && p->ambient <= 1e6);
    must(isnan(r->ground) || r->ground == INFINITY || fabs(r->ground) <= 1e15);
    must(r->aov < 32 && r->shading < 2 && r->up < 2 && fabs(r->exposure) <= 32);
    must(r->build.build.tolerance == 0 ||
         (r->build.build.tolerance >= 1e-6 && r->build.build.tolerance <= 1));
    check_lights(&r->build);
}

static void read_only(const char *path) {
    request r;
    cli_error error = {.status = 0};
    request_init(&r);
    if (request_read(&r, path, &error)) check_request(&r, path);
    else check_error(&error, path);
    request_free(&r);
}

/* Cuts the last lines off: a name and what follows the first blank. */
static size_t take_hints(char *text, size_t size, const char **names, const char **values,
                         size_t count) {
    size_t taken = 0;
    while (taken < count) {
        char *line = memrchr(text, '\n', size);
        if (!line) break;
        size = (size_t)(line - text);
        char *value = strchr(line + 1, ' ');
        if (value) *value++ = 0;
        names[taken] = line + 1, values[taken++] = value ? value : "";
        *line = 0;
    }
    return taken;
}

static void open_still(const char *path, char *hints, size_t size, size_t count) {
    const char *names[HINTS], *values[HINTS];
    uint64_t stamp;
    cli_error error = {.status = 0};
    count = take_hints(hints, size, names, values, count);
    still *s = still_open(path, names, values, count, 1, &stamp, &error);
    if (s) {
        still_info info;
        still_about(s, &info);
        must(info.width > 0 && info.height > 0 && info.plane_count >= 4 && !info.broken);
        for (uint32_t i = 0; i < info.plane_count; i++) must(*info.planes[i].name);
    } else {
        check_error(&error, path);
    }
    still_close(s);
}

/* A scene at `path` in the text's bytes, which are changed. */
static void try_scene(const char *path, char *text, size_t size, size_t hints) {
    char head[16] = {0};
    memcpy(head, text, size < sizeof head ? size : sizeof head);
    read_only(path);
    if (still_begins(head)) open_still(path, text, size, hints);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    char path[32];
    if (size < 1) return 0;
    const size_t hints = data[0] % (HINTS + 1);
    data++, size--;
    const uint8_t *cut = memchr(data, 0xff, size);
    const size_t length = cut ? (size_t)(cut - data) : size;
    if (cut) {
        const int profile = file_of(cut + 1, size - length - 1, NULL);
        must(dup2(profile, PROFILE) == PROFILE);
        close(profile);
    }
    const int fd = file_of(data, length, path);
    char *text = calloc(length + 1, 1);
    must(text != NULL);
    memcpy(text, data, length);
    try_scene(path, text, length, hints);
    free(text);
    close(fd);
    if (cut) close(PROFILE);
    return 0;
}
