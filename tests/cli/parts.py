#!/usr/bin/env python3
"""--shard and --resume: parts make the whole, bit for bit, and only what is whole is skipped."""
import os
import random
import re
import signal
import subprocess
import time

from command import LIGHT, SOFTSHADOW, Case, ground, main, method, npy, ply, raw, text


class Shards(Case):
    def test_parts_make_the_whole(self):
        # Without --error: a point that is answered with its whole neighbourhood is known to be lit,
        # bound 0, and the neighbourhood is of the batch. Visibility does not depend on the split.
        lights = ("--light", "disk:1,0,4,0,0,-1,0.75")
        points = ground(1001, True)
        path = self.put("p.npy", npy(points))
        for name in ("o.npy", "o.raw"):
            self.good(self.query(*lights, path, "-o", self.path("whole-" + name)))
            for shards in (1, 3, 16):
                if os.path.exists(self.path(name)):
                    os.remove(self.path(name))
                running = [subprocess.Popen(
                    [SOFTSHADOW, "query", self.mesh, "--light", LIGHT, "--method", method(), *lights,
                     path, "--shard", "%d/%d" % (i, shards), "-o", self.path(name)])
                    for i in reversed(range(shards))]
                self.assertEqual([process.wait(120) for process in running], [0] * shards)
                self.assertEqual(self.get(name), self.get("whole-" + name))

    def test_text_and_ply(self):
        points = ground(100)
        head, lines = b"x y z\n", text(points)
        path = self.put("p.csv", b"# note\n" + head + lines)
        whole = self.good(self.query(path))
        lead = b"# note\nx y z visibility\n"
        parts = [self.good(self.query("--shard", "%d/7" % i, path)) for i in range(7)]
        self.assertTrue(all(part.startswith(lead) for part in parts))
        self.assertEqual(lead + b"".join(part[len(lead):] for part in parts), whole)
        for form in ("ascii", "binary_big_endian"):
            path = self.put("p.ply", ply(points, form))
            whole = self.good(self.query(path)).split(b"end_header\n")[1]
            parts = [self.good(self.query("--shard", "%d/7" % i, path)).split(b"end_header\n")
                     for i in range(7)]
            self.assertEqual(b"".join(body for _, body in parts), whole)
            counts = [int(re.search(rb"element vertex (\d+)", head).group(1)) for head, _ in parts]
            self.assertEqual((sum(counts), max(counts) - min(counts) <= 1), (100, True))

    def test_beyond_the_end(self):
        path = self.put("p.raw", raw(ground(3)))
        for shard in ("3/3", "7/3", "0/1000"):
            self.bad(self.query("--shard", shard, path, "-o", self.path("o.raw")), 0, "nothing to do")
            self.assertFalse(os.path.exists(self.path("o.raw")))
        done = self.query("-q", "--shard", "3/3", path, "-o", self.path("o.raw"))
        self.assertEqual(self.good(done), b"")

    def test_a_file_of_another_size(self):
        path = self.put("p.raw", raw(ground(8)))
        self.put("o.raw", b"x" * 31)
        self.bad(self.query("--shard", "0/2", path, "-o", self.path("o.raw")), 1, "31 bytes", "32")
        self.assertEqual(self.get("o.raw"), b"x" * 31)


class Resume(Case):
    POINTS = 600000  # three blocks

    def resume(self, *arguments, name="o.raw"):
        return self.query("--samples", "2", "--resume", self.path("p.raw"), "-o", self.path(name),
                          *arguments)

    def points(self):
        block = raw(ground(6000))
        self.put("p.raw", block * (self.POINTS // 6000))

    def test_after_a_kill(self):
        self.points()
        self.good(self.query("--samples", "2", self.path("p.raw"), "-o", self.path("whole.raw")))
        process = subprocess.Popen(
            [SOFTSHADOW, "query", self.mesh, "--light", LIGHT, "--method", method(), "--samples", "2",
             "--resume", self.path("p.raw"), "-o", self.path("o.raw")])
        deadline = time.monotonic() + 60
        journal = self.path("o.raw.resume")
        while process.poll() is None and time.monotonic() < deadline:
            if os.path.exists(journal) and b"bytes" in self.get("o.raw.resume"):
                process.send_signal(signal.SIGKILL)
                break
        killed = process.wait(60) == -signal.SIGKILL
        if killed:
            self.assertFalse(os.path.exists(self.path("o.raw")))
        self.resume()
        self.assertEqual(self.get("o.raw"), self.get("whole.raw"))
        self.assertFalse(os.path.exists(self.path("o.raw.part")))
        self.bad(self.resume(), 0, "is whole, nothing to do")

    def test_sixteen_shards_often_killed(self):
        """Of the shards that run, three in ten are killed, wherever they are; then all are asked again."""
        self.put("p.raw", raw(ground(6000)) * 30)
        self.good(self.query("--samples", "2", self.path("p.raw"), "-o", self.path("whole.raw")))
        chance, killed, rounds = random.Random(7), 0, 0
        left = list(range(16))
        while left:
            doomed = [shard for shard in left if chance.random() < (0.3 if rounds < 5 else 0)]
            for shard in left:
                process = subprocess.Popen(
                    [SOFTSHADOW, "query", self.mesh, "--light", LIGHT, "--method", method(), "-q",
                     "--samples", "2", "--resume", self.path("p.raw"), "-o", self.path("o.raw"),
                     "--shard", "%d/16" % shard])
                if shard in doomed:
                    time.sleep(chance.uniform(0, 0.03))
                    process.kill()
                if process.wait(120) == -signal.SIGKILL:
                    killed += 1
                elif shard not in doomed:
                    self.assertEqual(process.returncode, 0)
            left = doomed
            rounds += 1
        self.assertGreater(killed, 0)
        self.assertEqual(self.get("o.raw"), self.get("whole.raw"))

    def test_kills_leave_all_or_nothing(self):
        """Whenever SIGKILL comes, there is no output, or it is whole."""
        self.put("p.raw", raw(ground(6000)) * 10)
        arguments = ("--samples", "2", self.path("p.raw"), "-o")
        start = time.monotonic()
        self.good(self.query(*arguments, self.path("whole.raw")))
        took, chance, whole = time.monotonic() - start, random.Random(11), 0
        for _ in range(200):
            process = subprocess.Popen(
                [SOFTSHADOW, "query", self.mesh, "--light", LIGHT, "--method", method(), *arguments,
                 self.path("o.raw")])
            time.sleep(chance.uniform(0, 1.2 * took))
            process.kill()
            process.wait(60)
            if os.path.exists(self.path("o.raw")):
                whole += 1
                self.assertEqual(self.get("o.raw"), self.get("whole.raw"))
                os.remove(self.path("o.raw"))
        self.assertLess(whole, 200)

    def test_what_does_not_hash_is_done_again(self):
        self.points()
        self.good(self.resume())
        whole, journal = self.get("o.raw"), self.get("o.raw.resume").splitlines(True)
        self.assertEqual([line.split()[0] for line in journal],
                         [b"softshadow-resume", b"bytes", b"bytes", b"bytes", b"whole"])
        # Two blocks written and the second spoilt; then a journal that was cut in a line.
        spoilt = bytearray(whole)
        spoilt[4 * 262144 + 5] ^= 1
        for lines in (journal[:3], journal[:2] + [journal[2][:20]], journal[:1], []):
            os.path.exists(self.path("o.raw")) and os.remove(self.path("o.raw"))
            self.put("o.raw.part", bytes(spoilt))
            self.put("o.raw.resume", b"".join(lines))
            self.assertEqual(self.resume().returncode, 0)
            self.assertEqual(self.get("o.raw"), whole)
            self.assertEqual(self.get("o.raw.resume"), b"".join(journal))
        # A whole file that was changed afterwards.
        self.put("o.raw", bytes(spoilt))
        self.assertEqual(self.resume().returncode, 0)
        self.assertEqual(self.get("o.raw"), whole)

    def test_shards(self):
        self.points()
        self.good(self.query("--samples", "2", self.path("p.raw"), "-o", self.path("whole.raw")))
        for shard in ("1/2", "0/2"):
            self.good(self.resume("--shard", shard))
        self.assertEqual(self.get("o.raw"), self.get("whole.raw"))
        self.bad(self.resume("--shard", "0/2"), 0, "whole")
        changed = bytearray(self.get("o.raw"))
        changed[-1] ^= 1
        self.put("o.raw", bytes(changed))
        self.bad(self.resume("--shard", "0/2"), 0, "whole")
        self.good(self.resume("--shard", "1/2"))
        self.assertEqual(self.get("o.raw"), self.get("whole.raw"))

    def test_text(self):
        path = self.put("p.csv", text(ground(50)))
        arguments = ("--resume", path, "-o", self.path("o.csv"))
        self.good(self.query(*arguments))
        whole = self.get("o.csv")
        self.bad(self.query(*arguments), 0, "whole")
        self.put("o.csv", whole[:-1])
        self.good(self.query(*arguments))
        self.assertEqual(self.get("o.csv"), whole)
        os.remove(self.path("o.csv"))
        self.good(self.query(*arguments))
        self.assertEqual(self.get("o.csv"), whole)

    def test_another_job(self):
        path = self.put("p.csv", text(ground(5)))
        arguments = ("--resume", path, "-o", self.path("o.csv"))
        self.good(self.query(*arguments))
        for more in (["--tolerance", "0.1"], ["--error"], ["--light", LIGHT], ["--no-normals"]):
            self.bad(self.query(*arguments, *more), 1, "another job")
        self.good(self.run_it("query", self.mesh, "--light", LIGHT, "--method", method(), "-j", "1", "-q",
                              *arguments))
        self.put("p.csv", text(ground(6)))
        self.bad(self.query(*arguments), 1, "another job")


if __name__ == "__main__":
    main()
