#!/bin/sh
# The binary interface against the one that is committed, libsoftshadow.abi.xml: abidiff finds any
# change of a function, a type or a symbol; compatible.py says whether programs survive it. "diff.sh
# renew", which is make renew-abi, takes what is there as the interface to hold from then on: what
# programs survive, or, with ABI_BREAK=yes, anything; that asks for a new SONAME.
set -u
source=${top_srcdir:-.}
so=${top_builddir:-.}/.libs/libsoftshadow.so.1
baseline=$source/tests/abi/libsoftshadow.abi.xml
[ -z "${SANITIZERS:-}" ] || { echo "a sanitizer's own symbols are in the library"; exit 77; }
command -v abidw >/dev/null && command -v abidiff >/dev/null ||
    { echo "abidw, abidiff are missing (Debian package abigail-tools)"; exit 77; }
[ "${PYTHON:-:}" != : ] || { echo "Python is missing"; exit 77; }
[ -e "$so" ] || { echo "$so is missing"; exit 99; }
work=$(mktemp -d) && trap 'rm -rf "$work"' EXIT

# Types that the public header does not define are private. Where a line stands is no interface.
mkdir "$work/headers" && cp "$source/lib/softshadow.h" "$work/headers"
abidw --headers-dir "$work/headers" --drop-private-types --exported-interfaces-only --no-elf-needed \
    --no-corpus-path --no-comp-dir-path --no-parameter-names --type-id-style hash "$so" |
    sed -E "s/ (filepath|line|column|path|comp-dir-path)='[^']*'//g" >"$work/now.xml"
grep -q "class-decl name='softshadow_build' size-in-bits" "$work/now.xml" ||
    { echo "the library has no debug information: build it with -g"; exit 77; }
machine() { sed -n "s/^<abi-corpus.* architecture='\([^']*\)'.*/\1/p" "$1"; }
[ "$(machine "$work/now.xml")" = "$(machine "$baseline")" ] || [ "${1:-}" = renew ] ||
    { echo "the interface that is committed is another machine's: $(machine "$baseline")"; exit 77; }

if [ -e "$baseline" ]; then
    abidiff "$baseline" "$work/now.xml" >"$work/changes" 2>&1
    changed=$?
    verdict=$("$PYTHON" "$source/tests/abi/compatible.py" "$baseline" "$work/now.xml")
    breaks=$?
else
    changed=4 breaks=0 verdict="there was none"
fi
if [ "${1:-}" = renew ]; then
    if [ "$breaks" != 0 ] && [ "${ABI_BREAK:-}" != yes ]; then
        echo "$verdict"
        echo "programs built against this interface would break: nothing renewed (ABI_BREAK=yes does it)"
        exit 1
    fi
    cp "$work/now.xml" "$baseline" && echo "renewed $baseline: $verdict"
    exit
fi
if [ "$changed" = 0 ] && [ "$breaks" = 0 ]; then
    echo "the interface is the one that is committed"
    exit 0
fi
cat "$work/changes"
echo "$verdict"
if [ "$breaks" = 0 ]; then
    echo "Programs survive this. make renew-abi holds it from now on: commit tests/abi/libsoftshadow.abi.xml."
else
    echo "Programs built against the committed interface would break: take the change back. What may be" \
        "added: functions, and members at the end of structs that begin with struct_size."
fi
exit 1
