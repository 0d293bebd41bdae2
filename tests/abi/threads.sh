#!/bin/sh
# make check-threads: builds the library with ThreadSanitizer in threads/build, and runs the tests in
# which many threads query, build and cancel.
set -eu
mkdir -p threads/build
root=$PWD/threads
# A copy of the source, because one that is configured itself can have no other build beside it.
make -s distdir distdir="$root/source"
cd threads/build
[ -f config.status ] || "$root/source/configure" -q --enable-sanitizers=thread
make -s -j"$(nproc)" libsoftshadow.la
failed=0
for test in abi/handles abi/threadless stress/crowd; do
    make -s "tests/$test"
    if TSAN_OPTIONS="suppressions=$root/source/tests/abi/threads.supp exitcode=66" "./tests/$test" \
        >"$(basename "$test").log" 2>&1; then
        echo "PASS: tests/$test under ThreadSanitizer"
    else
        echo "FAIL: tests/$test under ThreadSanitizer; threads/build/$(basename "$test").log ends:"
        grep -A 30 'WARNING: ThreadSanitizer' "$(basename "$test").log" | head -n 60
        tail -n 10 "$(basename "$test").log"
        failed=1
    fi
done
exit $failed
