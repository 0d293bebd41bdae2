#!/usr/bin/env python3
"""Arrays of all kinds go in, in place where the library can read them, and come out as promised."""
import ctypes
import unittest
from array import array

import package
import softshadow
from package import FACES, GROUND, SQUARE, bits, lit_scene
from softshadow import _buffers

if package.WITH_NUMPY:
    import numpy

FLAT = [c for point in GROUND for c in point]  # exact in float32
POINTS = dict(name="points", columns=3, kinds=("float64", "float32"), raw="float32")
INDICES = dict(name="indices", columns=3, kinds=("uint32", "int32"), packed=True)


def plain_points():
    """The same points in every kind that needs no numpy: (what, value, whether it is copied)."""
    singles, doubles = array("f", FLAT), array("d", FLAT)
    rows = (ctypes.c_float * 3 * len(GROUND))(*GROUND)
    return [("array f", singles, False), ("array d", doubles, False),
            ("memoryview", memoryview(singles), False),
            ("memoryview (N, 3)", memoryview(singles).cast("B").cast("f", (len(GROUND), 3)), False),
            ("bytes", singles.tobytes(), False), ("bytearray", bytearray(singles.tobytes()), False),
            ("read-only view", memoryview(singles.tobytes()).cast("f"), False),
            ("ctypes rows", rows, False),
            ("ctypes flat", (ctypes.c_double * len(FLAT))(*FLAT), False),
            ("misaligned", memoryview(b"x" + singles.tobytes())[1:], True),
            ("list of tuples", GROUND, True), ("flat list", FLAT, True),
            ("tuple of lists", tuple(list(p) for p in GROUND), True)]


def numpy_points():
    singles = numpy.array(GROUND, dtype=numpy.float32)
    wide = numpy.zeros((len(GROUND), 7), dtype=numpy.float32)
    wide[:, 2:5] = singles
    fields = [("id", "i4"), ("p", "f8", 3), ("n", "f4", 3)]
    records = numpy.zeros(len(GROUND), dtype=numpy.dtype(fields, align=True))
    packed = numpy.zeros(len(GROUND), dtype=fields)  # doubles at multiples of 4
    records["p"] = packed["p"] = singles
    return [("float32", singles, False), ("float64", singles.astype("f8"), False),
            ("columns of a wider array", wide[:, 2:5], False), ("a field", records["p"], False),
            ("a misaligned field", packed["p"], True),
            ("every second row", numpy.repeat(singles, 2, axis=0)[::2], False),
            ("read-only", numpy.frombuffer(singles.tobytes(), "f4").reshape(-1, 3), False),
            ("Fortran order", numpy.asfortranarray(singles), True),
            ("backwards in memory", singles[::-1].copy()[::-1], True),
            ("big-endian", singles.astype(">f4"), True),
            ("longdouble", singles.astype("longdouble"), True)]


class Points(unittest.TestCase):
    def all_kinds(self):
        return plain_points() + (numpy_points() if package.WITH_NUMPY else [])

    def test_same_answers(self):
        with lit_scene(softshadow, "raytrace") as scene:
            wanted = bits(scene.visibility(GROUND))
            self.assertGreater(len(set(scene.visibility(GROUND))), 10)
            for what, value, _ in self.all_kinds():
                with self.subTest(what):
                    self.assertEqual(bits(scene.visibility(value)), wanted)

    def test_copies(self):
        for what, value, copied in self.all_kinds():
            with self.subTest(what):
                held = _buffers.hold(value, **POINTS)
                self.assertEqual((held.copied, held.count), (copied, len(GROUND)))

    @unittest.skipUnless(package.WITH_NUMPY, "is of numpy")
    def test_address_and_stride(self):
        for what, value, copied in numpy_points():
            held = _buffers.hold(value, **POINTS)
            if not copied:
                self.assertEqual((held.address, held.stride), (value.ctypes.data, value.strides[0]),
                                 what)

    @unittest.skipUnless(package.WITH_NUMPY, "is of numpy")
    def test_traps_of_strides(self):
        """A stride of 0 would mean packed, rows that overlap are refused by the library: copies."""
        with lit_scene(softshadow) as scene:
            one = numpy.array([0.6, 0, 0], dtype=numpy.float32)
            same = scene.visibility(numpy.broadcast_to(one, (5, 3)))
            self.assertEqual(bits(same), 5 * bits(scene.visibility(one)))
            line = numpy.array([.1, .2, .3, .4, .5], dtype=numpy.float32)
            windows = numpy.lib.stride_tricks.as_strided(line, (3, 3), (4, 4))
            apart = bits(scene.visibility(windows.copy()))
            self.assertEqual(bits(scene.visibility(windows)), apart)

    def test_empty(self):
        with lit_scene(softshadow) as scene:
            empty = [[], (), b"", array("f"), array("d")]
            if package.WITH_NUMPY:
                empty += [numpy.zeros((0, 3)), numpy.zeros((0, 3), "f4"), numpy.zeros((0, 4, 3))]
            for value in empty:
                self.assertEqual(len(scene.visibility(value)), 0)
                self.assertEqual(scene.stats().points, 0)

    @unittest.skipUnless(package.WITH_NUMPY, "is of numpy")
    def test_images(self):
        with lit_scene(softshadow, "raytrace") as scene:
            image = numpy.array(GROUND, dtype=numpy.float32).reshape(17, 33, 3)
            answers = scene.visibility(image)
            self.assertEqual(answers.shape, (17, 33))
            self.assertEqual(bits(answers), bits(scene.visibility(GROUND)))
            for part in (image[2:9, 4:20], image[::2], image[:, ::3], image.transpose(1, 0, 2)):
                self.assertEqual(bits(scene.visibility(part)),
                                 bits(scene.visibility(numpy.ascontiguousarray(part))))
            with self.assertRaisesRegex(softshadow.ArgumentError, "width"):
                scene.visibility(image, width=16)

    def test_other_inputs(self):
        """Normals, ids, primitives in other kinds than the library's give the same answers."""
        with lit_scene(softshadow, "raytrace") as scene:
            n = len(GROUND)
            tilted = [(0.5, 0, 1)] * n
            flat = [c for normal in tilted for c in normal]
            wanted = bits(scene.visibility(GROUND, normals=tilted))
            kinds = [array("f", flat), array("d", flat), array("f", flat).tobytes()]
            if package.WITH_NUMPY:
                kinds += [numpy.array(tilted), numpy.array(tilted, "f4"),
                          numpy.broadcast_to(numpy.float32([0.5, 0, 1]), (n, 3))]
            for normals in kinds:
                self.assertEqual(bits(scene.visibility(GROUND, normals=normals)), wanted)
            none = softshadow.NO_PRIMITIVE
            wanted = bits(scene.visibility(GROUND))
            kinds = [[none] * n, array("Q", [none] * n), array("q", [-1] * n)]
            if package.WITH_NUMPY:
                kinds += [numpy.full(n, none, "u8"), numpy.full(n, -1, "i8"),
                          numpy.full(2 * n, none, "u8")[::2]]
            for primitives in kinds:
                self.assertEqual(bits(scene.visibility(GROUND, primitives=primitives)), wanted)
            for ids in ([7] * n, array("I", [7] * n), array("q", [7] * n), array("B", [7] * n)):
                self.assertEqual(bits(scene.visibility(GROUND, ids=ids)), wanted)
            mixed = [none, 0] + [none] * (n - 2)  # numpy makes doubles of such a list
            scene.visibility(GROUND[:2], primitives=mixed[:2])


    @unittest.skipUnless(package.WITH_NUMPY, "is of numpy")
    def test_fields_of_one_record(self):
        """All of a record's fields are read where they lie; the other fields are noise."""
        made = numpy.zeros(len(GROUND), dtype=[("p", "f4", 3), ("noise", "f4"), ("n", "f4", 3)])
        made["p"], made["noise"] = GROUND, 99
        made["n"] = [(x - 1, 0, 1 + y) for x, y, _ in GROUND]
        with lit_scene(softshadow, "raytrace") as scene:
            wanted = bits(scene.visibility(GROUND, normals=made["n"].copy()))
            self.assertNotEqual(wanted, bits(scene.visibility(GROUND)))
            self.assertEqual(bits(scene.visibility(made["p"], normals=made["n"])), wanted)
        corners = numpy.full((4, 8), 99, dtype=numpy.float32)
        corners[:, 1:4], corners[:, 5:7] = SQUARE, [(0, 0), (1, 0), (1, 1), (0, 1)]
        for borrow in (False, True):
            with softshadow.Scene() as scene:
                scene.add_mesh(corners[:, 1:4], FACES, uvs=corners[:, 5:7], borrow=borrow,
                               opacity=numpy.array([[255, 0]], dtype=numpy.uint8))
                scene.set_light(softshadow.Sphere((0, 0, 4), 0.01))
                scene.build()
                self.assertEqual(scene.mesh_info(0).bounds, (-.5, -.5, 1, .5, .5, 1))
                self.assertEqual(list(scene.visibility([(-.3, 0, 0), (.3, 0, 0)])), [0, 1])


class Indices(unittest.TestCase):
    def test_kinds(self):
        flat = [i for face in FACES for i in face]
        same = [array("I", flat), array("i", flat), array("I", flat).tobytes(),
                (ctypes.c_uint32 * 3 * 2)(*FACES)]
        converted = [array("q", flat), array("H", flat), array("b", flat), FACES, flat]
        if package.WITH_NUMPY:
            same += [numpy.array(FACES, "u4"), numpy.array(FACES, "i4")]
            converted += [numpy.array(FACES), numpy.array(FACES, "u4")[::-1],
                          numpy.asfortranarray(numpy.array(FACES, "i4"))]
        for copied, kinds in ((False, same), (True, converted)):
            for value in kinds:
                self.assertEqual(_buffers.hold(value, **INDICES).copied, copied, value)
                with softshadow.Scene() as scene:
                    report = scene.mesh_info(scene.add_mesh(SQUARE, value))
                    self.assertEqual((report.triangles, report.boundary_edges), (2, 4))

    def test_refused(self):
        bad = [[(0, 1, -2)], [(0, 1, 2**32)], [(0, 1, 1.5)], array("f", [0, 1, 2]), ["abc"],
               array("q", [0, 1, -1])]
        if package.WITH_NUMPY:
            bad += [numpy.array([[0, 1, 2]], "f4"), numpy.array([[0, 1, -1]]),
                    numpy.array([[0, 1, None]])]
        with softshadow.Scene() as scene:
            for value in bad:
                with self.subTest(value), self.assertRaisesRegex(ValueError, "^indices: "):
                    scene.add_mesh(SQUARE, value)
            with self.assertRaisesRegex(softshadow.MeshError, "triangle 0 names vertex"):
                scene.add_mesh(SQUARE, array("i", [0, 1, -1]))


class Shapes(unittest.TestCase):
    def wrong(self, pattern, call, *arguments, **named):
        with self.subTest(pattern), self.assertRaisesRegex(ValueError, pattern) as caught:
            call(*arguments, **named)
        self.assertIsInstance(caught.exception, softshadow.ArgumentError)

    def test_points(self):
        with lit_scene(softshadow) as scene:
            ask = scene.visibility
            self.wrong(r"^points: shape \(4,\), must be \(N, 3\)", ask, array("f", [1, 2, 3, 4]))
            self.wrong(r"^points: shape \(2, 2\), must be \(N, 3\)", ask, [(0, 0), (1, 1)])
            self.wrong(r"^points: 13 bytes, must be a multiple of 12", ask, b"x" * 13)
            self.wrong("^points: ", ask, [(0, 0, 0), (1, 1)])
            self.wrong("^points: ", ask, "abc")
            self.wrong("^points: ", ask, None)
            self.wrong("^points: ", ask, [("a", "b", "c")])
            self.wrong(r"^normals: shape \(1, 3\), there are 1 of them for 2 points", ask,
                       [(0, 0, 0)] * 2, normals=[(0, 0, 1)])
            self.wrong(r"^primitives: shape \(3,\), there are 3 of them for 2 points", ask,
                       [(0, 0, 0)] * 2, primitives=[0, 0, 0])
            self.wrong(r"^ids: ", ask, [(0, 0, 0)], ids=[-1])
            self.wrong(r"^ids: ", ask, [(0, 0, 0)], ids=[0.5])
            self.wrong(r"^light: -1, must be 0..", ask, [(0, 0, 0)], light=-1)
            self.wrong(r"^width: 'a', must be", ask, [(0, 0, 0)], width="a")
            if package.WITH_NUMPY:
                self.wrong(r"^points: shape \(5, 2\), must be \(N, 3\)", ask, numpy.zeros((5, 2)))
                self.wrong(r"^points: shape \(3, 5\), must be \(N, 3\)", ask, numpy.zeros((3, 5)))
                self.wrong(r"^points: elements are complex128", ask, numpy.zeros((5, 3), complex))

    def test_meshes(self):
        with softshadow.Scene() as scene:
            add = scene.add_mesh
            self.wrong(r"^positions: shape \(4, 2\)", add, [(0, 0)] * 4, FACES)
            self.wrong(r"^indices: shape \(2, 4\)", add, SQUARE, [(0, 1, 2, 3)] * 2)
            self.wrong(r"^transform: shape \(2, 3\), must be 12 or 16", add, SQUARE, FACES,
                       transform=[(1, 0, 0)] * 2)
            self.wrong("^transform: the last row", add, SQUARE, FACES, transform=[1] * 16)
            self.wrong("^uvs: 3 of them for 4", add, SQUARE, FACES, uvs=[(0, 0)] * 3)
            self.wrong(r"^opacity: shape \(4,\)", add, SQUARE, FACES, uvs=[(0, 0)] * 4,
                       opacity=bytes(4))
            self.wrong("^opacity: needs uvs", add, SQUARE, FACES, opacity=[[1, 2]])
            self.wrong("^casts, receives", add, SQUARE, FACES, casts=False, receives=False)

    def test_lights(self):
        with softshadow.Scene() as scene:
            self.wrong(r"^light.position: shape \(2,\), must be 3 numbers", scene.set_light,
                       softshadow.Sphere((0, 0), 1))
            self.wrong("^light.radius: 'a'", scene.set_light, softshadow.Sphere((0, 0, 0), "a"))
            self.wrong("^light: 5, must be", scene.add_light, 5)


class Results(unittest.TestCase):
    def test_type(self):
        with lit_scene(softshadow) as scene:
            answers, bound = scene.visibility(GROUND, error_bound=True)
            for made in (answers, bound):
                if package.WITH_NUMPY:
                    self.assertEqual((made.dtype, made.shape), (numpy.float32, (len(GROUND),)))
                else:
                    self.assertIsInstance(made, array)
                    self.assertEqual((made.typecode, len(made)), ("f", len(GROUND)))

    def test_out(self):
        with lit_scene(softshadow, "raytrace") as scene:
            wanted, n = bits(scene.visibility(GROUND)), len(GROUND)
            outs = [array("f", bytes(4 * n)), (ctypes.c_float * n)()]
            if package.WITH_NUMPY:
                outs += [numpy.empty(n, "f4"), numpy.empty((17, 33), "f4")]
            for out in outs:
                self.assertIs(scene.visibility(GROUND, out=out), out)
                self.assertEqual(bits(out), wanted)
            for out in (array("f", [0]), array("d", bytes(8 * n)), bytes(4 * n), [0.0] * n,
                        memoryview(array("f", bytes(8 * n)))[::2]):
                with self.assertRaisesRegex(softshadow.ArgumentError, "^out: "):
                    scene.visibility(GROUND, out=out)
            both = array("f", FLAT)
            with self.assertRaisesRegex(softshadow.ArgumentError, "^out: overlaps"):
                scene.visibility(both, out=memoryview(both)[n:2 * n])

    def test_out_is_nan_after_an_error(self):
        with lit_scene(softshadow, build=False) as scene:
            out = array("f", [5, 5])
            with self.assertRaises(softshadow.StateError):
                scene.visibility([(0, 0, 0)] * 2, out=out)
            self.assertTrue(all(value != value for value in out))


if __name__ == "__main__":
    package.main()
