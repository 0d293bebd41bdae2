/* One file: a header, per level its sizes, then the arrays, then a hash of all that. Numbers are in
 * the machine's own order; the magic number reads differently on a machine with another. */
#define _GNU_SOURCE /* mkostemp, secure_getenv */
#include "topology/cache.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/memory.h"
#include "topology/decimate.h"

#define MAGIC UINT64_C(0x31564c574f444148) /* HADOWLV1 */
/* Grows with the file's form and with anything that changes what a build makes. */
#define VERSION   3
#define PATH_SIZE 4096

typedef struct header {
    uint64_t magic;
    uint32_t version, count;
    ss_cache_key key;
} header;

typedef struct level_header {
    uint64_t vertex_count, triangle_count;
    double deviation_rms, deviation_max;
} level_header;

typedef struct file_header {
    header head;
    level_header level[SS_LEVELS_MOST];
} file_header;

static void log_line(const softshadow_options *host, const char *what, const char *path,
                     const char *why) {
    char text[PATH_SIZE + 200];
    if (!host->log) return;
    snprintf(text, sizeof text, "SOFTSHADOW_CACHE: %s %s: %s", what, path, why);
    host->log(host->user, 1, text);
}

const char *ss_cache_directory(void) {
    const char *directory = secure_getenv("SOFTSHADOW_CACHE");
    return directory && directory[0] ? directory : NULL;
}

static bool path_of(char path[PATH_SIZE], const char *directory, const ss_cache_key *key,
                    const char *ending) {
    const int n =
        snprintf(path, PATH_SIZE, "%s/%016llx%016llx%s", directory, (unsigned long long)key->hash.a,
                 (unsigned long long)key->hash.b, ending);
    return n > 0 && n < PATH_SIZE;
}

static size_t level_bytes(const level_header *level) {
    return (size_t)level->vertex_count * sizeof(float[3]) +
           (size_t)level->triangle_count * sizeof(uint32_t[3]);
}

/* ---- Reading ---- */

/* The bytes of a plain file of a possible size; NULL with a reason, without one: no such file. */
static unsigned char *read_file(const char *path, size_t most, size_t *size, const char **why) {
    unsigned char *bytes = NULL;
    struct stat info;
    /* NONBLOCK: a foreign FIFO must not hold us up. */
    const int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    *why = file < 0 && errno != ENOENT ? strerror(errno) : NULL;
    if (file < 0) return NULL;
    size_t got = 0;
    if (fstat(file, &info) != 0 || !S_ISREG(info.st_mode))
        *why = "is not a file";
    else if (info.st_size < (off_t)sizeof(file_header) || (uint64_t)info.st_size > most) {
        *why = "has an impossible size";
    } else if (!(bytes = ss_alloc((size_t)info.st_size, 1)))
        *why = "is too large for memory";
    while (bytes && got < (size_t)info.st_size) {
        const ssize_t n = read(file, bytes + got, (size_t)info.st_size - got);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) {
            *why = n < 0 ? strerror(errno) : "became shorter";
            ss_free(bytes);
            bytes = NULL;
        } else
            got += (size_t)n;
    }
    close(file);
    *size = got;
    return bytes;
}

/* Everything the header says against what is possible; sizes first, so that nothing overflows. */
static const char *check_header(const file_header *file, const ss_cache_key *key, size_t size) {
    const header *head = &file->head;
    if (head->magic != MAGIC) return "is no file of ours";
    if (head->version != VERSION) return "is of another version";
    if (memcmp(&head->key, key, sizeof *key) != 0) return "belongs to another mesh";
    if (head->count > SS_LEVELS_MOST) return "has too many levels";
    size_t expected = sizeof *file + sizeof(ss_hash);
    uint64_t triangles = key->triangle_count;
    for (uint32_t i = 0; i < head->count; i++) {
        const level_header *level = &file->level[i];
        if (level->triangle_count == 0 || level->triangle_count >= triangles) {
            return "has an impossible number of triangles";
        }
        if (level->vertex_count < 3 || level->vertex_count > key->vertex_count) {
            return "has an impossible number of vertices";
        }
        if (!(level->deviation_rms >= 0 && level->deviation_rms <= level->deviation_max &&
              level->deviation_max <= 2)) {
            return "has an impossible deviation";
        }
        triangles = level->triangle_count;
        expected += level_bytes(level);
    }
    return expected == size ? NULL : "has the wrong size";
}

static const char *check_level(const ss_level *level) {
    for (size_t i = 0; i < 3 * level->vertex_count; i++) {
        /* The mesh is within [0, 1]; a collapse may put a vertex some way out. */
        if (!(fabsf(level->vertices[i]) <= 4)) return "has an impossible vertex";
    }
    for (size_t t = 0; t < level->triangle_count; t++) {
        const uint32_t *c = level->indices + 3 * t;
        for (int k = 0; k < 3; k++) {
            if (c[k] >= level->vertex_count || c[k] == c[(k + 1) % 3]) {
                return "has an impossible triangle";
            }
        }
    }
    return NULL;
}

static const char *read_levels(const file_header *file, const unsigned char *at,
                               ss_mesh_levels *out) {
    for (uint32_t i = 0; i < file->head.count; i++) {
        const level_header *from = &file->level[i];
        ss_level *level = &out->level[out->count++];
        if (!ss_level_allocate(level, from->vertex_count, from->triangle_count)) {
            return "is too large for memory";
        }
        const size_t vertices = from->vertex_count * sizeof(float[3]);
        memcpy(level->vertices, at, vertices);
        memcpy(level->indices, at + vertices, level_bytes(from) - vertices);
        level->deviation_rms = from->deviation_rms, level->deviation_max = from->deviation_max;
        at += level_bytes(from);
        const char *why = check_level(level);
        if (why) return why;
    }
    return NULL;
}

static const char *parse(const unsigned char *bytes, size_t size, const ss_cache_key *key,
                         ss_mesh_levels *out) {
    file_header file;
    ss_hash found = {0}, kept;
    memcpy(&file, bytes, sizeof file);
    const char *why = check_header(&file, key, size);
    if (why) return why;
    ss_hash_add(&found, bytes, size - sizeof kept);
    memcpy(&kept, bytes + size - sizeof kept, sizeof kept);
    if (found.a != kept.a || found.b != kept.b) return "is damaged";
    return read_levels(&file, bytes + sizeof file, out);
}

bool ss_cache_load(const char *directory, const ss_cache_key *key, ss_mesh_levels *out,
                   const softshadow_options *host) {
    char path[PATH_SIZE];
    size_t size = 0;
    const char *why;
    *out = (ss_mesh_levels){0};
    if (!path_of(path, directory, key, ".levels")) return false;
    const size_t most =
        sizeof(file_header) + sizeof(ss_hash) +
        SS_LEVELS_MOST * sizeof(float[3]) * (size_t)(key->vertex_count + key->triangle_count);
    unsigned char *bytes = read_file(path, most, &size, &why);
    if (bytes) why = parse(bytes, size, key, out);
    if (why) {
        log_line(host, "ignored", path, why);
        ss_mesh_levels_free(out);
    }
    const bool good = bytes && !why;
    ss_free(bytes);
    return good;
}

/* ---- Writing ---- */

static bool put(int file, const void *bytes, size_t size) {
    const unsigned char *at = bytes;
    while (size > 0) {
        const ssize_t n = write(file, at, size);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        at += n, size -= (size_t)n;
    }
    return true;
}

/* The file's bytes, hash included. */
static unsigned char *compose(const ss_cache_key *key, const ss_mesh_levels *levels, size_t *size) {
    file_header file;
    memset(&file, 0, sizeof file);
    file.head = (header){MAGIC, VERSION, levels->count, *key};
    *size = sizeof file + sizeof(ss_hash);
    for (uint32_t i = 0; i < levels->count; i++) {
        const ss_level *level = &levels->level[i];
        file.level[i] = (level_header){level->vertex_count, level->triangle_count,
                                       level->deviation_rms, level->deviation_max};
        *size += level_bytes(&file.level[i]);
    }
    unsigned char *bytes = ss_alloc(*size, 1), *at = bytes;
    if (!bytes) return NULL;
    memcpy(at, &file, sizeof file), at += sizeof file;
    for (uint32_t i = 0; i < levels->count; i++) {
        const ss_level *level = &levels->level[i];
        const size_t vertices = level->vertex_count * sizeof(float[3]);
        memcpy(at, level->vertices, vertices);
        memcpy(at + vertices, level->indices, level_bytes(&file.level[i]) - vertices);
        at += level_bytes(&file.level[i]);
    }
    ss_hash hash = {0};
    ss_hash_add(&hash, bytes, *size - sizeof hash);
    memcpy(at, &hash, sizeof hash);
    return bytes;
}

static bool write_aside(char aside[PATH_SIZE], const char *path, const void *bytes, size_t size) {
    const int file = mkostemp(aside, O_CLOEXEC);
    if (file < 0) return false;
    bool good = put(file, bytes, size);
    const int reason = errno;
    if (close(file) != 0)
        good = false;
    else
        errno = reason;
    if (good) good = rename(aside, path) == 0;
    if (!good) {
        const int kept = errno;
        unlink(aside);
        errno = kept;
    }
    return good;
}

void ss_cache_save(const char *directory, const ss_cache_key *key, const ss_mesh_levels *levels,
                   const softshadow_options *host) {
    char path[PATH_SIZE], aside[PATH_SIZE];
    size_t size;
    if (!path_of(path, directory, key, ".levels") || !path_of(aside, directory, key, ".XXXXXX")) {
        log_line(host, "did not write", directory, "the name is too long");
        return;
    }
    unsigned char *bytes = compose(key, levels, &size);
    if (!bytes) {
        log_line(host, "did not write", path, "out of memory");
        return;
    }
    mkdir(directory, 0777); /* if it is not there yet; what else may be wrong is said below */
    if (!write_aside(aside, path, bytes, size)) {
        log_line(host, "did not write", path, strerror(errno));
    }
    ss_free(bytes);
}
