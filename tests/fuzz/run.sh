#!/bin/sh
# make check-fuzz: builds the library and the fuzzers with clang, libFuzzer, ASan and UBSan in
# fuzz/build, and runs each for FUZZ_SECONDS (60) on a corpus that grows in fuzz/NAME. What a fuzzer
# finds stays in fuzz/NAME-crash-*, and is told as base64 for whom has only this output;
# `fuzz/build/tests/fuzz/NAME FILE` runs it again.
# FUZZERS="fuzz_abi" runs only those.
set -eu
seconds=${FUZZ_SECONDS:-60}
clang=$(command -v clang || true)
[ -n "$clang" ] || { echo "check-fuzz: clang is missing; ./bootstrap --hosts installs it" >&2; exit 77; }
mkdir -p fuzz/build
root=$PWD/fuzz
# quiet WHAT COMMAND...: says nothing unless it fails.
quiet() {
    what=$1
    shift
    if ! "$@" >"$root/build.log" 2>&1; then
        echo "FAIL: $what: fuzz/build.log ends:"
        grep -m 10 -E 'error|Error' "$root/build.log" || true
        tail -n 20 "$root/build.log"
        exit 1
    fi
}

# found NAME: what the fuzzer said, what matters first: the error, the input, the stack, the end.
found() {
    log=$root/$1.log
    echo "FAIL: $1"
    grep -m 8 -aE 'ERROR|SUMMARY|runtime error|Assertion|ALARM' "$log" || true
    for unit in $(sed -n 's/.*Test unit written to \(.*-\(crash\|timeout\|oom\|leak\)-.*\)/\1/p' "$log"); do
        echo "$unit is, in base64: $(base64 -w 0 "$unit")"
    done
    sed -n -E '/ERROR|runtime error|Assertion/,$p' "$log" | grep -m 20 -aE '^ +#[0-9]+ ' || true
    echo "fuzz/$1.log ends:"
    tail -n 15 "$log"
}

# A copy of the source, because one that is configured itself can have no other build beside it.
quiet "copying the source" make -s distdir distdir="$root/source"
flags="-g -O1 -fno-omit-frame-pointer -fno-sanitize-recover=undefined"
cover="-fsanitize=fuzzer-no-link,address,undefined"
# Programs are linked as C: no type information at run time.
cd fuzz/build
if [ ! -f config.status ]; then
    quiet "configure" "$root/source/configure" -q --disable-shared --enable-static CC=clang CXX=clang++ \
        CFLAGS="$flags $cover" CXXFLAGS="$flags $cover -fno-sanitize=vptr" LDFLAGS="-fsanitize=address,undefined"
fi
programs=
for name in $fuzzers; do programs="$programs tests/fuzz/$name"; done
# shellcheck disable=SC2086 # a list of programs
quiet "building" make -s -j"$(nproc)" $programs
failed=0
for name in ${FUZZERS:-$fuzzers}; do
    mkdir -p "$root/$name"
    seeds=
    [ ! -d "$root/source/tests/fuzz/corpus/$name" ] || seeds=$root/source/tests/fuzz/corpus/$name
    dict=
    [ ! -e "$root/source/tests/fuzz/${name#fuzz_}.dict" ] || dict=-dict=$root/source/tests/fuzz/${name#fuzz_}.dict
    # Calls that keep memory look like leaks after each input; whether there are any is seen at the end.
    how=
    [ "$name" != fuzz_abi ] || how="-detect_leaks=0 -len_control=0"
    # shellcheck disable=SC2086 # there may be none
    if ./tests/fuzz/"$name" -max_total_time="$seconds" -timeout=60 -rss_limit_mb=2048 -max_len=4096 \
        -print_final_stats=1 -artifact_prefix="$root/$name-" $dict $how "$root/$name" $seeds \
        </dev/null >"$root/$name.log" 2>&1; then
        runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$root/$name.log")
        echo "PASS: $name: $runs inputs in $seconds s"
    else
        found "$name"
        failed=1
    fi
done
exit $failed
