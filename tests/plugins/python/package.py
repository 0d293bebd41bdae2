"""Brings in the Python package as it is in the source, over the library as it was built.

A file that imports this is run again for each variant, with numpy and without it (its import is
made to fail), before it comes to import the package.
"""
import importlib.util
import math
import os
import subprocess
import sys
import unittest

SOURCE = os.path.abspath(os.environ.get("top_srcdir") or
                         os.path.join(os.path.dirname(__file__), "..", "..", ".."))
BUILD = os.path.abspath(os.environ.get("top_builddir") or ".")
PACKAGE = os.path.join(SOURCE, "plugins", "python")
LIBRARY = os.path.join(BUILD, ".libs", "libsoftshadow.so.1")
SANITIZERS = os.environ.get("SANITIZERS", "")
CC = (os.environ.get("CC") or "cc").split()
VARIANT = "SOFTSHADOW_TEST_VARIANT"


def _preload():
    """What a plain Python needs to load a library that was built with sanitizers. Leaks are not
    looked for: Python's own would be found."""
    found = []
    for kind, name in (("address", "libasan.so"), ("undefined", "libubsan.so")):
        if kind in SANITIZERS:
            asked = subprocess.run(CC + ["-print-file-name=" + name], stdout=subprocess.PIPE,
                                   check=True)
            found.append(os.path.realpath(asked.stdout.decode().strip()))
    if not found:
        return {}
    return {"LD_PRELOAD": ":".join(found), "ASAN_OPTIONS": "detect_leaks=0",
            "PYTHONMALLOC": "malloc"}  # else memory of Python has no borders to cross


def _with_numpy():
    """A Python that has numpy: this one, else Debian's, which may not be the first on the path."""
    for python in (sys.executable, "/usr/bin/python3"):
        asked = subprocess.run([python, "-c", "import numpy"], stderr=subprocess.DEVNULL)
        if asked.returncode == 0:
            return python
    return None


def _run_variants():
    if "thread" in SANITIZERS:
        print("skipped: Python cannot load a library that was built with ThreadSanitizer")
        sys.exit(77)
    environment = dict(os.environ, PYTHONDONTWRITEBYTECODE="1", **_preload())
    status = 0
    for variant, python in (("without numpy", sys.executable), ("with numpy", _with_numpy())):
        if python is None:
            print("skipped: numpy is not there (Debian package python3-numpy)")
            sys.exit(status or 77)
        print("== %s: %s" % (variant, python), flush=True)
        environment[VARIANT] = variant
        done = subprocess.run([python, "-W", "error"] + sys.argv, env=environment, timeout=500)
        status = status or done.returncode
    sys.exit(1 if status else 0)


if VARIANT not in os.environ:
    _run_variants()
WITH_NUMPY = os.environ[VARIANT] == "with numpy"
if not WITH_NUMPY:
    sys.modules["numpy"] = None
elif importlib.util.find_spec("numpy") is None:
    sys.exit("numpy was there a moment ago")
sys.path.insert(0, PACKAGE)
os.environ["SOFTSHADOW_LIBRARY"] = LIBRARY

# A square at z = 1 above the ground; a lamp above it: umbra, penumbra and light on the ground.
SQUARE = [(-.5, -.5, 1), (.5, -.5, 1), (.5, .5, 1), (-.5, .5, 1)]
FACES = [(0, 1, 2), (0, 2, 3)]
GROUND = [(x / 16.0, y / 8.0, 0.0) for y in range(-8, 9) for x in range(-16, 17)]


def lit_scene(softshadow, method=None, build=True, samples=0, **options):
    scene = softshadow.Scene(**options)
    scene.add_mesh(SQUARE, FACES)
    scene.set_light(softshadow.Sphere((0, 0, 4), 0.5))
    if build:
        scene.build(method, samples=samples)
    return scene


def bits(answers):
    """Answers as bytes: for comparison bit for bit, NaN included."""
    return memoryview(answers).cast("B").tobytes()


def child(code, **environment):
    """Runs code in a Python of its own; returns (status, stdout, stderr)."""
    plain = {k: v for k, v in os.environ.items() if k != "SOFTSHADOW_LIBRARY"}
    plain["PYTHONPATH"] = PACKAGE
    plain.update(environment)
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], env=plain, timeout=120,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def disk_cut(s):
    """The part of a unit disk on one side of a line at distance s; it grows with s."""
    s = max(-1.0, min(1.0, s))
    return 0.5 + (s * math.sqrt(1 - s * s) + math.asin(s)) / math.pi


main = unittest.main
