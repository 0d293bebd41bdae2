#!/bin/bash
# bash picture.sh bunny.png: prints the numbers of README.md's table and makes its picture, with povray, oiiotool
# and the bunny of glmark2-data. SOFTSHADOW names the program if it is not on the PATH.
set -eu
softshadow=${SOFTSHADOW:-softshadow}
here=$(cd "$(dirname "$0")" && pwd)
out=$(realpath "${1:?usage: picture.sh OUT.png}")
bunny=/usr/share/glmark2/models/bunny.obj
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
TIMEFORMAT='%U %S'

# seconds COMMAND...: the processor time that it took.
seconds() { { time "$@" >said.txt 2>&1; } 2>&1 | awk '{ printf "%.1f s", $1 + $2 }'; }
written() { "$softshadow" povray "$bunny" --light sphere:2.2,2.9,1.1,0.5 --area 33 --size 320x240 --aa 1 -q \
    --shadows "$1" -o "$1.pov"; }
# One thread: many would share their memory's bandwidth, and time is summed over them.
rendered() { povray "+I$1.pov" "+O$2" +W320 +H240 -D +WT1 "+L$here" "${@:3}"; }
decibel() { oiiotool "$1" --ch 0,1,2 "$2" --ch 0,1,2 --diff | sed -n 's/.*Peak SNR = \(.*\)/\1 dB/p' || true; }

printf '%-10s %12s %12s %12s %10s\n' shadows softshadow POV-Ray like bytes
for kind in area projected baked none; do
    ours=$(seconds written "$kind")
    theirs=$(seconds rendered "$kind" "$kind.png" -A)
    like=
    case $kind in projected | baked) like=$(decibel area.png "$kind.png") ;; esac
    printf '%-10s %12s %12s %12s %10d\n' "$kind" "$ours" "$theirs" "$like" "$(stat -c %s "$kind.pov")"
done

oiiotool area.png projected.png baked.png --mosaic:pad=4 3x1 -d uint8 -o "$out"
