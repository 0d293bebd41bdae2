#!/usr/bin/env python3
"""make bench, on a few points, and its page as a browser shows it, offline: in light, in dark, on a
telephone."""
import csv
import glob
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

import browser

SOURCE, BUILD = os.environ["top_srcdir"], os.environ["top_builddir"]
FEW = "--quick --scenes triangle --lights object --side 24 --truth-points 60 --truth-samples 512 --repeat 1"


def skip(reason):
    print(reason)
    sys.exit(77)


class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="softshadow-bench-")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        ours = ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")  # of the make that runs this test
        own = {name: value for name, value in os.environ.items() if name not in ours}
        done = subprocess.run(
            ["make", "-C", BUILD, "bench", "BENCH_DIR=" + cls.folder, "BENCH_FLAGS=" + FEW,
             "BENCH_SWEEPS=--sweep light,threads",
             "BENCH_PICTURES=--scenes triangle --lights object --side 48 --truth-samples 512"],
            env=own, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=1200)
        if done.returncode:
            raise AssertionError(done.stdout.decode(errors="replace")[-4000:])
        cls.page = os.path.join(cls.folder, "report.html")

    def rows(self, name):
        with open(os.path.join(self.folder, name), newline="") as file:
            return list(csv.DictReader(file))

    def check(self, seen):
        self.assertEqual(seen["title"], "Soft shadows: run time against error")
        # The truth and each way's errors; a plot a cell, of the light two, of threads one.
        self.assertEqual(seen["images"], 1 + len(self.rows("pictures.csv")))
        self.assertEqual(seen["decoded"], seen["images"])
        self.assertEqual(seen["drawings"], 1 + 2 + 1)
        self.assertEqual(seen["drawn"], seen["drawings"])
        self.assertEqual(seen["complaints"], [])
        self.assertEqual((seen["asked"], seen["outside"]), ([], []), "the page must open offline")
        self.assertLessEqual(seen["wide"], seen["window"], "it must not be wider than the window")
        self.assertGreater(seen["text"], 2000)

    def test_in_a_browser(self):
        shots = []
        with browser.Browser() as shown:
            for width, dark in ((1280, False), (1280, True), (400, False)):
                with self.subTest(width=width, dark=dark):
                    self.check(shown.open(self.page, width, dark))
                    shots.append(shown.picture())
        for shot in shots:
            self.assertEqual(shot[:8], b"\x89PNG\r\n\x1a\n")
            self.assertGreater(len(shot), 20000, "a blank window has 5 kB")
        self.assertEqual(struct.unpack(">2I", shots[0][16:24]), (1280, 900))
        self.assertNotEqual(shots[0], shots[1], "dark is another picture")

    def test_a_bad_page_is_seen(self):
        """What check() looks at tells a page that is wrong in each of these ways."""
        path = os.path.join(self.folder, "bad.html")
        with open(path, "w") as file:
            file.write("<!doctype html><title>no</title><img src=http://127.0.0.1:9/none.png><svg></svg>"
                       "<p style='width: 3000px'>wide<script>console.error('oh'); no()</script>")
        with browser.Browser() as shown:
            seen = shown.open(path)
        os.remove(path)
        self.assertEqual((seen["images"], seen["decoded"], seen["drawings"], seen["drawn"]), (1, 0, 1, 0))
        self.assertGreater(seen["wide"], seen["window"])
        kinds = {complaint["method"] for complaint in seen["complaints"]}
        self.assertLessEqual({"Network.loadingFailed", "Runtime.consoleAPICalled", "Runtime.exceptionThrown"}, kinds)
        self.assertEqual(seen["asked"], ["http://127.0.0.1:9/none.png"])

    def test_page_names_no_other_host(self):
        with open(self.page, encoding="utf-8") as file:
            text = file.read()
        found = set(re.findall(r"https?://[^\"'\s<>]+", text))
        names = {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}  # which nothing fetches
        self.assertLessEqual(found, names)
        self.assertNotIn("<script", text)
        self.assertIn("prefers-color-scheme: dark", text)
        for href in re.findall(r'href="([^"#:]+)"', text):
            self.assertTrue(os.path.exists(os.path.join(self.folder, href)), href)
        ids = re.findall(r"""\bid=['"]([^'"]+)['"]""", text)
        self.assertEqual(len(ids), len(set(ids)), "drawings share no ids")

    def test_numbers_are_those_of_the_files(self):
        with open(self.page, encoding="utf-8") as file:
            text = file.read()
        must = [row for row in self.rows("matrix.csv")
                if row["method"] == "auto" and float(row["penumbra_rms"]) <= 1 / 64]
        fine = sum(float(row["behind"]) <= 1.1 for row in must)
        self.assertGreater(len(must), 0)
        self.assertIn("<b>%d of %d</b>" % (fine, len(must)), text)
        self.assertEqual(text.count('<span class="pill good">'), fine)
        self.assertEqual(text.count('<span class="pill bad">'), len(must) - fine)
        for row in must:
            self.assertIn("<td>%.5f</td>" % float(row["penumbra_rms"]), text)
        for row in self.rows("matrix.csv"):
            if row["method"] == "auto":
                self.assertIn("<td>triangle, object light</td><td>%s</td>" % row["setting"],
                              text[text.index('id="ratios"'):text.index('id="pictures"')])

    def test_plots(self):
        names = {os.path.splitext(os.path.basename(path))[0] for path in glob.glob(self.folder + "/plots/*")}
        self.assertEqual(names, {"front-triangle-object-camera", "light-time", "light-error", "threads-speed-up"})
        for name in names:
            base = os.path.join(self.folder, "plots", name)
            with open(base + ".png", "rb") as file:
                self.assertEqual(struct.unpack(">2I", file.read(24)[16:]), (1040, 560))
            with open(base + ".svg", encoding="utf-8") as file:
                self.assertIn("<path", file.read())
            before = os.path.getmtime(base + ".svg")
            subprocess.run(["gnuplot", base + ".gp"], check=True)
            self.assertGreater(os.path.getmtime(base + ".svg"), before)


if __name__ == "__main__":
    if os.environ.get("SANITIZERS"):
        skip("the program's own sanitizers say nothing of a page; bench.py runs it")
    if not browser.program():
        skip("chromium is missing: ./bootstrap --hosts installs it")
    if not shutil.which("gnuplot"):
        skip("gnuplot is missing: ./bootstrap --hosts installs it")
    unittest.main(verbosity=2)
