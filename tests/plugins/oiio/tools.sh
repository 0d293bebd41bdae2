#!/bin/sh
# Scene files in OpenImageIO's own programs: oiiotool and maketx see the pixels that softshadow render
# writes, to the bit; mistakes are one line; the compositing example's sums come out.
set -u
softshadow=$top_builddir/softshadow
for tool in oiiotool maketx idiff; do
    command -v $tool >/dev/null || { echo "$tool is not there (Debian package openimageio-tools)"; exit 77; }
done
[ -z "${SANITIZERS:-}" ] || { echo "oiiotool has no sanitizers' runtime"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
OIIO_LIBRARY_PATH=$SOFTSHADOW_MODULES
export OIIO_LIBRARY_PATH
bad=0
wrong() { echo "wrong: $*"; bad=1; }

mkdir meshes
printf 'v -1 1 -1\nv 1 1 -1\nv 1 1 1\nv -1 1 1\nf 1 2 3 4\n' >'meshes/a tile.obj'
cat >a.softshadow <<EOF
softshadow 1
mesh meshes/a tile.obj
light sphere:0.5,4,1,0.5
light sun:1,-1,0.2,2
camera 0,6,5/0,0,0/40
size 333x222
ground 0
aov visibility,position,normal,depth,unshadowed
EOF
channels=R,G,B,A,Z,visibility,visibility.2,P.X,P.Y,P.Z,N.X,N.Y,N.Z,ambient.R,ambient.G,ambient.B
channels=$channels,unshadowed.R,unshadowed.G,unshadowed.B,unshadowed.2.R,unshadowed.2.G,unshadowed.2.B

# same A B: the same channels, bit for bit (an EXR sorts them by name).
same() {
    oiiotool "$1" --ch $channels -o 1.exr 2>err.txt && oiiotool "$2" --ch $channels -o 2.exr 2>>err.txt &&
        [ ! -s err.txt ] || { wrong "$1, $2: $(cat err.txt)"; return; }
    idiff -fail 0 -warn 0 1.exr 2.exr >diff.txt || wrong "$1 and $2 differ: $(cat diff.txt)"
}
"$softshadow" render a.softshadow -o cli.exr -o cli.png 2>err.txt || wrong "render: $(cat err.txt)"
oiiotool a.softshadow -o oiio.exr || wrong "oiiotool"
same cli.exr oiio.exr
oiiotool cli.exr --ch visibility --printstats | awk '/Stats (Min|Max)/ { print $3 }' | tr '\n' ' ' |
    awk '{ exit !($1 == 0 && $2 == 1) }' || wrong "no umbra or no lit point in the picture"
# From elsewhere: paths are relative to the scene file. A cache of 1 MB asks tile by tile.
mkdir elsewhere
(cd elsewhere && oiiotool --cache 1 --autotile 64 ../a.softshadow -o ../far.exr) || wrong "from elsewhere"
same cli.exr far.exr
# The command line's own options win, its meshes and lights are added.
"$softshadow" render --size 50x40 a.softshadow --light sphere:0,9,0,1 --aov visibility -o small.exr 2>err.txt ||
    wrong "options beside a scene: $(cat err.txt)"
oiiotool --info -v small.exr >info.txt
grep -q ' 50 x   40, 26 channel' info.txt && grep -q 'visibility.3' info.txt || wrong "small.exr: $(cat info.txt)"

# A texture of it: its finest level is the picture again. TIFF has no names for channels.
maketx a.softshadow -o a.tx 2>err.txt && [ ! -s err.txt ] || wrong "maketx: $(cat err.txt)"
oiiotool a.softshadow -o a.tif && idiff -fail 0 -warn 0 a.tif a.tx >diff.txt || wrong "a.tx: $(cat diff.txt)"

# Hints are lines of the scene.
oiiotool --iconfig softshadow:size 40x30 --iconfig softshadow:aov depth -i a.softshadow -o hint.exr || wrong "hints"
oiiotool --info hint.exr | grep -q ' 40 x   30' || wrong "the hint did not count: $(oiiotool --info hint.exr)"

# refuse PATTERN COMMAND...: fails, and one line says why.
refuse() {
    pattern=$1
    shift
    "$@" >out.txt 2>&1 && wrong "$* works"
    [ "$(grep -c "$pattern" out.txt)" = 1 ] || wrong "$*: $(cat out.txt)"
}
printf 'softshadow 1\nmesh meshes/a tile.obj\nlight sphere:0,4\n' >light.softshadow
refuse 'light.softshadow:3: light sphere:' oiiotool light.softshadow -o x.exr
refuse 'light.softshadow:3: light sphere:' maketx light.softshadow -o x.tx
refuse '^softshadow render: light.softshadow:3: light sphere:' "$softshadow" render light.softshadow -o x.exr
printf 'softshadow 1\nmesh late.obj\nlight sphere:0,4,0,1\n' >late.softshadow
echo 'v 1 2 nan' >late.obj
refuse "late.obj:1:7: 'nan' is not finite" oiiotool late.softshadow -o x.exr
refuse "late.obj:1:7: 'nan' is not finite" maketx late.softshadow -o x.tx
[ ! -e x.exr ] && [ ! -e x.tx ] || wrong "a failed read left a picture"

# A + sum of vis_i x B_i. Asked again the points are rounded to float, and lie on no known triangle;
# measured 0.0016 at most, on the bunny's silhouette: 0.01 at any pixel would be a wrong shadow.
printf 'v -.4 .2 -.4\nv .4 .2 -.4\nv 0 1.2 .3\nf 1 2 3\n' >sail.obj
PATH=$top_builddir:$PATH MESH=$work/sail.obj SIZE=160x120 sh "$top_srcdir/examples/composite.sh" . >out.txt 2>&1 ||
    wrong "composite.sh: $(cat out.txt)"
oiiotool --fail 0.01 passes.exr --ch R,G,B,A beauty.exr --ch R,G,B,A --diff >diff.txt || wrong "composite: $(cat diff.txt)"
# larger lamps: other shadows
oiiotool --fail 0.05 relit.exr --ch R,G,B beauty.exr --ch R,G,B --diff >diff.txt && wrong "the relit picture has the old shadows"
exit "$bad"
