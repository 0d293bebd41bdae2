#!/usr/bin/env python3
"""Every status comes out as its exception, with the library's message."""
import os
import re
import tempfile
import unittest

import package
import softshadow
from package import FACES, GROUND, SQUARE, child, lit_scene

STATUS = {"ArgumentError": (-1, ValueError), "StateError": (-2, RuntimeError),
          "MeshError": (-3, ValueError), "LightError": (-4, ValueError),
          "OutOfMemoryError": (-5, MemoryError), "UnsupportedError": (-6, NotImplementedError),
          "CancelledError": (-7, Exception), "BackendError": (-8, RuntimeError),
          "InternalError": (-9, RuntimeError)}


class Failures(unittest.TestCase):
    def refused(self, kind, pattern, call, *arguments, **named):
        with self.assertRaisesRegex(kind, pattern) as caught:
            call(*arguments, **named)
        error = caught.exception
        self.assertIs(type(error), kind)
        self.assertEqual((error.status, type(error).name), (STATUS[kind.__name__][0], error.name))

    def test_classes(self):
        for name, (status, parent) in STATUS.items():
            kind = getattr(softshadow, name)
            self.assertTrue(issubclass(kind, softshadow.Error) and issubclass(kind, parent))
            self.assertEqual(kind.status, status)
            self.assertTrue(kind.name.startswith("SOFTSHADOW_E_"))
        self.assertEqual(len({getattr(softshadow, name).name for name in STATUS}), 9)

    def test_argument(self):
        with lit_scene(softshadow) as scene:
            for name in ("update_mesh", "remove_mesh", "mesh_info"):
                more = (SQUARE, FACES) if name == "update_mesh" else ()
                self.refused(softshadow.ArgumentError, "7", getattr(scene, name), 7, *more)
            for size in (0, 4097):
                self.refused(softshadow.ArgumentError, "size: %d" % size, scene.explain, (0, 0, 0),
                             size=size)
            self.refused(softshadow.ArgumentError, "tolerance: -1", scene.build, tolerance=-1)
            self.refused(softshadow.ArgumentError, "^weighting: 'x', must be one of uniform, ",
                         scene.build, weighting="x")
            self.refused(softshadow.ArgumentError, "^backend: 'gpu'", scene.build, backend="gpu")
            self.refused(softshadow.ArgumentError, "samples: -1", scene.build, samples=-1)
            self.refused(softshadow.ArgumentError, "samples: 4294967295", scene.build,
                         samples=2**32 - 1)
            self.refused(softshadow.ArgumentError, "^bounds: ", scene.build, bounds=[0, 1])
        self.refused(softshadow.ArgumentError, "threads: -1", softshadow.Scene, threads=-1)
        self.refused(softshadow.ArgumentError, "transform", softshadow.Scene().add_mesh, SQUARE,
                     FACES, transform=[float("nan")] * 12)

    def test_state(self):
        with softshadow.Scene() as scene:
            self.refused(softshadow.StateError, "light", scene.build)
            scene.set_light(softshadow.Sphere((0, 0, 4), 0.5))
            for call in (scene.maps, lambda: scene.visibility(GROUND),
                         lambda: scene.measure_error(GROUND), lambda: scene.explain((0, 0, 0))):
                self.refused(softshadow.StateError, "nothing is built", call)

    def test_mesh(self):
        with softshadow.Scene() as scene:
            self.refused(softshadow.MeshError, "triangle 1 names vertex 9, must be below 4",
                         scene.add_mesh, SQUARE, [(0, 1, 2), (0, 1, 9)])
            self.refused(softshadow.MeshError, "vertex 2 is", scene.add_mesh,
                         SQUARE[:2] + [(0, float("nan"), 0)] + SQUARE[3:], FACES)
            self.assertEqual(scene.add_mesh(SQUARE, FACES), 0)
            self.refused(softshadow.MeshError, "vertex 3", scene.update_mesh, 0,
                         SQUARE[:3] + [(0, 1e16, 0)], FACES)
            self.assertEqual(scene.mesh_info(0).triangles, 2)

    def test_light(self):
        with softshadow.Scene() as scene:
            for light in (softshadow.Sphere((0, 0, 0), -1),
                          softshadow.Disk((0, 0, 0), (0, 0, 0), 1),
                          softshadow.Rect((0, 0, 0), (1, 0, 0), (1, 1, 0)),
                          softshadow.Sun((0, 0, 1), 1.5),
                          softshadow.Sphere((float("inf"), 0, 0), 1),
                          softshadow.Sphere((0, 0, 0), 1, profile=[0, 0])):
                self.refused(softshadow.LightError, "^light", scene.set_light, light)

    def test_unsupported(self):
        with lit_scene(softshadow, build=False) as scene:
            self.refused(softshadow.UnsupportedError, 'method: "no-such", this library has auto',
                         scene.build, "no-such")

    def test_cancelled(self):
        with lit_scene(softshadow, build=False, progress=lambda done: True) as scene:
            self.refused(softshadow.CancelledError, "cancelled", scene.build)

    def test_internal(self):
        """A host's scheduler that does not do its work."""
        with lit_scene(softshadow, "raytrace", build=False, threads=4,
                       parallel=lambda count, run: None) as scene:
            self.refused(softshadow.InternalError, "parallel returned before",
                         lambda: (scene.build("raytrace"), scene.visibility(GROUND * 50)))

    @unittest.skipIf(package.SANITIZERS, "a sanitizer needs more address space than a limit allows")
    def test_memory(self):
        code = """
import resource, softshadow
from array import array
vertices = array("f", bytes(12 * 4000000))
with open("/proc/self/statm") as file:
    used = int(file.read().split()[0]) * resource.getpagesize()
with softshadow.Scene() as scene:
    resource.setrlimit(resource.RLIMIT_AS, (used + (16 << 20), resource.RLIM_INFINITY))
    try:
        scene.add_mesh(vertices, [(0, 1, 2)])
    except softshadow.OutOfMemoryError as error:
        print(error.name, error)
    print(scene.add_mesh([(0, 0, 0)] * 3, [(0, 1, 2)]))
"""
        status, out, err = child(code, SOFTSHADOW_LIBRARY=package.LIBRARY)
        self.assertEqual((status, err), (0, ""))
        self.assertEqual(
            out, "SOFTSHADOW_E_MEMORY mesh: out of memory copying 4000000 vertices\n0\n")

    def test_backend(self):
        """An Embree that is none stands before the real one."""
        code = """
import softshadow
with softshadow.Scene() as scene:
    scene.add_mesh([(0, 0, 1), (1, 0, 1), (0, 1, 1)], [(0, 1, 2)])
    scene.set_light(softshadow.Sphere((0, 0, 4), 0.5))
    try:
        scene.build("raytrace")
    except softshadow.BackendError as error:
        print(error.status, error)
"""
        with open(os.path.join(package.BUILD, "config.h")) as file:
            name = re.search('SS_EMBREE_LIBRARY "(.*)"', file.read()).group(1)
        if os.sep in name:
            self.skipTest("this build names Embree by its path")
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, name), "w") as file:
                file.write("no library\n")
            status, out, err = child(code, SOFTSHADOW_LIBRARY=package.LIBRARY,
                                     LD_LIBRARY_PATH=folder)
        self.assertEqual((status, err), (0, ""))
        self.assertRegex(out, r"^-8 Embree: .*install")

    def test_messages_are_of_the_thread(self):
        """Another handle's failure between does not change what is told."""
        with softshadow.Scene() as one, softshadow.Scene() as two:
            self.refused(softshadow.ArgumentError, "5", one.remove_mesh, 5)
            self.refused(softshadow.ArgumentError, "6", two.remove_mesh, 6)
            self.refused(softshadow.ArgumentError, "5", one.remove_mesh, 5)


if __name__ == "__main__":
    package.main()
