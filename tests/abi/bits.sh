#!/bin/sh
# make check-bits: builds the library with gcc and clang, at -O0 and -O3, in bits/NAME, and asks each
# what tests/abi/digest asks, on every instruction-set rung (SOFTSHADOW_CPU) that this machine has.
# All answers must be those of this build's library on its highest rung. What differs stays in
# bits/NAME.RUNG.diff.
set -eu
mkdir -p bits
root=$PWD/bits
[ -z "${SANITIZERS:-}" ] || { echo "a sanitizer's runtime must be in the program, too"; exit 77; }
command -v clang >/dev/null || { echo "clang is missing; ./bootstrap --hosts installs it" >&2; exit 77; }
# A copy of the source, because one that is configured itself can have no other build beside it.
make -s distdir distdir="$root/source"

build() { # build NAME CC CXX FLAGS
    mkdir -p "$root/$1"
    cd "$root/$1"
    [ -f config.status ] ||
        "$root/source/configure" -q --disable-dependency-tracking CC="$2" CXX="$3" CFLAGS="$4" CXXFLAGS="$4"
    make -s -j"$(nproc)" libsoftshadow.la
    cd "$root/.."
}
rungs=scalar
if [ -e /proc/cpuinfo ]; then
    flags=" $(sed -n 's/^flags[^:]*://p' /proc/cpuinfo | head -n 1) "
    case $flags in *" avx2 "*) rungs="$rungs avx2" ;; esac
    case $flags in *" avx512bw "*) rungs="$rungs avx512" ;; esac
fi

# ask FOLDER RUNG FILE [few]: the program, with that folder's library and no other.
ask() {
    LD_LIBRARY_PATH=$1 SOFTSHADOW_CPU=$2 tests/abi/.libs/digest ${4:-} >"$3" 2>"$3.err" ||
        { echo "FAIL: with $1, rung $2:"; tail -n 5 "$3" "$3.err"; exit 1; }
    case $(head -n 1 "$3.err") in
    "$1"/*) ;;
    *) echo "FAIL: $(head -n 1 "$3.err") was loaded, not $1"; exit 1 ;;
    esac
}

ask "$PWD/.libs" "${rungs##* }" "$root/want"
lines=$(wc -l <"$root/want")
[ "$lines" -gt 1000 ] || { echo "FAIL: only $lines answers"; exit 1; }
failed=0
compare() { # compare NAME FOLDER [few]
    for rung in $rungs; do
        ask "$2" "$rung" "$root/got" "${3:-}"
        answers=$(wc -l <"$root/got")
        if ! grep -vxFf "$root/want" "$root/got" >"$root/$1.$rung.diff" && [ "$answers" -gt 200 ]; then
            rm -f "$root/$1.$rung.diff"
            echo "PASS: $1, $rung: $answers answers, the same bits"
        else
            echo "FAIL: $1, $rung: $(wc -l <"$root/$1.$rung.diff") of $answers answers differ, as:"
            head -n 6 "$root/$1.$rung.diff"
            failed=1
        fi
    done
}
compare "this build" "$PWD/.libs"
for how in "gcc g++ -O0" "gcc g++ -O3" "clang clang++ -O0" "clang clang++ -O3"; do
    # shellcheck disable=SC2086 # three words
    set -- $how
    build "$1$3" "$1" "$2" "$3"
    few=
    [ "$3" != -O0 ] || few=few # it takes a dozen times as long
    compare "$1 $3" "$root/$1$3/.libs" $few
done
exit $failed
