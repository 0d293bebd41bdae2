#!/bin/sh
# What the shared object shows and asks for: it exports exactly what the header declares, under the
# version of the symbol map; stays loaded; needs no OpenImageIO, GL, Embree or OpenMP by name; and
# imports nothing that prints, exits, or changes locale or signals.
set -u
so=${top_builddir:-.}/.libs/libsoftshadow.so.1
header=${top_srcdir:-.}/lib/softshadow.h
map=${top_srcdir:-.}/lib/softshadow.map
[ -e "$so" ] || { echo "$so is missing"; exit 99; }
work=$(mktemp -d) && trap 'rm -rf "$work"' EXIT
bad=0
complain() { echo "$*"; bad=1; }

# The header as the compiler sees it: comments and macros are gone.
${CC:-cc} -E -P "$header" | tr '\n' ' ' | grep -o 'softshadow_[a-z_]*(' | tr -d '(' | sort -u >"$work/header"
sed -n 's/^ *\(softshadow_[a-z_]*\);$/\1/p' "$map" | sort -u >"$work/map"
nm -D --defined-only "$so" | awk '{print $3}' | grep -v '^SOFTSHADOW_' >"$work/versioned"
# A sanitizer's own symbols are not ours to judge.
[ -n "${SANITIZERS:-}" ] && grep -v '^__\(asan\|ubsan\|tsan\|odr\)' "$work/versioned" >"$work/kept" &&
    mv "$work/kept" "$work/versioned"
sed 's/@.*//' "$work/versioned" | sort -u >"$work/so"
[ -s "$work/header" ] || complain "no function found in $header"
cmp -s "$work/header" "$work/map" || complain "header and map differ: $(diff "$work/header" "$work/map" | tr '\n' ' ')"
cmp -s "$work/header" "$work/so" || complain "header and library differ: $(diff "$work/header" "$work/so" | tr '\n' ' ')"
grep -v '@@SOFTSHADOW_1\.[0-9]*$' "$work/versioned" && complain "^ exported without a version"

readelf -dW "$so" >"$work/dynamic"
grep -q 'SONAME.*\[libsoftshadow\.so\.1\]' "$work/dynamic" || complain "SONAME is not libsoftshadow.so.1"
grep -q 'NODELETE' "$work/dynamic" || complain "not linked with -z nodelete: dlclose would crash hosts"
grep 'TEXTREL' "$work/dynamic" && complain "^ text relocations"
grep -iE 'NEEDED.*(OpenImageIO|libGL|libEGL|epoxy|embree|tbb|gomp|omp\.so)' "$work/dynamic" &&
    complain "^ must be reached without linking, or not at all"
readelf -lW "$so" | grep 'GNU_STACK.*E' && complain "^ wants an executable stack"

nm -D --undefined-only "$so" | awk '{print $2}' | sed 's/@.*//' |
    grep -xE 'exit|_exit|quick_exit|puts|putchar|printf|vprintf|perror|setlocale|signal|sigaction|system|popen|srand|rand|setenv|putenv|unsetenv|chdir|umask' &&
    complain "^ imported: belongs to the host"
# FTZ and DAZ in whoever loads us: what crtfastmath.o does.
[ -z "$(nm "$so" 2>/dev/null | grep -w set_fast_math)" ] || complain "linked with -ffast-math"
grep -rhoE 'getenv\("[A-Za-z_0-9]*"' "${top_srcdir:-.}/lib" | grep -v '("SOFTSHADOW_' &&
    complain "^ only variables named SOFTSHADOW_ may matter"

[ "$bad" = 0 ] && echo "$(wc -l <"$work/so") functions, nothing else"
exit "$bad"
