#!/bin/sh
# composite.sh [FOLDER]: shadows put into a picture after it was rendered, A + sum of vis_i x B_i.
#
# A renderer gives the ambient light (A), what each lamp adds where nothing hides it (B_i), positions
# and normals. Here that renderer is a scene file opened by oiiotool; any other will do.
# softshadow query asks at those positions how much of each lamp is seen, and oiiotool puts it all
# together: with the lamps as they were, and once more with larger ones, without rendering again.
#
# Needs softshadow and oiiotool on the PATH, and OIIO_LIBRARY_PATH=PREFIX/lib/softshadow/oiio. Writes
# beauty.exr, relit.exr and PNGs of both into FOLDER (the current one). MESH=... takes another mesh.
set -eu
cd "${1:-.}"
mesh=${MESH:-/usr/share/glmark2/models/bunny.obj}
size=${SIZE:-480x360}

cat >lamps.softshadow <<EOF_SCENE
softshadow 1
mesh $mesh
light sphere:2.2,2.9,1.1,0.25
light rect:-2.6,2.2,1.2,0.1,0,0.2,0,0.3,0
size $size
aa 1
tolerance 0.004
aov position,normal,unshadowed
EOF_SCENE

# The renderer's passes, and how much of two lamps the pixels see: query adds its channels to theirs.
oiiotool lamps.softshadow -o passes.exr
softshadow query "$mesh" --light sphere:2.2,2.9,1.1,0.25 --light rect:-2.6,2.2,1.2,0.1,0,0.2,0,0.3,0 \
    --from passes.exr -o seen.exr
softshadow query "$mesh" --light sphere:2.2,2.9,1.1,0.8 --light rect:-2.6,2.2,1.2,0.4,0,0.8,0,0.9,0 \
    --from passes.exr -o seen-larger.exr

# composite SEEN OUT: A + vis_0 x B_0 + vis_1 x B_1, and the alpha it had.
composite() {
    oiiotool "$1" --ch R=ambient.R,G=ambient.G,B=ambient.B \
        "$1" --ch R=unshadowed.R,G=unshadowed.G,B=unshadowed.B \
        "$1" --ch R=visibility_0,G=visibility_0,B=visibility_0 --mul --add \
        "$1" --ch R=unshadowed.2.R,G=unshadowed.2.G,B=unshadowed.2.B \
        "$1" --ch R=visibility_1,G=visibility_1,B=visibility_1 --mul --add \
        "$1" --ch A --chappend --eraseattrib softshadow.method -o "$2.exr" \
        --ch R,G,B --colorconvert linear sRGB -d uint8 -o "$2.png"
}
composite seen.exr beauty
composite seen-larger.exr relit
