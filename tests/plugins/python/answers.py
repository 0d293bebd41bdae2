#!/usr/bin/env python3
"""What the package answers: closed forms, the library's own words, every call."""
import json
import math
import os
import re
import subprocess
import threading
import unittest
from array import array

import package
import softshadow
from package import FACES, GROUND, SQUARE, bits, lit_scene

CUBE = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
SIDES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
         (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]


class ClosedForm(unittest.TestCase):
    """A half-plane at z = 2 hides x < 0 of a disk of radius 1/2 at z = 4. From (x, 0, 0) its edge
    is seen at -x on the light: the part of the disk beyond it is visible."""

    def setUp(self):
        far = 1000.0
        self.scene = softshadow.Scene()
        self.addCleanup(self.scene.close)
        self.scene.add_mesh([(-far, -far, 2), (0, -far, 2), (0, far, 2), (-far, far, 2)], FACES)
        self.scene.set_light(softshadow.Disk((0, 0, 4), (0, 0, -1), 0.5))
        self.x = [i / 64 for i in range(-40, 41)]
        self.truth = [package.disk_cut(x / 0.5) for x in self.x]

    def test_auto(self):
        for tolerance in (1 / 256, 1 / 64):
            self.scene.build(tolerance=tolerance)
            answers = self.scene.visibility([(x, 0, 0) for x in self.x])
            inside = [(a - t) ** 2 for a, t in zip(answers, self.truth) if 0 < t < 1]
            # tolerance is the RMS wanted; that of 63 points lies within 1.5 times (4 sigma of it).
            self.assertEqual(len(inside), 63)
            self.assertLess(math.sqrt(sum(inside) / len(inside)), 1.5 * tolerance)
            for answer, truth in zip(answers, self.truth):
                if truth in (0, 1):
                    self.assertEqual(answer, truth)

    def test_bound(self):
        self.scene.build("raytrace", samples=256)
        answers, bound = self.scene.visibility([(x, 0, 0) for x in self.x], error_bound=True)
        outside = sum(abs(a - t) > b + 1e-6 for a, t, b in zip(answers, self.truth, bound))
        self.assertLessEqual(outside, 1)  # it is left at one point in a thousand
        self.assertLess(max(bound), 0.2)

    def test_every_method(self):
        """What is handed over is the same for all methods; how near each comes is its own."""
        for method in softshadow.methods():
            if "disk" not in method.lights_native:
                continue
            self.scene.build(method.name, bounds=[-1, -1, -1, 1, 1, 1])
            answers = self.scene.visibility([(-0.9, 0, 0), (0.9, 0, 0)])
            self.assertEqual(list(answers), [0, 1], method.name)
            used = self.scene.stats().method_used
            if method.name != "auto":  # that names what it chose
                self.assertEqual(used, method.name)


class Answers(unittest.TestCase):
    def test_lights(self):
        lights = [softshadow.Sphere((0, 0, 4), 0.5), softshadow.Sphere((0, 0, 4), 0),
                  softshadow.Disk((0, 0, 4), (0, 0, -1), 0.5),
                  softshadow.Ellipse((0, 0, 4), (0.5, 0, 0), (0, -0.5, 0)),
                  softshadow.Rect((0, 0, 4), (0.5, 0, 0), (0, 0.5, 0)),
                  softshadow.Sun((0, 0, -1), 0.1),
                  softshadow.Sun((0, 0, -2), angle=0.1, profile=[1, 0.5, 0])]
        with softshadow.Scene() as scene:
            scene.add_mesh(SQUARE, FACES)
            scene.set_light(lights[0])
            self.assertEqual([scene.add_light(light) for light in lights[1:]],
                             list(range(1, len(lights))))
            scene.build()
            for light in range(len(lights)):
                answers = scene.visibility([(0, 0, 0), (3, 0, 0)], light=light)
                self.assertEqual(list(answers), [0, 1])
            scene.set_light(lights[4])
            scene.build()
            with self.assertRaisesRegex(softshadow.ArgumentError, "light: 1"):
                scene.visibility([(0, 0, 0)], light=1)

    def test_profile_counts(self):
        """All the light in the rim of a disk whose left half is hidden but for its middle strip."""
        def ask(profile):
            with softshadow.Scene() as scene:
                scene.add_mesh([(-9, -9, 2), (0, -9, 2), (0, 9, 2), (-9, 9, 2)], FACES)
                scene.set_light(softshadow.Disk((0, 0, 4), (0, 0, 1), 0.5, profile))
                scene.build("raytrace", samples=4096)
                return scene.visibility([(0.125, 0, 0)])[0]
        # The point sees the disk's x > -1/8 (a quarter radius): of the core more than of the rim.
        self.assertGreater(ask([1, 0, 0, 0, 0]), ask(None) + 0.02)
        self.assertLess(ask([0, 0, 0, 0, 1]), ask(None) - 0.02)

    def test_build_options_arrive(self):
        with lit_scene(softshadow) as scene:
            normals = [(0, 0, 1)] * len(GROUND)
            uniform = scene.visibility(GROUND, normals=normals)
            scene.build(weighting="irradiance")
            self.assertNotEqual(bits(scene.visibility(GROUND, normals=normals)), bits(uniform))
            with self.assertRaisesRegex(softshadow.ArgumentError, "normals"):
                scene.visibility(GROUND)
            scene.build("raytrace", samples=64)
            rays = scene.visibility(GROUND) is not None and scene.stats().rays
            scene.build("raytrace", samples=256)
            scene.visibility(GROUND)
            self.assertGreater(scene.stats().rays, 2 * rays)
            scene.build(bounds=[(-1, -1, -1), (1, 1, 1)])
            outside = scene.visibility([(0, 0, 0), (2, 0, 0)])
            self.assertEqual([math.isnan(answer) for answer in outside], [False, True])

    def test_normals_and_primitives(self):
        with lit_scene(softshadow) as scene:
            points = [(0.25, 0, 1)] * 3  # on the square, lit from above
            up, down = (0, 0, 1), (0, 0, -1)
            self.assertEqual(list(scene.visibility(points, normals=[up, down, up])), [1, 0, 1])
            on = softshadow.primitive(0, 0)
            named = scene.visibility(points, primitives=[on, softshadow.NO_PRIMITIVE, on])
            self.assertEqual(named[0], 1)
            self.assertEqual(softshadow.primitive(3, 5), (3 << 32) | 5)

    def test_bad_points_are_nan(self):
        with lit_scene(softshadow) as scene:
            nan, inf = float("nan"), float("inf")
            answers = scene.visibility([(nan, 0, 0), (0, 0, 0), (0, inf, 0), (0, 0, 1e16)])
            self.assertEqual([math.isnan(answer) for answer in answers], [True, False, True, True])
            self.assertEqual(scene.stats().points_bad, 3)

    def test_meshes_come_and_go(self):
        with lit_scene(softshadow) as scene:
            def middle():
                scene.build()
                return scene.visibility([(0, 0, 0)])[0]
            self.assertEqual(middle(), 0)
            aside = [1, 0, 0, 9, 0, 1, 0, 0, 0, 0, 1, 0]
            scene.update_mesh(0, SQUARE, FACES, transform=aside)
            self.assertEqual(scene.mesh_info(0).bounds, (8.5, -.5, 1, 9.5, .5, 1))
            with self.assertRaises(softshadow.StateError):
                scene.visibility([(0, 0, 0)])
            self.assertEqual(middle(), 1)
            scene.update_mesh(0, SQUARE, FACES, transform=[aside[0:4], aside[4:8], aside[8:],
                                                           (0, 0, 0, 1)])
            self.assertEqual(middle(), 1)
            self.assertEqual(scene.add_mesh(SQUARE, FACES), 1)
            self.assertEqual(middle(), 0)
            scene.remove_mesh(1)
            self.assertEqual(middle(), 1)
            scene.update_mesh(0, SQUARE, FACES, casts=False)
            self.assertEqual(middle(), 1)
            scene.update_mesh(0, SQUARE, FACES, receives=False)
            self.assertEqual(middle(), 0)

    def test_opacity(self):
        uvs = [(0, 0), (1, 0), (1, 1), (0, 1)]
        texels = memoryview(bytes([255, 100])).cast("B", (1, 2))  # u < 1/2 casts, the rest does not
        for threshold, right in ((0.5, 1), (0.3, 0)):
            with softshadow.Scene() as scene:
                scene.add_mesh(SQUARE, FACES, uvs=uvs, opacity=texels, opacity_threshold=threshold)
                scene.set_light(softshadow.Sphere((0, 0, 4), 0.01))
                scene.build()
                self.assertEqual(list(scene.visibility([(-.3, 0, 0), (.3, 0, 0)])), [0, right])

    def test_stats(self):
        with lit_scene(softshadow, "raytrace") as scene:
            scene.visibility(GROUND)
            stats = scene.stats()
            self.assertEqual((stats.points, stats.points_bad, stats.triangles), (len(GROUND), 0, 2))
            self.assertEqual(stats.points_lit + stats.points_umbra + stats.points_penumbra,
                             stats.points)
            self.assertTrue(stats.points_penumbra and stats.rays and stats.peak_bytes)
            self.assertGreater(stats.query_seconds, 0)
            self.assertEqual((stats.method_used, stats.backend_used), ("raytrace", "cpu"))
            with self.assertRaises(AttributeError):
                stats.points = 0

    def test_measure_error(self):
        with lit_scene(softshadow) as scene:
            report = scene.measure_error(GROUND, max_points=200, samples=1024)
            self.assertTrue(0 < report.points <= 200)
            # All points, most of them not in penumbra: below what is promised for penumbra alone.
            self.assertTrue(0 < report.rms < 1 / 256)
            self.assertTrue(report.rms <= report.max and 0 < report.reference_error < 0.01)

    def test_explain(self):
        with lit_scene(softshadow) as scene:
            point, size = (0.6, 0, 0), 32
            view = scene.explain(point, size=size)
            image, hiders = list(memoryview(view.image).cast("B").cast("f")), list(
                memoryview(view.hiders).cast("B").cast("Q"))
            self.assertEqual((len(image), len(hiders)), (size * size, size * size))
            on = [value for value in image if not math.isnan(value)]
            self.assertEqual(set(on), {0.0, 1.0})
            # A disk fills pi/4 of its square, up to the pixels of its rim.
            self.assertLess(abs(len(on) / size ** 2 - math.pi / 4), 4 / size)
            self.assertLess(abs(sum(on) / len(on) - view.visibility), 1e-6)
            asked = scene.visibility([point])[0]
            self.assertLess(abs(asked - view.visibility), 1 / size + 3 / 256)
            named = {hider for hider in hiders if hider != softshadow.NO_PRIMITIVE}
            self.assertEqual(named, {softshadow.primitive(0, i) for i in range(2)} & named)
            self.assertEqual(len(named), view.triangles)
            self.assertEqual([value == 0 for value in image],
                             [hider != softshadow.NO_PRIMITIVE for hider in hiders])
            self.assertEqual(view.centre, (0, 0, 4))
            if package.WITH_NUMPY:
                self.assertEqual((view.image.shape, view.hiders.shape), ((size, size),) * 2)
            below = scene.explain(point, normal=(0, 0, -1), size=8)
            self.assertEqual(below.visibility, 0)
            named = scene.explain((0.25, 0, 1), primitive=softshadow.primitive(0, 0), size=8)
            self.assertEqual(named.visibility, 1)

    def test_mesh_info(self):
        with softshadow.Scene() as scene:
            report = scene.mesh_info(scene.add_mesh(CUBE, SIDES))
            self.assertEqual((report.vertices, report.positions, report.triangles, report.edges),
                             (8, 8, 12, 18))
            self.assertEqual((report.components, report.closed_components), (1, 1))
            self.assertEqual((report.boundary_edges, report.nonmanifold_edges,
                              report.nonmanifold_vertices, report.flipped_edges,
                              report.degenerate_triangles, report.duplicate_triangles), (0,) * 6)
            self.assertEqual(report.bounds, (0, 0, 0, 1, 1, 1))
            self.assertEqual(report.silhouette_edges, 0)
            scene.set_light(softshadow.Sphere((5, 0.5, 0.5), 0.1))
            self.assertEqual(scene.mesh_info(0).silhouette_edges, 4)

    def test_maps(self):
        seen = 0
        for method in softshadow.methods():
            if "sphere" not in method.lights_native + method.lights_approximated:
                continue
            with lit_scene(softshadow, build=False) as scene:
                scene.build(method.name, resolution=64, bounds=[-1, -1, 0, 1, 1, 0.5])
                for plane in scene.maps():
                    seen += 1
                    count = plane.width * plane.height * plane.channels
                    self.assertEqual(len(bits(plane.pixels)), 4 * count, plane.name)
                    self.assertEqual(len(plane.matrix), 16)
                    # The square at z = 1 is what the texel in the middle holds.
                    held = array("f", bits(plane.pixels))[(32 * 64 + 32) * plane.channels]
                    z, w = (plane.matrix[4 * r + 2] + plane.matrix[4 * r + 3] for r in (2, 3))
                    if plane.name == "depth" and plane.width == 64:
                        self.assertAlmostEqual(plane.depth[0] + plane.depth[1] * z / w, held, 1)
                    self.assertGreater(plane.unit, 0)
                    self.assertEqual(len(plane.origin), 3)
                    self.assertTrue(plane.name and count)
                maps = scene.maps()
                before = [bits(plane.pixels) for plane in maps]
            # They are copies: still there after close().
            self.assertEqual([bits(plane.pixels) for plane in maps], before)
        print("%d planes of maps were seen" % seen)

    def test_two_scenes(self):
        with lit_scene(softshadow) as one, lit_scene(softshadow) as two:
            before = bits(one.visibility(GROUND))
            two.remove_mesh(0)
            two.build()
            self.assertEqual(set(two.visibility(GROUND)), {1})
            self.assertEqual(bits(one.visibility(GROUND)), before)

    def test_threads(self):
        with lit_scene(softshadow, "raytrace", threads=2) as scene:
            wanted, got = bits(scene.visibility(GROUND)), []

            def ask():
                for _ in range(10):
                    got.append(bits(scene.visibility(GROUND)))
            threads = [threading.Thread(target=ask) for _ in range(4)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            self.assertEqual(len(got), 40)
            self.assertEqual(set(got), {wanted})
            self.assertEqual(scene.stats().points, 41 * len(GROUND))


class Names(unittest.TestCase):
    def test_methods_are_the_command_lines(self):
        environment = {k: v for k, v in os.environ.items() if k != "LD_PRELOAD"}
        out = subprocess.run([os.path.join(package.BUILD, "softshadow"), "methods", "--json"],
                             stdout=subprocess.PIPE, check=True, env=environment).stdout
        ours = [{"name": m.name, "title": m.title, "lights_native": list(m.lights_native),
                 "lights_approximated": list(m.lights_approximated), "bound": m.bound,
                 "citation": m.citation, "notes": m.notes, "backends": list(m.backends)}
                for m in softshadow.methods()]
        self.assertEqual(ours, json.loads(out.decode()))

    def test_version(self):
        with open(os.path.join(package.SOURCE, "lib", "softshadow.h")) as file:
            header = file.read()
        numbers = re.findall(r"#define SOFTSHADOW_VERSION_[A-Z]+ (\d+)", header)
        self.assertEqual(softshadow.version(), ".".join(numbers))
        self.assertEqual(softshadow.version_info(), tuple(map(int, numbers)))

    def test_everything_public_is_documented(self):
        for name in softshadow.__all__:
            thing = getattr(softshadow, name)
            if name not in ("NO_PRIMITIVE", "Light"):
                self.assertTrue(thing.__doc__, name)
                self.assertFalse(thing.__doc__.startswith(name + "("), name)  # dataclass's own
        for name, thing in vars(softshadow.Scene).items():
            if callable(thing) and not name.startswith("_"):
                self.assertTrue(thing.__doc__, name)


if __name__ == "__main__":
    package.main()
