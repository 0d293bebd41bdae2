"""Runs the softshadow that was built, for the scripts beside this one. Standard library only."""
import functools
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

SOURCE = os.environ.get("top_srcdir") or os.path.join(os.path.dirname(__file__), "..", "..")
BUILD = os.environ.get("top_builddir") or "."
SOFTSHADOW = os.path.join(os.path.abspath(BUILD), "softshadow")
LIGHT = "sphere:0,0,4,0.5"

# A square at z = 1 above the ground z = 0, and a light above it: lit, penumbra and umbra points.
MESH = """v -0.5 -0.5 1
v 0.5 -0.5 1
v 0.5 0.5 1
v -0.5 0.5 1
f 1 2 3 4
"""


def ground(count, normals=False):
    """Points at z = 0 whose coordinates are exact in float32; most of them in penumbra."""
    points = []
    for i in range(count):
        x = ((i * 37) % 257 - 128) / 128.0
        y = ((i * 91) % 263 - 131) / 256.0
        points.append((x, y, 0.0) + ((0.0, 0.0, 1.0) if normals else ()))
    return points


def raw(points):
    return b"".join(struct.pack("<%df" % len(p), *p) for p in points)


def npy(points, kind="f", version=1, columns=None):
    columns = columns or len(points[0])
    head = "{'descr': '<%s%d', 'fortran_order': False, 'shape': (%d, %d), }" % (
        "f", 4 if kind == "f" else 8, len(points), columns)
    prefix = 10 if version == 1 else 12
    head += " " * (-(prefix + len(head) + 1) % 64) + "\n"
    size = struct.pack("<H" if version == 1 else "<I", len(head))
    body = b"".join(struct.pack("<%d%s" % (columns, kind), *p) for p in points)
    return b"\x93NUMPY" + bytes([version, 0]) + size + head.encode() + body


def read_npy(data):
    """(shape, float32 values as bytes)"""
    assert data[:8] == b"\x93NUMPY\x01\x00", data[:8]
    length = struct.unpack("<H", data[8:10])[0]
    assert (10 + length) % 64 == 0
    head = eval(data[10:10 + length].decode(), {"__builtins__": {}})
    assert head["descr"] == "<f4" and head["fortran_order"] is False, head
    return head["shape"], data[10 + length:]


def text(points, separator=" "):
    return "".join(separator.join(repr(c) for c in p) + "\n" for p in points).encode()


def ply(points, form="binary_little_endian", kind="float"):
    names = ["x", "y", "z", "nx", "ny", "nz"][:len(points[0])]
    head = "ply\nformat %s 1.0\nelement vertex %d\n" % (form, len(points))
    head += "".join("property %s %s\n" % (kind, n) for n in names) + "end_header\n"
    if form == "ascii":
        return head.encode() + text(points)
    order = "<" if "little" in form else ">"
    code = "f" if kind == "float" else "d"
    return head.encode() + b"".join(struct.pack(order + "%d%s" % (len(p), code), *p) for p in points)


@functools.lru_cache()
def method():
    """One whose answers are bit-identical however the points are split."""
    listed = json.loads(subprocess.run([SOFTSHADOW, "methods", "--json"], check=True,
                                       stdout=subprocess.PIPE).stdout)
    names = [m["name"] for m in listed]
    return next((n for n in ("exact", "raytrace") if n in names), "auto")


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="softshadow-cli-")
        self.addCleanup(shutil.rmtree, self.folder)
        self.mesh = self.put("mesh.obj", MESH)

    def path(self, name):
        return os.path.join(self.folder, name)

    def put(self, name, data):
        with open(self.path(name), "wb") as file:
            file.write(data if isinstance(data, bytes) else data.encode())
        return self.path(name)

    def get(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def run_it(self, *arguments, stdin=b"", **more):
        options = dict(input=stdin, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=120)
        if "stdin_file" in more:
            del options["input"]
            options["stdin"] = more.pop("stdin_file")
        options.update(more)
        return subprocess.run([SOFTSHADOW] + [str(a) for a in arguments], **options)

    def query(self, *arguments, **more):
        return self.run_it("query", self.mesh, "--light", LIGHT, "--method", method(), *arguments,
                           **more)

    def good(self, done):
        self.assertEqual((done.returncode, done.stderr), (0, b""))
        return done.stdout

    def bad(self, done, status, *parts):
        """The exit status, nothing on stdout, one line on stderr that holds the parts."""
        error = done.stderr.decode()
        self.assertEqual((done.returncode, error.count("\n")), (status, 1), error)
        self.assertTrue(error.startswith("softshadow"), error)
        for part in parts:
            self.assertIn(part, error)
        return error

    def visibilities(self, points, *arguments):
        """What raw output has: the reference for all other formats."""
        kind = "raw6" if len(points[0]) == 6 else "raw"
        out = self.good(self.query("--input-format", kind, *arguments, stdin=raw(points)))
        return struct.unpack("<%df" % (len(out) // 4), out)


def main():
    if not os.path.exists(SOFTSHADOW):
        sys.exit("no %s: build it first, and run with top_builddir set" % SOFTSHADOW)
    unittest.main(verbosity=2)
