/* still.c */
#include "still.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "planes.h"
#include "request.h"

struct still {
    request request;
    cli_scene scene;
    planes planes;
    bool built, broken;
    cli_error failure; /* of a still that is broken: it answers that for ever */
};

/* Folds what tells a file from its next version into the stamp (FNV-1a over 64-bit words). */
static bool stamp_file(const char *path, uint64_t *stamp, cli_error *error) {
    struct stat about;
    char shown[208];
    if (stat(path, &about) != 0)
        return cli_fail(error, CLI_FAILED, "%s: %s", cli_show_path(path, shown), strerror(errno));
    const uint64_t words[] = {(uint64_t)about.st_dev,          (uint64_t)about.st_ino,
                              (uint64_t)about.st_size,         (uint64_t)about.st_mtim.tv_sec,
                              (uint64_t)about.st_mtim.tv_nsec, (uint64_t)about.st_ctim.tv_nsec};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        *stamp = (*stamp ^ words[i]) * 1099511628211u;
    return true;
}

static bool stamp_all(const request *r, const char *path, uint64_t *stamp, cli_error *error) {
    *stamp = 14695981039346656037u;
    if (!stamp_file(path, stamp, error)) return false;
    for (uint32_t i = 0; i < r->mesh_count; i++)
        if (!stamp_file(r->meshes[i], stamp, error)) return false;
    return !r->build.profile_path || stamp_file(r->build.profile_path, stamp, error);
}

/* A message about the whole scene has no file in front yet. */
static bool name_file(const char *path, cli_error *error) {
    char shown[208];
    const cli_error inner = *error;
    return cli_fail(error, CLI_FAILED, "%s: %s", cli_show_path(path, shown), inner.text);
}

static bool check(request *r, cli_error *error) {
    viewpoint aimed = r->picture.camera;
    return request_finish(r, error) &&
           (!(aimed.fov > 0) ||
            camera_aim(&aimed, r->picture.up, r->picture.width, r->picture.height, error));
}

bool still_begins(const char bytes[16]) { return request_begins_scene(bytes); }

static bool read_scene(request *r, const char *path, const char *const *names,
                       const char *const *values, size_t count, cli_error *error) {
    if (!request_read(r, path, error)) return false;
    for (size_t i = 0; i < count; i++)
        if (!request_set(r, "", names[i], values[i], error)) return name_file(path, error);
    return check(r, error) || name_file(path, error);
}

still *still_open(const char *path, const char *const *names, const char *const *values,
                  size_t count, uint32_t threads, uint64_t *stamp, cli_error *error) {
    still *s = calloc(1, sizeof *s);
    if (!s) return cli_fail(error, CLI_FAILED, "memory ran out"), NULL;
    request *r = &s->request;
    request_init(r);
    if (!read_scene(r, path, names, values, count, error) ||
        !(stamp_all(r, path, stamp, error) || name_file(path, error)))
        return still_close(s), NULL;
    r->build.silent = true;
    if (!r->build.threads) r->build.threads = threads;
    planes_list(&s->planes, r);
    return s;
}

void still_about(const still *s, still_info *info) {
    const picture *p = &s->request.picture;
    const char *method = s->request.build.build.method;
    *info = (still_info){p->width,        p->height, s->planes.plane, s->planes.count,
                         method ? method : "auto", s->broken};
}

static bool build(still *s, cli_error *error) {
    request *r = &s->request;
    if (!cli_scene_open(&s->scene, &r->build, r->meshes, (int)r->mesh_count, error)) return false;
    if (picture_prepare(&r->picture, &s->scene, r->ground, error) &&
        picture_begin(&r->picture, error)) {
        planes_list(&s->planes, r);
        return s->built = true;
    }
    cli_scene_close(&s->scene);
    return false;
}

bool still_rows(still *s, uint32_t first, uint32_t count, cli_error *error) {
    if (s->broken) return *error = s->failure, false;
    if (!s->built && !build(s, error)) {
        s->broken = true;
        s->failure = *error;
        return false;
    }
    return picture_rows(&s->request.picture, &s->scene, first, count, error);
}

void still_close(still *s) {
    if (!s) return;
    if (s->built) cli_scene_close(&s->scene);
    request_free(&s->request);
    free(s);
}
