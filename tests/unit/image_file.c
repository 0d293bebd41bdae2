/* Image files through the module: what is written comes back, and what cannot serve is refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "cli/image/image.h"

enum { W = 7, H = 5, N = W * H };

static const image_module *module;
static char folder[] = "/tmp/softshadow-image-XXXXXX";

static int load(void **state) {
    (void)state;
    cli_error error;
    module = image_load(&error);
    if (!module) fprintf(stderr, "%s\n", error.text);
    return module && mkdtemp(folder) ? 0 : -1;
}

static int clean(void **state) {
    (void)state;
    return rmdir(folder);
}

static const char *save(const char *name, const void *bytes, size_t size) {
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
    return path;
}

static image_file *open_or_fail(const char *path) {
    char why[IMAGE_WHY] = "";
    image_file *image = module->open(path, why);
    if (!image) fail_msg("%s", why);
    return image;
}

static uint32_t find(const image_info *info, const char *name) {
    for (uint32_t i = 0; i < info->channel_count; i++)
        if (strcmp(info->channels[i].name, name) == 0) return i;
    fail_msg("no channel %s", name);
    return 0;
}

static void fill(float values[N], float first, float step) {
    for (int i = 0; i < N; i++) values[i] = first + step * (float)i;
}

static void check_channel(image_file *image, uint32_t channel, const float *expected) {
    float values[N];
    char why[IMAGE_WHY];
    assert_true(module->read(image, channel, values, 1, why));
    assert_memory_equal(values, expected, sizeof values);
}

static void check_plane(image_file *image, const char *name, const float *expected) {
    image_info info;
    module->about(image, &info);
    check_channel(image, find(&info, name), expected);
}

/* Floats go through an EXR and a TIFF bit for bit, whatever their size. */
static void floats_come_back(void **state) {
    (void)state;
    float a[N], b[N];
    fill(a, -1e7f, 1234.567f);
    fill(b, 1e-30f, 1e-31f);
    const image_plane planes[] = {{"visibility", a, 1}, {"P.X", b, 1}};
    const char *const metadata[] = {"Software", "softshadow", NULL};
    const image_picture picture = {W, H, planes, 2, false, metadata, NULL};
    for (int format = IMAGE_EXR; format <= IMAGE_TIFF; format++) {
        if (format == IMAGE_PNG) continue;
        void *bytes = NULL;
        size_t size = 0;
        char why[IMAGE_WHY] = "";
        if (!module->encode(&picture, (image_format)format, &bytes, &size, why))
            fail_msg("%s", why);
        const char *path = save(format == IMAGE_EXR ? "a.exr" : "a.tif", bytes, size);
        module->free_bytes(bytes);
        image_file *image = open_or_fail(path);
        image_info info;
        module->about(image, &info);
        assert_int_equal(info.width, W);
        assert_int_equal(info.height, H);
        assert_int_equal(info.channel_count, 2);
        check_channel(image, format == IMAGE_EXR ? find(&info, "visibility") : 0, a);
        check_channel(image, format == IMAGE_EXR ? find(&info, "P.X") : 1, b);
        module->close(image);
        unlink(path);
    }
}

/* 8 bits: a value comes back within half a step, and beyond 0..1 is clamped. */
static void png_is_eight_bits(void **state) {
    (void)state;
    float a[N];
    fill(a, -0.1f, 1.2f / (N - 1));
    const image_plane planes[] = {{"Y", a, 1}};
    const image_picture picture = {W, H, planes, 1, false, NULL, NULL};
    void *bytes = NULL;
    size_t size = 0;
    char why[IMAGE_WHY] = "";
    if (!module->encode(&picture, IMAGE_PNG, &bytes, &size, why)) fail_msg("%s", why);
    const char *path = save("a.png", bytes, size);
    module->free_bytes(bytes);
    image_file *image = open_or_fail(path);
    float back[N];
    assert_true(module->read(image, 0, back, 1, why));
    for (int i = 0; i < N; i++) {
        const float wanted = a[i] < 0 ? 0 : a[i] > 1 ? 1 : a[i];
        assert_true(back[i] - wanted <= 0.5f / 255 + 1e-6f &&
                    wanted - back[i] <= 0.5f / 255 + 1e-6f);
    }
    module->close(image);
    unlink(path);
}

/* What was in the file stays, bit for bit; what is added is there beside it. */
static void adding_keeps_the_rest(void **state) {
    (void)state;
    float a[N], b[N], c[N];
    fill(a, 3.25f, 0.1f);
    fill(b, 0, 0.01f);
    fill(c, 1, -0.01f);
    const image_plane before[] = {{"P.X", a, 1}, {"visibility", b, 1}};
    const char *const metadata[] = {"shot", "042", NULL};
    const image_picture first = {W, H, before, 2, false, metadata, NULL};
    void *bytes = NULL;
    size_t size = 0;
    char why[IMAGE_WHY] = "";
    if (!module->encode(&first, IMAGE_EXR, &bytes, &size, why)) fail_msg("%s", why);
    char path[256];
    snprintf(path, sizeof path, "%s", save("before.exr", bytes, size));
    module->free_bytes(bytes);
    image_file *from = open_or_fail(path);
    const image_plane added[] = {{"visibility", c, 1}, {"visibility.2", b, 1}};
    const image_picture more = {W, H, added, 2, false, NULL, NULL};
    if (!module->encode_like(from, &more, &bytes, &size, why)) fail_msg("%s", why);
    const image_picture other = {W + 1, H, added, 2, false, NULL, NULL};
    void *none = NULL;
    assert_false(module->encode_like(from, &other, &none, &size, why));
    assert_null(none);
    module->close(from);
    unlink(path);
    const char *after = save("after.exr", bytes, size);
    module->free_bytes(bytes);
    image_file *image = open_or_fail(after);
    check_plane(image, "P.X", a);
    check_plane(image, "visibility", c);
    check_plane(image, "visibility.2", b);
    module->close(image);
    unlink(after);
}

static void positions_are_found(void **state) {
    (void)state;
    static const image_channel blender[] = {
        {"ViewLayer.Combined.R", IMAGE_FLOAT}, {"ViewLayer.Normal.X", IMAGE_HALF},
        {"ViewLayer.Normal.Y", IMAGE_HALF},    {"ViewLayer.Normal.Z", IMAGE_HALF},
        {"ViewLayer.Position.X", IMAGE_FLOAT}, {"ViewLayer.Position.Y", IMAGE_FLOAT},
        {"ViewLayer.Position.Z", IMAGE_FLOAT}};
    static const image_channel half[] = {{"R", IMAGE_FLOAT}, {"G", IMAGE_FLOAT}, {"B", IMAGE_HALF}};
    static const image_channel grey[] = {{"Y", IMAGE_FLOAT}};
    uint32_t channel[3];
    cli_error error;
    image_info info = {1, 1, 0, 0, 7, blender};
    assert_true(image_find_positions(&info, NULL, "f.exr", channel, &error));
    assert_int_equal(channel[0], 4);
    assert_true(image_find_normals(&info, channel));
    assert_int_equal(channel[2], 3);
    assert_false(image_find_positions(&info, "Pref", "f.exr", channel, &error));
    info = (image_info){1, 1, 0, 0, 3, half};
    assert_false(image_find_positions(&info, NULL, "f.exr", channel, &error));
    assert_non_null(strstr(error.text, "channel B holds half floats"));
    assert_false(image_find_normals(&info, channel));
    info = (image_info){1, 1, 0, 0, 1, grey};
    assert_false(image_find_positions(&info, NULL, "f.exr", channel, &error));
}

/* No image: a line that names the file, never a crash. */
static void no_image_is_refused(void **state) {
    (void)state;
    char why[IMAGE_WHY] = "";
    assert_null(module->open("/nowhere/x.exr", why));
    assert_non_null(strstr(why, "/nowhere/x.exr"));
    const char *path = save("garbage.exr", "v/1\001 this is none", 17);
    assert_null(module->open(path, why));
    assert_true(strlen(why) > 10 && !strchr(why, '\n'));
    unlink(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(floats_come_back),      cmocka_unit_test(png_is_eight_bits),
        cmocka_unit_test(adding_keeps_the_rest), cmocka_unit_test(positions_are_found),
        cmocka_unit_test(no_image_is_refused),
    };
    return cmocka_run_group_tests(tests, load, clean);
}
