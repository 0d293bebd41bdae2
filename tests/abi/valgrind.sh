#!/bin/sh
# make check-valgrind: rounds of dlopen, query with every method, dlclose, twice each, under memcheck:
# nothing read that was never written or is not ours, nothing freed twice or lost. The back end EGL is
# left out: a GPU in software compiles its programs at run time, which memcheck takes for stray code;
# tests/abi/gpu_host counts its memory instead.
set -eu
command -v valgrind >/dev/null || { echo "valgrind is missing; ./bootstrap --hosts installs it" >&2; exit 77; }
[ -z "${SANITIZERS:-}" ] || { echo "a sanitizer's runtime does not run in valgrind"; exit 77; }
log=valgrind.log
if top_builddir=. valgrind -q --leak-check=full --error-exitcode=9 --num-callers=30 \
    --suppressions="$top_srcdir/tests/abi/valgrind.supp" tests/abi/dlopen twice >$log 2>&1; then
    echo "PASS: $(tail -n 1 $log) under valgrind"
    rm -f $log
else
    echo "FAIL: under valgrind; $log begins:"
    head -n 60 $log
    exit 1
fi
