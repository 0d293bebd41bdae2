#!/usr/bin/env python3
"""The Python package in a real FreeCAD: solids of its own, cut and tessellated by it, before a lamp.

Run by Python it starts freecadcmd on itself; in there FreeCAD can be imported and the cases run.
"""
import math
import os
import shutil
import subprocess
import sys
import tempfile

SKIP, MARK = 77, "solids: all cases hold"
HERE = os.path.abspath(__file__ if "__file__" in globals() else sys.argv[-1])
SOURCE = os.path.abspath(os.environ.get("top_srcdir") or os.path.join(os.path.dirname(HERE), "../../.."))
BUILD = os.path.abspath(os.environ.get("top_builddir") or ".")


def skip(why):
    print(why)
    sys.exit(SKIP)


def outside():
    """FreeCAD's exit status says nothing of a script's: the last line does."""
    program = shutil.which("freecadcmd")
    if not program:
        skip("freecadcmd is not there (Debian package freecad-python3)")
    if os.environ.get("SANITIZERS"):
        skip("a sanitized library cannot be loaded by a host that is not")
    library = os.path.join(BUILD, ".libs", "libsoftshadow.so.1")
    with tempfile.TemporaryDirectory() as home:
        clean = dict(os.environ, PATH="/usr/local/bin:/usr/bin:/bin", SOFTSHADOW_LIBRARY=library,
                     PYTHONPATH=os.path.join(SOURCE, "plugins", "python"), HOME=home)
        ran = subprocess.run([program, HERE], env=clean, timeout=120, stdin=subprocess.DEVNULL,
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    print(ran.stdout)
    return 0 if MARK in ran.stdout else 1


def visibility(shape, points):
    """Of a square lamp of side 8, four above the points; 1/64 is the most exact may be off by."""
    import softshadow
    corners, facets = shape.tessellate(1e-3)
    with softshadow.Scene() as scene:
        scene.add_mesh([tuple(corner) for corner in corners], facets)
        scene.set_light(softshadow.Rect((0, 0, 4), (4, 0, 0), (0, 4, 0)))
        scene.build(method="exact")
        return list(scene.visibility(points))


def near(what, seen, truth):
    if abs(seen - truth) > 1 / 64:
        raise AssertionError("%s: %g is seen, the closed form says %g" % (what, seen, truth))
    print("%s: %g, closed form %g" % (what, seen, truth))


def inside():
    import Part
    from FreeCAD import Vector
    # Half as high as the lamp: seen from the middle its sides look twice as long.
    plate = Part.makeBox(2, 2, 1e-3, Vector(-1, -1, 2))
    middle, away = visibility(plate, [(0, 0, 0), (30, 0, 0)])
    near("a plate", middle, 1 - 4 * 4 / 64)
    near("far from it", away, 1)
    hole = Part.makeCylinder(.5, 1, Vector(0, 0, 1.5))
    near("a plate with a hole", visibility(plate.cut(hole), [(0, 0, 0)])[0], 1 - 4 * 4 / 64 + math.pi / 64)
    both = plate.fuse(Part.makeBox(1, 1, 1, Vector(-6, -6, 2)))
    near("a box beside it", visibility(both, [(0, 0, 0)])[0], 1 - 4 * 4 / 64)
    print(MARK)


try:
    import FreeCAD
except ImportError:
    FreeCAD = None
if FreeCAD is None:
    sys.exit(outside())
inside()
