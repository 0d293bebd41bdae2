#!/bin/sh
# make demo: how much of a lamp does the Stanford bunny leave to the floor? As numbers, as a picture.
set -eu
: "${top_builddir:?}" "${top_srcdir:?}"
softshadow=$top_builddir/softshadow
out=$top_builddir/demo
mkdir -p "$out"
cd "$out"
now() { date +%s%N; }
begin=$(now)
status=0

bunny=${SOFTSHADOW_BUNNY-/usr/share/glmark2/models/bunny.obj}
if [ -r "$bunny" ]; then
    mesh=$bunny floor=-0.9912
else
    echo "demo: $bunny is not there (Debian package glmark2-data): three blocks serve instead"
    [ "${CI:-}" != true ] || { echo "demo: CI must have the bunny"; status=1; }
    mesh=$out/blocks.obj floor=0
    # Each block stands on the floor: x z half-width height.
    awk 'BEGIN {
        n = split("-0.7 0.1 0.35 1.6  0.35 -0.3 0.3 1.0  0.5 0.6 0.25 0.5", b, " +")
        for (k = 0; k < n / 4; k++) {
            x = b[4*k+1]; z = b[4*k+2]; w = b[4*k+3]; h = b[4*k+4]; o = 8 * k
            for (i = 0; i < 8; i++)
                print "v", x + (i % 2 ? w : -w), int(i / 4) * h, z + (int(i / 2) % 2 ? w : -w)
            split("1 2 4 3 5 7 8 6 1 5 6 2 3 4 8 7 1 3 7 5 2 6 8 4", f, " ")
            for (q = 0; q < 6; q++) print "f", f[4*q+1]+o, f[4*q+2]+o, f[4*q+3]+o, f[4*q+4]+o
        }
    }' >"$mesh"
fi
light=sphere:2.2,2.9,1.1,0.5

# A list of points: 101 x 101 on the floor, with the normal that faces up.
awk -v y="$floor" 'BEGIN {
    print "x,y,z,nx,ny,nz"
    for (i = 0; i <= 100; i++) for (j = 0; j <= 100; j++)
        printf "%.4f,%s,%.4f,0,1,0\n", -3 + 0.06 * i, y, -3 + 0.06 * j
}' >points.csv

echo "demo: 10201 points of $out/points.csv"
"$softshadow" query "$mesh" --light "$light" points.csv -o visibility.csv --stats --verify=500 2>query.txt || {
    cat query.txt
    exit 1
}
sed 's/^/    /' query.txt
awk -F, 'NR > 1 { n++; v = $NF; lit += v >= 1; dark += v <= 0; sum += v }
    END { printf "demo: visibility.csv: %d lit, %d in umbra, %d in penumbra; %.4f on average\n",
              lit, dark, n - lit - dark, sum / n }' visibility.csv

echo "demo: a picture"
"$softshadow" render "$mesh" --light "$light" --size 800x600 --aov visibility,position,normal,depth \
    -o preview.exr -o preview.png --stats 2>render.txt || { cat render.txt; exit 1; }
sed 's/^/    /' render.txt
ms=$((($(now) - begin) / 1000000))
echo "demo: made in $ms ms, in $out:"
ls -l points.csv visibility.csv preview.exr preview.png | awk '{ printf "    %9d  %s\n", $5, $NF }'
exit "$status"
