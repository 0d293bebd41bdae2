#!/bin/sh
# What "make install" puts in place serves: the examples are built against it with pkg-config alone,
# run, and print what they should; without the library 05_dlopen goes without.
set -eu
unset MAKEFLAGS MFLAGS MAKELEVEL
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
make -s -C "$top_builddir" install DESTDIR="$root" >"$root/install.log" 2>&1 || {
    cat "$root/install.log"
    exit 1
}
pc=$(find "$root" -name softshadow.pc)
library=$(find "$root" -name libsoftshadow.so.1)
[ -n "$pc" ] && [ -n "$library" ] || { echo "softshadow.pc or libsoftshadow.so.1 is not installed"; exit 1; }
LD_LIBRARY_PATH=$(dirname "$library")${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
PKG_CONFIG_PATH=$(dirname "$pc") PKG_CONFIG_SYSROOT_DIR=$root
export LD_LIBRARY_PATH PKG_CONFIG_PATH PKG_CONFIG_SYSROOT_DIR

mkdir "$root/examples"
cp "$top_srcdir"/examples/*.c "$top_srcdir/examples/Makefile" "$root/examples"
cd "$root/examples"
flags="-O1 -Wall -Wextra -Werror"
[ -z "${SANITIZERS:-}" ] || flags="$flags -fsanitize=$SANITIZERS"
make -s CC="${CC:-cc}" CFLAGS="$flags"
bad=0
wrong() { echo "wrong: $*"; bad=1; }

# The lamp over the triangle: its middle is hidden, the far point sees it all.
./01_one_triangle >1.txt || wrong "01_one_triangle: exit status $?"
cat 1.txt
grep -q '^x = 0.0 sees 0.000 ' 1.txt || wrong "01: the point under the triangle is in umbra"
grep -q '^x = 3.0 sees 1.000 ' 1.txt || wrong "01: the far point is lit"

# Columns: x, fraction, bound, truth. The bound holds at 99.9 % of points and there are 11.
./02_error_bound >2.txt || wrong "02_error_bound: exit status $?"
cat 2.txt
awk 'NR > 1 { n++; e = $2 - $4; if (e < 0) e = -e; if (e > $3 + 1e-5) out++ }
     END { exit !(n == 11 && out <= 1) }' 2.txt || wrong "02: the truth is not within the bound"

./03_lights >3.txt || wrong "03_lights: exit status $?"
cat 3.txt
[ "$(wc -l <3.txt)" = 5 ] || wrong "03: five lines are wanted"

./04_in_a_host || wrong "04_in_a_host: exit status $?"

# The same point through dlopen, to the last digit printed.
./05_dlopen >5.txt || wrong "05_dlopen: exit status $?"
cat 5.txt
grep -qFx "$(cat 5.txt)" 1.txt || wrong "05: another answer than 01"
status=0
./05_dlopen "$root/none.so" 2>none.txt || status=$?
[ "$status" = 3 ] && grep -q 'no soft shadows' none.txt || wrong "05 without the library: status $status"

# A library of the next major version has every call, and is not used.
for call in version create destroy add_mesh set_light build_maps query_visibility last_message; do
    echo "unsigned softshadow_$call(void); unsigned softshadow_$call(void) { return 20000; }"
done >next.c
${CC:-cc} -shared -fPIC -o next.so next.c
status=0
./05_dlopen ./next.so 2>next.txt || status=$?
[ "$status" = 3 ] && grep -q 'version 20000' next.txt || wrong "05 with version 2: status $status"

# A renderer of another make: the same light with the library as with shadow rays, and less noise.
./06_tinytracer with.ppm 4 60 >6.txt && ./06_tinytracer rays.ppm 4 60 "$root/none.so" >>6.txt &&
    ./06_tinytracer next.ppm 4 60 ./next.so >>6.txt &&
    ./06_tinytracer truth.ppm 400 60 "$root/none.so" >>6.txt || wrong "06_tinytracer: exit status $?"
cat 6.txt
[ "$(grep -c 'from softshadow' 6.txt)" = 1 ] || wrong "06: the library is used once"
cmp -s rays.ppm next.ppm || wrong "06: version 2 of the library is as good as none"
linear() { tail -c 7200 "$1" | od -An -v -tu1 -w1; }
linear truth.ppm >truth.txt
for kind in with rays; do
    linear $kind.ppm | paste - truth.txt | awk -v kind=$kind '
        { a = ($1 / 255) ^ 2.2; b = ($2 / 255) ^ 2.2; sum += a; truth += b; square += (a - b) ^ 2 }
        END { print kind, NR, sum / truth, sqrt(square / NR) }'
done >noise.txt
cat noise.txt
# The random numbers are always the same. Noise left by other bounces moves the mean by 0.2 %.
awk '{ mean[$1] = $3; rms[$1] = $4; n += $2 }
     END { exit !(n == 14400 && mean["with"] > .99 && mean["with"] < 1.01 &&
                  rms["with"] < .9 * rms["rays"]) }' noise.txt || wrong "06: $(cat noise.txt)"

# The reader for OpenImageIO finds the installed library and knows its files.
plugin=$(find "$root" -name softshadow.imageio.so)
[ -n "$plugin" ] || wrong "softshadow.imageio.so is not installed"
if command -v oiiotool >/dev/null && [ -z "${SANITIZERS:-}" ]; then
    printf 'softshadow 1\nsize 3\n' >bad.softshadow
    OIIO_LIBRARY_PATH=$(dirname "$plugin") oiiotool bad.softshadow --info >6.txt 2>&1 || :
    grep -q 'bad.softshadow:2: size 3: WxH' 6.txt || wrong "oiiotool: $(cat 6.txt)"
fi
exit "$bad"
