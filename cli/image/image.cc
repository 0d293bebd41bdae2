// image.cc - image.h on OpenImageIO: the body of softshadow-image.so.
//
// Every entry catches everything: an exception must not unwind through the program's C frames.
#include "image.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

using namespace OIIO;

struct image_file {
    std::unique_ptr<ImageInput> input;
    std::string path;
    std::vector<image_channel> channels;
};

namespace {

// More than any camera or film scanner makes; what a damaged header claims is usually beyond it.
constexpr uint64_t max_pixels = uint64_t(1) << 30;

bool refuse(char *why, const std::string &text) {
    std::string line = text;
    for (char &c : line)
        if (c == '\n' || c == '\r') c = ' ';
    std::snprintf(why, IMAGE_WHY, "%s", line.c_str());
    return false;
}

// Runs body and turns whatever it throws into a line of text.
template <class Body> bool guarded(char *why, Body body) noexcept {
    try {
        return body();
    } catch (const std::bad_alloc &) {
        std::snprintf(why, IMAGE_WHY, "memory ran out");
    } catch (const std::exception &e) {
        std::snprintf(why, IMAGE_WHY, "%s", e.what());
    } catch (...) {
        std::snprintf(why, IMAGE_WHY, "OpenImageIO threw something unknown");
    }
    return false;
}

image_type type_of(TypeDesc type) {
    switch (type.basetype) {
    case TypeDesc::HALF:
        return IMAGE_HALF;
    case TypeDesc::FLOAT:
        return IMAGE_FLOAT;
    case TypeDesc::DOUBLE:
        return IMAGE_DOUBLE;
    default:
        return IMAGE_INTEGER;
    }
}

bool open_file(std::unique_ptr<image_file> &out, const char *path, char *why) {
    auto made = std::make_unique<image_file>();
    made->path = path;
    made->input = ImageInput::open(path);
    if (!made->input) return refuse(why, std::string(path) + ": " + OIIO::geterror());
    const ImageSpec &spec = made->input->spec();
    const uint64_t pixels = uint64_t(spec.width) * uint64_t(spec.height);
    if (spec.width <= 0 || spec.height <= 0 || spec.depth > 1 || pixels > max_pixels ||
        spec.nchannels <= 0 || spec.nchannels > IMAGE_MAX_CHANNELS || spec.deep)
        return refuse(why, std::string(path) + ": a flat image of up to 2^30 pixels is wanted");
    for (int c = 0; c < spec.nchannels; c++)
        made->channels.push_back(
            {spec.channelnames[size_t(c)].c_str(), type_of(spec.channelformat(c))});
    out = std::move(made);
    return true;
}

image_file *image_open(const char *path, char *why) {
    std::unique_ptr<image_file> made;
    return guarded(why, [&] { return open_file(made, path, why); }) ? made.release() : nullptr;
}

void image_close(image_file *image) { delete image; }

void image_about(const image_file *image, image_info *info) {
    const ImageSpec &spec = image->input->spec();
    info->width = uint32_t(spec.width);
    info->height = uint32_t(spec.height);
    info->x = spec.x;
    info->y = spec.y;
    info->channel_count = uint32_t(image->channels.size());
    info->channels = image->channels.data();
}

bool image_read(image_file *image, uint32_t channel, float *values, size_t stride, char *why) {
    return guarded(why, [&] {
        const int c = int(channel);
        if (image->input->read_image(0, 0, c, c + 1, TypeFloat, values,
                                     stride_t(stride * sizeof(float))))
            return true;
        return refuse(why, image->path + ": " + image->input->geterror());
    });
}

const char *name_of(image_format format) {
    switch (format) {
    case IMAGE_PNG:
        return "png";
    case IMAGE_TIFF:
        return "tiff";
    default:
        return "openexr";
    }
}

// Hands a finished file over as malloc'ed memory, which C can own.
bool hand_over(const std::vector<unsigned char> &file, void **bytes, size_t *size, char *why) {
    if (file.empty()) return refuse(why, "the encoder made nothing");
    *bytes = std::malloc(file.size());
    if (!*bytes) return refuse(why, "memory ran out");
    std::memcpy(*bytes, file.data(), file.size());
    *size = file.size();
    return true;
}

// Encodes packed pixels. The PNG writer may return true and only leave a message behind; the TIFF
// writer (2.4.7) leaves one, about EXIF data, behind every good file.
bool encode_pixels(const ImageSpec &spec, const char *format, TypeDesc type, const void *pixels,
                   std::vector<unsigned char> &file, char *why) {
    auto output = ImageOutput::create(format);
    if (!output) return refuse(why, OIIO::geterror());
    Filesystem::IOVecOutput memory(file);
    bool good = output->set_ioproxy(&memory) && output->open("memory", spec) &&
                output->write_image(type, pixels);
    good = output->close() && good;
    if (good && (!output->has_error() || std::strcmp(format, "tiff") == 0)) return true;
    const std::string text = output->geterror();
    return refuse(why, text.empty() ? std::string(format) + ": encoding failed" : text);
}

ImageSpec spec_of(const image_picture *picture, image_format format) {
    ImageSpec spec(int(picture->width), int(picture->height), int(picture->plane_count),
                   format == IMAGE_PNG ? TypeUInt8 : TypeFloat);
    spec.channelnames.clear();
    for (uint32_t i = 0; i < picture->plane_count; i++)
        spec.channelnames.push_back(picture->planes[i].name);
    spec.alpha_channel = -1;
    spec.attribute("oiio:ColorSpace", picture->srgb ? "sRGB" : "Linear");
    if (format != IMAGE_PNG) spec.attribute("compression", "zip");
    for (const char *const *m = picture->metadata; m && m[0]; m += 2) spec.attribute(m[0], m[1]);
    if (picture->world_to_ndc) {
        float turned[16]; // points are rows in an EXR: v M
        for (int i = 0; i < 16; i++) turned[i] = float(picture->world_to_ndc[i % 4 * 4 + i / 4]);
        spec.attribute("worldToNDC", TypeMatrix, turned);
    }
    return spec;
}

std::vector<float> interleave(const image_picture *picture) {
    const size_t pixels = size_t(picture->width) * picture->height, n = picture->plane_count;
    std::vector<float> packed(pixels * n);
    for (size_t c = 0; c < n; c++) {
        const image_plane &plane = picture->planes[c];
        for (size_t i = 0; i < pixels; i++) packed[i * n + c] = plane.values[i * plane.stride];
    }
    return packed;
}

bool image_encode(const image_picture *picture, image_format format, void **bytes, size_t *size,
                  char *why) {
    return guarded(why, [&] {
        if (format == IMAGE_PNG && picture->plane_count > 4)
            return refuse(why, "a PNG holds 1 to 4 channels");
        std::vector<unsigned char> file;
        const std::vector<float> packed = interleave(picture);
        return encode_pixels(spec_of(picture, format), name_of(format), TypeFloat, packed.data(),
                             file, why) &&
               hand_over(file, bytes, size, why);
    });
}

// The channels of the file that a plane of the picture replaces are left out.
bool replaced(const std::string &name, const image_picture *added) {
    for (uint32_t i = 0; i < added->plane_count; i++)
        if (name == added->planes[i].name) return true;
    return false;
}

struct kept_channel {
    size_t offset, bytes; // within a pixel of the input
};

// The output's spec: the input's, less what is replaced, plus what is added, in float.
ImageSpec spec_like(const ImageSpec &in, const image_picture *added,
                    std::vector<kept_channel> &kept) {
    ImageSpec out = in;
    out.channelnames.clear();
    out.channelformats.clear();
    out.tile_width = out.tile_height = out.tile_depth = 0;
    size_t offset = 0;
    for (int c = 0; c < in.nchannels; c++) {
        TypeDesc type = in.channelformat(c);
        const std::string &name = in.channelnames[size_t(c)];
        if (!replaced(name, added)) {
            kept.push_back({offset, type.size()});
            out.channelnames.push_back(name);
            out.channelformats.push_back(type);
        }
        offset += type.size();
    }
    for (uint32_t i = 0; i < added->plane_count; i++) {
        out.channelnames.push_back(added->planes[i].name);
        out.channelformats.push_back(TypeFloat);
    }
    out.nchannels = int(out.channelnames.size());
    out.alpha_channel = out.z_channel = -1;
    for (const char *const *m = added->metadata; m && m[0]; m += 2) out.attribute(m[0], m[1]);
    return out;
}

bool encode_like(image_file *from, const image_picture *added, std::vector<unsigned char> &file,
                 char *why) {
    const ImageSpec &in = from->input->spec();
    if (added->width != uint32_t(in.width) || added->height != uint32_t(in.height))
        return refuse(why, from->path + ": the planes to add have another size");
    for (const image_channel &c : from->channels)
        if (c.type == IMAGE_DOUBLE) return refuse(why, from->path + ": an EXR cannot hold doubles");
    std::vector<kept_channel> kept;
    const ImageSpec out = spec_like(in, added, kept);
    const size_t pixels = size_t(in.width) * size_t(in.height);
    const size_t in_bytes = in.pixel_bytes(true), out_bytes = out.pixel_bytes(true);
    std::vector<unsigned char> source(pixels * in_bytes), target(pixels * out_bytes);
    if (!from->input->read_image(0, 0, 0, in.nchannels, TypeUnknown, source.data()))
        return refuse(why, from->path + ": " + from->input->geterror());
    for (size_t i = 0; i < pixels; i++) {
        unsigned char *to = &target[i * out_bytes];
        for (const kept_channel &k : kept) {
            std::memcpy(to, &source[i * in_bytes + k.offset], k.bytes);
            to += k.bytes;
        }
        for (uint32_t a = 0; a < added->plane_count; a++, to += sizeof(float))
            std::memcpy(to, &added->planes[a].values[i * added->planes[a].stride], sizeof(float));
    }
    return encode_pixels(out, "openexr", TypeUnknown, target.data(), file, why);
}

bool image_encode_like(image_file *from, const image_picture *added, void **bytes, size_t *size,
                       char *why) {
    return guarded(why, [&] {
        std::vector<unsigned char> file;
        return encode_like(from, added, file, why) && hand_over(file, bytes, size, why);
    });
}

void image_free_bytes(void *bytes) { std::free(bytes); }

} // namespace

extern "C" __attribute__((visibility("default"))) const image_module *softshadow_image_module(void);

const image_module *softshadow_image_module(void) {
    static const image_module module = {
        IMAGE_VERSION, image_open,   image_close,       image_about,
        image_read,    image_encode, image_encode_like, image_free_bytes,
    };
    return &module;
}
