#!/usr/bin/env python3
"""The planes of the map methods as files, read back by a program that is not ours."""
import os
import re
import shutil
import subprocess
import unittest

from command import LIGHT, Case, main

SIDE = 32
BOUNDS = "-2,-2,0,2,2,0"
LAMP = "sphere:0.1,0,0,0.05"
BOX = """v -1 -1 -1
v 1 -1 -1
v 1 1 -1
v -1 1 -1
v -1 -1 1
v 1 -1 1
v 1 1 1
v -1 1 1
f 1 2 3 4
f 5 6 7 8
f 1 2 6 5
f 3 4 8 7
f 1 4 8 5
f 2 3 7 6
"""


def tool(*arguments):
    return subprocess.run(["oiiotool", *arguments], check=True, timeout=60,
                          stdout=subprocess.PIPE).stdout.decode()


class Maps(Case):
    def maps(self, *arguments, light=(LIGHT,), mesh=None, method="penumbra-limit", **more):
        lights = [word for one in light for word in ("--light", one)]
        return self.run_it("maps", mesh or self.mesh, *lights, "--method", method, "--resolution",
                           SIDE, *arguments, **more)

    def written(self, done, channels):
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn(b"%d channel" % channels, done.stderr)
        return done.stdout

    @staticmethod
    def clip_depth(matrix, place):
        z, w = (sum(matrix[4 * r + k] * (place + (1,))[k] for k in range(4)) for r in (2, 3))
        return z / w

    @unittest.skipUnless(shutil.which("oiiotool"), "no oiiotool")
    def test_positions(self):
        """The edges that penumbra-volume keeps are those of the triangle."""
        path = self.path("m.exr")
        half = self.put("half.obj", "v 99.5 -0.5 1\nv 100.5 -0.5 1\nv 99.5 0.5 1\nf 1 2 3\n")
        self.written(self.maps("--bounds", "99,-1,0,101,1,0.5", "-o", path, mesh=half,
                               light=("sphere:100,0,3,0.3",), method="penumbra-volume"), 9)
        about = tool("--info", "-v", path)
        channels = re.search(r"channel list: (.*)", about).group(1).split(", ")
        *origin, unit = (float(n) for n in
                         re.search(r'softshadow.origin: "(.*)"', about).group(1).split())
        corners = {(99.5, -.5, 1), (100.5, -.5, 1), (99.5, .5, 1)}
        seen = whole = 0
        for texel in re.findall(r"Pixel \(\d+, \d+\): (.*)", tool("--dumpdata", path, "--echo", "")):
            value = dict(zip(channels, map(float, texel.split())))
            if value["penumbra-volume.begin"] > 1e20:
                continue
            seen += 1
            ends = [tuple(round(origin[k] + unit * value["penumbra-volume.%s.%s" % (end, "xyz"[k])], 5)
                          for k in range(3)) for end in ("from", "to")]
            self.assertIn(ends[0], corners)
            whole += ends[1] in corners  # else at a corner, where a line through it cuts the light
        self.assertGreater(seen, 100)
        self.assertGreater(whole, .9 * seen)

    @unittest.skipUnless(shutil.which("oiiotool"), "no oiiotool")
    def test_channels(self):
        path = self.path("m.exr")
        half = self.put("half.obj", "v -0.5 -0.5 1\nv 0.5 -0.5 1\nv -0.5 0.5 1\nf 1 2 3\n")
        self.written(self.maps("--bounds", BOUNDS, "-o", path, mesh=half), 5)
        about = tool("--info", "-v", path)
        self.assertIn("%d x   %d, 5 channel, float openexr" % (SIDE, SIDE), about)
        channels = re.search(r"channel list: (.*)", about).group(1).split(", ")
        self.assertEqual(set(channels), {"depth"} | {"penumbra-limit." + c for c in "cgbq"})
        matrix, unit, origin = (
            [float(n) for n in re.search(r'softshadow.%s: "(.*)"' % name, about).group(1).split()]
            for name in ("matrix", "depth", "origin"))
        self.assertEqual((len(matrix), len(unit), len(origin)), (16, 2, 4))
        ndc = [float(n) for n in re.search(r"worldToNDC: (.*)", about).group(1).split(", ")]
        for i in range(16):  # rows of one are columns of the other, printed with six digits
            self.assertAlmostEqual(ndc[i], matrix[i % 4 * 4 + i // 4], delta=1e-5)
        dump = tool("--dumpdata", path, "--echo", "")
        texels = {(int(x), int(y)): [float(n) for n in rest.split()] for x, y, rest in
                  re.findall(r"Pixel \((\d+), (\d+)\): (.*)", dump)}
        self.assertEqual(len(texels), SIDE * SIDE)
        depth = channels.index("depth")
        corner = channels.index("penumbra-limit.c")
        # Points of the plane the triangle is in, through the matrix to their texels: y is up in clip
        # space, and the image's first row is its top.
        for place, held in (((-0.3, -0.3, 1), True), ((0.3, -0.4, 1), True), ((-0.4, 0.3, 1), True),
                            ((0.3, 0.3, 1), False)):
            clip = [sum(matrix[4 * r + k] * (place + (1,))[k] for k in range(4)) for r in range(4)]
            x = int((clip[0] / clip[3] + 1) / 2 * SIDE)
            y = int((1 - clip[1] / clip[3]) / 2 * SIDE)
            self.assertEqual(texels[x, y][depth] < 1e20, held, (place, x, y))
            if held:  # a point above the triangle is before what the texel holds, one below behind it
                h = [unit[0] + unit[1] * self.clip_depth(matrix, place[:2] + (z,))
                     for z in (1.01, 0.99)]
                self.assertLess(h[0], texels[x, y][depth])
                self.assertLess(texels[x, y][depth], h[1])
        # Somewhere a penumbra begins, and somewhere there is none.
        at = sorted(t[corner] for t in texels.values())
        self.assertLess(at[0], 1e20)
        self.assertGreater(at[-1], 1e20)

    @unittest.skipUnless(shutil.which("oiiotool"), "no oiiotool")
    def test_lights_and_faces(self):
        box = self.put("box.obj", BOX)
        path = self.path("m.exr")
        # From inside a closed box there is no silhouette: six depths. From outside: depth and c, g, b, q.
        self.written(self.maps("-o", path, light=(LAMP, "sun:0,0,-1,2"), mesh=box), 6 + 5)
        about = tool("--info", "-v", path)
        for name in ("light0.face5.depth", "light1.penumbra-limit.q", "light1.depth"):
            self.assertIn(name, about)
        self.assertEqual(about.count(".matrix: "), 7)
        self.assertNotIn("worldToNDC", about)  # which of them would it be?

    def test_folder(self):
        for folder in ("new", "new", "there/"):
            if folder == "there/":
                os.mkdir(self.path("there"))
            out = os.path.join(self.folder, folder)
            done = self.maps("-o", out, method="smoothie")
            self.assertEqual((done.returncode, done.stdout), (0, b""), done.stderr)
            self.assertEqual(sorted(os.listdir(out)), ["depth.exr", "smoothie.exr"])
        self.written(self.maps("-o", self.path("faces"), light=(LAMP,), mesh=self.put("box.obj", BOX),
                               method="hard"), 1)
        self.assertEqual(len([f for f in os.listdir(self.path("faces"))
                              if re.fullmatch(r"face\d-depth\.exr", f)]), 6)

    def test_stdout(self):
        self.written(self.maps("-o", self.path("m.exr"), method="hard"), 1)
        out = self.written(self.maps("-o", "-", method="hard"), 1)
        self.assertEqual(out[:4], b"\x76\x2f\x31\x01")
        # but for the time that the file says it was made
        self.assertEqual(len(out), len(self.get("m.exr")))
        self.assertEqual(self.good(self.maps("-q", "-o", "-", method="hard"))[:4], out[:4])

    def test_mistakes(self):
        self.bad(self.run_it("maps", "--light", LIGHT, "-o", "m.exr"), 2, "a mesh is missing")
        self.bad(self.run_it("maps", self.mesh, "--light", LIGHT, "--method", "hard"), 2, "-o DIR")
        self.bad(self.run_it("maps", self.mesh, "-m", "hard", "-o", "m.exr"), 2, "--light is missing")
        self.bad(self.run_it("maps", self.mesh, "--light", LIGHT, "-o", "m.exr"), 2, "auto builds no maps")
        self.bad(self.maps("-o", self.path("m.png")), 2, "m.png", ".exr")
        self.bad(self.maps("-o", self.path("m.exr"), method="hart"), 2, "did you mean hard")
        self.bad(self.maps("-o", self.path("m.exr"), "--resolution", "100000"), 2, "100000")
        self.bad(self.maps("-o", self.path("no/m.exr")), 1, "m.exr", "No such")
        self.bad(self.maps("-o", self.path("no/new")), 1, "new", "No such")
        self.bad(self.maps("-o", self.path("new"), method="exact"), 1, "exact", "no maps")
        self.bad(self.maps("-o", self.path("m.exr"), mesh=self.path("none.obj")), 1, "none.obj")
        empty = self.put("empty.obj", "v 0 0 0\n")
        self.bad(self.maps("-o", self.path("new"), mesh=empty, method="hard"), 1)
        self.assertEqual(sorted(os.listdir(self.folder)), ["empty.obj", "mesh.obj"])

    @unittest.skipUnless(os.path.exists("/dev/full"), "no /dev/full")
    def test_full_disk(self):
        self.bad(self.maps("-o", "/dev/full"), 1, "/dev/full", "No space")
        with open("/dev/full", "wb") as full:
            self.bad(self.maps("-o", "-", stdout=full), 1, "standard output", "No space")


if __name__ == "__main__":
    main()
