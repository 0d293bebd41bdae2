#!/usr/bin/env python3
"""Points in and answers out: every format gives the same values, everything else comes back, and
what is wrong in a file is told with its place."""
import math
import struct

from command import LIGHT, Case, ground, main, npy, ply, raw, read_npy, text

SECOND = "disk:1,0,4,0,0,-1,0.75"


class Formats(Case):
    def test_all_agree(self):
        for normals in (False, True):
            points = ground(700, normals)
            wanted = self.visibilities(points)
            self.assertGreater(len({v for v in wanted if 0 < v < 1}), 20)
            inputs = {"a.csv": text(points, ","), "a.txt": text(points), "b.csv": text(points, ";"),
                      "a.ply": ply(points), "b.ply": ply(points, "binary_big_endian"),
                      "c.ply": ply(points, "ascii"), "d.ply": ply(points, kind="double"),
                      "1.npy": npy(points), "2.npy": npy(points, "f", 2), "3.npy": npy(points, "d", 3)}
            if not normals:
                inputs["a.raw"] = raw(points)
            for name, data in inputs.items():
                with self.subTest(name=name, normals=normals):
                    path = self.put(name, data)
                    self.good(self.query(path, "-o", self.path("out.raw")))
                    self.assertEqual(struct.unpack("<700f", self.get("out.raw")), wanted)

    def test_outputs_agree(self):
        points = ground(500, True)
        path = self.put("p.npy", npy(points))
        lights = ("--light", SECOND, "--error")
        wanted = self.visibilities(points, *lights)
        self.assertEqual(len(wanted), 500 * 4)
        for name in ("o.npy", "o.csv", "o.txt", "o.ply"):
            self.good(self.query(path, *lights, "-o", self.path(name)))
        shape, data = read_npy(self.get("o.npy"))
        self.assertEqual(shape, (500, 4))
        self.assertEqual(data, struct.pack("<2000f", *wanted))
        names = "visibility_0,visibility_1,error_bound_0,error_bound_1"
        for name, separator, head in (("o.csv", ",", "x,y,z,nx,ny,nz," + names),
                                      ("o.txt", " ", "# x y z nx ny nz " + names.replace(",", " "))):
            lines = self.get(name).decode().splitlines()
            self.assertEqual(lines[0], head)
            self.assertEqual(len(lines), 501)
            for i, line in enumerate(lines[1:]):
                numbers = [float(n) for n in line.split(separator)]
                self.assertEqual(tuple(numbers[:6]), points[i])
                self.assertEqual(struct.pack("<4f", *numbers[6:]),
                                 struct.pack("<4f", *wanted[4 * i:4 * i + 4]))
        head, body = self.get("o.ply").split(b"end_header\n")
        for name in names.split(","):
            self.assertIn(b"property float scalar_%s\n" % name.encode(), head)
        for i in range(500):
            self.assertEqual(body[40 * i:40 * i + 40],
                             struct.pack("<10f", *points[i], *wanted[4 * i:4 * i + 4]))
        self.assertEqual(len(body), 500 * 40)

    def test_doubles_round_trip(self):
        """A double goes in and comes out as the same double, and is not rounded on the way."""
        points = [(0.1, 1 / 3, 2 ** -40), (1e15, -1e-300, 123456789.123456789)]
        out = self.good(self.query("--input-format", "npy", "--output-format", "csv",
                                   stdin=npy(points, "d"))).decode().splitlines()
        for line, point in zip(out[1:], points):
            self.assertEqual(tuple(float(n) for n in line.split(",")[:3]), point)
        # In float32 both would lie at the same place; the light is seen past the edge by one only.
        far = 4096.0
        self.mesh = self.put("far.obj", "".join("v %r %r 1\n" % (far + x, y) for x, y in
                                                ((0, -9), (9, -9), (9, 9), (0, 9))) + "f 1 2 3 4\n")
        done = self.run_it("query", self.mesh, "--light", "sphere:%r,0,2,0" % far,
                           stdin=("%r 0 0\n%r 0 0\n" % (far - 1e-5, far + 1e-5)).encode())
        self.assertEqual([l.split()[3] for l in self.good(done).splitlines()], [b"1", b"0"])

    def test_text_is_kept(self):
        one, = self.visibilities([(0.5, 0.0, 0.0)])
        v = repr(struct.unpack("<f", struct.pack("<f", one))[0])
        v = next(s for s in ("%.*g" % (d, one) for d in range(1, 10))
                 if struct.pack("<f", float(s)) == struct.pack("<f", one))
        for given, wanted in (
                ("0.5 0 0\n", "0.5 0 0 V\n"), ("0.5,0,0", "0.5,0,0,V\n"), ("0.5 ; 0;0\r\n", "0.5 ; 0;0;V\r\n"),
                (" 0.5\t0  0 # a note\n", " 0.5\t0  0 V # a note\n"),
                ("# a\n\n0.5 0 0\n# end\n", "# a\n\n0.5 0 0 V\n# end\n"),
                ("x y z\n0.5 0 0\n", "x y z visibility\n0.5 0 0 V\n"),
                ("# x y z\n0.5 0 0\n", "# x y z visibility\n0.5 0 0 V\n"),
                ("# x;y;z\n//\n.5;0;0\n", "# x;y;z;visibility\n//\n.5;0;0;V\n"),
                ("//X Y Z\n0.5 0 0\n", "//X Y Z visibility\n0.5 0 0 V\n"),
                ("# points of x and y and z\n.5 0 0\n", "# points of x and y and z\n.5 0 0 V\n"),
                ("name,Z,y,X,tag\n\"a, b\",0,0,+.5,#1\n", "name,Z,y,X,tag,visibility\n\"a, b\",0,0,+.5,#1,V\n"),
                ("x;y;z;w\n0.5;0;0;\n", "x;y;z;w;visibility\n0.5;0;0;;V\n"),
                ("x\ty\tz\n\"5e-1\"\t0\t0\n", "x\ty\tz\tvisibility\n\"5e-1\"\t0\t0\tV\n"),
                ("\ufeffx,y,z\n0.5,0,0\n", "\ufeffx,y,z,visibility\n0.5,0,0,V\n"),
                ("x,y,z\n", "x,y,z,visibility\n"), ("", "")):
            with self.subTest(given=given):
                out = self.good(self.query(stdin=given.encode())).decode()
                self.assertEqual(out, wanted.replace("V", v))

    def test_normals_matter(self):
        up, down = "0.6 0 0 0 0 1\n", "0.6 0 0 0 0 -1\n"
        out = self.good(self.query(stdin=(up + down).encode())).split()
        self.assertGreater(float(out[6]), 0)
        self.assertEqual(float(out[13]), 0)
        same = self.good(self.query("--no-normals", stdin=(up + down).encode())).split()
        self.assertEqual(same[6], same[13])

    def test_ply_is_kept(self):
        """Other properties, comments and faces come back; a mesh is baked."""
        for form, order in (("binary_little_endian", "<"), ("binary_big_endian", ">"), ("ascii", "")):
            head = ("ply\nformat %s 1.0\ncomment made by hand\nelement vertex 3\nproperty uchar red\n"
                    "property float x\nproperty double y\nproperty float z\n" % form)
            tail = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
            rows = [(7, -1.0, 0.0, 0.0), (8, 0.5, 0.0, 0.0), (9, 0.0, 0.0, 0.0)]
            wanted = self.visibilities([r[1:] for r in rows])
            if form == "ascii":
                body = "".join("%d %r %r %r\n" % r for r in rows) + "3 0 1 2\n"
                body = body.encode()
            else:
                body = b"".join(struct.pack(order + "Bfdf", *r) for r in rows)
                body += struct.pack(order + "Biii", 3, 0, 1, 2)
            path = self.put("in.ply", head.encode() + tail.encode() + body)
            self.good(self.query(path, "-o", self.path("out.ply")))
            out = self.get("out.ply")
            lead = (head + "property float scalar_visibility\n" + tail).encode()
            self.assertTrue(out.startswith(lead), out[:300])
            rest = out[len(lead):]
            if form == "ascii":
                lines = rest.decode().splitlines()
                self.assertEqual([float(l.split()[4]) for l in lines[:3]],
                                 [float("%.9g" % v) for v in wanted])
                self.assertEqual(lines[3], "3 0 1 2")
            else:
                again = b"".join(struct.pack(order + "Bfdff", *r, v) for r, v in zip(rows, wanted))
                self.assertEqual(rest, again + struct.pack(order + "Biii", 3, 0, 1, 2))
            self.bad(self.query(self.path("out.ply"), "-o", self.path("more.ply")), 1,
                     "scalar_visibility already")

    def test_counts_that_come_late(self):
        """NPY and PLY begin with a count that a stream does not tell: a file is patched."""
        points = ground(300)
        wanted = struct.pack("<300f", *self.visibilities(points))
        for name in ("o.npy", "o.ply"):
            self.good(self.query("-o", self.path(name), stdin=text(points)))
        shape, data = read_npy(self.get("o.npy"))
        self.assertEqual((shape, data), ((300, 1), wanted))
        self.assertIn(b"element vertex 300\n", self.get("o.ply"))
        with open(self.path("redirected.npy"), "wb") as file:
            self.query("--output-format", "npy", stdin=text(points), stdout=file)
        self.assertEqual(self.get("redirected.npy"), self.get("o.npy"))

    def test_points_that_are_none(self):
        nan, inf = float("nan"), float("inf")
        points = [(nan, 0, 0), (9, 9, 0), (inf, 0, 0), (0, 0, -inf), (1e16, 0, 0)]
        done = self.query("--input-format", "raw", stdin=raw(points))
        error = self.bad(done, 0, "warning", "4 of 5 points", "nan")
        self.assertIn("query", error)
        values = struct.unpack("<5f", done.stdout)
        self.assertEqual([math.isnan(v) for v in values], [True, False, True, True, True])
        self.assertEqual(values[1], 1)
        done = self.query("--bounds=-1,-1,-1,1,1,1", stdin=b"0 0 0\n9 9 0\n")
        self.bad(done, 0, "1 of 2")
        self.assertEqual(done.stdout, b"0 0 0 0\n9 9 0 nan\n")


class Mistakes(Case):
    def test_lines(self):
        for given, place, what in (
                ("0 0\n", "1:1", "2 columns"), ("0 0 0 0\n", "1:1", "4 columns"),
                ("0 0 0\n0 0\n", "2:1", "2 columns"), ("0 0 0\n1 1 1 1\n", "2:1", "line 1"),
                ("0 0 0\n\n# c\n0 a 0\n", "4:3", "'a'"), ("0 0 1e400\n", "1:5", "too large"),
                ("0 nan 0\n", "1:3", "not finite"), ("0 0 -inf\n", "1:5", "not finite"),
                ("1,5 2,5 3,5\n", "1:1", "4 columns"), ("1,5 2,5\n", "1:3", "'5 2'"), ("1,5;2,5;3,5\n", "1:1", "'1,5'"),
                ("0,,0\n", "1:3", "''"), ("0 0 0x\n", "1:5", "'0x'"), ("0 0 \0\n", "1:5", "zero byte"),
                ("0 0 0\n0 0 \0\n", "2:5", "zero byte"), ("a b c\n0 0 0\n", "1:1", "names x, y and z"),
                ("x y z x\n0 0 0 0\n", "1:1", "names x, y and z"), ("x y z nx\n", "1:1", "nx, ny, nz"),
                ("x y z\n0 0 0 0\n", "2:1", "4 columns, 3"), ("v 0 0 0\n", "1:1", "names x, y and z"),
                ("0 0 0\n" + " " * 70000 + "\n", "2:65537", "65536"), ("0 0 0 " * 400, "1:1", "columns")):
            with self.subTest(given=given[:40]):
                done = self.query(stdin=given.encode())
                self.bad(done, 1, "standard input:%s:" % place, what)
        path = self.put("p.csv", "x,y,z\n1,2,3\n1,2,x\n")
        self.bad(self.query(path), 1, "p.csv:3:5: 'x'")

    def test_npy(self):
        good = npy([(0.0, 0.0, 0.0)] * 4)
        for data, what in (
                (b"", "byte 0"), (good[:6], "byte 0"), (b"\x93NUMPX" + good[6:], "byte 0"),
                (good[:6] + b"\x04" + good[7:], "version 4"), (good[:40], "ends within"),
                (good[:-1], "47 bytes"), (good + b"x", "49 bytes"),
                (good.replace(b"<f4", b">f4"), "'<f4'"), (good.replace(b"<f4", b"<i4"), "'<f4'"),
                (good.replace(b"False", b"True "), "Fortran"), (good.replace(b"(4, 3)", b"(3, 4)"), "(3, 4)"),
                (good.replace(b"(4, 3)", b"(12,) "), "(12,)"),
                (good.replace(b"(4, 3), }", b"(4000000000000, 3)}"[:9].ljust(9)), "shape"),
                (good.replace(b"shape", b"shope"), "lacks"), (good[:8] + b"\xff\xff" + good[10:], "header")):
            with self.subTest(what=what):
                self.bad(self.query(self.put("p.npy", data)), 1, "p.npy", what)
        done = self.query("--input-format", "npy", stdin=good[:-1])
        self.bad(done, 1, "ends after 3 of 4")
        done = self.query("--input-format", "npy", stdin=good + bytes(12))
        self.bad(done, 1, "standard input")

    def test_raw(self):
        self.bad(self.query(self.put("p.raw", bytes(13))), 1, "13 bytes")
        self.bad(self.query("--input-format", "raw", stdin=bytes(13)), 1, "point 1")
        self.bad(self.query("--input-format", "raw6", self.put("q.raw", bytes(12))), 1, "24")

    def test_ply(self):
        good = ply([(0.0, 0.0, 0.0)] * 4)
        ascii_ = ply([(0.0, 0.0, 0.0)] * 2, "ascii")
        for data, what in (
                (b"", "ply"), (b"plx" + good[3:], "is no PLY"), (good[:60], "end_header"),
                (good[:-1], "not whole"), (good.replace(b"vertex 4", b"vertex 9"), "not whole"),
                (good.replace(b"vertex 4", b"vertex 99999999999999"), "not whole"),
                (good.replace(b"vertex 4", b"vertex -1"), "count"),
                (good.replace(b"vertex 4", b"face 4"), "before vertex"),
                (good.replace(b"float z", b"float w"), "lack x, y or z"),
                (good.replace(b"float z", b"float x"), "twice"),
                (good.replace(b"float z", b"real z"), "unknown type"),
                (good.replace(b"float z", b"list uchar int z"), "list"),
                (good.replace(b"little", b"middle"), "unknown format"),
                (ascii_.replace(b"0.0 0.0 0.0\n", b"0.0 0.0\n", 1), ":8:8"),
                (ascii_.replace(b"0.0 0.0 0.0\n", b"0.0 0.0 0.0 0\n", 1), "more than the 3"),
                (ascii_[:-14], "not whole"), (ascii_.replace(b"0.0 0.0 0.0\n", b"0 nan 0\n", 1), "not finite"),
                (b"ply\n" + b"comment x\n" * 9000, "65536")):
            with self.subTest(what=what, size=len(data)):
                self.bad(self.query(self.put("p.ply", data)), 1, "p.ply", what)

    def test_wrong_format_is_told(self):
        points = ground(5)
        for data, kind, name in ((npy(points), "npy", "csv"), (ply(points), "ply", "csv"),
                                 (ply(points), "ply", "npy"), (npy(points), "npy", "ply")):
            done = self.query("--input-format", name, stdin=data)
            self.bad(done, 1, "is %s, not %s" % (kind, name), "--input-format " + kind)
        self.bad(self.query("--input-format", "ply", stdin=text(points)), 1, "is no PLY")


class Reports(Case):
    def test_stats_and_verify(self):
        import json
        done = self.query("--stats=json", stdin=text(ground(100)))
        self.assertEqual(done.returncode, 0)
        self.assertEqual(done.stderr.count(b"\n"), 1)
        stats = json.loads(done.stderr)
        self.assertEqual((stats["points"], stats["triangles"]), (100, 2))
        table = self.query("--stats", stdin=text(ground(100))).stderr.decode().splitlines()
        self.assertEqual({len(line) for line in table}, {32})
        done = self.query("--verify=50", "--light", SECOND, stdin=text(ground(100)))
        lines = done.stderr.decode().splitlines()
        self.assertEqual(done.returncode, 0, lines)
        self.assertEqual(len(lines), 2)
        for i, line in enumerate(lines):
            self.assertRegex(line, r"^verify: light %d: rms \d\.\d+  max .* over 50 points" % i)

    def test_methods(self):
        import json
        listed = json.loads(self.good(self.run_it("methods", "--json")))
        out = self.good(self.run_it("methods")).decode()
        self.assertTrue(listed)
        for m in listed:
            self.assertIn("\n%s\n" % m["name"], "\n" + out)
            self.assertIn(m["bound"], ("none", "certified", "statistical"))
            maps = m["bound"] == "none"  # what works from maps runs on a GPU, too
            self.assertEqual(m["backends"], ["cpu", "egl"] if maps else ["cpu"], m["name"])
            self.assertEqual(out.count("  backends      %s\n" % " ".join(m["backends"])),
                             sum(o["backends"] == m["backends"] for o in listed))
            done = self.run_it("query", self.mesh, "--light", LIGHT, "--method", m["name"],
                               "--bounds=-2,-2,-1,2,2,3", stdin=b"0 0 0\n1.9 1.9 0\n")
            if "sphere" in m["lights_native"] + m["lights_approximated"]:
                self.assertEqual(done.stdout.split()[7], b"1", done.stderr)
            else:
                self.bad(done, 1)


if __name__ == "__main__":
    main()
