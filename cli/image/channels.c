/* channels.c - which channels of an image are positions and normals, and what a file name asks for.
 *
 * Names as renderers write them: P and N (Cryptomatte tools, Nuke), LAYER.Position and LAYER.Normal
 * (Blender's multilayer EXR), __Pworld (RenderMan). */
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "image.h"

bool image_format_of(const char *path, image_format *format) {
    static const struct {
        const char *end;
        image_format format;
    } ends[] = {
        {".exr", IMAGE_EXR}, {".png", IMAGE_PNG}, {".tif", IMAGE_TIFF}, {".tiff", IMAGE_TIFF}};
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot && i < sizeof ends / sizeof *ends; i++) {
        if (strcasecmp(dot, ends[i].end) != 0) continue;
        *format = ends[i].format;
        return true;
    }
    return false;
}

/* "stem.axis", or the same behind a layer's name and a dot. */
static bool is_channel(const char *name, const char *stem, char axis) {
    char wanted[300];
    snprintf(wanted, sizeof wanted, "%s.%c", stem, axis);
    const size_t length = strlen(name), end = strlen(wanted);
    if (length < end || strcasecmp(name + length - end, wanted) != 0) return false;
    return length == end || name[length - end - 1] == '.';
}

static bool find_axis(const image_info *info, const char *stem, char axis, uint32_t *channel) {
    for (uint32_t i = 0; i < info->channel_count; i++) {
        if (!is_channel(info->channels[i].name, stem, axis)) continue;
        *channel = i;
        return true;
    }
    return false;
}

static bool find_three(const image_info *info, const char *stem, uint32_t channel[3]) {
    static const char axes[2][3] = {{'X', 'Y', 'Z'}, {'R', 'G', 'B'}};
    for (int set = 0; set < 2; set++)
        if (find_axis(info, stem, axes[set][0], &channel[0]) &&
            find_axis(info, stem, axes[set][1], &channel[1]) &&
            find_axis(info, stem, axes[set][2], &channel[2]))
            return true;
    return false;
}

static bool find_rgb(const image_info *info, uint32_t channel[3]) {
    int found = 0;
    for (int axis = 0; axis < 3; axis++)
        for (uint32_t i = 0; i < info->channel_count; i++) {
            const char *name = info->channels[i].name;
            if (name[0] != "RGB"[axis] || name[1] != '\0') continue;
            channel[axis] = i;
            found++;
            break;
        }
    return found == 3;
}

static bool find_positions(const image_info *info, const char *which, uint32_t channel[3]) {
    if (which && *which) return find_three(info, which, channel);
    return find_three(info, "P", channel) || find_three(info, "Position", channel) ||
           find_three(info, "__Pworld", channel) || find_rgb(info, channel);
}

bool image_find_positions(const image_info *info, const char *which, const char *path,
                          uint32_t channel[3], cli_error *error) {
    char shown[208];
    cli_show_path(path, shown);
    if (!find_positions(info, which, channel))
        return cli_fail(error, CLI_FAILED,
                        "%s: has no channels of positions: P.X P.Y P.Z, LAYER.Position.X .Y .Z or "
                        "R G B are wanted",
                        shown);
    for (int axis = 0; axis < 3; axis++) {
        const image_channel *c = &info->channels[channel[axis]];
        if (c->type == IMAGE_FLOAT || c->type == IMAGE_DOUBLE) continue;
        return cli_fail(error, CLI_FAILED,
                        "%s: channel %.60s holds %s: positions must be 32-bit floats", shown,
                        c->name, c->type == IMAGE_HALF ? "half floats" : "integers");
    }
    return true;
}

bool image_find_normals(const image_info *info, uint32_t channel[3]) {
    return find_three(info, "N", channel) || find_three(info, "Normal", channel);
}
