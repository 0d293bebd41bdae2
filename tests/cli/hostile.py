#!/usr/bin/env python3
"""Mesh files that broke other readers, through the whole program: each is read right, or refused with
one line, soon and in little memory."""
import os
import resource
import subprocess
import sys

from command import LIGHT, SOURCE, Case, main

FOLDER = os.path.join(SOURCE, "..", "shared", "hostile")
GOOD = {"edge3.obj", "cont.obj", "bowtie.obj"}


def limits():
    resource.setrlimit(resource.RLIMIT_CPU, (5, 5))


class Hostile(Case):
    def test_all(self):
        names = sorted(n for n in os.listdir(FOLDER) if n != "README.md")
        self.assertGreater(len(names), 20)
        for name in names:
            with self.subTest(name=name):
                done = self.run_it("query", os.path.join(FOLDER, name), "--light", LIGHT, "-q",
                                   stdin=b"90 90 0\n", preexec_fn=limits)
                mutant = name.startswith("crash_")
                if name in GOOD or (mutant and done.returncode == 0):
                    self.assertEqual(self.good(done), b"90 90 0 1\n")
                else:
                    self.bad(done, 1, name)


if __name__ == "__main__":
    if not os.path.isdir(FOLDER):
        print("skipped: no", FOLDER)
        sys.exit(77)
    main()
