#!/bin/sh
# Every #include between rooms of lib/ must be an arrow of lib/LAYERS, and third parties stay in
# their rooms.
set -u
lib=${top_srcdir:-.}/lib
bad=0
for file in $(find "$lib" -mindepth 2 \( -name '*.c' -o -name '*.h' -o -name '*.cc' \)); do
    room=${file#"$lib"/}; room=${room%%/*}
    allowed=$(sed -n "s/^$room:[ ]*//p" "$lib/LAYERS")
    grep -q "^$room:" "$lib/LAYERS" || { echo "$file: room '$room' is not in LAYERS"; bad=1; }
    for target in $(sed -n 's/^#[ ]*include[ ]*"\([a-z_]*\)\/.*/\1/p' "$file" | sort -u); do
        [ "$target" = "$room" ] && continue
        case " $allowed " in *" $target "*) ;; *) echo "$file: '$room' may not include '$target'"; bad=1 ;; esac
    done
    own() { # own PATTERN ROOM: only that room includes it
        grep -q "#[ ]*include[ ]*<$1" "$file" && [ "$room" != "$2" ] &&
            { echo "$file: only $2/ may include <$1"; bad=1; }
    }
    own embree3/ trace; own OpenMesh/ topology; own epoxy/ raster; own OpenImageIO/ nobody
done
[ "$bad" = 0 ] && echo "every arrow is in LAYERS"
exit "$bad"
