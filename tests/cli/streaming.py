#!/usr/bin/env python3
"""Points stream: answers leave before the last point has come, in bounded memory."""
import os
import resource
import select
import shutil
import struct
import subprocess
import unittest

from command import LIGHT, SOFTSHADOW, BUILD, Case, ground, main, method, raw

MEBI = 1 << 20


class Streaming(Case):
    def test_first_answers_leave_early(self):
        """Each line is answered while stdin stays open; 60 s is for a machine that is busy."""
        for kind, points, size in (("csv", [b"0 0 0\n", b"9 9 0\n"], None),
                                   ("raw", [struct.pack("<3f", 0, 0, 0), struct.pack("<3f", 9, 9, 0)], 4)):
            process = subprocess.Popen(
                [SOFTSHADOW, "query", self.mesh, "--light", LIGHT, "--method", method(),
                 "--input-format", kind], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
            try:
                for i, point in enumerate(points):
                    process.stdin.write(point)
                    self.assertTrue(select.select([process.stdout], [], [], 60)[0], kind)
                    answer = os.read(process.stdout.fileno(), 100)
                    wanted = point.strip() + b" %d\n" % i if size is None else struct.pack("<f", i)
                    self.assertEqual(answer, wanted)
                process.stdin.close()
                self.assertEqual(process.wait(60), 0)
            finally:
                process.kill()
                process.wait()
                process.stdout.close()

    def test_pieces_do_not_matter(self):
        """Whatever the pieces in which text arrives, the same bytes leave."""
        data = "".join("%r %r %r\n" % p for p in ground(3000)).encode()
        wanted = self.good(self.query(stdin=data))
        for size in (1 << 12, 4095, 777):
            process = subprocess.Popen(
                [SOFTSHADOW, "query", self.mesh, "--light", LIGHT, "--method", method()],
                stdin=subprocess.PIPE, stdout=open(self.path("out"), "wb"), bufsize=0)
            for at in range(0, len(data), size):
                process.stdin.write(data[at:at + size])
            process.stdin.close()
            self.assertEqual(process.wait(60), 0)
            self.assertEqual(self.get("out"), wanted)

    @unittest.skipIf(os.environ.get("SANITIZERS"), "a sanitizer's own memory would be measured")
    def test_memory_is_bounded(self):
        """5 million points cost less than 64 MiB more than one does."""
        def peak(path):
            code = ("import resource,subprocess,sys;"
                    "r=subprocess.run(sys.argv[1:]).returncode;"
                    "print(r, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)")
            out = subprocess.run(
                ["python3", "-c", code, SOFTSHADOW, "query", self.mesh, "--light", LIGHT,
                 "--samples", "4", "--method", "raytrace", path, "-o", self.path("out.raw")],
                stdout=subprocess.PIPE, check=True).stdout.split()
            self.assertEqual(int(out[0]), 0)
            return int(out[1]) * 1024
        one = peak(self.put("one.raw", raw([(3.0, 3.0, 0.0)])))
        block = raw(ground(50000))
        with open(self.path("many.raw"), "wb") as file:
            for _ in range(100):
                file.write(block)
        many = peak(self.path("many.raw"))
        self.assertEqual(os.path.getsize(self.path("out.raw")), 4 * 5000000)
        self.assertLess(many, one + 64 * MEBI)

    @unittest.skipUnless(shutil.which("ldd"), "no ldd")
    def test_starts_light(self):
        """OpenImageIO would cost 170 ms and 130 MB at each start."""
        program = os.path.join(BUILD, ".libs", "softshadow")
        if not os.path.exists(program):
            program = SOFTSHADOW
        out = subprocess.run(["ldd", program], stdout=subprocess.PIPE, check=True).stdout.decode()
        self.assertIn("libsoftshadow", out)
        for name in ("OpenImageIO", "embree", "libtbb", "libEGL", "libGL"):
            self.assertNotIn(name, out)


if __name__ == "__main__":
    main()
