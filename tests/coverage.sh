#!/bin/sh
# make check-coverage: builds everything with gcc's counters in coverage/build, runs the tests of
# COVERAGE_ROOMS there, and prints which share of lines and branches of lib/ and cli/ ran: see
# coverage.py. Says nothing of plugins, and nothing of what a test killed on purpose had run.
set -eu
command -v gcov >/dev/null || { echo "gcov is missing: it comes with gcc" >&2; exit 77; }
mkdir -p coverage/build
root=$PWD/coverage
make -s distdir distdir="$root/source"
cd coverage/build
# Counters are shared by threads.
flags="-O1 --coverage -fprofile-update=atomic"
[ -f config.status ] || "$root/source/configure" -q CFLAGS="$flags" CXXFLAGS="$flags"
make -s -j"$(nproc)"
find . -name '*.gcda' -exec rm {} +
tests=
for room in ${COVERAGE_ROOMS:-unit property oracle abi cli}; do
    # The names as make knows them: programs and scripts.
    # What counters export is no symbol of the library's.
    tests="$tests $(printf '%s\n' ${ALL_TESTS} | grep "^tests/$room/" | grep -v abi/symbols | tr '\n' ' ')"
done
status=0
# Where a test forbids to write, counters are lost, and must not complain where the test reads.
export GCOV_ERROR_FILE=/dev/null
make -s -k check TESTS="$tests" >check.log 2>&1 || status=1
grep -E '^(FAIL|ERROR):' check.log || :
"${PYTHON:-python3}" "$root/source/tests/coverage.py" "$root/source" .
exit $status
