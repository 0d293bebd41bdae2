#!/bin/sh
# render and explain by running them: what a pixel holds, what is refused, what a failure leaves behind.
set -u
softshadow=$top_builddir/softshadow
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
bad=0
wrong() { echo "wrong: $*"; bad=1; }
command -v oiiotool >/dev/null || { echo "oiiotool is not there (Debian package openimageio-tools)"; exit 77; }

# expect STATUS PATTERN ARGUMENT...: that exit status, and one line on stderr that has the pattern.
expect() {
    status=$1 pattern=$2
    shift 2
    "$softshadow" "$@" >out.txt 2>err.txt
    got=$?
    [ "$got" = "$status" ] || wrong "softshadow $*: status $got, not $status: $(cat err.txt)"
    [ "$(wc -l <err.txt)" = 1 ] || wrong "softshadow $*: not one line: $(cat err.txt)"
    grep -q -- "$pattern" err.txt || wrong "softshadow $*: $(cat err.txt)"
}
# pixel FILE CHANNEL X Y: its value.
pixel() {
    oiiotool "$1" --ch "$2" --cut "1x1+$3+$4" --printstats |
        sed -n 's/.*Stats Min: *\([-0-9.e]*\).*/\1/p' | head -n 1
}
# near VALUE WANTED TOLERANCE
near() { awk -v a="$1" -v b="$2" -v t="$3" 'BEGIN { exit !(a != "" && a - b <= t && b - a <= t) }'; }

# A 2 x 2 tile at height 1; sunlight goes along +x and down by 45 degrees, so its shadow lies on the
# ground at x in 0..2. The camera looks straight down from 9.
printf 'v -1 1 -1\nv 1 1 -1\nv 1 1 1\nv -1 1 1\nf 1 2 3 4\n' >tile.obj
sun=sun:1,-1,0,0.267
above="--camera 0,9,0/0,0,0/40 --ground 0 --size 100x100 --aa 1"

# 1.6 to the right on the ground is column (1.6 / 9 / tan 20 + 1) / 2 * 100 = 74, to the left 25.
"$softshadow" render tile.obj --light $sun --light sphere:0,9,0,1 $above \
    --aov visibility,position,normal,depth -o a.exr -o a.png -o a.tif 2>err.txt || wrong "render: $(cat err.txt)"
for file in a.exr a.png a.tif; do
    [ -s $file ] && grep -q "wrote $file" err.txt || wrong "$file was not made, or not told"
done
oiiotool --info -v a.exr | grep -q 'R, G, B, A, Z, visibility, N.X, N.Y, N.Z, P.X, P.Y, P.Z, visibility.2' ||
    wrong "channels: $(oiiotool --info -v a.exr | grep channel)"
near "$(pixel a.exr visibility 74 50)" 0 0 || wrong "in the shadow: $(pixel a.exr visibility 74 50)"
near "$(pixel a.exr visibility 25 50)" 1 0 || wrong "beside it: $(pixel a.exr visibility 25 50)"
near "$(pixel a.exr visibility 50 50)" 1 0 || wrong "on the tile: $(pixel a.exr visibility 50 50)"
# A pixel is 0.066 wide on the ground.
near "$(pixel a.exr P.X 74 50)" 1.6 0.07 || wrong "position: $(pixel a.exr P.X 74 50)"
near "$(pixel a.exr P.Y 50 50)" 1 1e-6 || wrong "the tile's height: $(pixel a.exr P.Y 50 50)"
near "$(pixel a.exr N.Y 50 50)" 1 0 || wrong "the tile's normal: $(pixel a.exr N.Y 50 50)"
near "$(pixel a.exr Z 50 50)" 8 1e-5 || wrong "depth: $(pixel a.exr Z 50 50)"
lit=$(pixel a.exr R 25 50) dark=$(pixel a.exr R 74 50)
awk -v l="$lit" -v d="$dark" 'BEGIN { exit !(l > 1.2 * d && d > 0) }' || wrong "shading: $lit in light, $dark in shadow"

# The passes ask for the same points again. What differs: positions were rounded to float, and a
# sample pattern turns with a point's last bits: 1024 samples are 4 sigma within 4 sqrt(.25/1024) = .0625.
lamp=sphere:2,5,1,0.7
"$softshadow" render tile.obj --light $lamp $above --method raytrace --samples 1024 \
    --aov visibility,position,normal -o pass.exr 2>/dev/null
"$softshadow" query tile.obj --light $lamp --method raytrace --samples 1024 pass.exr -o again.exr ||
    wrong "query of a rendered image"
oiiotool --fail 0.0625 pass.exr --ch visibility again.exr --ch visibility --diff >diff.txt ||
    wrong "render and query differ: $(cat diff.txt)"
oiiotool again.exr --ch visibility --printstats | awk '/Stats (Min|Max)/ { print $3 }' | tr '\n' ' ' |
    awk '{ exit !($1 == 0 && $2 == 1) }' || wrong "no umbra or no lit point in the picture"

# What is asked wrongly.
expect 2 'a mesh is missing' render --light $sun -o x.png
expect 2 'light is missing' render tile.obj -o x.png
expect 2 'is missing' render tile.obj --light $sun
expect 2 'ends in .exr' render tile.obj --light $sun -o x.jpg
expect 2 'PNG has no room' render tile.obj --light $sun --aov depth -o x.png
expect 2 'are allowed' render tile.obj --light $sun --aov depth,colour -o x.exr
expect 2 'WxH' render tile.obj --light $sun --size 100 -o x.png
expect 2 'WxH' render tile.obj --light $sun --size 0x10 -o x.png
expect 2 'EX,EY,EZ' render tile.obj --light $sun --camera 1,2,3 -o x.png
expect 2 'eye is the target' render tile.obj --light $sun --camera 1,2,3/1,2,3 -o x.png
expect 2 'on, off or a height' render tile.obj --light $sun --ground nan -o x.png
expect 2 'at X,Y,Z is missing' explain tile.obj --light $sun
expect 2 'one --light' explain tile.obj --light $sun --light $sun --at 0,0,0 -o x.png
expect 2 'MESH:TRIANGLE' explain tile.obj --light $sun --at 0,0,0 --primitive 3

# What fails, and what that leaves behind: the file that was there before.
echo before >x.png
expect 1 'none.obj' render none.obj --light $sun -o x.png
[ "$(cat x.png)" = before ] || wrong "a failed run touched its output"
expect 1 '' render tile.obj --light $sun -o nowhere/x.png
SOFTSHADOW_MODULES=/nowhere expect 1 'softshadow-image.so' render tile.obj --light $sun -o x.png
if [ -c /dev/full ]; then
    for end in png exr tif; do
        ln -s /dev/full full.$end
        expect 1 'full' render tile.obj --light $sun --size 64x64 -o full.$end
    done
fi
[ "$(cat x.png)" = before ] && [ -z "$(find . -name 'nowhere*' -o -name '*.tmp*' -o -name '.x*')" ] ||
    wrong "left behind: $(ls -A)"

# The edge of a half-plane through the middle of the light hides half of it; of a picture 512 wide the
# edge is a column: 1/512 of the height in doubt, 0.0025 of the disk.
printf 'v -1000 1 -1000\nv 0 1 -1000\nv 0 1 1000\nv -1000 1 1000\nf 1 2 3 4\n' >half.obj
"$softshadow" explain half.obj --light disk:0,2,0,0,-1,0,0.5 --at 0,0,0 -o light.png >told.txt 2>/dev/null ||
    wrong "explain"
near "$(sed -n 's/^visibility \([0-9.]*\),.*/\1/p' told.txt)" 0.5 0.0025 || wrong "explain: $(cat told.txt)"
# One of its two triangles does all of that.
near "$(awk '/^mesh/ { on = 1; next } on { n++; sum += $3 } END { print (n == 1) * sum }' told.txt)" 0.5 0.0025 ||
    wrong "explain's list: $(cat told.txt)"
oiiotool --info light.png | grep -q '512 x  512, 3 channel, uint8' || wrong "light.png: $(oiiotool --info light.png)"
"$softshadow" explain half.obj --light $sun --at 5,0,0 | grep -q '^visibility 1.000000, hidden by 0 triangles' ||
    wrong "explain of a point in full light"
exit "$bad"
