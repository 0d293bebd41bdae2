#!/usr/bin/env python3
"""Nothing half done is left, and no loss goes unsaid: full disks, broken pipes, signals."""
import os
import resource
import shutil
import signal
import subprocess
import time
import unittest

from command import LIGHT, SOFTSHADOW, Case, ground, main, method, npy, text


class Faults(Case):
    def left(self):
        return sorted(set(os.listdir(self.folder)) - {"mesh.obj", "p.csv", "p.npy"})

    def test_broken_pipe(self):
        path = self.put("p.csv", text(ground(100000)))
        done = subprocess.run(
            ["bash", "-c", '"$@" | head -1; echo "${PIPESTATUS[0]}" >&2', "bash", SOFTSHADOW, "query",
             self.mesh, "--light", LIGHT, "--samples", "1", "--method", "raytrace", path],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=120)
        said, status = done.stderr.decode().splitlines()
        self.assertEqual(status, "1")
        self.assertIn("standard output: the reader has gone", said)

    @unittest.skipUnless(os.path.exists("/dev/full"), "no /dev/full")
    def test_full_disk(self):
        with open("/dev/full", "wb") as full:
            self.bad(self.query(stdin=b"0 0 0\n", stdout=full), 1, "standard output", "No space")
            for arguments in (["--help"], ["--version"], ["query", "--help"], ["methods"],
                              ["methods", "--json"]):
                self.bad(self.run_it(*arguments, stdout=full), 1)
        self.bad(self.query("-o", "/dev/full", "--output-format", "csv", stdin=b"0 0 0\n"), 1, "/dev/full")
        self.bad(self.query("-o", "/dev/full", "--output-format", "raw", stdin=b"0 0 0\n"), 1, "/dev/full")
        self.assertEqual(self.left(), [])

    def test_file_size_limit(self):
        """The file may end anywhere: in its head, at a page, at the last byte."""
        path = self.put("p.npy", npy(ground(60000)))
        size = 60000 * 4 + 128
        for most in (0, 1, 4096, 100000, size - 1):
            def limit():
                resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
            self.bad(self.query("--samples", "1", path, "-o", self.path("o.npy"), preexec_fn=limit), 1,
                     "o.npy", "too large")
            self.assertEqual(self.left(), [], most)
        most = size
        self.good(self.query("--samples", "1", path, "-o", self.path("o.npy"), preexec_fn=limit))
        self.assertEqual(os.path.getsize(self.path("o.npy")), size)

    def test_inputs(self):
        self.bad(self.query(self.path("none.csv")), 1, "none.csv", "No such file")
        os.mkdir(self.path("folder.csv"))
        self.bad(self.query(self.path("folder.csv")), 1, "is a directory")
        os.rmdir(self.path("folder.csv"))
        self.bad(self.run_it("query", self.path("none.obj"), "--light", LIGHT, stdin=b"0 0 0\n"), 1,
                 "none.obj")
        self.bad(self.query("-o", self.path("no/out.csv"), stdin=b"0 0 0\n"), 1, "out.csv", "No such")
        path = self.put("p.csv", "0 0 0\n0 0 x\n")
        self.bad(self.query(path, "-o", self.path("out.csv")), 1, "p.csv:2:5")
        self.assertEqual(self.left(), [])
        if os.geteuid() != 0:
            os.chmod(path, 0)
            self.bad(self.query(path), 1, "p.csv", "Permission denied")

    def test_old_file_stays_until_the_new_is_whole(self):
        old = self.put("out.csv", "old\n")
        os.chmod(old, 0o640)
        self.bad(self.query("-o", old, stdin=b"0 0 0\n0 0\n"), 1)
        self.assertEqual((self.get("out.csv"), self.left()), (b"old\n", ["out.csv"]))
        os.symlink("out.csv", self.path("link.csv"))
        self.good(self.query("-o", self.path("link.csv"), stdin=b"9 9 0\n"))
        self.assertEqual(self.get("out.csv"), b"9 9 0 1\n")
        self.assertTrue(os.path.islink(self.path("link.csv")))
        self.assertEqual(os.stat(old).st_mode & 0o777, 0o640)
        self.assertEqual(self.left(), ["link.csv", "out.csv"])

    def test_signals_leave_nothing(self):
        def heed():  # under nohup, or behind a shell's &, some are ignored, which children inherit
            for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
                signal.signal(number, signal.SIG_DFL)

        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            process = subprocess.Popen(
                [SOFTSHADOW, "query", self.mesh, "--light", LIGHT, "--method", method(), "-o",
                 self.path("out.csv")], stdin=subprocess.PIPE, bufsize=0, preexec_fn=heed)
            try:
                process.stdin.write(b"0 0 0\n")
                deadline = time.monotonic() + 60
                while not self.left() and time.monotonic() < deadline:
                    time.sleep(0.01)
                there = self.left()
                self.assertEqual(len(there), 1)
                self.assertNotEqual(there, ["out.csv"])
                process.send_signal(number)
                self.assertEqual(process.wait(60), -number)
                self.assertEqual(self.left(), [])
            finally:
                process.kill()
                process.wait()
                process.stdin.close()

    @unittest.skipUnless(shutil.which("localedef") and os.path.exists("/usr/share/i18n/locales/de_DE"),
                         "no locale with a decimal comma can be made")
    def test_decimal_comma(self):
        made = subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", self.path("de_DE.UTF-8")],
                              stderr=subprocess.DEVNULL)
        if not os.path.exists(self.path("de_DE.UTF-8")):
            self.skipTest("localedef failed with %d" % made.returncode)
        data = text(ground(200))
        wanted = self.good(self.query("--tolerance", "0.01", stdin=data))
        german = dict(os.environ, LOCPATH=self.folder, LC_ALL="de_DE.UTF-8", LANG="de_DE.UTF-8")
        self.assertEqual(self.good(self.query("--tolerance", "0.01", stdin=data, env=german)), wanted)
        self.assertIn(b".", wanted)


if __name__ == "__main__":
    main()
