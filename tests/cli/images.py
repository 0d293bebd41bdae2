#!/usr/bin/env python3
"""Images of positions: each pixel is a point, the answers come back as a channel beside the others."""
import re
import shutil
import struct
import subprocess
import unittest

from command import Case, ground, main, raw, text

WIDTH, HEIGHT = 20, 10


class Images(Case):
    def setUp(self):
        super().setUp()
        self.points = ground(WIDTH * HEIGHT)
        rows = [self.points[y * WIDTH:(y + 1) * WIDTH] for y in range(HEIGHT)]
        # PFM: three floats a pixel, the last row first
        self.image = self.put("p.pfm", b"PF\n%d %d\n-1.0\n" % (WIDTH, HEIGHT) +
                              b"".join(raw(row) for row in reversed(rows)))
        self.wanted = self.visibilities(self.points)

    def test_into_a_list(self):
        self.good(self.query(self.image, "-o", self.path("o.raw")))
        self.assertEqual(self.get("o.raw"), struct.pack("<200f", *self.wanted))

    @unittest.skipUnless(shutil.which("oiiotool"), "no oiiotool")
    def test_into_an_image(self):
        self.good(self.query(self.image, "-o", self.path("o.exr")))
        out = subprocess.run(["oiiotool", "--dumpdata", self.path("o.exr"), "--echo", ""], check=True,
                             timeout=60, stdout=subprocess.PIPE).stdout.decode()
        told = {(int(x), int(y)): [float(n) for n in rest.split()] for x, y, rest in
                re.findall(r"Pixel \((\d+), (\d+)\): (.*)", out)}
        self.assertEqual(len(told), WIDTH * HEIGHT)
        for i, (point, value) in enumerate(zip(self.points, self.wanted)):
            channels = told[i % WIDTH, i // WIDTH]
            # printed with six digits or more
            for a, b in zip(channels, point + (value,)):
                self.assertAlmostEqual(a, b, delta=1e-5)
        # and from the EXR that has R G B and visibility once more
        self.good(self.query(self.path("o.exr"), "-o", self.path("again.raw")))
        self.assertEqual(self.get("again.raw"), struct.pack("<200f", *self.wanted))

    def test_blur(self):
        """Rows of an image are what a blur runs along: none, the library's own 12 pixels, or others."""
        across = [((i % WIDTH - 9.5) / 8, y / 16, 0.0) for y in range(HEIGHT) for i in range(WIDTH)]
        image = self.put("line.pfm", b"PF\n%d %d\n-1.0\n" % (WIDTH, HEIGHT) + raw(across))
        told = []
        for n, blur in enumerate([[], ["--blur"], ["--blur=12"], ["--blur=3"]]):
            out = self.path("%d.raw" % n)
            self.good(self.query(image, "--method", "penumbra-mask", *blur, "-o", out))
            told.append(self.get("%d.raw" % n))
        self.assertEqual(told[1], told[2])
        self.assertEqual(len(set(told)), 3)

    def test_mistakes(self):
        self.bad(self.query(self.image), 2, "image is written to a file")
        self.bad(self.query(self.image, "--shard", "0/2", "-o", self.path("o.raw")), 2, "need a file")
        self.bad(self.query(self.image, "--channels", "Q", "-o", self.path("o.raw")), 1, "p.pfm")
        self.bad(self.query(self.put("bad.exr", b"x" * 100), "-o", self.path("o.raw")), 1, "bad.exr")
        self.bad(self.query("--input-format", "image", "-o", self.path("o.raw"), stdin=b""), 2, "image")


if __name__ == "__main__":
    main()
