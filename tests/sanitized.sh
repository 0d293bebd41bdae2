#!/bin/sh
# sanitized.sh COMMAND...: runs a test in a sanitized build. LeakSanitizer walks the thread-local storage
# of threads that TBB, below Embree, ends just then, and at times crashes in it, after the test is over.
# Then, and only then, the test runs again.
log=$(mktemp) || exit 99
trap 'rm -f "$log"' EXIT
for try in 1 2 3 4 5 6; do
    "$@" >"$log" 2>&1
    status=$?
    cat "$log"
    [ "$status" = 0 ] && break
    grep -q 'LeakSanitizer has encountered a fatal error' "$log" || break
    echo "LeakSanitizer crashed (run $try): once more"
done
exit "$status"
