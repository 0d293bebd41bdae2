#!/bin/sh
# The header compiles alone, as the first thing of a file, in every language it promises, with every
# warning on; its _INIT macros make what they say.
set -u
work=$(mktemp -d) && trap 'rm -rf "$work"' EXIT
bad=0
cat >"$work/alone.c" <<'END'
#include <softshadow.h>
#include <softshadow.h>
#include <string.h>

#define CHECK(type, INIT)                                                        \
    do {                                                                         \
        type value = INIT;                                                       \
        unsigned char rest[sizeof(type)];                                        \
        memset(rest, 0, sizeof rest);                                            \
        if (value.struct_size != sizeof value) return 1;                         \
        if (memcmp((const unsigned char *)&value + 4, rest, sizeof value - 4)) return 2; \
    } while (0)

int main(void) {
    CHECK(softshadow_options, SOFTSHADOW_OPTIONS_INIT);
    CHECK(softshadow_mesh, SOFTSHADOW_MESH_INIT);
    CHECK(softshadow_light, SOFTSHADOW_LIGHT_INIT);
    CHECK(softshadow_build, SOFTSHADOW_BUILD_INIT);
    CHECK(softshadow_points, SOFTSHADOW_POINTS_INIT);
    CHECK(softshadow_error, SOFTSHADOW_ERROR_INIT);
    CHECK(softshadow_stats, SOFTSHADOW_STATS_INIT);
    CHECK(softshadow_map, SOFTSHADOW_MAP_INIT);
    CHECK(softshadow_method, SOFTSHADOW_METHOD_INIT);
    return 0;
}
END
cp "$work/alone.c" "$work/alone.cc"
# A program of the kind that the contract was fixed for: designated initialisers.
cat >"$work/designated.c" <<'END'
#include <softshadow.h>
int main(void) {
    float xyz[9] = {0, 0, 1, 1, 0, 1, 0, 1, 1}, point[3] = {0, 0, 0}, v, bound;
    uint32_t indices[3] = {0, 1, 2};
    softshadow_mesh mesh = {.struct_size = sizeof mesh, .flags = SOFTSHADOW_CASTS, .position_type = SOFTSHADOW_F32,
        .positions = xyz, .position_stride = 0, .vertex_count = 3, .indices = indices, .triangle_count = 1,
        .transform = NULL, .uvs = NULL, .uv_stride = 0, .opacity = {.width = 0, .height = 0, .texels = NULL},
        .opacity_threshold = 0};
    softshadow_light light = {.struct_size = sizeof light, .type = SOFTSHADOW_SPHERE, .position = {0, 0, 5},
        .direction = {0}, .u = {0}, .v = {0}, .radius = 1, .profile = NULL, .profile_count = 0};
    softshadow_build build = {.struct_size = sizeof build, .method = "auto", .backend = SOFTSHADOW_CPU, .samples = 64,
        .resolution = 0, .layers = 0, .max_samples = 0, .falloff = SOFTSHADOW_FALLOFF_DISK,
        .weighting = SOFTSHADOW_UNIFORM, .mask_taps = 0, .blur = 0, .seed = 0, .tolerance = 0, .depth_bias = 0,
        .smoothie_width = 0, .bounds = NULL, .points_ahead = 0};
    softshadow_points points = {.struct_size = sizeof points, .position_type = SOFTSHADOW_F32, .positions = point,
        .position_stride = 0, .count = 1, .normals = NULL, .normal_stride = 0, .ids = NULL, .primitives = NULL,
        .width = 0, .light = 0, .error_bound = &bound};
    softshadow_options options = {.struct_size = sizeof options, .threads = 1, .user = NULL, .log = NULL,
        .progress = NULL, .parallel = NULL};
    softshadow_error error = {.struct_size = sizeof error, .max_points = 1, .samples = 16};
    softshadow *s;
    softshadow_status status = softshadow_create(&s, &options);
    if (!status) status = softshadow_add_mesh(s, &mesh, NULL);
    if (!status) status = softshadow_set_light(s, &light);
    if (!status) status = softshadow_build_maps(s, &build);
    if (!status) status = softshadow_query_visibility(s, &points, &v);
    if (!status) status = softshadow_measure_error(s, &points, &error);
    softshadow_destroy(s);
    return status ? 1 : 0;
}
END
try() { # try NAME COMPILER FLAGS... SOURCE
    name=$1; shift
    "$@" -I"${top_srcdir:-.}/lib" -Wall -Wextra -pedantic -Werror -o "$work/program" >"$work/log" 2>&1 ||
        { echo "$name does not compile:"; cat "$work/log"; bad=1; return; }
}
cc=${CC:-cc} cxx=${CXX:-c++}
for standard in c99 c11 c17; do
    try "$standard" $cc -std=$standard "$work/alone.c" && { "$work/program" || { echo "$standard: an _INIT macro is wrong: $?"; bad=1; }; }
    try "$standard, designated" $cc -std=$standard -c "$work/designated.c"
done
for standard in c++11 c++14 c++17 c++20; do
    try "$standard" $cxx -std=$standard "$work/alone.cc" && { "$work/program" || { echo "$standard: an _INIT macro is wrong: $?"; bad=1; }; }
done
# What a number was called in 1.0 it is called for ever.
old=${top_srcdir:-.}/tests/abi/old/softshadow.h
{
    echo '#include <softshadow.h>'
    echo '#include <stdio.h>'
    echo 'int main(void) {'
    sed -n '/^enum/,/};/p' "$old" | grep -oE 'SOFTSHADOW_[A-Z0-9_]+' | sort -u |
        sed 's/.*/    printf("%s %lld\\n", "&", (long long)&);/'
    echo '    return 0;'
    echo '}'
} >"$work/values.c"
for which in old now; do
    folder=${top_srcdir:-.}/lib
    [ $which = now ] || folder=${old%/*}
    $cc -std=c11 -I"$folder" -o "$work/program" "$work/values.c" && "$work/program" >"$work/$which" ||
        { echo "the constants of 1.0 do not compile with $folder"; bad=1; }
done
[ "$(wc -l <"$work/old")" -ge 30 ] || { echo "only $(wc -l <"$work/old") constants found"; bad=1; }
cmp -s "$work/old" "$work/now" || { echo "constants of 1.0 changed:"; diff "$work/old" "$work/now"; bad=1; }
[ "$bad" = 0 ] && echo "C99, C11, C17, C++11, C++14, C++17, C++20"
exit "$bad"
