#!/bin/sh
# sanitized.sh COMMAND...: runs a test in a sanitized build. LeakSanitizer looks for pointers in the
# thread-local storage of libraries loaded at run time, guesses where that ends from what lies before it,
# and at times crashes there, after the test is over. Then, and only then, the test runs again, and it
# looks everywhere else; what the loader and dlerror() keep in theirs is no leak.
work=$(mktemp -d) || exit 99
trap 'rm -rf "$work"' EXIT
"$@" >"$work/log" 2>&1
status=$?
cat "$work/log"
if [ "$status" != 0 ] && grep -q 'LeakSanitizer has encountered a fatal error' "$work/log"; then
    echo "LeakSanitizer crashed: once more, without thread-local storage"
    printf 'leak:%s\n' add_to_global_resize _dlerror_run __vasprintf_internal >"$work/loader"
    LSAN_OPTIONS="use_tls=0:suppressions=$work/loader" "$@"
    status=$?
fi
exit "$status"
