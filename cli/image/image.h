/* image.h - what the command line asks of image files.
 *
 * OpenImageIO brings 260 shared objects and 170 ms of loading with it, so it lives in a module of
 * its own, softshadow-image.so, which only commands that touch an image load (image_load()).
 * Between the two stands this plain C interface; no C++ exception crosses it.
 *
 * Files are encoded into memory and written by the caller: OpenImageIO reports success for a PNG
 * that met a full disk, and output.h has the one place that writes a file safely. */
#ifndef CLI_IMAGE_H
#define CLI_IMAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "../error.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { IMAGE_WHY = 512, IMAGE_VERSION = 2, IMAGE_MAX_CHANNELS = 1024 };

typedef enum { IMAGE_EXR, IMAGE_PNG, IMAGE_TIFF } image_format;

/* What a channel's numbers are made of in the file. */
typedef enum { IMAGE_HALF, IMAGE_FLOAT, IMAGE_DOUBLE, IMAGE_INTEGER } image_type;

typedef struct image_file image_file; /* a file opened for reading */

typedef struct image_channel {
    const char *name;
    image_type type;
} image_channel;

typedef struct image_info {
    uint32_t width, height; /* of the data window */
    int32_t x, y;           /* where the data window begins */
    uint32_t channel_count;
    const image_channel *channels; /* valid until the image is closed */
} image_info;

/* One channel to be written: width x height floats, `stride` floats from one pixel to the next. */
typedef struct image_plane {
    const char *name;
    const float *values;
    size_t stride;
} image_plane;

typedef struct image_picture {
    uint32_t width, height;
    const image_plane *planes;
    uint32_t plane_count;
    /* PNG: the values are encoded for a screen already (sRGB), and are marked so; else linear */
    bool srgb;
    const char *const *metadata; /* name, value, name, value, ..., NULL; or NULL */
    const double *world_to_ndc;  /* 16, row-major: of a map's light; or NULL. EXR's worldToNDC */
} image_picture;

/* Every function that can fail returns false (or NULL) and puts one line into why[IMAGE_WHY]. */
typedef struct image_module {
    uint32_t version; /* IMAGE_VERSION */

    /* Opens an EXR, TIFF, PNG or what else OpenImageIO reads; the file's first image. */
    image_file *(*open)(const char *path, char *why);
    void (*close)(image_file *image);
    void (*about)(const image_file *image, image_info *info);

    /* Reads a channel of the whole image as float: width x height values, `stride` floats apart. */
    bool (*read)(image_file *image, uint32_t channel, float *values, size_t stride, char *why);

    /* Makes a file in memory: EXR and TIFF hold 32-bit floats, PNG 8 bits, clamped to 0..1. */
    bool (*encode)(const image_picture *picture, image_format format, void **bytes, size_t *size,
                   char *why);

    /* The image `from` again as EXR, all its channels bit for bit, its metadata and windows, with
     * the picture's planes added (or put in the place of channels of the same name). */
    bool (*encode_like)(image_file *from, const image_picture *added, void **bytes, size_t *size,
                        char *why);
    void (*free_bytes)(void *bytes);
} image_module;

/* The module's one symbol. */
typedef const image_module *image_entry(void);
#define IMAGE_ENTRY "softshadow_image_module"

/* ---- In the program itself -----------------------------------------------------------------*/

/* Loads the module: from $SOFTSHADOW_MODULES, else from beside a program that was not installed,
 * else from where it was installed. NULL with an error. */
const image_module *image_load(cli_error *error);

/* The format that is meant by the end of a file's name (.exr .png .tif .tiff); false if none. */
bool image_format_of(const char *path, image_format *format);

/* Which three channels hold positions: P.X P.Y P.Z or LAYER.Position.X ..., else R G B. Half floats
 * are refused: their steps are 1/1024 of a coordinate, far wider than any contact.
 *   which  a name to look for before .X .Y .Z (or .R .G .B) instead, or NULL
 *   path   for the message */
bool image_find_positions(const image_info *info, const char *which, const char *path,
                          uint32_t channel[3], cli_error *error);

/* Likewise normals: N.X N.Y N.Z or LAYER.Normal.X ...; half floats will do. False if there are
 * none. */
bool image_find_normals(const image_info *info, uint32_t channel[3]);

#ifdef __cplusplus
}
#endif
#endif
