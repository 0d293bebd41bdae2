#!/usr/bin/env python3
"""front.py on files made up for it: what is behind the front, and what is noise."""
import csv
import os
import stat
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
HEAD = "sweep,scene,triangles,light,points,penumbra,cpu,threads,method,unit,setting,backend,ns_a_point,penumbra_rms,rms"


def row(method="auto", setting="1/256", ns=100, rms=.002, scene="bunny", light="medium", penumbra=.25, sweep="",
        rms_all=None):
    backend = "embree" if method.startswith("peer") else "cpu"
    unit = "tolerance" if method == "auto" else "samples"
    return "%s,%s,9,%s,camera,%s,best,1,%s,%s,%s,%s,%s,%s,%s" % (
        sweep, scene, light, penumbra, method, unit, setting, backend, ns, rms, rms if rms_all is None else rms_all)


class Front(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="softshadow-front-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def put(self, name, *rows, head=HEAD):
        with open(self.path(name), "w") as file:
            file.write("\n".join((head,) + rows) + "\n")
        return self.path(name)

    def call(self, status, *arguments):
        done = subprocess.run([sys.executable, os.path.join(HERE, "front.py")] + list(arguments),
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=60)
        out = done.stdout.decode()
        self.assertEqual(done.returncode, status, out)
        return out

    def judge(self, status, *rows):
        return self.call(status, self.put("m.csv", *rows))

    def test_on_it(self):
        out = self.judge(0, row(), row("exact", 512, 110, .002), row("hard", 256, 1, .3))
        self.assertIn("auto: 1 of 1 rows on the front (to 10 %), every row of 1 of 1 cells", out)
        self.judge(0, row(), row("exact", 512, 91, .002))  # noise
        self.judge(0, row(), row("exact", 512, 50, .0021))  # faster, but errs more
        self.judge(0, row())  # nobody else

    def test_behind(self):
        out = self.judge(1, row(), row("exact", 512, 90, .002), row("exact", 1024, 95, .001))
        self.assertIn("BEHIND bunny, medium light, camera points: auto 1/256 (rms 0.00200) takes 1.11 times as long "
                      "as exact 512 (rms 0.00200), 1.11 of the library's best", out)
        self.assertIn("0 of 1 rows", out)
        out = self.judge(1, row(), row("peer", 64, 50, .001), row("exact", 512, 80, .001))
        self.assertIn("takes 2.00 times as long as peer 64 (rms 0.00100), 1.25 of the library's best", out)
        # auto at another tolerance is a rival, too.
        self.judge(1, row(), row("auto", "1/1024", 50, .001))

    def test_what_must_be(self):
        coarse = row("auto", "1/64", 900, .0157), row("exact", 256, 100, .001)
        self.assertIn("nothing to judge", self.judge(2, *coarse))
        self.judge(1, row("auto", "1/64", 900, .015625), coarse[1])
        self.assertIn("nothing to judge", self.judge(2, coarse[1]))
        self.assertIn("nothing to judge", self.judge(2, row(sweep="light"), row("exact", 256, 10, .001)))

    def test_cells_are_apart(self):
        out = self.judge(1, row(), row("exact", 512, 50, .002, light="object"), row(light="object"),
                         row("auto", "1/64", 20, .01, light="object"))
        self.assertIn("2 of 3 rows on the front (to 10 %), every row of 1 of 2 cells", out)
        self.assertIn("BEHIND bunny, object light", out)
        two = self.put("a.csv", row()), self.put("b.csv", row(scene="triangle"))
        self.assertIn("2 of 2 cells", self.call(0, *two))

    def test_no_penumbra(self):
        """Where no point is in penumbra the error over all points tells methods apart."""
        fast = row("exact", 512, 10, 0, penumbra=0, rms_all=.003)
        self.judge(0, row(rms=0, penumbra=0, rms_all=.002), fast)
        self.judge(1, row(rms=0, penumbra=0, rms_all=.004), fast)

    def test_files(self):
        self.assertIn("none.csv: No such file", self.call(2, self.path("none.csv")))
        self.assertIn("line 2 is no row", self.judge(2, "1,2,3"))
        self.assertIn("line 2: penumbra_rms 'nan' is no time or error", self.judge(2, row(rms="nan")))
        self.assertIn("line 3: ns_a_point 'fast'", self.judge(2, row(), row(ns="fast")))
        self.assertIn("of scenes=", self.call(2, "--run", "softshadow", "size=3"))
        self.call(2)
        self.call(2, "--run")

    def fake(self, *answers):
        """A softshadow that answers what is given, one after the other."""
        for i, rows in enumerate(answers):
            if rows is not None:
                self.put("answer%d" % i, *rows)
        path = self.path("softshadow")
        with open(path, "w") as file:
            file.write('#!/bin/sh\ncd "%s"\nn=$(cat count 2>/dev/null || echo 0)\necho $((n + 1)) >count\n'
                       'echo "$@" >>asked\nwhile [ "$1" != --csv ]; do shift; done\n'
                       '[ $n -lt %d ] || exit 1\n[ ! -f answer$n ] || cp answer$n "$2"\n' % (self.folder, len(answers)))
        os.chmod(path, os.stat(path).st_mode | stat.S_IXUSR)
        return path

    def asked(self):
        with open(self.path("asked")) as file:
            return file.read().splitlines()

    def test_measures_every_cell(self):
        cell = [row(), row("exact", 512, 120, .001)]
        program = self.fake(cell, [row(light="object")], None, None)
        out = self.call(0, "--run", program, "scenes=bunny,dragon-11k", "lights=medium,object", "side=8",
                        "csv=" + self.path("out.csv"))
        self.assertEqual([line.split("--lights ")[1].split()[0] for line in self.asked()],
                         ["medium", "object"] * 2)
        self.assertIn("--side 8", self.asked()[0])
        self.assertEqual(out.count("dragon-11k: left out"), 2)
        self.assertIn("bunny, object light: auto 1/256 (rms 0.00200): no other errs so little", out)
        with open(self.path("out.csv"), newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([(r["light"], r["front"], r["behind"], r["ahead"]) for r in rows],
                         [("medium", "1", "0.83", "exact"), ("object", "1", "0.00", "")])
        self.assertNotRegex(",".join(rows[0]), "ns_|_ms|second")

    def test_noise_is_measured_again(self):
        slow = [row(), row("exact", 512, 50, .001)]
        fine = [row(), row("exact", 512, 95, .001)]
        arguments = ("scenes=bunny", "lights=medium")
        self.assertIn("1 of 1 rows", self.call(0, "--run", self.fake(slow, fine), *arguments))
        self.assertEqual(len(self.asked()), 2)
        for name in ("count", "asked"):
            os.remove(self.path(name))
        worse = [row(), row("exact", 512, 20, .001)]
        out = self.call(1, "--run", self.fake(worse, slow, worse), *arguments)
        self.assertIn("takes 2.00 times", out)
        self.assertEqual(len(self.asked()), 3)

    def test_a_bench_that_fails(self):
        self.assertIn("exit status 1", self.call(2, "--run", self.fake(), "scenes=bunny"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
