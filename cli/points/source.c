/* What all point readers share: names of formats, opening, blocks. */
#include <endian.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "points.h"

const char *const points_format_names[] = {"csv", "ply", "npy", "raw", "raw6", "image", NULL};

static const points_reader *const readers[] = {
    [POINTS_TEXT] = &points_text_reader, [POINTS_PLY] = &points_ply_reader,
    [POINTS_NPY] = &points_npy_reader,   [POINTS_RAW] = &points_raw_reader,
    [POINTS_RAW6] = &points_raw_reader,  [POINTS_IMAGE] = &points_image_reader,
};

points_format points_format_of(const char *path) {
    static const struct {
        const char *ending;
        points_format format;
    } endings[] = {
        {".csv", POINTS_TEXT},  {".txt", POINTS_TEXT},  {".tsv", POINTS_TEXT},
        {".xyz", POINTS_TEXT},  {".asc", POINTS_TEXT},  {".ply", POINTS_PLY},
        {".npy", POINTS_NPY},   {".raw", POINTS_RAW},   {".f32", POINTS_RAW},
        {".exr", POINTS_IMAGE}, {".tif", POINTS_IMAGE}, {".tiff", POINTS_IMAGE},
        {".png", POINTS_IMAGE}, {".hdr", POINTS_IMAGE}, {".pfm", POINTS_IMAGE},
    };
    const char *name = strrchr(path, '/'), *ending = strrchr(name ? name : path, '.');
    for (size_t i = 0; ending && i < sizeof endings / sizeof *endings; i++)
        if (strcasecmp(ending, endings[i].ending) == 0) return endings[i].format;
    return POINTS_NO_FORMAT;
}

/* A stream that is plainly of another format than was said is told by its first bytes. */
static bool check_signature(points_source *source, cli_error *error) {
    if (source->format == POINTS_IMAGE || !cli_input_need(&source->input, 4, error))
        return source->format == POINTS_IMAGE;
    static const struct {
        const char *bytes;
        size_t size;
        points_format format;
    } signs[] = {{"\x93NUM", 4, POINTS_NPY},
                 {"ply", 3, POINTS_PLY},
                 {"v/1\x01", 4, POINTS_IMAGE},
                 {"\x89PNG", 4, POINTS_IMAGE}};
    for (size_t i = 0; i < sizeof signs / sizeof *signs; i++) {
        bool is = cli_input_waiting(&source->input) >= signs[i].size &&
                  memcmp(cli_input_at(&source->input), signs[i].bytes, signs[i].size) == 0;
        /* Raw floats may begin with any bytes. */
        if (!is || signs[i].format == source->format || source->format == POINTS_RAW ||
            source->format == POINTS_RAW6)
            continue;
        return cli_fail(error, CLI_FAILED, "%s: is %s, not %s: --input-format %s is allowed",
                        source->input.name, points_format_names[signs[i].format],
                        points_format_names[source->format], points_format_names[signs[i].format]);
    }
    return true;
}

bool points_source_open(points_source *source, const char *path, points_format format,
                        const char *channels, cli_error *error) {
    bool standard = strcmp(path, "-") == 0;
    *source = (points_source){.path = path,
                              .channels = channels,
                              .count = POINTS_UNKNOWN,
                              .input.fd = -1,
                              .format = format};
    if (format == POINTS_NO_FORMAT)
        source->format = standard ? POINTS_TEXT : points_format_of(path);
    char shown[208];
    if (source->format == POINTS_NO_FORMAT)
        return cli_fail(
            error, CLI_USAGE,
            "%s: its name tells no point format (.csv .txt .xyz .ply .npy .raw .exr ...), "
            "--input-format csv, ply, npy, raw, raw6 or image is allowed",
            cli_show_path(path, shown));
    if (source->format == POINTS_IMAGE && standard)
        return cli_fail(error, CLI_USAGE, "standard input: an image is read from a file only");
    source->reader = readers[source->format];
    if (cli_input_open(&source->input, path, error) && check_signature(source, error) &&
        source->reader->open(source, error))
        return true;
    points_source_close(source);
    return false;
}

bool points_source_read(points_source *source, points_block *block, size_t most, cli_error *error) {
    block->count = 0;
    block->carried.length = 0;
    block->type = source->type;
    block->width = 0;
    if (!source->reader->read(source, block, most, error)) return false;
    source->given += block->count;
    return !block->carried.failed ||
           cli_fail(error, CLI_FAILED, "%s: memory ran out", source->input.name);
}

bool points_source_tally(points_source *source, cli_error *error) {
    if (source->count != POINTS_UNKNOWN) return true;
    if (source->input.regular) return source->reader->tally(source, error);
    return cli_fail(error, CLI_USAGE,
                    "%s: how many points there are must be known beforehand, a file is allowed",
                    source->input.name);
}

bool points_source_seek(points_source *source, uint64_t first, cli_error *error) {
    source->ended = false;
    if (!source->input.regular || !source->reader->seek)
        return cli_fail(error, CLI_USAGE, "%s: a part of it can only be had from a file of points",
                        source->input.name);
    return source->reader->seek(source, first, error);
}

void points_source_close(points_source *source) {
    if (source->reader && source->reader->close) source->reader->close(source);
    free(source->state);
    source->state = NULL;
    cli_text_free(&source->header);
    cli_input_close(&source->input);
}

bool points_block_reserve(points_block *block, const points_source *source, size_t count,
                          cli_error *error) {
    size_t item = source->type == SOFTSHADOW_F64 ? sizeof(double) : sizeof(float);
    size_t room = count ? count : 1;
    *block = (points_block){.room = count, .type = source->type};
    block->positions = calloc(room, 3 * item);
    bool fine = block->positions != NULL;
    if (source->normals) fine = (block->normals = calloc(room, 3 * sizeof(float))) && fine;
    if (source->lines) {
        fine = (block->ends = calloc(room, sizeof *block->ends)) && fine;
        fine = (block->cuts = calloc(room, sizeof *block->cuts)) && fine;
    }
    return fine || cli_fail(error, CLI_FAILED, "%s: memory ran out", source->input.name);
}

void points_block_free(points_block *block) {
    free(block->positions);
    free(block->normals);
    free(block->ends);
    free(block->cuts);
    cli_text_free(&block->carried);
    *block = (points_block){0};
}

float points_le_float(const void *from) {
    uint32_t bits;
    float value;
    memcpy(&bits, from, sizeof bits);
    bits = le32toh(bits);
    memcpy(&value, &bits, sizeof value);
    return value;
}

double points_le_double(const void *from) {
    uint64_t bits;
    double value;
    memcpy(&bits, from, sizeof bits);
    bits = le64toh(bits);
    memcpy(&value, &bits, sizeof value);
    return value;
}

void points_put_le_float(void *to, float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    bits = htole32(bits);
    memcpy(to, &bits, sizeof bits);
}

void points_put_le_double(void *to, double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    bits = htole64(bits);
    memcpy(to, &bits, sizeof bits);
}
