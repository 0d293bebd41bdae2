#!/usr/bin/env python3
"""Scenes come and go; the library is found, or its absence is told."""
import gc
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
import weakref
from array import array

import package
import softshadow
from package import FACES, GROUND, SQUARE, bits, child, lit_scene

ASK = """
import softshadow
with softshadow.Scene() as scene:
    scene.set_light(softshadow.Sphere((0, 0, 4), 0.5))
    scene.build()
    print(softshadow.version(), list(scene.visibility([(0, 0, 0)])))
"""
ANSWER = "%s [1.0]\n" % softshadow.version()


class Life(unittest.TestCase):
    def test_use_after_close(self):
        with lit_scene(softshadow) as scene:
            self.assertFalse(scene.closed)
        self.assertTrue(scene.closed)
        scene.close()
        calls = [scene.build, scene.stats, scene.maps, lambda: scene.add_mesh(SQUARE, FACES),
                 lambda: scene.update_mesh(0, SQUARE, FACES), lambda: scene.remove_mesh(0),
                 lambda: scene.set_light(softshadow.Sphere((0, 0, 1), 1)),
                 lambda: scene.add_light(softshadow.Sphere((0, 0, 1), 1)),
                 lambda: scene.visibility(GROUND), lambda: scene.measure_error(GROUND),
                 lambda: scene.mesh_info(0), lambda: scene.explain((0, 0, 0))]
        public = [name for name, thing in vars(softshadow.Scene).items()
                  if callable(thing) and not name.startswith("_")]
        self.assertEqual(len(calls) + 1, len(public))  # close() itself
        for call in calls:
            with self.assertRaisesRegex(softshadow.StateError, "closed"):
                call()

    def test_closed_after_an_exception(self):
        with self.assertRaises(KeyError):
            with lit_scene(softshadow) as scene:
                raise KeyError
        self.assertTrue(scene.closed)

    def test_goes_at_once(self):
        """No cycle keeps a scene, callbacks included: the handle goes with the last reference."""
        gc.disable()
        try:
            destroyed = []
            for callbacks in ({}, {"log": print, "progress": lambda done: None,
                                   "parallel": lambda count, run: run(0, count)}):
                scene = lit_scene(softshadow, **callbacks)
                close, gone = scene._close, weakref.ref(scene)
                del scene
                self.assertIsNone(gone())
                self.assertFalse(close.alive)
                destroyed.append(close)
            self.assertEqual(len(destroyed), 2)
        finally:
            gc.enable()

    def test_many(self):
        """Memory of scenes that nobody closes comes back."""
        def resident():
            with open("/proc/self/statm") as file:
                return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
        vertices = array("f", bytes(12 * 300000))  # 3.6 MB

        def make():
            softshadow.Scene().add_mesh(vertices, FACES)
        for _ in range(5):
            make()
        before = resident()
        for _ in range(60):
            make()
        # 216 MB were copied; a sanitizer keeps freed memory aside for a while.
        self.assertLess(resident() - before, (250 if package.SANITIZERS else 50) << 20)

    def test_borrow(self):
        """Borrowed arrays are kept while they are needed, and no longer; array.array is locked."""
        vertices = array("f", [c for v in SQUARE for c in v])
        with softshadow.Scene() as scene:
            scene.set_light(softshadow.Sphere((0, 0, 4), 0.5))
            lent = scene.add_mesh(vertices, FACES, borrow=True)
            copied = scene.add_mesh(array("f", vertices), FACES)
            with self.assertRaises(BufferError):
                vertices.append(0)
            gc.collect()
            scene.build()
            self.assertEqual(scene.visibility([(0, 0, 0)])[0], 0)
            for index in range(2, 12, 3):
                vertices[index] = 2  # allowed between calls only with an update
            scene.update_mesh(lent, vertices, FACES, borrow=True)
            scene.update_mesh(copied, vertices, FACES)
            self.assertEqual(scene.mesh_info(lent).bounds[2], 2)
            scene.remove_mesh(lent)
            vertices.append(0)
            vertices.pop()
            scene.add_mesh(vertices, FACES, borrow=True)
        vertices.append(0)

    @unittest.skipIf(package.SANITIZERS, "another thread may hold its allocator at fork")
    def test_fork(self):
        """A child's use of the parent's scene is refused; its end does no harm."""
        scene = lit_scene(softshadow)
        wanted = bits(scene.visibility(GROUND))
        sys.stdout.flush()
        pid = os.fork()
        if pid == 0:
            status = 1
            try:
                scene.visibility(GROUND)
            except softshadow.StateError as error:
                status = 0 if "fork" in str(error) else 2
            finally:
                scene.close()
                os._exit(status)
        self.assertEqual(os.waitpid(pid, 0)[1], 0)
        self.assertEqual(bits(scene.visibility(GROUND)), wanted)

    @unittest.skipIf(package.SANITIZERS, "it does not know of threads that Python ends by force")
    def test_end_of_the_interpreter(self):
        """Scenes that are still there, and a thread still asking, do not disturb the end."""
        code = ASK + """
import threading
left = softshadow.Scene(progress=lambda done: None)
left.add_mesh([(-9, -9, 1), (9, -9, 1), (0, 9, 1)], [(0, 1, 2)])
left.set_light(softshadow.Sphere((0, 0, 4), 0.5))
left.build("raytrace", samples=4096)
def work():
    while True:
        left.visibility([(i / 100.0, 9, 0) for i in range(1000)])
threading.Thread(target=work, daemon=True).start()
"""
        status, out, err = child(code, SOFTSHADOW_LIBRARY=package.LIBRARY)
        self.assertEqual((status, out, err), (0, ANSWER, ""))


class Finding(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)

    def refused(self, pattern, **environment):
        status, out, err = child("import softshadow", **environment)
        self.assertEqual((status, out), (1, ""))
        self.assertRegex(err.splitlines()[-1], "^ImportError: softshadow: .*" + pattern)

    def compiled(self, source):
        path = os.path.join(self.folder, "libsoftshadow.so.1")
        with open(path + ".c", "w") as file:
            file.write(source)
        environment = {k: v for k, v in os.environ.items() if k != "LD_PRELOAD"}
        subprocess.run(package.CC + ["-shared", "-fPIC", "-o", path, path + ".c"], check=True,
                       env=environment)
        return path

    def test_variable(self):
        status, out, err = child(ASK, SOFTSHADOW_LIBRARY=package.LIBRARY)
        self.assertEqual((status, out, err), (0, ANSWER, ""))

    def test_variable_decides(self):
        """A library that was asked for is not replaced by another in silence."""
        self.refused(r"/none/lib.so.*SOFTSHADOW_LIBRARY", SOFTSHADOW_LIBRARY="/none/lib.so",
                     LD_LIBRARY_PATH=os.path.dirname(package.LIBRARY))

    def test_search_path(self):
        status, out, err = child(ASK, LD_LIBRARY_PATH=os.path.dirname(package.LIBRARY))
        self.assertEqual((status, out, err), (0, ANSWER, ""))

    def test_installed_place(self):
        """What make install writes comes before the search path."""
        shutil.copytree(os.path.join(package.PACKAGE, "softshadow"),
                        os.path.join(self.folder, "softshadow"))
        place = os.path.join(self.folder, "softshadow", "_installed.py")
        for libdir, status in ((os.path.dirname(package.LIBRARY), 0), ("/none", 1)):
            with open(place, "w") as file:
                file.write("LIBDIR = %r\n" % libdir)
            got = child(ASK, PYTHONPATH=self.folder)
            if status == 0:
                self.assertEqual(got, (0, ANSWER, ""))
            elif got[0]:  # unless the system has one
                self.assertRegex(got[2], "/none/libsoftshadow.so.1 .where it was installed.*search")

    def test_other_versions(self):
        other = self.compiled("unsigned softshadow_version(void) { return 20103; }\n")
        self.refused(r"it is version 2\.1, this package needs 1\.x", SOFTSHADOW_LIBRARY=other)

    def test_no_such_library(self):
        self.refused("it is no softshadow library",
                     SOFTSHADOW_LIBRARY=self.compiled("int other;\n"))
        bare = self.compiled("unsigned softshadow_version(void) { return 10000; }\n")
        self.refused("softshadow_version_string", SOFTSHADOW_LIBRARY=bare)
        text = os.path.join(self.folder, "text.so")
        with open(text, "w") as file:
            file.write("no library")
        self.refused("text.so", SOFTSHADOW_LIBRARY=text)


if __name__ == "__main__":
    package.main()
