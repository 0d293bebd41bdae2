/* still.h - a scene file as a picture whose rows are made when they are asked for. All that a host
 * of such pictures needs to know. */
#ifndef CLI_RENDER_STILL_H
#define CLI_RENDER_STILL_H

#include "../image/image.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct still still;

typedef struct still_info {
    uint32_t width, height;
    const image_plane *planes; /* R G B A and the scene's aov; values from still_rows() on */
    uint32_t plane_count;
    const char *method;        /* as it was asked for */
    bool broken;               /* the scene could not be made: all rows fail */
} still_info;

/* Whether these are the first bytes of a scene file. */
bool still_begins(const char bytes[16]);

/* Reads a scene file; no mesh.
 *   names, values  count lines that follow those of the file
 *   threads        for a scene that does not say; 0: one per processor
 *   stamp          out: another number when the scene, a mesh or the profile changed on disk
 * NULL on error; messages begin with the file's name. */
still *still_open(const char *path, const char *const *names, const char *const *values,
                  size_t count, uint32_t threads, uint64_t *stamp, cli_error *error);
void still_close(still *s); /* NULL is fine */

void still_about(const still *s, still_info *info);

/* Makes these rows, and the scene when it is the first time. One thread at a time; what is made may
 * be read by others meanwhile. */
bool still_rows(still *s, uint32_t first, uint32_t count, cli_error *error);

#ifdef __cplusplus
}
#endif
#endif
