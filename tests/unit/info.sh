#!/bin/sh
# softshadow info on meshes whose counts are known by hand: text, JSON, and what goes wrong.
program=$top_builddir/softshadow
[ -x "$program" ] || exit 77
folder=$(mktemp -d) || exit 99
trap 'rm -rf "$folder"' EXIT
cd "$folder" || exit 99
fail() { echo "FAIL: $*"; cat out err 2>/dev/null; exit 1; }
info() { "$program" info "$@" >out 2>err; }
line() { grep -Eq "^  $1 +$2\$" out || fail "no line '$1 $2'"; }

# A closed tetrahedron, as seen from far above its apex: the three edges of its base.
cat >closed.obj <<'END'
v 0 0 0
v 4 0 0
v 0 4 0
v 1 1 1
f 1 3 2
f 1 2 4
f 2 3 4
f 3 1 4
END
info closed.obj --light sphere:1,1,1000,1 --light sphere:1,1,-1000,1 || fail "status $?"
line format OBJ; line triangles 4; line vertices 4; line surface closed; line components 1
line edges 6; line 'boundary edges' 0; line 'bounds x' '0 \.\. 4'; line 'bounds z' '0 \.\. 1'
line 'silhouette edges' '3  from sphere:1,1,1000,1'
line 'silhouette edges' '3  from sphere:1,1,-1000,1'

# Three faces on one edge, one of them there twice and once without area.
cat >open.off <<'END'
OFF
5 5 0
0 0 0
1 0 0
0 1 0
0 0 1
0 -1 0
3 0 1 2
3 0 1 3
3 0 1 4
3 0 1 4
3 0 0 1
END
info open.off || fail "status $?"
line surface open; line triangles 5; line 'non-manifold edges' 1
line 'degenerate triangles' 1; line 'duplicate triangles' 1

# JSON holds the same, and a mesh that fails does not take the others with it.
printf 'v 0 0 0\nf 1 1 9\n' >bad.obj
info --json closed.obj bad.obj 'open.off' && fail 'a bad mesh has status 0'
[ $? -eq 1 ] || fail 'the status of a bad mesh is not 1'
[ "$(wc -l <err)" -eq 1 ] || fail 'not one line of error'
grep -q '^softshadow info: bad.obj:2:7: vertex 9 is named' err || fail 'the error names no place'
for word in '"file": "closed.obj"' '"closed": true' '"closed": false' '"nonmanifold_edges": 1' \
    '"silhouettes": \[\]' '"bounds": \[0, 0, 0, 4, 4, 1\]'; do
    grep -q "$word" out || fail "no $word"
done
if [ -n "$PYTHON" ]; then "$PYTHON" -m json.tool out >/dev/null || fail 'no JSON'; fi

# What is here, and why not: no driver, no such device, too old an OpenGL.
egl() { sed -n '/^egl$/,$p' out; }
info --backends || fail "status $?"
line device '[a-z0-9]+'
grep -Eq '^  methods +auto, exact, raytrace, hard' out || fail 'the CPU has every method'
here=no; egl | grep -q '^  device ' && here=yes
egl | grep -Eq '^  (device|not here) +[^ ]' || fail 'neither here nor why not'
egl | grep -q 'methods .*hard' && ! egl | grep -q exact || fail 'methods of the GPU'
info --backends closed.obj; [ $? -eq 2 ] || fail 'backends of a mesh'
info --backends --json || fail 'JSON'
if [ -n "$PYTHON" ]; then "$PYTHON" -m json.tool out >/dev/null || fail 'no JSON'; fi
not_here() { # not_here WORDS: the status is 0, the line has them
    info --backends || fail "status $?"
    egl | grep -Eq "^  not here +.*$1" || fail "no '$1'"
}
if [ $here = yes ]; then
    (export SOFTSHADOW_EGL_DEVICE=99; not_here 'SOFTSHADOW_EGL_DEVICE: "99", must be') || exit 1
    (export SOFTSHADOW_EGL_DEVICE=x; not_here 'SOFTSHADOW_EGL_DEVICE: "x", must be') || exit 1
    if egl | grep -q Mesa; then # environment of glvnd and of Mesa
        (export __EGL_VENDOR_LIBRARY_FILENAMES=/nowhere; not_here 'EGL: no device') || exit 1
        (export MESA_GL_VERSION_OVERRIDE=3.3; not_here 'too old: EGL_') || exit 1
    fi
fi

# Wrong usage is 2, and then nothing is on stdout.
info; [ $? -eq 2 ] || fail 'no mesh'
info closed.obj --light sphere:0,0,1,-1; [ $? -eq 2 ] || fail 'a negative radius'
[ "$(wc -l <err)" -eq 1 ] && [ ! -s out ] || fail 'a negative radius says more than one line'
info closed.obj --light lamp:1; [ $? -eq 2 ] || fail 'a light of no kind'
info closed.obj --nonsense; [ $? -eq 2 ] || fail 'an option that is none'
if [ -w /dev/full ]; then
    "$program" info closed.obj >/dev/full 2>err; [ $? -eq 1 ] || fail 'a full disk'
fi
exit 0
