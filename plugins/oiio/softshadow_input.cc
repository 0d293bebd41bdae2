// softshadow_input.cc - scene files (.softshadow) as images: an ImageInput for OpenImageIO.
//
// Hosts open an image two to four times before they read a pixel, so opening reads the scene file
// and nothing else. Meshes are read and the scene is built when the first tile is asked for, once
// in a process: scenes are shared by all inputs that name the same file with the same settings, and
// the latest few are kept. Bands of rows are made under the scene's lock, on the library's own
// threads; a host that stops between two tiles leaves a scene that any later read goes on with.
#include <OpenImageIO/imageio.h>

#include <softshadow.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstring>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <unistd.h>
#include <vector>

#include "cli/render/still.h"

using namespace OIIO;

namespace {

constexpr int tile_side = 64;
constexpr size_t most_kept = 4; // scenes that no input has open any more

struct scene {
    std::unique_ptr<still, void (*)(still *)> picture{nullptr, still_close};
    std::mutex lock; // of still_rows()
    std::string key;
    std::atomic<bool> failed{false};
};

struct scene_cache {
    std::mutex lock;
    std::list<std::shared_ptr<scene>> latest;

    // The scene that is there already, if it is; else this one, which is remembered.
    std::shared_ptr<scene> find(std::shared_ptr<scene> made) {
        std::lock_guard<std::mutex> guard(lock);
        for (auto i = latest.begin(); i != latest.end(); ++i) {
            if ((*i)->key != made->key) continue;
            if (!(*i)->failed) made = *i;
            latest.erase(i);
            break;
        }
        latest.push_front(made);
        if (latest.size() > most_kept) latest.pop_back();
        return made;
    }
};

// Never destroyed: at the end of a process other threads may still read.
scene_cache &cache() {
    static scene_cache *only = new scene_cache;
    return *only;
}

class SoftshadowInput final : public ImageInput {
  public:
    const char *format_name() const override { return "softshadow"; }
    bool valid_file(const std::string &name) const override;
    bool open(const std::string &name, ImageSpec &spec) override;
    bool open(const std::string &name, ImageSpec &spec, const ImageSpec &config) override;
    bool close() override;
    bool read_native_scanline(int subimage, int miplevel, int y, int z, void *data) override;
    bool read_native_tile(int subimage, int miplevel, int x, int y, int z, void *data) override;

  private:
    std::shared_ptr<scene> m_scene;

    template <class Body> bool guarded(Body body);
    bool open_scene(const std::string &name, const ImageSpec &config);
    void describe();
    bool read_box(int x0, int x1, int y0, int y1, int row_pixels, float *to);
};

// No exception leaves: hosts built without them, and C ones, load plugins, too.
template <class Body> bool SoftshadowInput::guarded(Body body) {
    try {
        return body();
    } catch (const std::bad_alloc &) {
        errorfmt("memory ran out");
    } catch (const std::exception &e) {
        errorfmt("{}", e.what());
    }
    return false;
}

bool SoftshadowInput::valid_file(const std::string &name) const {
    char head[16] = {0};
    std::FILE *file = std::fopen(name.c_str(), "rb");
    if (!file) return false;
    const bool any = std::fread(head, 1, sizeof head, file) > 0;
    std::fclose(file);
    return any && still_begins(head);
}

bool SoftshadowInput::open(const std::string &name, ImageSpec &spec) {
    return open(name, spec, ImageSpec());
}

bool SoftshadowInput::open(const std::string &name, ImageSpec &spec, const ImageSpec &config) {
    close();
    const bool opened = guarded([&] { return open_scene(name, config); });
    if (opened) spec = m_spec;
    return opened;
}

// A host's hints "softshadow:NAME" are lines that follow those of the file.
bool SoftshadowInput::open_scene(const std::string &name, const ImageSpec &config) {
    static const std::string prefix = "softshadow:";
    std::vector<std::string> texts;
    texts.reserve(2 * config.extra_attribs.size());
    std::vector<const char *> names, values;
    auto made = std::make_shared<scene>();
    // a child's use of a parent's scene is refused
    made->key = std::to_string(getpid()) + '\0' + name;
    for (const ParamValue &hint : config.extra_attribs) {
        if (!Strutil::starts_with(hint.name(), prefix)) continue;
        texts.push_back(hint.name().string().substr(prefix.size()));
        names.push_back(texts.back().c_str());
        texts.push_back(hint.get_string());
        values.push_back(texts.back().c_str());
        made->key += '\0' + texts[texts.size() - 2] + '\0' + texts.back();
    }
    int threads = 0;
    if (!OIIO::getattribute("threads", threads) || threads < 0) threads = 0;
    uint64_t stamp = 0;
    cli_error error;
    made->picture.reset(still_open(name.c_str(), names.data(), values.data(), names.size(),
                                   uint32_t(threads), &stamp, &error));
    if (!made->picture) {
        errorfmt("{}", error.text);
        return false;
    }
    made->key += '\0' + std::to_string(stamp);
    m_scene = cache().find(made);
    describe();
    return true;
}

void SoftshadowInput::describe() {
    still_info info;
    still_about(m_scene->picture.get(), &info);
    m_spec = ImageSpec(int(info.width), int(info.height), int(info.plane_count), TypeFloat);
    m_spec.tile_width = m_spec.tile_height = tile_side;
    m_spec.tile_depth = 1;
    for (size_t i = 0; i < info.plane_count; i++) {
        m_spec.channelnames[i] = info.planes[i].name;
        if (m_spec.channelnames[i] == "Z") m_spec.z_channel = int(i);
    }
    m_spec.alpha_channel = 3;
    m_spec.attribute("oiio:ColorSpace", "Linear");
    m_spec.attribute("Software", std::string("softshadow ") + softshadow_version_string());
    m_spec.attribute("softshadow.method", info.method);
}

bool SoftshadowInput::close() {
    m_scene.reset();
    return true;
}

// Pixels of columns x0..x1 and rows y0..y1, ends not included; the host's rows have row_pixels.
bool SoftshadowInput::read_box(int x0, int x1, int y0, int y1, int row_pixels, float *to) {
    still *made = m_scene->picture.get();
    still_info info;
    {
        std::lock_guard<std::mutex> guard(m_scene->lock);
        cli_error error;
        const bool fine = still_rows(made, uint32_t(y0), uint32_t(y1 - y0), &error);
        still_about(made, &info);
        if (!fine) {
            m_scene->failed = info.broken;
            errorfmt("{}", error.text);
            return false;
        }
    }
    const size_t width = info.width, channels = info.plane_count;
    for (size_t c = 0; c < channels; c++) {
        const image_plane &plane = info.planes[c];
        for (int y = y0; y < y1; y++) {
            const float *from = plane.values + (size_t(y) * width + size_t(x0)) * plane.stride;
            float *at = to + size_t(y - y0) * size_t(row_pixels) * channels + c;
            for (int x = x0; x < x1; x++, from += plane.stride, at += channels) *at = *from;
        }
    }
    return true;
}

bool SoftshadowInput::read_native_scanline(int subimage, int miplevel, int y, int z, void *data) {
    if (!m_scene || subimage || miplevel || z || y < 0 || y >= m_spec.height) {
        errorfmt("there is no row {} in this image", y);
        return false;
    }
    return guarded([&] {
        return read_box(0, m_spec.width, y, y + 1, m_spec.width, static_cast<float *>(data));
    });
}

bool SoftshadowInput::read_native_tile(int subimage, int miplevel, int x, int y, int z,
                                       void *data) {
    if (!m_scene || subimage || miplevel || z || x < 0 || y < 0 || x >= m_spec.width ||
        y >= m_spec.height || x % tile_side || y % tile_side) {
        errorfmt("there is no tile at {}, {} in this image", x, y);
        return false;
    }
    // What lies beyond the picture's edges is nothing.
    std::memset(data, 0, size_t(tile_side) * tile_side * m_spec.pixel_bytes());
    return guarded([&] {
        return read_box(x, std::min(x + tile_side, m_spec.width), y,
                        std::min(y + tile_side, m_spec.height), tile_side,
                        static_cast<float *>(data));
    });
}

} // namespace

OIIO_PLUGIN_EXPORTS_BEGIN

OIIO_EXPORT int softshadow_imageio_version = OIIO_PLUGIN_VERSION;
OIIO_EXPORT const char *softshadow_imageio_library_version() {
    static const std::string version = std::string("softshadow ") + softshadow_version_string();
    return version.c_str();
}
OIIO_EXPORT ImageInput *softshadow_input_imageio_create() { return new SoftshadowInput; }
OIIO_EXPORT const char *softshadow_input_extensions[] = {"softshadow", nullptr};

OIIO_PLUGIN_EXPORTS_END
