#!/usr/bin/env python3
"""check.py on files made up for it: what is a regression and what is noise."""
import os
import stat
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
HEAD = ("scene,triangles,light,points,cpu,penumbra,method,tolerance,ratio,ratio_is,penumbra_rms,rms,max,settled,"
        "lit_ratio,build_ratio,thread_ratio")


def row(scene="bunny", ratio="10.00", rms="0.00200", most="0.0100", method="exact", cpu="best"):
    return "%s,69666,medium,camera,%s,0.250,%s,1/256,%s,interpolated,%s,0.00100,%s,0.2,5.0,0.5,nan" % (
        scene, cpu, method, ratio, rms, most)


class Check(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="softshadow-check-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def put(self, name, *rows, head=HEAD):
        path = os.path.join(self.folder, name)
        with open(path, "w") as file:
            file.write("\n".join((head,) + rows) + "\n")
        return path

    def check(self, status, *arguments, **environment):
        done = subprocess.run([sys.executable, os.path.join(HERE, "check.py")] + list(arguments),
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=60,
                              env=dict(os.environ, **environment))
        out = done.stdout.decode()
        self.assertEqual(done.returncode, status, out)
        return out

    def of(self, status, old, new):
        return self.check(status, self.put("old.csv", *old), self.put("new.csv", *new))

    def test_same(self):
        self.assertIn("0 of 2 rows are worse", self.of(0, [row(), row("triangle")], [row("triangle"), row()]))

    def test_ratio(self):
        self.of(0, [row()], [row(ratio="8.01")])
        self.of(0, [row()], [row(ratio="99.00")])
        out = self.of(1, [row(), row("triangle")], [row(ratio="7.99"), row("triangle")])
        self.assertRegex(out, r"WORSE bunny medium camera best exact 1/256: ratio 7\.99, was 10\.00: 20 % less")
        self.assertIn("1 of 2 rows are worse", out)

    def test_errors(self):
        self.of(0, [row()], [row(rms="0.00210")])  # another vector unit
        self.assertIn("penumbra_rms 0.00220", self.of(1, [row()], [row(rms="0.00220")]))
        self.assertIn("max 0.0120", self.of(1, [row()], [row(most="0.0120")]))
        self.of(0, [row(rms="0.00001")], [row(rms="0.00002")])  # the last digit
        self.assertIn("WORSE", self.of(1, [row()], [row(rms="nan")]))

    def test_reached_no_more(self):
        self.assertIn("not reached", self.of(1, [row()], [row(ratio="nan")]))
        self.of(0, [row(ratio="nan")], [row(ratio="nan")])
        self.of(0, [row(ratio="nan")], [row(ratio="3.00")])

    def test_rows(self):
        self.assertIn("triangle medium camera best exact 1/256: is not in the new file",
                      self.of(2, [row(), row("triangle")], [row()]))
        self.of(0, [row()], [row(), row("new")])
        self.assertIn("is there twice", self.of(2, [row()], [row(), row()]))

    def test_files(self):
        old = self.put("old.csv", row())
        self.assertIn("none.csv: No such file", self.check(2, old, os.path.join(self.folder, "none.csv")))
        self.assertIn("has no rows", self.check(2, old, self.put("new.csv")))
        self.assertIn("line 2 is no row", self.check(2, old, self.put("new.csv", "1,2,3")))
        self.assertIn("line 2 is no row", self.check(2, old, self.put("new.csv", "bunny,1", head="scene,x")))
        self.assertIn("is no number", self.of(2, [row()], [row(ratio="fast")]))

    def fake(self, *answers):
        """A softshadow that answers what is given, one after the other."""
        for i, rows in enumerate(answers):
            self.put("answer%d" % i, *rows)
        path = os.path.join(self.folder, "softshadow")
        with open(path, "w") as file:
            file.write('#!/bin/sh\ncd "%s"\nn=$(cat count 2>/dev/null || echo 0)\necho $((n + 1)) >count\n'
                       'echo "$@" >>asked\n[ -f answer$n ] || exit 1\nwhile [ "$1" != --csv ]; do shift; done\n'
                       'cp answer$n "$2"\n' % self.folder)
        os.chmod(path, os.stat(path).st_mode | stat.S_IXUSR)
        return path

    def asked(self):
        with open(os.path.join(self.folder, "asked")) as file:
            return file.read().splitlines()

    def test_noise_is_measured_again(self):
        old = self.put("old.csv", row(), row("triangle"), row("dragon-202k"))
        program = self.fake([row(ratio="6.00"), row("triangle")], [row(ratio="9.50")])
        self.assertIn("0 of 2 rows", self.check(0, old, "--run", program, SOFTSHADOW_CPU="best"))
        asked = self.asked()
        self.assertEqual(len(asked), 2)
        self.assertIn("--scenes triangle,bunny ", asked[0])
        self.assertIn("--scenes bunny ", asked[1])

    def test_what_stays_slow_is_slower(self):
        old = self.put("old.csv", row())
        program = self.fake([row(ratio="6.00")], [row(ratio="7.00")], [row(ratio="6.50")])
        out = self.check(1, old, "--run", program, SOFTSHADOW_CPU="best")
        self.assertIn("ratio 7.00, was 10.00: 30 % less", out)
        self.assertEqual(len(self.asked()), 3)

    def test_errors_are_no_noise(self):
        program = self.fake([row(rms="0.00300")])
        self.check(1, self.put("old.csv", row()), "--run", program, SOFTSHADOW_CPU="best")
        self.assertEqual(len(self.asked()), 1)

    def test_other_machines(self):
        old = self.put("old.csv", row(), row(ratio="3.00", cpu="avx2"))
        program = self.fake([row(ratio="3.10", cpu="avx2")])
        self.assertIn("bunny medium camera avx2", self.check(0, old, "--run", program, SOFTSHADOW_CPU="avx2"))
        self.assertIn("no rows for this machine's scalar",
                      self.check(2, old, "--run", program, SOFTSHADOW_CPU="scalar"))
        self.assertIn("exit status 1", self.check(2, old, "--run", program, SOFTSHADOW_CPU="best"))

    def test_the_committed_file_can_be_compared(self):
        base = os.path.join(HERE, "results.csv")
        self.assertIn("0 of", self.check(0, base, base))
        with open(base) as file:
            head = file.readline()
        self.assertNotRegex(head, r"_ms|ns_|second", "results.csv keeps ratios and errors, no times")


if __name__ == "__main__":
    unittest.main(verbosity=2)
